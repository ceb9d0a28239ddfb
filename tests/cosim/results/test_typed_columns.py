"""Columns of every type: in their own types in each file, with literals of enumerations, read back as they were."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_array_equal
from scipy.io import loadmat

from cosim import flights
from cosim.results.formats import read
from cosim.results.recorder import Recorder
from cosim.results.result import Result

from .. import both
from ..typed_fmu import ITEMS, typed

ARROW = {
    "a.x": pa.float64(),
    "a.count": pa.int32(),
    "a.odd": pa.bool_(),
    "a.mode": pa.int32(),
    "a.memory": pa.string(),
    "a.r_in": pa.float64(),
    "a.i_in": pa.int32(),
    "a.b_in": pa.bool_(),
    "a.e_in": pa.int32(),
    "a.s_in": pa.string(),
}
WORD = 'Grüße,\n"漢字" 007'
HELD = {"a.r_in": 1.5, "a.i_in": -7, "a.b_in": True, "a.e_in": "fast", "a.s_in": f"'{WORD}'"}
STATES = {"a.memory0": "' 12 '", "a.count0": -(2**31), "a.x0": 1 / 3}


@pytest.fixture(scope="module")
def system(tmp_path_factory):
    path = typed(tmp_path_factory.mktemp("typed"))
    return both.of({"a": path}, [], held={**HELD, "a.i_in": 0}, parameters=STATES)


@pytest.fixture(scope="module")
def straight(system):
    """The flight as it is in memory."""
    return flights.simulate(system, both.experiment(stop=2.0))


def test_lines_within_texts_of_a_long_csv(system, tmp_path):
    """The file is read in several blocks, which must not begin within a text."""
    setup = both.experiment(stop=1.0, step=1 / 20000, record=("a.s_in", "a.memory"))
    flights.simulate(system, setup, out=tmp_path / "out", format="csv")
    assert (tmp_path / "out" / "result.csv").stat().st_size > 1_100_000
    assert set(Result.read(tmp_path / "out")["a.s_in"]) == {WORD}


@pytest.mark.parametrize("loop", both.LOOPS)
@pytest.mark.parametrize("kind", ["parquet", "csv", "mat"])
def test_read_back_equal_with_types_units_and_items(system, straight, tmp_path, kind, loop):
    written = flights.simulate(system, both.experiment(stop=2.0, loop=loop), out=tmp_path / "out", format=kind)
    result = Result.read(tmp_path / "out")
    for name, expected in ARROW.items():
        assert result.table.schema.field(name).type == expected, name
        assert_array_equal(result[name], straight[name], err_msg=name)
    assert result.table.equals(straight.table)
    assert written.table.equals(result.table)
    assert result.items == written.items == dict.fromkeys(["a.e_in", "a.e", "a.mode"], ITEMS)


def test_values_at_the_ends_of_their_types(straight):
    assert straight["a.count"].min() == -(2**31)
    assert straight["a.memory"][0] == " 12 "
    assert straight["a.s_in"][0] == WORD
    assert straight["a.x"][0] == 1 / 3


def test_parquet_says_the_literals(system, tmp_path):
    flights.simulate(system, both.experiment(), out=tmp_path / "out")
    schema = pq.read_schema(tmp_path / "out" / "result.parquet")
    assert {n: schema.field(n).type for n in ARROW} == ARROW
    assert json.loads(schema.field("a.mode").metadata[b"items"]) == ITEMS
    assert not any(field.nullable for field in schema)


def test_mat_has_numbers_and_texts(system, tmp_path):
    flights.simulate(system, both.experiment(stop=0.2), out=tmp_path / "out", format="mat")
    a = loadmat(tmp_path / "out" / "result.mat")["a"][0, 0]
    assert_array_equal(a["mode"].ravel(), [2, 5, 1])
    assert_array_equal(a["odd"].ravel(), [1, 0, 1])
    assert [str(cell[0]) for cell in a["s_in"].ravel()] == [WORD] * 3


def test_a_stream_that_a_kill_left_has_the_types(system, straight, tmp_path, monkeypatch):
    """Rows go to the stream in several batches; the file is then cut in the last one."""
    monkeypatch.setattr("cosim.results.formats.convert", lambda folder, kind: read(folder, {}))
    monkeypatch.setattr("cosim.results.recorder.BLOCK_ROWS", 5)
    flights.simulate(system, both.experiment(stop=2.0), out=tmp_path / "out")
    stream = tmp_path / "out" / "result.arrows"
    assert Result.read(tmp_path / "out").table.equals(straight.table)
    stream.write_bytes(stream.read_bytes()[:-200])
    cut = Result.read(tmp_path / "out")
    assert 5 <= len(cut) < 21
    assert cut.table.equals(straight.table.slice(0, len(cut)))
    assert cut.items["a.mode"] == ITEMS


def test_run_json_says_which_columns_are_not_real(system, straight):
    kinds = {"count": "Integer", "odd": "Boolean", "mode": "Enumeration", "memory": "String"}
    assert {n: straight.info["types"][f"a.{n}"] for n in kinds} == kinds
    assert "a.x" not in straight.info["types"]
    assert straight.info["held"]["a.e_in"]["value"] == 5
    assert straight.info["parameters"]["a.memory0"]["value"] == " 12 "


def test_patterns_choose_among_all_types(system):
    result = both.fly(system, record=("*.mode", "a.s_in", "a.odd0"))
    assert result.names == ["a.s_in", "a.mode", "a.odd0"]


def test_a_record_of_no_rows_has_its_columns(system):
    with flights.prepare(system) as prepared:
        layout = prepared._plan(both.experiment(), None, ("*",)).course.layout
    from cosim.masters.types import Texts

    table = Recorder(None, layout.columns, Texts()).table()
    assert (table.num_rows, table.schema.field("a.memory").type) == (0, pa.string())


def test_booleans_are_packed_bit_by_bit(system):
    """More rows than bits in a byte, and no multiple of eight."""
    result = flights.simulate(system, both.experiment(stop=2.1))
    assert result["a.odd"].tolist() == ([True, False] * 11)
    assert np.asarray(result["a.b_in"]).all()
