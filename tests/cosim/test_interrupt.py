"""Ctrl-C, in processes of their own: the first ends a run within the step that is running, a second one at once."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from cosim.masters.interrupt import STATUS
from cosim.results.result import Result

from . import both
from .c_fmu import build, real, string

ROOT = Path(__file__).parents[2]
QUICK = 300_000
"""Steps that cost nothing, after which each takes 2 s, or `nap` s."""

pytestmark = pytest.mark.skipif(os.name != "posix", reason="SIGINT is sent to a process")


@pytest.fixture(scope="module")
def sleeper(tmp_path_factory):
    """y counts the steps; from step `quick` on each of them sleeps for `nap` s, whatever signals come."""
    step = r"""
        if (m->whole[0] >= (long long)quick) {
            struct timespec rest = { (time_t)nap, (long)(1e9 * (nap - (double)(time_t)nap)) };
            FILE *file = fopen(sign, "a");
            if (file) { fputs("asleep\n", file); fclose(file); }
            while (nanosleep(&rest, &rest)) {}
        }
        m->whole[0]++;
    """
    variables = [
        real("y"),
        real("quick", "parameter", start=float(QUICK)),
        real("nap", "parameter", start=2.0),
        string("sign", "parameter", start="asleep"),
    ]
    code = "y = (double)m->whole[0];"
    return build(tmp_path_factory.mktemp("sleeper"), "Sleeper", variables, outputs=code, step=step)


PROGRAM = """
import json, os, signal, sys, threading, time
from cosim import flights
from tests.cosim import both

SYSTEM = both.of({{"s": {fmu!r}}}, [], parameters={{"s.quick": {quick}, "s.nap": {nap}, "s.sign": {sign!r}}})

def fly(out="out", stop=100.0 * {quick}, every={every}, **more):
    return flights.simulate(SYSTEM, both.experiment(stop=stop, step=1.0, every=every, loop={loop!r}), out=out, **more)

"""


@pytest.fixture
def start(sleeper, tmp_path):
    """Start a program; `begun` waits until the FMU sleeps."""
    processes = []

    def call(code, loop="always", quick=QUICK, nap=2.0, every=1000):
        sign = tmp_path / "asleep"
        program = PROGRAM.format(fmu=str(sleeper), quick=quick, nap=nap, sign=str(sign), loop=loop, every=every)
        process = subprocess.Popen(
            [sys.executable, "-c", program + textwrap.dedent(code)],
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, start_new_session=True,
        )  # fmt: skip
        processes.append(process)
        deadline = time.monotonic() + 90
        while not sign.exists() and time.monotonic() < deadline:
            assert process.poll() is None, process.communicate()
            time.sleep(0.01)
        assert sign.exists(), "the quick steps took too long"
        return process, sign

    yield call
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate()


def steps_of(loop):
    """The Python loop takes fewer quick steps in the same time."""
    return {"always": QUICK, "never": 3000}[loop]


@pytest.mark.parametrize("loop", both.LOOPS)
class TestWithinAStep:
    def test_the_first_ends_the_run_within_the_step(self, start, tmp_path, loop):
        quick = steps_of(loop)
        process, sign = start(
            'r = fly(); print(r.info["status"], r.info["reached_time"])', loop, quick=quick, every=quick // 300
        )
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, f"interrupted {quick + 1:.1f}\n", "")
        assert sign.read_text() == "asleep\n"  # one slow step and no second
        result = Result.read(tmp_path / "out")
        assert result.info["status"] == "interrupted"
        assert result.time.tolist() == [*np.arange(0.0, quick + 1, quick // 300), quick + 1.0]
        assert result["s.y"].tolist() == result.time.tolist()

    def test_a_second_one_ends_the_process_at_once(self, start, tmp_path, loop):
        quick = steps_of(loop)
        process, sign = start("fly()", loop, quick=quick, nap=60.0, every=quick // 300)
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        assert process.poll() is None  # the first one lets the step end
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (STATUS, "", "")
        assert STATUS == 130
        assert sign.read_text() == "asleep\n"
        folder = tmp_path / "out"
        assert sorted(p.name for p in folder.iterdir()) == ["result.arrows", "run.json"]
        info = json.loads((folder / "run.json").read_text())
        assert info["status"] == "interrupted" and info["system"] == "test"
        result = Result.read(folder)
        assert len(result) == info["rows"] == 301
        assert result["s.y"].tolist() == result.time.tolist() == list(np.arange(0.0, quick + 1, quick // 300))

    def test_sigterm_ends_the_run_within_the_step_and_then_the_process(self, start, tmp_path, loop):
        quick = steps_of(loop)
        process, sign = start('fly(); print("not reached")', loop, quick=quick, every=quick // 300)
        time.sleep(0.3)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (128 + signal.SIGTERM, "", "")
        assert sign.read_text() == "asleep\n"
        assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["result.parquet", "run.json"]
        result = Result.read(tmp_path / "out")
        assert (result.info["status"], result.info["process"]) == ("interrupted", process.pid)
        assert result["s.y"][-1] == result.time[-1] == quick + 1

    def test_a_programs_own_handler_of_sigterm_is_called_after_the_run(self, start, tmp_path, loop):
        code = """
            signal.signal(signal.SIGTERM, lambda number, frame: print("mine", number))
            print(fly().info["status"], signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL)
        """
        process, _ = start(code, loop, quick=10, nap=1.0, every=1)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, f"mine {int(signal.SIGTERM)}\ninterrupted True\n", "")

    def test_the_rows_of_the_last_words_are_a_whole_stream(self, start, tmp_path, loop):
        """Nothing was on disk yet: the rows of the last second were in memory."""
        process, _ = start("fly()", loop, quick=10, nap=60.0, every=1)
        for _ in range(2):
            process.send_signal(signal.SIGINT)
            time.sleep(0.1)
        process.communicate(timeout=30)
        with (tmp_path / "out" / "result.arrows").open("rb") as file:
            table = pa.ipc.open_stream(file).read_all()
        assert table["s.y"].to_pylist() == list(map(float, range(11)))

    def test_without_a_folder_it_ends_too(self, start, tmp_path, loop):
        process, _ = start("fly(out=None)", loop, quick=10, nap=60.0)
        process.send_signal(signal.SIGINT)
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == STATUS
        assert sorted(p.name for p in tmp_path.iterdir()) == ["asleep"]


class TestAroundARun:
    def test_keyboard_interrupt_works_as_before_after_a_run(self, start):
        code = """
            handler = signal.getsignal(signal.SIGINT)
            fly(stop=12.0)
            assert signal.getsignal(signal.SIGINT) is handler is signal.default_int_handler
            assert signal.set_wakeup_fd(-1) == -1
            try:
                print("ready", flush=True)
                time.sleep(30)
            except KeyboardInterrupt:
                print("interrupted")
            r = fly(stop=12.0, overwrite=True)
            print(r.info["status"])
        """
        process, _ = start(code, quick=10, nap=0.01)
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "interrupted\nfinished\n", "")

    def test_a_second_one_after_an_interrupted_run_is_not_lost(self, start):
        """The run has ended by the first; the next is for whoever flies runs in a loop, and the next run is whole."""
        code = """
            result = fly()
            try:
                print(result.info["status"], flush=True)
                time.sleep(30)
            except KeyboardInterrupt:
                print("for the program")
            print(fly(stop=12.0, overwrite=True).info["status"])
        """
        process, _ = start(code, quick=10, nap=0.5)
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "for the program\nfinished\n", "")

    def test_a_second_one_while_python_can_hear_it(self, start, tmp_path):
        """In the Python loop between short steps it is a KeyboardInterrupt, and the run ends in order."""
        code = """
            stop = threading.Event()
            def press():
                while not os.path.exists("out/run.json"): time.sleep(0.01)
                time.sleep(0.3)
                os.kill(os.getpid(), signal.SIGINT); os.kill(os.getpid(), signal.SIGINT)
            threading.Thread(target=press).start()
            print(fly().info["status"])
        """
        process, _ = start(code, loop="never", quick=10, nap=0.05, every=1)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "interrupted\n", "")
        assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["result.parquet", "run.json"]

    def test_a_run_in_another_thread_is_untouched(self, start):
        """The main thread's handler gets the signal; the run in the thread flies to its end."""
        code = """
            got, results = [], []
            signal.signal(signal.SIGINT, lambda number, frame: got.append(number))
            thread = threading.Thread(target=lambda: results.append(fly(stop=13.0)))
            thread.start()
            thread.join()
            print(got, results[0].info["status"], results[0].info["reached_time"])
        """
        process, _ = start(code, quick=10, nap=0.5, every=1)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "[2] finished 13.0\n", "")

    def test_a_handler_and_a_wakeup_of_the_program_s_own_are_kept(self, start):
        """asyncio and others have both; their bytes still come while a run goes on."""
        code = """
            import socket
            mine, theirs = socket.socketpair()
            theirs.setblocking(False); mine.settimeout(5)
            signal.set_wakeup_fd(theirs.fileno())
            def handler(number, frame): pass
            signal.signal(signal.SIGINT, handler)
            print(fly().info["status"], mine.recv(8))
            assert signal.getsignal(signal.SIGINT) is handler
            assert signal.set_wakeup_fd(-1) == theirs.fileno()
        """
        process, _ = start(code, quick=10, nap=0.5, every=1)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "interrupted b'\\x02'\n", "")

    def test_a_run_within_a_run(self, start):
        """Whoever flies a run from the progress of another one leaves the other as it was."""
        code = """
            inner = []
            def progress(t, stop):
                if not inner:
                    inner.append(fly(out=None, stop=5.0).info["status"])
            def press():
                while not inner: time.sleep(0.01)
                time.sleep(0.3)
                os.kill(os.getpid(), signal.SIGINT)
            threading.Thread(target=press).start()
            print(fly(progress=progress).info["status"], *inner)
            began = time.process_time()
            time.sleep(0.3)
            print(time.process_time() - began < 0.1)  # nobody goes round and round
        """
        process, _ = start(code, quick=10, nap=0.05, every=1)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "interrupted finished\nTrue\n", "")

    def test_other_signals_do_not_end_a_run(self, start):
        code = """
            signal.signal(signal.SIGUSR1, lambda number, frame: None)
            print(fly(stop=13.0).info["status"])
        """
        process, _ = start(code, quick=10, nap=0.4, every=1)
        process.send_signal(signal.SIGUSR1)
        out, err = process.communicate(timeout=30)
        assert (process.returncode, out, err) == (0, "finished\n", "")

    def test_a_forked_process_hears_too(self, start):
        """multiprocessing forks: threads do not come along."""
        code = """
            fly(stop=11.0)
            child = os.fork()
            if child == 0:
                status = fly(out="child", overwrite=True).info["status"]
                os._exit(7 if status == "interrupted" else 1)
            time.sleep(1.0)
            os.kill(child, signal.SIGINT)
            print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        """
        process, _ = start(code, quick=10, nap=0.2, every=1)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out) == (0, "7\n"), err
