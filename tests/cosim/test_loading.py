"""Loading: files, threads, the working folder, FMUs that may be instantiated once."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import cosim
from cosim import flights
from cosim.cli.library import Library
from cosim.errors import FmuError, WiringErrors
from cosim.masters.explicit import Explicit
from cosim.system import Experiment, System
from fmus.description.errors import SimulationError

from . import both
from .c_fmu import build, integer, real
from .fakes import Clock
from .short_flight import short
from .typed_fmu import typed


class TestOncePerProcess:
    @pytest.fixture
    def once(self, tmp_path):
        """An FMU whose instances share a counter in its library, as canBeInstantiatedOnlyOncePerProcess says."""
        variables = [integer("total")]
        code = "static int shared; if (m->whole[0]) { shared++; m->whole[0] = 0; } total = shared;"
        return build(
            tmp_path, "Once", variables, outputs=code, step="m->whole[0] = 1; outputs(m);",
            canBeInstantiatedOnlyOncePerProcess=True, reset="return fmi2Error;",
        )  # fmt: skip

    def test_two_instances_do_not_meet(self, once):
        result = both.fly(both.of({"a": once, "b": once}, []), stop=0.5)
        assert result["a.total"].tolist() == result["b.total"].tolist() == [0, 1, 2, 3, 4, 5]

    def test_threads_do_not_meet(self, once):
        """Each flight that goes on at the same time has a library of its own, and counts its own steps."""
        together = threading.Barrier(3)

        def fly(_number):
            together.wait()
            return np.diff(prepared.fly(both.experiment(stop=2.0, step=0.01))["a.total"]).tolist()

        with flights.prepare(both.of({"a": once}, [])) as prepared, ThreadPoolExecutor(3) as pool:
            assert list(pool.map(fly, range(3))) == [[1] * 200] * 3


class TestLoading:
    def test_the_working_folder_never_changes(self, tmp_path):
        """fmpy's own loader goes to the FMU's folder and back, which every thread of the process sees."""
        paths = [build(tmp_path, f"Alone{i}", [real("y")], step="y = t;") for i in range(4)]
        here, seen, done = os.getcwd(), set(), threading.Event()

        def watch():
            while not done.is_set():
                seen.add(os.getcwd())

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            system, experiment = short()
            for _ in range(10):
                with flights.prepare(both.of({path.stem: path for path in paths}, [])) as prepared:
                    prepared.fly(both.experiment())
            with cosim.prepare(system, Library("python")) as prepared:
                prepared.fly(experiment)
        finally:
            done.set()
            watcher.join()
        assert seen == {here}

    def test_many_threads_that_load_the_same_files_at_once(self, tmp_path):
        path = typed(tmp_path)
        held = {"a.r_in": 1.0, "a.i_in": 1, "a.b_in": True, "a.e_in": 1, "a.s_in": "w"}
        together = threading.Barrier(6)

        def fly(_number):
            together.wait()
            return flights.simulate(both.of({"a": path}, [], held=held), both.experiment()).table

        with ThreadPoolExecutor(6) as pool:
            tables = list(pool.map(fly, range(6)))
        assert all(table.equals(tables[0]) for table in tables)

    def test_prepare_tells_mistakes_before_any_flight(self, tmp_path):
        with pytest.raises(FmuError, match="there is no such file"):
            flights.prepare(both.of({"a": tmp_path / "nothing.fmu"}, []))
        with pytest.raises(WiringErrors, match=r"a\.r_in is not connected"):
            flights.prepare(both.of({"a": typed(tmp_path)}, []))

    def test_given_instances_fly_one_flight_at_a_time(self):
        """A second flight at the same time would step the same instances: it is refused, not mixed in."""
        inside, go_on, results = threading.Event(), threading.Event(), []

        class Waiting(Clock):
            def advance(self, t, h, v, slopes):
                inside.set()
                assert go_on.wait(20)
                super().advance(t, h, v, slopes)

        system = System(name="t", components={"w": "fake"})
        setup = Experiment(stop_time=0.2, communication_step_size=0.1, master=Explicit(kernel="never"))
        with flights.prepare(system, slaves={"w": Waiting("w")}) as prepared:
            thread = threading.Thread(target=lambda: results.append(prepared.fly(setup)))
            thread.start()
            assert inside.wait(20)
            try:
                with pytest.raises(SimulationError, match=r"\(w\) fly one flight at a time"):
                    prepared.fly(setup)
            finally:
                go_on.set()
                thread.join()
        assert results[0]["w.y"].tolist() == [0.0, 0.1, 0.2]
