"""The toolchain: which compiler is taken, reproducible libraries, clear refusals, a universal library for macOS."""

import ctypes
import os
import shutil
import struct
import sys
from pathlib import Path

import pytest

from fmus import toolchain
from fmus.errors import BuildError, CompileFailed, NoCompiler
from fmus.toolchain import SUFFIXES, compile_library, compiler_name, find_compiler, host_platform, resolve_platforms

SOURCE = '#include "number.h"\n#include <math.h>\n#if defined(_WIN32)\n__declspec(dllexport)\n#else\n'
SOURCE += '__attribute__((visibility("default")))\n#endif\ndouble answer(double x) { return NUMBER + sqrt(x); }\n'
posix = pytest.mark.skipif(os.name != "posix", reason="the fake compiler is a shell script")


@pytest.fixture
def folder(tmp_path):
    place = tmp_path / "Quellen in Köln"
    place.mkdir()
    (place / "answer.c").write_text(SOURCE)
    (place / "number.h").write_text("#define NUMBER 40\n")
    return place


@pytest.fixture
def no_compiler(monkeypatch):
    """A machine without any compiler."""
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(toolchain, "_has_zig", lambda: False)


def fake(path: Path, script: str) -> Path:
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return path


def test_a_library_computes(folder, tmp_path):
    output = tmp_path / "out" / f"answer{SUFFIXES[host_platform()]}"
    compile_library(folder, "answer.c", output)
    answer = ctypes.CDLL(str(output)).answer
    answer.argtypes, answer.restype = [ctypes.c_double], ctypes.c_double
    assert answer(4.0) == 42.0
    assert list(output.parent.iterdir()) == [output]


def test_the_same_source_gives_the_same_bytes(folder, tmp_path):
    other = tmp_path / "elsewhere"
    shutil.copytree(folder, other)
    libraries = [tmp_path / "a" / "answer.so", tmp_path / "b" / "deeper" / "answer.so"]
    for place, library in zip((folder, other), libraries, strict=True):
        compile_library(place, "answer.c", library)
    assert libraries[0].read_bytes() == libraries[1].read_bytes()


def test_headers_of_another_folder(folder, tmp_path):
    headers = tmp_path / "headers"
    headers.mkdir()
    (folder / "number.h").rename(headers / "number.h")
    with pytest.raises(CompileFailed, match=r"number\.h"):
        compile_library(folder, "answer.c", tmp_path / "answer.so")
    compile_library(folder, "answer.c", tmp_path / "answer.so", include=(headers,))


def test_the_compilers_own_words(folder, tmp_path):
    (folder / "answer.c").write_text("int answer(void) { return nonsense; }\n")
    with pytest.raises(CompileFailed, match="nonsense") as caught:
        compile_library(folder, "answer.c", tmp_path / "out" / "answer.so")
    assert "answer.c" in caught.value.command
    assert "nonsense" in caught.value.output
    assert list((tmp_path / "out").iterdir()) == []


@posix
def test_cc_is_taken_with_its_arguments(folder, tmp_path, monkeypatch):
    script = 'echo "$@" > "$RECORD"\necho $ZIG_GLOBAL_CACHE_DIR $ZIG_LOCAL_CACHE_DIR >> "$RECORD"\nfor a; do :; done\n'
    compiler = fake(tmp_path / "my zig", script + 'while [ "$1" != -o ]; do shift; done\necho library > "$2"')
    monkeypatch.setenv("CC", f"'{compiler}' -funny")
    monkeypatch.setenv("RECORD", str(tmp_path / "record"))
    monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "cache"))
    assert find_compiler() == [str(compiler), "-funny"]
    assert compiler_name() == f"{compiler} -funny"
    compile_library(folder, "answer.c", tmp_path / "answer.so")
    assert (tmp_path / "answer.so").read_text() == "library\n"
    arguments, caches = (tmp_path / "record").read_text().splitlines()
    assert arguments.startswith("-funny -shared ")
    assert " -ffp-contract=off " in arguments
    assert " answer.c " in arguments  # relative: no path of this machine enters the library
    assert caches == f"{tmp_path}/cache/zig {tmp_path}/cache/zig"


def test_cc_that_does_not_exist_is_not_passed_over(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    with pytest.raises(NoCompiler, match=r"tried \$CC = no-such-compiler -m64"):
        find_compiler()


def test_no_compiler(no_compiler, folder, tmp_path):
    with pytest.raises(NoCompiler, match=r"tried cc, gcc, clang, python -m ziglang cc.*--backend python"):
        compile_library(folder, "answer.c", tmp_path / "answer.so")
    assert compiler_name() == "none"
    other = next(p for p in SUFFIXES if p != host_platform())
    with pytest.raises(NoCompiler) as caught:
        compile_library(folder, "answer.c", tmp_path / "answer.so", other)
    assert str(caught.value) == (
        f"no C compiler for {other} found (tried python -m ziglang cc). `pip install 'adcs-cosim[cross]'` brings one "
        "for every platform."
    )


@posix
@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("exit 1", "it says nothing"),
        ("echo >&2; echo 'cannot execute cc1' >&2; exit 1", "cannot execute cc1"),
        ("exit 0", "it ended well, but wrote no library"),
    ],
)
def test_a_compiler_that_compiles_nothing_is_none(folder, tmp_path, monkeypatch, script, said):
    compiler = fake(tmp_path / "broken", script)
    monkeypatch.setenv("CC", str(compiler))
    with pytest.raises(NoCompiler) as caught:
        compile_library(folder, "answer.c", tmp_path / "out" / "answer.so")
    begin = f"no C compiler found (tried {compiler}, which compiles nothing at all: {said}). Install gcc or clang, or "
    assert str(caught.value).startswith(begin)
    assert list((tmp_path / "out").iterdir()) == []


@posix
def test_a_compiler_that_is_no_program_is_none(folder, tmp_path, monkeypatch):
    compiler = tmp_path / "text"
    compiler.write_bytes(b"\x7fELF, but no more")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    with pytest.raises(NoCompiler, match=r"which compiles nothing at all: .*Exec format error"):
        compile_library(folder, "answer.c", tmp_path / "answer.so")


@posix
def test_cc_that_cannot_be_read_is_none(monkeypatch):
    monkeypatch.setenv("CC", "gcc 'half")
    with pytest.raises(NoCompiler, match=r"tried \$CC = gcc 'half: No closing quotation"):
        find_compiler()
    assert compiler_name() == "none"


def test_ziglang_where_there_is_no_other(no_compiler, monkeypatch):
    monkeypatch.setattr(toolchain, "_has_zig", lambda: True)
    command = find_compiler()
    assert command[:5] == [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        "-target",
    ]  # a target: no instructions of this very processor


@posix
@pytest.mark.parametrize("name", ["cc", "gcc", "clang"])
def test_order_of_compilers(no_compiler, tmp_path, monkeypatch, name):
    fake(tmp_path / name, "exit 0")
    fake(tmp_path / "clang", "exit 0")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_compiler() == [name]


def test_platforms():
    assert resolve_platforms(("host",)) == ["host"]
    assert resolve_platforms(("win64", "win64", "darwin64")) == ["win64", "darwin64"]
    assert resolve_platforms(("host", host_platform())) == [host_platform()]
    assert set(resolve_platforms(("all",))) == set(SUFFIXES)
    known = r"Platforms: host, all, linux64, win64, darwin64\."
    with pytest.raises(BuildError, match=rf'unknown platform "win32"\. Did you mean "win64"\? {known}'):
        resolve_platforms(("win64", "win32"))


def test_compile_library_refuses_an_unknown_platform(folder, tmp_path):
    for platform in ("amiga", "all"):
        with pytest.raises(BuildError, match=f"unknown platform '{platform}'"):
            compile_library(folder, "answer.c", tmp_path / "answer.so", platform)


def test_a_host_without_a_platform(monkeypatch):
    monkeypatch.setattr(toolchain.machine, "system", lambda: "FreeBSD")
    with pytest.raises(BuildError, match=r"no FMI 2.0 platform for FreeBSD on .*There are linux64, win64, darwin64"):
        host_platform()


def test_a_universal_library_holds_every_slice(tmp_path):
    slices = []
    for processor, content in ((0x01000007, b"x86" * 10), (0x0100000C, b"arm" * 9000)):
        path = tmp_path / str(processor)
        path.write_bytes(struct.pack("<III", 0xFEEDFACF, processor, 3) + content)
        slices.append(path)
    toolchain._join(slices, tmp_path / "out")
    data = (tmp_path / "out").read_bytes()
    assert struct.unpack(">II", data[:8]) == (0xCAFEBABE, 2)
    for i, path in enumerate(slices):
        processor, kind, offset, size, align = struct.unpack(">IIIII", data[8 + 20 * i : 28 + 20 * i])
        assert (str(processor), kind, align) == (path.name, 3, 14)
        assert offset % 2**align == 0
        assert data[offset : offset + size] == path.read_bytes()


@pytest.mark.slow
@pytest.mark.peers
@pytest.mark.skipif(not toolchain._has_zig(), reason="ziglang is not installed")
@pytest.mark.parametrize(
    ("platform", "magic"), [("linux64", b"\x7fELF"), ("win64", b"MZ"), ("darwin64", b"\xca\xfe\xba\xbe")]
)
def test_cross_compiled_libraries(folder, tmp_path, monkeypatch, platform, magic):
    """Byte-identical too, from two folders."""
    libraries = [tmp_path / place / f"answer{SUFFIXES[platform]}" for place in ("a", "b")]
    for i, library in enumerate(libraries):
        monkeypatch.setenv("ZIG_LOCAL_CACHE_DIR", str(tmp_path / f"cache-{i}"))
        source = tmp_path / f"source-{i}"
        shutil.copytree(folder, source)
        compile_library(source, "answer.c", library, platform)
        assert list(library.parent.iterdir()) == [library]
    assert libraries[0].read_bytes().startswith(magic)
    assert libraries[0].read_bytes() == libraries[1].read_bytes()
