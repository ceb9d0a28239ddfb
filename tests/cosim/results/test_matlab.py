"""MATLAB files: names that MATLAB takes, no two alike, whatever an instance is called; and no rows get lost."""

import json
import re

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_array_equal
from scipy.io import loadmat

from cosim import flights
from cosim.errors import NotSupported, ResultUnreadable, ResultUnwritable
from cosim.results import formats, matlab
from cosim.results.result import Result
from cosim.results.schema import field
from cosim.system import Experiment, System

from ..fakes import Clock, Fake, describe

LONG = "a" * 70
INSTANCES = ["a-b", "a_b", "_x", "time", "column_names", "column_fields", "end", "é", "9", LONG + "1", LONG + "2"]


class Constant(Fake):
    """Outputs that say which instance they are of: y = number, and names that only FMI takes."""

    OUTPUTS = ("y", "_y", "y.z", "y_z", "der(y)", "end", LONG + "1", LONG + "2", "v[1]", "v[2]", "w[1]", "w[3]", "w_1_")

    def __init__(self, name, number):
        super().__init__(name, describe(outputs=list(self.OUTPUTS)))
        self.number = number

    def advance(self, t, h, v, slopes):
        for i, name in enumerate(self.OUTPUTS):
            v[name] = self.number + i + t


def fly(slaves, **keywords):
    system = System(name="flight", components={s.name: "fake" for s in slaves})
    experiment = Experiment(stop_time=keywords.pop("stop", 0.5), communication_step_size=0.1)
    return flights.simulate(system, experiment, slaves={s.name: s for s in slaves}, **keywords)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("odd") / "out"
    fly([Constant(name, 100 * i) for i, name in enumerate(INSTANCES)], out=folder, format="mat")
    return folder


def test_no_instance_loses_its_numbers(folder):
    result = Result.read(folder)
    straight = fly([Constant(name, 100 * i) for i, name in enumerate(INSTANCES)])
    assert result.table.equals(straight.table)
    assert_array_equal(result["a-b.y"][1:] + 100, result["a_b.y"][1:])


def test_names_are_those_of_matlab_with_ours_beside_them(folder):
    content = loadmat(folder / "result.mat")
    ours = [cell[0] for cell in content["column_names"].ravel()]
    fields = [cell[0] for cell in content["column_fields"].ravel()]
    place = dict(zip(ours, fields, strict=True))
    assert place["time"] == "time" and len(set(fields)) == len(fields) - len(INSTANCES)  # v[1] and v[2] are one array
    structs = {f.split(".")[0] for f in fields[1:]}
    assert len(structs) == len(INSTANCES) and not structs & {*matlab.OWN}
    for name in {part for f in fields for part in f.split(".")}:
        assert re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,62}", name) and name not in matlab.WORDS
    assert (place["a_b.y"], place["a-b.y"], place["_x.y"]) == ("a_b.y", "a_b_2.y", "x_x.y")
    assert (place["a_b.y_z"], place["a_b.y.z"], place["a_b.v[2]"]) == ("a_b.y_z", "a_b.y_z_2", "a_b.v")
    for number, name in enumerate(INSTANCES):
        struct, inside = place[f"{name}.der(y)"].split(".")
        assert content[struct][inside][0, 0][-1] == pytest.approx(100 * number + 4 + 0.4)


def test_names_that_are_valid_stay():
    assert matlab.unique_names(["a-b", "a_b", "a_b_2", "x"]) == {
        "a-b": "a_b_3",
        "a_b": "a_b",
        "a_b_2": "a_b_2",
        "x": "x",
    }
    cut = matlab.unique_names([LONG + c for c in "0123456789ab"])
    assert len(set(cut.values())) == 12 and max(map(len, cut.values())) == 63


def test_arrays_of_several_types_are_taken_apart(tmp_path):
    columns = [
        field("time", "Real", "s", None),
        field("a.x[1]", "Real", None, None),
        field("a.x[2]", "String", None, None),
    ]
    table = pa.table([pa.array([0.0]), pa.array([1.5]), pa.array(["word"])], schema=pa.schema(columns))
    matlab.write(table, tmp_path / "a.mat")
    assert matlab.read(tmp_path / "a.mat").equals(table)


def test_no_rows(tmp_path):
    columns = pa.schema([field(n, "Real", None, None) for n in ("time", "a.x[1]", "a.x[2]")])
    matlab.write(columns.empty_table(), tmp_path / "a.mat")
    assert matlab.read(tmp_path / "a.mat").equals(columns.empty_table())


def test_what_has_no_room_is_refused_before_the_flight(tmp_path, monkeypatch):
    monkeypatch.setattr(matlab, "LARGEST", 100)
    with pytest.raises(NotSupported, match=r"of one instance, c has .* rows. Record fewer rows"):
        fly([Constant("c", 1)], out=tmp_path / "out", format="mat")
    assert not (tmp_path / "out").exists()
    assert len(fly([Constant("c", 1)], out=tmp_path / "out", format="parquet")) == 6


@pytest.mark.parametrize("kind", ["parquet", "csv", "mat"])
@pytest.mark.parametrize("lost", ["a row", "a column"])
def test_the_stream_stays_where_what_was_written_is_not_read_back(tmp_path, monkeypatch, kind, lost):
    write = formats._WRITERS[kind]

    def careless(stream, target):
        table = formats._read_stream(stream)
        less = table.slice(1) if lost == "a row" else table.drop_columns(["c.y"])
        short = target.with_suffix(".short")
        with pa.OSFile(str(short), "wb") as file, pa.ipc.new_stream(file, less.schema) as writer:
            writer.write_table(less)
        write(short, target)
        short.unlink()
        return table

    monkeypatch.setitem(formats._WRITERS, kind, careless)
    words = "5 of 6 rows are read back" if lost == "a row" else "columns are not read back as they were written: c.y"
    with pytest.raises(ResultUnwritable, match=words):
        fly([Clock("c")], out=tmp_path, format=kind)
    assert {p.name for p in tmp_path.iterdir()} == {"result.arrows", "run.json"}
    assert len(Result.read(tmp_path)) == 6
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "failed"


def test_a_file_of_others_is_unreadable(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "result.mat", {"a": np.zeros(3)})
    with pytest.raises(ResultUnreadable, match=r"result.mat: it cannot be read"):
        Result.read(tmp_path)
    (tmp_path / "result.mat").write_bytes(b"\0" * 200)
    with pytest.raises(ResultUnreadable, match=r"result.mat: it cannot be read"):
        Result.read(tmp_path)
