"""A value that is not finite ends a run where it is passed on; where nothing is connected to it, it is recorded."""

import numpy as np
import pytest

from cosim.errors import InitializationFailed, StepFailed

from .. import both, c_fmu
from ..c_fmu import real

LOST = "y = m->now > 0.25 ? NAN : 1; z = m->now > 0.45 ? INFINITY : 2;"


@pytest.fixture
def fmus(tmp_path):
    """Somebody else's FMU, whose y is lost after 0.25 s and z after 0.45 s, and one that takes a number."""
    other = c_fmu.build(tmp_path, "Other", [real("y"), real("z")], outputs=LOST, refresh=False)
    taker = c_fmu.build(tmp_path, "Taker", [real("u", "input"), real("v", depends="u")], outputs="v = u;")
    return {"other": other, "taker": taker}


def test_it_is_recorded_where_nothing_is_connected(fmus):
    result = both.fly(both.of({"other": fmus["other"]}, []))
    assert np.isnan(result["other.y"][3:]).all() and (result["other.y"][:3] == 1).all()
    assert result.info["status"] == "finished"
    assert np.isinf(result["other.z"][-1])


def test_it_ends_the_run_where_it_is_passed_on(fmus):
    error = both.failure(StepFailed, both.of(fmus, [("other.z", "taker.u")]))
    assert "other.z became inf in the step from communication point 0.4 s" in str(error)


@pytest.mark.parametrize("last", [0.0, 0.2, 0.9])
def test_it_ends_the_run_in_an_fmu_of_ours(tmp_path, last):
    """In the first step, in one of many, in the last one of the run: each goes its own way in the kernel."""
    lost = f"y = m->now > {last} + 0.05 ? NAN : 1;"
    ours = c_fmu.build(tmp_path, "Ours", [real("y")], outputs=lost, refresh=True)
    error = both.failure(StepFailed, both.of({"ours": ours}, []), every=10)
    assert f"ours.y became nan in the step from communication point {last:g} s" in str(error)


def test_at_the_start(tmp_path):
    path = c_fmu.build(tmp_path, "Odd", [real("y"), real("z")], outputs="y = NAN; z = 1;", refresh=False)
    taker = c_fmu.build(tmp_path, "Taker", [real("u", "input")])
    assert both.fly(both.of({"odd": path}, [])).info["status"] == "finished"
    error = both.failure(InitializationFailed, both.of({"odd": path, "taker": taker}, [("odd.y", "taker.u")]))
    assert "odd cannot be initialized: y is nan at the start" in str(error)
