"""An experiment of every paper from FMUs of both back ends: the same flight, to 1e-12 of each variable's maximum.

A python FMU cannot interpolate its inputs: both are given held ones. Of a ramp it takes the middle.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cosim import Explicit, simulate
from cosim.cli.library import Library, locate
from cosim.studies.papers import scenario

STOP = 20.0  # s
FLIGHTS = [
    "zhang2018-ppatc",
    "zhang2018-atc",
    "xiao2011-l2gain",
    "xiao2011-pid-antiwindup",
    "ye2016-adaptive",
    "li2014-nn",
    "li2014-no-nn-lvlh",
    "li2014-actuators",
    "li2014-printed-start-with-limits",
    "geng2012-compensated",
]


@cache
def fly(name: str, backend: str, inputs: str = "held", ramp: str = "ramp", step: float | None = None):
    """`ramp`: the timing in place of "ramp"."""
    system, experiment = scenario(name)
    links = [replace(c, timing=ramp) if c.timing == "ramp" else c for c in system.connections]
    changes = {"stop_time": STOP, "master": Explicit(inputs=inputs)}
    changes |= {} if step is None else {"communication_step_size": step, "every": 1}
    return simulate(replace(system, connections=links), replace(experiment, **changes), locate=Library(backend))


def test_flights_of_the_tests_are_native():
    """Without a compiler the python back end would step in, and every figure of the papers would be its."""
    assert locate("PID").parent.name == "native"


@pytest.mark.slow
@pytest.mark.parametrize("name", FLIGHTS)
def test_native_and_python_fly_the_same(name):
    native, python = (fly(name, backend) for backend in ("native", "python"))
    made = [{path["path"].split("/")[-2] for path in run.info["components"].values()} for run in (native, python)]
    assert made == [{"native"}, {"python"}]
    assert native.time[-1] == STOP and native.table.column_names == python.table.column_names
    for column in native.table.column_names:
        a, b = (run.table[column].to_numpy() for run in (native, python))
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max(), column


@pytest.mark.slow
@pytest.mark.parametrize("name", ["xiao2011-l2gain", "ye2016-adaptive", "geng2012-compensated"])
def test_a_python_fmu_takes_the_middle_of_a_ramp(name):
    middle, ramp = (fly(name, "python", "declared", timing) for timing in ("midpoint", "ramp"))
    for column in middle.table.column_names:
        assert_array_equal(ramp.table[column].to_numpy(), middle.table[column].to_numpy(), err_msg=column)


@pytest.mark.slow
def test_with_ramps_the_back_ends_agree_to_second_order():
    """The middle of a ramp is its mean: what it leaves falls with the square of the step."""
    apart = []
    for step in (0.04, 0.02, 0.01):
        native, python = (fly("ye2016-nonadaptive", b, "declared", step=step) for b in ("native", "python"))
        apart.append(np.abs(native["plant.omega_BN_B"] - python["plant.omega_BN_B"]).max())
    assert apart[-1] < 1e-9
    np.testing.assert_allclose(np.diff(np.log2(apart)), -2.0, atol=0.2)
