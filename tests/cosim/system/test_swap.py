"""Replacing an instance's FMU: what is kept, dropped, added, refused."""

import pytest

from cosim.errors import UnknownName, WiringErrors
from cosim.system import Connection, System
from cosim.system.swap import replace

from ..fakes import describe

PLANT = describe(
    inputs=["tau[1]", "tau[2]"],
    outputs=["q[1]", "q[2]", "w", "h"],
    parameters={"J": 1.0},
    step_means={"h": ""},
)
GUIDANCE = describe(outputs=["r", "rate"])
OLD = describe(
    inputs=["q[1]", "q[2]", "r"], outputs=["tau[1]", "tau[2]"], parameters={"k": 1.0, "rho": 1.0, "g[1]": 1.0}
)
SYSTEM = System(
    name="loop",
    components={"guidance": "G", "plant": "P", "controller": "Old"},
    connections=[
        Connection("plant.q", "controller.q", "after_step"),
        Connection("guidance.r", "controller.r", "midpoint"),
        Connection("controller.tau", "plant.tau"),
    ],
    parameters={"controller.k": 2.0, "controller.rho": 3.0, "controller.g[1]": 1.0, "plant.h0": 1.0, "*.k": 4.0},
    vehicle={"J": 1.0},
)


def swapped(new, system=SYSTEM, **descriptions):
    return replace(
        system, "controller", "New", {"guidance": GUIDANCE, "plant": PLANT, "controller": new} | descriptions
    )


def new(inputs=("q[1]", "q[2]", "r"), outputs=("tau[1]", "tau[2]"), **kinds):
    return describe(inputs=inputs, outputs=outputs, **kinds)


def test_same_ports_keep_everything():
    system, report = swapped(OLD)
    assert system.components["controller"] == "New"
    assert system.connections == SYSTEM.connections
    assert (system.parameters, system.vehicle) == (SYSTEM.parameters, SYSTEM.vehicle)
    assert report.kept[0] == "plant.q -> controller.q (after_step)"
    assert (report.dropped, report.added) == ((), ())


def test_parameters_that_it_lacks_are_dropped_and_listed():
    system, report = swapped(new(parameters={"k": 1.0}))
    assert system.parameters == {"controller.k": 2.0, "plant.h0": 1.0, "*.k": 4.0}
    assert report.dropped == ("parameter controller.rho", "parameter controller.g[1]")


def test_vehicle_parameters_that_carry_over_are_listed():
    _, report = swapped(new(parameters={"k": 1.0, "J": 2.0}))
    assert "vehicle J" in report.kept


def test_vehicle_parameters_that_nothing_has_any_more_are_dropped_and_listed():
    system, report = replace(
        SYSTEM,
        "plant",
        "New",
        {
            "guidance": GUIDANCE,
            "plant": describe(inputs=["tau[1]", "tau[2]"], outputs=["q[1]", "q[2]"]),
            "controller": OLD,
        },
    )
    assert system.vehicle == {}
    assert "vehicle J, which no component has any more" in report.dropped


def test_inputs_that_it_lacks_are_dropped():
    system, report = swapped(new(inputs=["q[1]", "q[2]"]))
    assert [c.source for c in system.connections] == ["plant.q", "controller.tau"]
    assert "guidance.r -> controller.r (midpoint)" in report.dropped


def test_another_size_is_not_the_same_port():
    with pytest.raises(
        WiringErrors,
        match=r"controller needs the input q .*plant.q has 2 elements, controller.q has 3: name a component with that "
        r"structure, as in NAME:modes=2",
    ):
        swapped(new(inputs=["q[1]", "q[2]", "q[3]", "r"]))


def test_a_connection_that_another_width_breaks_is_named():
    notched = System(
        name="loop",
        components={"guidance": "G", "plant": "P", "controller": "Notch:width=2"},
        connections=[Connection("plant.q", "controller.u"), Connection("controller.y", "plant.tau")],
    )
    with pytest.raises(
        WiringErrors,
        match=r"controller needs the input u .*plant.q has 2 elements, controller.u has 1: name a component with that "
        r"structure, as in NAME:width=2",
    ):
        swapped(new(inputs=["u"], outputs=["y"]), notched)


def test_further_input_takes_the_timing_of_its_source():
    system, report = swapped(new(inputs=["q[1]", "q[2]", "r", "w", "rate"]))
    assert Connection("plant.w", "controller.w", "after_step") in system.connections
    assert Connection("guidance.rate", "controller.rate", "midpoint") in system.connections
    assert report.added == ("plant.w -> controller.w (after_step)", "guidance.rate -> controller.rate (midpoint)")


def test_further_input_from_elsewhere_is_after_step_where_others_are():
    system, _ = swapped(new(inputs=["q[1]", "q[2]", "r", "s"]), wheels=describe(outputs=["s"]))
    assert Connection("wheels.s", "controller.s", "after_step") in system.connections


def test_step_mean_keeps_its_own_timing():
    system, _ = swapped(new(inputs=["q[1]", "q[2]", "r", "h"]))
    assert Connection("plant.h", "controller.h", None) in system.connections


def test_no_offer_and_several_are_refused_together():
    with pytest.raises(WiringErrors) as caught:
        swapped(new(inputs=["q[1]", "q[2]", "r", "w", "nowhere"]), wheels=describe(outputs=["w"]))
    text = str(caught.value)
    assert "controller needs the input w in its new FMU Fake, but plant, wheels offer it" in text
    assert "controller needs the input nowhere" in text
    assert 'hold it: held={"controller.nowhere": ...}' in text


def test_held_inputs():
    held = System(**{**vars(SYSTEM), "held": {"controller.bias": 0.0, "controller.old": 1.0}})
    system, report = swapped(new(inputs=["q[1]", "q[2]", "r", "bias"]), held)
    assert system.held == {"controller.bias": 0.0}
    assert "held controller.old" in report.dropped


def test_unknown_instance():
    with pytest.raises(UnknownName, match=r'unknown component "controler" in system "loop". Did you mean "controller"'):
        replace(SYSTEM, "controler", "New", {})
