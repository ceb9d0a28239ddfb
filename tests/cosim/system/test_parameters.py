"""Parameters, vehicle values and held inputs: names, sizes, types, units."""

import math

import pytest

from cosim.system import System, Value
from cosim.system.parameters import Parameters
from cosim.system.wiring import Port

from ..fakes import Vehicle
from ..wired import HELD, only, wired, zero

CONVERT = "parameter {}: it has {}, the value has unit {}, which cannot be converted. Units: {}"


QUOTES = "Write it in quotes: '\"1\"'"


class TestParameters:
    def set(self, **parameters):
        return {str(p): v for p, v in wired(parameters=parameters.pop("given", parameters)).settings.items()}

    def test_matrix_element_vector_scalar_and_other_types(self):
        given = {
            "plant.J": [[1, 2], [3, 4]],
            "plant.J[1,2]": 9,
            "plant.Omega": 5.0,
            "plant.omega[2]": 7,
            "plant.count": 4,
            "plant.on": False,
            "plant.label": "5 V",
        }
        assert self.set(given=given) == {
            "plant.J[1,1]": 1.0,
            "plant.J[1,2]": 9.0,
            "plant.J[2,1]": 3.0,
            "plant.J[2,2]": 4.0,
            "plant.Omega[1]": 5.0,
            "plant.Omega[2]": 5.0,
            "plant.omega[2]": 7.0,
            "plant.count": 4,
            "plant.on": False,
            "plant.label": "5 V",
        }

    def test_what_was_resolved_before_is_taken_for_the_same_entry_only(self):
        """1, 1.0, True and their texts are equal or look alike, and come to different values, or to none."""
        first = wired(parameters={"plant.Omega": [1, 2], "plant.on": True, "plant.label": "5 V"})
        plant = first.descriptions
        for given in (
            {"plant.Omega": [1, 2], "plant.on": True, "plant.label": "5 V"},
            {"plant.Omega": [1, 3], "plant.on": 0, "plant.label": "5"},
            {"plant.Omega": Value([1, 2]), "plant.on": "false", "plant.label": Value("5 V")},
            {"plant.Omega": [1, 2], "plant.on": 1.0},
        ):
            system = System(name="s", components={}, parameters=given)
            alone, again = Parameters(system, plant), Parameters(system, plant, first.resolved)
            assert again.settings() == alone.settings()
            assert [str(m) for m in again.mistakes] == [str(m) for m in alone.mistakes]
        assert again.mistakes
        assert [e[1] for e in again.resolved] == ["plant.Omega"]

    def test_precedence_vehicle_everywhere_array_element(self):
        settings = wired(
            slaves=[Vehicle("a"), Vehicle("b")],
            held=zero("a", "b"),
            vehicle={"J": [[1, 0], [0, 1]], "rho": 1.0},
            parameters={"b.J[1,1]": 4, "b.J": [[3, 0], [0, 3]], "*.rho": 2.0},
        ).settings
        assert settings[Port("a", "J[1,1]")] == 1.0
        assert (settings[Port("b", "J[1,1]")], settings[Port("b", "J[2,2]")]) == (4.0, 3.0)
        assert settings[Port("a", "rho")] == settings[Port("b", "rho")] == 2.0

    def test_vehicle_sets_parameters_only(self):
        assert 'unknown parameter "omega" in vehicle of any component' in only(vehicle={"omega": [1, 2]})

    @pytest.mark.parametrize("value", [Value(5.0, "deg"), Value("5 deg"), Value("5.0 deg")])
    def test_display_unit(self, value):
        assert math.isclose(self.set(given={"plant.rho": value})["plant.rho"], math.radians(5), rel_tol=1e-15)

    def test_held_with_unit(self):
        held = wired(held={"plant.tau_B": Value("[1000, 0, 0] mN.m"), "plant.angle": Value(90, "deg")}).held
        assert held[Port("plant", "tau_B[1]")] == 1.0
        assert math.isclose(held[Port("plant", "angle")], math.pi / 2)

    @pytest.mark.parametrize(
        ("name", "value", "text"),
        [
            ("plant.rho", "x", "parameter plant.rho: it is Real, the value 'x' is no number and no list of numbers"),
            ("plant.rho", True, "parameter plant.rho: it is Real, the value True is bool"),
            ("plant.rho", None, "parameter plant.rho: it is Real, the value None is NoneType"),
            ("plant.rho", math.nan, "parameter plant.rho: the value nan is not finite"),
            ("plant.rho", Value("inf"), "parameter plant.rho: the value inf is not finite"),
            ("plant.count", 1.5, "parameter plant.count: it is Integer, the value 1.5 is float"),
            ("plant.on", 2, "parameter plant.on: it is Boolean, the value 2 is int. Write true, false, 1 or 0"),
            ("plant.label", Value(1), "parameter plant.label: it is String, the value 1 is int. " + QUOTES),
            ("plant.J", 1.0, "parameter plant.J: it is a matrix of 2 x 2, the value is a scalar"),
            ("plant.J", [1, 2], "parameter plant.J: it is a matrix of 2 x 2, the value is a vector of 2"),
            ("plant.J", [[1, 2], [3]], "parameter plant.J: it is a matrix of 2 x 2, the value is a ragged list"),
            ("plant.rho", [1.0], "parameter plant.rho: it is a scalar, the value is a vector of 1"),
            ("plant.power", 1.0, "parameter plant.power: it is an output: it cannot be set"),
            ("plant.angle", 1.0, 'parameter plant.angle: it is an input: hold it: held={"plant.angle": ...}'),
            ("plant.rho", Value(1, "N.m"), CONVERT.format("plant.rho", "unit rad", "N.m", "deg, rad")),
            ("plant.rho", Value(1, "foo"), CONVERT.format("plant.rho", "unit rad", "foo", "deg, rad")),
            ("plant.J", Value(1, "N.m"), "parameter plant.J: it is a matrix of 2 x 2, the value is a scalar"),
            ("plant.count", Value(1, "N.m"), CONVERT.format("plant.count", "no unit", "N.m", "none")),
        ],
    )  # fmt: skip
    def test_refused(self, name, value, text):
        assert only(parameters={name: value}) == text

    def test_unknown(self):
        assert only(parameters={"plant.rh": 1.0}).startswith(
            'unknown parameter "rh" in component "plant". Did you mean "rho"? There: J, rho, count'
        )
        assert 'unknown component "plat" in parameter "plat.J"' in only(parameters={"plat.J": 1})
        assert 'unknown parameter "Jay" in parameters of any component' in only(parameters={"*.Jay": 1})
        assert 'unknown component "pl" in held "pl.angle"' in only(held=HELD | {"pl.angle": 1})
        assert 'unknown input "angl" in component "plant"' in only(held=HELD | {"plant.angl": 1})
        assert "it is held, but it is no input. Inputs: tau_B, angle" in only(held=HELD | {"plant.power": 1})
