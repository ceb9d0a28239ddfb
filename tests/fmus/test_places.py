"""Where built FMUs, kernels and extracted FMUs live: the user's cache, what stands in for it, what is refused."""

import logging
import os
import re
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fmus import places
from fmus.errors import BuildError, PlaceUnusable

posix = pytest.mark.skipif(os.name != "posix", reason="modes and owners are POSIX's")


@pytest.fixture(autouse=True)
def fresh(monkeypatch, tmp_path):
    """As a new process, with a home of its own and nothing chosen."""
    for variable in ("ADCS_BUILD", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(places, "_usable", set())
    monkeypatch.setattr(places, "_own", {})


def in_a_process(code: str, cache: Path, **more: str) -> str:
    """What a new process prints, its $ADCS_BUILD set."""
    environment = os.environ | {"ADCS_BUILD": str(cache)} | more
    command = [sys.executable, "-c", f"from fmus import places\n{code}"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def test_what_is_chosen_wins_and_is_made(monkeypatch, tmp_path):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "a" / "b"))
    assert places.cache() == tmp_path / "a" / "b"
    assert places.kernel() == tmp_path / "a" / "b" / "kernel"
    if os.name == "posix":
        assert [mode(tmp_path / part) for part in ("a", "a/b", "a/b/kernel")] == [0o700] * 3


@pytest.mark.parametrize(
    ("platform", "variable", "below"),
    [
        ("linux", None, "home/.cache"),
        ("linux", "XDG_CACHE_HOME", "elsewhere"),
        ("darwin", None, "home/Library/Caches"),
        ("win32", "LOCALAPPDATA", "elsewhere"),
        ("win32", None, "home/AppData/Local"),
    ],
)
def test_the_cache_of_the_platform(monkeypatch, tmp_path, platform, variable, below):
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    if variable:
        monkeypatch.setenv(variable, str(tmp_path / "elsewhere"))
    assert places.cache() == tmp_path / below / "adcs-cosim"


@pytest.mark.skipif(sys.platform != "linux", reason="XDG_CACHE_HOME is of Linux")
def test_what_is_set_to_nothing_is_not_set(monkeypatch, tmp_path):
    monkeypatch.setenv("ADCS_BUILD", "")
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    assert places.cache() == tmp_path / "home" / ".cache" / "adcs-cosim"


def test_what_is_chosen_but_cannot_be_made_is_an_error(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "file" / "below"))
    with pytest.raises(PlaceUnusable) as caught:
        places.cache()
    assert isinstance(caught.value, BuildError)
    assert caught.value.folder == tmp_path / "file" / "below"
    assert str(caught.value) == (
        f"{tmp_path}/file/below cannot hold what is built: File exists: {tmp_path}/file. "
        "Set ADCS_BUILD to a folder that you can write, or unset it."
    )


@posix
def test_what_is_chosen_but_cannot_be_written_is_an_error(monkeypatch, tmp_path):
    def refused(dir, prefix):
        raise PermissionError(13, "Permission denied", f"{dir}/{prefix}1")

    monkeypatch.setattr(places.tempfile, "TemporaryFile", refused)  # whoever runs the tests may be allowed everything
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path))
    with pytest.raises(PlaceUnusable, match=r"is built: Permission denied: .*\.trial-1\. Set ADCS_BUILD to"):
        places.cache()


def test_a_default_that_cannot_be_written_gives_way_to_a_temporary_folder_with_one_line(monkeypatch, tmp_path, caplog):
    (tmp_path / "home").write_text("no folder")
    with caplog.at_level(logging.WARNING):
        first, again = places.cache(), places.cache()
    assert first == again
    assert first.is_dir()
    (line,) = caplog.messages
    begin = f"{tmp_path}/home/.cache/adcs-cosim cannot be written (File exists: {tmp_path}/home): FMUs are built in"
    assert line.startswith(begin)
    assert str(first) in line and "Set ADCS_BUILD" in line
    places._remove(os.getpid(), first)
    assert not first.exists()


def test_a_user_without_a_home_has_a_temporary_folder_too(monkeypatch, caplog):
    def nowhere():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", nowhere)
    places._remove(os.getpid(), places.cache())
    assert "the cache folder cannot be written (Could not determine home directory.)" in caplog.messages[0]


@posix
def test_an_empty_home_is_none_and_not_the_root_folder(monkeypatch, caplog):
    monkeypatch.setenv("HOME", "")
    places._remove(os.getpid(), places.cache())
    assert "the cache folder cannot be written (HOME is empty)" in caplog.messages[0]


@posix
def test_without_the_variable_home_the_users_own_is_taken(monkeypatch):
    monkeypatch.delenv("HOME")
    assert places._default().parents[1] == Path.home()


def test_the_temporary_folder_goes_with_its_process_and_the_line_goes_to_the_terminal(tmp_path):
    (tmp_path / "home").write_text("no folder")
    environment = os.environ | {"HOME": str(tmp_path / "home")}
    command = [sys.executable, "-c", "from fmus import places; print(places.cache()); print(places.extracted())"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    cache, extracted = map(Path, done.stdout.split())
    assert extracted.parent.parent == cache
    assert not cache.exists()
    assert len(done.stderr.splitlines()) == 1


@posix
@pytest.mark.parametrize("bits", [0o720, 0o702, 0o777])
def test_a_cache_that_others_can_write_is_refused(monkeypatch, tmp_path, bits):
    place = tmp_path / "shared"
    place.mkdir()
    place.chmod(bits)
    monkeypatch.setenv("ADCS_BUILD", str(place))
    with pytest.raises(PlaceUnusable, match=f"{place} .*mode {bits:04o}.*chmod go-w '{place}'"):
        places.cache()
    place.chmod(0o755)
    assert places.cache() == place


@posix
def test_a_cache_of_somebody_else_is_refused(monkeypatch, tmp_path):
    found = (tmp_path / "x").parent.stat()
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path))
    values = [*found]
    values[4] = 4711
    monkeypatch.setattr(os, "geteuid", lambda: 4712)
    monkeypatch.setattr(Path, "stat", lambda self, **_: os.stat_result(values))
    with pytest.raises(
        PlaceUnusable, match=r"belongs to another user \(number 4711, this is 4712\).*folder of your own"
    ):
        places.cache()


def test_a_process_has_one_folder_of_extracted_fmus(monkeypatch, tmp_path):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path))
    found: list[Path] = []
    threads = [threading.Thread(target=lambda: found.append(places.extracted())) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (folder,) = set(found)
    assert folder.parent == tmp_path / "extracted"
    assert re.fullmatch(rf"{os.getpid()}-[0-9a-f]{{16}}", folder.name)
    assert folder.is_dir()
    places._remove(os.getpid(), folder)
    assert [p.name for p in folder.parent.iterdir()] == [places.TURN]


def test_it_goes_at_exit(tmp_path):
    folder = Path(in_a_process("print(places.extracted())\n(places.extracted() / 'file').touch()", tmp_path))
    assert folder.parent.is_dir()
    assert not folder.exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_has_a_folder_of_its_own_and_leaves_that_of_its_parent(tmp_path):
    code = """
import os, sys
ours = places.extracted()
if os.fork() == 0:
    theirs = places.extracted()
    print(theirs != ours, theirs.is_dir(), ours.is_dir(), flush=True)
    sys.exit()  # with what is registered for the exit
os.wait()
print(ours.is_dir())
"""
    assert in_a_process(code, tmp_path).split() == ["True", "True", "True", "True"]
    assert [p.name for p in (tmp_path / "extracted").iterdir()] == [places.TURN]


def test_a_killed_process_leaves_neither_a_half_build_nor_a_temporary_cache(tmp_path):
    """What is half made lies in the folder of the process; one in place of the cache has a lock too."""
    half = """
import os, tempfile
kept = places.made(places.cache() / "native")
print(tempfile.mkdtemp(dir=places.workshop(kept)), places.workshop(kept.parents[1]) == kept.parents[1], flush=True)
os._exit(0)
"""
    left, elsewhere = in_a_process(half, tmp_path / "cache").split()
    assert Path(left).is_dir() and elsewhere == "True"
    in_a_process("places.extracted()", tmp_path / "cache")
    assert not Path(left).exists()
    (tmp_path / "tmp").mkdir()
    code = "from fmus import places; import os; print(places.cache(), flush=True); os._exit(0)"
    environment = {k: v for k, v in os.environ.items() if k not in ("ADCS_BUILD", "XDG_CACHE_HOME")}
    environment |= {"HOME": "", "TMPDIR": str(tmp_path / "tmp")}
    command = [sys.executable, "-c", code]
    first, second = (
        Path(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip())
        for _ in range(2)
    )
    assert first != second and first.parent == second.parent == tmp_path / "tmp"
    assert not first.exists() and second.exists()


def test_what_dead_processes_left_is_swept_and_the_living_keep_theirs(tmp_path):
    code = "import os; print(places.extracted(), flush=True); (places.extracted() / 'file').touch(); os._exit(0)"
    dead = Path(in_a_process(code, tmp_path))
    assert (dead / "file").exists()
    alive = subprocess.Popen(
        [sys.executable, "-c", "from fmus import places; print(places.extracted(), flush=True); input()"],
        env=os.environ | {"ADCS_BUILD": str(tmp_path)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    theirs = Path(alive.stdout.readline().strip())
    assert not dead.exists()
    in_a_process("places.extracted()", tmp_path)
    assert theirs.is_dir()
    alive.communicate("\n")
    assert [p.name for p in (tmp_path / "extracted").iterdir()] == [places.TURN]
