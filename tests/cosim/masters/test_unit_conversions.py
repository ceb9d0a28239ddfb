"""Units with factors and offsets: in connections, in values, in the Jacobian of an algebraic loop."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cosim import simulate
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.initialization.values import Values
from cosim.masters.layout import Layout
from cosim.masters.point import Point
from cosim.system import Experiment, System, Value
from cosim.system.wiring import Port
from fmus.description.units import BaseUnit, Conversion, Unit, conversion, resolve

from ..fakes import Clock, Gain, Integrator, describe
from ..flights import run
from ..wired import wired

KELVIN, CELSIUS, FAHRENHEIT = (
    Unit(name, BaseUnit((0, 0, 0, 0, 1, 0, 0, 0), to_si))
    for name, to_si in (
        ("K", Conversion()),
        ("degC", Conversion(1.0, 273.15)),
        ("degF", Conversion(5 / 9, 273.15 - 32 * 5 / 9)),
    )
)
UNITS = {unit.name: unit for unit in (KELVIN, CELSIUS, FAHRENHEIT)} | {
    "K": Unit("K", KELVIN.base, {"degR": Conversion(9 / 5), "degC_shown": Conversion(1.0, -273.15)})
}


def thermal(slave, unit):
    """Give a gain inputs and outputs in a unit of temperature."""
    names = {"u": unit, "y": unit, "b": unit}
    slave.description = describe(
        inputs=["u"],
        outputs=["y"],
        parameters={"k": slave.values["k"], "b": slave.values["b"]},
        feedthrough={"y": ("u",)},
        units=names,
        provides_directional_derivative=True,
    )
    object.__setattr__(slave.description, "units", UNITS)
    return slave


class TestOffsets:
    def test_one_after_the_other(self):
        """degC -> K -> degF: 100 degC are 373.15 K and 212 degF; the order of the two matters."""
        to_kelvin, to_fahrenheit = Conversion(1.0, 273.15), Conversion(9 / 5, 32 - 273.15 * 9 / 5)
        both_ways = to_kelvin.then(to_fahrenheit)
        for celsius, fahrenheit in ((100.0, 212.0), (0.0, 32.0), (-40.0, -40.0)):
            assert both_ways(celsius) == pytest.approx(fahrenheit, abs=1e-9)
            assert both_ways(celsius) == pytest.approx(to_fahrenheit(to_kelvin(celsius)), abs=1e-9)
            assert both_ways.inverse(fahrenheit) == pytest.approx(celsius, abs=1e-9)

    @pytest.mark.parametrize("factor", [2.0, -0.5])
    @pytest.mark.parametrize("offset", [0.0, 10.0])
    def test_the_way_back(self, factor, offset):
        there = Conversion(factor, offset)
        for way in (there.then(there.inverse), there.inverse.then(there), there.inverse.inverse.then(there.inverse)):
            assert way(7.0) == pytest.approx(7.0, rel=1e-14)

    def test_between_units_with_offsets(self):
        found = conversion("degC", "degF", UNITS, UNITS)
        assert found is not None and found(100.0) == pytest.approx(212.0)
        found = conversion("degF", "degC", UNITS, UNITS)
        assert found is not None and found(-40.0) == pytest.approx(-40.0) and found(212.0) == pytest.approx(100.0)

    def test_a_user_s_value_through_a_display_unit(self):
        """Shown = factor * value + offset: from a display unit of K on to another unit."""
        found = resolve("degC_shown", "degF", [UNITS])
        assert found is not None and found(100.0) == pytest.approx(212.0)
        found = resolve("degR", "degC", [UNITS])
        assert found is not None and found(491.67) == pytest.approx(0.0, abs=1e-9)

    @pytest.mark.parametrize("timing", ["at_point", "after_step", "midpoint"])
    def test_a_connection(self, timing):
        """21 degC in one unit are 294.15 K in the next, and 69.8 degF in the last."""
        slaves = [thermal(Gain(name), unit) for name, unit in (("c", "degC"), ("k", "K"), ("f", "degF"))]
        links = [("c.y", "k.u", timing), ("k.y", "f.u", timing)]
        result = run(slaves, links, held={"c.u": 21.0}, stop=0.3)
        assert_allclose(result["k.u"], 294.15, rtol=1e-14)
        assert_allclose(result["f.y"], 69.8, rtol=1e-13)

    def test_a_ramp_has_the_factor_and_no_offset(self):
        """d/dt of a temperature in degF is 9/5 of that in degC: an offset would be a slope."""
        clock, integrator = Clock("c"), Integrator("i")
        clock.description = describe(outputs=["y"], units={"y": "degC"})
        integrator.description = describe(
            inputs=["u"], states={"y": 0.0}, units={"u": "degF"}, can_interpolate_inputs=True
        )
        for slave in (clock, integrator):
            object.__setattr__(slave.description, "units", UNITS)
        result = run([clock, integrator], [("c.y", "i.u", "ramp")])
        assert_allclose(result["i.y"], 32 * result.time + 9 / 5 * result.time**2 / 2, rtol=1e-12, atol=1e-12)

    def test_initial_and_held_values(self):
        gain = thermal(Gain("g", k=2.0), "K")
        held = {"g.u": Value("20 degC")}
        result = run([gain], [], held=held, stop=0.1)
        assert_allclose(result["g.u"], 293.15)
        for text, kelvin in (("212 degF", 373.15), ("-40 degC", 233.15), ("491.67 degR", 273.15)):
            system = System(name="t", components={"g": ""}, held={"g.u": 0.0}, parameters={"g.b": Value(text)})
            gain = thermal(Gain("g", k=0.0), "K")
            result = simulate(system, Experiment(stop_time=0.1, communication_step_size=0.1), slaves={"g": gain})
            assert_allclose(result["g.y"], kelvin)

    def test_in_the_jacobian_of_a_loop(self):
        """f = 0.5 u_f + 10 degF, k = 2 u_k - 300 K, each the other's input; solved in kelvins by hand.

        The slope of a conversion is its factor: with the offset in it, or without the factor, Newton's last step
        would not end where the loop is.
        """
        f, k = thermal(Gain("f", k=0.5, b=10.0), "degF"), thermal(Gain("k", k=3.0, b=-300.0), "K")
        result = run([f, k], [("f.y", "k.u"), ("k.y", "f.u")], stop=0.1)
        to_f = lambda kelvin: kelvin * 9 / 5 - 459.67  # noqa: E731
        # k = 3 (f + 459.67) 5/9 - 300 and f = 0.5 to_f(k) + 10
        matrix = np.array([[1.0, -0.5 * 9 / 5], [-3.0 * 5 / 9, 1.0]])
        right = np.array([0.5 * -459.67 + 10.0, 3.0 * 459.67 * 5 / 9 - 300.0])
        expected = np.linalg.solve(matrix, right)
        assert_allclose([result["f.y"][0], result["k.y"][0]], expected, rtol=1e-10)
        assert_allclose(result["f.u"][0], to_f(expected[1]), rtol=1e-10)


class TestJacobian:
    """a in N.m from b in mN.m and back: Newton with directional derivatives needs the factors of both connections."""

    def loop(self, functions):
        counts = {"evaluations": 0}

        class Bent(Gain):
            def evaluate(self, v):
                counts["evaluations"] += 1
                v["y"] = functions[self.name][0](v["u"])

            def directional_derivative(self, unknowns, knowns, seed):
                return np.array([functions[self.name][1](self.values["u"]) * seed[0]])

        slaves = []
        for name, unit in (("a", "N.m"), ("b", "mN.m")):
            slave = Bent(name)
            slave.description = describe(
                inputs=["u"],
                outputs=["y"],
                parameters={"k": 1.0, "b": 0.0},
                feedthrough={"y": ("u",)},
                units={"u": unit, "y": unit},
                provides_directional_derivative=True,
            )
            slaves.append(slave)
        result = run(slaves, [("b.y", "a.u"), ("a.y", "b.u")], stop=0.1)
        return result, counts["evaluations"]

    def test_a_linear_loop_is_solved_exactly(self):
        """a = 3 u + 1 N.m, b = -2 u + 500 mN.m: in N.m a = 3 b + 1, b = -2 a + 0.5, so that a = 2.5 / 7."""
        result, _ = self.loop(
            {"a": (lambda u: 3 * u + 1, lambda u: 3.0), "b": (lambda u: -2 * u + 500, lambda u: -2.0)}
        )
        assert_allclose(result["a.y"][0], 2.5 / 7, rtol=1e-14)
        assert_allclose(result["b.y"][0], -1500 / 7, rtol=1e-14)
        assert_allclose(result["a.u"][0], -1.5 / 7, rtol=1e-14)

    def test_a_jacobian_without_the_factor_would_go_elsewhere(self):
        """A wrong slope costs evaluations or the solution: a few dozen are enough with the right one."""
        result, evaluations = self.loop(
            {
                "a": (lambda u: 4 * math.cos(3 * u), lambda u: -12 * math.sin(3 * u)),
                "b": (lambda u: 0.9 * u, lambda u: 0.9),
            }
        )
        a = result["a.y"][0]
        assert_allclose(a, 4 * math.cos(3 * 0.9 * a), rtol=1e-9)
        assert evaluations < 150

    def test_the_matrix_itself(self):
        """dG/dx - 1 against differences of G, with unit factors 1e-3 and 1e3 in it."""
        slaves = {}
        for name, unit, k in (("a", "N.m", 3.0), ("b", "mN.m", -2.0)):
            slaves[name] = Gain(name, k=k)
            slaves[name].description = describe(
                inputs=["u"], outputs=["y"], parameters={"k": k, "b": 0.0}, feedthrough={"y": ("u",)},
                units={"u": unit, "y": unit}, provides_directional_derivative=True,
            )  # fmt: skip
        wiring = wired([("b.y", "a.u"), ("a.y", "b.u")], list(slaves.values()), held={})
        layout = Layout.of(wiring)
        (loop,) = Initialization.of(wiring, layout).parts
        values = Values(layout, slaves, Point.start(layout), 0.0)
        values.known[:] = True
        place = {layout.slots[Port(name, "y")]: name for name in "ab"}
        names = [place[slot] for slot in loop.slots]
        loop._passed(values, np.array([1.0, 2.0]))
        matrix = loop._jacobian(values)
        a, b = names.index("a"), names.index("b")
        assert matrix[a, a] == matrix[b, b] == -1.0
        assert_allclose([matrix[a, b], matrix[b, a]], [3.0e-3, -2.0e3], rtol=1e-15)
