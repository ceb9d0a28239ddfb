"""adcs build with values and other FMUs: start values, names, the experiment that they are flown with, what is told."""

import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from cosim import Result, simulate
from cosim.studies.papers import scenario
from fmus.description.description import DefaultExperiment
from fmus.description.read import read_description

from .. import own_files


def starts(fmu, name: str) -> list[float]:
    said = read_description(Path(fmu))
    return [said.variables[element].start for element in said.groups[name].elements]


@pytest.fixture
def refused(adcs, folder):
    def call(*arguments):
        done = adcs("build", *arguments)
        assert done.status == 2 and "building" not in done.err
        return " ".join(done.err.split())

    return call


class TestComponent:
    def test_values_by_the_variables_name(self, adcs, folder):
        (folder / "pd.py").write_text(own_files.PD_EQUATIONS)
        made = adcs("build", "pd.py:PD", "--set", "kp=60", "-o", "fmus")
        assert (made.status, made.out) == (0, "fmus/PD.fmu\n")
        assert starts("fmus/PD.fmu", "kp") == [60.0]

    def test_elements_units_dotted_names_and_the_instances_own_name(self, adcs, folder):
        options = ["J[1,1]=500", "Omega=[90, 180] deg/s", "solver.step=1e-2", "FlexibleSpacecraft.zeta=0.25"]
        sets = [word for option in options for word in ("--set", option)]
        assert adcs("build", "FlexibleSpacecraft:modes=2", *sets, "--backend", "python").status == 0
        fmu = "FlexibleSpacecraft_modes2.fmu"  # here, for what is in the cache is as declared
        assert starts(fmu, "J") == [500.0, 0, 0, 0, 200, 0, 0, 0, 250]
        np.testing.assert_allclose(starts(fmu, "Omega"), [np.pi / 2, np.pi], rtol=1e-15)
        assert starts(fmu, "solver.step") == [0.01] and starts(fmu, "zeta") == [0.25, 0.25]
        assert validate_fmu(fmu) == []

    def test_a_file_of_values_with_and_without_a_table(self, adcs, folder):
        (folder / "values.toml").write_text("frequency = 2.0\nsine = [1, 2, 3]\n[HarmonicTorque]\nbias = [0.5, 0, 0]\n")
        (folder / "more.toml").write_text("[HarmonicTorque]\ncosine = [4, 5, 6]\n")
        files = ("--params", "values.toml", "--params", "more.toml")
        adcs("build", "HarmonicTorque", *files, "--set", "sine[2]=7", "-o", ".", "--backend", "python")
        expected = {"frequency": [2.0], "sine": [1.0, 7.0, 3.0], "bias": [0.5, 0, 0], "cosine": [4.0, 5, 6]}
        assert {name: starts("HarmonicTorque.fmu", name) for name in expected} == expected

    def test_a_table_that_a_dotted_name_means(self, adcs, folder):
        (folder / "values.toml").write_text("[solver]\nstep = 0.02\n")
        adcs("build", "FlexibleSpacecraft:modes=0", "--params", "values.toml", "-o", ".", "--backend", "python")
        assert starts("FlexibleSpacecraft_modes0.fmu", "solver.step") == [0.02]

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--set", "omega=1"], 'unknown parameter "omega" in component "Sum"'),
            (["--set", "n"], "parameter n: it is not NAME=VALUE, as in J[1,1]=500 or rho_inf='0.005 deg'"),
            (["--set", "tau_1=[1,2]"], "parameter Sum.tau_1"),
            (["--use", "plant=Sum"], "--use changes an instance of a system. Sum is a component. Name a system."),
            (["HarmonicTorque", "--set", "bias=1"], "change what one NAME stands for. Build one NAME at a time."),
        ],
    )
    def test_refused(self, refused, arguments, words):
        assert words in refused("Sum", *arguments)

    def test_refused_without_a_name(self, refused):
        assert "change what one NAME stands for" in refused("--set", "bias=1")


NAME = "zhang2018-ppatc"


class TestSystem:
    def test_names_experiment_and_what_is_told(self, adcs, folder, name=NAME):
        made = adcs("build", name, "-o", "fmus", "--backend", "python")
        system, _ = scenario(name)
        assert made.out.split() == [f"fmus/{name}_{instance}.fmu" for instance in system.components]
        for instance in system.components:
            said = read_description(Path(f"fmus/{name}_{instance}.fmu"))
            assert said.model_name == f"{name}_{instance}"
            assert said.model_identifier == f"zhang2018_ppatc_{instance}"
            assert said.default_experiment == DefaultExperiment(0.0, 200.0, None, 1e-3)
        told = " ".join(made.err.split())
        assert "zhang2018-ppatc: communication step 1 ms; let the FMUs step in this order" in told
        order = [line for line in adcs("show", name).out.splitlines() if re.match(r"\d ", line)]
        assert f"choose: {', '.join(line.split()[1] for line in order)}. What is connected" in told
        assert "adcs show 'zhang2018-ppatc'" in told

    @pytest.mark.slow
    def test_changed_values_and_fmus_are_those_of_a_run(self, adcs, folder, name=NAME):
        changes = ["--use", "controller=AdaptiveTracking", "--set", "*.J=[[500,4,-4],[4,410,9],[-4,9,690]]"]
        changes += ["--set", "controller.K=0.2"]
        made = adcs("build", name, *changes, "-o", "fmus")
        assert made.status == 0 and "dropped parameter controller.rho_0" in made.err
        assert made.out.split() == [f"fmus/{name}_{i}.fmu" for i in scenario(name)[0].components]
        assert adcs("run", name, *changes, "--stop", "0.2", "--every", "1", "--out", "run").status == 0
        system, experiment = scenario(name)
        files = {instance: f"fmus/{name}_{instance}.fmu" for instance in system.components}
        bare = replace(system, components=files, parameters={}, vehicle={})
        alone = simulate(bare, replace(experiment, stop_time=0.2, every=1), out="alone")
        assert alone.table.equals(Result.read("run").table)
        rows = simulate_fmu(files["plant"], output=["q_BN[1]"], stop_time=0.01)  # its step from DefaultExperiment
        assert len(rows) >= 10

    def test_of_a_users_system(self, adcs, folder):
        (folder / "two.py").write_text(
            "from fractions import Fraction\n"
            "from cosim import Connection, Experiment, System\n"
            "def two(stop=1):\n"
            "    system = System(name='my two/1', components={'a': 'HarmonicTorque', 'b': 'Sum'}, steps={'b': 2},\n"
            "                    connections=[Connection('a.tau_dist_B', 'b.tau_1')], held={'b.tau_2': [0, 0, 0]})\n"
            "    return system, Experiment(stop_time=stop, communication_step_size=Fraction(1, 4), tolerance=1e-5)\n"
        )
        made = adcs("build", "two.py:two(stop=3)", "--backend", "python", "--set", "a.bias=[1,0,0]")
        assert made.out.split("\n")[:2] == ["my_two_1/my_two_1_a.fmu", "my_two_1/my_two_1_b.fmu"]
        said = {i: read_description(Path(f"my_two_1/my_two_1_{i}.fmu")).default_experiment for i in "ab"}
        assert said == {
            "a": DefaultExperiment(0.0, 3.0, 1e-5, float(Fraction(1, 4))),
            "b": DefaultExperiment(0.0, 3.0, 1e-5, 0.5),
        }
        assert starts("my_two_1/my_two_1_a.fmu", "bias") == [1.0, 0.0, 0.0]
        assert "adcs show 'two.py:two(stop=3)'" in made.err

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--set", "plnt.J=1"], 'unknown component "plnt" in parameter "plnt.J". Did you mean "plant"?'),
            (["--set", "plant.j=1"], 'unknown parameter "j" in component "plant". Did you mean "J"?'),
            (["--use", "controller=Pid"], 'unknown component "Pid". Did you mean "PID"?'),
            (["--params", "none.toml"], "file none.toml: there is no such file"),
        ],
    )
    def test_refused_before_anything_is_built(self, refused, arguments, words):
        assert words in refused(NAME, *arguments)
