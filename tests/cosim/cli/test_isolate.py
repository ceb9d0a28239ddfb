"""adcs run --isolate."""

import json
from pathlib import Path

import pytest

from cosim.results.result import Result

from .. import c_fmu, tiny_fmu
from ..c_fmu import real

pytestmark = pytest.mark.skipif(not tiny_fmu.COMPILED, reason="this FMU is compiled for Linux")


def test_a_crash_ends_the_run_with_status_1_and_keeps_its_rows(adcs, folder):
    proposal = '<DefaultExperiment startTime="0" stopTime="1" stepSize="0.25"/>'
    path = c_fmu.build(folder, "Dies", [real("y")], outputs="y = m->now;", step="if (t >= 0.5) abort();")
    tiny_fmu.changed(
        path, folder / "dies.fmu", xml=lambda t: t.replace("<VendorAnnotations>", f"{proposal}<VendorAnnotations>")
    )
    done = adcs("run", "dies.fmu", "--isolate", "all", "--isolation-timeout", "20")
    assert done.status == 1, done.err
    assert "dies was lost at communication point 0.5 s" in done.err
    assert "in fmi2DoStep its process was ended by SIGABRT" in done.err
    info = json.loads(Path("results/dies/run.json").read_text())
    assert (info["status"], info["rows"], info["isolation_timeout"]) == ("failed", 3, 20.0)
    assert info["components"]["dies"]["isolated"] is True


def test_an_instance_that_there_is_not(adcs, folder):
    done = adcs("run", "zhang2018-ppatc", "--isolate", "plan")
    assert done.status == 2
    assert 'unknown component "plan" in isolated. Did you mean "plant"?' in done.err


FLIGHT = """
from cosim import Component, Experiment, System

def flight():
    parts = {"free": "small.fmu", "apart": Component("small.fmu", isolated=True)}
    system = System(name="apart", components=parts, hold_unconnected=True)
    return system, Experiment(stop_time=1.0, communication_step_size=0.25)
"""


def test_a_component_of_a_file_that_is_isolated_is_shown_flown_and_swapped(adcs, folder):
    c_fmu.build(folder, "Small", [real("y")], outputs="y = m->now;").rename(folder / "small.fmu")
    (folder / "flight.py").write_text(FLIGHT)
    shown = adcs("show", "flight.py")
    lines = [line for line in shown.out.splitlines() if "in a process of its own" in line]
    assert shown.status == 0 and len(lines) == 1 and "apart" in lines[0]
    for use in ([], ["--use", "apart=small.fmu", "--force"]):
        assert adcs("run", "flight.py", *use).status == 0
        told = json.loads(Path("results/apart/run.json").read_text())["components"]
        assert {name: told[name]["isolated"] for name in told} == {"free": False, "apart": True}


RESUMED = """
from cosim import Component, Experiment, Signal, System

def flight():
    parts = {"apart": Component("LowPass", isolated=True), "free": "LowPass"}
    signal = Signal(([0.0, 1.0, 4.0], [0.0, 2.0, 1.0]))
    system = System(name="flight", components=parts, inputs={"apart.u": signal}, hold_unconnected=True)
    return system, Experiment(stop_time=1.0, communication_step_size=0.1)
"""


def test_a_run_that_goes_on_from_its_checkpoint_is_isolated_still(adcs, folder):
    (folder / "flight.py").write_text(RESUMED)
    assert adcs("run", "flight.py", "--checkpoint", "0.5s").status == 0
    done = adcs("run", "--resume", "results/flight", "--stop", "2")
    assert done.status == 0, done.err
    assert adcs("run", "flight.py", "--stop", "2", "--out", "whole").status == 0
    resumed, whole = Result.read(folder / "results/flight"), Result.read(folder / "whole")
    assert resumed.table.equals(whole.table, check_metadata=False) and len(whole) == 21
    assert {name: told["isolated"] for name, told in resumed.info["components"].items()} == {
        "apart": True,
        "free": False,
    }
