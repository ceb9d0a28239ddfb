"""Names as they are typed: the version, completion, the nearest of the right kind, functions with arguments."""

import importlib.metadata
import json
import os
import re
import subprocess
import sys
import textwrap

import pytest
from typer.testing import CliRunner

import cosim
from components.catalog import CATALOG, MODULES
from cosim import load
from cosim.cli.commands import app
from cosim.studies.papers import describe

MINE = '''
"""Rigid bodies turned by a torque."""
from cosim import Experiment, System


def mine(torque=0.5, n=1, *, name="mine", axis=(1, 0, 0)):
    """The momentum grows by torque, n times."""
    components = {"plant": "FlexibleSpacecraft:modes=0"}
    held = {"plant.tau_B": [torque * n * a for a in axis], "plant.h_B": [0, 0, 0], "plant.tau_dist_B": [0, 0, 0]}
    return System(name=name, components=components, held=held), Experiment(stop_time=0.1, communication_step_size=0.01)


def needy(torque):
    return mine(torque)


def _hidden():
    return mine()
'''


@pytest.fixture
def refused(adcs):
    def call(*arguments):
        done = adcs(*arguments)
        assert done.status == 2
        assert "building" not in done.err  # before anything is compiled
        return " ".join(done.err.split())

    return call


@pytest.fixture
def mine(folder):
    (folder / "mine.py").write_text(MINE)
    return folder / "mine.py"


class TestVersionAndHelp:
    def test_version(self, adcs):
        assert adcs("--version").out == f"adcs-cosim {importlib.metadata.version('adcs-cosim')}\n"
        assert cosim.__version__ == importlib.metadata.version("adcs-cosim")

    @pytest.mark.parametrize("command", [(), ("run",), ("show",), ("build",), ("verify",), ("compare",), ("list",)])
    def test_short_help_is_the_long_one(self, adcs, command):
        short = adcs(*command, "-h")
        assert short.status == 0 and "Usage: " in short.out
        assert short.out == adcs(*command, "--help").out


class TestCompletion:
    @pytest.fixture
    def completed(self, folder, monkeypatch):
        """What bash is offered for a line whose last word is being typed."""

        def call(line: str) -> list[str]:
            words = line.split(" ")
            monkeypatch.setenv("_ADCS_COMPLETE", "complete_bash")
            monkeypatch.setenv("COMP_WORDS", line)
            monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
            return CliRunner().invoke(app, [], prog_name="adcs").stdout.split()

        return call

    def test_systems_and_files(self, completed, folder):
        (folder / "zhang_mine.py").touch()
        (folder / "zhang_mine.txt").touch()
        (folder / "there").mkdir()
        (folder / "there" / "a.fmu").touch()
        mine = [name for name in describe() if name.startswith("zh")]
        assert completed("adcs run zh") == [*mine, "zhang_mine.py"]
        assert completed("adcs verify zh") == [*mine, "zhang_mine.py"]
        assert completed("adcs run the") == ["there/"]
        assert completed("adcs run there/") == ["there/a.fmu"]
        assert completed("adcs run nowhere/") == []

    def test_components(self, completed):
        assert completed("adcs show Fl") == ["FlexibleSpacecraft"]
        assert completed("adcs build Sum ye") == [name for name in describe() if name.startswith("ye")]
        assert completed("adcs reproduce z") == ["zhang2018"]

    def test_swaps(self, completed):
        assert completed("adcs run geng2012-compensated --use s") == ["steering=" + name for name in MODULES]
        assert completed("adcs run geng2012-compensated --use ") == [
            f"{i}=" for i in load("geng2012-compensated")[0].components
        ]
        assert completed("adcs run zhang2018-ppatc --use controller=P") == [
            "controller=PID",
            "controller=PrescribedPerformance",
        ]
        assert completed("adcs run mine.py --use c") == []

    @pytest.mark.parametrize("typed", ["", "P"])
    def test_swaps_as_bash_breaks_them(self, folder, typed):
        """Its words end at an equals sign; what stands behind is completed alone."""
        words = ["adcs", "run", "zhang2018-ppatc", "--use", "controller", "=", *[typed] * bool(typed)]

        def completed(words):
            told = {
                "COMP_WORDS": "\n".join(words),
                "COMP_CWORD": str(len(words) - 1),
                "_ADCS_COMPLETE": "complete_bash",
            }
            code = "import sys; sys.argv = ['adcs']; from adcs_cosim import main; main()"
            done = subprocess.run([sys.executable, "-c", code], env=os.environ | told, capture_output=True, text=True)
            return done.stdout.split()

        assert completed(words) == [name for name in MODULES if name.startswith(typed)]
        words[3:5] = ["--set", "controller.k"]
        assert completed(words) == []


class TestNearest:
    def test_component_where_a_system_is_meant_too(self, refused):
        text = refused("show", "Flexiblespacecraft")
        assert 'unknown component or system "Flexiblespacecraft" in the catalog and the papers.' in text
        assert 'Did you mean "FlexibleSpacecraft"' in text
        assert 'Did you mean "zhang2018-ppatc"' in refused("show", "zhang2018-pptac")

    def test_a_component_where_only_a_system_flies(self, refused, folder):
        text = refused("run", "FlexibleSpacecraft:modes=2")
        assert "FlexibleSpacecraft:modes=2 is a component, needed is a system. Look at it with adcs show" in text
        assert "--use INSTANCE=FlexibleSpacecraft:modes=2" in text

    def test_swap(self, refused):
        text = refused("run", "zhang2018-ppatc", "--use", "controller=Pid")
        assert 'unknown component "Pid". Did you mean "PID"?' in text

    @pytest.mark.parametrize(
        ("option", "meant"),
        [("plnt.J=1", 'component "plnt" in parameter "plnt.J". Did you mean "plant"?'),
         ("plant.j=1", 'parameter "j" in component "plant". Did you mean "J"?'),
         ("*.Zeta=1", 'parameter "Zeta" in parameters of any component. Did you mean "zeta"'),
         ("guidance.bias=1 degs", 'unit degs, which cannot be converted. Did you mean "deg"? Units: ')],
    )  # fmt: skip
    def test_parameter(self, adcs, option, meant):
        done = adcs("run", "zhang2018-ppatc", "--set", option)
        assert done.status == 2 and meant in " ".join(done.err.split())

    def test_files(self, refused, mine):
        assert 'there is no file min.py. Did you mean "mine.py"?' in refused("run", "min.py")
        assert 'there is no file min.py. Did you mean "mine.py"?' in refused("show", "min.py:Law")
        (mine.parent / "plant.fmu").touch()
        assert 'plnt.fmu: there is no such file. Did you mean "plant.fmu"?' in refused("show", "plnt.fmu")
        assert refused("run", "nowhere/min.py").endswith("there is no file nowhere/min.py.")

    def test_plants_and_controllers_to_compare(self, refused):
        text = refused("compare", "--plants", "zang2018")
        assert 'unknown plant "zang2018" in the papers and the catalog. Did you mean "zhang2018"' in text
        text = refused("compare", "--plants", "zhang2018", "--controllers", "zhang2018-act")
        assert 'unknown controller "zhang2018-act" in the papers and the catalog. Did you mean "zhang2018-atc"' in text


class TestFunctions:
    def ran(self, adcs, reference):
        done = adcs("run", reference, "--out", "out", "--force")
        assert done.status == 0, done.err
        info = json.loads(open("out/run.json").read())
        return info["source"]["arguments"], info["held"]["plant.tau_B[1]"]["value"], info

    def test_defaults_are_taken_and_written(self, adcs, mine):
        arguments, torque, info = self.ran(adcs, "mine.py")
        assert arguments == {"torque": 0.5, "n": 1, "name": "mine", "axis": [1, 0, 0]}
        assert torque == 0.5
        assert info["source"]["function"] == "mine.py:mine"

    @pytest.mark.parametrize(
        ("call", "torque"),
        [("mine(0.25)", 0.25), ("mine(torque=-2e-1, n=3)", -0.6), ("mine(0.5, 2, axis=[0.5, 0, 0])", 0.5),
         ("needy(0.125)", 0.125), ("mine()", 0.5)],
    )  # fmt: skip
    def test_values(self, adcs, mine, call, torque):
        assert self.ran(adcs, f"mine.py:{call}")[1] == pytest.approx(torque, rel=1e-15)

    def test_from_python_and_by_other_commands(self, adcs, mine):
        system, _ = cosim.load(f"{mine}:mine(n=2, name='two')")
        assert (system.name, system.held["plant.tau_B"]) == ("two", [1.0, 0.0, 0.0])
        assert system == cosim.load(f"{mine}:mine(1.0, name='two')")[0]  # where it is from is no part of what it is
        assert adcs("show", "mine.py:mine(name='other')").out.startswith("other: 0.1 s")
        assert adcs("verify", "mine.py:mine(n=2)").status == 0

    @pytest.mark.parametrize(
        ("call", "words"),
        [
            ("mine(torqe=3)", 'mine.py:mine takes no argument "torqe". Did you mean "torque"? It is mine(torque=0.5,'),
            ("mine(1, 2, 3)", "mine.py:mine: too many positional arguments. It is mine(torque=0.5, n=1, *, name="),
            ("mine(1, torque=2)", "mine.py:mine: multiple values for argument 'torque'. It is mine("),
            ("needy", "mine.py:needy: missing a required argument: 'torque'. It is needy(torque). "
             "Write mine.py:needy(NAME=VALUE)."),
            ("mine(torque=big)", "mine.py:mine(torque=big): torque is big; it must be a number, a text in quotes,"),
            ("mine(__import__('os'))", "argument 1 is __import__('os'); it must be a number"),
            ("mine(**{})", "** is not possible here. Write each argument as NAME=VALUE."),
            ("mine(3", "mine.py:mine(3 cannot be read: '(' was never closed. Write it as mine.py:FUNCTION("),
            ("mine(3)(4)", "mine.py:mine(3)(4) is no call of a function. Write it as"),
            ("mini(3)", 'unknown function "mini" in mine.py. Did you mean "mine"? There: mine, needy.'),
            ("mine(torque='big', n=2.5)", "mine.py:mine fails: TypeError: can't multiply sequence by non-int"),
        ],
    )  # fmt: skip
    def test_refused(self, refused, mine, call, words):
        assert words in refused("run", f"mine.py:{call}")

    def test_a_file_whose_functions_need_something(self, refused, folder):
        (folder / "needy.py").write_text("def one(a):\n    return a\ndef two(b, *, c):\n    return b\n")
        assert refused("run", "needy.py").endswith(
            "NoScenario: needy.py has no function that needs no argument and returns (System, Experiment). Functions "
            "with arguments in it, to be given as needy.py:FUNCTION(NAME=VALUE): one(a), two(b, *, c)."
        )

    def test_a_function_that_takes_anything_needs_nothing(self, adcs, mine):
        text = MINE.replace("def needy(torque):\n    return mine(torque)", "")
        mine.write_text(text.replace("def mine(torque=0.5,", "def mine(torque=0.5, *more,").replace("*, name", "name"))
        assert self.ran(adcs, "mine.py")[1] == 0.5


class TestShowComponent:
    @pytest.fixture
    def shown(self, adcs, monkeypatch):
        def call(name: str, width: int) -> str:
            monkeypatch.setattr("cosim.cli.console._out.width", width)
            done = adcs("show", name)
            assert (done.status, done.err) == (0, "")  # and nothing is built
            return done.out

        return call

    @pytest.mark.parametrize("width", [60, 90, 120])
    @pytest.mark.parametrize("name", ["FlexibleSpacecraft", "CmgSteering", "HybridAdaptive", "Sum"])
    def test_all_of_it_fits_and_names_are_whole(self, shown, name, width):
        text = shown(name, width)
        assert max(map(len, text.splitlines())) <= width
        assert "\u2026" not in text
        part = CATALOG[name]()
        groups = (part.parameters, part.calculated_parameters, part.inputs, part.states, part.outputs_declared)
        for v in (v for group in groups for v in group):
            size = f"[{','.join(map(str, v.shape))}]" if v.shape else ""
            assert re.search(rf"^ +{re.escape(v.name + size)} +{re.escape(v.unit)}(?!\w)", text, re.MULTILINE), v.name
        for word in ("Source: ", "Limits: ", "direct feedthrough:"):
            assert word in text

    def test_equations_keep_their_text_and_number(self, shown):
        text = shown("FlexibleSpacecraft", 120)
        line = r"^    J w' \+ delta\^T eta'' \+ h_B' \+ w x L = tau \+ d,   L = J w \+ delta\^T eta' \+ h_B +\(1\)$"
        assert re.search(line, text, re.MULTILINE)
        assert "Role in a loop: plant; structure: modes = 8" in text
        assert "omega_BN_B, eta_dot, energy <- h_B" in text
        narrow = shown("FlexibleSpacecraft", 60).splitlines()
        assert [line.split()[-1] for line in narrow if line.endswith(")") and len(line) == 60][:3] == [
            "(1)",
            "(2)",
            "(3)",
        ]

    def test_structure_and_own_files(self, shown, folder):
        assert "delta[2,3]" in shown("FlexibleSpacecraft:modes=2", 120)
        (folder / "law.py").write_text(
            textwrap.dedent(
                '''
                """Torque by a gain.

                    y = k u                                       (1)

                Limits: none.
                """
                from components.framework import Component, Input, Output, Parameter

                class Law(Component):
                    u = Input(unit="1", doc="[what] comes in")
                    y = Output(unit="1", doc="what goes out")
                    k = Parameter(unit="1", start=1.5, doc="gain")

                    def outputs(self, t, x, u, p):
                        return {"y": p.k * u.u}
                '''
            )
        )
        text = shown("law.py:Law", 120)
        assert text.startswith("Law: Torque by a gain.\n\n    y = k u ")
        assert "[what] comes in" in text
        assert shown("law.py", 120) == text
