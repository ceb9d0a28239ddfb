"""The systems and claims of li2014."""

import json
from functools import cache

import numpy as np
import pyarrow as pa
import pytest

from components.catalog import CATALOG
from cosim.results.result import Result
from cosim.studies import metrics, papers
from cosim.studies.papers.claims import judge
from cosim.studies.papers.li2014 import design, lyapunov, spectrum, system
from cosim.system.expand import wire
from fmus.export.python.in_process import describe_in_process

DESIGN = (system.DESIGN, system.DESIGN_NO_NN, system.DESIGN_PRINTED, system.DESIGN_CONSISTENT, system.DESIGN_GAMMA)
IDEAL = (system.NN, system.NO_NN, system.NN_LVLH, system.NO_NN_LVLH, system.DESIGN, system.DESIGN_NO_NN)


@pytest.mark.parametrize("name", papers.PAPERS["li2014"].experiments)
def test_the_system_fits_its_components(name):
    """All inputs fed, every parameter known, every unit convertible: nothing is left to complain about."""
    flight, experiment = papers.scenario(name)
    assert flight.name == name
    descriptions = {
        instance: describe_in_process(CATALOG[reference]()) for instance, reference in flight.components.items()
    }
    settings = {str(port): value for port, value in wire(flight, descriptions).settings.items()}
    assert settings["plant.J[2,2]"] == settings["controller.J[2,2]"] == 200.0
    assert name in DESIGN or settings["plant.cage_gap"] == 4e-3
    assert name not in DESIGN or settings["plant.centres[2,25]"] == settings["controller.centres[2,25]"] == 1.0
    long = {system.ACTUATORS: 2000.0, system.NN_SPECTRUM: 2000.0, system.NO_NN_SPECTRUM: 2000.0}
    assert experiment.stop_time == (long | {system.PRINTED_START: 60.0}).get(name, 200.0)


@pytest.mark.parametrize("name", IDEAL)
def test_no_number_of_the_paper_is_left_to_a_component(name):
    """What a system does not set is an option that is off, or no number of this paper."""
    flight, _ = papers.scenario(name)
    parts = {instance: CATALOG[reference]() for instance, reference in flight.components.items()}
    every = {f"{instance}.{v.name}": v for instance, part in parts.items() for v in part.parameters}
    left = set(every) - set(flight.parameters) - {"plant.J", "controller.J"}
    off = {"controller.printed_signs", "controller.consistent_feedforward", "controller.f_feedforward_S"}
    off |= {"plant.printed_signs", "guidance.step_time"}
    general = {f"environment.{n}" for n in ("terminator_width", "penumbra_width", "seed")} | {"guidance.axis"}
    general |= {f"guidance.{n}" for n in ("mu", "J2", "earth_radius")}
    assert left <= off | general
    assert not any(np.any(every[port].start) for port in left & off)


def test_initial_states_are_those_of_the_equations():
    """The state at t = 0 of equations/parameters.json, for the LVLH case too."""
    lvlh = system.initial_state(lvlh=True)
    q = [0.562006422768794, 0.24402224156899613, -0.7830788186568098, 0.1067215543239574]
    w = [-8.150161646771547e-06, -0.0011672740507584246, 1.009059743330371e-05]
    np.testing.assert_allclose(lvlh["plant.q_SN"] * np.sign(lvlh["plant.q_SN"][0]), q, atol=1e-15)
    np.testing.assert_allclose(lvlh["plant.omega_SN_S"].value, w, atol=1e-17)
    inertial = system.initial_state(lvlh=False)
    q = [0.9999809216719303, 0.004372406155852035, -0.002602719276952274, 0.003502029258937982]
    np.testing.assert_allclose(inertial["plant.q_SN"], q, atol=1e-15)
    q = [0.9999277701901729, 0.008756700008556063, -0.004302115180700307, 0.007019003664389736]
    np.testing.assert_allclose(inertial["plant.q_TS"], q, atol=1e-15)


def made(stop=200.0, step=0.1, residual=None, caught=None, **variables) -> Result:
    """A run that is quiet except for what is given; caught: when the test mass reaches its cage, s."""
    t = np.arange(0, stop + step / 2, step)
    rows = {
        "plant.r_rel": np.zeros((len(t), 3)),
        "plant.q_SN": np.tile([1.0, 0, 0, 0], (len(t), 1)),
        "plant.q_TS": np.tile([1.0, 0, 0, 0], (len(t), 1)),
        "guidance.q_RN": np.tile([1.0, 0, 0, 0], (len(t), 1)),
        "plant.residual_acceleration_S": np.zeros((len(t), 3)) if residual is None else residual(t),
        "environment.f_dist_B": np.zeros((len(t), 3)),
        "plant.f_dist_S": np.zeros((len(t), 3)),
        "plant.f_command_S": np.zeros((len(t), 3)),
        "controller.f_command_S": np.full((len(t), 3), 2.1),
    }
    rows |= {name.replace("__", "."): np.ones((len(t), 1)) * np.ravel(value) for name, value in variables.items()}
    rows |= {name: np.tile(v, (1, 3)) for name, v in rows.items() if v.shape[1] == 1}
    free = np.inf if caught is None else caught
    columns = {"time": t, "plant.cage_contact": (t >= free).astype(float), "plant.contact_time": np.minimum(t, free)}
    columns |= {f"{n}[{i + 1}]": v[:, i] for n, v in rows.items() for i in range(v.shape[1])}
    return Result(pa.table(columns), {})


def test_density_of_white_noise():
    rng = np.random.default_rng(1)
    run = made(4000.0, 0.2, lambda t: 3e-14 * np.sqrt(2.5) * rng.normal(size=(len(t), 3)))
    f, values = spectrum.residual_density(run)
    assert np.sqrt((values[(f > 0.1) & (f < 2)] ** 2).mean()) == pytest.approx(3e-14, rel=0.03)


def noisy(level, satellite=1e-9, seed=1):
    """White noise of the test mass and of the satellite, deviations in m/s2; 0.63 of it a sqrt(Hz)."""
    rng = np.random.default_rng(seed)
    run = made(2000.0, 0.2, lambda t: level * rng.normal(size=(len(t), 3)))
    names = [f"plant.f_command_S[{i}]" for i in (1, 2, 3)]
    for name in names:
        force = pa.array(system.M_SC * satellite * rng.normal(size=len(run)))
        run = Result(run.table.set_column(run.table.column_names.index(name), name, force), {})
    return run


def designed(offset=0.0, growth=0.0, size=1e-3, rate=1.0, **variables) -> Result:
    """A run on the design model: x1 falls by exp(-rate t) without z; the weights are off by offset + growth t."""
    run = made(**variables)
    t, table = run.time, run.table
    fall = size * np.exp(-rate * t)
    for position, speed in lyapunov.LOOPS.values():
        for axis in (1, 2, 3):
            table = table.append_column(f"plant.{speed}[{axis}]", pa.array(-fall))
            if position != "r_rel":
                table = table.append_column(f"plant.{position}[{axis}]", pa.array(fall))
            else:
                at = table.column_names.index(f"plant.r_rel[{axis}]")
                table = table.set_column(at, f"plant.r_rel[{axis}]", pa.array(run["plant.r_rel"][:, axis - 1] + fall))
    for i, W in enumerate(design.true_weights()):
        for place, weight in np.ndenumerate(W):
            name = f"controller.W_{i + 1}[{place[0] + 1},{place[1] + 1}]"
            table = table.append_column(name, pa.array(weight + offset + growth * t))
    return Result(table, {})


LEARNING = ("DESIGN", "DESIGN_PRINTED", "DESIGN_GAMMA", "NN", "GAMMA_10")


@cache
def quiet() -> dict[str, Result]:
    """Runs in which every claim holds but that on thrusters."""
    near, far, on_model = made(plant__r_rel=1e-9), made(plant__r_rel=1e-6), designed(plant__r_rel=1e-9)
    runs = dict.fromkeys((system.NN, system.GAMMA_10, system.PRINTED), near)
    runs |= dict.fromkeys((system.DESIGN, system.DESIGN_PRINTED, system.DESIGN_GAMMA), on_model)
    runs |= dict.fromkeys((system.NO_NN, system.DESIGN_NO_NN), far)
    runs |= {system.CONSISTENT: made(), system.DESIGN_CONSISTENT: made()}
    runs |= {system.NN_SPECTRUM: noisy(1e-15), system.NO_NN_SPECTRUM: noisy(1e-13), system.ACTUATORS: noisy(1e-15)}
    return runs | {system.PRINTED_START: made()}


def verdicts(**changes):
    runs = quiet() | {getattr(system, name): run for name, run in changes.items()}
    return [v.verdict for v in judge(papers.PAPERS["li2014"].claims, runs)]


def turned(angle):
    """Quaternions of a small turn about x, a row of them."""
    return np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])


def all_learning(run):
    return dict.fromkeys(LEARNING, run)


def on_design_model(run):
    return dict.fromkeys(("DESIGN", "DESIGN_PRINTED", "DESIGN_GAMMA"), run)


OFF, HALF_OFF = (dict(plant__q_TS=turned(2e-6), plant__q_SN=turned(angle)) for angle in (2e-6, 0.0))
CASES = {  # claim -> verdict -> what brings it about
    0: {
        "reproduced": {},
        "in one reading": dict(NN=made(plant__r_rel=2e-6), GAMMA_10=made(plant__r_rel=2e-6)),
        "not reproduced": all_learning(made(plant__r_rel=2e-6)),
    },
    1: {
        "reproduced": {},
        "in one reading": dict(DESIGN_PRINTED=made(**OFF)),
        "partly": all_learning(made(**HALF_OFF)),
        "not reproduced": all_learning(made(**OFF)),
    },
    2: {
        "reproduced": {},
        "in one reading": dict(NO_NN=made(plant__r_rel=2e-9)),
        "partly": dict(NO_NN=made(plant__r_rel=2e-9), DESIGN_NO_NN=made(plant__r_rel=2e-9)),
        "not reproduced": dict(
            NO_NN_SPECTRUM=noisy(1e-15), NO_NN=made(plant__r_rel=1e-9), DESIGN_NO_NN=made(plant__r_rel=1e-9)
        ),
    },
    3: {
        "reproduced": {},
        "in one reading": dict(DESIGN=designed(offset=1e-3)),  # V stays where the weights are off
        "partly": on_design_model(designed(offset=1e-3)),
        "not reproduced": on_design_model(designed(growth=1e-3, rate=0.0)),
    },
    4: {
        "reproduced": dict(NN=made(controller__f_command_S=0.01)),
        "partly": {},  # the command is too large, yet the test mass stays free
        "not reproduced": dict(PRINTED_START=made(caught=41.0)),
    },
    5: {
        "reproduced": {},
        "partly": dict(ACTUATORS=noisy(1e-12)),
        "not reproduced": dict(ACTUATORS=noisy(1e-12, 1e-6), NN_SPECTRUM=noisy(1e-12, 1e-6)),
    },
    6: {
        "reproduced": {},
        "in one reading": dict(PRINTED=made(**OFF)),
        "not reproduced": dict(PRINTED=made(**OFF), DESIGN_PRINTED=made(**OFF)),
    },
    7: {
        "reproduced": {},
        "partly": dict(NN=made(**OFF), CONSISTENT=made(plant__q_TS=turned(1e-6)), DESIGN_CONSISTENT=made(**OFF)),
        "not reproduced": dict(
            CONSISTENT=made(**OFF), DESIGN_CONSISTENT=made(**OFF), NN=made(plant__q_TS=turned(1e-9))
        ),
    },
}


@pytest.mark.parametrize(("number", "verdict"), [(n, verdict) for n, cases in CASES.items() for verdict in cases])
def test_each_claim_can_come_out_each_way(number, verdict):
    assert verdicts(**CASES[number][verdict])[number] == verdict


def test_what_is_ours_stands_apart():
    """Thrusters whose limits are ours, requirements, signs and a feed-forward that are not printed."""
    claims = papers.PAPERS["li2014"].claims
    assert [claim.beyond for claim in claims] == [False] * 4 + [True] * 4
    assert all(claim.depends for claim in claims)


def test_every_claim_has_a_case():
    assert len(CASES) == len(papers.PAPERS["li2014"].claims)


def test_a_short_run_is_not_judged():
    assert verdicts(NN=made(100.0))[0] == "not judged"


def test_the_requirement_of_lisa_pathfinder_rises_with_the_square_of_the_frequency():
    """ESA: 3e-14 m/s2/sqrt(Hz), rising with frequency squared above 3 mHz: twice that at 3 mHz, 101 times at 30 mHz."""
    np.testing.assert_allclose(spectrum.lisa_pathfinder(np.array([0.0, 3e-3, 30e-3])), [3e-14, 6e-14, 101 * 3e-14])
    f = np.array([0.0, 5e-3, 30e-3, 0.1])
    values = np.outer([1.0, 3e-14, 101 * 6e-14, 1.0], [1.0, 0, 0])
    assert spectrum.above_lisa_pathfinder((f, values)) == pytest.approx(2.0)  # inside its band only


def test_metrics_of_a_drag_free_satellite():
    law = [f"controller.f_command_S[{i}]" for i in (1, 2, 3)]  # without run.json what shows it is taken for a plant
    run, caught = (Result(flown.table.drop_columns(law), {}) for flown in (made(), made(caught=41.0)))
    found = metrics.measure(run)
    assert found["APE max (deg)"] == 0 and found["test mass at its cage (s)"] is None
    assert metrics.measure(caught)["test mass at its cage (s)"] == 41.0
    assert spectrum.contact(caught) == 41.0 and spectrum.contact(run) is None
    json.dumps(metrics.measure(caught))
