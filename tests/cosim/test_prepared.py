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
from cosim.errors import InitializationFailed, UnknownName, WiringErrors
from cosim.masters.explicit import Explicit
from cosim.system import Connection, System

from . import both, tiny_fmu
from .short_flight import short
from .typed_fmu import typed


@pytest.fixture(scope="module")
def fresh():
    system, experiment = short()
    return cosim.simulate(system, experiment).table


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
