"""Parameters and held inputs of every type, as a user writes them: in Python, on the command line, in a file."""

import pytest

from cosim import flights
from cosim.errors import WiringErrors
from cosim.results.result import Result
from cosim.system import Value
from fmus.description.read import read_description

from . import both
from .typed_fmu import typed

HELD = {"a.r_in": 0.0, "a.i_in": 0, "a.b_in": False, "a.e_in": "off", "a.s_in": ""}
STATE = {"x0": "x", "count0": "count", "odd0": "odd", "mode0": "mode", "memory0": "memory"}
"""Parameter -> the state that it starts."""

NUMBERS = "Numbers are decimal, with a point and nothing between their digits: 2.5, 1000, 1e-3"


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return typed(tmp_path_factory.mktemp("typed"))


def begun(fmu, name, value):
    """Return what a state is in the first row."""
    system = both.of({"a": fmu}, [], held=HELD, parameters={f"a.{name}": value})
    return both.fly(system, stop=0.1)[f"a.{STATE[name]}"][0]


def refused(fmu, name, value) -> str:
    """Return why a value of a parameter, or of a held input, is refused."""
    given = {"held": HELD | {f"a.{name}": value}} if name.endswith("_in") else {"parameters": {f"a.{name}": value}}
    with pytest.raises(WiringErrors) as caught:
        flights.prepare(both.of({"a": fmu}, [], **{"held": HELD} | given))
    (mistake,) = caught.value.mistakes
    return str(mistake)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("mode0", "slow", 2),
        ("mode0", 2, 2),
        ("mode0", "5", 5),
        ("mode0", Value("fast"), 5),
        ("mode0", Value("5"), 5),
        ("mode0", Value('"fast"'), 5),
        *(("odd0", value, True) for value in (True, 1, "true", "True", "1", Value("true"), Value("1"))),
        *(("odd0", value, False) for value in (False, 0, "false", "False", "0", Value("false"), Value("0"))),
        ("count0", 2**31 - 1, 2**31 - 1),
        ("count0", Value("-2147483648"), -(2**31)),
        ("count0", 12.0, 12),
        ("memory0", "12", "12"),
        ("memory0", "'12'", "12"),
        ("memory0", Value('"0.5 deg"'), "0.5 deg"),
        ("memory0", Value("true"), "true"),
        ("memory0", Value('"[1, 2]"'), "[1, 2]"),
        ("memory0", "'quoted'", "quoted"),
        ("memory0", "", ""),
        ("memory0", "[draft] é", "[draft] é"),
        *(("memory0", Value(t), t) for t in ("true", "12", "1e3", "5 deg", "0012", "[1, 2]", "[1] m", "2,5", "nan")),
    ],
    ids=repr,
)
def test_what_is_taken(fmu, name, value, expected):
    found = begun(fmu, name, value)
    assert (found, type(found) is str) == (expected, isinstance(expected, str))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("mode0", "medium", "it has no item 'medium'. There: off (1), slow (2), fast (5)"),
        ("mode0", 3, "it has no item 3. There: off (1), slow (2), fast (5)"),
        ("mode0", "fsat", "it has no item 'fsat'. Did you mean \"fast\"? There: off (1), slow (2), fast (5)"),
        ("mode0", True, "it has no item True. There: off (1), slow (2), fast (5)"),
        ("mode0", 2.0, "it has no item 2.0. There: off (1), slow (2), fast (5)"),
        ("odd0", 2, "it is Boolean, the value 2 is int. Write true, false, 1 or 0"),
        ("odd0", "yes", "it is Boolean, the value 'yes' is str. Write true, false, 1 or 0"),
        ("count0", 2**31, "the value 2147483648 is beyond an Integer of FMI 2.0, -2147483648 to 2147483647"),
        ("count0", -(2**31) - 1, "the value -2147483649 is beyond an Integer of FMI 2.0, -2147483648 to 2147483647"),
        ("count0", Value("99999999999999999999"), "beyond an Integer of FMI 2.0, -2147483648 to 2147483647"),
        ("count0", 1.5, "it is Integer, the value 1.5 is float"),
        ("count0", True, "it is Integer, the value True is bool"),
        ("count0", "many", "it is Integer, the value 'many' is str"),
        ("count0", float("inf"), "the value inf is not finite"),
        ("memory0", 12, "it is String, the value 12 is int. Write it in quotes: '\"12\"'"),
        ("memory0", [1, 2], "it is a scalar, the value is a vector of 2"),
        ("x0", "long", "it is Real, the value 'long' is no number and no list of numbers"),
        ("x0", Value("2,5"), f"the value '2,5' is no number and no list of numbers. {NUMBERS}"),
        ("x0", Value("0x10"), f"the value '0x10' is no number and no list of numbers. {NUMBERS}"),
        ("x0", Value("1_000 m"), f"the value '1_000 m' is no number and no list of numbers. {NUMBERS}"),
        ("x0", ["2,5"], "it is a scalar, the value is a vector of 1"),
        ("x0", 10**400, "the value is beyond a double, 1.8e308"),
        ("x0", Value("1e999"), "the value inf is not finite"),
        ("x0", Value("1e1234567890"), f"the value '1e1234567890' is no number and no list of numbers. {NUMBERS}"),
        ("x0", Value("+-inf"), "the value '+-inf' is no number"),
        ("x0", Value("[" * 5000 + "]" * 5000), "is no number and no list of numbers"),
        ("count0", Value("0x10"), f"it is Integer, the value '0x10' is str. {NUMBERS}"),
        ("count0", Value("2,5"), f"it is Integer, the value '2,5' is str. {NUMBERS}"),
        ("count0", 10**400, "is beyond an Integer of FMI 2.0, -2147483648 to 2147483647"),
        ("e_in", "medium", "it has no item 'medium'. There: off (1), slow (2), fast (5)"),
        ("i_in", 2**40, "the value 1099511627776 is beyond an Integer of FMI 2.0"),
        ("b_in", 7, "it is Boolean, the value 7 is int. Write true, false, 1 or 0"),
        ("s_in", 7, "it is String, the value 7 is int"),
    ],
    ids=lambda part: repr(part)[:30],
)
def test_what_is_refused(fmu, name, value, words):
    message = refused(fmu, name, value)
    assert message.startswith(f"parameter a.{name}: ") and words in message


def test_an_input_that_is_not_connected_is_told_how_to_hold_it(fmu):
    with pytest.raises(WiringErrors) as caught:
        flights.prepare(both.of({"a": fmu}, []))
    told = [str(m) for m in caught.value.mistakes]
    assert len(told) == 5
    assert told[1] == 'input a.i_in is not connected. Connect it, or hold it: held={"a.i_in": 0}.'
    assert told[2] == 'input a.b_in is not connected. Connect it, or hold it: held={"a.b_in": False}.'
    assert told[4] == "input a.s_in is not connected. Connect it, or hold it: held={\"a.s_in\": ''}."


FILE = """
from cosim.system import Experiment, System


def system():
    return System(name="typed", components={{"a": {path!r}}}, held={held!r}), Experiment(
        stop_time=0.2, communication_step_size=0.1
    )
"""


class TestCommandLine:
    @pytest.fixture
    def run(self, fmu, adcs, folder):
        (folder / "typed.py").write_text(FILE.format(path=str(fmu), held=HELD))
        return lambda *arguments: adcs("run", "typed.py", "--out", "out", *arguments)

    def test_set(self, run):
        texts = ["mode0=fast", "odd0=0", 'memory0="007"', "count0=-4", "x0=1e-3"]
        done = run(*(word for text in texts for word in ("--set", f"a.{text}")))
        assert done.status == 0, done.err
        result = Result.read("out")
        row = {name: result[f"a.{state}"][0] for name, state in STATE.items()}
        assert row == {"mode0": 5, "odd0": False, "memory0": "007", "count0": -4, "x0": 1e-3}
        assert result.items["a.mode"] == {"off": 1, "slow": 2, "fast": 5}

    def test_set_refuses(self, run):
        done = run("--set", "a.mode0=medium", "--set", "a.odd0=maybe", "--set", "a.count0=2147483648")
        assert done.status == 2
        assert "parameter a.mode0: it has no item 'medium'. There: off (1), slow (2), fast (5)" in done.err
        assert "parameter a.odd0: it is Boolean, the value 'maybe' is str. Write true, false, 1 or 0" in done.err
        assert "the value 2147483648 is beyond an Integer of FMI 2.0" in done.err

    @pytest.mark.parametrize("text", ["true", "12", "1e3", "5 deg", "0012", "[1, 2]", "a=b"])
    def test_a_text_is_what_was_written(self, run, folder, text):
        assert run("--set", f"a.memory0={text}").status == 0
        assert Result.read("out")["a.memory"][0] == text
        (folder / "own.toml").write_text(f'[a]\nmemory0 = "{text}"\n', encoding="utf-8")
        assert run("--force", "--params", "own.toml").status == 0
        assert Result.read("out")["a.memory"][0] == text

    def test_file(self, run, folder):
        (folder / "own.toml").write_text(
            '[a]\nmode0 = "slow"\nodd0 = false\nmemory0 = "12"\ncount0 = 5\nx0 = 2\n', encoding="utf-8"
        )
        assert run("--params", "own.toml").status == 0
        result = Result.read("out")
        row = [result[f"a.{state}"][0] for state in STATE.values()]
        assert row == [2.0, 5, False, 2, "12"]


def test_the_description_has_the_items(fmu):
    assert read_description(fmu).variables["mode0"].items == {"off": 1, "slow": 2, "fast": 5}
