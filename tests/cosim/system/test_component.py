"""An instance as an FMU and how it flies: Component("x.fmu", isolated=True), in every place where systems are data."""

import os
from dataclasses import replace
from pathlib import Path

import pytest

import cosim
from components.filters.delay import Delay
from cosim import Component, Connection, Experiment, System, prepare, simulate
from cosim.errors import WiringError

from .. import c_fmu, tiny_fmu
from ..c_fmu import real

STEPS = Experiment(stop_time=1.0, communication_step_size=0.25)


def test_it_is_the_systems_own_word_for_the_same():
    parts = {"a": Component("x.fmu", isolated=True), "b": Component(Path("y.fmu")), "c": "z.fmu"}
    system = System(name="s", components=parts)
    assert system == System(name="s", components={"a": "x.fmu", "b": "y.fmu", "c": "z.fmu"}, isolated=["a"])
    assert system.components == {"a": "x.fmu", "b": "y.fmu", "c": "z.fmu"} and system.isolated == ("a",)
    assert repr(system).startswith("<System s: a x.fmu, b y.fmu, c z.fmu;")
    assert cosim.Component is Component and "Component" in cosim.__all__


def test_a_flag_adds_to_what_the_system_names():
    parts = {name: Component("x.fmu", isolated=name != "a") for name in "abc"}
    assert System(name="s", components=parts, isolated=["a", "b"]).isolated == ("a", "b", "c")
    assert System(name="s", components=parts, isolated="a").isolated == ("a", "b", "c")
    whole = System(name="s", components={"first": "x.fmu"}, isolated="first")  # one name, not five letters
    assert whole.isolated == ("first",)
    assert replace(whole, components=whole.components | {"b": Component("y.fmu", isolated=True)}).isolated == (
        "first",
        "b",
    )
    assert replace(System(name="s", components=parts), isolated=()).isolated == ()


def test_a_class_of_equations_is_an_fmu_too():
    assert System(name="s", components={"a": Component(Delay, isolated=True)}).components == {"a": Delay}


@pytest.mark.parametrize("isolated", [1, "yes", None])
def test_a_flag_that_is_none(isolated):
    said = rf"isolated of the component x\.fmu is {isolated!r}, which is neither True nor False\. Give isolated=True"
    with pytest.raises(WiringError, match=said):
        Component("x.fmu", isolated=isolated)


def test_what_names_no_fmu():
    with pytest.raises(WiringError, match=r"a component is int 3, which names no FMU\. Give FILE\.fmu"):
        Component(3)  # pyright: ignore[reportArgumentType]


@pytest.mark.skipif(not tiny_fmu.COMPILED, reason="these FMUs are compiled for Linux")
def test_it_flies_in_a_process_of_its_own_and_run_json_says_so(tmp_path):
    pids = tmp_path / "pids"
    note = f'FILE *f = fopen("{pids}", "a"); fprintf(f, "%ld\\n", (long)getpid()); fclose(f);'
    template = c_fmu.C.replace("#include <time.h>", "#include <time.h>\n#include <unistd.h>")
    variables = [real("u", "input", start=2.0), real("y")]
    code = {"outputs": "y = m->state[0];", "step": f"m->state[0] += h * u; {note}"}
    fmu = c_fmu.build(tmp_path, "Noted", variables, template=template, **code)
    parts = {"a": Component(fmu, isolated=True), "b": Component(fmu)}
    system = System(name="s", components=parts, connections=[Connection("a.y", "b.u")], hold_unconnected=True)
    result = simulate(system, STEPS)
    where = set(map(int, pids.read_text().split()))
    assert len(where) == 2 and os.getpid() in where
    assert {name: told["isolated"] for name, told in result.info["components"].items()} == {"a": True, "b": False}
    here = simulate(replace(system, isolated=()), STEPS)
    assert here.table.equals(result.table, check_metadata=False)
    with prepare(system) as prepared:
        assert prepared.fly(STEPS).table.equals(result.table, check_metadata=False)
