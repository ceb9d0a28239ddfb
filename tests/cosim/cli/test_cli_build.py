"""adcs list, build and show: what is there, what is made of it, what it looks like."""

import re
import subprocess
import sys
import textwrap
import zipfile
from dataclasses import replace

import fmpy
import pytest
from fmpy.validation import validate_fmu
from numpy.testing import assert_array_equal

from components.catalog import CATALOG
from cosim import simulate
from cosim.studies.papers import describe, scenario
from fmus.description.read import read_description

from .. import own_files


def test_list_has_a_line_for_everything(adcs):
    lines = [line.strip() for line in adcs("list").out.splitlines()]
    for name in [*CATALOG, *describe(), "zhang2018"]:
        (line,) = [entry for entry in lines if entry.split(" ")[0] == name]
        assert len(line.removeprefix(name).strip()) > 20


class TestBuild:
    def test_a_rebuild_of_nothing_prints_paths_only(self, adcs):
        first, second = adcs("build", "Sum", "HarmonicTorque"), adcs("build", "Sum", "HarmonicTorque")
        assert (second.status, second.out, second.err) == (0, first.out, "")
        assert [line.rpartition("/")[2] for line in second.out.split()] == ["Sum.fmu", "HarmonicTorque.fmu"]

    def test_into_a_folder_it_is_always_built_and_nothing_else_is_there(self, adcs, folder):
        for _ in range(2):
            made = adcs("build", "Sum", "-o", "there")
            assert (made.status, made.out, made.err) == (0, "there/Sum.fmu\n", "building Sum (native)\n")
        assert [p.name for p in (folder / "there").iterdir()] == ["Sum.fmu"]

    def test_all_back_ends(self, adcs):
        assert adcs("build", "Sum", "--backend", "all").out.split() == [
            line for backend in ("native", "python") for line in adcs("build", "Sum", "--backend", backend).out.split()
        ]

    def test_all_back_ends_into_one_folder_do_not_overwrite_each_other(self, adcs):
        made = adcs("build", "Sum", "-o", "fmus", "--backend", "all")
        assert made.out.split() == ["fmus/native/Sum.fmu", "fmus/python/Sum.fmu"]

    def test_structure_and_classes_of_files(self, adcs, folder):
        (folder / "pd.py").write_text(own_files.PD_EQUATIONS)
        made = adcs("build", "FlexibleSpacecraft:modes=1", "pd.py:PD", "pd.py", "-o", "made")
        assert made.out.split() == ["made/FlexibleSpacecraft_modes1.fmu", "made/PD.fmu", "made/PD.fmu"]
        assert read_description(folder / "made" / "FlexibleSpacecraft_modes1.fmu").groups["eta"].shape == (1,)
        assert validate_fmu(str(folder / "made" / "PD.fmu")) == []

    def test_a_structure_with_a_width_and_a_unit(self, adcs, folder):
        made = adcs("build", "Notch:width=2,unit=rad/s", "Delay:unit=N.m:samples=3", "-o", "made")
        assert made.out.split() == ["made/Notch_width2_unitrad_per_s.fmu", "made/Delay_unitN_m_samples3.fmu"]
        notch, delay = (read_description(folder / path) for path in made.out.split())
        assert notch.groups["y"].shape == (2,) and notch.variables["y[1]"].unit == "rad/s"
        assert delay.groups["ring"].shape == (3, 1) and delay.variables["ring[1,1]"].unit == "N.m"

    def test_plain_python_takes_the_python_back_end(self, adcs, folder):
        (folder / "pd.py").write_text(own_files.PD_PYTHON)
        made = adcs("build", "pd.py:PD", "-o", "made")
        assert made.err == "building PD (python)\n"
        assert "resources/source/pd.py" in zipfile.ZipFile(folder / "made" / "PD.fmu").namelist()

    @pytest.mark.parametrize("name", ["zhang2018-ppatc", "ye2016-adaptive"])
    def test_a_system_gives_an_fmu_per_instance_that_flies_without_parameters(self, adcs, folder, name):
        system, experiment = scenario(name)
        made = adcs("build", name)
        files = {instance: f"{name}/{name}_{instance}.fmu" for instance in system.components}
        assert made.out.split() == list(files.values())
        short = replace(experiment, stop_time=0.2, every=1)
        bare = replace(system, components=files, parameters={}, vehicle={})
        flown = simulate(system, short)
        assert simulate(bare, short).table.equals(flown.table)
        for instance, file in files.items():  # for tools that exchange nothing in initialization mode
            described = fmpy.read_model_description(file)
            assert float(described.defaultExperiment.stopTime) == float(experiment.stop_time)
            inputs = [v for v in described.modelVariables if v.causality == "input"]
            assert [float(v.start) for v in inputs] == [flown[f"{instance}.{v.name}"][0] for v in inputs]
        rows = fmpy.simulate_fmu(files["plant"], stop_time=0.01, output=["q_BN[1]"])
        assert rows["q_BN[1]"][0] == system.parameters["plant.q_BN"][0]

    def test_from_python_in_a_users_folder(self, folder):
        (folder / "pd.py").write_text(own_files.PD_EQUATIONS)
        (folder / "make.py").write_text(
            textwrap.dedent(
                """
                from fmus.export.build import build
                from pd import PD
                print(build(PD(kp=60.0), "My.fmu", "native"))
                print(build(PD(), "Mine.fmu", "python"))
                """
            )
        )
        done = subprocess.run([sys.executable, "make.py"], cwd=folder, capture_output=True, text=True)
        assert (done.stdout, done.stderr) == ("My.fmu\nMine.fmu\n", "")
        for name, kp in (("My", 60.0), ("Mine", 40.0)):
            assert read_description(folder / f"{name}.fmu").variables["kp"].start == kp
            assert validate_fmu(str(folder / f"{name}.fmu")) == []
        rows = fmpy.simulate_fmu(str(folder / "My.fmu"), stop_time=0.1, output=["attitude_error[1]"])
        assert_array_equal(rows["attitude_error[1]"], rows["attitude_error[1]"][0])


class TestShow:
    def test_a_system_on_one_screen(self, adcs):
        text = adcs("show", "zhang2018-ppatc").out
        assert len(text.splitlines()) < 45
        assert max(map(len, text.splitlines())) <= 120
        assert "zhang2018-ppatc: 200 s in steps of 0.001 s, master Explicit(extrapolation=1)" in text
        assert "4      controller   PrescribedPerformance" in text
        assert "plant.q_BN                controller.q_BN            1       smooth" in text
        assert "plant.h_B = [0.0, 0.0, 0.0]  N.m.s" in text
        assert "controller: s, D_hat <- q_BN, omega_BN_B, q_RN, omega_RN_R" in text
        assert "plant: omega_BN_B, eta_dot, energy <- h_B" in text
        assert "  plant: eta = 0 kg^(1/2).m, eta_dot = 0 kg^(1/2).m/s" in text
        assert "  plant: 0.001 s (solver.step = 0.001 s)" in text
        assert "algebraic loops: none" in text
        assert "delayed paths: none" in text

    def test_a_preset(self, adcs):
        text = adcs("show", "zhang2018-ppatc", "--master", "jacobi").out
        assert "master Explicit(preset='jacobi')" in text
        assert "plant.q_BN                controller.q_BN            1       at_point" in text

    def test_rates_and_single_held_elements(self, adcs, folder):
        (folder / "two.py").write_text(
            textwrap.dedent(
                """
                from cosim.system import Connection, Experiment, System
                def two():
                    held = {"b.tau_1[2]": 0.5, "b.tau_1[3]": 0.0, "b.tau_2": [0, 0, 0]}
                    system = System(name="two", components={"a": "HarmonicTorque", "b": "Sum"}, held=held,
                                    connections=[Connection("a.tau_dist_B[1]", "b.tau_1[1]")], steps={"b": 2})
                    return system, Experiment(stop_time=1, communication_step_size=0.1)
                """
            )
        )
        text = adcs("show", "two.py").out
        assert "Sum, every 2 steps" in text
        assert "b.tau_1[2] = 0.5" in text
        assert "b.tau_2 = [0.0, 0.0, 0.0]" in text

    def test_an_fmu_and_a_component(self, adcs, folder):
        adcs("build", "FlexibleSpacecraft", "-o", ".")
        text = adcs("show", "FlexibleSpacecraft.fmu").out
        assert re.search(r"J\[3,3\] +Real +parameter +fixed +kg.m2 +\[\[300, 0, 0\], \[0,", text)
        assert re.search(r"omega_BN_B\[3\] +Real +output +continuous +rad/s +0 +body rate", text)
        assert "directional derivatives: yes" in text
        assert adcs("show", "FlexibleSpacecraft").out.startswith("FlexibleSpacecraft: Rigid hub with elastic")

    def test_a_component_of_a_file(self, adcs, folder):
        (folder / "pd.py").write_text(own_files.PD_PYTHON)
        assert "tau_command_B, attitude_error <- q_BN" in adcs("show", "pd.py:PD").out

    def test_defaults_that_were_taken_are_marked(self, adcs, folder):
        (folder / "two.py").write_text(
            textwrap.dedent(
                """
                from cosim import Connection, Experiment, System
                def two():
                    links = [Connection("wheels.h_B", "plant.h_B"), Connection("wheels.tau_B", "filter.tau_1")]
                    links += [Connection("torque.tau_dist_B", "plant.tau_dist_B", "at_point")]
                    components = {"wheels": "ReactionWheels", "torque": "HarmonicTorque", "filter": "Sum:n=1",
                                  "plant": "FlexibleSpacecraft:modes=0"}
                    system = System(name="two", components=components, connections=links,
                                    held={"wheels.tau_command_B": [0, 0, 0], "plant.tau_B": [0, 0, 0]})
                    return system, Experiment(stop_time=1, communication_step_size=0.1)
                """
            )
        )
        text = adcs("show", "two.py").out
        assert re.search(r"wheels.tau_B +filter.tau_1 +N.m +step mean \(default\)", text)
        assert re.search(r"wheels.h_B +plant.h_B +N.m.s +ramp \(default\)", text)
        assert re.search(r"torque.tau_dist_B +plant.tau_dist_B +N.m +at_point +\n", text)
