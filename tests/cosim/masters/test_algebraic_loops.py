"""Algebraic loops at communication points: solved, refused or delayed, in the explicit and the iterated master."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cosim import simulate
from cosim.errors import AlgebraicLoop, CallFailed, NotSupported, StepFailed, WiringErrors
from cosim.masters.algebraic_loop import TOLERANCE, solve_linear
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.system import Experiment
from cosim.system.graph import algebraic_loops, refresh_order, unsolved_loops

from .. import both
from ..c_fmu import boolean, build, real
from ..fakes import Clock, Fake, Gain, Integrator, describe
from ..flights import run
from ..wired import wired

RING = [("a.y", "b.u"), ("b.y", "a.u", "at_point")]
EPS = np.finfo(float).eps


class Sum(Fake):
    """y = k u + w, direct feedthrough of both."""

    def __init__(self, name, k, law=None, rate=None, **capabilities):
        capabilities = {"provides_directional_derivative": True} | capabilities
        super().__init__(
            name, describe(inputs=["u", "w"], outputs=["y"], feedthrough={"y": ("u", "w")}, **capabilities)
        )
        self.law, self.rate = law or (lambda u: k * u), rate or (lambda u: k)

    def evaluate(self, v):
        v["y"] = self.law(v["u"]) + v["w"]

    def directional_derivative(self, unknowns, knowns, seed):
        known = self._names[knowns[0]]
        return np.array([(self.rate(self.values["u"]) if known == "u" else 1.0) * seed[0]])


def two(derivatives=True, **more):
    """a.y = 3 b.y + t, b.y = -2 a.y: a.y = t / 7. The second pass of values would blow up, for 6 > 1."""
    slaves = [Clock("c"), Sum("a", 3.0, provides_directional_derivative=derivatives), Gain("b", k=-2.0)]
    return run(slaves, [*RING, ("c.y", "a.w")], **more)


def test_the_plain_exchange_delays_them():
    """Each output of a point follows those of the one before it; what starts is solved all the same: 0."""
    result = two(master=Explicit("plain"))
    a, b, t = 0.0, 0.0, result.time
    for k in range(1, len(t)):
        a, b = 3 * b + t[k - 1], -2 * a
        assert (result["a.y"][k], result["b.y"][k]) == (a, b)
    assert len(t) > 5


class TestSolved:
    @pytest.mark.parametrize(("derivatives", "bound"), [(True, 8 * EPS), (False, TOLERANCE)])
    def test_two_gains(self, derivatives, bound):
        """Linear: Newton is exact to the rounding of a few operations; without derivatives to the tolerance."""
        result = two(derivatives)
        assert_allclose(result["a.y"], result.time / 7, rtol=bound, atol=bound)
        assert_allclose(result["b.y"], -2 * result.time / 7, rtol=bound, atol=2 * bound)
        assert_allclose(result["a.u"], result["b.y"], rtol=0, atol=0)

    @pytest.mark.parametrize("derivatives", [True, False])
    def test_nonlinear(self, derivatives):
        """x = 2 cos(x) - x / 2 + t."""
        can = {"provides_directional_derivative": derivatives}
        a = Sum("a", 0.0, lambda u: 2 * math.cos(u), lambda u: -2 * math.sin(u), **can)
        b = Gain("b", k=1.0)
        s = Sum("s", 1.0, **can)
        half = Gain("half", k=-0.5)
        links = [("a.y", "s.u"), ("half.y", "s.w", "at_point"), ("s.y", "b.u"), ("s.y", "half.u")]
        links += [("b.y", "a.u", "at_point"), ("c.y", "a.w")]
        result = run([Clock("c"), a, s, b, half], links)
        for t, x in zip(result.time, result["s.y"], strict=True):
            exact = brentq(lambda x, t=t: 2 * math.cos(x) - x / 2 + t - x, -1.0, 3.0, xtol=1e-15)
            # |G(x) - x| <= TOLERANCE, and dx = F / F', |F'| >= 1.5 where the root is
            assert abs(x - exact) <= TOLERANCE * 2

    def test_what_feeds_the_loop_and_what_follows_it(self):
        """Order of evaluation: before = 5 t, into the loop with a time of one step ago otherwise; after = 2 a.y."""
        slaves = [Gain("after", k=2.0), Sum("a", 3.0), Gain("b", k=-2.0), Gain("before", k=5.0), Clock("c")]
        links = [*RING, ("c.y", "before.u", "at_point"), ("before.y", "a.w", "at_point"), ("a.y", "after.u")]
        result = run(slaves, [(*link, "at_point")[:3] for link in links])
        assert_allclose(result["a.y"], 5 * result.time / 7, rtol=1e-14)
        assert_allclose(result["after.y"], 10 * result.time / 7, rtol=1e-14)

    def test_a_loop_within_one_component(self):
        result = run([Clock("c"), Sum("a", 0.5)], [("a.y", "a.u", "at_point"), ("c.y", "a.w")])
        assert_allclose(result["a.y"], 2 * result.time, rtol=1e-14)

    def test_a_component_that_does_not_stand_at_the_point_keeps_its_value(self):
        """b steps every second communication step: between, a answers what b showed last; a.y = 3 b.y + t."""
        result = two(steps={"b": 2})
        a, b, t = result["a.y"], result["b.y"], result.time
        assert_allclose(a[::2], t[::2] / 7, rtol=1e-14)
        assert_allclose(b[1::2], b[:-1:2], rtol=0)
        assert_allclose(a[1::2], 3 * b[1::2] + t[1::2], rtol=1e-14)

    def test_the_iterated_master_finds_the_same(self):
        """To its tolerance: 1e-9 of |x| + nominal, nominal 1."""
        can = {"can_get_and_set_state": True}
        slaves = [Clock("c", **can), Sum("a", 3.0, **can), Gain("b", k=-2.0, **can)]
        result = run(slaves, [*RING, ("c.y", "a.w")], master=Iterated(inputs="ramp"))
        assert_allclose(result["a.y"], result.time / 7, atol=1e-9 * (1 + result.time.max()), rtol=0)


class Lag(Fake):
    """x' = u - a x, y = c x + d u; steps are exact for a line of u."""

    def __init__(self, name, a, c, d, x0):
        self.a, self.c, self.d, self.x = a, c, d, x0
        super().__init__(
            name,
            describe(
                inputs=["u"],
                outputs=["y"],
                feedthrough={"y": ("u",)},
                provides_directional_derivative=True,
                can_interpolate_inputs=True,
                max_output_derivative_order=1,
            ),
        )

    def evaluate(self, v):
        v["y"] = self.c * self.x + self.d * v["u"]

    def advance(self, t, h, v, slopes):
        e = math.exp(-self.a * h)
        ramp = h / self.a - (1 - e) / self.a**2
        self.x = e * self.x + v["u"] * (1 - e) / self.a + slopes.get("u", 0.0) * ramp

    def slope(self, name, order):
        return self.c * (self.values["u"] - self.a * self.x) + self.d * self.slopes.get("u", 0.0)

    def directional_derivative(self, unknowns, knowns, seed):
        return np.array([self.d * seed[0]])


LAGS = {"p": (1.0, 1.0, 0.5, 1.0), "q": (2.0, -1.0, 2.0, 0.5), "r": (0.5, 0.3, -1.5, -1.0)}


def error_of_lags(step, extrapolation):
    """Three lags in a ring against DOP853 of the closed system; d1 d2 d3 = -1.5, so no passing on settles it."""
    lags = [Lag(name, *numbers) for name, numbers in LAGS.items()]
    links = [("p.y", "q.u", "at_point"), ("q.y", "r.u", "at_point"), ("r.y", "p.u", "at_point")]
    result = run(lags, links, step=step, master=Explicit(kernel="never", extrapolation=extrapolation))
    a, c, d, x0 = (np.array(column) for column in zip(*LAGS.values(), strict=True))
    around = np.roll(np.eye(3), 1, axis=1).T  # u = around y: q takes p, r takes q, p takes r

    def y_of(x):
        return np.linalg.solve(np.eye(3) - d[:, None] * around, c * x)

    exact = solve_ivp(
        lambda t, x: around @ y_of(x) - a * x, (0, 1), x0, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=result.time
    )
    found = np.column_stack([result[f"{name}.y"] for name in LAGS])
    return np.abs(found - np.array([y_of(x) for x in exact.y.T])).max()


@pytest.mark.parametrize("order", [1, 2])
def test_three_lags_against_the_closed_system(order):
    """Held inputs are of order one; with slopes, which are a loop too, of order two. The next term is a part of h."""
    errors = [error_of_lags(h, order - 1) for h in (0.02, 0.01, 0.005)]
    observed = np.log2([errors[0] / errors[1], errors[1] / errors[2]])
    assert_allclose(observed, order, atol=0.15)


def test_slopes_of_a_loop_are_solved_to_rounding():
    matrix, b = np.array([[0.0, 3e5], [-2e-5, 0.0]]), np.array([1e3, 1e-4])
    exact = np.linalg.solve(np.eye(2) - matrix, b)
    assert_allclose(solve_linear(lambda s: matrix @ s + b, 2), exact, rtol=1e-13)
    with pytest.raises(np.linalg.LinAlgError):
        solve_linear(lambda s: s + 1.0, 1)


class TestNotSolved:
    def test_without_a_solution(self):
        """From 0.25 s on x = x^2 + t + x has none; the rows before are kept."""
        a = Sum("a", 0.0, lambda u: u**2 + u, lambda u: 2 * u + 1)
        level = Gain("level", k=1.0, b=-0.25)
        slaves = [Clock("c"), level, a, Gain("b")]
        with pytest.raises(AlgebraicLoop) as caught:
            run(slaves, [*RING, ("c.y", "level.u"), ("level.y", "a.w")])
        error = caught.value
        assert error.time == 0.3
        assert "a.y <- a.u (direct feedthrough) <- b.y <- b.u (direct feedthrough) <- a.y: no solution" in str(error)
        assert "at communication point 0.3 s. Give one of these outputs a state" in str(error)
        assert_allclose(error.result.time, [0.0, 0.1, 0.2])
        assert error.result.info["failure"]["time"] == 0.3

    def test_an_fmu_that_fails_in_it(self):
        class Fails(Sum):
            def get_real(self, references):
                if self.values["w"] > 0.25:
                    raise CallFailed(self.name, "fmi2GetReal", "fmi2Error", ("no table beyond 0.25",))
                return super().get_real(references)

        with pytest.raises((AlgebraicLoop, StepFailed)) as caught:
            run([Clock("c"), Fails("a", 3.0), Gain("b")], [*RING, ("c.y", "a.w", "at_point")])
        error = caught.value
        assert isinstance(error, AlgebraicLoop) and (error.component, error.time) == ("a", 0.3)
        assert "<- b.y <- b.u (direct feedthrough) <- a.y: the loop could not be solved (a: fmi2GetReal" in str(error)
        assert "no table beyond 0.25" in str(error)
        assert_allclose(error.result.time, [0.0, 0.1, 0.2])

    def test_only_the_kernel(self):
        with pytest.raises(NotSupported, match="an algebraic loop is solved at each communication point"):
            two(master=Explicit(kernel="always"))

    def test_run_json_says_why_python_flew(self):
        loop = two(master=Explicit(kernel="auto")).info["loop"]
        assert loop["name"] == "python"
        assert loop["reason"].startswith("an algebraic loop is solved at each communication point (a.y <- a.u")


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    """Gains of C that cannot be evaluated again: y = k u + 1."""
    variables = [real("k", "parameter", start=0.5), real("u", "input"), real("y", depends="u")]
    step = "y = k * (u + m->slope[1] * h) + 1;"  # u at the end of a step over which it is a line

    def make(name, **more):
        return build(tmp_path_factory.mktemp(name), name, variables, step=step, refresh=False, **more)

    return make


class TestRefused:
    def loop(self, first, second):
        return both.of({"a": first, "b": second}, RING)

    def test_foreign_fmus_that_declare_it(self, foreign):
        plain = foreign("Plain")
        error = both.failure(WiringErrors, self.loop(plain, plain))
        (loop,) = error.mistakes
        assert str(loop) == (
            "a.y <- a.u (direct feedthrough) <- b.y <- b.u (direct feedthrough) <- a.y: this algebraic loop cannot be "
            "solved, for a and b cannot be evaluated again without a step. Choose master=Iterated(). Or: Put a "
            "component with a state into one of these connections."
        )

    def test_and_cannot_save_their_state(self, foreign):
        fixed = foreign("Fixed", canGetAndSetFMUstate=False)
        (loop,) = both.failure(WiringErrors, self.loop(fixed, fixed)).mistakes
        assert "Iterated" not in str(loop)
        assert str(loop).endswith("Put a component with a state into one of these connections.")

    def test_the_iterated_master_solves_it_as_told(self, foreign):
        """y = 0.5 y + 1 = 2 from the first step on."""
        plain = foreign("Plain2")
        setup = Experiment(stop_time=1.0, communication_step_size=0.1, master=Iterated(inputs="ramp"))
        result = simulate(self.loop(plain, plain), setup)
        assert_allclose(result["a.y"][1:], 2.0, rtol=3e-9)

    def test_fmus_that_declare_nothing_fly_delayed(self):
        slaves = [Integrator("i"), Gain("a", 0.5, 1.0, said=False, refresh=False), Gain("b", 0.5)]
        (path,) = _delayed(slaves, RING)
        assert path == "b.y -> a.u -> a.y: algebraic loop, if it is one: dependencies are not declared by a"
        assert unsolved_loops(_wiring(slaves, RING)) == []
        assert len(run(slaves, RING, held={"i.u": 0.0})) == 11

    def test_a_boolean_in_it(self, tmp_path):
        variables = [boolean("on", "input"), boolean("off", depends="on")]
        path = build(tmp_path, "Not", variables, outputs="off = !on;")
        system = both.of({"a": path, "b": path}, [("a.off", "b.on"), ("b.off", "a.on")])
        (loop,) = both.failure(WiringErrors, system).mistakes
        assert "a.off <- a.on (direct feedthrough) <- b.off" in str(loop)
        assert "cannot be solved, for a.off is of type Boolean, which no solver can vary." in str(loop)
        assert "Iterated" not in str(loop)


def _wiring(slaves, links):
    return wired(links, slaves, held={"i.u": 0.0})


def _delayed(slaves, links):
    return [str(path) for path in refresh_order(_wiring(slaves, links)).delayed]


def test_loops_are_found_variable_by_variable():
    """Two outputs of one component, of which only one is in the loop."""
    a = Gain("a")
    a.description = describe(inputs=["u", "w"], outputs=["x", "y"], feedthrough={"y": ("u",), "x": ("w",)})
    wiring = _wiring([Integrator("i"), a, Gain("b")], [("a.y", "b.u"), ("b.y", "a.u"), ("b.y", "a.w")])
    (loop,) = algebraic_loops(wiring)
    assert "a.x" not in loop
    assert [(sorted(map(str, e.outputs)), e.loop) for e in refresh_order(wiring).evaluations] == [
        (["a.y", "b.y"], True),
        (["a.x"], False),
    ]


SHOWN = '''
from cosim import Connection, Experiment, System
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated


def system(master=Explicit()):
    """Two gains in a ring."""
    ring = [Connection("a.y", "b.u"), Connection("b.y", "a.u", "at_point")]
    fmu = {fmu!r}
    return System(name="ring", components={{"a": fmu, "b": fmu}}, connections=ring), Experiment(
        stop_time=1.0, communication_step_size=0.1, master=master
    )


def iterated():
    """The same, iterated."""
    return system(Iterated())
'''


@pytest.mark.parametrize(
    ("refresh", "function", "told"),
    [
        (True, "system", "solved at each communication point"),
        (False, "system", "refused: this algebraic loop cannot be solved, for a and b cannot be evaluated again"),
        (True, "iterated", "solved by repeating steps"),
    ],
)
def test_adcs_show_says_what_is_done_with_a_loop(adcs, folder, refresh, function, told):
    path = build(folder, "Half", [real("u", "input"), real("y", depends="u")], outputs="y = u / 2;", refresh=refresh)
    (folder / "ring.py").write_text(SHOWN.format(fmu=str(path)), encoding="utf-8")
    shown = " ".join(adcs("show", f"ring.py:{function}").out.split())
    assert "algebraic loops: " in shown
    assert f"(direct feedthrough) <- a.y: {told}" in shown or f"(direct feedthrough) <- b.y: {told}" in shown
    assert "solved in initialization" in shown
