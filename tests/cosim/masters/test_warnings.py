"""fmi2Warning and an error of fmi2Terminate end no run; both are told, on the terminal and in run.json."""

import json

import pytest

from cosim import flights
from cosim.cli import console
from cosim.errors import StepFailed

from .. import both, c_fmu
from ..c_fmu import boolean, build, integer, real, string

SAY = r"""
static void say(Memory *m, const char *text)
{
    const Instance *c = (const Instance *)m;
    c->f->logger(c->f->componentEnvironment, "w", fmi2Error, "logStatusError", "%s", text);
}
static void start(Memory *m);
"""
END = "fmi2Terminate(fmi2Component c) { return fmi2OK; }"


@pytest.fixture(scope="module")
def wary(tmp_path_factory):
    """Says nothing and returns fmi2Warning from 0.25 s on: `where` 1 from a setter, 2 from a getter, 3 from fmi2DoStep,
    5 from a setter and 6 from a getter of slopes; 4: at the end of initialization mode."""
    due = "m->now > 0.25"
    variables = [real("u", "input"), integer("n", "input"), real("y"), boolean("on"), string("word")]
    return build(
        tmp_path_factory.mktemp("wary"),
        "Wary",
        [*variables, integer("where", "parameter")],
        step=f"y = t + h; if (where == 3 && {due}) return fmi2Warning;",
        initialized="if (where == 4) return fmi2Warning;",
        on_set=f"if (where == 1 && {due}) return fmi2Warning;",
        on_get=f"if (where == 2 && {due}) return fmi2Warning;",
        on_set_slopes=f"if (where == 5 && {due}) return fmi2Warning;",
        on_get_slopes=f"if (where == 6 && {due}) return fmi2Warning;",
        refresh=False,
        maxOutputDerivativeOrder=1,
    )


def flown(path, where, timing="at_point"):
    """Both loops; the warnings must be the same, the kernel's result is returned."""
    held = {"c.u": 0.0, "c.n": 1, "w.n": 1}
    system = both.of({"c": path, "w": path}, [("c.y", "w.u", timing)], held=held, parameters={"w.where": where})
    results = [flights.simulate(system, both.experiment(loop=loop)) for loop in both.LOOPS]
    assert results[0].info["fmi2Warning"] == results[1].info["fmi2Warning"]
    both.assert_same(*results)
    assert results[0].info["status"] == "finished" and results[0].info["messages"] == {}
    return results[0]


@pytest.mark.parametrize(
    ("where", "functions"),
    [
        (1, {"fmi2SetReal": (7, 0.3)}),
        (2, {f"fmi2Get{kind}": (8, 0.2) for kind in ("Real", "Boolean", "String")}),
        (3, {"fmi2DoStep": (7, 0.3)}),
        (4, {"fmi2ExitInitializationMode": (1, 0.0)}),
        (0, {}),
    ],
)
def test_each_function_is_counted(wary, capsys, where, functions):
    result = flown(wary, where)
    told = {name: {"count": count, "first": first} for name, (count, first) in functions.items()}
    assert result.info["fmi2Warning"] == ({"w": told} if told else {})
    console.write_summary(result)
    text = capsys.readouterr().out
    for name, (count, first) in functions.items():
        times = f"{count} times, first" if count > 1 else "once,"
        assert f"\nw: {name} returned fmi2Warning {times} at communication point {first} s\n" in text
    assert text.count("fmi2Warning") == len(functions)


def test_derivatives_of_inputs_and_outputs(wary):
    assert flown(wary, 5, "ramp").info["fmi2Warning"] == {
        "w": {"fmi2SetRealInputDerivatives": {"count": 7, "first": 0.3}}
    }
    system = both.of({"w": wary, "b": wary}, [("w.y", "b.u")], held={"w.u": 0.0, "w.n": 1, "b.n": 1},
                     parameters={"w.where": 6})  # fmt: skip
    for loop in both.LOOPS:
        info = flights.simulate(system, both.experiment(loop=loop, extrapolation=1)).info
        assert info["fmi2Warning"] == {"w": {"fmi2GetRealOutputDerivatives": {"count": 8, "first": 0.2}}}


@pytest.mark.parametrize("loop", both.LOOPS)
def test_every_flight_counts_its_own(wary, loop):
    """Instances, and what the kernel keeps of them, go from flight to flight."""
    system = both.of({"w": wary}, [], held={"w.u": 0.0, "w.n": 1}, parameters={"w.where": 3})
    with flights.prepare(system) as prepared:
        found = [prepared.fly(both.experiment(loop=loop)).info["fmi2Warning"] for _ in range(3)]
        calm = prepared.fly(both.experiment(loop=loop), parameters={"w.where": 0}).info["fmi2Warning"]
    assert found == [{"w": {"fmi2DoStep": {"count": 7, "first": 0.3}}}] * 3
    assert calm == {}


@pytest.mark.parametrize("loop", both.LOOPS)
def test_a_run_that_fails_tells_them_too(tmp_path, loop, capsys):
    path = build(tmp_path, "Worse", [real("y")], step="return t > 0.45 ? fmi2Error : fmi2Warning;", refresh=False)
    with pytest.raises(StepFailed) as caught:
        flights.simulate(both.of({"a": path}, []), both.experiment(loop=loop))
    assert caught.value.result.info["fmi2Warning"] == {"a": {"fmi2DoStep": {"count": 5, "first": 0.0}}}
    console.write_summary(caught.value.result)
    assert "a: fmi2DoStep returned fmi2Warning 5 times, first at communication point 0.0 s" in capsys.readouterr().out


@pytest.mark.parametrize("loop", both.LOOPS)
@pytest.mark.parametrize(("status", "word"), [(3, "fmi2Error"), (4, "fmi2Fatal"), (2, "fmi2Discard")])
def test_an_fmu_that_does_not_terminate(tmp_path, adcs, capsys, loop, status, word):
    """All others are terminated all the same; the run is finished, for its rows are whole."""
    said = f'fmi2Terminate(fmi2Component c) {{ say(c, "the valve is stuck"); return {status}; }}'
    template = c_fmu.C.replace("static void start(Memory *m);\n", SAY, 1).replace(END, said)
    stuck = build(tmp_path, "Stuck", [real("y")], step='if (t > 0.85) say(m, "nearly");', template=template)
    system = both.of({"w": stuck, "x": stuck}, [])
    result = flights.simulate(system, both.experiment(loop=loop), out="out")
    end = {"status": word, "messages": ["the valve is stuck"]}
    assert result.info["fmi2Terminate"] == {"w": end, "x": end}
    assert json.loads((tmp_path / "out" / "run.json").read_text())["fmi2Terminate"] == {"w": end, "x": end}
    assert (result.info["status"], len(result)) == ("finished", 11)
    line = f"w: fmi2Terminate returned {word}, after the last row\n    the valve is stuck\n"
    console.write_summary(result)
    assert line in capsys.readouterr().out
    assert line in adcs("show", "out").out


def test_one_that_terminates_with_a_warning(tmp_path):
    template = c_fmu.C.replace(END, "fmi2Terminate(fmi2Component c) { return fmi2Warning; }")
    path = build(tmp_path, "Wry", [real("y")], template=template)
    info = flights.simulate(both.of({"a": path}, []), both.experiment()).info
    assert info["fmi2Warning"] == {"a": {"fmi2Terminate": {"count": 1, "first": 1.0}}}
    assert info["fmi2Terminate"] == {}
