"""A run that was interrupted anywhere goes on from its checkpoint to the bits of one that was not."""

from pathlib import Path

import numpy as np
import pytest

from cosim import Library
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.system import At, Connection, Experiment, Signal, System, Value

from .. import both
from ..arrays_fmu import build as build_arrays
from ..interrupted import assert_goes_on, go_on, taken
from ..oscillator import Damper, Mass, SampledDamper
from ..typed_fmu import NAMES, typed
from ..walking import Walk
from ..wheel import TorqueBody, Wheel

NATIVE = Library("native")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return typed(tmp_path_factory.mktemp("typed"))


def all_types(fmu, **more):
    """A loop of three, of every type; each step brings new texts."""
    links = [(f"{a}.{out}", f"{b}.{out}_in", "after_step") for a, b in ("ab", "bc") for out in NAMES]
    back = [(f"c.{state}", f"a.{direct}_in", "at_point") for direct, state in NAMES.items()]
    return both.of(dict.fromkeys("abc", fmu), links + back, **more)


def oscillator(damper=Damper, timing="after_step"):
    return System(
        name="oscillator",
        components={"mass": Mass, "damper": damper},
        connections=[Connection("mass.v", "damper.v", timing), Connection("damper.f", "mass.f")],
    )


CHANGES = [At(0.35, {"mass.k": 9.0}), At(0.475, {"damper.c": 0.1, "mass.k": 5.0}), At(0.7, {"damper.c": 0.9})]
"""At a checkpoint, within a step, between two."""


@pytest.mark.parametrize("loop", both.LOOPS)
class TestExplicit:
    @pytest.mark.parametrize("steps", [{}, {"a": 2, "b": 4, "c": 4}], ids=str)
    def test_all_types_and_rates(self, fmu, tmp_path, loop, steps):
        """Checkpoints lie within the steps of slow components, some between two rows."""
        setup = both.experiment(stop=1.3, loop=loop, every=3)
        assert_goes_on(all_types(fmu, steps=steps), setup, tmp_path, 0.25)

    def test_samples_and_events(self, tmp_path, loop):
        """The length of a step between two events, values at them, which have happened, samples."""
        setup = both.experiment(stop=1.0, step=0.05, loop=loop, events=CHANGES)
        straight = assert_goes_on(oscillator(SampledDamper), setup, tmp_path, 0.175, NATIVE)
        assert 0.475 in straight.time and straight["damper.n"][-1] == 10

    @pytest.mark.parametrize("sine", ["Sine0", "Sine2"])
    def test_slopes_by_differences_and_told(self, slopes, tmp_path, loop, sine):
        system = both.of({"s": slopes[sine], "y": slopes["Cubic"]}, [("s.y", "y.u", "smooth")])
        assert_goes_on(system, both.experiment(stop=1.0, step=0.05, loop=loop), tmp_path, 0.2)

    def test_extrapolation(self, slopes, tmp_path, loop):
        system = both.of({"y": slopes["Line"], "s": slopes["Sine0"]}, [("s.y", "y.u", "at_point")])
        assert_goes_on(system, both.experiment(stop=1.0, step=0.05, loop=loop, extrapolation=1), tmp_path, 0.2)

    def test_step_means(self, tmp_path, loop):
        """The torque of the wheels is a mean over the step before."""
        system = System(
            name="momentum",
            components={"wheel": Wheel, "body": TorqueBody},
            connections=[
                Connection("wheel.tau_B", "body.tau_B"),
                Connection("wheel.h_B", "body.h_B", "ramp"),
                Connection("body.omega_BN_B", "wheel.tau_command_B", factor=-50.0),
            ],
        )
        assert_goes_on(system, both.experiment(stop=1.0, loop=loop), tmp_path, 0.25, NATIVE)

    @pytest.mark.parametrize("target", ["Cubic", "Held"])
    def test_signals(self, slopes, tmp_path, loop, target):
        """One of a file, one of memory; what the last step has told of them is in the checkpoint."""
        (tmp_path / "gust.csv").write_text("time,tau\n0,0\n0.33,2\n0.5,-1\n2,3\n")
        inputs = {
            "a.u": Signal(tmp_path / "gust.csv"),
            "b.u": Signal(([0, 0.1, 0.4, 1.0], np.sin([0, 1, 2, 3])), interpolation="cubic"),
        }
        system = both.of({"a": slopes[target], "b": slopes[target]}, [], inputs=inputs)
        assert_goes_on(system, both.experiment(stop=1.0, step=0.04, loop=loop), tmp_path, 0.2)

    def test_noise(self, tmp_path, loop):
        """Its generator is in the state of the FMU."""
        system = System(
            name="noisy",
            components={"gyro": "Gyro"},
            parameters={"gyro.angle_random_walk": Value(0.02, "deg/h(1/2)"), "gyro.bias": Value([3, -2, 4], "deg/h")},
            hold_unconnected=True,
        )
        straight = assert_goes_on(system, both.experiment(stop=1.0, loop=loop), tmp_path, 0.25, NATIVE)
        assert len(np.unique(straight["gyro.omega_BN_B"], axis=0)) > 8


PYTHON = Explicit(kernel="never")


class TestElsewhere:
    """What flies in the Python loop alone."""

    def test_python_fmus(self, tmp_path):
        setup = Experiment(stop_time=1.0, communication_step_size=0.05, master=PYTHON, events=CHANGES)
        assert_goes_on(oscillator(SampledDamper), setup, tmp_path, 0.175, Library("python"))

    def test_plain_python_with_a_generator_of_its_own(self, tmp_path):
        system = System(name="walk", components={"walk": Walk}, held={"walk.u": 1e-4})
        setup = Experiment(stop_time=1.0, communication_step_size=0.1)
        straight = assert_goes_on(system, setup, tmp_path, 0.25, NATIVE)
        assert len(np.unique(np.diff(straight["walk.x"]))) == 10

    def test_isolated_ones(self, fmu, tmp_path):
        setup = both.experiment(stop=1.0, loop="never")
        assert_goes_on(all_types(fmu, isolated=["b"]), setup, tmp_path, 0.25)

    def test_fmi_3(self, tmp_path):
        path = build_arrays(tmp_path)
        system = System(name="arrays", components={"a": str(path)}, hold_unconnected=True)
        assert_goes_on(system, Experiment(stop_time=1.0, communication_step_size=0.1), tmp_path, 0.25)

    def test_an_algebraic_loop(self, slopes, tmp_path):
        links = [("p.y", "q.u", "after_step"), ("q.y", "p.u", "at_point")]
        waves = [("s.y", "p.w", "after_step"), ("s.y", "q.w", "after_step")]
        system = both.of({"s": slopes["Sine0"], "p": slopes["Law"], "q": slopes["Law"]}, [*links, *waves])
        assert_goes_on(system, both.experiment(stop=1.0, loop="auto"), tmp_path, 0.25)


@pytest.mark.parametrize("loop", both.LOOPS)
@pytest.mark.parametrize("events", [(), CHANGES], ids=["", "events"])
class TestImplicit:
    def test_iterated(self, tmp_path, loop, events):
        """The Jacobian, the last step and what was sought in it."""
        setup = Experiment(
            stop_time=1.0, communication_step_size=0.05, master=Iterated(kernel=loop), events=events, every=4
        )
        assert_goes_on(oscillator(), setup, tmp_path, 0.2, NATIVE)

    @pytest.mark.parametrize("damper", [Damper, SampledDamper])
    def test_error_controlled(self, tmp_path, loop, events, damper):
        """The lengths of steps follow from the errors of those before, and no checkpoint shortens one."""
        master = ErrorControlled(relative=1e-7, kernel=loop)
        setup = Experiment(stop_time=1.0, communication_step_size=0.05, master=master, events=events, every=10)
        straight = assert_goes_on(oscillator(damper), setup, tmp_path, 0.1, NATIVE)
        assert straight.info["loop"]["steps"]["accepted"] > 5


@pytest.mark.parametrize("format", ["csv", "mat"])
def test_rows_that_were_written_as_text_or_for_matlab(fmu, tmp_path, format):
    """The finished run of `assert_goes_on` is cut from that file."""
    assert_goes_on(all_types(fmu), both.experiment(stop=1.0, loop="always"), tmp_path, 0.25, format=format)


@pytest.mark.parametrize("loop", both.LOOPS)
def test_from_the_start(fmu, tmp_path, loop):
    """The first checkpoint is before the first step, and no row is before it."""
    setup = both.experiment(loop=loop)
    straight, shots = taken(all_types(fmu), setup, tmp_path, 0.25)
    again = go_on(shots[1], shots[0], tmp_path / "again")
    both.assert_same(straight, again)
    assert again.info["resumed_at"] == 0


def test_the_folder_has_the_checkpoint_and_what_flew(fmu, tmp_path):
    straight = assert_goes_on(all_types(fmu), both.experiment(loop="always"), tmp_path, 0.25)
    assert sorted(p.name for p in (tmp_path / "again-1").iterdir()) == ["checkpoint.bin", "result.parquet", "run.json"]
    assert sorted(p.name for p in Path(straight.folder).iterdir()) == ["result.parquet", "run.json"]
