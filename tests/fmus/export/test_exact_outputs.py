"""Outputs whose start is set, while the states that are integrated follow from it."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from cosim.errors import CallFailed
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import build
from fmus.export.describe import describe
from fmus.export.python.in_process import InProcessSlave

from .parts import Turntable

OMEGA, STORED = np.array([0.1 + 0.2, -1 / 7]), np.array([0.3, 2 / 3])  # no short binary fractions
NAMES = "omega[1]", "omega[2]"


@pytest.fixture(params=["native", "python", "in-process"])
def table(request, tmp_path):
    if request.param == "in-process":
        made = InProcessSlave("unit", Turntable(), CallFailed)
    else:
        made = FmuSlave("unit", build(Turntable(), tmp_path / "Turntable.fmu", request.param))
    made.instantiate()
    made.setup_experiment(0.0)
    return made


def references(made, *names):
    return tuple(made.description.variables[n].value_reference for n in names)


def put(made, values, *names):
    made.set_real(references(made, *names), np.array(values))


def got(made, *names):
    return made.get_real(references(made, *names))


def momentum(omega, stored):
    """L of the component, in this test's words."""
    return (1 + 0.1 * math.sin(0.3)) * np.array([[2.0, 0.3], [0.3, 1.5]]) @ omega + stored


def test_what_is_set_is_read_back_bit_for_bit_and_the_states_follow(table):
    put(table, OMEGA, *NAMES)  # before initialization mode
    table.enter_initialization_mode()
    assert got(table, *NAMES).tobytes() == OMEGA.tobytes()
    assert_allclose(got(table, "L[1]", "L[2]"), momentum(OMEGA, [0.2, -0.1]), rtol=1e-15)
    put(table, STORED, "stored[1]", "stored[2]")
    assert got(table, *NAMES).tobytes() == OMEGA.tobytes()  # the rates are what was said, whatever is stored
    put(table, OMEGA[::-1], *NAMES)
    assert got(table, *NAMES).tobytes() == OMEGA[::-1].tobytes()
    assert_allclose(got(table, "L[1]", "L[2]"), momentum(OMEGA[::-1], STORED), rtol=1e-15)
    energy = 0.5 * OMEGA[::-1] @ [[2.0, 0.3], [0.3, 1.5]] @ OMEGA[::-1]
    assert_allclose(got(table, "energy"), energy, rtol=1e-14)
    table.exit_initialization_mode()
    assert got(table, *NAMES).tobytes() == OMEGA[::-1].tobytes()


def test_it_flies_from_there_and_shows_what_the_states_say(table):
    """Against scipy, on the equations in this test's words; the stored momentum turns the table at once."""
    put(table, OMEGA, *NAMES)
    table.enter_initialization_mode()
    table.exit_initialization_mode()
    put(table, STORED, "stored[1]", "stored[2]")

    def rates(_, x):
        omega = np.linalg.solve([[2.0, 0.3], [0.3, 1.5]], x[2:] - STORED) / (1 + 0.1 * math.sin(x[0]))
        return [*omega, *(-0.7 * x[:2])]

    start = np.array([0.3, 0.1, *momentum(OMEGA, [0.2, -0.1])])
    assert_allclose(got(table, *NAMES), rates(0, start)[:2], rtol=1e-14)
    flown = solve_ivp(rates, (0, 0.5), start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    for k in range(5):
        table.do_step(k * 0.1, 0.1)
    assert_allclose(got(table, "angle[1]", "angle[2]", "L[1]", "L[2]"), flown, rtol=1e-11)
    assert_allclose(got(table, *NAMES), rates(0, flown)[:2], rtol=1e-11)


def test_it_is_set_no_more_after_initialization(table):
    table.enter_initialization_mode()
    table.exit_initialization_mode()
    with pytest.raises(CallFailed, match=r"variable omega\[1\] cannot be set now"):
        put(table, OMEGA, *NAMES)


def test_reset_and_fmu_state(table):
    table.enter_initialization_mode()
    put(table, OMEGA, *NAMES)
    momenta = got(table, "L[1]", "L[2]")
    state = table.get_state()
    put(table, 2 * OMEGA, *NAMES)
    table.set_state(table.deserialize_state(table.serialize_state(state)))
    assert got(table, *NAMES).tobytes() == OMEGA.tobytes()
    assert got(table, "L[1]", "L[2]").tobytes() == momenta.tobytes()
    table.exit_initialization_mode()
    table.do_step(0.0, 0.1)
    if not table.reset():  # a python FMU's is made anew by the master
        return
    table.setup_experiment(0.0)
    table.enter_initialization_mode()
    assert got(table, *NAMES).tolist() == [0.1, 1 / 3]


@pytest.mark.parametrize("derivatives", [True, False], ids=["native", "python"])
def test_what_the_description_says(derivatives):
    said = describe(Turntable(), "Turntable", derivatives=derivatives)
    omega = said.variables["omega[2]"]
    assert (omega.causality, omega.variability, omega.initial, omega.start) == ("output", "continuous", "exact", 1 / 3)
    assert omega.is_parameter and not set(NAMES) & said.initial_unknowns.keys()
    moved = {"stored[1]", "stored[2]"} | ({"angle[1]", "L[1]", "L[2]"} if derivatives else set())
    assert set(said.dependencies["omega[1]"]) == moved
    assert {"omega[1]", "omega[2]"} <= set(said.initial_unknowns["energy"])
    if derivatives:
        needed = {"omega[1]", "omega[2]", "angle[1]", "stored[2]", "J[2,1]", "J[2,2]"}
        assert set(said.initial_unknowns["L[2]"]) == needed
    assert said.feedthrough("omega[1]") == ("stored[1]", "stored[2]") and not said.initial_feedthrough("omega[1]")
