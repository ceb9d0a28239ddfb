import re

import numpy as np
import pyarrow as pa
import pytest

from cosim import Experiment, Library, System, Value, simulate
from cosim.results.result import Result
from cosim.studies import metrics
from cosim.studies.roles import loops

T = np.linspace(0.0, 100.0, 10001)
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def run(time=T, **variables) -> Result:
    """A result from arrays; "__" stands for the dot of a name."""
    columns = {"time": np.asarray(time, float)}
    for name, rows in variables.items():
        base = name.replace("__", ".")
        rows = np.asarray(rows, float)
        if rows.ndim == 1:
            columns[base] = rows
        else:
            columns |= {f"{base}[{i + 1}]": rows[:, i] for i in range(rows.shape[1])}
    return Result(pa.table(columns), {})


def turned(axis, degrees) -> np.ndarray:
    """Scalar-first quaternions of rotations about one axis, by the half-angle formula."""
    half = np.radians(np.asarray(degrees, float)) / 2
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.column_stack([np.cos(half), np.outer(np.sin(half), unit)])


def pointing(degrees, axis=(1, 0, 0), time=T) -> Result:
    """A body that is off its reference by an angle about one axis; the reference turns too."""
    n = len(time)
    return run(time, plant__q_BN=turned(axis, degrees), guidance__q_RN=np.tile(IDENTITY, (n, 1)))


def test_constant_error():
    found = metrics.measure(pointing(np.full(len(T), 0.03), axis=(0, 3, 4)))
    assert found["settling time (s)"] == 0.0
    for part in ("max", "95 %", "99.7 %"):
        assert found[f"APE {part} (deg)"] == pytest.approx(0.03, rel=1e-9)
        assert found[f"RPE {part} (deg)"] == pytest.approx(0.0, abs=1e-12)
    assert found["APE max per axis (deg)"] == pytest.approx([0.0, 0.018, 0.024], abs=1e-12)
    assert found["window of APE and RPE (s)"] == [0.0, 100.0]


@pytest.mark.parametrize("threshold", [0.5, 0.1, 0.01])
def test_settling_time_of_an_exponential(threshold):
    found = metrics.measure(pointing(2.0 * np.exp(-T / 7)), threshold_deg=threshold)
    assert found["settling time (s)"] == pytest.approx(7 * np.log(2.0 / threshold), abs=1e-4)
    assert found["APE max (deg)"] <= threshold


def test_settling_counts_the_largest_component_of_either_sign():
    error = np.zeros((len(T), 3))
    error[:, 2] = -np.where(T < 42, 1.0, 0.0)
    assert metrics.settling_time(T, error, 0.1) == pytest.approx(42, abs=0.01)


def test_a_run_that_never_settles_says_so():
    found = metrics.measure(pointing(np.full(len(T), 3.0)))
    assert found["settling time (s)"] is None
    assert found["window of APE and RPE (s)"] == [50.0, 100.0]
    assert found["APE max (deg)"] == pytest.approx(3.0)


def test_jitter_on_a_bias():
    found = metrics.measure(pointing(0.04 + 0.01 * np.sin(2 * np.pi * T)))
    assert found["APE max (deg)"] == pytest.approx(0.05, rel=1e-6)
    assert found["RPE max (deg)"] == pytest.approx(0.01, rel=1e-3)
    # |sin| does not exceed sin(pi/2 p) for the part p of the time; rows are a hundredth of a period apart.
    assert found["RPE 95 % (deg)"] == pytest.approx(0.01 * np.sin(np.pi / 2 * 0.95), rel=2e-3)


def test_a_drift_slower_than_the_interval_is_no_relative_error():
    found = metrics.measure(pointing(0.001 * T), rpe_interval_s=10.0)
    assert found["APE max (deg)"] == pytest.approx(0.1, rel=1e-6)
    assert found["RPE max (deg)"] == pytest.approx(0.005, rel=1e-3)


def test_percentiles_weigh_time_not_rows():
    # 1 % of the time, but half of the rows, is spent at the large error.
    time = np.concatenate([np.linspace(0, 1, 500), np.linspace(1.0001, 100, 500)])
    found = metrics.measure(pointing(np.where(time <= 1, 0.09, 0.02), time=time))
    assert found["APE 95 % (deg)"] == pytest.approx(0.02)
    assert found["APE 99.7 % (deg)"] == pytest.approx(0.09)


def test_the_error_takes_the_short_way():
    far = run([0, 1], plant__q_BN=-turned((0, 0, 1), [1, 1]), guidance__q_RN=turned((0, 0, 1), [-1, -1]))
    np.testing.assert_allclose(metrics.attitude_error(far), [[0, 0, 2]] * 2, atol=1e-12)


def test_the_error_is_in_body_axes():
    # Reference turned by 90 deg about z: a body turned further about its own x is off about x.
    reference = np.tile(turned((0, 0, 1), [90])[0], (2, 1))
    c, s = np.cos(np.radians(5)), np.sin(np.radians(5))
    r = np.sqrt(0.5)
    body = np.tile([r * c, r * s, r * s, r * c], (2, 1))  # (r, 0, 0, r) (x) (c, s, 0, 0)
    error = metrics.attitude_error(run([0, 1], plant__q_BN=body, guidance__q_RN=reference))
    np.testing.assert_allclose(error, [[10, 0, 0]] * 2, atol=1e-12)


def test_torque():
    tau = np.column_stack([np.sin(2 * np.pi * T / 100), -0.5 * np.ones_like(T), 0 * T])
    found = metrics.measure(run(plant__tau_B=tau))
    assert found["peak torque (N.m)"] == pytest.approx([1.0, 0.5, 0.0])
    assert found["torque impulse (N.m.s)"] == pytest.approx([200 / np.pi, 50.0, 0.0], rel=1e-6)


def test_the_torque_of_a_cluster_whose_momentum_the_plant_takes():
    """It is added to what comes from outside; where the plant takes it as a torque it is in there already."""
    outside, wheels = np.tile([1.0, 0.0, 0.0], (3, 1)), np.tile([0.0, 2.0, -3.0], (3, 1))
    flight = run([0, 1, 2], plant__tau_B=outside, actuators__tau_B=wheels, actuators__h_B=wheels)
    kinds = {"plant": {"role": "plant"}, "actuators": {"role": "actuators"}}
    momentum = {"plant.h_B": {"source": "actuators.h_B", "timing": "ramp"}}
    both = momentum | {"plant.tau_B": {"source": "actuators.tau_B", "timing": "step mean"}}
    for connections, expected in ((momentum, [1, 2, 3]), (both, [1, 0, 0])):
        flight.info = {"components": kinds, "connections": connections}
        assert metrics.measure(flight)["peak torque (N.m)"] == expected
    flight.info = {}  # columns alone: a torque that the plant was given is taken for all of it
    assert metrics.measure(flight)["peak torque (N.m)"] == [1, 0, 0]
    alone = run([0, 1, 2], plant__tau_B=0 * outside, actuators__tau_B=wheels, actuators__h_B=wheels)
    assert metrics.measure(alone)["peak torque (N.m)"] == [0, 2, 3]


def test_a_thruster_beside_wheels_is_from_outside():
    """Both change: the wheels' momentum is inside, the thruster's impulse is no drift; as a step mean it is inside."""
    time, zero = np.linspace(0, 10, 1001), np.zeros((1001, 3))
    given = np.outer(np.sin(time), [0, 0, 1])
    flight = run(
        time,
        plant__q_BN=np.tile(IDENTITY, (1001, 1)),
        plant__H_N=np.outer(1 - np.cos(time), [0, 0, 1]),
        plant__tau_dist_B=zero,
        plant__tau_B=given,
        plant__h_B=np.outer(time, [1, 0, 0]),
    )
    drifts = []
    for timing in ("midpoint", "step mean"):
        flight.info = {"connections": {"plant.tau_B": {"source": "other.tau_B", "timing": timing}}}
        drifts.append(metrics.measure(flight)["momentum drift (N.m.s)"])
    assert drifts[0] < 0.01**4  # Simpson's rule: h^4
    assert drifts[1] == pytest.approx(2.0, rel=1e-2)


def test_the_command_stands_in_for_a_torque_that_was_not_recorded():
    assert metrics.measure(run([0, 1], controller__tau_command_B=[[1, 2, 3]] * 2))["peak torque (N.m)"] == [1, 2, 3]


def balance(H, tau_dist=(0, 0, 0), tau=(0, 0, 0), stored=(0, 0, 0), rate=0.0):
    """Metrics of a body that turns about z; constant vectors are spread over the rows."""
    known = dict(plant__H_N=H, plant__tau_dist_B=tau_dist, plant__tau_B=tau, plant__h_B=stored)
    spread = {name: np.broadcast_to(np.asarray(v, float), (len(T), 3)) for name, v in known.items()}
    return metrics.measure(run(plant__q_BN=turned((0, 0, 1), np.degrees(rate * T)), **spread))


def test_momentum_drift_where_only_actuators_act():
    H = np.tile([3.0, 0.0, 4.0], (len(T), 1))
    H[-1, 1] = 5e-9
    found = balance(H, tau=(1, 1, 1), stored=np.column_stack([T, 0 * T, 0 * T]) / 100)
    assert found["momentum drift (N.m.s)"] == pytest.approx(5e-9)
    assert found["momentum drift, relative (1)"] == pytest.approx(1e-9)
    assert found["momentum change (N.m.s)"] == pytest.approx(5e-9)


def test_the_impulse_from_outside_is_no_drift():
    """A constant torque in turning body axes: its impulse is a circle in closed form."""
    rate, h = 0.2, T[1]
    H = np.column_stack([np.sin(rate * T), 1 - np.cos(rate * T), 0 * T]) / rate
    wheels = np.column_stack([T, 0 * T, 0 * T])
    found = balance(H, tau_dist=(1, 0, 0), tau=(7, 7, 7), stored=wheels, rate=rate)
    assert found["momentum change (N.m.s)"] == pytest.approx(10.0, rel=1e-4)
    simpson = T[-1] * h**4 / 180 * rate**4  # its error, with the fourth derivative of the torque
    assert found["momentum drift (N.m.s)"] < simpson + h**4 + 1e-12  # h^4: a last interval without a partner
    H[:, 2] += 1e-6 * T
    assert balance(H, tau_dist=(1, 0, 0), stored=wheels, rate=rate)["momentum drift (N.m.s)"] == pytest.approx(1e-4)


@pytest.mark.parametrize(("timing", "shift"), [("at_point", -0.5), ("after_step", 0.5), ("midpoint", 0.0)])
def test_an_ideal_torque_is_from_outside_and_held_as_the_master_holds_it(timing, shift):
    """A torque t about z, held over steps of 0.1 s: what the plant then gets is a sum in closed form."""
    step, k = 0.1, np.arange(1001)
    time, given = step * k, np.outer(step * k, [0, 0, 1])
    sums = {"at_point": k * (k - 1) / 2, "after_step": k * (k + 1) / 2, "midpoint": k * k / 2}[timing] * step**2
    zero, identity = np.zeros((len(k), 3)), np.tile(IDENTITY, (len(k), 1))
    flight = run(
        time,
        plant__q_BN=identity,
        plant__H_N=np.outer(sums, [0, 0, 1]),
        plant__tau_dist_B=zero,
        plant__tau_B=given,
        plant__h_B=zero,
    )
    assert metrics.measure(flight)["momentum drift (N.m.s)"] == pytest.approx(abs(shift) * step * 100, abs=1e-9)
    flight.info = {
        "connections": {"plant.tau_B": {"source": "controller.tau_command_B", "timing": timing}},
        "communication_step_size": step,
    }
    assert metrics.measure(flight)["momentum drift (N.m.s)"] < 1e-9


def test_no_drift_where_the_rows_cannot_tell():
    found = metrics.measure(run([0, 1], plant__H_N=[[0, 0, 0], [0, 2, 0]], plant__tau_B=[[0, 0, 1]] * 2))
    assert found["momentum change (N.m.s)"] == 2.0
    assert "momentum drift (N.m.s)" not in found


def thruster(apart: float, lost: float) -> Result:
    """A body whose thruster gives sin t about z for 60 s, rows `apart`; a part `lost` of its impulse does not come."""
    time = np.arange(0.0, 60.0 + apart / 2, apart)
    zero = np.zeros((len(time), 3))
    return run(
        time,
        plant__q_BN=np.tile(IDENTITY, (len(time), 1)),
        plant__H_N=np.outer((1 - lost) * (1 - np.cos(time)), [0, 0, 1]),
        plant__tau_dist_B=np.outer(np.sin(time), [0, 0, 1]),
        plant__tau_B=zero,
        plant__h_B=zero,
    )


def test_a_drift_that_rows_far_apart_cannot_tell_is_refused_and_said():
    """Simpson's rule over sin t of rows 1 s apart is off by some 1e-2: a drift of 1e-4 is not in such rows."""
    fine, coarse = (metrics.measure(thruster(apart, 1e-4)) for apart in (0.01, 1.0))
    assert fine["momentum drift (N.m.s)"] == pytest.approx(2e-4, rel=1e-3)  # of a momentum of 1 - cos t, at most 2
    assert fine["momentum drift, known to (N.m.s)"] < 1e-7
    assert coarse["momentum change (N.m.s)"] == pytest.approx(2.0, rel=0.02)
    assert not any("drift" in key for key in coarse)
    words = metrics.not_measured(thruster(1.0, 1e-4))
    assert "momentum drift, for rows 1 s apart give the impulse from outside to" in words and "--every" in words
    assert "drift" not in metrics.not_measured(thruster(0.01, 1e-4))


def test_what_a_drift_is_known_to_bounds_the_error_of_its_integral():
    """The true drift, .05 (1 - cos t), is known; at every distance of rows what is shown is off by no more than that.

    The largest of rows misses the peak by up to .05 (apart / 2)^2 / 2.
    """
    for apart in (0.01, 0.05, 0.1, 0.25):
        found = metrics.measure(thruster(apart, 0.05))
        known = found["momentum drift, known to (N.m.s)"]
        assert abs(found["momentum drift (N.m.s)"] - 0.1) <= known + 0.05 * apart**2 / 8


def test_a_drift_larger_than_its_integral_s_error_is_shown_however_far_apart_the_rows():
    assert metrics.measure(thruster(0.5, 0.3))["momentum drift (N.m.s)"] == pytest.approx(0.6, rel=0.05)


SLEW_END = 40.0


def slewing(error, remaining=None) -> Result:
    """A body with an error about x; the reference's slew ends at 40 s."""
    left = np.maximum(SLEW_END - T, 0.0) if remaining is None else remaining
    return run(
        T,
        plant__q_BN=turned((1, 0, 0), error),
        guidance__q_RN=np.tile(IDENTITY, (len(T), 1)),
        guidance__remaining=left,
    )


@pytest.mark.parametrize(("last", "expected"), [(55.0, 15.0), (40.0, 0.0), (30.0, 0.0)])
def test_settling_of_a_slew_is_counted_from_its_end(last, expected):
    """1 deg up to `last`: settled that much after the end of the slew, at once where it was settled before."""
    found = metrics.measure(slewing(np.where(T < last, 1.0, 0.0)))
    assert found["settling counted from (s)"] == pytest.approx(SLEW_END)
    assert found["settling time (s)"] == pytest.approx(expected, abs=0.02)  # rows 10 ms apart
    assert found["window of APE and RPE (s)"][0] == pytest.approx(SLEW_END + expected, abs=0.02)


def test_a_slew_that_has_not_ended_has_not_settled():
    found = metrics.measure(slewing(0 * T, remaining=150.0 - T))
    assert found["settling counted from (s)"] == pytest.approx(150.0)
    assert found["settling time (s)"] is None


def test_a_reference_that_never_moves_is_no_slew():
    assert metrics.measure(slewing(0 * T, remaining=0 * T))["settling counted from (s)"] == 0.0


def test_the_end_of_a_slew_as_its_guidance_flies_it():
    """A bang-bang turn by 90 deg within 1 deg/s and 0.1 deg/s2, begun at 5 s: 5 + 90 / 1 + 1 / 0.1 s, by hand."""
    system = System(
        name="turn",
        components={"guidance": "Slew"},
        parameters={
            "guidance.angle": Value(90.0, "deg"),
            "guidance.max_rate": Value(1.0, "deg/s"),
            "guidance.max_acceleration": Value(0.1, "deg/s2"),
            "guidance.start_time": 5.0,
            "guidance.smooth": 0.0,
        },
    )
    flown = simulate(system, Experiment(stop_time=20.0, communication_step_size=0.5), locate=Library())
    assert metrics.slew_end(flown, loops(flown)[0]) == pytest.approx(105.0, abs=1e-9)


def test_force_of_a_drag_free_satellite():
    force = np.column_stack([0.5 * np.ones_like(T), 0 * T, -np.abs(np.sin(2 * np.pi * T / 100))])
    found = metrics.measure(run(plant__f_command_S=force, plant__r_rel=1e-3 * force))
    assert found["peak force (N)"] == pytest.approx([0.5, 0, 1.0])
    assert found["force impulse (N.s)"] == pytest.approx([50, 0, 200 / np.pi], rel=1e-6)
    assert found["peak distance of the test mass (m)"] == pytest.approx(1e-3)


def test_peaks_of_what_was_recorded():
    found = metrics.measure(
        run(
            [0, 1],
            plant__eta=[[0, 1e-3], [-2e-3, 0]],
            actuators__wheel_speed=[[1, -7]] * 2,
            actuators__wheel_momentum=[[0.1, -0.7]] * 2,
            actuators__h_B=[[1, 2, -3]] * 2,
        )
    )
    assert found["peak modal coordinate (kg^(1/2).m)"] == 2e-3
    assert found["peak wheel speed (rad/s)"] == 7
    assert found["peak wheel momentum (N.m.s)"] == 0.7
    assert found["peak stored momentum (N.m.s)"] == 3


@pytest.mark.parametrize("rows", [0, 1, 2])
def test_a_run_of_few_rows(rows):
    short = run(
        T[:rows],
        plant__q_BN=np.tile(IDENTITY, (rows, 1)),
        guidance__q_RN=np.tile(IDENTITY, (rows, 1)),
        plant__tau_B=np.zeros((rows, 3)),
        plant__H_N=np.zeros((rows, 3)),
        plant__eta=np.zeros((rows, 1)),
    )
    found = metrics.measure(short)
    assert ("settling time (s)" in found) == (rows == 2)


def test_a_system_without_attitude_has_no_metrics():
    assert metrics.measure(run([0, 1], pump__pressure=[1, 2])) == {}


def test_every_key_names_its_unit():
    found = metrics.measure(pointing(0.01 * np.ones_like(T)))
    assert "APE 95 % (deg)" in found
    assert all(re.search(r" \(.+\)$", key) for key in found)
