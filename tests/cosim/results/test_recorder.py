"""Rows that are kept in memory while more come."""

import numpy as np
from numpy.testing import assert_array_equal

from cosim.masters.layout import Layout
from cosim.masters.types import Texts
from cosim.results.recorder import Recorder
from cosim.results.schema import to_numpy

from ..fakes import Clock
from ..wired import wired


def test_rows_that_come_one_by_one_stay_what_they_were():
    """A slow run is flushed with a single row in its block, where the next one goes."""
    layout = Layout.of(wired(slaves=[Clock("clock")], held={}))
    with Recorder(None, layout.columns, Texts()) as recorder:
        for t in (1.0, 2.0, 3.0):
            recorder.block.append(t, np.array([10 * t]))
            recorder.flush()
    table = recorder.table()
    assert_array_equal(to_numpy(table["time"]), [1.0, 2.0, 3.0])
    assert_array_equal(to_numpy(table["clock.y"]), [10.0, 20.0, 30.0])
