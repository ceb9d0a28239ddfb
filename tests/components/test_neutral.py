"""The start values: one vehicle for all, nothing that acts unasked, and gains that suit that vehicle."""

import numpy as np
import pytest
from helpers import Monolithic, Point
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from components.catalog import CATALOG

VEHICLE = ("J", "delta", "Omega", "zeta", "rotor_momentum", "spin_axes_B", "wheel_inertia", "gimbal_axes_B")
AT_REST = ("q_BN", "q_RN", "q_SN", "q_TS", "omega_BN_B", "omega_RN_R", "omega_SN_S", "omega_TS_T", "eta", "eta_dot")
STRUCTURE = {"modes": 4, "gimbals": 4, "wheels": 3}
LAWS = [
    "AdaptiveL2Gain",
    "AdaptiveL2GainTracking",
    "AdaptiveTracking",
    "IntegralSlidingMode",
    "LinearQuadraticRegulator",
    "PID",
    "PrescribedPerformance",
    "QuaternionFeedback",
]
IDENTITY = [1.0, 0.0, 0.0, 0.0]


def made(name):
    bare = CATALOG[name]()
    return bare.variant(**{k: v for k, v in STRUCTURE.items() if k in bare.structure})


def test_one_vehicle_for_all():
    """Components of one structure have one value of a vehicle parameter, whatever paper they were made for."""
    found = {}
    for name in CATALOG:
        for v in made(name).parameters:
            if v.name in VEHICLE:
                found.setdefault(v.name, []).append((name, v.start))
    assert {"J", "delta", "Omega", "zeta"} <= {n for n, values in found.items() if len(values) > 2}
    for values in found.values():
        for _, value in values[1:]:
            assert_array_equal(value, values[0][1])


@pytest.mark.parametrize("name", CATALOG)
def test_attitudes_are_the_identity_and_nothing_turns(name):
    part = CATALOG[name]()
    settable = [*part.inputs, *(s for s in part.states if not s.calculated)]
    for v in settable:
        if v.name.removesuffix("_true") in AT_REST:
            expected = IDENTITY if v.name.startswith("q_") else np.zeros(v.shape)
            assert_array_equal(v.start, np.broadcast_to(expected, v.shape), err_msg=v.name)


@pytest.mark.parametrize(
    "name", ["HarmonicTorque", "LowOrbit", "EulerSinusoid", "BodyRateSinusoid", "Slew", "AttitudeStep"]
)
def test_what_is_not_asked_for_does_not_act(name):
    """No disturbance, and a reference at rest in N, at any time."""
    for t in (0.0, 0.3, 1e3):
        for output, value in Point(CATALOG[name](), t=t).outputs().items():
            if output.startswith(("tau", "f_", "omega")):
                assert not np.any(value), output
            if output == "q_RN":
                assert_array_equal(value, IDENTITY)


@pytest.mark.parametrize("name", CATALOG)
def test_no_noise(name):
    """An estimator's are what it assumes."""
    part, words = CATALOG[name](), ("noise", "random_walk", "gust_density")
    noisy = [v for v in part.parameters if any(word in v.name for word in words)]
    assert part.role == "estimator" or not any(np.any(v.start) for v in noisy)


@pytest.mark.parametrize("law", LAWS)
def test_gains_suit_the_vehicle(law):
    """From 5 deg about a skew axis and turning, with its modes, every law brings it within 0.1 deg in 120 s."""
    turned = Rotation.from_rotvec(np.array([3.0, -3.0, 2.6]), degrees=True).as_quat(scalar_first=True)
    controller, plant = CATALOG[law](), CATALOG["FlexibleSpacecraft"]
    modes = controller.structure.get("modes", 4)
    parts = {
        "plant": plant(modes=modes, q_BN=turned, omega_BN_B=[1e-3, 1e-3, -1e-3]),
        "controller": controller,
        "guidance": CATALOG["EulerSinusoid"](),
    }
    links = [("controller.tau_command_B", "plant.tau_B")]
    names = [v.name for v in controller.inputs]
    links += [(f"plant.{n}", f"controller.{n}") for n in ("q_BN", "omega_BN_B", "eta", "eta_dot") if n in names]
    links += [(f"guidance.{n}", f"controller.{n}") for n in ("q_RN", "omega_RN_R", "omega_dot_RN_R")]
    system, t = Monolithic(parts, links), np.linspace(0, 180.0, 361)
    rows = system.split(system.solve(t, rtol=1e-7, atol=1e-10))
    error = np.degrees(Rotation.from_quat(rows["plant.q_BN"], scalar_first=True).magnitude())
    assert error[t >= 120].max() < 0.1
    assert error.max() < 5.5


def test_gains_of_the_law_with_a_cluster_suit_the_vehicle():
    """HybridAdaptive, from 5 deg and turning, with gyros and wheels that have one axis off by 0.03."""
    turned = Rotation.from_rotvec(np.array([3.0, -3.0, 2.6]), degrees=True).as_quat(scalar_first=True)
    off = np.zeros((3, 4))
    off[0, 1] = 0.03
    parts = {
        "plant": CATALOG["FlexibleSpacecraft"](modes=0, q_BN=turned, omega_BN_B=[1e-3, 1e-3, -1e-3]),
        "actuators": CATALOG["CmgCluster"](rotor_deviation=off),
        "controller": CATALOG["HybridAdaptive"](),
        "guidance": CATALOG["BodyRateSinusoid"](),
    }
    links = [(f"plant.{n}", f"controller.{n}") for n in ("q_BN", "omega_BN_B")]
    links += [(f"guidance.{n}", f"controller.{n}") for n in ("q_RN", "omega_RN_R", "omega_dot_RN_R")]
    links += [(f"actuators.{n}", f"controller.{n}") for n in ("gimbal_angle", "wheel_speed")]
    links += [(f"controller.{n}", f"actuators.{n}") for n in ("gimbal_rate_command", "wheel_acceleration_command")]
    links += [("actuators.h_B", "plant.h_B")]
    system, t = Monolithic(parts, links), np.linspace(0, 180.0, 361)
    rows = system.split(system.solve(t, rtol=1e-7, atol=1e-10))
    error = np.degrees(Rotation.from_quat(rows["plant.q_BN"], scalar_first=True).magnitude())
    assert error[t >= 120].max() < 0.1


def test_gains_of_the_drag_free_law_suit_its_satellite():
    """From 1 mm and 1 deg: the test mass to a tenth of a per cent of that in 300 s, on its orbit."""
    turned = Rotation.from_rotvec([1.0, 0, 0], degrees=True).as_quat(scalar_first=True)
    controller = CATALOG["DragFreeBackstepping"]()
    plant = CATALOG["DragFreeSatellite"](r_rel=[1e-3, -1e-3, 1e-3], q_TS=turned, q_SN=turned)
    parts = {"plant": plant, "controller": controller, "guidance": CATALOG["AttitudeStep"]()}
    reference, outputs = ("q_RN", "omega_RN_R", "omega_dot_RN_R"), [o.name for o in controller.outputs_declared]
    links = [(f"guidance.{n}", f"controller.{n}") for n in reference]
    links += [(f"plant.{v.name}", f"controller.{v.name}") for v in controller.inputs if v.name not in reference]
    links += [(f"controller.{v.name}", f"plant.{v.name}") for v in plant.inputs if v.name in outputs]
    system, t = Monolithic(parts, links), np.linspace(0, 300.0, 301)
    rows = system.split(system.solve(t, rtol=1e-9, atol=1e-12))
    assert np.abs(rows["plant.r_rel"][-1]).max() < 1e-6
    for name in ("q_TS", "q_SN"):
        q = Rotation.from_quat(rows[f"plant.{name}"][-1], scalar_first=True)
        assert np.degrees(q.magnitude()) < 1e-2
