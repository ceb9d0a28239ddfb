"""What every component of the catalog must be: its units, its documents, its derivatives, its integrator."""

import ast
import io
import re
import subprocess
import sys
import tokenize
from pathlib import Path

import numpy as np
import pytest
from helpers import Point, assert_units, numbers
from numpy.testing import assert_allclose

import components
from components.catalog import CATALOG
from components.framework.units import UNITS

PACKAGE = Path(components.__file__).parent
MODULES = sorted(p for p in PACKAGE.rglob("*.py") if p.name != "__init__.py")
SPREADS = (0.1, 1e-4)  # of the random points: far from the start (barrier extended), and near it
every = pytest.mark.parametrize("name", CATALOG)


@every
@pytest.mark.parametrize("spread", SPREADS)
def test_declared_units_are_those_of_the_equations(name, spread):
    assert_units(CATALOG[name](), spread)


@every
def test_name_doc_unit(name):
    part = CATALOG[name]()
    assert part.name == name
    groups = (part.parameters, part.calculated_parameters, part.inputs, part.states, part.outputs_declared)
    for v in (v for group in groups for v in group):
        assert v.unit in UNITS and v.doc and v.doc[-1] != ".", v.name
        assert v.display_unit is None or v.display_unit in UNITS[v.unit].display, v.name
        assert all(ord(c) < 128 for c in v.name + v.doc), v.name


@every
@pytest.mark.parametrize("spread", SPREADS)
def test_finite_at_random_states(name, spread):
    rng = np.random.default_rng(2)
    for t in (0.0, 3.0, 1e3):
        point = Point(CATALOG[name](), rng, spread, t=t)
        assert np.isfinite(np.concatenate([point.rates_flat(), point.outputs_flat(), point.c])).all()


@every
def test_start_values_pass_check(name):
    assert Point(CATALOG[name]()).violated() == []


def quaternions(part):
    """What can be set and is a quaternion by its name and shape."""
    settable = (*part.inputs, *(s for s in part.states if not s.calculated), *part.parameters)
    return [v for v in settable if v.name.startswith("q_") and v.shape == (4,)]


@pytest.mark.parametrize(("name", "q"), [(n, v.name) for n, make in CATALOG.items() for v in quaternions(make())])
@pytest.mark.parametrize("size", [0.0, 2.0])
def test_what_is_no_unit_quaternion_is_refused(name, q, size):
    """By its name and its norm, and before a master meets what is no number."""
    point = Point(CATALOG[name](), **{q: [size, 0, 0, 0]})
    assert np.isfinite(np.concatenate([point.initial(), point.outputs_flat(), point.rates_flat()])).all()
    within = "1e-6" if q in {v.name for v in CATALOG[name]().inputs} else "0.001"  # who connects it does not type it
    text = f"{q} has norm {size:g} at the start, a unit quaternion (within {within}) is needed. Divide it by its norm."
    assert text in point.violated()


@pytest.mark.parametrize("name", [n for n in CATALOG if CATALOG[n]().exact_outputs])
def test_outputs_whose_start_is_set_are_the_inverse_of_the_initial_equations(name):
    """What `initial` makes of them, `outputs` gives back, but for the rounding of a few matrix products."""
    point = Point(CATALOG[name](), np.random.default_rng(6), 0.3)
    point.x = point.initial()
    assert_allclose(point.outputs_flat()[: len(point.e)], point.e, rtol=1e-12, atol=1e-12 * np.abs(point.e).max())


@every
@pytest.mark.parametrize("spread", SPREADS)
def test_directional_derivatives(name, spread):
    """forward and initial_forward against differences (order 4) along a random direction of everything."""
    part, rng, h = CATALOG[name](), np.random.default_rng(3), 1e-3
    point = Point(part, rng, spread, t=2.0)
    values = {n: getattr(point, n) for n in ("t", "x", "u", "p", "m", "e")}
    nominal = np.concatenate([np.full(v.size, 1e-2 * min(v.nominal or 1, 1)) for v in part.inputs] or [np.zeros(0)])
    size = {"t": 1.0, "x": np.abs(point.x), "u": nominal + np.abs(point.u), "p": np.abs(point.p), "m": 1.0}
    size["e"] = np.abs(point.e)
    seeds = {n: spread * size[n] * rng.normal(size=np.shape(v)) for n, v in values.items()}

    def at(steps):
        for n, value in values.items():
            setattr(point, n, value + steps * h * seeds[n])
        initial, rates = point.initial(), point.rates_flat()
        if part.sampled:  # its derivative is that of the outputs at a sample
            point.x, rates = rates, np.zeros(0)
        return np.concatenate([rates, point.outputs_flat(), initial])

    expected = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h)
    f = part.functions
    where = (values["t"], values["x"], values["u"], values["p"], numbers(f.calculate(values["p"])))
    s = list(seeds.values())
    initial = f.initial_forward(*where, values["e"], *s[:4], seeds["e"])[0]
    found = np.concatenate([numbers(v) for v in (*f.forward(*where, *s[:5]), initial)])
    rounding = 1e-15 / h  # of values of the size of one
    assert_allclose(found, expected, rtol=1e-5, atol=1e-8 * np.max(np.abs(expected)) + rounding)


FASTER = {  # than an orbit, whose position would hide the error in its rounding
    "DragFreeSatellite": {"mu": 0, "r_N": [0] * 3, "v_N": [0] * 3, "K": 10.0, "K_r": 0.05},
}


@pytest.mark.parametrize("name", [n for n in CATALOG if CATALOG[n]().states and not CATALOG[n]().sampled])
def test_advance_is_of_order_four(name):
    tracking = name in ("AdaptiveTracking", "PrescribedPerformance")
    names = [v.name for v in CATALOG[name]().parameters]
    faster = {"beta": 10.0, "gamma": 10.0} if tracking else FASTER.get(name, {})
    steps = (8, 16, 32) if tracking else (64, 128, 256) if "delta" in names else (32, 64, 128)  # modes: to 25 rad/s
    point, time = Point(CATALOG[name](), np.random.default_rng(4), 0.01, **faster), 0.4
    reference = point.advance(time / 1024, 1024)[:, -1]
    errors = [np.abs(point.advance(time / n, n)[:, -1] - reference).max() for n in steps]
    if max(errors) < 1e-12 * max(1.0, np.abs(reference).max()):
        return  # with its inputs held its motion is a polynomial of time, which the method integrates exactly
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (np.abs(slopes - 4) < 0.3).all(), (slopes, errors)


def numbered_comments(path: Path):
    """(line, equation number) of every comment that is an equation number."""
    for token in tokenize.generate_tokens(io.StringIO(path.read_text()).readline):
        if token.type == tokenize.COMMENT:
            for number in re.findall(r"\((\d+[a-z]?)\)", token.string):
                yield token.start[0], number


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.stem)
def test_equation_numbers_are_in_the_docstring(path):
    docstring = ast.get_docstring(ast.parse(path.read_text())) or ""
    assert docstring, "every module has a docstring"
    for line, number in numbered_comments(path):
        assert f"({number})" in docstring, f"{path.name}, line {line}: no equation ({number}) above"


@pytest.mark.parametrize("name", CATALOG)
def test_documents_of_a_component(name):
    docstring = sys.modules[CATALOG[name].__module__].__doc__
    assert "Source:" in docstring and "Limits:" in docstring
    assert "Frames:" in docstring or "Symbols:" in docstring


OPTIONS = [  # parameters that choose between numbered readings of a law: their documents begin with what 1 means
    (name, v.name)
    for name, make in CATALOG.items()
    for v in make().parameters
    if v.doc.startswith("1: ") and not v.name.startswith("solver.")
]


@pytest.mark.parametrize(("name", "option"), OPTIONS)
def test_an_option_is_one_of_its_numbers(name, option):
    for value in (-1.0, 0.3, 0.9, 7.0):
        messages = Point(CATALOG[name](), **{option: value}).violated()
        assert any(f"{option} = {value:g}: it must be 0" in message for message in messages), messages
    for value in (0.0, 1.0):
        messages = Point(CATALOG[name](), **{option: value}).violated()
        assert not any(option in message for message in messages), messages


def test_importing_the_catalog_builds_nothing():
    """Importing and listing the catalog makes no CasADi Function (a rebuild of nothing is to take no time)."""
    code = (
        "import casadi\n"
        "class Refused(casadi.Function):\n"
        "    def __init__(self, *arguments): raise SystemExit(f'a Function was built: {arguments[0]}')\n"
        "casadi.Function = Refused\n"
        "from components.catalog import CATALOG\n"
        "[make().inputs for make in CATALOG.values()]\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=PACKAGE.parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
