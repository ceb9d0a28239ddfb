"""Bodies, wheels and gyros of the papers keep their total inertial momentum in every exchange.

It is computed here from what both units show: R (J w + delta^T eta' + h), R and w of the plant, h of the cluster. The
disturbance is off. What is left is rounding: some 1e-16 of every one of 500 steps, and of the internal RK4 (1 ms) of
rates below .1 rad/s, whose error of the fifth order, .1 (1e-4)^4 a second, is less.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from scipy.spatial.transform import Rotation

from cosim import simulate
from cosim.cli.library import Library
from cosim.masters.explicit import Explicit
from cosim.masters.iterated import Iterated
from cosim.studies.papers import scenario
from cosim.system.value import Value

STEP, STOP = 0.01, 5.0
PAPERS = ["xiao2011-pid", "ye2016-adaptive", "geng2012-compensated"]
EXCHANGES = {
    "declared": Explicit(),
    "jacobi": Explicit(preset="jacobi"),
    "gauss_seidel": Explicit(preset="gauss_seidel"),
    "smooth": Explicit(inputs="smooth", extrapolation=1),
    "iterated": Iterated(),
    "iterated ramp": Iterated(inputs="ramp"),
}


def quiet(name: str):
    """The experiment without its disturbance, in steps of 10 ms."""
    system, experiment = scenario(name)
    still = {k: np.zeros(3) for k in system.parameters if k.split(".")[-1] in ("bias", "sine", "cosine")}
    still = {k: v for k, v in still.items() if k.startswith("environment.")}
    changes = dict(start_time=0.0, stop_time=STOP, communication_step_size=STEP, every=1)
    return replace(system, parameters=system.parameters | still), replace(experiment, **changes)


@cache
def vehicle(name: str):
    """J and delta of the plant."""
    system, _ = scenario(name)
    J, delta = (
        getattr(v, "value", v)
        for v in (system.parameters.get("plant.J", system.vehicle["J"]), system.vehicle.get("delta", np.zeros((0, 3))))
    )
    return np.array(J), np.array(delta)


def total(name, q, w, eta_dot, h):
    J, delta = vehicle(name)
    return Rotation.from_quat(q, scalar_first=True).apply(w @ J + eta_dot @ delta + h)


def change(rows: np.ndarray, scale: float) -> float:
    return float(np.linalg.norm(rows - rows[0], axis=1).max() / scale)


FLOWN = [("native", exchange) for exchange in EXCHANGES]
FLOWN += [("python", exchange) for exchange in ("declared", "jacobi", "gauss_seidel")]  # these FMUs have no slopes


@pytest.mark.parametrize(("backend", "exchange"), FLOWN)
@pytest.mark.parametrize("name", PAPERS)
def test_kept_in_every_exchange(name, backend, exchange):
    system, experiment = quiet(name)
    run = simulate(system, replace(experiment, master=EXCHANGES[exchange]), locate=Library(backend))
    h = run["actuators.h_B"]
    scale = max(np.linalg.norm(run["plant.H_N"][0]), np.linalg.norm(h, axis=1).max())
    assert np.linalg.norm(h - h[0], axis=1).max() > 0.1  # the cluster has turned the body
    assert change(run["plant.H_N"], scale) < 1e-12
    eta_dot = run["plant.eta_dot"] if "plant.eta_dot" in run else np.zeros((len(run), 0))
    found = total(name, run["plant.q_BN"], run["plant.omega_BN_B"], eta_dot, h)
    assert change(found, scale) < 1e-12


def foreign(name: str) -> dict[str, np.ndarray]:
    """Plain fmpy calls, all inputs held from the start of each step, none read again: a master that knows FMI alone."""
    system, _ = quiet(name)
    locate, units, variables = Library("native"), {}, {}
    for instance, reference in system.components.items():
        path = str(locate(reference))
        said = read_model_description(path)
        variables[instance] = {v.name: v.valueReference for v in said.modelVariables}
        unit = FMU2Slave(
            guid=said.guid,
            unzipDirectory=extract(path),
            modelIdentifier=said.coSimulation.modelIdentifier,
            instanceName=instance,
        )
        unit.instantiate()
        unit.setupExperiment(startTime=0.0)
        units[instance] = unit

    def elements(instance, variable):
        names = [variable, *(n for n in variables[instance] if n.startswith(f"{variable}["))]
        return [variables[instance][n] for n in names if n in variables[instance]]

    def put(instance, variable, value):
        refs = elements(instance, variable)
        if refs:
            units[instance].setReal(refs, np.broadcast_to(np.ravel(value), len(refs)).tolist())

    def get(instance, variable):
        return np.array(units[instance].getReal(elements(instance, variable)))

    def exchange():
        found = [(c.target.split("."), get(*c.source.split("."))) for c in system.connections]
        for target, values in found:
            put(*target, values)

    def plain(value):
        if isinstance(value, Value) and value.unit == "deg":
            return np.radians(value.value)
        return getattr(value, "value", value)

    for key, value in system.vehicle.items():
        for instance in units:
            put(instance, key, plain(value))
    for key, value in (system.parameters | system.held).items():
        first, _, variable = key.partition(".")
        for instance in units if first == "*" else [first]:
            put(instance, variable, plain(value))
    for unit in units.values():
        unit.enterInitializationMode()
    for _ in range(5):
        exchange()
    for unit in units.values():
        unit.exitInitializationMode()
    shown = ("q_BN", "omega_BN_B", "eta_dot", "H_N", "h_B")
    rows = {n: [get("plant", n)] for n in shown}
    for k in range(round(STOP / STEP)):
        exchange()
        for unit in units.values():
            unit.doStep(k * STEP, STEP)
        for n in shown:  # h_B is what the plant was given
            rows[n].append(get("plant", n))
    for unit in units.values():
        unit.terminate()
        unit.freeInstance()
    return {n: np.array(values) for n, values in rows.items()}


@pytest.mark.parametrize("name", PAPERS)
def test_kept_by_a_foreign_master(name):
    run = foreign(name)
    scale = max(np.linalg.norm(run["H_N"][0]), np.linalg.norm(run["h_B"], axis=1).max())
    assert np.linalg.norm(run["h_B"] - run["h_B"][0], axis=1).max() > 0.1
    assert change(run["H_N"], scale) < 1e-12
    found = total(name, *(run[n] for n in ("q_BN", "omega_BN_B", "eta_dot", "h_B")))
    assert change(found, scale) < 1e-12
