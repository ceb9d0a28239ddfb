import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from components.catalog import CATALOG
from cosim import Explicit, Iterated
from cosim.errors import UnknownName
from cosim.results.result import Result
from cosim.studies import papers, plots
from cosim.studies.papers.claims import Claim, Measured, judge
from cosim.studies.papers.zhang2018 import system, tracking
from cosim.system import Value
from cosim.system.expand import wire
from fmus.export.python.in_process import describe_in_process

from ..figures import OF_ANY_RUN, cut_off
from . import zhang2018_reference as outside

PPATC, ATC, PPATC_HALF, ATC_HALF = "zhang2018-ppatc", "zhang2018-atc", "zhang2018-ppatc-half", "zhang2018-atc-half"
KINDS = {PPATC: ("ppatc", 1.0), ATC: ("atc", 1.0), PPATC_HALF: ("ppatc", 0.5), ATC_HALF: ("atc", 0.5)}
NAMES = [*KINDS, *(f"{name}-rad" for name in KINDS)]
T = np.linspace(0.0, 200.0, 4001)
OMEGA_1 = 2 * np.pi * 0.379


def table(time, **variables) -> Result:
    columns = {"time": time}
    for name, rows in variables.items():
        columns |= {f"{name.replace('__', '.')}[{i + 1}]": rows[:, i] for i in range(rows.shape[1])}
    return Result(pa.table(columns), {})


def synthetic(e, eta=None, eta_dot=None, time=T) -> Result:
    """A run whose Euler angles are off those of the reference by e (deg), with the modes given."""
    theta_d = outside.DEG * np.array([outside.desired(t)[0] for t in time])
    still = np.zeros((len(time), 8))
    return table(
        time,
        plant__q_BN=outside.quaternion(theta_d + outside.DEG * e),
        guidance__q_RN=outside.quaternion(theta_d),
        plant__eta=still if eta is None else eta,
        plant__eta_dot=still if eta_dot is None else eta_dot,
        controller__tau_command_B=np.cos(time)[:, None] * [0.1, 0.2, 0.3],
        plant__omega_BN_B=1e-3 * np.sin(time)[:, None] * [1, 2, 3],
    )


def decaying(bias=0.0025, rate=0.2, time=T) -> np.ndarray:
    """A smooth error on the side it starts from: within the paper's bounds if it falls fast enough."""
    return (0.2 * np.exp(-rate * time) + bias)[:, None] * [1, 1, -1]


def swinging(amplitude, period=20.0, damping=0.0) -> np.ndarray:
    wave = amplitude * np.cos(2 * np.pi * T / period) * np.exp(-damping * T)
    return wave[:, None] * [1, 1, -1]


def vibrating(amplitude, damping) -> dict[str, np.ndarray]:
    eta, eta_dot = np.zeros((len(T), 8)), np.zeros((len(T), 8))
    fall = amplitude * np.exp(-damping * T)
    eta[:, 0], eta_dot[:, 0] = fall * np.sin(OMEGA_1 * T), fall * OMEGA_1 * np.cos(OMEGA_1 * T)
    return {"eta": eta, "eta_dot": eta_dot}


# The system


@pytest.mark.parametrize("name", NAMES)
def test_the_system_is_complete(name):
    flight, experiment = papers.scenario(name)
    assert flight.name == name
    assert set(flight.components) == {"guidance", "environment", "controller", "plant"}
    stiff = name in (f"{PPATC}-rad", f"{PPATC_HALF}-rad")
    step, every = (5e-4, 20) if stiff else (1e-3, 10)
    assert (experiment.stop_time, experiment.communication_step_size, experiment.every) == (200.0, step, every)
    fed = [c.target for c in flight.connections] + list(flight.held)
    controller = ["q_BN", "omega_BN_B", "q_RN", "omega_RN_R", "omega_dot_RN_R"]
    assert sorted(fed) == sorted(
        [f"controller.{n}" for n in controller] + [f"plant.{n}" for n in ("tau_B", "h_B", "tau_dist_B")]
    )
    timings = {c.target: c.timing for c in flight.connections}
    assert all(timings[f"controller.{n}"] == "smooth" for n in controller)
    assert timings["plant.tau_B"] == "at_point" and timings["plant.tau_dist_B"] == "smooth"
    assert isinstance(experiment.master, Iterated if stiff else Explicit)
    assert {p.split(".")[0] for p in flight.parameters} <= {"*", *flight.components}
    assert flight.parameters["*.solver.step"] == Value(1e-3, "s")


@pytest.mark.parametrize("name", NAMES)
def test_the_system_fits_its_components(name):
    """All inputs fed, every parameter known, every unit convertible: nothing is left to complain about."""
    flight, _ = papers.scenario(name)
    descriptions = {
        instance: describe_in_process(CATALOG[reference]()) for instance, reference in flight.components.items()
    }
    settings = {str(port): value for port, value in wire(flight, descriptions).settings.items()}
    assert settings["controller.angle_unit"] == pytest.approx(1.0 if name.endswith("-rad") else np.pi / 180)
    assert settings["controller.hold_step"] == 0
    assert settings["guidance.amplitude[2]"] == pytest.approx(np.pi / 180)
    assert settings["plant.delta[6,3]"] == 2.73
    assert settings["controller.J[2,3]"] == settings["plant.J[2,3]"] == 9.4


def test_vehicle():
    vehicle = papers.scenario(PPATC)[0].vehicle
    values = {name: np.array(v.value if isinstance(v, Value) else v) for name, v in vehicle.items()}
    np.testing.assert_array_equal(values["J"], outside.HUB)
    np.testing.assert_array_equal(values["delta"], outside.BOTH.T)
    np.testing.assert_allclose(values["Omega"], outside.OMEGA, rtol=1e-15)
    np.testing.assert_array_equal(values["zeta"], np.full(8, 0.005))


def test_half_gains():
    full, half = papers.scenario(PPATC)[0].parameters, papers.scenario(PPATC_HALF)[0].parameters
    changed = {name for name in full if full[name] != half[name]}
    assert changed == {"controller.K", "controller.tau_w", "controller.tau_mu"}
    assert half["controller.K"] == [0.25, 0.05, 0.25]
    assert (half["controller.tau_w"], half["controller.tau_mu"]) == (0.25, 0.25)


@pytest.mark.parametrize("name", KINDS)
def test_the_other_reading_has_another_unit_of_angle_and_nothing_else(name):
    degrees, radians = papers.scenario(name)[0], papers.scenario(f"{name}-rad")[0]
    assert {n for n in degrees.parameters if degrees.parameters[n] != radians.parameters[n]} == {
        "controller.angle_unit"
    }
    assert dataclasses.replace(radians, name=name, parameters=degrees.parameters) == degrees


def test_atc_has_the_same_gains_and_no_performance_bounds():
    ppatc, atc = papers.scenario(PPATC)[0].parameters, papers.scenario(ATC)[0].parameters
    extra = {f"controller.{name}" for name in ("rho_0", "rho_inf", "k", "overshoot")}
    assert set(ppatc) - set(atc) == extra
    assert all(atc[name] == ppatc[name] for name in atc)


def test_initial_attitude_is_the_product_of_three_rotations():
    q, _ = system.initial_attitude()
    phi, th, psi = np.radians([0.25, 0.15, -0.20])
    x = np.array([[1, 0, 0], [0, np.cos(phi), np.sin(phi)], [0, -np.sin(phi), np.cos(phi)]])
    y = np.array([[np.cos(th), 0, -np.sin(th)], [0, 1, 0], [np.sin(th), 0, np.cos(th)]])
    z = np.array([[np.cos(psi), np.sin(psi), 0], [-np.sin(psi), np.cos(psi), 0], [0, 0, 1]])
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    dcm_BN = (w**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) - 2 * w * skew  # v_B = dcm_BN v_N
    np.testing.assert_allclose(dcm_BN, z @ y @ x, atol=1e-15)
    assert w > 0


def test_euler_rates_are_those_of_the_turning_body():
    """Equation (3) at a large attitude: angles of a body that turns with omega change with theta'."""
    theta, theta_dot, h = np.array([0.4, -0.7, 1.1]), np.array([0.3, 0.2, -0.5]), 1e-6
    omega = outside.euler_kinematics(theta, theta_dot)[0] @ theta_dot
    q = outside.quaternion(np.array([theta - h * theta_dot, theta, theta + h * theta_dot]))
    rate = (q[2] - q[0]) / (2 * h)
    w, v = q[1][0], q[1][1:]
    product = w * rate[1:] - rate[0] * v - np.cross(v, rate[1:])  # q* (x) q', vector part
    np.testing.assert_allclose(2 * product, omega, atol=1e-9)
    np.testing.assert_allclose(tracking.angles(q[1:2])[0], np.degrees(theta), atol=1e-10)


def test_initial_rate_is_that_of_the_paper():
    q, omega = system.initial_attitude()
    F_inverse, _ = outside.euler_kinematics(np.radians(tracking.angles(q[None]))[0], np.zeros(3))
    np.testing.assert_allclose(np.degrees(np.linalg.solve(F_inverse, omega)), [0.02, 0.01, -0.02], atol=1e-14)


def test_disturbance_and_reference_are_those_of_the_paper():
    p = {
        name.split(".", 1)[1]: v.value
        for name, v in papers.scenario(PPATC)[0].parameters.items()
        if name.startswith("env")
    }
    for t in (0.0, 123.4):
        angle = p["frequency"] * t
        torque = np.array(p["bias"]) + np.array(p["sine"]) * np.sin(angle) + np.array(p["cosine"]) * np.cos(angle)
        np.testing.assert_allclose(torque, outside.disturbance(t), atol=1e-17)


# Registry


def test_registry():
    assert [name for name in papers.describe() if name.startswith("zhang2018-")] == NAMES
    assert all(paper.title and paper.settled for paper in papers.PAPERS.values())
    assert all(papers.describe().values())


def test_unknown_names_are_answered_with_the_nearest():
    with pytest.raises(UnknownName, match='Did you mean "zhang2018-ppatc"'):
        papers.scenario("zhang2018-ppact")
    with pytest.raises(UnknownName, match=r'unknown paper "zhang2019".*"zhang2018"'):
        papers.find("zhang2019")
    with pytest.raises(UnknownName, match='Did you mean "zhang2018-atc-half-rad"'):
        papers.scenario("zhang2018-atc-half-grad")
    with pytest.raises(UnknownName, match=r'unknown reading "radian".*Did you mean "radians"\? .*degrees, radians'):
        system.read("radian")


# Claims


CASES = {
    "PPATC: steady": ({PPATC: decaying(0.0049)}, {PPATC: decaying(0.0051)}),
    "PPATC: error within": ({PPATC: decaying()}, {PPATC: -decaying() + decaying()[0] * 2 * np.exp(-T[:, None])}),
    "PPATC settles": (
        {PPATC: decaying(rate=0.2), ATC: decaying(rate=0.1)},
        {PPATC: decaying(rate=0.1), ATC: decaying(rate=0.2)},
    ),
    "ATC misses": ({ATC: decaying(0.006)}, {ATC: decaying(0.004)}),
    "ATC: error visibly": ({ATC: swinging(0.2, damping=0.02)}, {ATC: decaying()}),
    "half gains: PPATC": (
        {PPATC: decaying(rate=0.2), PPATC_HALF: decaying(rate=0.203)},
        {PPATC: decaying(), PPATC_HALF: swinging(0.2)},
    ),
    "half gains: ATC": (
        {ATC: swinging(0.1, damping=0.02), ATC_HALF: swinging(0.2, damping=0.02)},
        {ATC: swinging(0.2, damping=0.02), ATC_HALF: swinging(0.1, damping=0.02)},
    ),
}


def claim(start: str) -> Claim:
    (found,) = [c for c in papers.PAPERS["zhang2018"].claims if c.text.startswith(start)]
    return found


def in_radians(runs):
    return {f"{name}-rad": run for name, run in runs.items()}


def in_both(runs):
    return runs | in_radians(runs)


@pytest.mark.parametrize("start", CASES)
def test_each_claim_can_come_out_either_way(start):
    good, bad = ({name: synthetic(e) for name, e in runs.items()} for runs in CASES[start])
    holds, fails = claim(start).judge(in_both(good)), claim(start).judge(in_both(bad))
    assert holds.verdict == "reproduced", holds
    assert fails.verdict == "not reproduced", fails
    assert holds.measured != fails.measured
    for first, second, reading in ((good, bad, "degrees"), (bad, good, "radians")):
        one = claim(start).judge(first | in_radians(second))
        assert one.word == f"in one reading ({reading})", one
        assert all(good is part.startswith(reading) for part, good in one.holds.items())


def test_every_row_says_what_it_depends_on():
    assert all("unit of angle" in c.depends for c in papers.PAPERS["zhang2018"].claims)


def test_vibration_can_be_suppressed_or_not():
    own = 0.005 * OMEGA_1
    error = decaying()
    weak = synthetic(error, **vibrating(1e-4, own))
    damped = synthetic(error, **vibrating(1e-4, 3 * own))
    driven = synthetic(error, **vibrating(1e-2, 0.0))
    suppressed = claim("PPATC suppresses")
    assert suppressed.judge(in_both({PPATC: damped, ATC: weak})).verdict == "reproduced"
    assert suppressed.judge(in_both({PPATC: weak, ATC: weak})).verdict == "partly"
    assert suppressed.judge(in_both({PPATC: driven, ATC: weak})).verdict == "not reproduced"


def test_every_claim_has_a_case():
    assert len(CASES) + 1 == len(papers.PAPERS["zhang2018"].claims) == 8


def test_one_axis_alone_makes_it_partly():
    e = decaying(0.004)
    e[:, 1] += 0.004
    verdict = claim("PPATC: steady").judge(in_both({PPATC: synthetic(e)}))
    assert verdict.verdict == "partly"
    assert verdict.readings["radians"] == {"roll": True, "pitch": False, "yaw": True}
    assert verdict.failing == "degrees: pitch; radians: pitch"


def test_a_claim_without_its_runs_is_not_judged():
    verdict = claim("PPATC settles").judge({PPATC: synthetic(decaying())})
    missing = "needs zhang2018-atc, zhang2018-ppatc-rad, zhang2018-atc-rad"
    assert (verdict.verdict, verdict.measured) == ("not judged", missing)


def test_a_run_that_ended_early_is_not_judged():
    short = T[T <= 50]
    verdict = claim("PPATC: steady").judge(in_both({PPATC: synthetic(decaying(time=short), time=short)}))
    assert (verdict.verdict, verdict.measured) == ("not judged", "needs 200 s of zhang2018-ppatc, it has 50 s")


def test_a_variable_that_was_not_recorded_is_named():
    table_ = synthetic(decaying()).table
    left = Result(table_.select([n for n in table_.column_names if not n.startswith("guidance")]), {})
    verdict = claim("PPATC: steady").judge(in_both({PPATC: left}))
    assert verdict.verdict == "not judged" and '"guidance.q_RN"' in verdict.measured


def finished(result: Result) -> Result:
    return Result(result.table, {"status": "finished"})


def test_one_run_is_judged_by_the_claims_it_decides_alone():
    result = synthetic(decaying())
    assert [v.claim for v in papers.judge_run(PPATC, result)] == [c.text for c in papers.PAPERS["zhang2018"].claims[:2]]
    (steady, _) = papers.judge_run(f"{PPATC}-rad", result)
    assert (steady.verdict, list(steady.readings)) == ("reproduced", ["radians"])
    assert papers.explain_open(PPATC, finished(result)).startswith("3 more claims of zhang2018")
    assert papers.judge_run("my_system", result) == []
    result.info["swaps"] = [{"instance": "controller"}]
    assert papers.judge_run(PPATC, result) == []


def test_verdicts_are_not_written_down():
    """A claim holds no verdict: the same claim gives another one for other runs, and a measure decides."""
    changed = dataclasses.replace(claim("PPATC: steady"), measure=lambda runs: Measured("nothing", {"part": False}))
    assert judge([changed], in_both({PPATC: synthetic(decaying())}))[0].verdict == "not reproduced"


# Figures


def title_of(figure) -> str:
    return figure.get_suptitle() or figure.axes[0].get_title()


def test_figures_are_those_of_the_paper():
    runs = {
        name: synthetic(decaying(rate=r), **vibrating(1e-4, 0.01))
        for name, r in zip(KINDS, (0.2, 0.1, 0.21, 0.09), strict=True)
    }
    drawn = papers.PAPERS["zhang2018"].draw(runs)
    assert [name.split("_")[0] for name in drawn] == ["fig02-04", "fig05", "fig06", "fig07", "fig08", "fig09-11"]
    other = papers.PAPERS["zhang2018"].draw(in_radians(runs))
    assert list(other) == [f"{name}_radians" for name in drawn]
    assert "gains in radians" in title_of(other["fig07_torque_radians"])
    assert not drawn.keys() & OF_ANY_RUN
    for name, figure in (drawn | other).items():
        assert cut_off(figure) == [], name
    for name, figure in drawn.items():
        assert figure.legends, name
        assert all(ax.lines for ax in figure.axes), name
        assert all("(" in ax.get_ylabel() for ax in figure.axes[:: 2 if "error" in name or "torque" in name else 1]), (
            name
        )
    texts = [text.get_text() for text in drawn["fig09-11_tracking_error_half_gains"].legends[0].texts]
    assert texts == ["PPATC", "ATC", "PPATC, half gains", "ATC, half gains", "bounds"]


def test_figures_of_one_short_run(tmp_path):
    short = T[T <= 10]
    drawn = papers.draw_run(PPATC, synthetic(decaying(time=short), time=short))
    assert {"attitude_error", "fig02-04_tracking_error", "fig05_attitude"} <= set(drawn)
    assert not any(name.startswith("fig09") for name in drawn)
    assert all(file.is_file() for file in plots.save(drawn, tmp_path))
    assert not any(name.startswith("fig05") for name in papers.draw_run(ATC, synthetic(decaying())))


# The outside reference: the equations file's figures from a second derivation


def test_reference_starts_as_the_equations_file_says():
    first = outside.reference("ppatc", 1.0, np.array([0.0, 0.01]))
    np.testing.assert_allclose(first["u"][0], [-0.656759, 0.546986, 0.199056], atol=1e-6)
    np.testing.assert_allclose(first["s"][0], [0.183090, -0.4525, -0.039572], atol=1e-6)
    np.testing.assert_allclose(first["eps"][0], [0.804719, 0, -0.346574], atol=1e-6)
    assert first["eta"][0].tolist() == [0.0] * 8


def test_reference_has_the_free_free_modes():
    frequencies, damping = outside.free_free()
    np.testing.assert_allclose(frequencies, [0.38534, 1.05350, 1.33163, 2.22827], atol=1e-4)
    assert damping == pytest.approx(0.00508, abs=1e-4)


def test_reference_keeps_momentum_and_loses_energy_as_the_dampers_say():
    """The plant of the reference: angular momentum follows the torque, energy the power and the damping."""
    loop = outside.Loop("atc", 1.0)
    rng = np.random.default_rng(1)
    x = np.concatenate([rng.normal(0, 0.5, 3), rng.normal(0, 0.1, 3), rng.normal(0, 0.1, 16), np.zeros(22)])
    _, omega, eta, eta_dot, _, _ = outside.split(x)
    _, omega_dot, _, eta_ddot, _, _ = outside.split(loop(0.0, x))
    torque = loop.control(0.0, x)["u"] + outside.disturbance(0.0)
    momentum = outside.HUB @ omega + outside.BOTH @ eta_dot
    rate = outside.HUB @ omega_dot + outside.BOTH @ eta_ddot
    np.testing.assert_allclose(rate + np.cross(omega, momentum), torque, atol=1e-10)
    power = omega @ rate + eta_dot @ (eta_ddot + outside.BOTH.T @ omega_dot) + eta_dot @ (outside.STIFFNESS * eta)
    assert power == pytest.approx(omega @ torque - eta_dot @ (outside.DAMPING * eta_dot), rel=1e-9)


@pytest.fixture(scope="module")
def reference_runs():
    return {name: outside.reference(kind, factor, T) for name, (kind, factor) in KINDS.items()}


@pytest.mark.slow
def test_reference_shows_the_figures_of_the_equations_file(reference_runs):
    ppatc, atc = reference_runs[PPATC], reference_runs[ATC]
    late = T >= 100
    np.testing.assert_allclose(ppatc["e"][late].mean(axis=0), [0.0025, 0.0025, -0.0025], atol=3e-5)
    assert ppatc["z"][:, 1].min() == pytest.approx(0.400, abs=0.003)
    assert ppatc["mu"][-1] == pytest.approx(0.052255, abs=1e-5)
    assert atc["mu"][-1] == pytest.approx(0.038704, abs=1e-5)
    lowest = atc["e"][:, 1].argmin()
    assert atc["e"][lowest, 1] == pytest.approx(-0.0433, abs=0.0005)
    assert T[lowest] == pytest.approx(4.9, abs=0.1)
    np.testing.assert_allclose(abs(atc["e"][late]).max(axis=0), [7.52e-5, 5.68e-5, 4.88e-5], atol=2e-6)
    for run in reference_runs.values():
        assert abs(run["eta"][:, :4] + run["eta"][:, 4:]).max() < 1e-12


@pytest.mark.slow
def test_verdicts_on_the_reference_are_those_of_the_equations_file(reference_runs):
    names = {"plant.q_BN": "q_BN", "guidance.q_RN": "q_RN", "plant.eta": "eta", "plant.eta_dot": "eta_dot"}
    runs = {
        name: table(T, **{there.replace(".", "__"): run[here] for there, here in names.items()})
        for name, run in reference_runs.items()
    }
    in_degrees = [c.alone[0] for c in papers.PAPERS["zhang2018"].claims]
    found = [v.verdict for v in judge(in_degrees, runs)]
    assert found == [
        "reproduced",
        "reproduced",
        "partly",
        "not reproduced",
        "not reproduced",
        "reproduced",
        "partly",
        "partly",
    ]
    e = tracking.tracking_error(runs[PPATC])
    np.testing.assert_allclose(e, reference_runs[PPATC]["e"], atol=1e-12)
