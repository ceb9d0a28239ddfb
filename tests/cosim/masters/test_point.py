"""A run that is saved in the middle and taken up by new instances flies on to the same bits."""

from dataclasses import replace

import numpy as np
import pytest

from cosim import Library
from cosim.errors import NotSupported
from cosim.flights import find
from cosim.masters.explicit import Explicit
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.point import Point
from cosim.masters.run import run
from cosim.masters.types import Texts
from cosim.masters.watch import Block, Watch
from cosim.slaves.fmi2 import FmuSlave
from cosim.studies.papers import scenario
from cosim.system.expand import wire
from cosim.time import Schedule

from .. import both
from ..fakes import Clock
from ..typed_fmu import NAMES, typed


class Voyage:
    """A system with its course, and flights of it from any point to any other."""

    def __init__(self, system, master, stop, step, locate=None):
        paths = {name: find(r, locate) for name, r in system.components.items()}
        self.kernel = master.kernel
        self.make = lambda: {name: FmuSlave(name, path) for name, path in paths.items()}
        crew = self.make()
        wiring = master.timed(wire(system, {name: slave.description for name, slave in crew.items()}))
        self.course = master.course(wiring, Schedule.of(0, stop, step, 1), ("*",))
        self.initialization = Initialization.of(wiring, self.course.layout)

    def started(self):
        """New instances, and the first point."""
        crew = self.make()
        return crew, self.initialization.start(crew, 0.0)

    def on(self, crew, point, until):
        """Fly on until a communication point; return it, and the rows on the way."""
        algorithm, watch = self.loop(crew)
        watch.row(point)
        while point.index < until:
            point = algorithm.advance(point, until if algorithm.records else point.index + 1).point
            if not algorithm.records:
                watch.row(point)
        return point, watch.block.data[: watch.block.count].copy()

    def end(self, crew, point):
        """Fly to the end with the loop of every run; return the last point, and the rows."""
        algorithm, watch = self.loop(crew)
        *_, last = run(algorithm, self.course.control(), point, watch)
        return last, watch.block.data[: watch.block.count].copy()

    def loop(self, crew):
        watch = Watch(self.course.layout, self.course.schedule, Block(1000, len(self.course.layout.columns.names)))
        algorithm, flown = self.course.algorithm(crew, watch)
        assert flown.name == {"always": "kernel", "never": "python"}[self.kernel]
        return algorithm, watch


def same(a: Point, b: Point) -> bool:
    arrays = ("values", "newest", "begun")
    return a.index == b.index and all(getattr(a, n).tobytes() == getattr(b, n).tobytes() for n in arrays)


def resumed(voyage, middle, other=None):
    """The rows of a straight flight, and of one that was saved, sent and taken up by others in the middle.

    `other`: what takes it up, the same voyage or one in the other loop.
    """
    other = other or voyage
    crew, point = voyage.started()
    last, straight = voyage.end(crew, point)

    crew, point = voyage.started()
    point, before = voyage.on(crew, point, middle)
    sent = point.with_states(crew).to_bytes()
    for slave in crew.values():
        slave.free()

    point = Point.from_bytes(sent)
    others, _ = other.started()
    point.restore(others)
    end, after = other.end(others, point)
    if other is voyage:
        assert same(end, last)
        assert end.texts.all() == last.texts.all()
    return straight, np.vstack([before, after[1:]])


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return typed(tmp_path_factory.mktemp("typed"))


def loop_of_all_types(fmu, timing="after_step", real_timing="ramp", steps=None):
    links = [
        (f"{a}.{out}", f"{b}.{out}_in", real_timing if out == "r" else timing) for a, b in ("ab", "bc") for out in NAMES
    ]
    back = [(f"c.{state}", f"a.{direct}_in", "at_point") for direct, state in NAMES.items()]
    return both.of(dict.fromkeys("abc", fmu), links + back, steps=steps or {})


@pytest.mark.parametrize("kernel", both.LOOPS)
class TestResumed:
    @pytest.mark.parametrize("middle", [5, 6, 7, 8])
    @pytest.mark.parametrize(
        "steps", [{}, {"a": 2}, {"a": 4, "b": 2}, {"b": 2, "c": 4}, {"a": 2, "b": 4, "c": 4}], ids=str
    )
    def test_all_types_and_rates(self, fmu, kernel, steps, middle):
        """a is ahead of the point where it is slow; b and c wait to step at the end of their period."""
        voyage = Voyage(loop_of_all_types(fmu, steps=steps), Explicit(kernel=kernel), 1.3, 0.1)
        straight, parts = resumed(voyage, middle)
        assert straight.tobytes() == parts.tobytes()

    def test_the_other_loop_takes_it_up(self, fmu, kernel):
        system = loop_of_all_types(fmu, steps={"a": 2, "b": 4, "c": 4})
        python = {"always": "never", "never": "always"}[kernel]
        voyage, other = (Voyage(system, Explicit(kernel=k), 1.3, 0.1) for k in (kernel, python))
        for middle in (5, 6, 7, 8):
            straight, parts = resumed(voyage, middle, other)
            assert straight.tobytes() == parts.tobytes()

    @pytest.mark.parametrize("steps", [{}, {"actuators": 4, "plant": 2}], ids=str)
    def test_a_paper_s_system_of_native_fmus(self, kernel, steps):
        """Curves; at several rates the wheels are ahead, and the body waits for its environment: held measurements."""
        system, experiment = scenario("xiao2011-l2gain")
        master = replace(experiment.master, kernel=kernel, inputs="declared" if steps else "smooth")
        voyage = Voyage(replace(system, steps=steps), master, 0.2, 0.001, Library("native"))
        straight, parts = resumed(voyage, 101)
        assert len(straight) == 201
        assert straight.tobytes() == parts.tobytes()

    def test_the_state_that_was_saved_is_what_counts(self, fmu, kernel):
        """Without the states of the FMUs, new instances fly on from their own start, and end elsewhere."""
        voyage = Voyage(loop_of_all_types(fmu), Explicit(kernel=kernel), 1.0, 0.1)
        crew, point = voyage.started()
        point, _ = voyage.on(crew, point, 5)
        end, _ = voyage.end(crew, point.copy())
        others, _ = voyage.started()
        other, _ = voyage.end(others, Point.from_bytes(point.to_bytes()))
        assert not same(end, other)

    def test_the_same_instances_can_go_back(self, fmu, kernel):
        voyage = Voyage(loop_of_all_types(fmu, steps={"a": 2}), Explicit(kernel=kernel), 1.0, 0.1)
        crew, point = voyage.started()
        point, _ = voyage.on(crew, point, 5)
        saved = point.with_states(crew).copy()
        end, rows = voyage.end(crew, point)
        saved.restore(crew)
        again, same_rows = voyage.end(crew, saved)
        assert same(end, again) and rows.tobytes() == same_rows.tobytes()


class TestPoint:
    @pytest.fixture
    def point(self, fmu):
        voyage = Voyage(loop_of_all_types(fmu), Explicit(kernel="never"), 1.0, 0.1)
        crew, point = voyage.started()
        return voyage.on(crew, point, 3)[0].with_states(crew)

    def test_bytes_bring_back_everything(self, point):
        other = Point.from_bytes(point.to_bytes())
        assert same(point, other)
        assert other.texts.all() == point.texts.all() and any("µ".encode() in t for t in other.texts.all())
        assert dict(other.states) == dict(point.states)
        assert list(other.states) == ["a", "b", "c"] and all(len(state) > 1000 for state in other.states.values())

    def test_a_point_without_states_and_texts_too(self):
        empty = Point(4, np.array([0.1, np.inf]), np.array([0.2, -0.0]), np.zeros(0), Texts())
        assert same(empty, Point.from_bytes(empty.to_bytes()))

    def test_a_copy_shares_nothing(self, point):
        before = Point.from_bytes(point.to_bytes())
        copy = point.copy()
        assert same(copy, point)
        copy.values[:], copy.newest[:], copy.begun[:] = -1.0, -2.0, -3.0
        number = copy.texts.number(b"a new text")
        copy.states["a"] = b"another"
        assert same(point, before)
        assert point.texts.all() == before.texts.all() and len(point.texts) == number
        assert point.states["a"] == before.states["a"]

    def test_a_step_leaves_the_point_as_it_was(self, fmu):
        voyage = Voyage(loop_of_all_types(fmu, steps={"a": 2, "c": 2}), Explicit(kernel="never"), 1.0, 0.1)
        crew, point = voyage.started()
        before = point.copy()
        after, _ = voyage.on(crew, point, 1)
        assert same(point, before) and not same(point, after)

    def test_parts_join_with_what_they_remember(self, point):
        """Floats to the bit, whole numbers of any size, as the state of a generator of noise is."""

        class Remembering:
            def __init__(self, kept=None):
                self.kept = kept

            def memory(self):
                return self.kept

            def recall(self, memory):
                self.kept = memory

        state = np.random.default_rng(7).bit_generator.state
        kept = {"line": [0.1, -0.0, float("nan"), 1e-310], "noise": state, "next": 3, "stuck": None, "text": "µ"}
        sent = point.with_parts({"faults": Remembering(kept), "control": Remembering()}).to_bytes()
        other = Remembering()
        Point.from_bytes(sent).recall({"faults": other})
        assert np.array(other.kept["line"]).tobytes() == np.array(kept["line"]).tobytes()
        assert {k: v for k, v in other.kept.items() if k != "line"} == {k: v for k, v in kept.items() if k != "line"}
        with pytest.raises(KeyError, match="unknown"):
            point.recall({"unknown": other})

    @pytest.mark.parametrize("lacking", ["canSerializeFMUstate", "canGetAndSetFMUstate"])
    def test_an_fmu_that_cannot_serialize_is_refused_by_name(self, tmp_path, point, fmu, lacking):
        path = typed(tmp_path, **{lacking: False})
        crew = {"a": FmuSlave("a", fmu), "sealed": FmuSlave("sealed", path)}
        crew["a"].instantiate()
        with pytest.raises(NotSupported, match=r"^sealed cannot serialize its FMU state\. Its modelDesc"):
            point.with_states(crew)

    def test_a_fake_cannot_either(self, point):
        with pytest.raises(NotSupported, match=r"^clock cannot serialize"):
            point.with_states({"clock": Clock("clock")})
