"""--master, --inputs, --extrapolation, --master-tolerance."""

import pytest

from cosim.cli import masters
from cosim.errors import NotSupported, UnknownName
from cosim.masters.error_controlled import ErrorControlled
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated

OWN = Explicit(extrapolation=1)


@pytest.mark.parametrize(
    ("name", "master"),
    [
        (None, OWN),
        ("explicit", OWN),
        ("jacobi", Explicit("jacobi")),
        ("plain", Explicit("plain")),
        ("gauss-seidel", Explicit("gauss_seidel")),
        ("gauss_seidel", Explicit("gauss_seidel")),
        ("iterated", Iterated()),
        ("error-controlled", ErrorControlled()),
    ],
)
def test_names(name, master):
    assert masters.choose(OWN, name) == master


def test_settings():
    assert masters.choose(None, extrapolation=1, inputs="smooth") == Explicit(inputs="smooth", extrapolation=1)
    assert masters.choose(None, "iterated", inputs="ramp", tolerance=1e-6) == Iterated("ramp", 1e-6)
    assert masters.choose(None, "error-controlled", tolerance=1e-5) == ErrorControlled(relative=1e-5)
    assert masters.choose(Iterated("ramp"), tolerance=1e-5) == Iterated("ramp", 1e-5)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"name": "newton"}, 'unknown master "newton" in --master.*iterated, error-controlled'),
        ({"name": "iterated", "extrapolation": 1}, "Iterated has no setting extrapolation. Choose --master explicit"),
        ({"tolerance": 1e-6}, "Explicit has no setting tolerance. Choose --master iterated"),
        ({"name": "error-controlled", "inputs": "ramp"}, "no setting inputs. Choose --master .*iterated"),
        ({"name": "iterated", "inputs": "held"}, 'unknown inputs "held" in Iterated.*smooth, ramp'),
        ({"name": "iterated", "tolerance": 0.0}, "tolerance = 0. It must be above 0"),
        ({"name": "error-controlled", "tolerance": -1e-6}, "relative = -1e-06. A tolerance must be above 0"),
    ],
)
def test_what_there_is_not(given, text):
    with pytest.raises((UnknownName, NotSupported), match=text):
        masters.choose(None, **given)
