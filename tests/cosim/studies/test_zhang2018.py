"""The systems of zhang2018 against the paper's numbers."""

import dataclasses

import numpy as np
import pytest

from components.catalog import CATALOG
from cosim import Explicit, Iterated
from cosim.errors import UnknownName
from cosim.studies import papers
from cosim.studies.papers.zhang2018 import system, tracking
from cosim.system import Value
from cosim.system.expand import wire
from fmus.export.python.in_process import describe_in_process

from . import zhang2018_reference as outside
from .zhang2018_runs import (
    ATC,
    KINDS,
    NAMES,
    PPATC,
    PPATC_HALF,
)


@pytest.mark.parametrize("name", NAMES)
def test_the_system_is_complete(name):
    flight, experiment = papers.scenario(name)
    assert flight.name == name
    assert set(flight.components) == {"guidance", "environment", "controller", "plant"}
    stiff = name in (f"{PPATC}-rad", f"{PPATC_HALF}-rad")
    step, every = (5e-4, 20) if stiff else (1e-3, 10)
    assert (experiment.stop_time, experiment.communication_step_size, experiment.every) == (200.0, step, every)
    fed = [c.target for c in flight.connections] + list(flight.held)
    controller = ["q_BN", "omega_BN_B", "q_RN", "omega_RN_R", "omega_dot_RN_R"]
    assert sorted(fed) == sorted(
        [f"controller.{n}" for n in controller] + [f"plant.{n}" for n in ("tau_B", "h_B", "tau_dist_B")]
    )
    timings = {c.target: c.timing for c in flight.connections}
    assert all(timings[f"controller.{n}"] == "smooth" for n in controller)
    assert timings["plant.tau_B"] == "at_point" and timings["plant.tau_dist_B"] == "smooth"
    assert isinstance(experiment.master, Iterated if stiff else Explicit)
    assert {p.split(".")[0] for p in flight.parameters} <= {"*", *flight.components}
    assert flight.parameters["*.solver.step"] == Value(1e-3, "s")


@pytest.mark.parametrize("name", NAMES)
def test_the_system_fits_its_components(name):
    """All inputs fed, every parameter known, every unit convertible: nothing is left to complain about."""
    flight, _ = papers.scenario(name)
    descriptions = {
        instance: describe_in_process(CATALOG[reference]()) for instance, reference in flight.components.items()
    }
    settings = {str(port): value for port, value in wire(flight, descriptions).settings.items()}
    assert settings["controller.angle_unit"] == pytest.approx(1.0 if name.endswith("-rad") else np.pi / 180)
    assert settings["controller.hold_step"] == 0
    assert settings["guidance.amplitude[2]"] == pytest.approx(np.pi / 180)
    assert settings["plant.delta[6,3]"] == 2.73
    assert settings["controller.J[2,3]"] == settings["plant.J[2,3]"] == 9.4


def test_vehicle():
    vehicle = papers.scenario(PPATC)[0].vehicle
    values = {name: np.array(v.value if isinstance(v, Value) else v) for name, v in vehicle.items()}
    np.testing.assert_array_equal(values["J"], outside.HUB)
    np.testing.assert_array_equal(values["delta"], outside.BOTH.T)
    np.testing.assert_allclose(values["Omega"], outside.OMEGA, rtol=1e-15)
    np.testing.assert_array_equal(values["zeta"], np.full(8, 0.005))


def test_half_gains():
    full, half = papers.scenario(PPATC)[0].parameters, papers.scenario(PPATC_HALF)[0].parameters
    changed = {name for name in full if full[name] != half[name]}
    assert changed == {"controller.K", "controller.tau_w", "controller.tau_mu"}
    assert half["controller.K"] == [0.25, 0.05, 0.25]
    assert (half["controller.tau_w"], half["controller.tau_mu"]) == (0.25, 0.25)


@pytest.mark.parametrize("name", KINDS)
def test_the_other_reading_has_another_unit_of_angle_and_nothing_else(name):
    degrees, radians = papers.scenario(name)[0], papers.scenario(f"{name}-rad")[0]
    assert {n for n in degrees.parameters if degrees.parameters[n] != radians.parameters[n]} == {
        "controller.angle_unit"
    }
    assert dataclasses.replace(radians, name=name, parameters=degrees.parameters) == degrees


def test_atc_has_the_same_gains_and_no_performance_bounds():
    ppatc, atc = papers.scenario(PPATC)[0].parameters, papers.scenario(ATC)[0].parameters
    extra = {f"controller.{name}" for name in ("rho_0", "rho_inf", "k", "overshoot")}
    assert set(ppatc) - set(atc) == extra
    assert all(atc[name] == ppatc[name] for name in atc)


def test_initial_attitude_is_the_product_of_three_rotations():
    q, _ = system.initial_attitude()
    phi, th, psi = np.radians([0.25, 0.15, -0.20])
    x = np.array([[1, 0, 0], [0, np.cos(phi), np.sin(phi)], [0, -np.sin(phi), np.cos(phi)]])
    y = np.array([[np.cos(th), 0, -np.sin(th)], [0, 1, 0], [np.sin(th), 0, np.cos(th)]])
    z = np.array([[np.cos(psi), np.sin(psi), 0], [-np.sin(psi), np.cos(psi), 0], [0, 0, 1]])
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    dcm_BN = (w**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) - 2 * w * skew  # v_B = dcm_BN v_N
    np.testing.assert_allclose(dcm_BN, z @ y @ x, atol=1e-15)
    assert w > 0


def test_euler_rates_are_those_of_the_turning_body():
    """Equation (3) at a large attitude: angles of a body that turns with omega change with theta'."""
    theta, theta_dot, h = np.array([0.4, -0.7, 1.1]), np.array([0.3, 0.2, -0.5]), 1e-6
    omega = outside.euler_kinematics(theta, theta_dot)[0] @ theta_dot
    q = outside.quaternion(np.array([theta - h * theta_dot, theta, theta + h * theta_dot]))
    rate = (q[2] - q[0]) / (2 * h)
    w, v = q[1][0], q[1][1:]
    product = w * rate[1:] - rate[0] * v - np.cross(v, rate[1:])  # q* (x) q', vector part
    np.testing.assert_allclose(2 * product, omega, atol=1e-9)
    np.testing.assert_allclose(tracking.angles(q[1:2])[0], np.degrees(theta), atol=1e-10)


def test_initial_rate_is_that_of_the_paper():
    q, omega = system.initial_attitude()
    F_inverse, _ = outside.euler_kinematics(np.radians(tracking.angles(q[None]))[0], np.zeros(3))
    np.testing.assert_allclose(np.degrees(np.linalg.solve(F_inverse, omega)), [0.02, 0.01, -0.02], atol=1e-14)


def test_disturbance_and_reference_are_those_of_the_paper():
    p = {
        name.split(".", 1)[1]: v.value
        for name, v in papers.scenario(PPATC)[0].parameters.items()
        if name.startswith("env")
    }
    for t in (0.0, 123.4):
        angle = p["frequency"] * t
        torque = np.array(p["bias"]) + np.array(p["sine"]) * np.sin(angle) + np.array(p["cosine"]) * np.cos(angle)
        np.testing.assert_allclose(torque, outside.disturbance(t), atol=1e-17)


def test_registry():
    assert [name for name in papers.describe() if name.startswith("zhang2018-")] == NAMES
    assert all(paper.title and paper.settled for paper in papers.PAPERS.values())
    assert all(papers.describe().values())


def test_unknown_names_are_answered_with_the_nearest():
    with pytest.raises(UnknownName, match='Did you mean "zhang2018-ppatc"'):
        papers.scenario("zhang2018-ppact")
    with pytest.raises(UnknownName, match=r'unknown paper "zhang2019".*"zhang2018"'):
        papers.find("zhang2019")
    with pytest.raises(UnknownName, match='Did you mean "zhang2018-atc-half-rad"'):
        papers.scenario("zhang2018-atc-half-grad")
    with pytest.raises(UnknownName, match=r'unknown reading "radian".*Did you mean "radians"\? .*degrees, radians'):
        system.read("radian")
