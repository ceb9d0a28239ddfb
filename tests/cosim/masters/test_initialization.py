"""Exact initialization: chains, undeclared dependencies, algebraic loops, refusals."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import simulate
from cosim.errors import AlgebraicLoop, CallFailed, InitializationFailed
from cosim.system import Connection, Experiment, System
from cosim.system.expand import wire
from cosim.system.graph import algebraic_loops

from .. import both
from ..c_fmu import build, real
from ..fakes import Fake, Gain, Integrator, describe
from ..flights import run


def start(slaves, connections, *, held=None, parameters=None):
    """The row at the start."""
    system = System(
        name="test",
        components=dict.fromkeys((s.name for s in slaves), "fake"),
        connections=[Connection(*c) for c in connections],
        held=held or {},
        parameters=parameters or {},
    )
    result = simulate(
        system, Experiment(stop_time=0.1, communication_step_size=0.1), slaves={s.name: s for s in slaves}
    )
    return {name: result[name][0] for name in result.names}


@pytest.mark.parametrize("said", [True, False])
def test_chain_against_the_order_of_declaration(said):
    gains = [Gain(f"g{i}", k=float(i), said=said) for i in (4, 3, 2)]
    row = start(
        [*gains, Integrator("i", x0=1.5)],
        [("i.y", "g2.u"), ("g2.y", "g3.u"), ("g3.y", "g4.u"), ("g4.y", "i.u")],
    )
    assert row["g4.y"] == 1.5 * 2 * 3 * 4
    assert row["i.u"] == 36.0


def test_chain_within_one_component():
    """y1 follows u1, y2 follows u2, and u2 is y1 through a gain: no loop, variable by variable."""

    class Two(Fake):
        def evaluate(self, v):
            v["y1"], v["y2"] = 2 * v["u1"], 3 * v["u2"]

    two = Two("two", describe(inputs=["u1", "u2"], outputs=["y2", "y1"], feedthrough={"y1": ("u1",), "y2": ("u2",)}))
    row = start([two, Gain("g", k=10.0)], [("two.y1", "g.u"), ("g.y", "two.u2")], held={"two.u1": 1.0})
    assert row["two.y2"] == 60.0


def test_undeclared_loop_that_is_none_settles_exactly():
    """Two pairs of decoupled channels without `dependencies`: it looks like a loop, and is none."""

    class Cross(Fake):
        def __init__(self, name, k):
            super().__init__(
                name, describe(inputs=["u1", "u2"], outputs=["y1", "y2"], feedthrough={"y1": None, "y2": None})
            )
            self.k = k

        def evaluate(self, v):
            v["y1"], v["y2"] = self.k * v["u2"] + 1 / 3, v["u1"] / 3

    row = start([Cross("a", 0.1), Gain("b", k=0.7, said=False)], [("a.y1", "b.u"), ("b.y", "a.u1")], held={"a.u2": 1.0})
    y1 = 0.1 * 1.0 + 1 / 3
    assert row["a.y2"] == (0.7 * y1 + 0.0) / 3


@pytest.mark.parametrize("derivatives", [True, False])
def test_linear_loop_is_solved(derivatives):
    """y_a = 3 y_b + 1, y_b = -2 y_a + 0.5: neither direction converges by sweeping."""
    row = start(
        [Gain("a", k=3.0, b=1.0, provides_directional_derivative=derivatives), Gain("b", k=-2.0, b=0.5)],
        [("b.y", "a.u"), ("a.y", "b.u")],
    )
    assert_allclose(row["a.y"], 2.5 / 7, rtol=1e-14 if derivatives else 1e-9)
    assert_allclose(row["b.y"], -1.5 / 7, rtol=1e-14 if derivatives else 1e-9)


def test_nonlinear_loop_with_what_hangs_on_it():
    class Cosine(Gain):
        def evaluate(self, v):
            v["y"] = math.cos(v["u"])

        def directional_derivative(self, unknowns, knowns, seed):
            return np.array([-math.sin(self.values["u"]) * seed[0]])

    row = start([Gain("after", k=2.0), Cosine("c"), Gain("g")], [("g.y", "c.u"), ("c.y", "g.u"), ("c.y", "after.u")])
    assert_allclose(row["c.y"], 0.7390851332151607, rtol=1e-13)
    assert row["after.y"] == 2 * row["c.y"]


def test_loop_without_solution_is_refused_variable_by_variable():
    with pytest.raises(AlgebraicLoop) as caught:
        start([Gain("a", k=1.0, b=1.0), Gain("b")], [("b.y", "a.u"), ("a.y", "b.u")])
    assert "a.y <- a.u (direct feedthrough) <- b.y <- b.u (direct feedthrough) <- a.y" in str(caught.value)
    assert "Give one of these outputs a state" in str(caught.value)


def test_loops_for_show():
    slaves = [Gain("a"), Gain("b"), Integrator("i")]
    system = System(
        name="s",
        components=dict.fromkeys("abi", ""),
        connections=[Connection("b.y", "a.u"), Connection("a.y", "b.u"), Connection("a.y", "i.u")],
    )
    wiring = wire(system, {s.name: s.description for s in slaves})
    (loop,) = algebraic_loops(wiring)
    assert loop[0] == loop[-1]
    assert set(loop) == {"a.y", "b.y", "a.u (direct feedthrough)", "b.u (direct feedthrough)"}


def test_values_that_never_settle_are_refused():
    """An FMU whose output changes with every look."""

    class Restless(Fake):
        def evaluate(self, v):
            v["y"] += 1.0

    with pytest.raises(AlgebraicLoop, match=r"r.y: these values never settle"):
        start([Restless("r", describe(outputs=["y"]))], [])


def test_parameters_and_start_values_before_initialization_held_inputs_in_it():
    integrator = Integrator("i")
    row = start([integrator], [], held={"i.u": 2.0}, parameters={"i.y": 5.0})
    assert row == {"i.u": 2.0, "i.y": 5.0}
    calls = [call if call[0] == "set" else call[0] for call in integrator.calls[:6]]
    parameter, held = ("set", {"y": 5.0}), ("set", {"u": 2.0})
    assert calls == ["instantiate", "setup", parameter, "enter", held, "exit"]


def test_output_that_is_not_finite_at_the_start():
    class Log(Gain):
        def evaluate(self, v):
            v["y"] = math.inf if v["u"] == 0 else math.log(abs(v["u"]))

    with pytest.raises(InitializationFailed, match="g cannot be initialized: y is inf at the start"):
        start([Log("g")], [], held={"g.u": 0.0})


def test_refusal_carries_component_and_words():
    class Strict(Integrator):
        def exit_initialization_mode(self):
            raise CallFailed(self.name, "fmi2ExitInitializationMode", "fmi2Error", ("J is not symmetric",))

    with pytest.raises(InitializationFailed) as caught:
        start([Strict("plant")], [], held={"plant.u": 0.0})
    assert (caught.value.component, caught.value.messages) == ("plant", ("J is not symmetric",))
    assert str(caught.value) == (
        "plant cannot be initialized: fmi2ExitInitializationMode returned fmi2Error\n    J is not symmetric"
    )


@pytest.mark.parametrize("speaks", [True, False])
def test_a_number_that_is_none_is_laid_to_the_component_that_made_it(speaks):
    """Its neighbour refuses the number before the FMU comes to say why: at the end of initialization mode."""

    class Nowhere(Gain):
        def evaluate(self, v):
            v["y"] = math.nan

        def exit_initialization_mode(self):
            if speaks:
                raise CallFailed(self.name, "fmi2ExitInitializationMode", "fmi2Error", ("k = 0: it must be positive.",))

    class Strict(Gain):
        def set_real(self, references, values):
            if not np.isfinite(values).all():
                raise CallFailed(self.name, "fmi2SetReal", "fmi2Error", ("variable u = nan is not finite.",))
            super().set_real(references, values)

    with pytest.raises(InitializationFailed) as caught:
        start([Nowhere("law"), Strict("wheels")], [("law.y", "wheels.u")], held={"law.u": 0.0})
    assert str(caught.value) == (
        "law cannot be initialized: fmi2ExitInitializationMode returned fmi2Error\n    k = 0: it must be positive."
        if speaks
        else "law cannot be initialized: y is nan at the start"
    )


def test_unit_conversion_in_initialization():
    def gain(name, unit):
        g = Gain(name)
        g.description = describe(
            inputs=["u"],
            outputs=["y"],
            parameters={"k": 1.0, "b": 0.0},
            feedthrough={"y": ("u",)},
            units={"u": unit, "y": unit},
        )
        return g

    row = start([gain("a", "N.m"), gain("b", "mN.m")], [("b.y", "a.u")], held={"b.u": 250.0})
    assert_array_equal([row["a.u"], row["a.y"]], [0.25, 0.25])


class TestLastInputsOfInitialization:
    """What inputs are when initialization mode ends counts: an FMU may freeze what follows from them."""

    class Freezing(Fake):
        """y is what u was at the exit of initialization mode; `now` follows u."""

        def __init__(self, name):
            super().__init__(name, describe(inputs=["u"], outputs=["y", "now"], feedthrough={"now": ("u",)}))
            self.frozen = math.nan
            self.seen = []

        def set_real(self, references, values):
            super().set_real(references, values)
            self.seen.append(self.values["u"])

        def evaluate(self, v):
            v["now"] = v["u"]
            v["y"] = self.frozen if not math.isnan(self.frozen) else 0.0

        def exit_initialization_mode(self):
            super().exit_initialization_mode()
            self.frozen = self.values["u"]

    class Refined(Fake):
        """An FMU that says that y follows nothing in initialization, though it follows u."""

        def __init__(self, name):
            super().__init__(name, describe(inputs=["u"], outputs=["y"], feedthrough={"y": ()}))

        def evaluate(self, v):
            v["y"] = 2.0 * v["u"] + 1.0

    @pytest.mark.parametrize("declared", [("frozen", "wrong", "gain"), ("gain", "wrong", "frozen")])
    def test_the_final_values_are_seen(self, declared):
        """gain = 4, so that wrong = 2 * 4 + 1, whatever order its wrong description gives."""
        slaves = {"frozen": self.Freezing("frozen"), "wrong": self.Refined("wrong"), "gain": Gain("gain", b=4.0, k=0.0)}
        links = [("wrong.y", "frozen.u"), ("gain.y", "wrong.u")]
        result = run([slaves[name] for name in declared], links, held={"gain.u": 0.0}, stop=0.1)
        assert slaves["frozen"].frozen == 9.0
        assert result["frozen.y"][0] == 9.0

    def test_an_fmu_without_outputs_is_set_all_the_same(self):
        """No output of it is evaluated, so that nobody but the last round sets its inputs."""

        class Sink(self.Freezing):
            def __init__(self, name):
                super().__init__(name)
                self.description = describe(inputs=["u"])

        sink = Sink("sink")
        run([sink, Gain("gain", b=4.0, k=0.0)], [("gain.y", "sink.u")], held={"gain.u": 0.0}, stop=0.1)
        assert sink.frozen == 4.0

    def test_the_solution_of_a_loop_is_what_counts(self):
        """After Newton the components of the loop still have the inputs of its last trial."""
        bent = {}

        class Bent(Gain):
            def evaluate(self, v):
                v["y"] = math.cos(v["u"])

            def directional_derivative(self, unknowns, knowns, seed):
                return np.array([-math.sin(self.values["u"]) * seed[0]])

            def exit_initialization_mode(self):
                bent[self.name] = self.values["u"]
                super().exit_initialization_mode()

        result = run([Bent("a"), Gain("b")], [("a.y", "b.u"), ("b.y", "a.u")], stop=0.1)
        assert_allclose(bent["a"], 0.7390851332151607, rtol=1e-13)
        assert bent["a"] == result["a.u"][0] == result["b.y"][0]

    def test_fmus(self, tmp_path):
        variables = [real("u", "input"), real("y")]
        code = "if (m->whole[0]) y = m->state[0];"
        path = build(tmp_path, "Freezing", variables, outputs=code, initialized="m->state[0] = u; m->whole[0] = 1;")
        gain = build(tmp_path, "Gain", [real("u", "input"), real("y", depends="u")], outputs="y = 3 * u;")
        system = both.of({"f": path, "b": gain, "a": gain}, [("b.y", "f.u"), ("a.y", "b.u")], held={"a.u": 2.0})
        assert both.fly(system)["f.y"].tolist() == [18.0] * 11
