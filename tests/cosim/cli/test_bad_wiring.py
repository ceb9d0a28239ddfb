"""Connections and FMU files that cannot be, at the command line."""

import zipfile
from pathlib import Path

import fmpy
import pytest

from .. import own_files, tiny_fmu
from ..own_files import HELD, TORQUE, WIRED


@pytest.fixture
def run(refused):
    return lambda *arguments: refused("run", "zhang2018-ppatc", "--stop", "0.01", *arguments)


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
