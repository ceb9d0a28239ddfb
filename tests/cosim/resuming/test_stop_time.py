"""Another stop time is one with which every step so far would have been the same."""

from dataclasses import replace
from pathlib import Path

import pytest

from cosim import Library, flights
from cosim.masters.error_controlled import ErrorControlled
from cosim.resuming import resume as go_on
from cosim.system import Connection, Experiment, Fault, Signal, System

from .. import both
from ..oscillator import Damper, Mass
from .left import interrupted, refused

OSCILLATOR = System(
    name="oscillator",
    components={"mass": Mass, "damper": Damper},
    connections=[Connection("mass.v", "damper.v", "after_step"), Connection("damper.f", "mass.f")],
)
V = "mass.v -> damper.v"


class TestStop:
    """Another stop time is one with which every step so far would have been the same."""

    def later(self, system, setup, folder, stop, **more):
        """A run that is begun with one stop time and ended with another one equals one that had it from the start."""
        flights.simulate(system, setup, out=folder, checkpoint=0.25, locate=Library(), **more)
        longer = go_on(folder, stop_time=stop)
        straight = flights.simulate(system, replace(setup, stop_time=stop), locate=Library())
        both.assert_same(straight, longer)
        assert longer.info["stop_time"] == stop and longer.info["resumed_at"] == setup.stop_time
        return longer

    @pytest.mark.parametrize("loop", both.LOOPS)
    @pytest.mark.parametrize("every", [1, 3])
    def test_further_from_the_end(self, alone, tmp_path, loop, every):
        """The last row of the shorter flight goes where it is none of the longer one."""
        again = self.later(alone, both.experiment(loop=loop, every=every), tmp_path / "out", 1.65)
        assert again["a.y"][-1] == 17

    @pytest.mark.parametrize("loop", both.LOOPS)
    @pytest.mark.parametrize("every", [1, 3])
    @pytest.mark.parametrize(
        "fault",
        [
            Fault("scale", V, 0.5, start=0.3, until=1.0),
            Fault("delay", V, 3, start=0.3, until=1.0),
            Fault("freeze", "damper", start=0.333, until=1.0),
            Fault("parameter", "damper.c", 2.0, start=0.3, until=1.0),
        ],
        ids=str,
    )
    def test_a_fault_that_ended_with_the_flight(self, tmp_path, loop, every, fault):
        """In the longer one it ends there too, and the row of that point shows what then holds."""
        self.later(OSCILLATOR, both.experiment(loop=loop, every=every, faults=[fault]), tmp_path / "out", 1.5)

    def test_twice(self, alone, tmp_path):
        self.later(alone, both.experiment(), tmp_path / "out", 2.0)
        longest = go_on(tmp_path / "out", stop_time=3.0)
        both.assert_same(flights.simulate(alone, both.experiment(stop=3.0)), longest)

    def test_shorter(self, alone, left):
        both.assert_same(flights.simulate(alone, both.experiment(stop=0.8)), go_on(left, stop_time=0.8))

    def test_of_error_controlled_steps(self, slopes, tmp_path):
        system = both.of({"s": slopes["Sine2"], "y": slopes["Cubic"]}, [("s.y", "y.u", "smooth")])
        setup = Experiment(stop_time=1.0, communication_step_size=0.1, master=ErrorControlled(relative=1e-6), every=5)
        self.later(system, setup, tmp_path / "out", 2.0)

    def test_not_after_the_point_reached(self, left):
        at = "out/checkpoint.bin: the run has come to 0.5 s"
        further = "Fly further: --stop TIME (stop_time=...)."
        assert refused(left, stop_time=0.5) == f"{at}, which is not before the stop time 0.5 s. {further}"
        go_on(left)
        assert refused(left) == f"out/checkpoint.bin: the run has come to 1 s. {further}"

    def test_a_step_that_was_shortened(self, alone, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        flights.simulate(alone, both.experiment(stop=0.95), out="out", checkpoint=0.5)
        assert refused("out", stop_time=2.0) == (
            "out/checkpoint.bin: a flight to 2 s would not have come to it: the step before 0.95 s was shortened to "
            "end there. Go on to 0.95 s, or fly anew with that stop time."
        )

    def test_steps_of_a_slow_component_that_was_shortened(self, fmu, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        system = both.of({"a": fmu}, [], steps={"a": 4})
        interrupted(system, both.experiment(), Path("out"), at=0.9, every=0.9)
        assert "a takes 4 steps at once, and is within its last, which the stop" in refused("out", stop_time=2.0)
        interrupted(system, both.experiment(), Path("earlier"), at=0.7, every=0.7)
        both.assert_same(flights.simulate(system, both.experiment(stop=2.0)), go_on("earlier", stop_time=2.0))

    def test_error_controlled_steps_near_the_old_stop(self, slopes, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        system = both.of({"s": slopes["Sine2"], "y": slopes["Cubic"]}, [("s.y", "y.u", "smooth")])
        setup = Experiment(stop_time=1.3, communication_step_size=0.1, master=ErrorControlled(), every=5)
        interrupted(system, setup, Path("out"), at=1.1, every=0.05)
        assert "the steps from 1 s on were chosen to end at the stop time" in refused("out", stop_time=2.0)

    def test_a_sample_of_a_signal_near_the_old_stop(self, slopes, tmp_path, monkeypatch):
        """A knot a hair from a communication point is taken there, one beyond the end is not."""
        monkeypatch.chdir(tmp_path)
        signal = Signal(([0.0, 0.2, 1.5 + 1e-10, 3.0], [0.0, 1.0, -1.0, 0.0]))
        system = both.of({"y": slopes["Line"]}, [], inputs={"y.u": signal})
        interrupted(system, both.experiment(), Path("out"))
        assert "a sample of a signal of y lies at another communication point" in refused("out", stop_time=2.0)

    def test_a_stop_time_that_the_fmus_were_told(self, alone, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        setup = both.experiment(announce_stop_time=True)
        interrupted(alone, setup, Path("out"))
        assert "the FMUs were told that it stops at 1 s (announce_stop_time)" in refused("out", stop_time=2.0)
        both.assert_same(flights.simulate(alone, setup), go_on("out"))
