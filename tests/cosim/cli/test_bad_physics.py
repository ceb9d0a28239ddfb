"""Vehicles, orbits, axes and gains that cannot be, at the command line."""

import pytest

from ..own_files import HELD, TORQUE, WIRED

PLANE, SKEWED = "[[1, 0, 0.6], [0, 1, 0.8], [0, 0, 0]]", "[[1, 0, 0.6], [0, 1, 0], [0, 0, 0.9]]"

REFUSED = {  # what is wrong -> system, setting, the instance that says so, its message; a number of rounding left out
    "inertia": (
        "zhang2018-ppatc",
        "plant.J=[[400, 0, 0], [0, -410, 0], [0, 0, 690]]",
        "plant",
        ["FlexibleSpacecraft: J is not positive definite (smallest eigenvalue -410 kg.m2). Check its diagonal."],
    ),
    "inertia of a controller": (
        "ye2016-adaptive",
        "controller.J=[[0, 0, 0], [0, 0, 0], [0, 0, 0]]",
        "controller",
        ["HybridAdaptive: J is not positive definite (smallest eigenvalue 0 kg.m2). Check its diagonal."],
    ),
    "triangle inequality": (
        "xiao2011-l2gain",
        "plant.J=[[1200, 0, 0], [0, 1000, 0], [0, 0, 2500]]",
        "plant",
        [
            "FlexibleSpacecraft_modes3: J breaks the triangle inequality: its largest principal moment 2500 kg.m2 is "
            "more than the sum 2200 kg.m2 of the others."
        ],
    ),
    "modes": (
        "xiao2011-l2gain",
        "plant.delta[3,3]=-40",
        "plant",
        [
            "FlexibleSpacecraft_modes3: J - delta^T delta is not positive definite (smallest eigenvalue -100 kg.m2). "
            "The modes hold more inertia than J."
        ],
    ),
    "wheel axis": (
        "xiao2011-l2gain",
        f"actuators.spin_axes_B={SKEWED}",
        "actuators",
        ["ReactionWheels: axis 3 of spin_axes_B has length 1.08167, a unit vector (within 0.001) is needed."],
    ),
    "wheel axes": (
        "xiao2011-l2gain",
        f"actuators.spin_axes_B={PLANE}",
        "actuators",
        [
            "ReactionWheels: axes spin_axes_B do not span three dimensions (smallest eigenvalue of A A^T",
            "about one axis",
        ],
    ),
    "gimbal axis": (
        "ye2016-adaptive",
        "actuators.gimbal_axes_B[3,2]=1",
        "actuators",
        ["CmgCluster: axis 2 of gimbal_axes_B has length 1.29099, a unit vector (within 0.001) is needed."],
    ),
    "gimbal axis of a controller": (
        "ye2016-adaptive",
        "controller.gimbal_axes_B[3,2]=1",
        "controller",
        ["HybridAdaptive: axis 2 of gimbal_axes_B has length 1.29099, a unit vector (within 0.001) is needed."],
    ),
    "rotor axes": (
        "geng2012-linear",
        "actuators.rotor_deviation=[[-1, 0], [0, 0], [0, 0]]",
        "actuators",
        [
            "CmgCluster_gimbals2: rotor_deviation leaves gyro 1 no rotor axis: rotor_axes_B + rotor_deviation has "
            "length 0, more than 0.001 is needed."
        ],
    ),
    "quaternion of a controller": (
        "xiao2011-pid",
        "plant.q_BN=[0, 0, 0, 0]",
        "controller",
        ["PID: q_BN has norm 0 at the start, a unit quaternion (within 1e-6) is needed. Divide it by its norm."],
    ),
    "orbit": (
        "xiao2011-l2gain",
        "guidance.orbit_rate=1.3e-3",
        "guidance",
        [
            "OrbitFrame: orbit_rate = 0.0013 rad/s: the orbit is below the surface of the Earth, where a circle has "
            "0.00123945 rad/s."
        ],
    ),
    "orbit of a plant": (
        "li2014-nn",
        "plant.r_N=[6e6, 0, 0]",
        "plant",
        ["DragFreeSatellite: r_N is 6000 km from the Earth's centre at the start", "the orbit is below the surface."],
    ),
    "weights": (
        "xiao2011-l2gain",
        f"controller.W_g={[[0.0] * 5] * 3}",
        "controller",
        [
            "AdaptiveL2Gain: ghat(0) of roll, row 1 of W_g times X over its inertia, is 0 1/(kg.m2), under its floor "
            "g_min = 0.000133333 1/(kg.m2). Start with larger weights or a smaller floor."
        ],
    ),
    "floor": (
        "xiao2011-l2gain",
        "controller.g_min=1.4e-3",
        "controller",
        [
            "AdaptiveL2Gain: ghat(0) of pitch, row 2 of W_g times X over its inertia, is 0.00131649 1/(kg.m2), under "
            "its floor g_min = 0.0014 1/(kg.m2)."
        ],
    ),
    "gains": (
        "ye2016-adaptive",
        "controller.k_1[2,2]=-0.18",
        "controller",
        ["HybridAdaptive: K = [k_1, k_2]: A_1 = A_0 - B_0 K is not Hurwitz"],
    ),
    "sign of a gain": (
        "geng2012-linear",
        "controller.G_omega=[[30, 0, 0], [0, 30, 0], [0, 0, 30]]",
        "controller",
        [
            "IntegralSlidingMode: -G_omega is not positive definite (smallest eigenvalue of its symmetric part -30 "
            "N.m.s/rad): the torque G_omega w must oppose every w. Check the sign of G_omega."
        ],
    ),
    "option": (
        "geng2012-linear",
        "steering.trim_wheels=3",
        "steering",
        ["CmgSteering: trim_wheels = 3: it must be 0, 1 or 2."],
    ),
}

BOTH = ("inertia of a controller", "wheel axes", "gains")  # for the python back end too


class TestPhysics:
    """Vehicles, orbits, axes and gains that cannot be, refused by the component that has them."""

    @pytest.mark.parametrize(
        ("case", "backend"), [*((case, "native") for case in REFUSED), *((case, "python") for case in BOTH)]
    )
    def test_what_cannot_fly(self, refused, case, backend):
        system, setting, instance, words = REFUSED[case]
        text = refused("run", system, "--stop", "0.01", "--backend", backend, "--set", setting)
        assert f"InitializationFailed: {instance} cannot be initialized: fmi2ExitInitializationMode returned" in text
        assert all(part in text for part in words), text

    def test_a_plant_at_no_attitude(self, refused, folder):
        (folder / "wired.py").write_text(WIRED.format(connections=[TORQUE], held=HELD))
        text = refused("run", "wired.py", "--set", "plant.q_BN=[0, 0, 0, 0]")
        assert "InitializationFailed: plant cannot be initialized" in text
        assert (
            "FlexibleSpacecraft_modes1: q_BN has norm 0 at the start, a unit quaternion (within 0.001) is needed."
            in text
        )
