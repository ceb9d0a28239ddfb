"""A system's mistakes: each has its message, and all are told together."""

import math

import pytest

from cosim.errors import UnknownName, WiringErrors
from cosim.masters.explicit import Explicit
from cosim.system.wiring import Port
from cosim.time import Schedule

from ..fakes import Clock, Fake, Gain, Integrator, Mean, Vehicle, describe
from ..wired import HELD, mistakes, only, wired, zero


class TestConnections:
    def test_vector_expands_element_by_element(self):
        links = wired([("a.q_BN", "b.tau_B")], [Vehicle("a"), unitless("b")], held=zero("a", "b.angle")).links
        assert [str(k) for k in links] == [f"a.q_BN[{i}] -> b.tau_B[{i}] (at_point)" for i in (1, 2, 3)]

    def test_element(self):
        (link,) = wired([("a.q_BN[2]", "b.angle")], [Vehicle("a"), Vehicle("b")], held=zero("a", "b.tau_B")).links
        assert link.source == Port("a", "q_BN[2]")

    def test_unknown_component(self):
        assert only([("plnt.q_BN", "plant.angle")], held={"plant.tau_B": [0, 0, 0]}) == (
            'unknown component "plnt" in connection plnt.q_BN -> plant.angle. Did you mean "plant"? There: plant.'
        )

    def test_unknown_variable_names_near_and_all_outputs(self):
        assert only([("plant.q_BM", "plant.angle")], held={"plant.tau_B": [0, 0, 0]}) == (
            'unknown output "q_BM" in component "plant". Did you mean "q_BN"? There: q_BN, power, eta, omega.'
        )

    def test_sizes_differ(self):
        slaves = [Vehicle("a"), Vehicle("b")]
        assert only([("a.power", "b.tau_B")], slaves, held=zero("a", "b.angle")) == (
            "a.power has 1 element (unit none), b.tau_B has 3 elements (unit N.m): cannot connect them."
        )

    def test_dimensions_differ(self):
        slaves = [Vehicle("a"), Vehicle("b")]
        assert only([("a.q_BN", "b.tau_B")], slaves, held=zero("a", "b.angle")) == (
            "a.q_BN has unit rad, b.tau_B has unit N.m: they cannot be converted."
        )

    def test_a_filter_of_another_width_or_unit_is_told_how_to_name_it(self):
        """At either end; of two filters nobody knows which is meant."""
        one, other = Gain("one"), Gain("other")
        one.description = describe(inputs=["u"], outputs=["y"], units={"u": "1", "y": "1"}, role="filter")
        other.description = describe(inputs=["u"], outputs=["y"], units={"u": "m", "y": "m"}, role="filter")
        advice = "one is made for a width and a unit: name its FMU as in NAME:{}."
        held = {"plant.tau_B[2]": 0, "plant.tau_B[3]": 0, "plant.angle": 0, "one.u": 0}
        assert only([("plant.q_BN", "one.u")], [Vehicle(), one], held=zero("plant")) == (
            "plant.q_BN has 3 elements (unit rad), one.u has 1 element (unit 1): cannot connect them. "
            + advice.format("width=3")
        )
        assert only([("plant.q_BN[1]", "one.u")], [Vehicle(), one], held=zero("plant")) == (
            "plant.q_BN[1] has unit rad, one.u has unit 1: they cannot be converted. " + advice.format("unit=rad")
        )
        assert only([("one.y", "plant.tau_B[1]")], [Vehicle(), one], held=held).endswith(advice.format("unit=N.m"))
        assert only([("one.y", "other.u")], [one, other], held={"one.u": 0}) == (
            "one.y has unit 1, other.u has unit m: they cannot be converted."
        )

    def test_unit_without_base_unit_passes_only_by_name(self):
        odd = Gain("g")
        odd.description = describe(inputs=["u"], outputs=["y"], units={"u": "kg^(1/2).m", "y": "m"})
        assert wired([("plant.eta", "g.u")], [Vehicle(), odd]).links[0].conversion.factor == 1.0
        odd.description = describe(inputs=["u"], outputs=["y"], units={"u": "m"})
        assert "unit kg^(1/2).m, g.u has unit m" in only([("plant.eta", "g.u")], [Vehicle(), odd])

    def test_convertible_unit(self):
        milli = Gain("g")
        milli.description = describe(inputs=["u"], outputs=["y"], units={"y": "mN.m", "u": "m"})
        (link,) = wired(
            [("g.y", "plant.tau_B[1]")],
            [Vehicle(), milli],
            held={"plant.tau_B[2]": 0, "plant.tau_B[3]": 0, "plant.angle": 0, "g.u": 0},
        ).links
        assert link.conversion.factor == 1e-3

    def test_a_factor_and_an_offset_instead_of_the_units(self):
        one, other = Gain("one"), Gain("other")
        other.description = describe(inputs=["u"], outputs=["y"], units={"u": "m"})  # one.y is of unit 1
        (link,) = wired([("one.y", "other.u", None, -2.0, 0.5)], [one, other], held={"one.u": 0}).links
        assert link.conversion(3.0) == -5.5
        (link,) = wired([("one.y", "other.u", None, None, 0.5)], [one, other], held={"one.u": 0}).links
        assert link.conversion(3.0) == 3.5

    def test_a_factor_that_cannot_be(self):
        one, other = Gain("one"), Gain("other")
        assert "one.y -> other.u has a factor or offset that is not finite: inf, 0.0" in only(
            [("one.y", "other.u", None, math.inf)], [one, other], held={"one.u": 0}
        )
        one.description = describe(inputs=["u"], states={"y": True})
        assert "has a factor or offset, but its ends are Boolean and Real: both must be Real" in only(
            [("one.y", "other.u", None, 2.0)], [one, other], held={"one.u": 0}
        )

    def test_source_must_be_an_output(self):
        slaves = [Vehicle("a"), Vehicle("b")]
        assert only([("a.rho", "b.angle")], slaves, held=zero("a", "b.tau_B")) == (
            "a.rho cannot be the source of a connection: its causality is parameter. "
            "Outputs of a: q_BN, power, eta, omega."
        )

    def test_target_must_be_an_input(self):
        slaves = [Vehicle("a"), Vehicle("b")]
        text = only([("a.power", "b.eta")], slaves, held=zero("a", "b"))
        assert text == (
            "b.eta cannot be the target of a connection: its causality is output. Inputs of b: tau_B, angle."
        )

    def test_a_real_source_on_a_boolean(self):
        flag = Integrator("i")
        flag.description = describe(inputs=["u"], outputs=["y"])
        variable = flag.description.variables["u"]
        flag.description.variables["u"] = type(variable)("u", 0, "Boolean", "input", initial="exact", start=True)
        assert only([("plant.power", "i.u")], [Vehicle(), flag]) == (
            "plant.power is Real, i.u is Boolean: cannot connect them. "
            "A Boolean takes Boolean, and Integer and Enumeration while they are 0 or 1."
        )
        assert wired((), [Vehicle(), flag], held=HELD | {"i.u": False}).held[Port("i", "u")] is False

    def test_unconnected_input_suggests_held(self):
        assert mistakes(held={}) == [
            'input plant.tau_B is not connected. Connect it, or hold it: held={"plant.tau_B": [0.0, 0.0, 0.0]}.',
            'input plant.angle is not connected. Connect it, or hold it: held={"plant.angle": 0.0}.',
        ]

    def test_one_missing_element(self):
        held = {"plant.tau_B[1]": 0, "plant.tau_B[3]": 0, "plant.angle": 0}
        assert only(held=held).startswith("input plant.tau_B[2] is not connected.")

    def test_connected_twice_names_sum(self):
        slaves = [Vehicle("a"), Vehicle("b")]
        text = only([("a.power", "b.angle"), ("a.q_BN[1]", "b.angle")], slaves, held=zero("a", "b.tau_B"))
        assert text == (
            "input b.angle has 2 sources: a.power, a.q_BN[1]. "
            "An input takes one connection; add several signals with the component Sum."
        )

    def test_connected_and_held(self):
        assert "plant.angle has 2 sources: plant.power, held" in only([("plant.power", "plant.angle")])


class TestTimings:
    def test_step_mean_defaults_to_after_step(self):
        (link,) = wired([("m.y", "i.u")], [Integrator("i"), Mean("m")], held={}).links
        assert (link.timing, link.step_mean) == ("after_step", True)

    def test_step_mean_refuses_others(self):
        assert only([("m.y", "i.u", "at_point")], [Integrator("i"), Mean("m")], held={}) == (
            "m.y -> i.u has timing at_point, but its source is the mean over a step. "
            'A step mean is held over the step it was taken from: timing="after_step".'
        )

    def test_a_ramp_into_a_target_that_cannot_interpolate_is_its_midpoint(self):
        (link,) = wired([("c.y", "i.u", "ramp")], [Integrator("i"), Clock("c")], held={}).links
        assert link.timing == "midpoint"

    @pytest.mark.parametrize(("torque", "timing"), [(True, "ramp"), (False, "at_point")])
    def test_what_a_step_mean_is_of_is_a_ramp_to_who_takes_both(self, torque, timing):
        class Wheel(Mean):
            def __init__(self, name):
                super().__init__(name)
                self.description = describe(outputs=["y", "x"], step_means={"y": "x"})

        class Body(Fake):
            def __init__(self, name):
                super().__init__(name, describe(inputs=["tau", "h"], can_interpolate_inputs=True))

        links = [("wheel.x", "body.h"), *([("wheel.y", "body.tau")] if torque else [])]
        held = {} if torque else {"body.tau": 0.0}
        wiring = wired(links, [Wheel("wheel"), Body("body")], held=held)
        assert wiring.links[0].timing == timing

    def test_unknown_timing(self):
        assert only([("c.y", "i.u", "later")], [Integrator("i"), Clock("c")], held={}) == (
            'c.y -> i.u has timing "later". Choose at_point, after_step, midpoint, ramp, smooth.'
        )

    def rates(self, connections, slaves, **steps):
        wiring = wired(connections, slaves, held={}, steps=steps)
        with pytest.raises(WiringErrors) as caught:
            Explicit().course(wiring, Schedule.of(0.0, 1.0, 0.1, 1), ["*"])
        (mistake,) = caught.value.mistakes
        return str(mistake)

    def test_step_mean_faster_than_its_target(self):
        assert self.rates([("m.y", "i.u")], [Integrator("i"), Mean("m")], i=2) == (
            "m.y -> i.u (after_step): the source is the mean over its last step, but m takes a step in every "
            "communication step, i in 2 communication steps. Let m step at the rate of i, or slower."
        )

    def test_rates_that_do_not_divide(self):
        text = self.rates([("c.y", "i.u", "after_step")], [Integrator("i"), Clock("c")], i=2, c=3)
        assert "One must be a multiple of the other" in text

    def test_slow_mean_that_comes_too_late(self):
        class Actuator(Mean):
            def __init__(self, name):
                super().__init__(name)
                self.description = describe(inputs=["u"], outputs=["y", "x"], step_means={"y": ""})

        text = self.rates(
            [("c.y", "m.u", "after_step"), ("m.y", "i.u")], [Integrator("i"), Actuator("m"), Clock("c")], m=2
        )
        assert "m waits for faster components, so that its values come too late" in text

    def test_steps(self):
        assert "steps of plant is 0. It must be a whole number, 1 to 4611686018427387904." in only(steps={"plant": 0})
        assert 'unknown component "plent" in steps' in only(steps={"plent": 2})


def test_instance_names():
    slaves = [Clock("a.b")]
    assert (
        only(slaves=slaves, held={}) == '"a.b" cannot be an instance name. Write it without dots, spaces and brackets.'
    )


def test_all_mistakes_at_once():
    with pytest.raises(WiringErrors) as caught:
        wired(
            [("a.q_BN", "b.tau_B"), ("a.nothing", "b.angle")],
            [Vehicle("a"), Vehicle("b")],
            held={"a.tau_B": [0, 0, 0]},
            parameters={"a.rho": "x"},
        )
    text = str(caught.value)
    assert text.startswith('system "test" has 4 mistakes:\n')
    for part in (
        "  WiringError: a.q_BN has unit",
        "  UnknownName: unknown output",
        "input a.angle is not",
        "  ParameterError",
    ):
        assert part in text


def test_names_are_nearest_without_letter_case():
    with pytest.raises(UnknownName, match=r'Did you mean "Omega" or "omega"\?'):
        Vehicle().description.find("OMEGA", "variable", "here")


def unitless(name):
    vehicle = Vehicle(name)
    vehicle.description = describe(inputs=[*(f"tau_B[{i}]" for i in (1, 2, 3)), "angle"], outputs=["y"])
    return vehicle
