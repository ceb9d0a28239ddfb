"""A worker that dies after its tests makes the run fail."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ENDS = {
    "well": ("pass", 0, ""),
    "with an abort": ("os.abort()", 1, "worker gw0 ended with status -6, after its tests"),
    "with a status": ("os._exit(7)", 1, "worker gw0 ended with status 7, after its tests"),
}


@pytest.mark.parametrize(("end", "status", "line"), ENDS.values(), ids=ENDS)
def test_a_worker_that_ends(tmp_path, end, status, line):
    shutil.copy(Path(__file__).with_name("conftest.py"), tmp_path)
    (tmp_path / "test_green.py").write_text(
        f"import atexit, os\n\ndef end():\n    {end}\n\ndef test_green():\n    atexit.register(end)\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-n", "1", "--rootdir", str(tmp_path), str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, "1 passed" in done.stdout) == (status, True), done.stdout
    assert line in done.stdout
