"""run.json has the parameters and initial states that flew, whether anybody set them or not."""

import json

from cosim import Connection, Experiment, System, simulate

from ..fakes import Gain

SYSTEM = System(
    name="flown",
    components={"wheels": "ReactionWheels", "plant": "FlexibleSpacecraft:modes=1"},
    connections=[Connection("wheels.h_B", "plant.h_B")],
    held={"wheels.tau_command_B": [0.0] * 3, "plant.tau_B": [0.0] * 3, "plant.tau_dist_B": [0.0] * 3},
    parameters={"plant.J[1,1]": 400.0, "plant.omega_BN_B": [0.01, 0.0, 0.0], "wheels.wheel_momentum": 0.5},
)
SHORT = Experiment(stop_time=0.2, communication_step_size=0.1)


def values(system, folder):
    simulate(system, SHORT, out=folder)
    return json.loads((folder / "run.json").read_text())["values"]


def test_set_or_not_and_calculated(tmp_path):
    flown = values(SYSTEM, tmp_path)
    assert flown["plant"]["J"] == {"value": [[400.0, 0.0, 0.0], [0.0, 200.0, 0.0], [0.0, 0.0, 250.0]], "unit": "kg.m2"}
    assert flown["plant"]["omega_BN_B"]["value"] == [0.01, 0.0, 0.0]
    assert flown["plant"]["q_BN"]["value"] == [1.0, 0.0, 0.0, 0.0]
    assert flown["plant"]["solver.step"] == {"value": 0.0, "unit": "s"}
    assert flown["wheels"]["wheel_momentum"]["value"] == [0.5, 0.5, 0.5]
    assert abs(flown["plant"]["hub_inverse"]["value"][0][0] - 1 / (400 - 9)) < 1e-15  # J - delta^T delta


def test_an_fmu_that_is_not_ours_is_not_asked(tmp_path):
    """One that would fail where its parameters are read flies: what was set stands beside the start values."""

    class Shy(Gain):
        def get_real(self, references):
            parameters = {v.value_reference for v in self.description.variables.values() if v.causality == "parameter"}
            assert not parameters & set(references)
            return super().get_real(references)

    system = System(name="shy", components={"g": "g.fmu"}, held={"g.u": 1.0}, parameters={"g.k": 4.0})
    simulate(system, SHORT, slaves={"g": Shy("g", refresh=False)}, out=tmp_path)
    values = json.loads((tmp_path / "run.json").read_text())["values"]["g"]
    assert {name: entry["value"] for name, entry in values.items()} == {"k": 4.0, "b": 0.0}
