"""FMI 3.0 FMUs in the kernel: the bits, the failures and the words of the Python loop."""

import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import At, Connection, Experiment, Explicit, Iterated, System, prepare, simulate
from cosim.errors import NotSupported, StepFailed

from .. import arrays_fmu, c_fmu, tiny_fmu

pytestmark = pytest.mark.skipif(not tiny_fmu.COMPILED, reason="this FMU is compiled for Linux")

STEPS = Experiment(stop_time=2.0, communication_step_size=0.25, master=Explicit(kernel="always"))
LOOPS = ("always", "never")
S = '<String name="s" valueReference="13" causality="output"{}'
CARRIED = ("Int8", "UInt8", "Int16", "UInt16", "Int32")


def narrowed(text):
    """The description without what the kernel does not carry: whole numbers of more than 32 bits."""
    for kind in ("UInt32", "Int64", "UInt64"):
        text = re.sub(rf'<{kind} name="(?:{kind}_in|{kind}_out|count)"[^>]*/>\n?', "", text)
        place = 20 + 2 * arrays_fmu.WHOLE.index(kind)
        text = text.replace(f'<Output valueReference="{place + 1}" dependencies="{place} 15"/>', "")
    return text.replace('<Output valueReference="16" dependencies=""/>', "")


def _without_feedthrough(text):
    of_y, none = '<Output valueReference="3" dependencies="1"/>', '<Output valueReference="3" dependencies=""/>'
    text = text.replace('<Output valueReference="7"/>', '<Output valueReference="7" dependencies="6"/>')
    return narrowed(text.replace(of_y, none))


def made(folder, step="", **more):
    return str(arrays_fmu.build(folder, step, narrowed, **more))


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return made(tmp_path_factory.mktemp("fmu"))


def loop(fmu, **more):
    """Two of them in a loop, every type connected; x' = u, so that the loop oscillates and grows."""
    kinds = [Connection(f"a.{kind}_out", f"b.{kind}_in") for kind in CARRIED]
    ends = {"a.x": "b.u", "a.f": "b.f_in", "a.b": "b.b_in", "a.e": "b.e_in", "a.s": "b.s_in"}
    crossed = {"b.x[3]": "a.u[1]", "b.y[1]": "a.u[2]"}  # elements of an array, the third is held
    joined = [Connection(*pair) for pair in (ends | crossed).items()]
    held = {"a.u[3]": 0.25, "a.f_in": 0.1, "a.b_in": [True, False], "a.e_in": 4, "a.s_in": "hello", "a.Int8_in": -7}
    return System(
        name="loop",
        components={"a": fmu, "b": fmu},
        connections=[*joined, *kinds],
        parameters={"a.x0": [0.1, -0.2, 0.3], "b.x0": [1.0, 0.0, 0.7], "b.G": [[0.5, 1, -1], [0, 0, 2]]},
        hold_unconnected=True,
        **{"held": held, **more},
    )


def both(system, experiment=STEPS):
    masters = [replace(experiment.master, kernel=kernel) for kernel in LOOPS]
    found = [simulate(system, replace(experiment, master=master)) for master in masters]
    assert [result.info["loop"]["name"] for result in found] == ["kernel", "python"]
    return found


def failures(system, experiment=STEPS):
    said = []
    for kernel in LOOPS:
        with pytest.raises(StepFailed) as caught:
            simulate(system, replace(experiment, master=Explicit(kernel=kernel)))
        failure = caught.value
        rows = failure.result.table.num_rows
        assert failure.result.info["loop"]["name"] == ("kernel" if kernel == "always" else "python")
        said.append((str(failure), failure.status, failure.last_successful_time, failure.terminated, rows))
    assert said[0] == said[1]
    return said[0]


class TestTheSameBits:
    @pytest.mark.parametrize("inputs", ["declared", "held", "ramp", "smooth"])
    def test_every_type(self, fmu, inputs):
        kernel, python = both(loop(fmu), replace(STEPS, master=Explicit(inputs=inputs)))
        assert kernel.table.equals(python.table, check_metadata=False) and len(kernel) == 9
        assert kernel["b.s"][-1] == "<<hello" and kernel["b.Int8_in"][-1] == -6
        assert len(np.unique(kernel["b.x"][:, 1])) == 9

    def test_against_a_closed_form(self, fmu):
        """x' = u by steps of h: with u held, x(2) = x0 + 2 u, exact in doubles for these numbers."""
        system = System(name="s", components={"a": fmu}, held={"a.u": [1.0, 2.0, -3.5]}, hold_unconnected=True)
        kernel, _ = both(system)
        assert_array_equal(kernel["a.x"][-1], [5 + 2.0, 4.0, -7.0])
        assert_array_equal(kernel["a.y"][-1], [1.0, 2.0])

    def test_float32_is_rounded_once(self, fmu):
        kernel, _ = both(loop(fmu))
        assert kernel["b.f_in"][-1] == 2 * float(np.float32(0.1)) and kernel["b.f"][-1] == 4 * float(np.float32(0.1))

    def test_events_set_arrays_between_two_runs_of_the_kernel(self, fmu):
        """Elements that the kernel has set last stay as they are when Python sets others, and the other way round."""
        events = [At(0.5, {"b.G[1,2]": -1.0}), At(0.6, {"a.G": [[1, 2, 3], [4, 5, 6]]})]
        kernel, python = both(loop(fmu), replace(STEPS, events=events))
        assert kernel.table.equals(python.table, check_metadata=False)
        assert not kernel.table.equals(both(loop(fmu))[0].table, check_metadata=False)

    def test_several_rates(self, fmu):
        kernel, python = both(loop(fmu, steps={"b": 4}))
        assert kernel.table.equals(python.table, check_metadata=False)

    def test_repeated_steps(self, tmp_path):
        """Iterated saves and restores states; y is said to follow nothing, else its inputs could not be means."""
        fmu = str(arrays_fmu.build(tmp_path, "", _without_feedthrough))
        system = loop(fmu)
        ends = [c for c in system.connections if c.source not in ("b.y[1]", "a.f")]
        system = replace(system, connections=ends, held=system.held | {"a.u[2]": 0.5})
        found = [
            simulate(system, replace(STEPS, master=Iterated(kernel=kernel), communication_step_size=0.125))
            for kernel in ("auto", "never")
        ]
        assert [result.info["loop"]["name"] for result in found] == ["kernel", "python"]
        assert found[0].table.equals(found[1].table, check_metadata=False)

    def test_again_and_again_with_resets(self, fmu):
        with prepare(loop(fmu)) as prepared:
            rows = [prepared.fly(STEPS).table for _ in range(3)]
            other = prepared.fly(replace(STEPS, master=Explicit(kernel="never"))).table
            rows.append(prepared.fly(STEPS).table)
        assert all(table.equals(other, check_metadata=False) for table in rows)

    def test_with_an_fmu_of_fmi_2(self, fmu, tmp_path):
        """Both versions in one loop: y' = u of FMI 2.0, fed by y[1] of FMI 3.0 and back."""
        from ..c_fmu import real

        variables = [real("u", "input"), real("y")]
        two = c_fmu.build(tmp_path, "Two", variables, outputs="y = m->state[0];", step="m->state[0] += h * u;")
        system = System(
            name="s",
            components={"three": fmu, "two": str(two)},
            connections=[Connection("three.x[1]", "two.u"), Connection("two.y", "three.u[1]")],
            hold_unconnected=True,
        )
        kernel, python = both(system)
        assert kernel.table.equals(python.table, check_metadata=False)
        x, y = 5.0, 0.0
        for _ in range(8):  # x' = y, y' = x by Euler's rule
            x, y = x + 0.25 * y, y + 0.25 * x
        assert_allclose([kernel["three.x"][-1][0], kernel["two.y"][-1]], [x, y], rtol=1e-14)


class TestTheSameEnds:
    @pytest.mark.parametrize(
        ("code", "said"),
        [
            ("if (t >= 1.0) return fmi3Error;", "fmi3Error at communication point 1 s"),
            ("if (t >= 1.0) return fmi3Discard;", "fmi3Discard at communication point 1 s"),
            ("if (t >= 1.0) return fmi3Fatal;", "fmi3Fatal at communication point 1 s"),
            ("if (t >= 1.0) { *early = true; *last = t + h / 2; }", "fmi3OK, but early, which was not allowed"),
            ("if (t >= 1.0) *early = true;", "fmi3OK, but early, which was not allowed"),
        ],
    )
    def test_steps_that_fail(self, tmp_path, code, said):
        fmu = made(tmp_path, code)
        text, *_, rows = failures(System(name="s", components={"a": fmu}, hold_unconnected=True))
        assert said in text and rows == 5

    @pytest.mark.parametrize("code", ["*end = t >= 1.0;", "if (t >= 1.0) { *end = true; *last = t + h / 2; }"])
    def test_the_end_of_a_run(self, tmp_path, code):
        """Asked for at the end of a step, which counts, or within one."""
        system = System(name="s", components={"a": made(tmp_path, code)}, hold_unconnected=True)
        found = both(system)
        assert found[0].table.equals(found[1].table, check_metadata=False)
        told = [{k: result.info[k] for k in ("status", "reached_time", "event")} for result in found]
        assert told[0] == told[1] and told[0]["event"]["variable"] == "a"
        assert len(found[0]) == (6 if "t + h / 2" not in code else 5)

    def test_a_value_that_a_type_cannot_hold(self, fmu):
        system = System(
            name="s",
            components={"a": fmu, "b": fmu},
            connections=[Connection("a.UInt16_out", "b.Int8_in")],
            held={"a.UInt16_in": 300},
            hold_unconnected=True,
        )
        said = []
        for kernel in LOOPS:
            with pytest.raises(Exception, match="Int8_in is Int8, which cannot be 301") as caught:
                simulate(system, replace(STEPS, master=Explicit(kernel=kernel)))
            said.append(str(caught.value))
        assert said[0] == said[1]

    def test_a_value_that_a_type_cannot_hold_later(self, tmp_path):
        """In flight, where the kernel sets it: UInt16_out grows by a hundred in each step."""
        fmu = made(tmp_path, "m->in_UInt16 = (fmi3UInt16)(m->in_UInt16 + 100);")
        system = System(
            name="s",
            components={"a": fmu, "b": made(_sub(tmp_path))},
            connections=[Connection("a.UInt16_out", "b.UInt8_in", "after_step")],
            hold_unconnected=True,
        )
        text, status, *_ = failures(system)
        assert "UInt8_in is UInt8, which cannot be 301" in text and status == "no call from fmi3SetUInt8"

    def test_warnings_are_counted(self, tmp_path):
        fmu = made(tmp_path, "if (t >= 1.0) return fmi3Warning;")
        kernel, python = both(System(name="s", components={"a": fmu}, hold_unconnected=True))
        assert kernel.table.equals(python.table, check_metadata=False)
        warned = [result.info["fmi2Warning"]["a"] for result in (kernel, python)]
        assert warned[0] == warned[1] == {"fmi3DoStep": {"count": 4, "first": 1.0}}

    def test_a_crash_is_told_by_the_name_of_the_function(self, tmp_path):
        """On standard error, of a process of its own."""
        fmu = made(tmp_path, "if (t >= 1.0) { volatile int *nowhere = 0; *nowhere = 1; }")
        code = f"""
from cosim import Experiment, Explicit, System, simulate
system = System(name="s", components={{"a": {fmu!r}}}, hold_unconnected=True)
simulate(system, Experiment(stop_time=2.0, communication_step_size=0.25, master=Explicit(kernel="always")))
"""
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode < 0
        assert "a ended the process in fmi3DoStep at communication point 1 s: SIGSEGV" in done.stderr


class TestWhatIsLeftToPython:
    def test_whole_numbers_of_64_bits(self, tmp_path):
        fmu = str(arrays_fmu.build(tmp_path))
        system = System(name="s", components={"a": fmu}, hold_unconnected=True)
        result = simulate(system, replace(STEPS, master=Explicit()))
        assert (result.info["loop"]["name"], result.info["loop"]["reason"]) == ("python", "a has no interface in C")
        with pytest.raises(NotSupported, match="a has no interface in C"):
            simulate(system, STEPS)

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ('name="Int32_out"', 'name="Int32_out"', ""),
            (S.format("/>"), S.format('><Dimension start="2"/></String>'), "s[1] is of an array of Strings"),
            (
                'value="4"/></EnumerationType>',
                'value="3000000000"/></EnumerationType>',
                "e_in has items beyond 32 bits",
            ),
        ],
    )
    def test_why(self, tmp_path, old, new, said):
        from cosim.slaves.fmi3_kernel import obstacle
        from fmus.description.read import read_description

        path = arrays_fmu.build(tmp_path, "", lambda text: narrowed(text).replace(old, new))
        assert obstacle(read_description(path)) == said


def _sub(folder):
    inner = folder / "other"
    inner.mkdir()
    return inner
