"""One C source -> a shared library for a platform, reproducibly: the same source gives the same bytes.

For this machine: `$CC`, else cc, gcc or clang, else the compiler of the package ziglang. For a platform that is named:
ziglang (with an old glibc, so that the library runs on other machines too), else this machine's compiler if it is its
platform. A macOS library is universal: one slice for each processor, joined here.
"""

import importlib.util
import os
import platform as machine
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from fmus import places
from fmus.description.names import did_you_mean
from fmus.errors import BuildError, CompileFailed, NoCompiler

HOST, ALL = "host", "all"
SUFFIXES = {"linux64": ".so", "win64": ".dll", "darwin64": ".dylib"}
ZIG_TARGETS = {
    "linux64": ("x86_64-linux-gnu.2.17",),
    "win64": ("x86_64-windows-gnu",),
    "darwin64": ("x86_64-macos.11.0", "aarch64-macos.11.0"),
}
FLAGS = ("-shared", "-fPIC", "-O3", "-std=c99", "-ffp-contract=off", "-fvisibility=hidden", "-g0", "-s")
COMPILERS = ("cc", "gcc", "clang")


def host_platform() -> str:
    """Return FMI 2.0's folder name of this machine's binaries; it does not tell processors of 64 bits apart."""
    name = {"Linux": "linux64", "Windows": "win64", "Darwin": "darwin64"}.get(machine.system())
    if name is None or sys.maxsize < 2**32:
        raise BuildError(
            f"no FMI 2.0 platform for {machine.system()} on {machine.machine()}. There are {', '.join(SUFFIXES)}."
        )
    return name


def resolve_platforms(platforms: Sequence[str]) -> list[str]:
    """Return the platforms to build for, each once; "all" is all that there are. Raises BuildError."""
    named: list[str] = []
    for name in platforms:
        if name != ALL and name != HOST and name not in SUFFIXES:
            known = [HOST, ALL, *SUFFIXES]
            raise BuildError(f'unknown platform "{name}".{did_you_mean(name, known)} Platforms: {", ".join(known)}.')
        named += SUFFIXES if name == ALL else [name]
    return [p for p in dict.fromkeys(named) if p != HOST or host_platform() not in named]


def find_compiler() -> list[str]:
    """Return the command of this machine's compiler; raises NoCompiler."""
    text = os.environ.get("CC", "")
    try:
        chosen = shlex.split(text, posix=os.name == "posix")
    except ValueError as error:
        raise NoCompiler([f"$CC = {text}: {error}"]) from error
    if chosen:
        if shutil.which(chosen[0]) is None:
            raise NoCompiler([f"$CC = {' '.join(chosen)}"])
        return chosen
    for name in COMPILERS:
        if shutil.which(name):
            return [name]
    if _has_zig():
        target = {"arm64": "aarch64", "AMD64": "x86_64"}.get(machine.machine(), machine.machine())
        system = {"linux64": "linux-gnu.2.17", "win64": "windows-gnu", "darwin64": "macos.11.0"}[host_platform()]
        return [*_zig(), "-target", f"{target}-{system}"]
    raise NoCompiler([*COMPILERS, "python -m ziglang cc"])


def compiler_name() -> str:
    """Return what tells this machine's compiler from another one, or "none"."""
    try:
        command = find_compiler()
    except NoCompiler:
        return "none"
    path = Path(shutil.which(command[0]) or command[0]).resolve()
    return " ".join([str(path), *command[1:]])


def compile_library(
    folder: Path,
    source: str,
    output: Path,
    platform: str = HOST,
    include: tuple[Path, ...] = (),
    optimisation: str | None = None,
    more: Sequence[str] = (),
) -> None:
    """Compile one C source, named relative to its folder, into the shared library `output`.

    platform: "host", "linux64", "win64" or "darwin64". include: folders of further headers. optimisation: "-O1"
    or the like in place of that of FLAGS. more: further sources, each compiled on its own, and flags. Raises
    BuildError, of which NoCompiler and CompileFailed are kinds: a compiler that compiles nothing at all is none.
    """
    if platform != HOST and platform not in SUFFIXES:
        raise BuildError(f"unknown platform {platform!r}. Platforms: {HOST}, {', '.join(SUFFIXES)}.")
    system = host_platform() if platform == HOST else platform
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=places.workshop(output.parent), prefix=".compile-") as place:
        parts: list[Path] = []
        for i, command in enumerate(_commands(platform)):
            part = Path(place) / str(i) / output.name  # a name inside the library must not tell where it was made
            part.parent.mkdir()
            includes = [f"-I{path.resolve()}" for path in include]
            flags = [*FLAGS, *([optimisation] if optimisation else [])]  # the last one counts
            arguments = [*command, *flags, *includes, *more, source, "-o", str(part.resolve())]
            if system == "darwin64":
                arguments.append(f"-Wl,-install_name,@rpath/{output.name}")
            if system != "win64":
                arguments.append("-lm")
            failure = _failure(arguments, folder, part)
            if failure is not None:
                raise failure if _works(command) else _none_that_works(command, failure, platform)
            parts.append(part)
        if len(parts) > 1:
            _join(parts, Path(place) / output.name)
            parts = [Path(place) / output.name]
        places.keep(parts[0], output)


def _commands(platform: str) -> list[list[str]]:
    """Return the compiler's command, one for each processor that the library is for."""
    if platform == HOST or (platform == host_platform() and not _has_zig()):
        return [find_compiler()]
    if not _has_zig():
        raise NoCompiler(["python -m ziglang cc"], platform)
    return [[*_zig(), "-target", target] for target in ZIG_TARGETS[platform]]


def _has_zig() -> bool:
    return importlib.util.find_spec("ziglang") is not None


def _zig() -> list[str]:
    return [sys.executable, "-m", "ziglang", "cc"]


def _failure(arguments: list[str], folder: Path, output: Path) -> CompileFailed | None:
    """Run the compiler; return how it failed, None where the output is there."""
    environment = dict(os.environ)
    if any("zig" in word for word in arguments[:3]):  # it keeps the C library that it has compiled
        kept = str(places.cache() / "zig")
        environment = {"ZIG_GLOBAL_CACHE_DIR": kept, "ZIG_LOCAL_CACHE_DIR": kept, **environment}
    try:
        done = subprocess.run(
            arguments, cwd=folder, env=environment, capture_output=True, text=True, errors="replace", check=False
        )
    except OSError as error:  # what which() found is no program
        return CompileFailed(arguments, str(error))
    if done.returncode != 0:
        return CompileFailed(arguments, done.stderr or done.stdout)
    return None if output.is_file() else CompileFailed(arguments, "it ended well, but wrote no library")


def _works(command: list[str]) -> bool:
    """Whether a compiler makes a library of a source in which nothing can be wrong."""
    with tempfile.TemporaryDirectory(dir=places.workshop()) as place:
        source, output = Path(place) / "trial.c", Path(place) / "trial.so"
        source.write_text("int trial(void);\nint trial(void) { return 0; }\n")
        return _failure([*command, *FLAGS, source.name, "-o", str(output)], source.parent, output) is None


def _none_that_works(command: list[str], failure: CompileFailed, platform: str) -> NoCompiler:
    said = next((line.strip() for line in failure.output.splitlines() if line.strip()), "it says nothing")
    tried = f"{shlex.join(command)}, which compiles nothing at all: {said}"
    return NoCompiler([tried], "" if platform in (HOST, host_platform()) else platform)


def _join(slices: list[Path], output: Path) -> None:
    """Write a universal Mach-O file: a table of the slices, each beginning on a page of its own."""
    bits = 14
    page = 1 << bits
    table, body, offset = struct.pack(">II", 0xCAFEBABE, len(slices)), b"", page
    for path in slices:
        data = path.read_bytes()
        processor, kind = struct.unpack("<II", data[4:12])
        table += struct.pack(">IIIII", processor, kind, offset, len(data), bits)
        padded = data + b"\0" * (-len(data) % page)
        body += padded
        offset += len(padded)
    output.write_bytes(table.ljust(page, b"\0") + body)
