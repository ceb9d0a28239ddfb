"""adcs run --fault: what goes wrong in flight, from files; and where it is told."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim.results.result import Result
from cosim.studies import plots

from .test_cli_events import SYSTEM


@pytest.fixture
def run(adcs, folder):
    (folder / "own.py").write_text(SYSTEM)

    def call(*texts):
        for i, text in enumerate(texts):
            (folder / f"{i}.toml").write_text(text)
        return adcs("run", "own.py", "--out", "out", *(a for i in range(len(texts)) for a in ("--fault", f"{i}.toml")))

    return call


def test_several_files(run, folder, adcs):
    done = run(
        '[[fault]]\nconnection = "mass.v -> damper.v"\nkind = "scale"\nfactor = 0.5\nfrom = "50 ms"\nuntil = 0.1\n'
        '[[fault]]\ntarget = "mass.f"\nkind = "bias"\nvalue = "0.1 m/s2"\nfrom = "1/9"\n',
        '[[fault]]\nparameter = "damper.c"\nvalue = 2\nfrom = 0.15\n'
        '[[fault]]\ncomponent = "mass"\nkind = "freeze"\nfrom = 0.18',
    )
    assert done.status == 0, done.err
    result = Result.read(folder / "out")
    ratio = result["damper.v"][1:] / result["mass.v"][1:]
    assert_array_equal(ratio != 1, (result.time[1:] >= 0.05) & (result.time[1:] < 0.1))
    assert_allclose(ratio[ratio != 1], 0.5)
    late = result.time >= 1 / 9
    assert_allclose(result["mass.f"][late] - result["damper.f"][late], 0.1, rtol=1e-12)
    assert len(np.unique(result["mass.x"][result.time >= 0.18])) == 1
    words = "scale of mass.v -> damper.v, factor 0.5, from 0.05 s to 0.1 s"
    assert result.info["faults"][0]["words"] == words and f"fault: {words}" in done.out
    assert f"fault: {words}" in adcs("show", "out").out
    (figure,) = plots.draw_variables({"run": result}, ["mass.x"]).values()
    dashes = [line for line in figure.axes[0].lines if line.get_label() == "fault"]
    assert [float(line.get_xdata()[0]) for line in dashes] == [0.05, 0.1, 1 / 9, 0.15, 0.18]


@pytest.fixture
def happening(folder):
    """A scenario with an event and a fault."""
    happens = 'faults=[Fault("dropout", "damper.v", start=0.1)], events=[At(0.15, {"mass.k": Value(3, "1/s2")})]'
    text = SYSTEM.replace("import Connection, ", "import At, Connection, Fault, Value, ")
    (folder / "own.py").write_text(text.replace("step_size=0.01", f"step_size=0.01, {happens}"))


def test_show_tells_those_of_a_scenario(adcs, happening):
    """And what it flies for the internal steps is shorter than these times."""
    text = adcs("show", "own.py").out
    assert "event: at 0.15 s mass.k = 3 1/s2\nfault: dropout of damper.v, from 0.1 s\n" in text
    assert "  mass: 0.01 s (automatic)" in text


def test_show_tells_and_checks_those_of_files(adcs, folder, happening):
    (folder / "good.toml").write_text('[[fault]]\ntarget = "mass.f"\nkind = "bias"\nvalue = "0.1 m/s2"\nfrom = "1/9"\n')
    done = adcs("show", "own.py", "--fault", "good.toml")
    assert "\nfault: bias of mass.f, value 0.1 m/s2, from 1/9 s\n" in done.out and done.status == 0
    (folder / "late.toml").write_text('[[fault]]\ntarget = "mass.f"\nkind = "dropout"\nfrom = 3\n')
    done = adcs("show", "own.py", "--fault", "good.toml", "--fault", "late.toml")
    assert (done.status, done.out) == (2, "")
    assert "dropout of mass.f from 3 s: it begins at 3 s, the flight is from 0 s to 0.2 s." in done.err


HEAD = '[[fault]]\ntarget = "damper.v"\n'


@pytest.mark.parametrize(
    "text, message",
    [
        ("[[fault]", "0.toml: it is no TOML"),
        ("[[faults]]\nfrom = 1", "0.toml: it must have [[fault]] tables and nothing else; there: faults"),
        ("[fault]\nkind = 'dropout'", "[fault] is one table. Write [[fault]], once for each fault"),
        ("", "it must have [[fault]] tables and nothing else; there: nothing"),
        ("\x00", "0.toml: it is no TOML"),
        ("fault = 3", "it must have [[fault]] tables and nothing else; there: fault"),
        (
            '[[fault]]\nkind = "scale"',
            "fault 1: it does not say where. Give one of connection, target, source, parameter",
        ),
        (HEAD + 'parameter = "damper.c"', "fault 1: it has target and parameter. Leave one"),
        (
            HEAD + "from = 1",
            "fault 1: it has no kind. Of a target: bias, scale, stuck, dropout, delay, noise, quantisation",
        ),
        (HEAD + 'kind = "skale"', "fault 1: its kind is 'skale'. Did you mean \"scale\"?"),
        (HEAD + 'kind = "freeze"', "fault 1: its kind is 'freeze'. Of a target: bias"),
        (
            HEAD + 'kind = "scale"\nfactr = 1',
            'factr is not known. Did you mean "factor"? There: kind, target, from, until',
        ),
        (HEAD + 'kind = "scale"\nfactor = 1', 'it does not say from when. Write from = "50 s"'),
        (HEAD + 'kind = "scale"\nfactor = 1\nfrom = "soon"', "fault 1: from is 'soon'"),
        (HEAD + 'kind = "scale"\nfactor = 1\nfrom = true', 'from is True. Write from = "50 s"'),
        (HEAD + 'kind = "scale"\nfactor = 1\nfrom = nan', "it must be a finite number of seconds"),
        ("[[fault]]\ntarget = 3\nkind = 'dropout'\nfrom = 1", "its target must be a text, not 3"),
        (HEAD + 'kind = "dropout"\nfrom = 1', "it begins at 1 s, the flight is from 0 s to 0.2 s."),
        (HEAD + 'kind = "stuck"\nvalue = "axis(1;2)"\nfrom = 0.1', "has no unit. Write it as"),
    ],
)
def test_what_is_refused(run, text, message):
    done = run(text)
    assert done.status == 2
    assert message in " ".join(done.err.split())


def test_a_file_that_there_is_not(run, adcs, folder):
    run("")
    done = adcs("run", "own.py", "--fault", "1.toml")
    assert done.status == 2
    assert '1.toml: there is no such file. Did you mean "0.toml"?' in " ".join(done.err.split())
