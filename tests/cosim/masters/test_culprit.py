"""After a value that is not finite the unit that let it grow is named, with its warning, in both loops."""

from dataclasses import replace

import pytest

from components.actuators.reaction_wheels import ReactionWheels
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim import flights
from cosim.errors import StepFailed
from cosim.masters.explicit import Explicit
from cosim.system import System
from fmus.description.annotations import GROWS
from fmus.export.build import build

from .. import both

LOOP = [("wheels.h_B", "plant.h_B", "midpoint")]


@pytest.fixture(scope="module", params=["native", "python"])
def fmus(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stiff")
    plant = FlexibleSpacecraft(modes=0, omega_BN_B=[0.01, 0.02, 0.03])
    components = {"wheels": ReactionWheels(), "plant": plant}
    return {name: build(c, folder / f"{name}.fmu", request.param) for name, c in components.items()}


def system(fmus, friction) -> System:
    parameters = {"wheels.friction": [friction] * 3, "wheels.rotor_inertia": [0.05] * 3, "*.solver.step": 1e-3}
    held = {"wheels.tau_command_B": [0.1, 0.2, 0.3], "plant.tau_B": [0.0] * 3, "plant.tau_dist_B": [0.0] * 3}
    return both.of(fmus, LOOP, parameters=parameters, held=held)


@pytest.mark.parametrize("loop", ["auto", "never"])
def test_a_stiff_actuator_is_blamed_where_the_plant_meets_what_it_made(fmus, loop):
    """Friction 500 on a rotor of 0.05 decays with 1e4 1/s: at 1 ms RK4 multiplies it by 291 a step."""
    setup = both.experiment(stop=1.0, step=0.001)
    with pytest.raises(StepFailed) as caught:
        flights.simulate(system(fmus, 500.0), replace(setup, master=Explicit(kernel=loop)))
    error = caught.value
    assert error.component == "plant"
    (culprit,) = error.culprits
    assert culprit.startswith("wheels is to blame: wheels: an internal step of 0.001 s is too long for its dynamics")
    assert f"a rate of 1e+04 1/s decays, {GROWS}. solver.step = 0.0001 s would do." in culprit
    assert f"\n    {culprit}" in str(error) and "a shorter step may help" not in str(error)
    assert error.result.info["failure"]["culprits"] == [culprit]
    assert error.result.info["messages"]["wheels"]
