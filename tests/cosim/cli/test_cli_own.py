"""A user's own controllers and systems, from their folder; another FMU for an instance."""

import textwrap

import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim.results.result import Result

from .. import own_files


@pytest.fixture
def use(adcs, folder):
    """Fly zhang2018-ppatc with another controller for 50 ms."""
    (folder / "pd_python.py").write_text(own_files.PD_PYTHON)
    (folder / "pd.py").write_text(own_files.PD_EQUATIONS)

    def call(reference, *arguments, out="out"):
        done = adcs(
            "run", "zhang2018-ppatc", "--use", f"controller={reference}", "--stop", "50ms", "--out", out, *arguments
        )
        assert done.status == 0, done.err
        return done, Result.read(folder / out)

    return call


class TestUse:
    def test_of_the_catalog(self, use):
        done, result = use("AdaptiveTracking")
        (swap,) = result.info["swaps"]
        assert (swap["instance"], swap["reference"], swap["added"]) == ("controller", "AdaptiveTracking", [])
        assert swap["dropped"] == [f"parameter controller.{n}" for n in ("rho_0", "rho_inf", "k", "overshoot")]
        kept_parameters = [name for name in swap["kept"] if name.startswith("parameter controller.")]
        carried = [name for name in swap["kept"] if name.startswith("vehicle ")]
        assert carried == ["vehicle J"]
        assert len(swap["kept"]) - len(kept_parameters) - len(carried) == 6
        assert "parameter controller.K" in kept_parameters
        assert "controller = AdaptiveTracking\n  kept    plant.q_BN -> controller.q_BN (smooth)" in done.out
        for line in swap["dropped"]:
            assert f"  dropped {line}\n" in done.out
        assert result.info["components"]["controller"]["model_name"] == "AdaptiveTracking"
        assert result.info["parameters"]["controller.J[1,1]"] == result.info["parameters"]["plant.J[1,1]"]

    def test_a_class_in_equations_in_plain_python_and_a_file_agree(self, use, adcs):
        (_, equations), (_, python) = use("pd.py:PD", out="e"), use("pd_python.py:PD", out="p")
        assert_allclose(python["plant.q_BN"], equations["plant.q_BN"], atol=1e-9)
        adcs("build", "pd.py:PD", "-o", ".")
        assert_array_equal(use("PD.fmu", out="f")[1]["plant.q_BN"], equations["plant.q_BN"])

    def test_its_own_parameters_can_be_set(self, use):
        _, result = use("pd.py:PD", "--set", "controller.kp=60")
        assert result.info["parameters"]["controller.kp"] == {"value": 60.0, "unit": "N.m/rad"}

    def test_a_parameter_that_the_new_fmu_lacks_is_refused_where_it_is_asked_for(self, adcs):
        done = adcs("run", "zhang2018-ppatc", "--use", "controller=AdaptiveTracking", "--set", "controller.rho_0=1 deg")
        assert done.status == 2
        assert 'unknown parameter "rho_0" in component "controller"' in done.err

    def test_several(self, use):
        done, result = use("AdaptiveTracking", "--use", "guidance=EulerSinusoid")
        assert [swap["instance"] for swap in result.info["swaps"]] == ["controller", "guidance"]
        assert "guidance = EulerSinusoid" in done.out


SYSTEM = """
from cosim.system import Connection, Experiment, System

SEEN = ["plant.q_BN", "plant.omega_BN_B", "guidance.q_RN", "guidance.omega_RN_R", "guidance.omega_dot_RN_R"]


def flight():
    '''A rigid body follows a slow sinusoid.'''
    system = System(
        name="my_flight",
        components={"guidance": "EulerSinusoid", "controller": "law.py:PD", "plant": "FlexibleSpacecraft:modes=0"},
        connections=[
            *(Connection(port, f"controller.{port.split('.')[1]}", "after_step") for port in SEEN),
            Connection("controller.tau_command_B", "plant.tau_B"),
        ],
        vehicle={"J": [[300, 0, 0], [0, 200, 0], [0, 0, 250]]},
        held={"plant.h_B": [0, 0, 0], "plant.tau_dist_B": [0.001, 0, 0]},
    )
    return system, Experiment(stop_time=0.5, communication_step_size=0.01)


def shorter(stop=0.1):
    system, experiment = flight()
    return system, Experiment(stop_time=stop, communication_step_size=0.01)


def helper(x):
    return x
"""


class TestSystem:
    @pytest.fixture
    def mine(self, folder):
        """A folder with a system and its controller; the test is in the folder above."""
        place = folder / "mine"
        place.mkdir()
        (place / "law.py").write_text(own_files.PD_EQUATIONS)
        (place / "flight.py").write_text(SYSTEM)
        return place

    def test_files_beside_it_are_found(self, adcs, mine):
        done = adcs("run", "mine/flight.py:flight", "--plot")
        assert done.status == 0
        result = Result.read("results/my_flight")
        assert (len(result), result["plant.q_BN"].shape) == (51, (51, 4))
        assert "claim" not in done.out
        assert "wrote results/my_flight/attitude_error.png" in done.out

    def test_one_of_several_functions_is_named(self, adcs, mine):
        refused = adcs("run", "mine/flight.py")
        assert refused.status == 2
        assert refused.err == (
            "ScenarioError: mine/flight.py: say which function, as mine/flight.py:FUNCTION. Functions without "
            "arguments in it: flight, shorter.\n"
        )
        assert adcs("run", "mine/flight.py:shorter").status == 0

    def test_a_file_with_one_function_needs_no_name(self, adcs, folder):
        (folder / "alone.py").write_text(own_files.ALONE.format(unit="HarmonicTorque", stop=0.1, kernel="auto"))
        assert adcs("run", "alone.py").status == 0
        assert adcs("show", "alone.py").out.startswith("alone: 0.1 s in steps of 0.001 s, master Explicit()")

    def test_build_makes_an_fmu_per_instance(self, adcs, mine):
        made = adcs("build", "mine/flight.py:flight", "-o", "made", "--backend", "python")
        assert made.out.split() == [
            f"made/my_flight_{instance}.fmu" for instance in ("guidance", "controller", "plant")
        ]

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("x = {\n", "ScenarioError: bad.py cannot be run: SyntaxError: '{' was never closed (bad.py, line 1)"),
            ("import nothing_like_this\n", "ModuleNotFoundError: No module named 'nothing_like_this' (bad.py, line 1)"),
            (
                "def system():\n    return 1 / 0\n",
                "bad.py:system fails: ZeroDivisionError: division by zero (bad.py, line 2)",
            ),
            ("def system():\n    return 1\n", "bad.py:system returns int, needed is (System, Experiment)."),
            ("x = 1\n", "bad.py has no function that needs no argument and returns (System, Experiment)."),
        ],
    )  # fmt: skip
    def test_a_mistake_in_the_file_is_told_with_its_line(self, adcs, folder, text, words):
        (folder / "bad.py").write_text(text)
        done = adcs("run", "bad.py")
        assert (done.status, done.out) == (2, "")
        assert words in done.err

    def test_names_that_are_not_there(self, adcs, mine):
        assert "there is no file nowhere.py." in adcs("run", "nowhere.py").err
        done = adcs("run", "mine/flight.py:fligt")
        assert (done.status, 'unknown function "fligt"' in done.err) == (2, True)
        assert 'Did you mean "flight"?' in done.err
        assert "My.fmu: there is no such file" in adcs("run", "My.fmu").err


def broken(text):
    return textwrap.dedent(
        f"""
        from components.framework import AttitudeController, Component, Output, PythonComponent
        {text}
        """
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import nothing_like_this", "ModuleNotFoundError: No module named 'nothing_like_this' (law.py, line 3)"),
        ("class Law(Component)", "SyntaxError: expected ':' (law.py, line 3)"),
        ("class Law(Component):\n            y = Output(unit='N.q', doc='y')",
         "ComponentFailed: Law: y: unknown unit 'N.q'. Did you mean 'N.m'"),
        ("class Law(Component):\n            ports = AttitudeController\n"
         "            def outputs(self, t, x, u, p):\n                return {'tau_command_B': -u.q_BNN}",
         "AttributeError: no variable 'q_BNN' here. Did you mean 'q_BN'"),
        ("class Low(Component):\n            y = Output(unit='1', doc='y')",
         'law.py defines no component "Law". Did you mean "Low"?'),
    ],
)  # fmt: skip
def test_a_mistake_in_a_controllers_file_is_told_with_its_line(adcs, folder, text, words):
    (folder / "law.py").write_text(broken(text))
    done = adcs("run", "zhang2018-ppatc", "--use", "controller=law.py:Law")
    assert done.status == 2
    assert words in done.err


RETURNS = """
from components.framework import AttitudeController, PythonComponent


class Wrong(PythonComponent):
    ports = AttitudeController

    def outputs(self, t, x, u, p):
        tau, error = u.omega_BN_B * 0, u.omega_BN_B * 0
        return {value}
"""


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ('{"tau_command_B": tau * 1j, "attitude_error": error}', "outputs: tau_command_B is complex, declared as real"),
        ('{"tau_command_B": "none", "attitude_error": error}', "outputs: tau_command_B is str, declared as real"),
        (
            '{"tau_command_B": tau[:2], "attitude_error": error}',
            "outputs: tau_command_B has shape (2,), declared with (3,)",
        ),
        ("None", "outputs returns NoneType, a dictionary with ['attitude_error', 'tau_command_B'] is needed"),
        ('{"tau": tau, "attitude_error": error}', "outputs returns ['attitude_error', 'tau'], declared are"),
    ],
)
def test_what_a_python_controller_returns_is_checked(adcs, folder, value, words):
    (folder / "wrong.py").write_text(RETURNS.replace("{value}", value))
    done = adcs("run", "zhang2018-ppatc", "--stop", "0.01", "--use", "controller=wrong.py:Wrong", "--out", "out")
    assert done.status in (1, 2)
    assert words in done.err.replace("\n", " ")
