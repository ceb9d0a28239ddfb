"""adcs run --isolate."""

import json
from pathlib import Path

import pytest

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
