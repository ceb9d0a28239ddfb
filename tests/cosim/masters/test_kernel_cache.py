"""The kernel's file or its checksum is damaged or gone: the kernel is compiled anew, with a line where it is damage."""

import fmpy
import pytest

from cosim.masters.kernel import library as kernel


def flip(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x80
    path.unlink()  # it may be loaded
    path.write_bytes(data)


def empty(path):
    path.unlink()
    path.touch()


def remove(path):
    path.unlink()


@pytest.mark.parametrize("damage", [flip, empty, remove])
@pytest.mark.parametrize("what", ["library", "checksum"])
def test_what_is_damaged_is_compiled_anew(tmp_path, monkeypatch, caplog, what, damage):
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel, "_loaded", {})
    kernel.library()
    (path,) = kernel._loaded
    whole = path.read_bytes()
    assert caplog.messages == []
    fmpy.freeLibrary(kernel._loaded.pop(path)._handle)  # as a new process finds it
    damage(path if what == "library" else kernel._seal(path))
    kernel.library()
    assert path.read_bytes() == whole
    told = [f"the kernel {path} is damaged, or of another version: it is compiled anew"]
    assert caplog.messages == ([] if damage is remove else told)
    assert sorted(p.name for p in path.parent.iterdir()) == sorted([path.name, kernel._seal(path).name])
