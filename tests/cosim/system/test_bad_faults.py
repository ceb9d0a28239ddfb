"""Faults that cannot be: each is refused by name before the first step, with what is wrong and the way out."""

from dataclasses import replace
from fractions import Fraction

import pytest

from cosim import At, Connection, ErrorControlled, Experiment, Fault, Iterated, Signal, System, prepare
from cosim.errors import NotSupported, TimeError, UnknownName, WiringErrors

from .. import c_fmu, tiny_fmu
from ..c_fmu import real
from ..oscillator import Damper, Mass

V = "mass.v -> damper.v"
SYSTEM = System(
    name="oscillator",
    components={"mass": Mass, "damper": Damper},
    connections=[Connection("mass.v", "damper.v", "after_step"), Connection("damper.f", "mass.f")],
)


@pytest.fixture(scope="module")
def prepared():
    with prepare(SYSTEM) as ready:
        yield ready


def refused(prepared, *faults, kind=WiringErrors, **more):
    with pytest.raises(kind) as caught:
        prepared.fly(Experiment(stop_time=2.0, communication_step_size=0.1, faults=faults, **more))
    return " ".join(str(caught.value).split())


@pytest.mark.parametrize(
    "fault, message",
    [
        (("scale", "mas.v", 2.0), 'unknown component "mas" in fault scale of mas.v from 0.5 s. Did you mean "mass"?'),
        (("scale", "damper.w -> mass.f", 2.0), 'unknown variable "w" in component "damper"'),
        (
            ("scale", "mass.v -> mass.f", 2.0),
            "mass.f is connected to damper.f, not to mass.v. Leave out the source: mass.f.",
        ),
        (
            ("scale", "damper.c", 2.0),
            'damper.c is no input, but parameter: no connection ends there. Its kind is "para',
        ),
        (("scale", "mass.a", 2.0), "nothing is connected to output mass.a"),
        (
            ("scale", "mass.v -> damper.f", 2.0),
            "damper.f is no input, but output: no connection ends there. Inputs: v.",
        ),
        (("scale", V), "it has no factor. Give it a factor."),
        (("scale", V, "2 m/s"), "its factor has the unit m/s. It is a number without unit."),
        (("scale", V, float("nan")), "its factor nan is no finite number"),
        (("bias", V, "0.1 deg"), "damper.v: it has unit m/s, the value has unit deg, which cannot be converted."),
        (("bias", V, [1.0, 2.0]), "its value has 2 numbers, what it is on has 1 element. Give it one."),
        (("bias", V, "much"), "its value 'much' is no finite number"),
        (("stuck", V, "0.1 deg"), "it has unit m/s, the value has unit deg, which cannot be converted."),
        (("stuck", V, True), "it is Real, the value True is bool"),
        (("dropout", V, 1.0), "it has the value 1.0, and takes none. Leave it out."),
        (("delay", V, -1), "its steps are -1. It counts steps of the source: a whole number, 1 to 100000."),
        (("delay", V, 1.5), "its steps are 1.5."),
        (("delay", V, "2 s"), "its steps are 2 s."),
        (("noise", V, 0.0), "its sigma is 0.0. It must be above 0."),
        (("quantisation", V, -1.0), "its step is -1.0. It must be above 0."),
        (("freeze", "dampr"), 'unknown component "dampr" in fault freeze of dampr from 0.5 s. Did you mean "damper"?'),
        (("freeze", "damper", 1), "it has the value 1, and takes none."),
        (("parameter", "damper.c"), "it has no value. Give it a value."),
        (("parameter", "damper.d", 1.0), 'unknown parameter "d" in component "damper"'),
        (
            ("parameter", "mass.mass", 2.0),
            "mass.mass is a fixed parameter, which cannot change after the start. Tunable",
        ),
        (("parameter", "damper.c", "1 m"), "it has unit 1/s, the value has unit m, which cannot be converted"),
    ],
)
def test_names_values_units(prepared, fault, message):
    assert message in refused(prepared, Fault(*fault, start=0.5))


@pytest.mark.parametrize("seed", [-1, 1.5, True, 2**53 + 1])
def test_a_seed_is_a_whole_number(prepared, seed):
    message = refused(prepared, Fault("noise", V, 0.1, start=0.5, seed=seed))
    assert f"its seed is {seed!r}. It must be a whole number, 0 to 9007199254740992." in message


def test_a_kind_that_there_is_not():
    with pytest.raises(
        UnknownName, match=r'unknown kind "quantization" in the fault of a\.u\. Did you mean "quantisation"'
    ):
        Fault("quantization", "a.u", 0.1, start=0)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    "start, until, message",
    [
        (-1.0, None, "it begins at -1 s, the flight is from 0 s to 2 s. Choose a time in it, before its end."),
        (2.0, None, "it begins at 2 s, the flight is from 0 s to 2 s."),
        (1.0, 1.0, "it ends at 1 s, and begins at 1 s. Let it end later."),
        (1.0, 2.5, "it ends at 2.5 s, the flight is from 0 s to 2 s. Leave out its end."),
    ],
)
def test_times_outside_the_flight(prepared, start, until, message):
    assert message in refused(prepared, Fault("scale", V, 2.0, start=start, until=until))


def test_times_that_are_none(prepared):
    assert "the start of scale of" in refused(prepared, Fault("scale", V, 2.0, start=float("nan")), kind=TimeError)


@pytest.mark.parametrize(
    "one, other",
    [
        (Fault("stuck", V, 1.0, start=0.5), Fault("stuck", "damper.v", 2.0, start=1.0)),
        (Fault("stuck", V, 1.0, start=0.5, until=1.5), Fault("dropout", "damper.v", start=1.0)),
        (Fault("bias", V, 1.0, start=0.5), Fault("bias", "mass.v", 1.0, start=0.5)),
        (Fault("freeze", "mass", start=0.5), Fault("freeze", "mass", start=1.0)),
        (Fault("parameter", "damper.c", 1.0, start=0.5), Fault("parameter", "*.c", 2.0, start=1.0, until=1.5)),
    ],
)
def test_contradictions_that_overlap(prepared, one, other):
    message = refused(prepared, one, other)
    assert f"has another one at that time, {one}. Let one end where the other begins" in message
    prepared.fly(
        Experiment(stop_time=2.0, communication_step_size=0.1, faults=[replace(one, until=other.start), other])
        if one.start < other.start
        else Experiment(stop_time=2.0, communication_step_size=0.1, faults=[one])
    )


def test_an_event_on_a_parameter_with_a_fault(prepared):
    fault = Fault("parameter", "damper.c", 1.0, start=0.5, until=1.5)
    message = refused(prepared, fault, events=[At(1.0, {"damper.c": 2.0})])
    assert "an event sets damper.c at 1 s, while it is there. Leave out one of them." in message


def test_a_parameter_that_must_come_back_and_has_no_start_value(tmp_path):
    made = c_fmu.build(tmp_path, "Line", [real("k", "tunable", start=2.0), real("y")], outputs="y = k;")
    bare = tiny_fmu.changed(made, tmp_path / "bare.fmu", xml=lambda text: text.replace(' start="2.0"', ""))
    fault = Fault("parameter", "a.k", 3.0, start=0.5, until=1.0)
    with prepare(System(name="s", components={"a": str(bare)})) as ready:
        assert (
            "fault parameter of a.k from 0.5 s: what a.k was before is not known (its FMU gives no start value). Leave "
            "out its end, and set it by an event."
        ) in refused(ready, fault)
        refused(ready, fault, events=[At(0.7, {"a.k": 2.0})])
        setup = Experiment(stop_time=2.0, communication_step_size=0.5, events=[At(0.0, {"a.k": 2.0})], faults=[fault])
        assert ready.fly(setup)["a.y"].tolist() == [2.0, 3.0, 2.0, 2.0, 2.0]


def test_all_mistakes_are_told_together(prepared):
    message = refused(prepared, Fault("scale", V, start=0.5), Fault("delay", V, 0, start=0.5))
    assert 'system "oscillator" has 2 mistakes' in message and "it has no factor" in message


def test_a_delay_needs_whole_steps(prepared):
    message = refused(prepared, Fault("delay", V, 2, start=Fraction(1, 3)))
    assert "it counts steps, and one is divided at 1/3 s. Let all faults and events be at communication" in message


def test_within_a_step_of_a_slow_component():
    with prepare(replace(SYSTEM, steps={"mass": 4})) as slow:
        message = refused(slow, Fault("scale", V, 2.0, start=0.5))
    assert "at 0.5 s mass is within a step of its own then, from 0.4 s to 0.8 s. Choose 0.4 s or 0.8 s." in message


def test_inputs_that_are_held_or_fed():
    held = replace(SYSTEM, connections=SYSTEM.connections[:1], held={"mass.f": 0.0})
    with prepare(held) as ready:
        message = refused(ready, Fault("bias", "mass.f", 1.0, start=0.5))
    assert "mass.f is held, nothing is connected to it. Hold it at another value." in message
    fed = replace(held, held={}, inputs={"mass.f": Signal(([0.0, 2.0], [0.0, 1.0]))})
    with prepare(fed) as ready:
        message = refused(ready, Fault("bias", "mass.f", 1.0, start=0.5))
    assert "a signal feeds mass.f. Put the fault into the signal." in message


@pytest.mark.parametrize(
    "master, kind, message",
    [
        (Iterated(), "delay", "Iterated halves steps that do not converge, and a delay would count each half"),
        (ErrorControlled(), "delay", "ErrorControlled chooses its steps"),
        (ErrorControlled(), "noise", "ErrorControlled chooses its steps, at each of whose ends the connection would"),
        (ErrorControlled(), "quantisation", "ErrorControlled chooses its steps"),
    ],
)
def test_kinds_that_a_master_cannot(prepared, master, kind, message):
    told = refused(prepared, Fault(kind, V, 1, start=0.5), kind=NotSupported, master=master)
    assert f"the fault {kind} of damper.v: {message}" in told and "Choose master=Explicit()." in told
