"""Signals as files, frames, arrays and functions have them; what is refused names file, row and values."""

import hashlib
from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import CubicSpline
from scipy.io import savemat

from cosim import Signal
from cosim.errors import SignalError
from cosim.results import matlab

GUST = "time [ms],gust[1] (N.m),gust[2] (N.m)\n0,1,4\n\n500,2,5\n1000,4,-1\n"


@pytest.fixture
def gust(folder):
    (folder / "gust.csv").write_text(GUST)
    return folder


class TestFiles:
    def test_csv_with_units_in_its_header(self, gust):
        signal = Signal("gust.csv", interpolation="previous")
        assert_array_equal(signal.time, [0.0, 0.5, 1.0])
        assert_array_equal(signal.values, [[1, 4], [2, 5], [4, -1]])
        assert (signal.unit, signal.columns, signal.width) == ("N.m", ("gust[1]", "gust[2]"), 2)
        assert signal.checksum == hashlib.sha256(GUST.encode()).hexdigest()
        assert "3 samples from 0 to 1 s, previous" in repr(signal)

    @pytest.mark.parametrize("text", ["# t, a\n0, 1\n1, 2\n", "t;a\n0;1\n1;2\n", "﻿t\ta\n0\t1\n1\t2\n"])
    def test_how_others_write_csv(self, folder, text):
        (folder / "a.csv").write_text(text)
        signal = Signal("a.csv")
        assert_array_equal(signal.time, [0, 1])
        assert_array_equal(signal.values[:, 0], [1, 2])
        assert signal.unit is None

    def test_columns_by_name_and_several(self, folder):
        (folder / "a.csv").write_text("time,x (kg^(1/2).m),y (kg^(1/2).m),note\n0,1,2,calm\n1,3,4,gale\n")
        assert_array_equal(Signal("a.csv", "y,x").values, [[2, 1], [4, 3]])
        assert Signal("a.csv", ["x"]).unit == "kg^(1/2).m"

    def test_an_element_with_two_indices(self, folder):
        (folder / "a.csv").write_text('time,"J[1,1]","J[1,2]"\n0,1,2\n1,3,4\n')
        assert_array_equal(Signal("a.csv", "J[1,2]").values[:, 0], [2, 4])
        assert_array_equal(Signal("a.csv", "J").values, [[1, 2], [3, 4]])

    def test_plain_vectors_of_matlab(self, folder):
        savemat("a.mat", {"time": np.arange(4.0), "tau": np.ones((4, 3)), "y": np.arange(4.0)})
        assert Signal("a.mat", "tau").columns == ("tau[1]", "tau[2]", "tau[3]")
        assert_array_equal(Signal("a.mat", "y").values[:, 0], np.arange(4.0))


class TestTables:
    def test_a_frame_with_a_column_or_an_index_of_times(self):
        pandas = pytest.importorskip("pandas")
        frame = pandas.DataFrame({"time": [0.0, 1.0], "a (N)": [1, 2]})
        by_index = pandas.DataFrame({"a (N)": [1, 2]}, index=pandas.to_timedelta([0, 1], unit="s"))
        assert Signal(frame) == Signal(by_index) == Signal(frame.set_index("time"))
        assert Signal(frame).unit == "N"

    def test_arrays(self):
        time = np.array([0.0, 1.0])
        signal = Signal((time, [[1, 2], [3, 4]]), unit="N")
        time[1] = 9  # the signal keeps its own
        assert signal.time[1] == 1.0 and signal.width == 2
        assert signal == Signal({"t": [0, 1], "f": [[1, 2], [3, 4]]}, unit="N")
        assert signal != Signal((signal.time, [[1, 2], [3, 4]])) and len({signal, signal}) == 1

    def test_a_function_is_tabulated_up_to_the_stop(self):
        signal = Signal.of(lambda t: [t, t**2], step=Fraction(1, 3), stop=1.5)
        assert_array_equal(signal.time, [0, 1 / 3, 2 / 3, 1, 4 / 3, 1.5])
        assert_array_equal(signal.values[:, 1], signal.time**2)


def test_cubic_is_the_spline_of_scipy():
    rng = np.random.default_rng(3)
    t, y = np.cumsum(rng.uniform(0.1, 1, 9)), rng.normal(size=(9, 2))
    found, spline = Signal((t, y), interpolation="cubic").coefficients(), CubicSpline(t, y)
    s = 0.3 * np.diff(t)
    values = sum(found[:, :, n] * s[:, None] ** n for n in range(4))
    assert_allclose(values, spline(t[:-1] + s), rtol=1e-12, atol=1e-12)  # some roundings of values about 1


HERE = "signal a.csv"


@pytest.mark.parametrize(
    "text, message",
    [
        ("time,a\n0,1\n1,2\n1,3\n", f"{HERE}: row 4 is at 1 s, row 3 at 1 s. Times must increase"),
        ("time,a\n0,1\n\n2,2\n1.5,3\n", f"{HERE}: row 5 is at 1.5 s, row 4 at 2 s"),
        ("time,a\n0,1\n1,nan\n", f"{HERE}: row 3 has nan in column a. Every value must be finite."),
        ("time,a\n0,1\n1,\n", f"{HERE}: row 3 has nan in column a"),
        ("time,a\n0,1\ninf,2\n", f"{HERE}: row 3 has inf in column time"),
        ("time,a\n0,1\n1,two\n", f"{HERE}: row 3 has 'two' in column a, which is no number. Numbers are decimal"),
        ("time,a\n0,1\nnoon,2\n", f"{HERE}: row 3 has 'noon' in column time, which is no number"),
        ("time,a\n0,1\n1\n", f"{HERE}: row 3 has 1 values, the header has 2 columns"),
        ("time,a\n0,1\n", f"{HERE}: it has 1 sample, at least 2 are needed"),
        ("time,a\n", f"{HERE}: it has no rows of values"),
        ("s,a\n0,1\n1,2\n", f'{HERE}: it has no column "time". Columns: s, a'),
        ("time (fortnight),a\n0,1\n1,2\n", f"{HERE}: its time has the unit fortnight. Known are s, ms"),
        ("time,a,b\n0,1,1\n1,2,2\n", f"{HERE}: it has 2 columns beside time: a, b. Choose, as FILE:a"),
        ("time\n0\n1\n", f"{HERE}: it has 0 columns beside time: none"),
        ("time,a[1] (N),a[2] (mN)\n0,1,1\n1,2,2\n", f"{HERE}: its columns have the units N, mN, not one"),
    ],
)
def test_what_is_refused(folder, text, message):
    (folder / "a.csv").write_text(text)
    with pytest.raises(SignalError) as caught:
        Signal("a.csv")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: Signal("gust.csv", "gist"), 'signal gust.csv: it has no column "gist". Did you mean gust?'),
        (lambda: Signal("gust.csv", "xyz"), 'it has no column "xyz". There: gust.'),
        (lambda: Signal("gust.csv", unit="N"), "its columns have the units N, N.m, not one"),
        (lambda: Signal("gust.csv", interpolation="akima"), 'its interpolation is "akima". Choose linear, previous'),
        (lambda: Signal("none.csv"), "signal none.csv: there is no such file"),
        (lambda: Signal("a.xlsx"), 'signal a.xlsx: its suffix is ".xlsx". Known are .csv'),
        (lambda: Signal("."), "its suffix is"),
        (lambda: Signal(3), "signal 3: it is int, which is no time series. Give a file"),
        (lambda: Signal(([0, 1], [1, 2, 3])), 'column "values" has 3 values, there are 2 times'),
        (lambda: Signal(([0, 1], np.zeros((2, 2, 2)))), 'column "values" has the shape (2, 2, 2)'),
        (lambda: Signal(([0, 1], ["a", 1])), "row 0 has 'a' in column values, which is no number"),
        (lambda: Signal.of(lambda t: "x", step=0.1, stop=1), "its values are no numbers"),
        (lambda: Signal.of(lambda t: t, step=0, stop=1), "it is tabulated from 0 s to 1 s in steps of 0 s"),
    ],
)
def test_what_else_is_refused(gust, make, message):
    with pytest.raises(SignalError) as caught:
        make()
    assert message in str(caught.value)


@pytest.mark.parametrize("file", ["a.parquet", "a.mat"])
def test_files_that_are_none(folder, file):
    (folder / file).write_text("nothing of the kind")
    with pytest.raises(SignalError, match=f"signal {file}: it is no"):
        Signal(file)


def test_names_of_matlab_are_those_of_the_result(folder):
    """`column_names` say what a field is called elsewhere: (a b).y is no name of MATLAB's."""
    import pyarrow as pa

    from cosim.results.schema import field

    columns = {"time": [0.0, 1.0], "a-b.y[1]": [1.0, 2.0], "a-b.y[2]": [3.0, 4.0]}
    schema = pa.schema([field(name, "Real", "s" if name == "time" else "N", None) for name in columns])
    matlab.write(pa.table(columns, schema=schema), folder / "r.mat")
    signal = Signal("r.mat", "a-b.y")
    assert_array_equal(signal.values, [[1, 3], [2, 4]])
    assert signal.unit == "N"
