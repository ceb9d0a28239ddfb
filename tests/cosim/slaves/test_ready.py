"""Calls that are made ready once do what the slave's own calls do."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cosim.errors import CallFailed
from cosim.slaves import breadcrumb
from cosim.slaves.fmi2 import FmuSlave
from cosim.slaves.ready import Span, ready_calls

from .. import tiny_fmu
from ..c_fmu import build, real
from ..fakes import Clock


def flying(path) -> FmuSlave:
    slave = FmuSlave("unit", path)
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    return slave


@pytest.fixture
def slave(tmp_path):
    slave = flying(tiny_fmu.build(tmp_path))
    yield slave
    slave.free()


def of(slave, *names):
    return tuple(slave.description.variables[n].value_reference for n in names)


def test_reads_and_sets_where_the_arrays_are(slave):
    vector = np.zeros(5)
    calls = ready_calls(slave)
    get, put = calls.get_real(of(slave, "u", "y"), vector[1:3]), calls.set_real(of(slave, "u"), vector[4:])
    for value in (2.5, -7.0):
        vector[4] = value
        put()
        get()
        assert_array_equal(vector[1:3], slave.get_real(of(slave, "u", "y")))
        assert vector[1] == value
    assert vector[0] == vector[3] == 0.0


def test_what_a_call_was_in_is_forgotten_after_it(slave):
    ready_calls(slave).get_real(of(slave, "y"), np.zeros(1))()
    assert breadcrumb.here().function is None


def test_an_array_that_does_not_fit_is_refused(slave):
    with pytest.raises(ValueError, match=r"fmi2GetReal: 1 values in a contiguous array of doubles, not \(2,\)"):
        ready_calls(slave).get_real(of(slave, "y"), np.zeros(2))
    with pytest.raises(ValueError, match="contiguous"):
        ready_calls(slave).get_real(of(slave, "u", "y"), np.zeros(4)[::2])


def test_warnings_count_and_failures_are_those_of_the_call(tmp_path):
    """A step warns before t = 1 s and is an error from there on."""
    fmu = build(tmp_path, "Warns", [real("y")], step="if (t < 1.0) return fmi2Warning; return fmi2Error;")
    slave = flying(fmu)
    span = Span()
    step = ready_calls(slave).do_step(span)
    for k in range(2):
        span.begin(k, 0.5 * k, 0.5)
        step()
    assert slave.warned["fmi2DoStep"][0] == 2
    span.begin(2, 1.0, 0.5)
    with pytest.raises(CallFailed, match="fmi2DoStep returned fmi2Error") as failure:
        step()
    assert failure.value.component == "unit"
    slave.free()


def test_a_slave_of_python_offers_none():
    assert ready_calls(Clock("c")) is None
