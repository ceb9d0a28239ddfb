"""Flights that fail leave a prepared system usable; instances are reset, freed or made anew."""

import pytest

from cosim import flights
from cosim.errors import StepFailed
from cosim.masters.explicit import Explicit
from cosim.slaves.fmi2 import FmuSlave
from cosim.system import Experiment, System

from . import both, tiny_fmu
from .c_fmu import C, build, integer, real
from .fakes import Clock, Integrator


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    return tiny_fmu.build(tmp_path_factory.mktemp("tiny"))


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
