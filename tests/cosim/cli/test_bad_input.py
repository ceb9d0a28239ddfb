"""Bad input at the command line: one message with the way out, exit status 2, nothing written, nothing lost."""

import zipfile
from pathlib import Path

import fmpy
import pytest

from .. import own_files, tiny_fmu


@pytest.fixture
def refused(adcs, folder):
    """What a refused command says; that it ran nothing and wrote nothing is checked."""

    def call(*arguments):
        done = adcs(*arguments)
        assert (done.status, list(folder.rglob("result.*"))) == (2, [])
        return " ".join(done.err.replace("│", " ").split())

    return call


@pytest.fixture
def run(refused):
    return lambda *arguments: refused("run", "zhang2018-ppatc", "--stop", "0.01", *arguments)


class TestNames:
    def test_system(self, refused):
        text = refused("run", "zhang2018-pptc")
        assert 'UnknownName: unknown system "zhang2018-pptc"' in text
        assert 'Did you mean "zhang2018-ppatc"' in text
        assert "There: zhang2018-ppatc, zhang2018-atc, zhang2018-ppatc-half, zhang2018-atc-half" in text

    def test_component_or_system_to_build(self, refused):
        assert 'Did you mean "FlexibleSpacecraft"' in refused("build", "FlexibelSpacecraft")
        assert 'unknown component or system "zhang2018-act"' in refused("build", "zhang2018-act")
        assert "no variable 'mods'. Did you mean 'modes'" in refused("build", "FlexibleSpacecraft:mods=2")
        assert "modes = 'x' is not a whole number >= 0" in refused("build", "FlexibleSpacecraft:modes=x")
        assert "'modes' is not NAME=VALUE, as in" in refused("build", "FlexibleSpacecraft:modes")

    def test_paper(self, refused):
        assert 'unknown paper "zhang2081" in the list of papers. Did you mean "zhang2018"?' in refused(
            "reproduce", "zhang2081"
        )

    def test_instance(self, run):
        assert 'unknown component "contoller" in system "zhang2018-ppatc". Did you mean "controller"?' in run(
            "--use", "contoller=AdaptiveTracking"
        )
        assert 'unknown component "plnt" in parameter "plnt.J". Did you mean "plant"?' in run("--set", "plnt.J=1")

    def test_fmu(self, run):
        assert 'unknown component "AdaptiveTrackin". Did you mean "AdaptiveTracking"' in run(
            "--use", "controller=AdaptiveTrackin"
        )
        assert "nowhere.fmu: there is no such file" in run("--use", "controller=nowhere.fmu")
        assert "there is no file nowhere.py" in run("--use", "controller=nowhere.py:Law")

    def test_variable(self, run):
        assert 'unknown parameter "rho_imf" in component "controller". Did you mean "rho_inf"' in run(
            "--set", "controller.rho_imf=0.005 deg"
        )
        text = run("--set", "plant.J[4,1]=1")
        assert 'unknown element "J[4,1]" in component "plant". There: J[1,1] to J[3,3].' in text
        assert 'unknown parameter "Jay" in parameters of any component' in run("--set", "*.Jay=1")

    def test_every_mistake_at_once(self, run):
        text = run("--set", "plant.Jay=1", "--set", "controller.k=true", "--set", "plnt.J=1")
        assert text.startswith('WiringErrors: system "zhang2018-ppatc" has 3 mistakes:')


class TestOptions:
    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--step", "0"], "communication_step_size is 0.0 s: it must be positive"),
            (["--step=-1ms"], "communication_step_size is -0.001 s: it must be positive"),
            (["--step", "1.5ns"], "communication_step_size is 1.5e-09 s: it is no whole number of nanoseconds"),
            (["--step", "1x"], "--step is '1x': write a number and one of s, ms, us, ns, min, h"),
            (["--step", "nan"], "--step is 'nan': write a number and one of s, ms, us, ns, min, h"),
            (["--stop", "0"], "stop_time is 0.0 s: it must be later than start_time, 0.0 s"),
            (["--stop", "0.5ns"], "stop_time is 5e-10 s: it is no whole number of nanoseconds"),
            (["--every", "0"], "every is 0: it must be a whole number of steps, 1 to 4611686018427387904"),
            (["--every", "x"], "Invalid value for '--every'"),
            (["--extrapolation", "3"], "extrapolation of order 3. Choose 0, 1 or 2."),
            (["--inputs", "smoth"], 'unknown inputs "smoth" in Explicit. Did you mean "smooth"?'),
            (
                ["--master", "jacobi", "--inputs", "ramp"],
                'preset="jacobi" with inputs="ramp": no source steps first, all inputs are at_point. '
                "Choose another preset, or extrapolation=1.",
            ),
            (
                ["--master", "plain", "--inputs", "smooth"],
                'preset="plain" with inputs="smooth": no source steps first, all inputs are at_point. '
                "Choose another preset.",
            ),
            (
                ["--master", "plain", "--extrapolation", "1"],
                'preset="plain" with extrapolation=1: its inputs are held. Choose another preset.',
            ),
            (["--master", "jacoby"], 'unknown master "jacoby" in --master. Did you mean "jacobi"?'),
            (["--format", "xlsx"], 'unknown format "xlsx" in results. There: parquet, csv, mat'),
            (["--backend", "nativ"], "'nativ' is not one of 'native', 'python'"),
            (["--stopp", "1"], "No such option: --stopp (Possible options: --set, --step, --stop)"),
            (["--use", "controller"], "controller: it is not INSTANCE=FMU, as in controller=AdaptiveTracking"),
            (["--set", "J=1"], "parameter J=1: it is not INSTANCE.NAME=VALUE, as in plant.J[1,1]=500"),
        ],
    )  # fmt: skip
    def test_a_wrong_value(self, run, arguments, words):
        assert words in run(*arguments)

    def test_a_wrong_platform(self, refused):
        text = refused("build", "Sum", "--platform", "linux65", "-o", ".")
        assert 'unknown platform "linux65". Did you mean "linux64"' in text

    def test_a_folder_that_cannot_be(self, run, folder):
        (folder / "file").write_text("mine")
        assert "ResultUnwritable: file cannot be written: it is a file. Choose another folder" in run("--out", "file")
        assert (folder / "file").read_text() == "mine"

    def test_a_result_that_is_none(self, refused, folder):
        assert "there is no result in it (none of result.parquet, result.csv" in refused("plot", ".")


class TestParameters:
    @pytest.mark.parametrize(
        ("setting", "words"),
        [
            ("controller.rho_inf=abc", "controller.rho_inf: it is Real, the value 'abc' is no number and no list"),
            ("controller.angle_unit=true", "controller.angle_unit: it is Real, the value True is bool"),
            ("controller.rho_inf=nan", "controller.rho_inf: the value nan is not finite"),
            ("plant.J[1,1]=inf", "plant.J[1,1]: the value inf is not finite"),
            ("plant.J=[[1,2],[3,4]]", "plant.J: it is a matrix of 3 x 3, the value is a matrix of 2 x 2"),
            ("plant.J=[[1,2],[3,4", "plant.J: it is Real, the value '[[1,2],[3,4' is no number and no list"),
            ("controller.rho_inf=1 kg", "it has unit rad, the value has unit kg, which cannot be converted. Units:"),
            ("plant.tau_B=[0,0,1]", 'plant.tau_B: it is an input: hold it: held={"plant.tau_B": ...}'),
            ("plant.H_N=[0,0,1]", "plant.H_N: it is an output: it cannot be set"),
        ],
    )  # fmt: skip
    def test_a_value_that_cannot_be(self, run, setting, words):
        assert words in run("--set", setting)

    @pytest.mark.parametrize("backend", ["native", "python"])
    @pytest.mark.parametrize(
        ("settings", "words"),
        [
            (
                ["plant.J[1,2]=50"],
                "plant cannot be initialized: {} FlexibleSpacecraft: J is not symmetric: elements that mirror each "
                "other differ by 46.4 kg.m2. Give both the same value.",
            ),
            (
                ["plant.J=[[1,0,0],[0,1,0],[0,0,1]]"],
                "FlexibleSpacecraft: J - delta^T delta is not positive definite (smallest eigenvalue -13.947 kg.m2). "
                "The modes hold more inertia than J.",
            ),
            (
                ["controller.rho_0=[0.2, 0.3, 0.3] deg"],
                "PrescribedPerformance: the initial roll error is 0.25 deg, outside its bound of 0 to 0.2 deg. Raise "
                "rho_0[1] or start nearer.",
            ),
            (
                ["plant.q_BN=[1, 0, 0, 0]"],
                "the initial pitch error is 0 deg and overshoot[2] is 0: epsilon would be infinite. Set overshoot[2] "
                "> 0.",
            ),
        ],
    )  # fmt: skip
    def test_a_broken_condition(self, run, settings, words, backend):
        text = run("--backend", backend, *(a for s in settings for a in ("--set", s)))
        status = {"native": "fmi2Error", "python": "fmi2Fatal"}[backend]
        assert words.format(f"fmi2ExitInitializationMode returned {status}") in text

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("[controller\nk = 1", "parameter file p.toml: it is no TOML: Expected ']'"),
            ("J = 1", "parameter file p.toml: J must be a table of an instance, as in [controller]"),
            ("[controller]\nk = " + "[" * 3000 + "]" * 3000, "p.toml: it is nested too deep for an array of numbers"),
            ("[controller]\nk = " + "[" * 100 + "]" * 100, "p.toml: controller.k: it is nested too deep for an array"),
            ("[controller]\nk = " + "9" * 5000, "parameter file p.toml: it is no TOML: Exceeds the limit"),
            ("[controller]\nkay = 1", 'unknown parameter "kay" in component "controller"'),
        ],
    )
    def test_a_file_with_a_mistake(self, run, folder, text, words):
        (folder / "p.toml").write_text(text)
        assert words in run("--params", "p.toml")

    def test_a_file_that_is_none(self, run, folder):
        assert "parameter file p.toml: there is no such file" in run("--params", "p.toml")
        (folder / "p.toml").mkdir()
        assert "parameter file p.toml: it cannot be read: Is a directory" in run("--params", "p.toml")


WIRED = """
from cosim.system import Connection, Experiment, System


def system():
    return System(
        name="wired",
        components={{"guidance": "EulerSinusoid", "env": "HarmonicTorque", "env2": "HarmonicTorque",
                     "plant": "FlexibleSpacecraft:modes=1"}},
        connections=[Connection(*c) for c in {connections}],
        held={held},
    ), Experiment(stop_time=1, communication_step_size=0.1)
"""
TORQUE, HELD = ("env.tau_dist_B", "plant.tau_dist_B"), {"plant.h_B": [0, 0, 0], "plant.tau_B": [0, 0, 0]}


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


class TestWiring:
    @pytest.mark.parametrize(
        ("connections", "held", "words"),
        [
            (
                [TORQUE, ("guidance.q_RN", "plant.h_B")],
                {"plant.tau_B": [0, 0, 0]},
                "WiringError: guidance.q_RN has 4 elements (unit 1), plant.h_B has 3 elements (unit N.m.s): cannot "
                "connect them.",
            ),
            (
                [TORQUE, ("guidance.omega_RN_R", "plant.h_B")],
                {"plant.tau_B": [0, 0, 0]},
                "WiringError: guidance.omega_RN_R has unit rad/s, plant.h_B has unit N.m.s: they cannot be converted.",
            ),
            (
                [TORQUE],
                {"plant.h_B": [0, 0, 0]},
                "WiringError: input plant.tau_B is not connected. Connect it, or hold it: "
                'held={"plant.tau_B": [0.0, 0.0, 0.0]}.',
            ),
            (
                [TORQUE, ("env2.tau_dist_B", "plant.tau_dist_B")],
                HELD,
                "WiringError: input plant.tau_dist_B has 2 sources: env.tau_dist_B[1], env2.tau_dist_B[1]. An input "
                "takes one connection; add several signals with the component Sum.",
            ),
            (
                [TORQUE, ("plant.omega_BN", "plant.h_B")],
                HELD,
                'UnknownName: unknown output "omega_BN" in component "plant". Did you mean "omega_BN_B"?',
            ),
            (
                [TORQUE, ("plent.H_N", "plant.h_B")],
                HELD,
                'unknown component "plent" in connection plent.H_N -> plant.h_B. Did you mean "plant"?',
            ),
        ],
    )  # fmt: skip
    def test_a_mistake(self, refused, folder, connections, held, words):
        (folder / "wired.py").write_text(WIRED.format(connections=connections, held=held))
        for command in ("run", "show", "build"):
            assert words in refused(command, "wired.py")

    def test_a_cycle_of_components_that_wait_for_each_other(self, refused, folder):
        cycle = [TORQUE, ("plant.H_N", "plant.h_B", "after_step")]
        (folder / "wired.py").write_text(WIRED.format(connections=cycle, held={"plant.tau_B": [0, 0, 0]}))
        text = refused("run", "wired.py")
        assert "CyclicOrder: every component of this cycle would have to step before the next" in text
        assert 'plant.H_N[1] -> plant.h_B[1] (after_step). Give one of these connections timing="at_point".' in text

    def test_a_new_fmu_with_an_input_that_nobody_offers(self, run):
        text = run("--use", "plant=Sum")
        assert "plant needs the input tau_1 in its new FMU Sum, but no instance has an output of that name" in text
        assert 'Connect it, or hold it: held={"plant.tau_1": ...}.' in text


class TestFmuFiles:
    @pytest.fixture
    def law(self, adcs, folder):
        """An FMU of a controller, to be damaged."""
        (folder / "pd.py").write_text(own_files.PD_EQUATIONS)
        adcs("build", "pd.py:PD", "-o", "good")
        return folder / "good" / "PD.fmu"

    def use(self, run):
        return run("--use", "controller=bad.fmu")

    def test_no_fmu(self, run, folder):
        (folder / "bad.fmu").write_text("hello")
        assert "FmuError: bad.fmu: it is not an FMU, for it is no readable zip archive" in self.use(run)
        with zipfile.ZipFile("bad.fmu", "w") as archive:
            archive.writestr("readme.txt", "hello")
        assert "bad.fmu: it is not an FMU, for there is no modelDescription.xml inside" in self.use(run)

    def test_no_binary_for_this_platform(self, run, law, folder):
        other, end = ("win64", ".dll") if fmpy.platform != "win64" else ("linux64", ".so")
        moved = {"binaries": f"binaries/{other}/PD{end}"}
        tiny_fmu.changed(law, Path("bad.fmu"), rename=lambda n: moved.get(n.split("/")[0], n.replace("sources/", "c/")))
        text = self.use(run)
        assert f"bad.fmu: it has no binary for this platform: needed {fmpy.platform}, there: {other}." in text

    def test_damaged_description(self, run, law):
        tiny_fmu.changed(law, Path("bad.fmu"), xml=lambda text: text[:500])
        assert "bad.fmu: its modelDescription.xml is damaged: " in self.use(run)

    def test_shown(self, refused, folder):
        (folder / "bad.fmu").write_text("hello")
        assert "bad.fmu: it is not an FMU" in refused("show", "bad.fmu")
        assert "nowhere.fmu: there is no such file" in refused("show", "nowhere.fmu")
