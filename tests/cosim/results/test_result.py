"""What a run leaves: files in three formats, run.json, and what is left when it ends early."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.testing import assert_array_equal
from scipy.io import loadmat

from cosim import simulate
from cosim.errors import (
    FmuError,
    ResultExists,
    ResultUnreadable,
    StepFailed,
    TimeError,
    UnknownName,
    WiringErrors,
)
from cosim.results.result import Result
from cosim.system import Connection, Experiment, System, Value
from cosim.system.swap import SwapReport

from ..fakes import Clock, Failing, Fake, Gain, Integrator, describe

ROOT = Path(__file__).parents[3]


class Body(Fake):
    """Outputs of all shapes: R = t * [[1, 2], [3, 4]], q = t * [1, 2, 3], one[1], s."""

    def __init__(self, name):
        names = ["R[1,1]", "R[1,2]", "R[2,1]", "R[2,2]", "q[1]", "q[2]", "q[3]", "one[1]", "s"]
        super().__init__(name, describe(outputs=names, units={"q": "rad", "R": "N.m"}))

    def advance(self, t, h, v, slopes):
        end = t + h
        for i, name in enumerate(["R[1,1]", "R[1,2]", "R[2,1]", "R[2,2]"]):
            v[name] = (i + 1) * end
        for i in (1, 2, 3):
            v[f"q[{i}]"] = i * end
        v["one[1]"] = v["s"] = end / 3


def fly(slaves=None, **keywords):
    slaves = slaves or [Body("body"), Gain("g", k=2.0)]
    system = System(
        name="flight",
        components={s.name: "fake" for s in slaves},
        connections=[Connection("body.s", "g.u")] if slaves[0].name == "body" else [],
        held=keywords.pop("held", {}),
        parameters=keywords.pop("parameters", {}),
    )
    changes = {k: keywords.pop(k) for k in ("every", "stop_time", "master") if k in keywords}
    experiment = Experiment(**{"stop_time": 0.5, "communication_step_size": 0.1} | changes)
    return simulate(system, experiment, slaves={s.name: s for s in slaves}, **keywords)


class TestNames:
    def test_shapes(self):
        result = fly()
        assert len(result) == 6
        assert result["body.q"].shape == (6, 3)
        assert result["body.R"].shape == (6, 2, 2)
        assert result["body.one"].shape == (6, 1)
        assert result["body.s"].shape == result["body.R[2, 1]"].shape == (6,)
        assert_array_equal(result["body.R"][-1], result.time[-1] * np.array([[1, 2], [3, 4]]))
        assert result.names == ["body.R", "body.q", "body.one", "body.s", "g.u", "g.y"]
        assert "body.q" in result and "body.q[1]" in result and "body.x" not in result

    def test_units(self):
        units = fly().units
        assert (units["time"], units["body.q"], units["body.q[2]"], units["body.s"]) == ("s", "rad", "rad", None)

    def test_unknown(self):
        with pytest.raises(UnknownName, match=r'unknown variable "body.p" in the result. Did you mean .*"body.q"'):
            fly()["body.p"]

    def test_pandas(self):
        frame = fly().to_pandas()
        assert list(frame.columns[:2]) == ["time", "body.R[1,1]"]
        assert len(frame) == 6


class TestFiles:
    @pytest.mark.parametrize("kind", ["parquet", "csv", "mat"])
    def test_read_back_bit_by_bit(self, tmp_path, kind):
        result = fly(out=tmp_path / "out", format=kind)
        assert {p.name for p in (tmp_path / "out").iterdir()} == {f"result.{kind}", "run.json"}
        again = Result.read(tmp_path / "out")
        assert again.names == result.names
        assert again.units == result.units == fly().units
        assert again.info == result.info
        assert_array_equal(again.time, fly().time)
        for name in result.names:
            assert_array_equal(again[name], fly()[name])

    def test_parquet_columns(self, tmp_path):
        fly(out=tmp_path)
        schema = pq.read_schema(tmp_path / "result.parquet")
        assert schema.names[:3] == ["time", "body.R[1,1]", "body.R[1,2]"]
        assert {str(t) for t in schema.types} == {"double"}
        assert schema.field("body.q[1]").metadata == {b"unit": b"rad"}

    def test_mat_for_matlab(self, tmp_path):
        fly(out=tmp_path, format="mat")
        content = loadmat(tmp_path / "result.mat")
        assert content["time"].shape == (6, 1)
        assert content["body"]["R"][0, 0].shape == (6, 2, 2)
        assert content["body"]["q"][0, 0].shape == (6, 3)

    def test_nothing_is_left_without_out(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("TMPDIR", str(tmp_path))
        monkeypatch.setattr("tempfile.tempdir", None)
        result = fly()
        assert result.folder is None
        assert [p for p in tmp_path.iterdir() if not p.name.startswith("adcs-fmu-")] == []
        assert len(result["body.q"]) == 6

    def test_unknown_format(self, tmp_path):
        with pytest.raises(UnknownName, match=r'unknown format "parket" in results. Did you mean "parquet"'):
            fly(out=tmp_path / "out", format="parket")

    def test_existing_result(self, tmp_path):
        fly(out=tmp_path)
        with pytest.raises(ResultExists, match=r"already holds a result. Write elsewhere .*--force"):
            fly(out=tmp_path)
        (tmp_path / "figure.png").write_text("mine")
        again = fly(out=tmp_path, overwrite=True, format="csv")
        assert {p.name for p in tmp_path.iterdir()} == {"result.csv", "run.json", "figure.png"}
        assert len(again) == 6

    def test_refused_run_leaves_an_older_result_alone(self, tmp_path):
        fly(out=tmp_path)
        with pytest.raises(WiringErrors):
            fly(out=tmp_path, overwrite=True, parameters={"g.kk": 1.0})
        assert len(Result.read(tmp_path)) == 6

    def test_unreadable(self, tmp_path):
        with pytest.raises(ResultUnreadable, match="there is no result in it"):
            Result.read(tmp_path)
        (tmp_path / "result.parquet").write_text("no")
        with pytest.raises(ResultUnreadable, match=r"result.parquet: it cannot be read"):
            Result.read(tmp_path)
        (tmp_path / "run.json").write_text("{")
        with pytest.raises(ResultUnreadable, match=r"run.json: it is no JSON"):
            Result.read(tmp_path)


class TestRunJson:
    def test_says_what_was_flown(self, tmp_path):
        report = SwapReport("g", "New", ("a",), ("b",), ())
        fly(out=tmp_path, swaps=[report], parameters={"g.k": Value(3, None)}, metrics=lambda r: {"rows": len(r)})
        info = json.loads((tmp_path / "run.json").read_text())
        assert info["status"] == "finished"
        assert (info["reached_time"], info["rows"], info["metrics"]) == (0.5, 6, {"rows": 6})
        assert (info["master"]["name"], info["master"]["preset"]) == ("Explicit", "declared")
        assert info["components"]["g"]["guid"] == "{fake}"
        assert info["parameters"] == {"g.k": {"value": 3.0, "unit": None}}
        assert info["swaps"][0]["dropped"] == ["b"]
        assert info["versions"]["numpy"] == np.__version__
        assert 0 < info["wall_time"]["loop"] < info["wall_time"]["total"]

    def test_failure_is_written_before_it_is_raised(self, tmp_path):
        with pytest.raises(StepFailed) as caught:
            fly([Failing("w", 0.3, "fmi2Error")], held={"w.u": 1.0}, out=tmp_path, metrics=lambda r: 1 / 0)
        info = json.loads((tmp_path / "run.json").read_text())
        assert (info["status"], info["error"], info["reached_time"]) == ("failed", "StepFailed", 0.3)
        assert info["failure"] == {
            "component": "w", "status": "fmi2Error", "time": 0.3, "step": 0.4 - 0.3, "messages": ["the wheel came off"],
            "culprits": [], "remedy": "", "lost": "",
        }  # fmt: skip
        assert "wheel came off" in info["why"]
        assert len(Result.read(tmp_path)) == len(caught.value.result) == 4

    def test_a_failed_run_has_the_metrics_of_its_rows(self, tmp_path):
        with pytest.raises(StepFailed):
            fly([Failing("w", 0.3, "fmi2Error")], held={"w.u": 1.0}, out=tmp_path, metrics=lambda r: {"rows": len(r)})
        assert json.loads((tmp_path / "run.json").read_text())["metrics"] == {"rows": 4}

    def test_metrics_that_overflow_are_null_and_hide_no_failure(self, tmp_path):
        far = {"peak": float("inf"), "each": [1.0, float("nan")], "settled": None}
        with pytest.raises(StepFailed):
            fly([Failing("w", 0.3, "fmi2Error")], held={"w.u": 1.0}, out=tmp_path, metrics=lambda r: far)
        info = json.loads((tmp_path / "run.json").read_text())
        assert info["error"] == "StepFailed"
        assert info["metrics"] == {"peak": None, "each": [1.0, None], "settled": None}


class TestInterrupts:
    def test_ctrl_c_ends_between_two_steps(self, tmp_path):
        class Pressed(Clock):
            def advance(self, t, h, v, slopes):
                super().advance(t, h, v, slopes)
                if round(t, 6) == 0.2:
                    os.kill(os.getpid(), signal.SIGINT)

        result = fly([Pressed("c")], out=tmp_path, every=10)
        assert result.info["status"] == "interrupted"
        assert_array_equal(result.time, [0.0, 0.3])
        assert json.loads((tmp_path / "run.json").read_text())["status"] == "interrupted"
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler

    def test_interrupt_in_a_guest(self):
        def progress(t, stop):
            raise KeyboardInterrupt

        result = fly([Clock("c")], stop_time=1e7, progress=progress, every=1000)  # far more than the first look takes
        assert result.info["status"] == "interrupted"
        assert result.time[-1] == result.info["reached_time"] < 1e7

    def test_progress_reaches_the_end(self):
        seen = []
        fly(progress=lambda t, stop: seen.append((t, stop)))
        assert seen[-1] == (0.5, 0.5)

    def test_kill_leaves_readable_rows(self, tmp_path):
        script = textwrap.dedent(
            f"""
            import sys
            sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / "tests")!r}, {str(ROOT / "tests" / "cosim")!r}]
            from fakes import Clock
            from cosim import simulate
            from cosim.system import Experiment, System
            simulate(System(name="long", components={{"c": ""}}),
                     Experiment(stop_time=1e6, communication_step_size=0.001), out={str(tmp_path)!r},
                     slaves={{"c": Clock("c")}})
            """
        )
        process = subprocess.Popen([sys.executable, "-c", script])
        try:
            stream = tmp_path / "result.arrows"
            deadline = time.monotonic() + 60
            while not (stream.is_file() and stream.stat().st_size > 100_000) and time.monotonic() < deadline:
                time.sleep(0.05)
        finally:
            process.kill()
            process.wait()
        result = Result.read(tmp_path)
        assert result.info["status"] == "died"
        assert len(result) > 1000
        assert_array_equal(np.diff(np.round(result.time * 1000)), 1)
        whole = stream.read_bytes()
        stream.write_bytes(whole[:-1000])
        cut = Result.read(tmp_path)
        assert 0 < len(cut) <= len(result)
        stream.write_bytes(whole[:20])
        with pytest.raises(ResultUnreadable, match="cut before its first row"):
            Result.read(tmp_path)


class TestSimulate:
    def test_references_are_located(self, tmp_path):
        asked = []

        def locate(reference):
            asked.append(reference)
            return tmp_path / "no.fmu"

        with pytest.raises(FmuError, match=r"no.fmu: there is no such file"):
            simulate(
                System(name="s", components={"a": "Thing"}),
                Experiment(stop_time=1, communication_step_size=1),
                locate=locate,
            )
        assert asked == ["Thing"]
        with pytest.raises(FmuError, match="there is no such file"):
            simulate(System(name="s", components={"a": "x.fmu"}), Experiment(stop_time=1, communication_step_size=1))

    def test_times(self):
        with pytest.raises(TimeError, match="stop_time"):
            fly(stop_time=0.0)

    def test_slaves_are_terminated_and_freed(self):
        slaves = [Clock("c"), Integrator("i")]
        fly(slaves, held={"i.u": 0.0})
        assert all([c[0] for c in s.calls][-2:] == ["terminate", "free"] for s in slaves)

    def test_failed_slave_is_not_terminated(self):
        failing, clock = Failing("w", 0.3, "fmi2Error"), Clock("c")
        with pytest.raises(StepFailed):
            fly([failing, clock], held={"w.u": 0.0})
        assert [c[0] for c in failing.calls][-1] == "free"
        assert ("terminate",) not in failing.calls
        assert ("terminate",) in clock.calls

    def test_many_rows_pass_through_the_block(self):
        """More rows than the recorder's block holds."""
        result = fly([Clock("c")], stop_time=10_000 * 0.1)
        assert_array_equal(result.time, np.arange(10_001) * 1e8 / 1e9)
        assert_array_equal(result["c.y"], np.round(result.time, 9))
