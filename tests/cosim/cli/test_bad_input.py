"""Bad input at the command line: one message with the way out, exit status 2, nothing written, nothing lost."""

import pytest


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
