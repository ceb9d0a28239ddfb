"""What acts by its rate comes in once: refused at wiring where its step mean comes in too, and held in a swap."""

import pytest

from cosim.errors import WiringErrors
from cosim.system import Connection, System
from cosim.system.expand import wire
from cosim.system.swap import replace

from ..fakes import describe

TWO = ("1", "2")
MEANS = {f"tau[{i}]": f"h[{i}]" for i in TWO}
WHEELS = describe(outputs=[*MEANS, *MEANS.values()], step_means=MEANS)
PORTS = dict(inputs=[*MEANS, *MEANS.values(), "push[1]", "push[2]"], outputs=["w"])
BODY = describe(**PORTS, rates_act=frozenset(MEANS.values()))
OTHER = describe(**PORTS)
SUM = describe(
    inputs=[f"{n}[{i}]" for n in "ab" for i in TWO],
    outputs=[f"y[{i}]" for i in TWO],
    feedthrough={f"y[{i}]": (f"a[{i}]", f"b[{i}]") for i in TWO},
    role="sum",
)
PASSING = describe(
    inputs=SUM.variables.keys() - {"y[1]", "y[2]"}, outputs=["y[1]", "y[2]"], feedthrough=SUM.dependencies
)
ZERO = [0.0, 0.0]


def wired(links, body=BODY, held=(), **others):
    fmus = {"wheels": WHEELS, "body": body} | others
    system = System(
        name="test",
        components=dict.fromkeys(fmus, ""),
        connections=[Connection(*link) for link in links],
        held={name: 0.0 if "[" in name else ZERO for name in held},
    )
    return wire(system, fmus)


def refused(links, **keywords) -> str:
    with pytest.raises(WiringErrors) as caught:
        wired(links, **keywords)
    (mistake,) = caught.value.mistakes
    return str(mistake)


STORED = ("wheels.h", "body.h")


def test_the_momentum_alone_is_a_ramp():
    links = wired([STORED], held=["body.tau", "body.push"]).links
    assert [str(link) for link in links] == [
        f"wheels.h[{i}] -> body.h[{i}] (midpoint)" for i in TWO
    ]  # no interpolation


@pytest.mark.parametrize("port", ["tau", "push"])
def test_momentum_and_its_mean_torque_are_refused(port):
    other = "push" if port == "tau" else "tau"
    assert refused([STORED, ("wheels.tau", f"body.{port}")], held=[f"body.{other}"]) == (
        f"body.{port} counts what body.h counts: wheels.tau -> body.{port} is the step mean of the rate of "
        f"wheels.h -> body.h, which acts too. Remove the connection wheels.tau -> body.{port}, and hold the input "
        f'where no other torque takes its place: held={{"body.{port}": [0.0, 0.0]}}.'
    )


def test_one_element_is_enough():
    links = [("wheels.h[1]", "body.h[1]"), ("wheels.tau", "body.tau")]
    assert "is the step mean of the rate" in refused(links, held=["body.h[2]", "body.push"])
    crossed = [("wheels.h[1]", "body.h[1]"), ("wheels.tau[2]", "body.tau[2]")]
    assert wired(crossed, held=["body.h[2]", "body.tau[1]", "body.push"])


def test_a_way_over_sums_is_found():
    """Torque over a sum, momentum over another."""
    links = [
        ("wheels.tau", "torques.a"),
        ("torques.y", "body.push"),
        ("wheels.h", "momenta.b"),
        ("momenta.y", "body.h"),
    ]
    held = ["torques.b", "momenta.a", "body.tau"]
    assert refused(links, held=held, torques=SUM, momenta=SUM) == (
        "body.push counts what body.h counts: wheels.tau -> torques.a -> body.push is the step mean of the rate of "
        "wheels.h -> momenta.b -> body.h, which acts too. Remove the connection wheels.tau -> torques.a."
    )
    assert wired(links, held=held, torques=PASSING, momenta=SUM)  # what is no sum makes something else of it


def test_two_clusters_may_come_in_either_way():
    """One by its momentum, another by its torque; sums that feed each other are no endless way."""
    links = [STORED, ("others.tau", "body.tau")]
    assert wired(links, held=["body.push"], others=WHEELS)
    loop = [("one.y", "two.a"), ("two.y", "one.a"), ("one.y", "body.push"), STORED]
    assert wired(loop, held=["one.b", "two.b", "body.tau"], one=SUM, two=SUM)


def test_a_body_without_the_mark_takes_both():
    links = wired([STORED, ("wheels.tau", "body.tau")], body=OTHER, held=["body.push"]).links
    assert {link.timing for link in links} == {"midpoint", "after_step"}


# ---- swaps -------------------------------------------------------------------------------------------------------


def swapped(new, links, held):
    system = System(
        name="test",
        components={"wheels": "W", "body": "B"},
        connections=[Connection(*link) for link in links],
        held=dict.fromkeys(held, ZERO),
    )
    changed, report = replace(system, "body", "New", {"wheels": WHEELS, "body": new})
    assert wire(changed, {"wheels": WHEELS, "body": new})
    return changed, report


def test_a_body_that_takes_the_momentum_gets_no_torque_beside_it():
    changed, report = swapped(BODY, [STORED, ("wheels.tau", "body.tau")], ["body.push"])
    assert changed.connections == (Connection(*STORED),)
    assert changed.held == {"body.tau": ZERO, "body.push": ZERO}
    assert report.dropped == ("wheels.tau -> body.tau",) and report.added == ("held body.tau",)


def test_a_body_that_takes_both_gets_both():
    changed, report = swapped(OTHER, [STORED], ["body.tau", "body.push"])
    assert changed.connections == (Connection(*STORED), Connection("wheels.tau", "body.tau"))
    assert report.dropped == ("held body.tau",) and report.added == ("wheels.tau -> body.tau",)


def test_a_torque_from_elsewhere_stays():
    links = [STORED, ("thrusters.tau", "body.tau")]
    system = System(
        name="test",
        components={"wheels": "W", "thrusters": "T", "body": "B"},
        connections=[Connection(*link) for link in links],
        held={"body.push": ZERO},
    )
    fmus = {"wheels": WHEELS, "thrusters": describe(outputs=["tau[1]", "tau[2]"]), "body": BODY}
    changed, _ = replace(system, "body", "New", fmus)
    assert (changed.connections, changed.held) == (system.connections, system.held)
