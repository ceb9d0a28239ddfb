"""Every component of the catalog as an FMU of both back ends: FMI's rules, feedthrough, derivatives, independence."""

from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from numpy.testing import assert_allclose

from components.catalog import CATALOG
from cosim.slaves.fmi2 import FmuSlave
from fmus.description.names import split_element
from fmus.export.build import build_reference

from .compiling import complaints
from .fmi_rules import fmi_rule_breaches

BACKENDS = ("native", "python")


@pytest.fixture(params=[(name, backend) for name in CATALOG for backend in BACKENDS], ids="-".join)
def fmu(request):
    return build_reference(*request.param)


@pytest.fixture(params=CATALOG)
def native(request):
    return FmuSlave("unit", build_reference(request.param))


def test_its_sources_have_nothing_that_a_compiler_warns_of(native, tmp_path):
    with ZipFile(native.path) as archive:
        archive.extractall(tmp_path)
    assert complaints(tmp_path / "sources", "-fsyntax-only") == ""


def begin(slave):
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    return slave


def start(slave):
    begin(slave).exit_initialization_mode()
    return slave


def test_fmpy_has_nothing_to_report(fmu):
    assert validate_fmu(str(fmu)) == []


def test_no_rule_of_model_structure_is_broken(fmu):
    assert fmi_rule_breaches(fmu) == []


def test_it_runs_alone(fmu):
    rows = fmpy.simulate_fmu(str(fmu), stop_time=0.02, step_size=0.001, output_interval=0.001)
    assert len(rows) == 21
    assert all(np.isfinite(rows[name]).all() for name in rows.dtype.names)


def test_its_model_structure_says_the_direct_feedthrough_of_the_equations(fmu):
    interface = FmuSlave("unit", fmu).description
    said: dict[str, set[str]] = {}
    for output in interface.real_outputs:
        inputs = {split_element(name)[0] for name in interface.feedthrough(output.name)}
        said.setdefault(split_element(output.name)[0], set()).update(inputs)
    component = CATALOG[fmu.stem]()
    table = {output: set(inputs) for output, inputs in component.direct_feedthrough.items()}
    table |= {s.name: set() for s in component.states if s.output}
    assert said == {output: inputs for output, inputs in table.items() if output in said}
    assert set(said) == {o for o in table if any(split_element(v.name)[0] == o for v in interface.real_outputs)}


def test_two_instances_do_not_disturb_each_other(fmu):
    alone, first, second = (start(FmuSlave(name, fmu)) for name in ("alone", "first", "second"))
    everything = tuple(v.value_reference for v in alone.description.variables.values())
    for k in range(3):
        alone.do_step(k * 1e-3, 1e-3)
    first.do_step(0.0, 1e-3)
    for k in range(3):
        second.do_step(k * 1e-3, 1e-3)
    for k in range(1, 3):
        first.do_step(k * 1e-3, 1e-3)
    expected = alone.get_real(everything).tobytes()
    assert first.get_real(everything).tobytes() == expected
    assert second.get_real(everything).tobytes() == expected


@pytest.mark.parametrize("initial", [True, False], ids=["initialization", "step"])
def test_directional_derivatives_are_those_of_finite_differences(native, initial):
    slave = begin(native)
    if not initial:
        slave.exit_initialization_mode()
        slave.do_step(0.0, 1e-3)
    interface = slave.description
    knowns = tuple(v.value_reference for v in interface.inputs)
    listed = interface.initial_unknowns if initial else interface.dependencies
    unknowns = tuple(interface.variables[n].value_reference for n in listed if n not in interface.step_means or initial)
    if not knowns or not unknowns or interface.sampled:
        return
    rng, start_values = np.random.default_rng(3), slave.get_real(knowns)
    size = np.maximum(np.abs(start_values), 1e-2)
    point = start_values + 0.1 * size * rng.uniform(0.1, 1, len(knowns))  # at an equilibrium norms and signs have kinks
    seed = size * rng.uniform(-1, 1, len(knowns))

    def value(step: float):
        slave.set_real(knowns, point + step * seed)
        return slave.get_real(unknowns)

    def differences(h: float):
        return (value(h) - value(-h)) / (2 * h)

    # Central differences, extrapolated: truncation of order h^4, rounding of eps / h, both below 1e-8 here.
    h = 2e-4
    expected = (4 * differences(h / 2) - differences(h)) / 3
    slave.set_real(knowns, point)
    size = np.max(np.abs(value(0.0)) + np.abs(expected))
    assert_allclose(slave.directional_derivative(unknowns, knowns, seed), expected, atol=1e-7 * size + 1e-12)
