"""xiao2011: its systems, claims on made-up runs, figures."""

import numpy as np
import pyarrow as pa
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from components.catalog import CATALOG
from cosim.results.result import Result
from cosim.studies import papers, plots
from cosim.studies.papers.claims import Claim
from cosim.studies.papers.xiao2011 import gain, storage, system, tracking
from cosim.system.expand import wire
from fmus.export.python.in_process import describe_in_process

from ..figures import OF_ANY_RUN, cut_off
from . import xiao2011_reference as outside

NAMES = list(papers.PAPERS["xiao2011"].experiments)
RIGID = (system.SHAKEN, system.OVERLOADED)
T = np.linspace(0.0, 600.0, 6001)
SIGNS = np.array([1.0, -1.0, 1.0])


def table(time, parameters=None, **variables) -> Result:
    columns = {"time": time}
    for name, rows in variables.items():
        columns |= {f"{name.replace('__', '.')}[{i + 1}]": rows[:, i] for i in range(rows.shape[1])}
    return Result(pa.table(columns), {"parameters": {n: {"value": v} for n, v in (parameters or {}).items()}})


def quaternions(theta) -> np.ndarray:
    return Rotation.from_euler("ZYX", theta[:, ::-1]).as_quat(scalar_first=True)


def synthetic(settles=80.0, quiet=50.0, torque=0.2, raw=10.0, k=5.0, gain=0.1, time=T) -> Result:
    """A run whose angles and modes fall to 5 % of their starts at the times given, in an orbit frame that turns.

    They fall evenly, so that they are within 0.1 % soon after.
    """
    falls = [np.clip(1 - 0.95 * time / max(end, 1e-9), 0, None)[:, None] for end in (settles, quiet)]
    theta, still = 0.01 * SIGNS * falls[0], np.ones((len(time), 3))
    turn = Rotation.from_rotvec(-system.ORBIT_RATE * time[:, None] * [0, 1, 0])
    body = turn * Rotation.from_quat(quaternions(theta), scalar_first=True)
    return table(
        time,
        {"controller.k_theta": k, "controller.p1": 10.0},
        plant__q_BN=body.as_quat(scalar_first=True),
        plant__omega_BN_B=body.inv().apply([0, -system.ORBIT_RATE, 0]),
        guidance__q_RN=turn.as_quat(scalar_first=True),
        guidance__omega_RN_R=np.tile([0, -system.ORBIT_RATE, 0], (len(time), 1)),
        plant__eta=1e-3 * falls[1] * np.cos(time)[:, None] * still,
        actuators__tau_B=torque * np.cos(time)[:, None] * still,
        controller__u=raw * still,
        controller__theta=theta,
        controller__z2=np.sqrt(np.maximum(gain**2 - theta**2, 0)),  # |y| = gain |d|, d = 1 rad/s^2
        controller__e1=0 * still,
        controller__f_hat=0 * still,
        plant__tau_dist_B=np.array(system.INERTIA) * still,
        guidance__y_d=0 * still,
    )


# The systems


@pytest.mark.parametrize("name", NAMES)
def test_the_system_fits_its_components(name):
    """All inputs fed, every parameter known, every unit convertible: nothing is left to complain about."""
    flight, experiment = papers.scenario(name)
    assert flight.name == name
    assert set(flight.components) == {"guidance", "environment", "controller", "actuators", "plant"}
    assert experiment.communication_step_size == (2e-4 if name == system.SHAKEN else 1e-3)
    settings = settings_of(flight)
    limit = 1e9 if name.endswith(("unconstrained", "shaken")) else 0.2
    for port in ("controller.torque_limit[2]", "actuators.torque_limit[2]"):
        assert settings[port] == limit
    assert settings["plant.J[2,2]"] == settings.get("controller.J[2,2]", 1000.0) == 1000.0
    assert name in RIGID or settings["plant.delta[3,3]"] == -21.0


def settings_of(flight):
    descriptions = {}
    for instance, reference in flight.components.items():
        kind, _, structure = reference.partition(":")
        part = CATALOG[kind]()
        part = part.variant(modes=int(structure[-1])) if structure else part
        descriptions[instance] = describe_in_process(part)
    return {str(port): value for port, value in wire(flight, descriptions).settings.items()}


@pytest.mark.parametrize("size", [4.4, 22.0])
def test_initial_attitude_is_at_rest_in_the_orbit_frame(size):
    q, omega = system.initial_attitude(size)
    start = outside.start(size)
    theta = Rotation.from_quat(q, scalar_first=True).as_euler("ZYX")[::-1]
    assert_allclose(theta, start[:3], atol=1e-15)
    assert_allclose(omega, start[3:6], atol=1e-17)
    printed = {4.4: [0.21008452, -0.25210143, 0.16806762], 22.0: [1.05042262, -1.26050715, 0.8403381]}
    assert_allclose(np.degrees(theta), printed[size], atol=1e-7)
    omega_S = [-3.1620981892444646e-06, -0.0010779880646761102, 3.966554032863072e-06]  # parameters.json
    assert size == 22.0 or np.abs(omega - omega_S).max() < 1e-17


def test_disturbance_is_that_of_the_file():
    flight = papers.scenario("xiao2011-pid")[0].parameters
    p = {n.split(".")[1]: np.array(v.value) for n, v in flight.items() if n.startswith("environment")}
    for t in (0.0, 123.4):
        torque = p["bias"] + p["sine"] * np.sin(p["frequency"] * t) + p["cosine"] * np.cos(p["frequency"] * t)
        assert_allclose(torque, outside.disturbance(t), atol=1e-18)


def test_experiments_differ_in_what_their_names_say():
    p = {name: papers.scenario(name)[0].parameters for name in NAMES}
    stop = {name.removeprefix("xiao2011-"): papers.scenario(name)[1].stop_time for name in NAMES}
    assert stop == {
        "l2gain": 400,
        "l2gain-large": 600,
        "l2gain-large-k5": 600,
        "l2gain-printed": 400,
        "l2gain-unconstrained": 100,
        "l2gain-tracking": 600,
        "l2gain-tracking-no-feedforward": 600,
        "l2gain-shaken": 12,
        "l2gain-overloaded": 60,
        "pid": 400,
        "pid-large": 400,
        "pid-antiwindup": 400,
    }
    start = {"plant.q_BN", "plant.omega_BN_B"}

    def changed(a, b):
        first, second = p[f"xiao2011-{a}"], p[f"xiao2011-{b}"]
        return {n for n in first if n in second and str(first[n]) != str(second[n])}

    assert changed("l2gain", "l2gain-large") == start | {"controller.k_theta"}
    assert changed("l2gain", "l2gain-large-k5") == start
    assert changed("l2gain", "l2gain-printed") == {"controller.normalised"}
    assert changed("l2gain-tracking", "l2gain-tracking-no-feedforward") == {"controller.feedforward"}
    assert not {n for n in changed("l2gain", "l2gain-tracking") & set(p["xiao2011-l2gain-tracking"]) if "plant" in n}
    assert changed("pid", "pid-large") == start
    assert changed("pid-large", "pid-antiwindup") == {"controller.conditional"}


# Angles


def test_angles_and_rates_are_relative_to_the_orbit_frame():
    run = synthetic(settles=40.0)
    theta = tracking.angles(run)
    assert_allclose(theta[0], 0.01 * SIGNS, atol=1e-15)
    assert_allclose(tracking.settling(run, 0.05), 40.0, atol=0.1)
    assert_allclose(tracking.rates(run), 0, atol=1e-18)


def test_what_never_settles_is_infinite():
    assert np.isinf(tracking.settling(synthetic(settles=1e9), 0.05)).all()


# Claims: each comes out either way, by its runs alone

S, L, K5, PRINTED = "xiao2011-l2gain", "xiao2011-l2gain-large", "xiao2011-l2gain-large-k5", "xiao2011-l2gain-printed"
FREE, PID, PID_L = "xiao2011-l2gain-unconstrained", "xiao2011-pid", "xiao2011-pid-large"
SHAKEN, LOADED = system.SHAKEN, system.OVERLOADED
TRACKING, WITHOUT = "xiao2011-l2gain-tracking", "xiao2011-l2gain-tracking-no-feedforward"
LAWS, PIDS = (PRINTED, S, K5), (PID, PID_L)


def all_of(names, **run):
    return {name: run for name in names}


CASES = {
    "L2-gain: attitude settles in about 80 s": (all_of(LAWS), all_of(LAWS, settles=97)),
    "L2-gain: the torque keeps": (all_of((S, K5)), all_of((S, K5), torque=0.21)),
    "L2-gain: vibration gone after": (all_of((S, K5)), all_of((S, K5), quiet=100)),
    "PID: attitude": (all_of(PIDS, settles=200), all_of(PIDS, settles=300)),
    "PID: vibration": (all_of(PIDS, quiet=300), all_of(PIDS, quiet=100)),
    "L2-gain settles faster": (
        all_of(LAWS) | all_of(PIDS, settles=81),
        all_of(LAWS) | all_of(PIDS, settles=79),
    ),
    "L2-gain: vibration gone faster": (
        all_of((S, K5)) | all_of(PIDS, quiet=60),
        all_of((S, K5)) | all_of(PIDS, quiet=40),
    ),
    "Theorem 1": ({FREE: dict(settles=5), SHAKEN: {}}, {FREE: dict(settles=900), SHAKEN: dict(gain=0.21)}),
    "Theorem 2": (
        {S: {}, SHAKEN: {}, LOADED: {}},
        {S: {}, SHAKEN: dict(gain=0.21), LOADED: dict(gain=100.0)},
    ),
    "L2-gain with a smaller k": (
        {L: {}, PID_L: dict(settles=200, quiet=300)},
        {L: dict(settles=300, quiet=400), PID_L: dict(settles=200, quiet=300)},
    ),
    "L2-gain tracks": (
        {TRACKING: dict(settles=30), WITHOUT: dict(settles=1e9)},
        {TRACKING: dict(settles=1e9), WITHOUT: dict(settles=30)},
    ),
}


def claim(start: str) -> Claim:
    (found,) = [c for c in papers.PAPERS["xiao2011"].claims if c.text.startswith(start)]
    return found


@pytest.mark.parametrize("start", CASES)
def test_each_claim_can_come_out_either_way(start):
    good, bad = ({name: synthetic(**run) for name, run in runs.items()} for runs in CASES[start])
    holds, fails = claim(start).judge(good), claim(start).judge(bad)
    assert holds.verdict == "reproduced", holds
    assert fails.verdict == "not reproduced", fails
    assert holds.measured != fails.measured


def test_the_gain_of_a_run_is_that_of_its_rows():
    assert_allclose(gain.flown(synthetic(gain=0.3)), 0.3, rtol=1e-12)
    assert_allclose(gain.flown(synthetic(gain=0.3), 100.0), 0.3, rtol=1e-12)


def test_half_a_theorem_is_partly():
    runs = {S: synthetic(), SHAKEN: synthetic(), LOADED: synthetic(gain=100.0)}
    verdict = claim("Theorem 2").judge(runs)
    assert (verdict.verdict, verdict.failing) == ("partly", "saturated, V(t) saturated")


def test_a_storage_function_above_its_bound_fails_though_the_gain_is_small():
    """V starts small and is driven by the weights; the bound grows by gamma^2 d^2 - |y|^2 only."""
    run = synthetic(gain=0.1)
    f_hat = np.linspace(0, 3000, len(T))[:, None] * np.ones(3)
    columns = {f"controller.f_hat[{i + 1}]": f_hat[:, i] for i in range(3)}
    kept = run.table.drop(list(columns))
    for name, rows in columns.items():
        kept = kept.append_column(name, pa.array(rows))
    assert storage.excess(run) == 0
    weighed = Result(kept, run.info)
    theta, z2 = run["controller.theta"], run["controller.z2"]
    X = np.exp(-np.sum(theta**2 + (z2 - 5.5 * theta) ** 2, axis=1) / 1.5**2)
    weights = 3 * f_hat[:, 0] ** 2 / (2 * 100 * 5 * X**2)
    assert_allclose(storage.storage(weighed) - storage.storage(run), weights, rtol=1e-12)
    runs = {FREE: synthetic(settles=5), SHAKEN: weighed}
    assert claim("Theorem 1").judge(runs).failing == "V(t)"


def test_what_settles_is_the_error_of_angles_that_move():
    wanted = 0.05 * np.sin(0.02 * T)[:, None] * SIGNS
    still = np.tile([1.0, 0, 0, 0], (len(T), 1))
    run = table(
        T,
        plant__q_BN=quaternions(wanted + 0.01 * np.exp(-T)[:, None] * SIGNS),
        guidance__q_RN=quaternions(wanted),
        guidance__q_ON=still,
        guidance__y_d=wanted,
    )
    assert_allclose(tracking.deviation(run), 0.01 * np.exp(-T)[:, None] * SIGNS, atol=1e-12)
    assert_allclose(tracking.settling(run, 0.05), np.log(20), atol=0.1)


def test_one_reading_in_which_it_holds_is_named():
    runs = {PRINTED: dict(settles=1e9), S: {}, K5: {}, PID: dict(settles=20), PID_L: dict(settles=200)}
    verdict = claim("L2-gain settles faster").judge({name: synthetic(**run) for name, run in runs.items()})
    assert verdict.word == "in 2 readings (L at 5 %, L at 0.1 %)"
    assert verdict.readings["S as printed at 5 %"] == {"faster": False}


def test_what_no_paper_claims_stands_apart_and_every_row_says_what_it_depends_on():
    claims = papers.PAPERS["xiao2011"].claims
    assert [c.text for c in claims if c.beyond] == [
        "L2-gain with a smaller k, case L",
        "L2-gain tracks angles that move",
    ]
    assert all(c.depends for c in claims)
    chosen = [c for c in claims if L in c.runs]  # k = 0.2 is ours
    assert [c.beyond for c in chosen] == [True]


def test_every_claim_has_a_case():
    assert len(CASES) == len(papers.PAPERS["xiao2011"].claims)


def test_a_claim_needs_its_whole_run():
    verdict = claim("PID: attitude").judge({PID_L: synthetic(time=T[T <= 50]), PID: synthetic()})
    assert (verdict.verdict, verdict.measured) == ("not judged", "needs 400 s of xiao2011-pid-large, it has 50 s")


# Figures


def test_figures_are_those_of_the_paper(tmp_path):
    drawn = papers.PAPERS["xiao2011"].draw({name: synthetic(time=T[:600]) for name in NAMES})
    assert list(drawn) == [
        *(
            f"{name}_{case}"
            for case in "SL"
            for name in (
                "fig01_fig05_angles",
                "fig02_fig06_rates",
                "fig03_fig07_torque",
                "fig04_fig08_modes",
                "raw_command",
            )
        ),
        "scale_of_the_weights",
        "moving_angles",
        "storage_function",
    ]
    assert not drawn.keys() & OF_ANY_RUN
    for name, figure in drawn.items():
        assert cut_off(figure) == [], name
        assert all(ax.lines for ax in figure.axes), name
        assert figure.legends or "modes" in name, name
    legend = [text.get_text() for text in drawn["fig01_fig05_angles_L"].legends[0].texts]
    assert legend[:4] == ["L2-gain, k = 0.2", "L2-gain, k = 5", "PID", "PID, conditional integration"]
    assert {"5 % of the start", "L2-gain, paper: 80 s", "PID, paper: 200 s"} <= set(legend)
    torque = [text.get_text() for text in drawn["fig03_fig07_torque_S"].legends[0].texts]
    assert torque == ["asked", "given", "limit"]
    assert all(file.is_file() for file in plots.save(drawn, tmp_path))


def test_figures_of_one_run():
    for name in ("xiao2011-l2gain-printed", "xiao2011-l2gain-tracking-no-feedforward"):  # the longest names
        for figure in papers.draw_run(name, synthetic(time=T[:600])).values():
            assert cut_off(figure) == [], name
    drawn = papers.draw_run("xiao2011-pid", synthetic(time=T[:600]))
    assert {"fig01_fig05_angles_S", "fig03_fig07_torque_S", "attitude_error"} <= set(drawn)
    assert not any(name.endswith("_L") for name in drawn)
