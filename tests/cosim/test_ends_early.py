"""Runs that end early at the command line: what is told, with which status, and what is kept on disk."""

import errno
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose

from cosim import remedy
from cosim.results import recorder
from cosim.results.result import Result
from fmus import toolchain

from . import own_files


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Trials of shorter steps may take long where the machine is busy."""
    monkeypatch.setattr(remedy, "WALL_TIME", 300.0)


class TestNotFinite:
    @pytest.fixture(params=[("native", "auto"), ("native", "never"), ("python", "auto"), ("python", "never")])
    def fly(self, request, adcs, folder):
        """Fly one unit, in both back ends, in the kernel and in the Python loop."""
        backend, loop = request.param
        (folder / "runaway.py").write_text(own_files.RUNAWAY)

        def call(unit):
            (folder / "alone.py").write_text(own_files.ALONE.format(unit=f"runaway.py:{unit}", stop=2, kernel=loop))
            done = adcs("run", "alone.py", "--backend", backend, "--out", "out", "--every", "7")
            return done, Result.read("out"), {"native": "fmi2Error", "python": "fmi2Fatal"}[backend]

        return call

    def test_a_state(self, fly):
        done, result, status = fly("Runaway")
        assert done.status == 1
        last = result.time[-1]
        assert 0.99 < last < 1.01
        assert f"StepFailed: unit returned {status} at communication point {last:.12g} s, step 0.001 s\n" in done.err
        assert f"    fmi2DoStep: state x is not finite at {last + 0.001:.9g} s.\n" in done.err
        assert "    at steps of 0.5 ms, 0.25 ms, 0.125 ms and 62.5 us the same flight fails too, at " in done.err
        assert ": the exchange is not the reason.\n" in done.err
        assert done.out.startswith(f"failed: {last:g} s simulated")
        assert np.isfinite(result["unit.x"]).all() and result["unit.x"][-1] > 100
        assert result.time[-2] == pytest.approx(0.007 * (len(result) - 2))
        info = result.info
        assert (info["status"], info["error"], info["reached_time"]) == ("failed", "StepFailed", last)
        assert (info["failure"]["component"], info["failure"]["status"]) == ("unit", status)
        assert "state x is not finite" in info["why"]

    def test_an_output(self, fly):
        done, result, _ = fly("Root")
        assert done.status == 1
        assert result.time[-1] == 0.5
        text = "StepFailed: unit.y became nan in the step from communication point 0.5 s, step 0.001 s"
        assert text in done.err
        assert (result.info["failure"]["variable"], result.info["failure"]["value"]) == ("y", "nan")
        assert_allclose(result["unit.y"], np.sqrt(0.5 - result.time))


def test_a_loop_that_diverges_at_too_long_a_step(adcs):
    done = adcs("run", "zhang2018-ppatc", "--step", "100ms", "--out", "out")
    assert done.status == 1
    reached = Result.read("out").time[-1]
    assert f"plant returned fmi2Error at communication point {reached:.12g} s, step 0.1 s" in done.err
    assert "fmi2DoStep: state q_BN[1] is not finite at " in done.err
    assert "diverged at steps of 100 ms; at " in done.err and "or --master iterated (master=Iterated())." in done.err
    assert "claims of zhang2018: not judged, the run ended early" in done.out
    assert "wrote out/result.parquet" in done.out
    assert reached > 5


@pytest.mark.parametrize("loop", ["kernel", "python"])
def test_an_exception_inside_a_python_component(adcs, folder, loop):
    (folder / "law.py").write_text(own_files.PD_PYTHON)
    (folder / "target.py").write_text(own_files.TARGET)
    system = "zhang2018-ppatc" if loop == "kernel" else "target.py"
    done = adcs(
        "run", system, "--use", "controller=law.py:PD", "--set", "controller.breaks=0.0305", "--stop", "1",
        "--out", "out", "--plot",
    )  # fmt: skip
    assert done.status == 1
    line = 1 + own_files.PD_PYTHON.splitlines().index('            raise ValueError(f"no law after {p.breaks} s")')
    assert done.err.endswith(
        "StepFailed: controller returned fmi2Fatal from fmi2GetReal at communication point 0.03 s, step 0.001 s\n"
        f"    ValueError: no law after 0.0305 s (law.py, line {line})\n"
    )
    result = Result.read("out")
    assert_allclose(result.time, [0, 0.01, 0.02, 0.03])
    assert "ValueError: no law after" in result.info["why"]
    assert (folder / "out" / "attitude_error.png").is_file()


def test_an_exception_at_the_start_writes_nothing(adcs, folder):
    (folder / "law.py").write_text(own_files.PD_PYTHON)
    done = adcs("run", "zhang2018-ppatc", "--use", "controller=law.py:PD", "--set", "controller.breaks=-1")
    assert done.status == 2
    assert "InitializationFailed: controller cannot be initialized: fmi2GetReal returned fmi2Fatal" in done.err
    assert "ValueError: no law after -1.0 s (law.py, line " in done.err
    assert not (folder / "results").exists()


class TestDisk:
    @pytest.fixture
    def full(self, monkeypatch):
        """A disk that takes five batches, the first of one row, and then nothing."""

        class Writer:
            def __init__(self, *arguments):
                self.writer, self.room = pa.RecordBatchStreamWriter(*arguments), 5

            def write_batch(self, batch):
                self.room -= 1
                if self.room < 0:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                self.writer.write_batch(batch)

            def close(self):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(recorder.pa.ipc, "new_stream", Writer)
        monkeypatch.setattr(recorder, "BLOCK_ROWS", 10)

    def test_that_is_full_ends_the_run_and_keeps_the_rows(self, full, adcs):
        done = adcs("run", "zhang2018-ppatc", "--stop", "10", "--out", "out")
        assert done.status == 1
        text = "ResultUnwritable: out/result.arrows cannot be written: No space left on device. Choose another folder"
        assert text in done.err
        result = Result.read("out")
        assert (result.info["status"], result.info["error"]) == ("failed", "ResultUnwritable")
        assert len(result) == result.info["rows"] == 41
        assert result.info["reached_time"] == result.time[-1]

    def test_that_has_no_room_for_the_other_format(self, adcs, folder, monkeypatch):
        def refuse(*arguments, **keywords):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr("cosim.results.formats.pq.ParquetWriter", refuse)
        done = adcs("run", "zhang2018-ppatc", "--stop", "0.05", "--out", "out")
        assert (done.status, "out/result.parquet cannot be written: No space left" in done.err) == (1, True)
        assert sorted(p.name for p in (folder / "out").iterdir()) == ["result.arrows", "run.json"]
        assert len(Result.read("out")) == 6

    def test_a_mistake_of_our_own_is_in_run_json_too(self, adcs, monkeypatch):
        def look(self):
            raise RuntimeError("a bug")

        monkeypatch.setattr(recorder.Recorder, "look", look)
        with pytest.raises(RuntimeError, match="a bug"):
            adcs("run", "zhang2018-ppatc", "--stop", "1", "--out", "out")
        result = Result.read("out")
        assert (result.info["status"], result.info["error"], result.info["why"]) == ("failed", "RuntimeError", "a bug")
        assert len(result) > 0

    def test_metrics_that_fail_lose_nothing(self, adcs, monkeypatch):
        def measure(run, threshold_deg):
            raise ZeroDivisionError("a bug")

        monkeypatch.setattr("cosim.studies.metrics.measure", measure)
        with pytest.raises(ZeroDivisionError):
            adcs("run", "zhang2018-ppatc", "--stop", "0.05", "--out", "out")
        result = Result.read("out")
        assert (len(result), result.info["status"], result.info["error"]) == (6, "failed", "ZeroDivisionError")


@pytest.mark.parametrize("arguments", [[], ["--backend", "native"]])
def test_without_a_compiler_the_python_back_end_flies_and_one_line_says_so(
    adcs, folder, monkeypatch, caplog, arguments
):
    (folder / "none").mkdir()
    monkeypatch.setenv("PATH", str(folder / "none"))
    monkeypatch.setenv("ADCS_BUILD", str(folder / "build"))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(toolchain, "_has_zig", lambda: False)
    monkeypatch.setattr("cosim.flight._told", set())
    done = adcs("run", "zhang2018-ppatc", "--stop", "0.02", "--out", "out", *arguments)
    assert done.status == 0
    (line,) = [line for line in done.err.splitlines() if "compiler" in line]
    (told,) = [record.getMessage() for record in caplog.records if "loop" in record.getMessage()]
    assert told.startswith("the loop runs in Python, not in the kernel, for no C compiler found (tried cc, gcc, clang")
    assert line.startswith("no C compiler found (tried cc, gcc, clang, python -m ziglang cc). Install gcc or clang")
    assert line.endswith("Until then: python back end.")
    result = Result.read("out")
    assert (result.info["loop"]["name"], result.info["loop"]["reason"][:20]) == ("python", "no C compiler found ")
    assert {c["path"].split(os.sep)[-2] for c in result.info["components"].values()} == {"python"}
    refused = adcs("build", "Sum")
    assert (refused.status, "NoCompiler: no C compiler found" in refused.err) == (2, True)


class TestProcesses:
    """Runs in processes of their own that get signals."""

    @pytest.fixture
    def started(self, folder):
        """Start an endless run and wait for its first rows; it is ended in any case."""
        (folder / "target.py").write_text(own_files.TARGET)
        processes = []

        def call(system, *arguments):
            command = [sys.executable, "-m", "cosim", "run", system, "--stop", "1000h", "--out", "out", *arguments]
            process = subprocess.Popen(
                command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
            )
            processes.append(process)
            stream, deadline = folder / "out" / "result.arrows", time.monotonic() + 60
            while not (stream.is_file() and stream.stat().st_size > 100_000) and time.monotonic() < deadline:
                assert process.poll() is None, process.communicate()
                time.sleep(0.05)
            return process

        yield call
        for process in processes:
            process.kill()
            process.communicate()

    @pytest.mark.parametrize(
        ("system", "arguments"),
        [("zhang2018-ppatc", []), ("target.py", []), ("zhang2018-ppatc", ["--backend", "python"])],
    )
    def test_interrupt(self, started, folder, system, arguments):
        process = started(system, *arguments)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
        assert process.returncode == 1
        assert out.startswith("interrupted: ")
        assert "Traceback" not in err
        assert "claims of zhang2018: not judged, the run ended early" in out or system == "target.py"
        result = Result.read(folder / "out")
        assert (result.info["status"], result.info["reached_time"]) == ("interrupted", result.time[-1])
        assert sorted(p.name for p in (folder / "out").iterdir()) == ["result.parquet", "run.json"]
        assert len(result) == result.info["rows"] > 100
        assert f"{len(result)} rows recorded" in out

    @pytest.mark.parametrize("system", ["zhang2018-ppatc", "target.py"])
    def test_kill(self, started, folder, system):
        """Rows reach the file at the latest each second."""
        process = started(system)
        time.sleep(1.6)
        age = time.time() - (folder / "out" / "result.arrows").stat().st_mtime
        process.kill()
        process.communicate()
        assert age < 1.5
        result = Result.read(folder / "out")
        assert (process.returncode, result.info["status"]) == (-signal.SIGKILL, "died")
        assert len(result) > 100
        assert_allclose(np.diff(result.time), 0.01, atol=1e-9)
        assert json.loads((folder / "out" / "run.json").read_text())["system"] == "zhang2018-ppatc"
