"""Faults on connections of every kind: types, conversions, algebraic loops, step means; runs that are gone on with."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cosim import Connection, Experiment, Explicit, Fault, Iterated, Library, System, simulate
from cosim.system import Value

from .. import both
from ..fakes import Clock, Gain
from ..interrupted import assert_goes_on
from ..system.test_bad_faults import refused
from ..typed_fmu import typed
from .test_algebraic_loops import RING, Sum
from .test_faults import SYSTEM, V, flown


def test_conversions_come_before_faults():
    """u = 0.5 (2 v + 0.1) + 0.3, in the target's own unit; the slope of a ramp is 0.5 2 v'."""
    links = [Connection("mass.v", "damper.v", "ramp", factor=2.0, offset=0.1), Connection("damper.f", "mass.f")]
    faults = [Fault("bias", V, Value(300, "mm/s"), start=0.5), Fault("scale", V, 0.5, start=0.5)]
    result = flown(Explicit(), faults, system=replace(SYSTEM, connections=links), stop=1.0)
    late = result.time >= 0.5
    v, u = result["mass.v"], result["damper.v"]
    assert_allclose(u[late], 0.5 * (2 * v[late] + 0.1) + 0.3, rtol=1e-14)
    assert_allclose(u[~late], 2 * v[~late] + 0.1, rtol=1e-14)


@pytest.mark.parametrize("derivatives", [True, False])
def test_in_an_algebraic_loop(derivatives):
    """a.y = 3 b.y + t, b.y = -2 s a.y: a.y = t / (1 + 6 s), by Newton and by Powell's method."""
    slaves = [Clock("c"), Sum("a", 3.0, provides_directional_derivative=derivatives), Gain("b", k=-2.0)]
    connections = [Connection(*link) for link in [*RING, ("c.y", "a.w")]]
    system = System(name="ring", components={s.name: "a.fmu" for s in slaves}, connections=connections)
    fault = Fault("scale", "a.y -> b.u", 0.5, start=0.5)
    setup = Experiment(stop_time=1.0, communication_step_size=0.1, faults=[fault])
    result = simulate(system, setup, slaves={s.name: s for s in slaves})
    s = np.where(result.time >= 0.5, 0.5, 1.0)
    assert_allclose(result["a.y"], result.time / (1 + 6 * s), atol=1e-9)
    assert_allclose(result["b.u"], s * result["a.y"], atol=1e-15)


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    fmu = typed(tmp_path_factory.mktemp("typed"))
    links = [
        ("a.i", "b.i_in"), ("a.b", "b.b_in"), ("a.e", "b.e_in"), ("a.s", "b.s_in"), ("a.r", "b.r_in"),
    ]  # fmt: skip
    held = {"a.r_in": 1.5, "a.i_in": 7, "a.b_in": True, "a.e_in": "fast", "a.s_in": "one"}
    return both.of({"a": fmu, "b": fmu}, [(*link, "after_step") for link in links], held=held)


def test_every_type(chain):
    faults = [
        Fault("stuck", "b.i_in", 3, start=0.3, until=0.6),
        Fault("stuck", "b.b_in", True, start=0.3, until=0.6),
        Fault("stuck", "b.e_in", "slow", start=0.3, until=0.6),
        Fault("dropout", "b.s_in", start=0.3),
        Fault("delay", "b.i_in", 2, start=0.7),
        Fault("delay", "b.s_in", 2, start=0.1),
    ]
    result = both.fly(chain, both.experiment(faults=faults))
    during = (result.time >= 0.3) & (result.time < 0.6)
    assert (result["b.i_in"][during] == 3).all() and (result["b.i_in"][~during] != 3).all()
    assert result["b.b_in"][during].all() and not result["b.b_in"][~during].any()
    assert len(set(result["b.e_in"][during].tolist())) == 1
    assert set(result["b.e_in"][during].tolist()) != set(result["b.e_in"][~during].tolist())
    assert set(result["b.s_in"].tolist()) == {"<one"}


@pytest.mark.parametrize(
    "fault, message",
    [
        (("bias", "b.i_in", 1), "b.i_in is Integer. Its faults are delay, stuck, dropout."),
        (("stuck", "b.s_in", "two"), "b.s_in is String. Its faults are delay, dropout."),
        (("stuck", "b.i_in", 2.5), "it is Integer, the value 2.5 is float"),
        (("stuck", "b.b_in", "maybe"), "Write true, false, 1 or 0"),
    ],
)
def test_what_a_type_cannot_take(chain, fault, message):
    from cosim import prepare

    with prepare(chain) as ready:
        assert message in refused(ready, Fault(*fault, start=0.5))


@pytest.mark.parametrize("master", [Explicit(), Iterated()], ids=["explicit", "iterated"])
def test_runs_go_on_from_checkpoints_with_their_faults(master, tmp_path):
    """What is on its way, what is held, whether it is frozen, which faults are over: all of it is in the point."""
    faults = [
        Fault("noise", V, 0.1, start=0.3, seed=5),
        Fault("freeze", "damper", start=0.9, until=1.3),
        Fault("parameter", "damper.c", 2.0, start=0.6, until=1.1),
    ]
    if isinstance(master, Explicit):
        faults.append(Fault("delay", V, 3, start=0.3, until=1.6))
    setup = Experiment(stop_time=2.0, communication_step_size=0.1, master=master, faults=faults)
    assert_goes_on(SYSTEM, setup, tmp_path, 0.4, locate=Library())


def test_a_step_mean():
    """A mean torque on its way to the hub is halved, over each step from the time on."""
    wheels = System(
        name="wheels",
        components={"wheels": "ReactionWheels", "plant": "FlexibleSpacecraft:modes=0"},
        connections=[Connection("wheels.tau_B", "plant.tau_B")],
        held={"wheels.tau_command_B": [0.1, 0.2, 0.3]},
        parameters={"plant.J": [[100, 0, 0], [0, 100, 0], [0, 0, 100]], "wheels.spin_axes_B": np.eye(3)},
        hold_unconnected=True,
    )
    setup = both.experiment(stop=2.0, faults=[Fault("scale", "plant.tau_B[3]", 0.5, start=1.0)])
    results = [simulate(wheels, replace(setup, master=Explicit(kernel=loop))) for loop in both.LOOPS]
    both.assert_same(*results)
    late = results[0].time > 1.0
    ratio = results[0]["plant.tau_B"][late] / results[0]["wheels.tau_B"][late]
    assert_array_equal(ratio, np.broadcast_to([1, 1, 0.5], ratio.shape))
    # J w' = tau about z, 0.3 N m for 1 s and half of it for 1 s, the other axes being slow: w_x w_y < 4e-6 of 0.3 / 100
    assert_allclose(results[0]["plant.omega_BN_B"][-1, 2], (0.3 + 0.15) / 100, rtol=1e-3)
