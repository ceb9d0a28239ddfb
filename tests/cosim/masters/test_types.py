"""Values of every type between FMUs: the same in both loops, converted where nothing is lost, refused elsewhere."""

import re
from itertools import pairwise, product

import numpy as np
import pytest

from cosim import flights
from cosim.errors import UnknownName, ValueRefused, WiringErrors

from .. import both
from ..c_fmu import C, boolean, build, enumeration, integer, real, string
from ..typed_fmu import ITEMS, NAMES, typed

HELD = {"a.r_in": 1.5, "a.i_in": 7, "a.b_in": True, "a.e_in": "fast", "a.s_in": "Grüße 漢字"}


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return typed(tmp_path_factory.mktemp("typed"))


@pytest.fixture(scope="module")
def result(fmu):
    return both.fly(both.of({"a": fmu}, [], held=HELD), stop=0.5)


@pytest.fixture(scope="module")
def reader(tmp_path_factory):
    """Passes each of its inputs through."""
    items = {"zero": 0, "one": 1, "two": 2}
    variables = [
        real("r_in", "input"), real("r", depends="r_in"),
        integer("i_in", "input"), integer("i", depends="i_in"),
        boolean("b_in", "input"), boolean("b", depends="b_in"),
        enumeration("e_in", "input", start=0, items=items), enumeration("e", depends="e_in", items=items),
    ]  # fmt: skip
    code = "r = r_in; i = i_in; b = b_in; e = e_in;"
    return build(tmp_path_factory.mktemp("reader"), "Reader", variables, outputs=code)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Counts its steps from n0 on, as each type; the Boolean and the enumeration stay 0 or 1."""
    items = {"nothing": 0, "all": 1}
    variables = [
        integer("n0", "parameter"), integer("i"), boolean("b"), enumeration("e", items=items), real("r"),
        string("s"),
    ]  # fmt: skip
    code = 'i = n0 + (int)m->whole[0]; b = i & 1; e = i & 1; r = i; strcpy(s, "word");'
    return build(tmp_path_factory.mktemp("source"), "Source", variables, outputs=code, step="m->whole[0]++;")


def chain(timing, real_timing=None, names="abc"):
    """Feedthrough into the next one's inputs, of all types."""
    return [
        (f"{a}.{out}", f"{b}.{out}_in", real_timing if out == "r" and real_timing else timing)
        for a, b in pairwise(names)
        for out in NAMES
    ]


def loop(timing, real_timing=None):
    """The same, and the last one's states back into the first."""
    back = [(f"c.{state}", f"a.{direct}_in", "at_point") for direct, state in NAMES.items()]
    return chain(timing, real_timing) + back


class TestBothLoops:
    @pytest.mark.parametrize("steps", [{}, {"b": 2, "c": 4}, {"a": 3, "c": 2}, {"a": 2, "b": 4, "c": 4}], ids=str)
    @pytest.mark.parametrize(
        ("timing", "real_timing"),
        [("at_point", None), ("after_step", None), ("at_point", "ramp"), ("after_step", "midpoint")],
    )
    def test_a_loop_of_three_is_the_same_in_the_kernel(self, fmu, timing, real_timing, steps):
        system = both.of(dict.fromkeys("abc", fmu), loop(timing, real_timing), steps=steps)
        result = both.fly(system, stop=2.05, step=0.1)
        assert len(result) == 22
        texts = set(result["c.memory"].tolist())
        assert len(texts) == 1 + len(range(0, 21, steps.get("c", 1)))  # the start, and one of each step of c

    @pytest.mark.parametrize("preset", ["jacobi", "gauss_seidel"])
    def test_presets_and_inputs(self, fmu, preset):
        system = both.of(dict.fromkeys("abc", fmu), loop("after_step"))
        both.fly(system, stop=1.0, preset=preset)
        inputs = "declared" if preset == "jacobi" else "smooth"
        both.fly(system, stop=1.0, preset=preset, inputs=inputs, extrapolation=1)

    def test_python_fmus_carry_all_types_too(self, tmp_path):
        """The same values from an FMU whose Strings live in Python objects."""
        (tmp_path / "tell.py").write_text(PYTHON, encoding="utf-8")
        from pythonfmu.builder import FmuBuilder

        path = FmuBuilder.build_FMU(tmp_path / "tell.py", dest=tmp_path)
        fmus = {"a": path, "b": path}
        links = [("a.s", "b.s_in"), ("a.i", "b.i_in"), ("a.b", "b.b_in")]
        held = {"a.s_in": "ä", "a.i_in": 2, "a.b_in": True}
        result = both.fly(both.of(fmus, links, held=held), stop=0.5)
        assert result["b.s"].tolist()[:3] == ["", "0", "ä01"]
        assert result["a.i"].tolist() == [2, 3, 4, 5, 6, 7]


PYTHON = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Integer, String

class Tell(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.s_in, self.i_in, self.b_in = "", 0, False
        self.s, self.i, self.b, self.steps = "", 0, False, 0
        for kind, name in ((String, "s"), (Integer, "i"), (Boolean, "b")):
            self.register_variable(kind(name + "_in", causality=Fmi2Causality.input))
            self.register_variable(kind(name, causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self.i, self.b = self.i_in, self.b_in

    def do_step(self, t, h):
        self.s, self.i, self.b = self.s_in + str(self.steps), self.i + 1, self.b_in
        self.steps += 1
        return True
"""


class TestExact:
    """What is known in closed form of one instance with held inputs."""

    def test_held_inputs_of_every_type_are_shown(self, result):
        assert result["a.r_in"].tolist() == [1.5] * 6
        assert result["a.i_in"].tolist() == [7] * 6
        assert result["a.b_in"].tolist() == [True] * 6
        assert result["a.e_in"].tolist() == [5] * 6
        assert result["a.s_in"].tolist() == ["Grüße 漢字"] * 6

    def test_states(self, result):
        np.testing.assert_allclose(result["a.x"], 0.25 + 1.5 * result.time, rtol=1e-15)
        assert result["a.count"].tolist() == [3, 10, 17, 24, 31, 38]
        assert result["a.odd"].tolist() == [True, False] * 3
        assert result["a.mode"].tolist() == [2, 5, 1, 2, 5, 1]
        assert result["a.memory"].tolist() == ["begin", *(f"Grüße 漢字 µ{n}" for n in (1, 2, 3, 4, 5))]

    def test_feedthrough(self, result):
        assert result["a.i"].tolist() == [10, 17, 24, 31, 38, 45]
        assert result["a.b"].tolist() == [False] * 6
        assert result["a.e"].tolist() == [1] * 6
        assert result["a.s"].tolist() == ["<Grüße 漢字"] * 6

    def test_types_of_the_arrays(self, result):
        kinds = {out: result[f"a.{out}"].dtype.kind for out in NAMES}
        assert kinds == {"r": "f", "i": "i", "b": "b", "e": "i", "s": "O"}

    def test_feedthrough_of_every_type_is_fresh_along_a_chain(self, fmu):
        """b and c follow a within the same row, though every input is at_point: they are refreshed."""
        result = both.fly(both.of(dict.fromkeys("abc", fmu), chain("at_point"), held=HELD), stop=0.5)
        assert result["b.s"].tolist() == ["<<Grüße 漢字"] * 6
        assert (result["c.b"] == result["a.b"]).all() and (result["b.b"] != result["a.b"]).all()
        assert (result["c.i"] == (result["a.i"] + result["b.count"] + result["c.count"]) % 1000).all()
        np.testing.assert_array_equal(result["b.r"], 0.5 * result["a.r"] + result["b.x"])

    def test_start_values_of_every_type(self, fmu):
        values = {"a.x0": 2.0, "a.count0": -4, "a.odd0": False, "a.mode0": "slow", "a.memory0": "é"}
        result = both.fly(both.of({"a": fmu}, [], held=HELD, parameters=values), stop=0.1)
        row = [result[f"a.{state}"][0] for state in NAMES.values()]
        assert row == [2.0, -4, False, 2, "é"]


def test_many_distinct_texts_over_a_run(fmu):
    """Two texts a step that were never there before: far more than the kernel's table of texts begins with."""
    held = {"a.r_in": 0.0, "a.i_in": 1, "a.b_in": False, "a.e_in": 1, "a.s_in": "x"}
    links = [("a.memory", "b.s_in"), *(c for c in chain("at_point", names="ab") if c[1] != "b.s_in")]
    result = both.fly(both.of({"a": fmu, "b": fmu}, links, held=held), stop=0.7, step=0.0001)
    count = 7000
    expected = ["begin", *(f"x µ{n}" for n in range(1, count + 1))]
    assert result["a.memory"].tolist() == expected
    assert result["b.s_in"].tolist() == expected
    assert result["b.memory"].tolist()[1:] == [f"{text} µ{n}" for n, text in enumerate(expected[:-1], 1)]


def test_texts_that_come_again(tmp_path):
    """500 texts round and round: each keeps its number while the table grows, in kernel and Python alike."""
    step = 'snprintf(s, TEXT, "text %lld", m->whole[0]++ % 500);'
    path = build(tmp_path, "Round", [string("s")], step=step)
    result = both.fly(both.of({"a": path}, []), stop=2.0, step=0.001)
    assert result["a.s"].tolist() == ["", *(f"text {n % 500}" for n in range(2000))]


def test_no_text_at_all_is_the_empty_one(tmp_path):
    """fmi2GetString may give NULL, of which no length can be taken."""
    getter = "GET(fmi2String, text, get)"
    template = C.replace(getter, "MEMORY; for (i = 0; i < n; i++) value[i] = m->whole[0] == 1 ? 0 : m->text[v[i]];"
                         " return fmi2OK;")  # fmt: skip
    assert template != C
    variables = [string("s"), string("other"), string("u", "input")]
    step = 'm->whole[0]++; strcpy(s, "a"); strcpy(other, "b");'
    path = build(tmp_path, "Null", variables, template=template, step=step)
    system = both.of({"x": path, "y": path}, [("x.s", "y.u")], held={"x.u": "h"})
    result = both.fly(system, stop=0.3)
    assert result["x.s"].tolist() == result["y.u"].tolist() == ["", "", "a", "a"]
    assert result["x.other"].tolist() == ["", "", "b", "b"]


def test_fmus_without_outputs_and_without_inputs(fmu, tmp_path):
    """A sink takes every type and gives nothing; an FMU that only has a parameter exchanges nothing at all."""
    kinds = {"r": real, "i": integer, "b": boolean, "s": string}
    sink = build(tmp_path, "Sink", [make(f"{name}_in", "input") for name, make in kinds.items()])
    idle = build(tmp_path, "Idle", [real("k", "parameter")])
    links = [(f"a.{NAMES[name]}", f"sink.{name}_in", "after_step") for name in kinds]
    result = both.fly(both.of({"idle": idle, "sink": sink, "a": fmu}, links, held=HELD), stop=0.5)
    for name in kinds:
        assert result[f"sink.{name}_in"].tolist() == result[f"a.{NAMES[name]}"].tolist()


def test_parameters_of_every_type_can_be_recorded(fmu):
    names = ("a.x0", "a.count0", "a.odd0", "a.mode0", "a.memory0")
    result = both.fly(both.of({"a": fmu}, [], held=HELD), record=names)
    assert [result[name].tolist() for name in names] == [[v] * 11 for v in (0.25, 3, True, 2, "begin")]
    assert result.items == {"a.mode0": ITEMS}


def test_a_true_that_is_not_one_is_one(tmp_path):
    """C takes any number but 0 for true; an Integer that a Boolean goes into takes 1."""
    tall = build(tmp_path, "Tall", [boolean("b")], outputs="b = m->whole[0] ? 7 : 0;", step="m->whole[0] = 1;")
    variables = [integer("u", "input"), integer("y", depends="u")]
    number = build(tmp_path, "Number", variables, outputs="y = u;")
    for timing in ("at_point", "after_step"):
        result = both.fly(both.of({"a": tall, "i": number}, [("a.b", "i.u", timing)]), stop=0.3)
        assert result["i.y"].tolist() == result["i.u"].tolist() == [0, 1, 1, 1]
        assert result["a.b"].tolist() == [False, True, True, True]


class TestStopWhen:
    def test_a_boolean(self, fmu):
        """odd begins false, and is true after the first step."""
        system = both.of({"a": fmu}, [], held=HELD, parameters={"a.odd0": False})
        result = both.fly(system, stop=1.0, stop_when="a.odd")
        assert result["a.odd"].tolist() == [False, True]
        assert result.info["event"]["variable"] == "a.odd"

    def test_an_integer(self, fmu):
        """count goes -2, -1, 0, 1: the first number above 0.5 ends the run."""
        system = both.of({"a": fmu}, [], held=HELD | {"a.i_in": 1}, parameters={"a.count0": -2})
        result = both.fly(system, stop=1.0, stop_when="a.count")
        assert result["a.count"].tolist() == [-2, -1, 0, 1]

    def test_a_string_is_no_flag(self, fmu):
        with pytest.raises(UnknownName, match=r'unknown output "a.memory" in stop_when') as caught:
            flights.simulate(both.of({"a": fmu}, [], held=HELD), both.experiment(stop_when="a.memory"))
        assert "a.odd" in str(caught.value)


class TestIntoOtherTypes:
    @pytest.mark.parametrize("timing", ["at_point", "after_step"])
    @pytest.mark.parametrize(("out", "into"), list(product("ibe", "ribe")))
    def test_what_is_lossless_passes(self, source, reader, out, into, timing):
        """The numbers of a Boolean, an Integer and an enumeration go into each other, and into a Real."""
        if out == "i" and into in "be":
            held_n0, stop = 0, 0.1  # 0, 1: both have a place in the target
        else:
            held_n0, stop = 0, 0.4
        held = {f"to.{name}_in": 0 for name in "ribe" if name != into}
        system = both.of(
            {"from": source, "to": reader}, [(f"from.{out}", f"to.{into}_in", timing)],
            held=held, parameters={"from.n0": held_n0},
        )  # fmt: skip
        result = both.fly(system, stop=stop)
        assert result[f"to.{into}"].astype(float).tolist() == result[f"from.{out}"].astype(float).tolist()
        expected = np.arange(len(result)) % 2 if out in "be" else np.arange(len(result))
        assert result[f"to.{into}_in"].astype(float).tolist() == expected.tolist()

    @pytest.mark.parametrize("timing", ["at_point", "after_step"])
    @pytest.mark.parametrize(
        ("into", "n0", "value", "allowed"), [("b", 0, 2, "0, 1"), ("e", 1, 3, "0, 1, 2"), ("b", -1, -1, "0, 1")]
    )
    def test_a_value_without_a_place_ends_the_run(self, source, reader, into, n0, value, allowed, timing):
        held = {f"to.{name}_in": 0 for name in "ribe" if name != into}
        system = both.of(
            {"from": source, "to": reader}, [("from.i", f"to.{into}_in", timing)],
            held=held, parameters={"from.n0": n0},
        )  # fmt: skip
        error = both.failure(ValueRefused, system, stop=1.0)
        begun = value != n0
        assert (error.target, error.source, error.value) == (f"to.{into}_in", "from.i", value)
        assert re.fullmatch(
            rf"to\.{into}_in cannot take {value} from from\.i at [\d.]+ s: its values are {allowed}\.", str(error)
        )
        if begun:
            result = error.result
            assert result["from.i"].tolist() == list(range(n0, value))  # the rows before are kept
            assert (result.info["status"], result.info["error"]) == ("failed", "ValueRefused")
            assert error.time == pytest.approx({"at_point": 0.2, "after_step": 0.1}[timing])
        else:
            assert error.time == 0.0  # in initialization mode: there is no row yet

    @pytest.mark.parametrize("into", "ibes")
    def test_a_real_is_rounded_into_nothing(self, source, fmu, into):
        with pytest.raises(WiringErrors) as caught:
            held = {f"a.{name}_in": HELD[f"a.{name}_in"] for name in "ribes" if name != into}
            flights.prepare(both.of({"from": source, "a": fmu}, [("from.r", f"a.{into}_in")], held=held))
        kind = {"i": "Integer", "b": "Boolean", "e": "Enumeration", "s": "String"}[into]
        (mistake,) = caught.value.mistakes
        assert str(mistake).startswith(f"from.r is Real, a.{into}_in is {kind}: cannot connect them. A")

    @pytest.mark.parametrize("timing", ["midpoint", "ramp"])
    @pytest.mark.parametrize(("out", "into"), [("i", "i"), ("b", "b"), ("e", "e"), ("s", "s"), ("i", "r")])
    def test_there_is_nothing_between_two_items(self, fmu, out, into, timing):
        held = {f"b.{name}_in": HELD[f"a.{name}_in"] for name in "ribes" if name != into} | HELD
        system = both.of({"a": fmu, "b": fmu}, [(f"a.{out}", f"b.{into}_in", timing)], held=held)
        with pytest.raises(WiringErrors, match=rf"timing {timing}, but there is nothing between two values of type"):
            flights.prepare(system)

    def test_the_target_items_of_equal_enumerations_need_no_check(self, fmu, tmp_path):
        """An FMU that returns a number that is no item of its own enumeration passes to its like as it is."""
        variables = [enumeration("e", items=ITEMS)]
        odd = build(tmp_path, "Odd", variables, outputs="e = 4;")
        held = {k: v for k, v in HELD.items() if k != "a.e_in"}
        result = both.fly(both.of({"odd": odd, "a": fmu}, [("odd.e", "a.e_in")], held=held), stop=0.2)
        assert set(result["a.e_in"]) == {4}
