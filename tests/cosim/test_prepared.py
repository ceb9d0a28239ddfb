"""Prepare once, fly many times, from several threads: every flight as if it were the only one."""

import gc
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import cosim
from cosim import flights
from cosim.cli.library import Library
from cosim.errors import FmuError, InitializationFailed, StepFailed, UnknownName, WiringErrors
from cosim.masters.explicit import Explicit
from cosim.slaves.fmi2 import FmuSlave
from cosim.studies.papers import scenario
from cosim.system import Connection, Experiment, System
from fmus.description.errors import SimulationError

from . import both, tiny_fmu
from .c_fmu import C, build, integer, real
from .fakes import Clock, Integrator
from .typed_fmu import typed

NAME = "zhang2018-ppatc"


def short(**changes):
    """The paper's system and ten steps of its experiment, every row of it."""
    system, experiment = scenario(NAME)
    return system, replace(experiment, stop_time=0.01, every=1, **changes)


@pytest.fixture(scope="module")
def fresh():
    system, experiment = short()
    return cosim.simulate(system, experiment).table


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    return tiny_fmu.build(tmp_path_factory.mktemp("tiny"))


def memory() -> int:
    """Resident memory of this process, bytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


class TestManyFlights:
    def test_fifty_are_as_fresh_and_leave_nothing(self, fresh):
        system, experiment = short()
        with cosim.prepare(system) as prepared:
            for _ in range(30):  # the allocator settles
                assert prepared.fly(experiment).table.equals(fresh)
            gc.collect()
            before = descriptors(), memory(), threading.active_count()
            for _ in range(50):
                assert prepared.fly(experiment).table.equals(fresh)
            gc.collect()
            after = descriptors(), memory(), threading.active_count()
        assert (after[0], after[2]) == (before[0], before[2])
        assert after[1] - before[1] < 50 * 20_000  # less than a tenth of what a set of instances and a library take

    @pytest.mark.parametrize("kernel", both.LOOPS)
    def test_from_four_threads_at_once(self, fresh, kernel):
        system, experiment = short()
        experiment = replace(experiment, master=replace(experiment.master, kernel=kernel))
        together = threading.Barrier(4)

        def fly(_number):
            together.wait()
            return [prepared.fly(experiment).table.equals(fresh) for _ in range(10)]

        with cosim.prepare(system) as prepared, ThreadPoolExecutor(4) as pool:
            assert list(pool.map(fly, range(4))) == [[True] * 10] * 4

    def test_threads_with_parameters_of_their_own(self):
        """Each thread flies its own gain, and gets the flight of that gain."""
        system, experiment = short()
        inertias = [470.0, 480.0, 490.0, 500.0]
        alone = [
            cosim.simulate(replace(system, parameters={**system.parameters, "plant.J[1,1]": j}), experiment).table
            for j in inertias
        ]
        assert len({table["plant.omega_BN_B[1]"].to_pylist()[-1] for table in alone}) == 4

        def fly(j):
            return [prepared.fly(experiment, parameters={"plant.J[1,1]": j}).table for _ in range(5)]

        with cosim.prepare(system) as prepared, ThreadPoolExecutor(4) as pool:
            for tables, expected in zip(pool.map(fly, inertias), alone, strict=True):
                assert all(table.equals(expected) for table in tables)

    @pytest.mark.parametrize("kernel", both.LOOPS)
    def test_python_fmus(self, kernel):
        system, experiment = short()
        experiment = replace(experiment, master=replace(experiment.master, kernel=kernel))
        expected = cosim.simulate(system, experiment, locate=Library("python")).table
        with cosim.prepare(system, Library("python")) as prepared:
            for _ in range(4):
                assert prepared.fly(experiment).table.equals(expected)

    def test_python_fmus_in_threads(self):
        system, experiment = short()
        with cosim.prepare(system, Library("python")) as prepared, ThreadPoolExecutor(3) as pool:
            tables = list(pool.map(lambda _number: prepared.fly(experiment).table, range(6)))
        assert all(table.equals(tables[0]) for table in tables)


class TestEachOnItsOwn:
    """What one flight changes is as it was in the next."""

    def test_parameters(self, fresh):
        system, experiment = short()
        with cosim.prepare(system) as prepared:
            other = prepared.fly(experiment, parameters={"plant.J[1,1]": 500.0, "plant.omega_BN_B": [0.1, 0.0, 0.0]})
            assert not other.table.equals(fresh)
            assert other["plant.omega_BN_B"][0].tolist() == [0.1, 0.0, 0.0]
            assert other.info["parameters"]["plant.J[1,1]"]["value"] == 500.0
            again = prepared.fly(experiment)
            assert again.table.equals(fresh)
            assert again.info["parameters"].get("plant.J[1,1]") != other.info["parameters"]["plant.J[1,1]"]

    def test_parameters_of_every_type(self, tmp_path):
        held = {"a.r_in": 0.0, "a.i_in": 0, "a.b_in": False, "a.e_in": "off", "a.s_in": ""}
        system = both.of({"a": typed(tmp_path)}, [], held=held)
        with flights.prepare(system) as prepared:
            own = {"a.x0": 5.0, "a.count0": 9, "a.odd0": False, "a.mode0": "fast", "a.memory0": "ü"}
            names = ("x", "count", "odd", "mode", "memory")
            rows = []
            for parameters in (None, own, None):
                result = prepared.fly(both.experiment(), parameters=parameters)
                rows.append([result[f"a.{name}"][0] for name in names])
        assert rows == [[0.25, 3, True, 2, "begin"], [5.0, 9, False, 5, "ü"], [0.25, 3, True, 2, "begin"]]

    def test_record(self, fresh):
        system, experiment = short()
        with cosim.prepare(system) as prepared:
            few = prepared.fly(experiment, record=("plant.omega_BN_B",))
            assert few.names == ["plant.omega_BN_B"]
            assert few.info["units"] == dict.fromkeys((f"plant.omega_BN_B[{i}]" for i in (1, 2, 3)), "rad/s")
            assert prepared.fly(experiment).table.equals(fresh)
            assert prepared.fly(experiment, record=("plant.omega_BN_B",)).table.equals(few.table)

    def test_experiments(self, fresh):
        """Another step, stop, master and start; then the first again."""
        system, experiment = short()
        with cosim.prepare(system) as prepared:
            for changes in (
                {"communication_step_size": 0.002},
                {"stop_time": 0.02, "every": 3},
                {"master": Explicit("jacobi")},
                {"start_time": 0.005},
                {"stop_when": "plant.q_BN[1]"},
            ):
                other = replace(experiment, **changes)
                assert prepared.fly(other).table.equals(cosim.simulate(system, other).table)
            assert prepared.fly(experiment).table.equals(fresh)

    def test_mistakes(self, fresh):
        system, experiment = short()
        with cosim.prepare(system) as prepared:
            with pytest.raises(WiringErrors, match=r"plant\.J"):
                prepared.fly(experiment, parameters={"plant.J[1,1]": "heavy"})
            with pytest.raises(WiringErrors, match="unknown component"):
                prepared.fly(experiment, parameters={"palnt.J[1,1]": 1.0})
            with pytest.raises(UnknownName):
                prepared.fly(experiment, record=("plant.nothing",))
            with pytest.raises(InitializationFailed, match="plant"):
                prepared.fly(experiment, parameters={"plant.J[1,1]": -500.0})
            assert prepared.fly(experiment).table.equals(fresh)

    def test_results_stay_as_they_are(self, fresh):
        """A later flight does not write into the arrays, the info or the files of an earlier one."""
        system, experiment = short()
        with cosim.prepare(system) as prepared:
            first = prepared.fly(experiment)
            kept, told = first["plant.q_BN"].copy(), first.info["parameters"]
            prepared.fly(experiment, parameters={"plant.omega_BN_B": [0.1, 0.0, 0.0]})
            np.testing.assert_array_equal(first["plant.q_BN"], kept)
            assert first.info["parameters"] == told and first.table.equals(fresh)


class TestFailures:
    @pytest.mark.parametrize("kernel", both.LOOPS)
    def test_a_step_that_fails_leaves_it_usable(self, tiny, kernel):
        """b steps until a has grown beyond what it takes: y = 30 k t."""
        system = both.of({"a": tiny, "b": tiny}, [("a.y", "b.u")], held={"a.u": 30.0})
        good, bad = {"a.k": 1.0}, {"a.k": 20.0}
        with flights.prepare(system) as prepared:
            expected = prepared.fly(both.experiment(loop=kernel), parameters=good)
            for _ in range(3):
                with pytest.raises(
                    StepFailed, match=r"b returned fmi2Error at .*\n    u is 120, more than 100"
                ) as caught:
                    prepared.fly(both.experiment(loop=kernel), parameters=bad)
                assert len(caught.value.result) == 3
                again = prepared.fly(both.experiment(loop=kernel), parameters=good)
                assert again.table.equals(expected.table)

    def test_a_fatal_failure_leaves_it_usable(self, tmp_path):
        """The instance that said fmi2Fatal must not be called again: the next flight has a new one."""
        variables = [real("u", "input"), real("y"), integer("instances")]
        step = "if (u > 1) { m->whole[0] = 1; return fmi2Fatal; } y += h;"
        path = build(
            tmp_path, "Fatal", variables, step=step, on_set="if (m->whole[0]) abort();",
            reset="if (m->whole[0]) abort(); memset(m, 0, sizeof *m);",
        )  # fmt: skip
        system = both.of({"f": path}, [], held={"f.u": 2.0})
        fine = both.of({"f": path}, [], held={"f.u": 0.0})
        with flights.prepare(system) as prepared:
            for loop in (*both.LOOPS, *both.LOOPS):
                with pytest.raises(StepFailed, match="f returned fmi2Fatal at communication point 0 s"):
                    prepared.fly(both.experiment(loop=loop))
        with flights.prepare(fine) as prepared:
            assert prepared.fly(both.experiment())["f.y"][-1] == pytest.approx(1.0)

    @pytest.mark.parametrize("kernel", both.LOOPS)
    def test_an_fmu_that_cannot_be_reset_is_made_anew(self, tmp_path, kernel):
        """fmi2Reset returns an error, and leaves the state as it is: a reused instance would count on."""
        variables = [integer("count"), integer("marked", "parameter")]
        path = build(
            tmp_path, "Stubborn", variables, step="m->whole[0]++;", outputs="count = (int)m->whole[0];",
            reset="return fmi2Error;",
        )  # fmt: skip
        with flights.prepare(both.of({"s": path}, [])) as prepared:
            for _ in range(3):
                result = prepared.fly(both.experiment(loop=kernel))
                assert result["s.count"].tolist() == list(range(11))

    def test_a_fake_that_cannot_be_reset_is_freed_and_instantiated(self):
        clock = Clock("clock")
        system = System(name="t", components={"clock": "fake"})
        with flights.prepare(system, slaves={"clock": clock}) as prepared:
            for _ in range(3):
                prepared.fly(Experiment(stop_time=0.2, communication_step_size=0.1, master=Explicit(kernel="never")))
        life = [call[0] for call in clock.calls if call[0] in ("instantiate", "terminate", "free")]
        assert life == ["instantiate", "terminate", "free"] * 3

    def test_a_slave_that_can_be_reset_is_kept(self):
        class Kind(Integrator):
            def reset(self):
                self.calls.append(("reset",))
                self.values["y"] = 1.0
                return True

        kind = Kind("i", x0=1.0)
        system = System(name="t", components={"i": "fake"}, held={"i.u": 2.0})
        with flights.prepare(system, slaves={"i": kind}) as prepared:
            for _ in range(3):
                setup = Experiment(stop_time=0.2, communication_step_size=0.1, master=Explicit(kernel="never"))
                assert prepared.fly(setup)["i.y"][-1] == pytest.approx(1.4)
        life = [call[0] for call in kind.calls if call[0] in ("terminate", "free", "reset")]
        assert life == ["terminate", "reset", "terminate", "reset", "terminate", "free"]


def test_a_flight_after_close_is_freed_too(tiny, monkeypatch):
    """Closing frees the instances that wait; those of a flight that comes later, or still goes on, too."""
    freed, free = [], FmuSlave.free
    monkeypatch.setattr(FmuSlave, "free", lambda self: freed.append(self.c_interface() is not None) or free(self))
    prepared = flights.prepare(both.of({"a": tiny}, [], held={"a.u": 1.0}))
    for _ in range(2):
        prepared.fly(both.experiment())
        prepared.close()
        assert freed == [True]
        freed.clear()


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


def test_a_system_of_a_connection_is_wired_once(monkeypatch, tmp_path):
    """Further flights, with parameters or without, do not wire again."""
    path = tiny_fmu.build(tmp_path)
    calls = []
    real_wire = flights.wire
    monkeypatch.setattr(flights, "wire", lambda *arguments: calls.append(1) or real_wire(*arguments))
    system = System(
        name="t", components={"a": str(path), "b": str(path)}, connections=[Connection("a.y", "b.u")], held={"a.u": 1.0}
    )
    with flights.prepare(system) as prepared:
        for k in (1.0, 2.0, 3.0):
            result = prepared.fly(both.experiment(), parameters={"a.k": k})
            assert result["a.y"][-1] == pytest.approx(k)
    assert len(calls) == 1


class TestTheKernelKeepsWhatItHasPacked:
    """From flight to flight, of the same turns and instances: neither a failure nor an old instance may stay in it."""

    STEP = "if (k > 5 && t > 0.25) return fmi2Error; m->state[0] += h;"
    VARIABLES = (real("k", "parameter", start=1.0), real("y"))

    def fly_around(self, path, parameters):
        """The tables of a first and a last flight, of more rows than a block has; `parameters` fail one between."""
        with flights.prepare(both.of({"a": path}, [])) as prepared:
            first = prepared.fly(both.experiment(stop=500.0)).table
            if parameters:
                with pytest.raises(StepFailed):
                    prepared.fly(both.experiment(stop=500.0), parameters=parameters)
            return first, prepared.fly(both.experiment(stop=500.0)).table

    def test_a_flight_after_one_that_failed(self, tmp_path):
        path = build(tmp_path, "Fails", self.VARIABLES, outputs="y = m->state[0];", step=self.STEP)
        first, last = self.fly_around(path, {"a.k": 9.0})
        assert last.equals(first)

    def test_a_flight_of_an_instance_that_was_made_anew_elsewhere(self, tmp_path):
        """It cannot be reset, and the memory of the old one is not used again."""
        template = C.replace("{ free(c); }", "{ (void)c; }", 1)
        assert template != C
        path = build(
            tmp_path,
            "Anew",
            self.VARIABLES,
            outputs="y = m->state[0];",
            step=self.STEP,
            reset="return fmi2Error;",
            template=template,
        )
        first, last = self.fly_around(path, {})
        assert last.equals(first)
