"""Names of units as tools read them that take them for expressions (pint), with m2 as m^2."""

import re

import pytest

from components.framework.units import UNITS

pytestmark = pytest.mark.peers

BASES = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "radian": "rad"}
OTHER = {"Hz"}  # display of rad/s: to pint 1/s, without the angle of a turn


def read(registry, name):
    """One of a unit in pint's words; digits after a letter are exponents, as such tools have it for FMI's names."""
    return registry.Quantity(1, registry.Unit(re.sub(r"([a-zA-Z])(\d+)", r"\1^\2", name)))


@pytest.fixture(scope="module")
def registry():
    return pytest.importorskip("pint").UnitRegistry()


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_means_the_same(registry, name):
    found = read(registry, name).to_base_units()
    exponents = {BASES[base]: float(power) for base, power in dict(found.unit_items()).items()}
    assert exponents == {base: float(power) for base, power in UNITS[name].exponents.items()}
    assert found.magnitude == pytest.approx(1, rel=1e-15)


@pytest.mark.parametrize(
    ("unit", "shown"), [(name, shown) for name, unit in UNITS.items() for shown in unit.display if shown not in OTHER]
)
def test_a_display_unit_means_the_same(registry, unit, shown):
    """So many of what is shown are one of the unit; constants have 16 digits."""
    found = read(registry, unit).to(read(registry, shown).units).magnitude
    assert found == pytest.approx(UNITS[unit].display[shown], rel=1e-14)
