"""The systems, claims and figures of ye2016."""

import numpy as np
import pyarrow as pa
import pytest
from helpers import Point
from scipy.spatial.transform import Rotation

from components.actuators.cmg_cluster import CmgCluster
from components.catalog import CATALOG
from components.controllers.hybrid_adaptive import HybridAdaptive
from components.numbers import neutral
from components.numbers.ye2016 import EIGENVALUES, K_1, K_2
from components.plants.flexible_spacecraft import FlexibleSpacecraft
from cosim.results.result import Result
from cosim.studies import papers, plots
from cosim.studies.papers.claims import Claim
from cosim.studies.papers.ye2016 import gains, system, theory, tracking
from cosim.system import Value
from cosim.system.expand import wire
from fmus.export.python.in_process import describe_in_process

from ..figures import OF_ANY_RUN, cut_off

NAMES = [
    "ye2016-nonadaptive",
    "ye2016-adaptive",
    "ye2016-adaptive-printed",
    "ye2016-nonadaptive-slow",
    "ye2016-adaptive-slow",
    "ye2016-adaptive-slow-printed",
    "ye2016-nonadaptive-placed",
    "ye2016-nonadaptive-slow-placed",
    "ye2016-perfect",
    "ye2016-adaptive-inertia",
    "ye2016-adaptive-inertia-printed",
    "ye2016-servo",
    "ye2016-full-model",
]
PARTS = {**CATALOG, "FlexibleSpacecraft:modes=0": lambda: FlexibleSpacecraft(modes=0)}
T = np.linspace(0.0, 800.0, 801)


def number(value):
    return np.array(value.value if isinstance(value, Value) else value)


# The systems


def test_the_experiments_are_those_of_the_equations_file():
    assert list(papers.PAPERS["ye2016"].experiments) == NAMES
    assert {name for name in papers.describe() if name.startswith("ye2016")} == set(NAMES)
    assert all(papers.describe()[name] for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_the_system_fits_its_components(name):
    """All inputs fed, every parameter known, every unit convertible: nothing is left to complain about."""
    flight, experiment = papers.scenario(name)
    assert flight.name == name and experiment.stop_time == 800.0
    descriptions = {
        instance: describe_in_process(PARTS[reference]()) for instance, reference in flight.components.items()
    }
    settings = {str(port): value for port, value in wire(flight, descriptions).settings.items()}
    cluster = "actuators" if "actuators" in flight.components else "plant"
    assert settings["controller.rotor_axes_B[2,1]"] == settings[f"{cluster}.rotor_axes_B[2,1]"] == 1.0
    known = 1.1 if "inertia" in name else 1.0  # of the inertia, to the controller
    assert settings["plant.J[2,2]"] == 110.0
    assert settings["controller.J[2,2]"] == pytest.approx(known * 110.0, rel=1e-15)
    assert settings[f"{cluster}.spin_deviation[3,3]"] == system.WHEEL_DEVIATION[2, 2]


@pytest.mark.parametrize("name", NAMES)
def test_every_number_is_set(name):
    """No start value of the library, which is no paper's, is left in an experiment, unless it is zero or no limit."""
    flight, _ = papers.scenario(name)
    for instance, reference in flight.components.items():
        part = PARTS[reference]()
        given = {n.split(".", 1)[1] for n in flight.parameters if n.split(".", 1)[0] in (instance, "*")}
        settable = (*part.parameters, *(s for s in part.states if not s.calculated))
        left = {v.name for v in settable if v.size and np.any(v.start) and not np.all(v.start == neutral.NO_LIMIT)}
        left -= given | set(flight.vehicle)
        assert not left, f"{instance}: {left}"


def test_deviations_and_unknown_momentum():
    for rows in (system.ROTOR_DEVIATION, system.TRANSVERSE_DEVIATION, system.WHEEL_DEVIATION):
        assert np.abs(rows).max() < 0.05
    np.testing.assert_allclose(system.unknown_momentum(), [-0.13127, 0.74357, -0.71436], atol=5e-6)
    # the true matrices of parameters.json
    assert system.ROTOR_AXES[0, 1] + system.ROTOR_DEVIATION[0, 1] == pytest.approx(-1.016032411957556, abs=1e-15)
    transverse = np.cross(system.GIMBAL_AXES.T, system.ROTOR_AXES.T).T + system.TRANSVERSE_DEVIATION
    assert transverse[0, 0] == pytest.approx(-0.5631725634145179, abs=1e-15)
    assert system.WHEEL_AXES[2, 2] + system.WHEEL_DEVIATION[2, 2] == pytest.approx(1.004207560532752, abs=1e-15)


def test_true_axes_known_are_the_clusters():
    """The rows of Theta that ye2016-perfect starts with make the law's axes those of the deviating cluster."""
    flight, _ = papers.scenario(system.PERFECT)
    p = {n.split(".", 1)[1]: number(v) for n, v in flight.parameters.items()}
    gamma, rates = (
        np.array([0.3, -0.2, 1.0, 2.0]),
        dict(omega_BN_B=[0.01, 0.0, -0.01], gimbal_angle=[0.3, -0.2, 1.0, 2.0]),
    )
    law = Point(HybridAdaptive(Theta_c=p["Theta_c"], Theta_w=p["Theta_w"]), **rates).outputs()
    cluster = Point(
        CmgCluster(**{n: p[n] for n in ("rotor_deviation", "transverse_deviation", "spin_deviation")}),
        gimbal_angle=gamma,
        gimbal_rate_command=law["gimbal_rate_command"],
        wheel_acceleration_command=law["wheel_acceleration_command"],
    )
    tau = cluster.functions.mean_rates(0, cluster.x, cluster.u, cluster.p, cluster.c).full().ravel()
    np.testing.assert_allclose(tau, law["tau_wanted_B"], rtol=1e-9)


def test_slow_poles_are_a_tenth():
    fast, slow = (papers.scenario(n)[0].parameters for n in (system.NONADAPTIVE, system.NONADAPTIVE_SLOW))
    for i in range(3):
        roots = [np.roots([1, *(number(p[f"controller.{k}"])[i, i] for k in ("k_2", "k_1"))]) for p in (fast, slow)]
        np.testing.assert_allclose(np.sort_complex(roots[1]), 0.1 * np.sort_complex(roots[0]), rtol=1e-12)


@pytest.mark.parametrize("scale", [1.0, system.SLOW])
def test_placed_gains_have_the_printed_eigenvalues(scale):
    for K in (gains.placed(scale), gains.diagonal(scale)):
        A = np.block([[np.zeros((3, 3)), np.eye(3)], [-K]])
        found = np.sort_complex(np.linalg.eigvals(A))
        np.testing.assert_allclose(found, np.sort_complex(scale * EIGENVALUES), rtol=1e-6)
    assert np.abs(gains.placed(scale) - gains.diagonal(scale)).max() > 0.01 * scale


# Claims, on runs made up


def table(**variables) -> Result:
    columns = {"time": T}
    for name, rows in variables.items():
        flat = rows.reshape(len(T), -1)
        index = list(np.ndindex(*rows.shape[1:]))
        label = ["[" + ",".join(str(k + 1) for k in place) + "]" if place else "" for place in index]
        columns |= {f"{name.replace('__', '.')}{where}": flat[:, i] for i, where in enumerate(label)}
    return Result(pa.table(columns), {})


def synthetic(angle=0.1, rate=1e-3, squared=0.1, momentum=0.01, terms=1e-6) -> Result:
    """Errors about z that swing by these, deviations of this squared length, a momentum error of this at the end."""
    small = np.outer(terms * np.cos(T), [1, 0, 0])
    body = Rotation.from_rotvec(np.outer(angle * np.sin(T), [0, 0, 1]))
    zero, ones = np.zeros((len(T), 3)), np.ones((len(T), 3))
    gyros, wheels = np.zeros((len(T), 4, 6)), np.zeros((len(T), 3, 3))
    gyros[:, 1, 2] = np.sqrt(squared) * np.abs(np.sin(T))
    q = np.tile([1.0, 0, 0, 0], (len(T), 1))
    return table(
        plant__q_BN=body.as_quat(scalar_first=True),
        guidance__q_RN=q,
        plant__omega_BN_B=np.outer(rate * np.cos(T), [0, 1, 0]),
        guidance__omega_RN_R=zero,
        plant__H_N=ones,
        plant__tau_B=1e-2 * ones,
        plant__inertia_torque_B=small,
        plant__acceleration_torque_B=small,
        plant__gyroscopic_torque_B=small,
        controller__e=1e-3 * ones,
        controller__e_dot=1e-4 * ones,
        controller__Theta_F=ones,
        controller__H_hat_N=ones * (2 - np.minimum(T / 90, 1) * (1 - momentum))[:, None],
        controller__Theta_c=gyros,
        controller__Theta_w=wheels,
        controller__gimbal_rate_command=1e-2 * np.sin(T)[:, None] * np.ones(4),
        controller__wheel_acceleration_command=1e-5 * np.cos(T)[:, None] * np.ones(3),
        controller__tau_wanted_B=2e-2 * ones,
        actuators__gimbal_angle=np.sin(T)[:, None] * np.ones(4),
        actuators__wheel_speed=np.array([100.0, -80.0, 60.0]) * ones,
        actuators__singularity=1 + 0.1 * np.cos(T),
    )


OFF = (system.NONADAPTIVE, system.NONADAPTIVE_SLOW, system.PLACED, system.SLOW_PLACED)
ON = (system.ADAPTIVE, system.PRINTED, system.SLOW_PRINTED, system.ADAPTIVE_SLOW)


def falling(alpha_F, sign) -> Result:
    """Theta_F that makes V fall, or grow, by the integral of |e|^2 / 2 of an error that dies out."""
    e, size = np.zeros((len(T), 3)), 1e-4 * np.exp(-T / 100)
    e_dot = np.outer(size, [0, 1, 0])
    lost = (1e-8 * 100 / 4) * (1 - np.exp(-T / 50))
    gyros, wheels = system.unknown_axes()
    P_22 = (1 + 1 / K_1[1]) / (2 * K_2[1])
    rest = 0.5 * 2e-6 - sign * lost - P_22 * size**2 / 2
    Theta = np.outer(np.sqrt(2 * alpha_F * rest), [1, 0, 0]) + system.unknown_momentum()
    return table(
        controller__e=e,
        controller__e_dot=e_dot,
        controller__Theta_F=Theta,
        controller__Theta_c=np.tile(gyros, (len(T), 1, 1)),
        controller__Theta_w=np.tile(wheels, (len(T), 1, 1)),
    )


def runs(names, **values):
    return {name: synthetic(**values) for name in names}


CASES = {
    "without": (runs(OFF, angle=0.25, rate=2e-3), runs(OFF, angle=0.02, rate=1e-7)),
    "with": (runs(ON, angle=2e-3, rate=2e-4), runs(ON, angle=2e-7, rate=2e-8)),
    "adaptation": (
        runs(OFF, angle=0.3, rate=2e-3) | runs(ON, angle=2e-3, rate=1e-4),
        runs(OFF, angle=0.3, rate=2e-3) | runs(ON, angle=0.2, rate=1e-3),
    ),
    "the projection": (
        runs(ON, squared=0.15),
        runs(ON, squared=0.152),
    ),
    "the estimated": (
        runs(ON, momentum=0.05),
        runs(ON, momentum=0.6),
    ),
    "V'": (
        {name: falling(alpha_F, 1.0) for name, alpha_F in theory.FLIGHTS.items()},
        {name: falling(alpha_F, -1.0) for name, alpha_F in theory.FLIGHTS.items()},
    ),
    "the law estimates": (
        runs((system.PRINTED, system.INERTIA_PRINTED, system.ADAPTIVE, system.INERTIA)),
        runs((system.PRINTED, system.ADAPTIVE)) | runs((system.INERTIA_PRINTED, system.INERTIA), angle=0.2),
    ),
    "the gyros'": (
        {system.FULL_MODEL: synthetic(terms=2e-5)},
        {system.FULL_MODEL: synthetic(terms=5e-5)},
    ),
    "the law keeps": (
        runs((system.ADAPTIVE, system.SERVO, system.FULL_MODEL)),
        runs((system.ADAPTIVE, system.SERVO)) | {system.FULL_MODEL: synthetic(angle=0.12, rate=1.2e-3)},
    ),
}


def claim(start: str) -> Claim:
    (found, *_) = [c for c in papers.PAPERS["ye2016"].claims if c.text.startswith(f"{start} ")]
    return found


@pytest.mark.parametrize("start", CASES)
def test_each_claim_can_come_out_either_way(start):
    """In every reading: but for that of degrees, which cannot be true together with that of radians."""
    holds, fails = (claim(start).judge(given) for given in CASES[start])
    in_radians = [part for part, good in holds.holds.items() if "degrees" not in part and not good]
    assert holds.verdict in ("reproduced", "in one reading") and not in_radians, holds
    assert fails.verdict == "not reproduced", fails
    assert holds.measured != fails.measured


def test_degrees_are_a_reading_of_their_own():
    """0.3 and 0.003 are taken as degrees, 1e-3 and 1e-4 as degrees a second."""
    for start, names, angle, rate in (("without", OFF, 0.3, 1e-3), ("with", ON, 3e-3, 1e-4)):
        verdict = claim(start).judge(runs(names, angle=np.radians(angle), rate=np.radians(rate)))
        assert verdict.word == "in one reading (printed poles in degrees)"
        verdict = claim(start).judge(runs(names, angle=np.radians(angle), rate=np.radians(10 * rate)))
        assert "printed poles in degrees: rate" in verdict.failing and verdict.verdict == "partly"


def test_momentum_is_judged_in_every_reading():
    good, bad = synthetic(momentum=0.05), synthetic(momentum=2.4)
    for name in ON:
        verdict = claim("the estimated").judge({other: bad if other == name else good for other in ON})
        (failed,) = [reading for reading, parts in verdict.readings.items() if not all(parts.values())]
        assert verdict.verdict == "in one reading" and failed in verdict.failing


def test_every_claim_has_a_case():
    assert len(CASES) == len(papers.PAPERS["ye2016"].claims) == 9


def test_a_claim_without_its_runs_is_not_judged():
    verdict = claim("without").judge(runs([system.NONADAPTIVE]))
    assert (verdict.verdict, verdict.measured) == (
        "not judged",
        "needs ye2016-nonadaptive-slow, ye2016-nonadaptive-placed, ye2016-nonadaptive-slow-placed",
    )


def test_errors_are_those_of_the_body_relative_to_the_reference():
    run = synthetic(angle=0.1, rate=1e-3)
    np.testing.assert_allclose(tracking.euler_error(run)[:, 2], 0.1 * np.sin(T), atol=1e-12)
    np.testing.assert_allclose(tracking.rate_error(run)[:, 1], 1e-3 * np.cos(T), atol=1e-15)


# Figures


def test_figures_are_those_of_the_paper(tmp_path):
    drawn = papers.PAPERS["ye2016"].draw({name: synthetic() for name in NAMES})
    assert sorted(drawn) == [
        "cluster_angles",
        "cluster_commands",
        "cluster_torque",
        "fig02_fig04_attitude_error",
        "fig03_fig05_rate_error",
        "fig08-09_momentum_estimate",
        "fig10-11_squared_norms",
        "neglected_terms",
        "storage_function",
        "wanted_torque",
    ]
    assert not drawn.keys() & OF_ANY_RUN
    assert all(figure.legends for figure in drawn.values())
    assert {name: cut for name, figure in drawn.items() if (cut := cut_off(figure))} == {}
    texts = [text.get_text() for text in drawn["fig02_fig04_attitude_error"].legends[0].texts]
    assert len(texts) == 9 and {"0.3 rad", "0.003 rad"} < set(texts)
    missing = drawn["wanted_torque"].axes[3].lines[0].get_ydata()
    np.testing.assert_allclose(missing, 1e-2 * np.sqrt(3))
    assert all(file.is_file() for file in plots.save(drawn, tmp_path))


def test_figures_of_one_run():
    drawn = papers.draw_run(system.NONADAPTIVE, synthetic())
    assert {"attitude_error", "fig02_fig04_attitude_error", "cluster_angles"} <= set(drawn)
    assert not any(name.startswith(("fig08", "fig10")) for name in drawn)
    assert papers.PAPERS["ye2016"].draw({}) == {}
