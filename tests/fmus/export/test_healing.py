"""What is kept heals: an FMU or its note that is damaged or gone is built again; many may find a cold cache at once."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from fmus import places
from fmus.errors import PlaceUnusable
from fmus.export import build as building
from fmus.export.build import BACKENDS, build_reference


def empty(path):
    path.write_bytes(b"")


def cut(path):
    path.write_bytes(path.read_bytes()[:-30])


def flip(path):
    """One bit, and nothing that a look at the file's size and time would tell."""
    data, stat = bytearray(path.read_bytes()), path.stat()
    data[len(data) // 2] ^= 0x80
    path.write_bytes(data)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def remove(path):
    path.unlink()


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.mark.parametrize("damage", [empty, cut, flip, remove])
@pytest.mark.parametrize("what", ["FMU", "note"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_damaged_file_is_built_again_with_a_line(cache, backend, what, damage):
    told: list[str] = []
    fmu = build_reference("Sum", backend, announce=told.append)
    whole = fmu.read_bytes()
    damage(fmu if what == "FMU" else building._note_file(fmu))
    assert build_reference("Sum", backend, announce=told.append) == fmu
    assert told == [f"building Sum ({backend})"] * 2
    assert fmu.read_bytes() == whole
    build_reference("Sum", backend, announce=told.append)
    assert len(told) == 2


def test_a_cache_that_is_removed_while_a_process_runs_is_made_again(cache):
    first = build_reference("Sum")
    os.rename(cache, cache.with_name("gone"))
    assert build_reference("Sum") == first
    assert first.is_file()


def test_what_is_in_the_way_is_told(cache):
    (places.made(cache / "native") / "Sum.fmu").mkdir()
    with pytest.raises(PlaceUnusable) as caught:
        build_reference("Sum")
    assert str(caught.value).startswith(f"{cache}/native cannot hold what is built: Sum.fmu cannot be put there (")
    assert str(caught.value).endswith("Remove that folder; it is made again.")


BY_THREADS = """
from concurrent.futures import ThreadPoolExecutor
from fmus.export.build import build_reference
with ThreadPoolExecutor(8) as threads:
    print(len(set(threads.map(lambda _: build_reference("Sum"), range(8)))))
"""


def test_eight_threads_in_each_of_four_processes_build_one_fmu_at_once(cache):
    command = [sys.executable, "-c", BY_THREADS]
    with ThreadPoolExecutor(4) as threads:
        done = list(threads.map(lambda _: subprocess.run(command, capture_output=True, text=True), range(4)))
    assert [(d.returncode, d.stdout, d.stderr) for d in done] == [(0, "1\n", "")] * 4
    told: list[str] = []
    fmu = build_reference("Sum", announce=told.append)
    assert told == []
    assert {file.name for file in fmu.parent.iterdir()} == {"Sum.fmu", ".Sum.fmu.key"}


# from a warm cache, so that nothing imports pythonfmu before the FMU does
FLY_THEN_BUILD = """
import zipfile
from cosim.slaves.fmi2 import FmuSlave
from fmus.export.build import build_reference
slave = FmuSlave("one", build_reference("Sum", "python"))
slave.instantiate()
with zipfile.ZipFile(build_reference("HarmonicTorque", "python")) as archive:
    print(any(name.startswith("binaries/") for name in archive.namelist()))
"""


def test_what_is_built_after_a_python_fmu_has_flown_has_its_binaries(cache):
    build_reference("Sum", "python")
    done = subprocess.run([sys.executable, "-c", FLY_THEN_BUILD], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr
