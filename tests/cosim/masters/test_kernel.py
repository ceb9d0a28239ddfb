"""The kernel as a compiled library: healed where its file is damaged, strict in C, honest about what it cannot do."""

import hashlib
import json
import logging
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cosim import flights
from cosim.errors import NotSupported, TimeError, WiringErrors
from cosim.masters.explicit import Explicit
from cosim.masters.kernel import library as kernel_library
from cosim.masters.kernel import structures
from cosim.masters.kernel.kernel import Kernel
from cosim.masters.watch import Block, Watch
from cosim.results.result import Result
from cosim.time import LARGEST_INTEGER
from fmus import toolchain
from fmus.errors import BuildError

from .. import both, tiny_fmu
from ..fakes import Clock, Integrator
from ..flights import run

KERNEL = Path(kernel_library.__file__).parent
ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    return tiny_fmu.build(tmp_path_factory.mktemp("tiny"))


@pytest.fixture
def system(tiny):
    return both.of({"a": tiny}, [], held={"a.u": 2.0})


FLY = """
from cosim import flights
from tests.cosim import both

result = flights.simulate(both.of({{"a": {tiny!r}}}, [], held={{"a.u": 2.0}}), both.experiment(loop="auto"))
print(result.info["loop"]["name"] + result.info["loop"]["reason"], result["a.y"][-1].round(9))
"""


def seal_of(path):
    return path.with_name(f"{path.name}.sha256")


class TestHealing:
    """A process of its own finds the damaged file: a library that is loaded once stays what it is in its process."""

    @pytest.fixture
    def built(self, tmp_path, monkeypatch):
        """The kernel's file in a cache of its own."""
        monkeypatch.setenv("ADCS_BUILD", str(tmp_path / "build"))
        monkeypatch.setattr(kernel_library, "_loaded", {})
        kernel_library.library()
        ((path, _),) = kernel_library._loaded.items()
        return path

    def damage(self, path, content, *, sealed):
        """Put other bytes in its place; `sealed`: with the right checksum."""
        path.unlink()
        path.write_bytes(content)
        if sealed:
            seal_of(path).write_text(hashlib.sha256(content).hexdigest())

    def heals(self, tiny, path, content):
        code = FLY.format(tiny=str(tiny))
        done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout) == (0, "kernel 2.0\n"), done.stderr
        assert path.read_bytes() != content
        assert seal_of(path).read_text() == hashlib.sha256(path.read_bytes()).hexdigest()
        assert sorted(p.name for p in path.parent.iterdir()) == sorted([path.name, seal_of(path).name])

    @pytest.mark.parametrize(("part", "sealed"), [(0.0, False), (0.0, True), (0.3, False), (0.9, False)])
    def test_a_file_that_is_empty_or_cut(self, built, tiny, part, sealed):
        whole = built.read_bytes()
        content = whole[: int(part * len(whole))]
        self.damage(built, content, sealed=sealed)
        self.heals(tiny, built, content)

    @pytest.mark.parametrize("sealed", [False, True])
    def test_another_library(self, built, tiny, tmp_path, sealed):
        (tmp_path / "other.c").write_text("int other(void) { return 1; }\n")
        toolchain.compile_library(tmp_path, "other.c", tmp_path / "other.so")
        content = (tmp_path / "other.so").read_bytes()
        self.damage(built, content, sealed=sealed)
        self.heals(tiny, built, content)

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ("    integer done, last_row,", "    integer one_more, done, last_row,"),
            ("    integer position, count;", "    int position, count;"),
        ],
        ids=["a field more", "a narrower field"],
    )
    def test_other_structures(self, built, tiny, tmp_path, old, new):
        """Whole, sealed and loadable, but of other structures: it would write where it must not."""
        sources = tmp_path / "sources"
        sources.mkdir()
        for source in kernel_library.SOURCES:
            shutil.copy(source, sources)
        header = (sources / "structures.h").read_text()
        assert old in header
        (sources / "structures.h").write_text(header.replace(old, new))
        toolchain.compile_library(sources, "kernel.c", tmp_path / "other.so")
        content = (tmp_path / "other.so").read_bytes()
        self.damage(built, content, sealed=True)
        self.heals(tiny, built, content)

    @pytest.mark.parametrize("text", [None, "", "0" * 64], ids=["none", "empty", "other"])
    def test_a_missing_or_wrong_checksum(self, built, tiny, text):
        seal_of(built).unlink() if text is None else seal_of(built).write_text(text)
        self.heals(tiny, built, b"")

    def test_structures_of_this_process_that_no_source_has(self, built, system, monkeypatch, caplog):
        """Nothing to be healed: the run flies in Python and says why, or is refused."""
        right = list(structures.sizes_and_offsets())
        monkeypatch.setattr(kernel_library, "sizes_and_offsets", lambda: iter([*right[:-1], right[-1] + 8]))
        monkeypatch.setattr(kernel_library, "_loaded", {})
        monkeypatch.setattr("cosim.flight._told", set())
        with pytest.raises(BuildError, match="was compiled, but cannot be loaded"):
            kernel_library.library()
        result = flights.simulate(system, both.experiment(loop="auto"))
        assert result.info["loop"]["name"] == "python" and "cannot be loaded" in result.info["loop"]["reason"]
        assert "cannot be loaded" in caplog.text
        with pytest.raises(NotSupported, match=r'kernel="always": .* was compiled, but cannot be loaded'):
            flights.simulate(system, both.experiment(loop="always"))

    def test_many_processes_compile_at_once(self, tmp_path):
        environment = os.environ | {"ADCS_BUILD": str(tmp_path / "build")}
        code = "from cosim.masters.kernel.library import library; library()"
        processes = [subprocess.Popen([sys.executable, "-c", code], env=environment) for _ in range(6)]
        assert [process.wait(timeout=120) for process in processes] == [0] * 6


def test_sizes_and_offsets_are_those_of_the_header():
    """Field by field: a structure that is changed in one place only is not loaded."""
    found = kernel_library.library()
    assert kernel_library._layout(found) == list(structures.sizes_and_offsets())
    assert len(structures.STRUCTURES) == 17


class TestCounts:
    @pytest.mark.parametrize("steps", [2**62 + 1, 2**64, 10**30, 0, -1, 1.5, True])
    def test_steps_of_a_component(self, steps):
        with pytest.raises(
            WiringErrors, match=rf"steps of a is {steps}. It must be a whole number, 1 to {LARGEST_INTEGER}"
        ):
            run([Clock("a")], [], steps={"a": steps})

    def test_the_largest_period_flies(self, tiny):
        """A component that steps once, in both loops: nothing overflows."""
        system = both.of({"a": tiny, "b": tiny}, [("a.y", "b.u")], held={"a.u": 1.0}, steps={"a": LARGEST_INTEGER})
        result = both.fly(system, stop=1.0)
        assert result["a.y"].tolist() == [0.0] * 10 + [1.0]

    @pytest.mark.parametrize("every", [10**20, 2**62 + 1])
    def test_every(self, every):
        with pytest.raises(TimeError, match=rf"every is {every}: it must be a whole number of steps"):
            run([Clock("a")], [], every=every)

    @pytest.fixture
    def kernel(self, system):
        """A kernel over an initialized FMU, and the first point."""
        with flights.prepare(system) as prepared:
            plan = prepared._plan(both.experiment(loop="always"), None, ("*",))
            with prepared._crew() as crew:
                point = plan.initialization.start(crew, 0.0)
                course = plan.course
                watch = Watch(course.layout, course.schedule, Block(100, len(course.layout.columns.names)))
                yield Kernel(course.turns, crew, watch), point

    @pytest.mark.parametrize("field", ["every", "denominator", "step"])
    @pytest.mark.parametrize("value", [0, -1])
    def test_the_kernel_itself_refuses_counts_that_cannot_be(self, kernel, field, value):
        flying, point = kernel
        setattr(flying._packed.run, field, value)
        with pytest.raises(NotSupported, match=r'the kernel cannot count this run\. Choose kernel="never"'):
            flying.advance(point, 10)

    def test_it_refuses_a_period_and_an_end_that_cannot_be(self, kernel):
        flying, point = kernel
        with pytest.raises(NotSupported, match="cannot count"):
            flying.advance(point, 11)  # the run has ten steps
        components = (structures.ComponentStructure * 1).from_address(flying._packed.run.component)
        components[0].period = 0
        with pytest.raises(NotSupported, match="cannot count"):
            flying.advance(point, 10)
        components[0].period = 1
        assert flying.advance(point, 10).point.index == 10


def name_and_reason(loop):
    return {key: loop[key] for key in ("name", "reason")}


class TestWhichLoop:
    @pytest.fixture(autouse=True)
    def untold(self, monkeypatch):
        monkeypatch.setattr("cosim.flight._told", set())

    def loop(self, folder):
        return name_and_reason(json.loads((folder / "run.json").read_text())["loop"])

    def test_the_kernel(self, system, tmp_path, caplog):
        flights.simulate(system, both.experiment(loop="auto"), out=tmp_path / "out")
        assert self.loop(tmp_path / "out") == {"name": "kernel", "reason": ""}
        assert not caplog.records

    def test_python_because_it_was_asked_for(self, system, tmp_path, caplog):
        flights.simulate(system, both.experiment(loop="never"), out=tmp_path / "out")
        assert self.loop(tmp_path / "out") == {"name": "python", "reason": 'kernel="never"'}
        assert not caplog.records

    def test_python_because_a_slave_is_not_of_c_is_told_once(self, caplog):
        caplog.set_level(logging.INFO)
        for _ in range(2):
            result = run([Clock("clock"), Integrator("i")], [("clock.y", "i.u")], master=Explicit())
            told = name_and_reason(result.info["loop"])
            assert told == {"name": "python", "reason": "clock has no interface in C"}
        (told,) = [record for record in caplog.records if "loop" in record.getMessage()]
        assert told.getMessage() == "the loop runs in Python, not in the kernel, for clock has no interface in C"
        assert told.levelname == "WARNING"

    def test_the_kernel_only_is_refused_by_name(self):
        with pytest.raises(NotSupported, match=r'kernel="always": clock has no interface in C. Choose kernel="auto"'):
            run([Clock("clock")], [], master=Explicit(kernel="always"))

    def test_a_run_that_fails_says_it_too(self, tiny, tmp_path):
        from cosim.errors import StepFailed

        with pytest.raises(StepFailed):
            system = both.of({"a": tiny}, [], held={"a.u": 200.0})
            flights.simulate(system, both.experiment(loop="auto"), out=tmp_path / "out")
        assert self.loop(tmp_path / "out") == {"name": "kernel", "reason": ""}
        assert Result.read(tmp_path / "out").info["status"] == "failed"


@pytest.mark.skipif(not tiny_fmu.COMPILED, reason="the C compiler of this machine is not cc")
class TestStrictC:
    def test_no_warning(self, tmp_path):
        flags = "-std=c99 -O2 -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror -ffp-contract=off -fPIC -shared"
        command = ["cc", *flags.split(), "kernel.c", "-o", str(tmp_path / "kernel.so"), "-lm"]
        done = subprocess.run(command, cwd=KERNEL, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")

    def test_flights_under_sanitizers(self, tmp_path):
        """All types, rates, texts, refusals, failing steps in a kernel that checks every access and every overflow."""
        libraries = [_sanitizer("libasan.so"), _sanitizer("libubsan.so")]
        compiler = tmp_path / "cc"
        flags = "-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -g"
        compiler.write_text(f'#!/bin/sh\nexec cc "$@" {flags}\n')
        compiler.chmod(0o755)
        (tmp_path / "fly.py").write_text(SANITIZED)
        environment = os.environ | {
            "CC": str(compiler),
            "ADCS_BUILD": str(tmp_path / "build"),
            "LD_PRELOAD": " ".join(libraries),
            "ASAN_OPTIONS": "detect_leaks=0",
            "PYTHONPATH": str(ROOT),
        }
        command = [sys.executable, str(tmp_path / "fly.py"), str(tmp_path)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr[-4000:]
        assert done.stdout.split() == ["sanitized", "types", "rates", "texts", "refused", "failed", "stopped"]

    def test_the_sanitizers_are_awake(self, tmp_path):
        """The same way of compiling finds a write behind the end of an array."""
        (tmp_path / "wrong.c").write_text(
            "#include <stdlib.h>\nint main(void) { volatile int *p = malloc(8); p[2] = 1; return 0; }\n"
        )
        flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
        subprocess.run(["cc", *flags, "wrong.c", "-o", "wrong"], cwd=tmp_path, check=True)
        done = subprocess.run([tmp_path / "wrong"], capture_output=True, text=True, check=False)
        assert done.returncode != 0 and "heap-buffer-overflow" in done.stderr


def _sanitizer(name: str) -> str:
    found = subprocess.run(
        ["cc", f"-print-file-name={name}"], capture_output=True, text=True, check=True
    ).stdout.strip()
    if not os.path.isabs(found):
        pytest.skip(f"{name} is not installed")
    return found


SANITIZED = """
import sys
from pathlib import Path

from cosim import flights
from cosim.errors import StepFailed, ValueRefused
from cosim.masters.kernel.library import library
from tests.cosim import both, tiny_fmu
from tests.cosim.typed_fmu import NAMES, typed

folder = Path(sys.argv[1])
compiled = Path(library()._name).read_bytes()
assert b"__asan_report" in compiled and b"__ubsan_handle" in compiled
print("sanitized")
fmu, tiny = typed(folder), tiny_fmu.build(folder)
links = [(f"{a}.{o}", f"{b}.{o}_in", "ramp" if o == "r" else "after_step") for a, b in ("ab", "bc") for o in NAMES]
links += [(f"c.{state}", f"a.{direct}_in") for direct, state in NAMES.items()]
both.fly(both.of(dict.fromkeys("abc", fmu), links), stop=5.0, every=7)
print("types")
for steps in ({"a": 2}, {"b": 2, "c": 4}, {"a": 3, "c": 2}, {"a": 2**62}):
    both.fly(both.of(dict.fromkeys("abc", fmu), links, steps=steps), stop=5.0)
both.fly(both.of({"a": tiny, "b": tiny}, [("a.y", "b.u", "after_step")], held={"a.u": 1.0}), stop=5.0, inputs="ramp")
print("rates")
held = {"a.r_in": 0.0, "a.i_in": 1, "a.b_in": True, "a.e_in": 1, "a.s_in": "w"}
both.fly(both.of({"a": fmu}, [], held=held), stop=1.0, step=0.0005)
print("texts")
more = {"b.r_in": 0.0, "b.i_in": 1, "b.e_in": 1, "b.s_in": "w"}
refused = both.of({"a": fmu, "b": fmu}, [("a.count", "b.b_in")], held=held | more, parameters={"a.count0": -3})
both.failure(ValueRefused, refused)
refused = both.of({"a": fmu, "b": fmu}, [("a.count", "b.b_in")], held=held | more, parameters={"a.count0": 0})
both.failure(ValueRefused, refused)
print("refused")
both.failure(StepFailed, both.of({"a": tiny}, [], held={"a.u": 200.0}))
both.failure(StepFailed, both.of({"a": tiny, "b": tiny}, [("a.y", "b.u")], held={"a.u": 60.0}), stop=5.0)
print("failed")
assert both.fly(both.of({"a": fmu}, [], held=held), stop=1.0, stop_when="a.count").time[-1] == 0.0
print("stopped")
"""
