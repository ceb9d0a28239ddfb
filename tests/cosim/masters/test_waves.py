"""Waves of the kernel: what takes nothing from one another goes together, and fails as if it went one by one."""

import ctypes
import sys
from itertools import product

import numpy as np
import pytest

from cosim import flights
from cosim.errors import StepFailed
from cosim.masters.kernel import unrolled
from cosim.masters.kernel.structures import PassStructure, WireStructure
from cosim.masters.kernel.waves import SLOT, together
from fmus.errors import CompileFailed

from .. import both
from ..c_fmu import C, build, integer, real
from .test_terminated import NO, YES

SETS, STEPS, GETS, NOT_A_NUMBER = range(4)
RING = [("a.y", "b.u", "at_point"), ("b.y", "c.u", "at_point"), ("c.y", "a.u", "at_point")]
WORDS = {SETS: "fmi2SetReal", STEPS: "fmi2Error", GETS: "fmi2GetReal", NOT_A_NUMBER: "y became nan"}


@pytest.fixture(scope="module")
def fragile(tmp_path_factory):
    """y follows u; after five steps `where` says what fails, unless it is below 0."""
    variables = [real("u", "input"), real("y", start=0.0), integer("where", "parameter", start=-1)]
    due = "m->whole[0] >= 5"
    return build(
        tmp_path_factory.mktemp("fragile"),
        "Fragile",
        variables,
        step=f"if (where == {STEPS} && {due}) return fmi2Error; y += h * (u + 1);"
        f" if (where == {NOT_A_NUMBER} && {due}) y = NAN; m->whole[0]++;",
        on_set=f"if (where == {SETS} && {due}) return fmi2Error;",
        on_get=f"if (where == {GETS} && m->whole[0] >= 6) return fmi2Error;",
    )


@pytest.fixture(params=["by lists", "unrolled"])
def form(request, monkeypatch):
    """How the kernel goes through waves: by their lists of calls, or written out and compiled for the run."""
    monkeypatch.setattr(unrolled, "LONG", 0 if request.param == "unrolled" else sys.maxsize)
    monkeypatch.setattr(unrolled, "SAVED", 1.0)


@pytest.fixture
def made(monkeypatch):
    """How many sources have been compiled."""
    sources = []
    compile_it = unrolled._compile
    monkeypatch.setattr(unrolled, "_compile", lambda text, path: (sources.append(text), compile_it(text, path)))
    return sources


def ring(fragile, **where):
    return both.of(dict.fromkeys("abc", fragile), RING, parameters={f"{name}.where": n for name, n in where.items()})


@pytest.mark.parametrize("third", [SETS, GETS])
@pytest.mark.parametrize(("first", "second"), [*product([-1, SETS, STEPS, GETS, NOT_A_NUMBER], range(4))])
def test_the_failure_that_is_told_is_that_of_the_first_in_turn(fragile, form, first, second, third):
    """All fail in the sixth step, whatever is called first where calls are made together."""
    system = ring(fragile, a=first, b=second, c=third)
    error = both.failure(StepFailed, system, stop=2.0, preset="plain")
    assert error.component == ("a" if first >= 0 else "b")
    assert WORDS[first if first >= 0 else second] in str(error)
    assert len(error.result) == 6


@pytest.mark.parametrize("every", [1, 31])
@pytest.mark.parametrize("count", [2, 7, 15, 16, 17, 40])
def test_few_and_many(fragile, form, count, every):
    """So many that values are taken one by one, and so many that they are not: y' = u + 1 held over each step.

    The last step is half as long as the others.
    """
    names = [f"n{i}" for i in range(count)]
    wires = [(f"{a}.y", f"{b}.u", "at_point") for a, b in zip(names, names[1:] + names[:1], strict=True)]
    result = both.fly(both.of(dict.fromkeys(names, fragile), wires), stop=3.05, every=every, preset="plain")
    y = np.zeros(count)
    for row in range(32):
        if row % every == 0:
            shown = [result[f"{name}.y"][row // every] for name in names]
            assert shown == pytest.approx(y.tolist(), rel=1e-13)
        y += (0.1 if row < 30 else 0.05) * (np.roll(y, 1) + 1)


@pytest.mark.parametrize("count", [3, 30])
def test_the_last_of_few_and_of_many_is_not_finite(fragile, form, count):
    names = [f"n{i}" for i in range(count)]
    wires = [(f"{a}.y", f"{b}.u", "at_point") for a, b in zip(names, names[1:] + names[:1], strict=True)]
    system = both.of(dict.fromkeys(names, fragile), wires, parameters={f"{names[-1]}.where": NOT_A_NUMBER})
    error = both.failure(StepFailed, system, stop=2.0, preset="plain")
    assert error.component == names[-1] and "y became nan" in str(error) and len(error.result) == 6


def test_a_run_that_saves_more_than_a_compiler_takes_is_unrolled_and_others_then_too(
    fragile, made, tmp_path, monkeypatch
):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path))  # nothing is there yet
    asked, kept = [], unrolled.library.kept
    monkeypatch.setattr(unrolled.library, "kept", lambda name, *more: (asked.append(name), kept(name, *more))[1])

    def fly(steps):
        setup = both.experiment(stop=0.1 * steps, every=steps, preset="plain")
        return flights.simulate(ring(fragile), setup)["a.y"][-1]

    monkeypatch.setattr(unrolled, "LONG", 10)
    monkeypatch.setattr(unrolled, "COMPILED", unrolled.SAVED * 50 - unrolled.COMPILER / 9)  # 9 calls a step
    fly(49)
    assert not made and "waves" not in "".join(asked)
    assert fly(51) > 0 and len(made) == 1
    asked.clear()
    fly(9)  # too short to ask for it
    assert "waves" not in "".join(asked)
    fly(49)
    assert "waves" in "".join(asked) and len(made) == 1
    asked.clear()
    monkeypatch.setattr(unrolled, "MOST", 8)
    fly(48)  # another plan: that of the flight before is kept
    assert "waves" not in "".join(asked)


def test_a_run_flies_without_what_cannot_be_compiled(fragile, monkeypatch):
    def fails(text, path):
        raise CompileFailed(["cc"], "no")

    monkeypatch.setattr(unrolled, "LONG", 0)
    monkeypatch.setattr(unrolled, "SAVED", 1.0)
    monkeypatch.setattr(unrolled, "_compile", fails)
    monkeypatch.setattr(unrolled.library, "is_kept", lambda name: False)
    names = [f"alone{i}" for i in range(5)]  # of a shape that no other test has
    assert len(both.fly(both.of(dict.fromkeys(names, fragile), [], held={f"{n}.u": 1.0 for n in names}))) == 11


def test_a_run_that_an_fmu_ends(form, tmp_path):
    """It says so in a step that is taken whole: that step counts, the next one is not taken."""
    ends = build(
        tmp_path,
        "Ends",
        [real("y", start=0.0)],
        step="m->last = t + h; y = t + h; if (t > 0.45) { m->now = t + h; return fmi2Discard; }",
        template=C.replace(NO, YES),
    )
    result = both.fly(both.of({"a": ends, "b": ends}, []), stop=2.0, every=20, preset="plain")
    assert result["a.y"].tolist() == pytest.approx([0.0, 0.6]) and result.info["event"]["variable"] == "b"


def test_several_inputs_each(form, tmp_path):
    """y = u - 2 v of what the others had: 3, 5 and -7 come round."""
    given = [real("u", "input"), real("v", "input"), real("y", "output", start=0.0), real("first", "parameter")]
    adder = build(tmp_path, "Adder", [*given], initialized="y = first;", step="y = u - 2 * v;")
    wires = [(f"{a}.y", f"{b}.{v}", "at_point") for b, v, a in ("aub", "avc", "buc", "bva", "cua", "cvb")]
    system = both.of(dict.fromkeys("abc", adder), wires, parameters={"a.first": 3.0, "b.first": 5.0, "c.first": -7.0})
    result = both.fly(system, preset="plain")
    y = np.array([3.0, 5.0, -7.0])
    for row in range(11):
        assert [result[f"{n}.y"][row] for n in "abc"] == y.tolist()
        y = np.array([y[1] - 2 * y[2], y[2] - 2 * y[0], y[0] - 2 * y[1]])


def test_a_zero_is_passed_on_without_its_sign(form, tmp_path):
    """As 1 * -0 + 0, which is what a connection gives, is +0."""
    negative = build(tmp_path, "Negative", [real("y", start=0.0)], step="y = -0.0;")
    passer = build(tmp_path, "Passer", [real("u", "input"), real("y", start=0.0)], step="y = u;")
    result = both.fly(both.of({"n": negative, "p": passer}, [("n.y", "p.u", "at_point")]), preset="plain")
    assert np.signbit(result["n.y"][1:]).all() and not np.signbit(result["p.y"]).any()


def test_inputs_in_other_units_are_scaled_in_both_forms(form, tmp_path):
    """deg into rad: a wire with a factor."""
    degree = """<Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit>"""
    radian = """<Unit name="rad"><BaseUnit rad="1"/></Unit>"""
    degrees = build(tmp_path, "Degrees", [real("y", start=0.0, unit="deg")], step="y += 90;", units=degree)
    given = [real("u", "input", unit="rad"), real("y", start=0.0)]
    radians = build(tmp_path, "Radians", given, step="y = u;", units=radian)
    result = both.fly(both.of({"d": degrees, "r": radians}, [("d.y", "r.u", "at_point")]), stop=0.5, preset="plain")
    assert result["r.y"][1:] == pytest.approx(np.pi / 2 * np.arange(5), rel=1e-15)


def test_what_follows_within_the_step_is_another_wave():
    slots = np.zeros(4)
    kept = []

    def straight(component, takes, reads, *, step=True, known=False):
        wires = (WireStructure * len(takes))(*(WireStructure(slots.ctypes.data + SLOT * slot, 1, 0) for slot in takes))
        kept.append(wires)
        return PassStructure(
            component=component,
            step=int(step),
            inputs=len(takes),
            wire=ctypes.addressof(wires),
            output=slots.ctypes.data + SLOT * reads,
            outputs=1,
            kept=known,
        )

    passes = [
        straight(0, [3], 0),
        straight(1, [2], 1),  # what follows it
        straight(2, [1], 2),  # takes what component 1 reads
        straight(3, [], 3),
        straight(1, [0], 1, step=False),  # readings
        straight(1, [0], 2, step=False),  # of the same component
        straight(0, [2], 0, step=False, known=True),  # sets nothing
    ]
    found = [[each.place for each in wave] for wave in together(passes)]
    assert found == [[0, 1], [2, 3], [4], [5, 6]]
