"""The outside reference of zhang2018: the equations file's figures from a second derivation."""

import numpy as np
import pytest

from cosim.studies import papers
from cosim.studies.papers.claims import judge
from cosim.studies.papers.zhang2018 import tracking

from . import zhang2018_reference as outside
from .zhang2018_runs import ATC, KINDS, PPATC, T, table


def test_reference_starts_as_the_equations_file_says():
    first = outside.reference("ppatc", 1.0, np.array([0.0, 0.01]))
    np.testing.assert_allclose(first["u"][0], [-0.656759, 0.546986, 0.199056], atol=1e-6)
    np.testing.assert_allclose(first["s"][0], [0.183090, -0.4525, -0.039572], atol=1e-6)
    np.testing.assert_allclose(first["eps"][0], [0.804719, 0, -0.346574], atol=1e-6)
    assert first["eta"][0].tolist() == [0.0] * 8


def test_reference_has_the_free_free_modes():
    frequencies, damping = outside.free_free()
    np.testing.assert_allclose(frequencies, [0.38534, 1.05350, 1.33163, 2.22827], atol=1e-4)
    assert damping == pytest.approx(0.00508, abs=1e-4)


def test_reference_keeps_momentum_and_loses_energy_as_the_dampers_say():
    """The plant of the reference: angular momentum follows the torque, energy the power and the damping."""
    loop = outside.Loop("atc", 1.0)
    rng = np.random.default_rng(1)
    x = np.concatenate([rng.normal(0, 0.5, 3), rng.normal(0, 0.1, 3), rng.normal(0, 0.1, 16), np.zeros(22)])
    _, omega, eta, eta_dot, _, _ = outside.split(x)
    _, omega_dot, _, eta_ddot, _, _ = outside.split(loop(0.0, x))
    torque = loop.control(0.0, x)["u"] + outside.disturbance(0.0)
    momentum = outside.HUB @ omega + outside.BOTH @ eta_dot
    rate = outside.HUB @ omega_dot + outside.BOTH @ eta_ddot
    np.testing.assert_allclose(rate + np.cross(omega, momentum), torque, atol=1e-10)
    power = omega @ rate + eta_dot @ (eta_ddot + outside.BOTH.T @ omega_dot) + eta_dot @ (outside.STIFFNESS * eta)
    assert power == pytest.approx(omega @ torque - eta_dot @ (outside.DAMPING * eta_dot), rel=1e-9)


@pytest.fixture(scope="module")
def reference_runs():
    return {name: outside.reference(kind, factor, T) for name, (kind, factor) in KINDS.items()}


@pytest.mark.slow
def test_reference_shows_the_figures_of_the_equations_file(reference_runs):
    ppatc, atc = reference_runs[PPATC], reference_runs[ATC]
    late = T >= 100
    np.testing.assert_allclose(ppatc["e"][late].mean(axis=0), [0.0025, 0.0025, -0.0025], atol=3e-5)
    assert ppatc["z"][:, 1].min() == pytest.approx(0.400, abs=0.003)
    assert ppatc["mu"][-1] == pytest.approx(0.052255, abs=1e-5)
    assert atc["mu"][-1] == pytest.approx(0.038704, abs=1e-5)
    lowest = atc["e"][:, 1].argmin()
    assert atc["e"][lowest, 1] == pytest.approx(-0.0433, abs=0.0005)
    assert T[lowest] == pytest.approx(4.9, abs=0.1)
    np.testing.assert_allclose(abs(atc["e"][late]).max(axis=0), [7.52e-5, 5.68e-5, 4.88e-5], atol=2e-6)
    for run in reference_runs.values():
        assert abs(run["eta"][:, :4] + run["eta"][:, 4:]).max() < 1e-12


@pytest.mark.slow
def test_verdicts_on_the_reference_are_those_of_the_equations_file(reference_runs):
    names = {"plant.q_BN": "q_BN", "guidance.q_RN": "q_RN", "plant.eta": "eta", "plant.eta_dot": "eta_dot"}
    runs = {
        name: table(T, **{there.replace(".", "__"): run[here] for there, here in names.items()})
        for name, run in reference_runs.items()
    }
    in_degrees = [c.alone[0] for c in papers.PAPERS["zhang2018"].claims]
    found = [v.verdict for v in judge(in_degrees, runs)]
    assert found == [
        "reproduced",
        "reproduced",
        "partly",
        "not reproduced",
        "not reproduced",
        "reproduced",
        "partly",
        "partly",
    ]
    e = tracking.tracking_error(runs[PPATC])
    np.testing.assert_allclose(e, reference_runs[PPATC]["e"], atol=1e-12)
