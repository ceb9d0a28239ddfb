"""geng2012: its systems, claims on made-up runs, figures."""

import numpy as np
import pyarrow as pa
import pytest
from geng2012_loop import loop, start
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from components.catalog import CATALOG
from components.numbers import geng2012 as numbers
from cosim.results.result import Result
from cosim.studies import papers, plots
from cosim.studies.papers.geng2012 import clusters, system
from cosim.system import Value
from cosim.system.expand import wire
from fmus.export.python.in_process import describe_in_process

from ..figures import OF_ANY_RUN, cut_off
from . import geng2012_reference as outside

NAMES = list(papers.PAPERS["geng2012"].experiments)
T = np.linspace(0.0, 100.0, 2001)
STRUCTURE = {"actuators": {"gimbals": 2}, "plant": {"modes": 4}}


def number(value):
    return value.value if isinstance(value, Value) else value


def table(time, **variables) -> Result:
    columns = {"time": time}
    for name, rows in variables.items():
        rows = np.asarray(rows)
        full = name.replace("__", ".")
        columns |= {full: rows} if rows.ndim == 1 else {f"{full}[{i + 1}]": rows[:, i] for i in range(rows.shape[1])}
    roles = {"components": {name: {"role": name} for name in ("plant", "guidance", "controller", "actuators")}}
    return Result(pa.table(columns), roles)


def synthetic(
    settles=30.0, rate=0.01, measure=0.5, drift=0.0, eta=1e-3, inverted=0.02, pushed=0.0, growth=-0.02, time=T
) -> Result:
    """A run that comes within 0.1 deg at a time, with a rate (deg/s) and a modal coordinate that stay.

    pushed: torque before 0 s, N m; growth: of the surface, 1/s.
    """
    error = 60.0 * np.exp(-time / settles * np.log(600.0))
    turn = Rotation.from_rotvec(np.radians(error)[:, None] * [1, -1, 1])
    still = np.ones((len(time), 3))
    return table(
        time,
        plant__q_BN=turn.as_quat(scalar_first=True),
        guidance__q_RN=np.tile([1.0, 0, 0, 0], (len(time), 1)),
        plant__omega_BN_B=np.radians(rate) * still,
        plant__eta_dot=np.zeros((len(time), 4)),
        plant__eta=eta * np.cos(time)[:, None] * np.ones((len(time), 4)),
        controller__rho=0.3 * still + drift * time[:, None],
        controller__tau_command_B=np.exp(-time)[:, None] * still,
        controller__sigma=np.exp(growth * time)[:, None] * still,
        controller__s=still,
        environment__tau_dist_B=0 * still,
        actuators__tau_B=np.where(time < 0, pushed, np.exp(-time))[:, None] * still,
        actuators__h_B=still,
        actuators__gimbal_angle=np.outer(np.sin(time), [1, -1]) + numbers.GIMBAL_ANGLES,
        steering__gimbal_rate_command=np.outer(np.cos(time), [0.1, -0.1]),
        steering__wheel_acceleration_command=0.1 * still,
        steering__singularity=measure * np.ones(len(time)),
        steering__inverted_determinant=inverted * np.ones(len(time)),
        steering__inverted_singular_value=inverted / 2 * np.ones(len(time)),
    )


# The systems


@pytest.mark.parametrize("name", NAMES)
def test_the_system_fits_its_components(name):
    """All inputs fed, every parameter known, every unit convertible: nothing is left to complain about."""
    flight, experiment = papers.scenario(name)
    descriptions = {
        instance: describe_in_process(CATALOG[reference.split(":")[0]]().variant(**STRUCTURE.get(instance, {})))
        for instance, reference in flight.components.items()
    }
    settings = {str(port): value for port, value in wire(flight, descriptions).settings.items()}
    assert flight.name == name
    mismatch = {"light": 0.8, "nominal": 1.0}.get(name.split("-")[1], 1.2)
    assert settings["plant.J[1,1]"] == pytest.approx(mismatch * 70)
    assert settings["controller.J[1,1]"] == settings["observer.J[1,1]"] == 70
    assert settings["steering.rotor_momentum[2]"] == settings["actuators.rotor_momentum[2]"] == 15.0
    assert settings["guidance.angle"] == pytest.approx(np.pi / 3)
    assert (experiment.stop_time, experiment.communication_step_size) == (100.0, 1e-3)
    assert experiment.start_time == flight.parameters["guidance.step_time"] == -10.0 * (name == system.PREPOSITIONED)


def test_the_paper_s_numbers_are_the_components_start_values():
    flight, _ = papers.scenario(system.COMPENSATED)
    vehicle = {f"{i}.{n}": v for n, v in flight.vehicle.items() for i in ("controller", "observer", "steering")}
    for instance, part in loop().items():
        for name in (v.name for v in part.parameters):
            value = flight.parameters.get(f"{instance}.{name}", vehicle.get(f"{instance}.{name}"))
            if value is None or (isinstance(value, Value) and value.unit in ("deg", "deg/s")):
                continue
            assert_allclose(number(value), start(part, name), rtol=1e-12, atol=1e-15, err_msg=f"{instance}.{name}")


def test_the_numbers_are_those_of_the_outside_reference():
    assert_array_equal(numbers.J, outside.NOMINAL)
    assert_array_equal(numbers.F, outside.F)
    states = ("e", "eta", "omega", "eta_dot")
    assert_array_equal(np.hstack([numbers.SURFACE[n] for n in states]), outside.D)
    assert_allclose(np.hstack([numbers.GAIN[n] for n in states]), outside.G, rtol=1e-4, atol=1e-5)
    assert_array_equal(np.vstack(list(numbers.centres().values())), outside.CENTRES)
    assert_allclose(2 * np.array(numbers.ZETA) * numbers.OMEGA, outside.C)


def test_the_experiments_differ_in_what_their_names_say():
    common = papers.scenario(system.UNCOMPENSATED)[0].parameters

    def changed(name):
        own = papers.scenario(name)[0].parameters
        return {n.split(".")[1]: number(own[n]) for n in own if own[n] != common[n]}

    assert changed(system.COMPENSATED) == {"network": 1}
    assert changed(system.LINEAR) == {"constant_gain": 0}
    assert changed(system.PRINTED_GAIN) == {"constant_gain": 0, "printed_gain": 1}
    assert changed(system.Z_WHEEL_ONLY) == {"constant_gain": 0, "trim_wheels": 0, "hand_over": 0}
    assert changed(system.END_PHASE_WHEELS) == {"constant_gain": 0, "trim_wheels": 2}
    assert changed(system.PRINTED_GAMMA) == {"network": 1, "gamma_W": 0.01}
    assert changed(system.WEAK) == {"constant_gain": 0.02}
    z, end = {"trim_wheels": 0, "hand_over": 0}, {"trim_wheels": 2}
    assert changed(system.Z_WHEEL_COMPENSATED) == {"network": 1} | z
    assert changed(system.Z_WHEEL_PRINTED_GAMMA) == {"network": 1, "gamma_W": 0.01} | z
    assert changed(system.Z_WHEEL_DEGREES) == {"network": 1, "gamma_W": pytest.approx(0.573, abs=5e-4)} | z
    assert changed(system.Z_WHEEL_UNCOMPENSATED) == z
    assert changed(system.END_PHASE_COMPENSATED) == {"network": 1} | end
    assert changed(system.END_PHASE_UNCOMPENSATED) == end
    assert changed(system.DEGREES) == {"network": 1, "gamma_W": pytest.approx(0.573, abs=5e-4)}
    for names, factor in (
        ((system.LIGHT, system.LIGHT_UNCOMPENSATED), 0.8),
        ((system.NOMINAL, system.NOMINAL_UNCOMPENSATED), 1.0),
    ):
        for name, law in zip(names, ({"network": 1}, {}), strict=True):
            found = changed(name)
            assert_allclose(found.pop("J"), factor * np.array(numbers.J))
            assert found == law


def test_the_gains_of_the_observer_place_its_poles():
    def poles(name):
        gain = {n: number(papers.scenario(name)[0].parameters[f"observer.{n}"]) for n in ("L_eta", "L_psi")}
        inertia, F = outside.NOMINAL, outside.F
        K, C = np.diag(outside.K), np.diag(outside.C)
        seen = np.linalg.inv(np.block([[inertia, F], [F.T, np.eye(4)]]))[:3, 3:] @ -np.hstack([K, C])
        A = np.block([[np.zeros((4, 4)), np.eye(4)], [-K, -C]])
        return np.sort_complex(np.linalg.eigvals(A - np.vstack(list(gain.values())) @ seen))

    pairs = -np.linspace(0.3, 0.5, 4) + 1j * outside.LAM
    assert_allclose(poles(system.OBSERVER_PLACED), np.sort_complex([*pairs, *pairs.conj()]), rtol=1e-6)
    assert_allclose(poles(system.OBSERVER_PLACED_REAL), -np.linspace(0.5, 0.3, 8), rtol=1e-3)


def test_measurement_and_reference_carry_one_time_stamp():
    flight, _ = papers.scenario(system.COMPENSATED)
    timings = {c.target: c.timing for c in flight.connections}
    assert {t for target, t in timings.items() if target.startswith(("controller", "steering"))} == {"after_step"}
    assert (timings["plant.h_B"], timings["observer.omega_BN_B"]) == ("ramp", "ramp")


def test_registry():
    assert [n for n in papers.describe() if n.startswith("geng2012")] == NAMES
    assert all(papers.describe()[n] for n in NAMES)
    five = ("compensated", "uncompensated", "linear", "printed-gain", "z-wheel-only")
    assert {f"geng2012-{n}" for n in five} <= set(NAMES)


# Claims

COMPENSATED = system.COMPENSATED
EARLY = np.linspace(-10.0, 100.0, 2201)
CASES = {  # start of the claim -> what fulfils it, of a run and of the one it is compared with; what does not
    "without": ([dict(settles=45.0, rate=0.05)], [dict(settles=1000.0, rate=0.2)]),
    "with compensation 0.1": ([dict(settles=38.0)], [dict(settles=1000.0)]),
    "with compensation 0.02": ([dict(rate=0.019)], [dict(rate=0.021)]),
    "compensation makes": ([dict(settles=30), dict(settles=41)], [dict(settles=30), dict(settles=39)]),
    "with compensation pointing": (
        [dict(settles=30, rate=0.01), dict(settles=31, rate=0.02)],
        [dict(settles=30, rate=0.02), dict(settles=29, rate=0.01)],
    ),
    "the gyros": ([dict(measure=0.5, inverted=0.02)], [dict(measure=1e-4, inverted=1e-3)]),
    "the network's": ([dict(drift=1e-4)], [dict(drift=1e-3)]),
    "compensation suppresses every mode": ([dict(eta=1e-3), dict(eta=2e-3)], [dict(eta=1e-3), dict(eta=1e-3)]),
    "wheels": ([dict(settles=30), dict(settles=31)], [dict(settles=31), dict(settles=30)]),
    "parallel": (
        [dict(time=EARLY), dict(settles=30.5)],
        [dict(time=EARLY + 0.025, pushed=1e-8), dict(settles=32)],
    ),
    "V = |": ([dict(growth=-0.02)], [dict(growth=0.02)]),
    "compensation is 10 s": ([dict(settles=30), dict(settles=41)], [dict(settles=30), dict(settles=39)]),
    "compensation suppresses every mode better": ([dict(eta=1e-3), dict(eta=2e-3)], [dict(eta=1e-3), dict(eta=1e-3)]),
    "compensation saves": ([dict(settles=30), dict(settles=41)], [dict(settles=30), dict(settles=39)]),
    "any stable": ([dict(settles=38.0)], [dict(settles=1000.0)]),
}
COMPARED = {
    "uncompensated",
    "linear",
    "z-wheel-only",
    "end-phase-wheels",
}  # how names of what a network is compared with end


def claim(words):
    found = [c for c in papers.PAPERS["geng2012"].claims if c.text.startswith(words)]
    return min(found, key=lambda c: len(c.text))


def second(words, name):
    """Whether a run is the one that the claim compares with."""
    if words == "wheels":
        return "z-wheel" in name
    if words == "parallel":
        return name == system.END_PHASE_COMPENSATED
    return any(name.endswith(end) for end in COMPARED | {"weak", "strong"})


@pytest.mark.parametrize("words", CASES)
def test_each_claim_can_come_out_either_way(words):
    judged = claim(words)
    good, bad = (
        {n: synthetic(**changes[min(second(words, n), len(changes) - 1)]) for n in judged.runs}
        for changes in CASES[words]
    )
    holds, fails = judged.judge(good), judged.judge(bad)
    assert holds.verdict == "reproduced", holds
    assert fails.verdict == "not reproduced", fails
    assert holds.measured != fails.measured
    assert judged.depends and (judged.paper_number == "") == judged.beyond


def test_every_claim_has_a_case_but_the_one_that_no_flight_decides():
    texts = {c.text for c in papers.PAPERS["geng2012"].claims}
    assert {claim(words).text for words in CASES} == texts - {"V of the surface and the weights falls (network)"}
    open_ = claim("V of the surface")
    verdict = open_.judge({name: synthetic() for name in open_.runs})
    assert (verdict.verdict, verdict.holds) == ("not judged", {})
    assert "W* is unknown" in verdict.measured


def test_the_paper_s_own_cluster_comes_first_and_each_reading_is_judged():
    pointing = claim("with compensation 0.1")
    runs = {name: synthetic(settles=1000) for name in pointing.runs} | {COMPENSATED: synthetic(settles=30)}
    verdict = pointing.judge(runs)
    assert next(iter(verdict.readings)) == "one wheel with the printed gamma"
    assert verdict.word == "in one reading (N with gamma = 1)"
    assert verdict.holds["N with gamma = 1: pitch"] and not verdict.holds["one wheel with gamma = 1: pitch"]


def test_never_singular_is_partly_where_only_the_inverted_matrix_is_regular():
    singular = claim("the gyros")
    verdict = singular.judge({name: synthetic(measure=1e-4) for name in singular.runs})
    assert verdict.verdict == "partly"
    assert verdict.readings["one wheel"] == {
        "inverted matrix": True,
        "gyros, after 1 s": False,
        "gyros, at the end": False,
    }


def test_a_run_that_ended_early_is_not_judged():
    runs = {name: synthetic() for name in claim("the gyros").runs} | {COMPENSATED: synthetic(time=T[T <= 50])}
    verdict = claim("the gyros").judge(runs)
    assert (verdict.verdict, verdict.measured) == ("not judged", "needs 100 s of geng2012-compensated, it has 50 s")


# Figures


def test_figures_are_those_of_the_paper():
    drawn = papers.PAPERS["geng2012"].draw({name: synthetic(settles=30 + 5 * i) for i, name in enumerate(NAMES)})
    numbered = {"fig04_fig06_attitude_error", "fig04_fig06_rates", "fig05_fig09_modal_coordinates"}
    further = {"fig07_singularity_and_gimbals", "fig08_estimate", "asked_and_given_torque", "all_experiments"}
    of_clusters = {f"{name}_clusters" for name in ("fig04_fig06", "fig05_fig09", "fig07", "fig08")}
    assert set(drawn) == numbered | further | of_clusters | {"lyapunov", "prepositioning"}
    for name in of_clusters:
        assert [ax.get_title() for ax in drawn[name].axes[:3]] == list(clusters.COLUMNS), name
    assert not drawn.keys() & OF_ANY_RUN
    for name, figure in drawn.items():
        assert cut_off(figure) == [], name
        assert figure.legends or all(ax.get_legend() for ax in figure.axes), name
        assert all(ax.lines and ax.get_xlim()[1] > 0 for ax in figure.axes), name
        assert all("(" in ax.get_ylabel() for ax in figure.axes if ax.get_ylabel()), name
    overlaid = [text.get_text() for text in drawn["fig04_fig06_attitude_error"].legends[0].texts]
    assert overlaid == ["with compensation", r"without, $\rho_0$ = 0.15 N m", "linear law", "0.1 deg"]
    gyros = [text.get_text() for text in drawn["fig07_singularity_and_gimbals"].legends[0].texts]
    assert gyros[:3] == overlaid[:3] and gyros[-3:] == ["singular below 0.01", "rate limit", "dead zone"]
    torque = [text.get_text() for text in drawn["asked_and_given_torque"].legends[0].texts]
    assert torque == ["asked", "on the hub", "by the wheels", "limit, plane", "limit, wheels"]
    shown = {t.get_text() for ax in drawn["all_experiments"].axes for t in ax.get_legend().texts}
    assert shown == {name.removeprefix("geng2012-") for name in NAMES} | {"0.1 deg"}


def test_figures_of_one_short_run(tmp_path):
    drawn = papers.draw_run(COMPENSATED, synthetic(time=T[T <= 10]))
    assert {"attitude_error", "fig04_fig06_attitude_error", "fig07_singularity_and_gimbals"} <= set(drawn)
    assert all(file.is_file() for file in plots.save(drawn, tmp_path))
    draw = papers.PAPERS["geng2012"].draw
    assert set(draw({system.PRINTED_GAIN: synthetic()})) == {"all_experiments"}
    one = draw({system.Z_WHEEL_COMPENSATED: synthetic()})
    assert len(one["fig04_fig06_clusters"].axes) == 3 and "lyapunov" not in one
    assert set(draw({system.PREPOSITIONED: synthetic(time=EARLY)})) == {"prepositioning", "all_experiments"}
