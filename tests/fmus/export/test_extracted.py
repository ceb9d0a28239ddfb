"""Where FMUs are extracted to: folders of any name, and folders that something empties while the process runs."""

import shutil
import subprocess
import sys

import pytest

from cosim.errors import CallFailed
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import build_reference

ODD = ["ü", "宇", "+", "%", "#", "&", ";", "[", "'", "a b", "~", "%41"]

FLY = """
from cosim.masters.kernel.library import library
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import build_reference
library()
for backend in ("native", "python"):
    slave = FmuSlave("one", build_reference("Sum", backend))
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    slave.do_step(0.0, 0.1)
    slave.terminate()
    slave.free()
    print(backend)
"""


def started(path) -> FmuSlave:
    slave = FmuSlave("one", path)
    slave.instantiate()
    slave.setup_experiment(0.0)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    slave.do_step(0.0, 0.1)
    return slave


@pytest.mark.parametrize("character", ODD)
def test_fmus_fly_below_a_folder_of_any_name(tmp_path, monkeypatch, character):
    """With temporary folders there too. In a process of their own: what they do wrong ends it."""
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / f"in {character} out"))
    (tmp_path / f"temporary{character}").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / f"temporary{character}"))
    done = subprocess.run([sys.executable, "-c", FLY], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split()) == (0, ["native", "python"]), done.stderr


def test_a_name_that_pythonfmu_reads_as_another_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "a%20b"))
    started(build_reference("Sum", "native"))
    with pytest.raises(CallFailed, match=r"pythonfmu takes %20 in .*a%20b.* for a blank: set ADCS_BUILD to a folder"):
        started(build_reference("Sum", "python"))


@pytest.mark.parametrize("backend", ["native", "python"])
@pytest.mark.parametrize("emptied", ["all", "the library", "a file that is only empty"])
def test_what_was_emptied_is_extracted_again_with_a_line(tmp_path, monkeypatch, caplog, backend, emptied):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    fmu = build_reference("Sum", backend)
    folder = started(fmu)._fmu.unzipDirectory
    assert started(fmu)._fmu.unzipDirectory == folder
    assert caplog.messages == []
    if emptied == "all":
        shutil.rmtree(tmp_path / "cache" / "extracted")
    elif emptied == "the library":
        shutil.rmtree(f"{folder}/binaries")
    else:
        with open(f"{folder}/modelDescription.xml", "w"):
            pass
    assert started(fmu)._fmu.unzipDirectory != folder
    (line,) = caplog.messages
    assert line == f"{folder}, extracted from {fmu}, was emptied: it is extracted again"
