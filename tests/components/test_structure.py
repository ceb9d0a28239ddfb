"""Structural parameters, whole numbers and texts: shapes and units that name them, references, names of FMUs."""

import pytest
from helpers import Point
from numpy.testing import assert_allclose

from components.framework import Component, ComponentError, Input, Output, Parameter, State
from components.framework.units import UNITS
from fmus.errors import UnknownComponent
from fmus.export.references import parse


class Ramp(Component):
    """Follows its input at a limited pace."""

    width: int = 1
    unit: str = "N"

    pace = Parameter(unit="unit/s", shape=("width",), start=2.0, doc="pace")
    gain = Parameter(unit="1/s", start=3.0, doc="gain")
    u = Input(unit="unit", shape=("width",), doc="wanted")
    x = State(unit="unit", shape=("width",), doc="reached")
    y = Output(unit="unit", shape=("width",), doc="shown")

    def derivatives(self, t, x, u, p):
        return {"x": p.gain * (u.u - x.x) + p.pace}

    def outputs(self, t, x, u, p):
        return {"y": x.x}


def units(part):
    return {v.name: v.unit for v in (*part.parameters, *part.inputs, *part.states, *part.outputs_declared)}


@pytest.mark.parametrize(
    ("unit", "rate"), [("N", "N/s"), ("1", "1/s"), ("rad", "rad/s"), ("N.m.s", "N.m"), ("rad/s", "rad/s2")]
)
def test_a_unit_may_be_a_structural_text_and_its_rate(unit, rate):
    part = Ramp(unit=unit, width=2)
    assert part.structure == {"width": 2, "unit": unit} and part.unit == unit
    found = units(part)
    assert (found["u"], found["x"], found["y"]) == (unit, unit, unit)
    assert found["pace"] == rate and found["gain"] == "1/s"
    assert_allclose(Point(part, u=[1.0, 2.0]).rates()["x"], [5.0, 8.0])


def test_what_components_have_anyway_is_no_structure():
    class Named(Ramp):
        role: str = "sensor"

    assert Named().structure == {"width": 1, "unit": "N"} and Named().role == "sensor"


def test_another_structure_takes_the_start_values_with_it_that_it_changes():
    part = Ramp(width=2, unit="N", pace=[4.0, 5.0], gain=7.0)
    turned = part.variant(unit="N.m")
    assert_allclose(next(v.start for v in turned.parameters if v.name == "pace"), 2.0)
    assert_allclose(next(v.start for v in turned.parameters if v.name == "gain"), 7.0)
    assert turned.structure == {"width": 2, "unit": "N.m"}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"unit": "N m"}, "Ramp: structural parameter unit = 'N m' is not a text of letters, digits and . / ( )."),
        ({"unit": ""}, "Ramp: structural parameter unit = '' is not a text of letters, digits and . / ( )."),
        ({"unit": None}, "Ramp: structural parameter unit = None is not a text of letters, digits and . / ( )."),
        ({"unit": "N.m.S"}, "Ramp: pace: unknown unit 'N.m.S'. Did you mean 'N.m.s'"),
        ({"unit": "rad/s2"}, "Ramp: pace: there is no unit of the rate of what is in rad/s2."),
        ({"width": "2"}, "Ramp: structural parameter width = '2' is not a whole number >= 0."),
    ],
)
def test_a_wrong_structure_is_refused(given, words):
    with pytest.raises(ComponentError) as error:
        Ramp(**given)
    assert words in str(error.value)


def test_a_shape_names_no_text():
    class Wrong(Component):
        unit: str = "N"
        u = Input(unit="unit", shape=("unit",), doc="wanted")

    with pytest.raises(ComponentError, match="u: shape names 'unit', the structural parameters are: unit"):
        Wrong()


@pytest.mark.parametrize("reference", ["Notch:width=3,unit=N.m", "Notch:width=3:unit=N.m"])
def test_a_reference_has_numbers_and_texts(reference):
    found = parse(reference)
    assert found.structure == (("width", 3), ("unit", "N.m"))
    assert found.model_name == "Notch_width3_unitN_m"
    part = found.component()
    assert part.structure == {"width": 3, "unit": "N.m"}
    assert units(part)["y"] == "N.m" and part.inputs[0].shape == (3,)


def test_a_text_of_digits_stays_a_text():
    assert parse("Notch:unit=1").component().structure["unit"] == "1"


def test_a_reference_to_a_file_takes_a_text_too(tmp_path):
    (tmp_path / "own.py").write_text(
        "from components.framework import Component, Input, Output\n\n\n"
        "class Own(Component):\n    unit: str = '1'\n    u = Input(unit='unit', doc='wanted')\n"
        "    y = Output(unit='unit', doc='shown')\n\n    def outputs(self, t, x, u, p):\n        return {'y': u.u}\n"
    )
    for reference in (f"{tmp_path / 'own.py'}:Own:unit=rad/s", f"{tmp_path / 'own.py'}:unit=rad/s"):
        assert units(parse(reference).component())["y"] == "rad/s"


def test_no_two_units_give_one_name():
    """FMUs are kept by their names: two of one name would take turns in one file."""
    names = {parse(f"Notch:unit={unit}").model_name for unit in UNITS}
    assert len(names) == len(UNITS) and all(name.isidentifier() for name in names)


@pytest.mark.parametrize("part", ["unit", "unit=", "=N", "a b=3"])
def test_a_wrong_part_of_a_reference_is_refused(part):
    with pytest.raises(UnknownComponent, match=f"'{part}' is not NAME=VALUE, as in Notch:modes=6"):
        parse(f"Notch:width=3,{part}")
