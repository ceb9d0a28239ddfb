"""One component, three slaves: python FMU, native FMU and in-process slave give one trajectory."""

import numpy as np
import pytest

from components.catalog import CATALOG
from cosim.errors import CallFailed
from cosim.slaves.fmi2 import FmuSlave
from fmus import toolchain
from fmus.export.build import build
from fmus.export.python.in_process import InProcessSlave

from .parts import every

PARTS = {name: part for name, part in every().items() if name != "Blowup"}  # that one is there to fail
COMPONENTS = {**CATALOG, **{name: (lambda part=part: part) for name, part in PARTS.items()}}
KINDS = ("native", "python", "in-process")
STEPS, H = 1000, 2e-3


@pytest.fixture(scope="module")
def slaves(tmp_path_factory):
    """Make a slave of a component, between fmi2Instantiate and initialization; an FMU is built once."""
    folder, components = tmp_path_factory.mktemp("twins"), {name: make() for name, make in COMPONENTS.items()}

    def slave(kind: str, name: str):
        component = components[name]
        if kind == "in-process":
            made = InProcessSlave("unit", component, CallFailed)
        else:
            path = folder / kind / f"{name}.fmu"
            made = FmuSlave("unit", path if path.exists() else build(component, path, kind))
        made.instantiate()
        return made

    return slave


def start(made):
    made.setup_experiment(0.0)
    made.enter_initialization_mode()
    made.exit_initialization_mode()
    return made


def common(made) -> tuple[int, ...]:
    """Value references of what all three have: everything but the state derivatives."""
    return tuple(v.value_reference for n, v in made.description.variables.items() if not n.startswith("der("))


def fly(made, steps: int) -> np.ndarray:
    """Drive the inputs by smooth functions around their starts; every variable after each step, a row a step."""
    inputs = [v for v in made.description.inputs]
    references = tuple(v.value_reference for v in inputs)
    starts = np.array([v.start for v in inputs])
    rows = []
    for k in range(steps):
        if inputs:
            made.set_real(references, starts * (1 + 1e-3 * np.sin(0.01 * k + np.arange(len(inputs)))))
        made.do_step(k * H, H)
        rows.append(made.get_real(common(made)))
    return np.array(rows)


@pytest.mark.parametrize("name", COMPONENTS)
def test_the_three_slaves_give_one_trajectory(name, slaves):
    native, python, in_process = (fly(start(slaves(k, name)), STEPS) for k in KINDS)
    largest = np.maximum(np.abs(native).max(axis=0), 1e-300)
    assert np.max(np.abs(python - native) / largest, initial=0) < 1e-12
    assert np.max(np.abs(in_process - native) / largest, initial=0) < 1e-12


@pytest.mark.parametrize("name", ["FlexibleSpacecraft", "PrescribedPerformance"])
def test_the_compiler_s_optimisation_leaves_the_bits(name, slaves, tmp_path, monkeypatch):
    """Sums stay in the order in which they are written, and no product is fused with one."""
    assert "-O3" in toolchain.FLAGS
    optimised = fly(start(slaves("native", name)), STEPS)
    monkeypatch.setattr(toolchain, "FLAGS", tuple("-O0" if flag == "-O3" else flag for flag in toolchain.FLAGS))
    plain = FmuSlave("unit", build(COMPONENTS[name](), tmp_path / "plain.fmu", "native"))
    plain.instantiate()
    assert fly(start(plain), STEPS).tobytes() == optimised.tobytes()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", COMPONENTS)
def test_a_step_taken_again_from_a_saved_state_has_the_same_bits(name, kind, slaves):
    made = start(slaves(kind, name))
    fly(made, 5)
    state = made.get_state()
    made.do_step(5 * H, H)
    expected = made.get_real(common(made))
    made.do_step(6 * H, H)
    made.set_state(state)
    made.do_step(5 * H, H)
    assert made.get_real(common(made)).tobytes() == expected.tobytes()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", COMPONENTS)
def test_a_serialized_state_restores_into_a_new_instance(name, kind, slaves):
    made = start(slaves(kind, name))
    fly(made, 5)
    data = made.serialize_state(made.get_state())
    made.do_step(5 * H, H)
    fresh = slaves(kind, name)
    fresh.set_state(fresh.deserialize_state(data))
    fresh.do_step(5 * H, H)
    assert fresh.get_real(common(fresh)).tobytes() == made.get_real(common(made)).tobytes()
