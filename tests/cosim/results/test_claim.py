"""Two runs into one folder: the second is refused while the first lives, whatever it was told to replace."""

import subprocess
import sys
import textwrap

import pytest

from cosim.errors import ResultBusy, ResultExists
from cosim.results.claim import LOCK
from cosim.results.result import Result

from ..fakes import Clock
from ..flights import run


class Nested(Clock):
    """In its second step another run begins, into the same folder."""

    def __init__(self, name: str, folder, **more):
        super().__init__(name)
        self.folder, self.more, self.error = folder, more, None

    def advance(self, t, h, v, slopes):
        super().advance(t, h, v, slopes)
        if t > 0.05 and self.error is None:
            with pytest.raises(ResultBusy) as caught:
                run([Clock("other")], [], out=self.folder, **self.more)
            self.error = caught.value


@pytest.mark.parametrize("overwrite", [True, False])
def test_the_second_run_is_refused_by_name_and_the_first_keeps_its_rows(tmp_path, monkeypatch, overwrite):
    monkeypatch.chdir(tmp_path)
    clock = Nested("c", "out", overwrite=True)
    result = run([clock], [], out="out", overwrite=overwrite)
    assert str(clock.error).startswith("out is being written by process ")
    assert str(clock.error).endswith("UTC. Wait for it, or write elsewhere (out=..., --out DIR).")
    assert Result.read("out").names == result.names == ["c.y"]
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["result.parquet", "run.json"]


def test_a_process_that_was_killed_leaves_no_lock(tmp_path):
    code = f"""
        import os
        from pathlib import Path
        from cosim.results.claim import claimed
        with claimed(Path({str(tmp_path)!r}) / "out"):
            os.kill(os.getpid(), 9)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=False)
    assert (tmp_path / "out" / LOCK).exists()
    assert len(run([Clock("c")], [], out=tmp_path / "out")) == 11
    assert not (tmp_path / "out" / LOCK).exists()


def test_a_result_that_came_meanwhile_is_not_overwritten(tmp_path):
    class Slow(Clock):
        def exit_initialization_mode(self):
            run([Clock("first")], [], out=tmp_path / "out")

    with pytest.raises(ResultExists):
        run([Slow("second")], [], out=tmp_path / "out")
    assert Result.read(tmp_path / "out").names == ["first.y"]
