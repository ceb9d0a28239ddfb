"""zhang2018: prescribed performance adaptive attitude tracking of a flexible spacecraft.

C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible spacecraft,
J. Harbin Inst. Tech. 50(4), 2018, 10.11918/j.issn.0367-6234.201612089, section 4.

The Euler angles theta = (phi, th, psi) are of the sequence 1-2-3: v_B = R_z(psi) R_y(th) R_x(phi) v_N with passive
rotations, so that
    omega_BN_B = G(theta) theta',  G = [ cos psi cos th  sin psi  0                               (3)
                                        -sin psi cos th  cos psi  0
                                         sin th          0        1]
Chosen where the paper is silent: the rates of its Table 1 are those of the Euler angles, the controller's angles are in
degrees, the disturbance is in body axes, the panels and the adaptation start at zero, 200 s, no torque limit.
Claims and figures use plant.q_BN and guidance.q_RN, not what a controller says of itself.
"""

from collections.abc import Callable, Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cosim import plots
from cosim.metrics import rotations, series, settling_time
from cosim.papers.claims import AXES, Claim, Measured, per_axis, window
from cosim.papers.claims import figures as shown
from cosim.result import Result
from cosim.system import Connection, Experiment, System, Value

Array = NDArray[np.float64]

TITLE = "Zhang, Sun, Ma, Li: Prescribed performance adaptive attitude tracking control for flexible spacecraft (2018)"
PPATC, ATC = "zhang2018-ppatc", "zhang2018-atc"
PPATC_HALF, ATC_HALF = "zhang2018-ppatc-half", "zhang2018-atc-half"

# Table 1
J = [[420.8, 3.6, -4.2], [3.6, 410.6, 9.4], [-4.2, 9.4, 690.7]]  # kg m2
F_1 = np.array(  # kg^1/2 m; a row an axis, a column a mode of panel 1
    [[2.62, -1.24e-3, -8.20e-4, 6.44e-1], [6.89e-3, 1.24e-1, 4.37e-1, 6.26e-3], [-3.44e-3, -2.73, -5.08e-2, 3.29e-3]]
)
F_2 = -F_1
OMEGA = 2 * np.pi * np.array([0.379, 1.042, 1.331, 2.226])  # rad/s, of either panel
ZETA = 0.005
THETA_0 = [0.25, 0.15, -0.20]  # deg
THETA_DOT_0 = [0.02, 0.01, -0.02]  # deg/s

# Table 2
RHO_0, RHO_INF = 0.3, 0.005  # deg
DECAY = 0.15  # k, 1/s
OVERSHOOT = 0.0  # delta

# Gains, section 4
LAMBDA = [0.125, 0.125, 0.125]
K = [0.5, 0.1, 0.5]
SIGMA, BETA, GAMMA = 0.01, 0.01, 0.01
TAU_W, TAU_MU = 0.5, 0.5
WIDTH = 0.1
CENTRES = [
    [-0.25, -0.17, -0.08, 0, 0.08, 0.17, 0.25],
    [-0.15, -0.10, -0.05, 0, 0.05, 0.10, 0.15],
    [-0.20, -0.13, -0.07, 0, 0.07, 0.13, 0.20],
]
RATE_CENTRES = [
    [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03],
    [-0.15, -0.10, -0.05, 0, 0.05, 0.10, 0.15],
    [-0.03, -0.02, -0.01, 0, 0.01, 0.02, 0.03],  # the first is printed 0.03
]

STOP_TIME = 200.0  # s
STEADY = 100.0  # s, from here on an error is the steady one


def ppatc() -> tuple[System, Experiment]:
    """Prescribed performance adaptive tracking (PPATC) of a sinusoidal attitude, figures 2-8."""
    return _flight(PPATC, "PrescribedPerformance", 1.0)


def atc() -> tuple[System, Experiment]:
    """Adaptive tracking (ATC), the same gains without prescribed performance, figures 2-4."""
    return _flight(ATC, "AdaptiveTracking", 1.0)


def ppatc_half() -> tuple[System, Experiment]:
    """PPATC with K, tau_w and tau_mu halved, figures 9-11."""
    return _flight(PPATC_HALF, "PrescribedPerformance", 0.5)


def atc_half() -> tuple[System, Experiment]:
    """ATC with K, tau_w and tau_mu halved, figures 9-11."""
    return _flight(ATC_HALF, "AdaptiveTracking", 0.5)


def systems() -> dict[str, Callable[[], tuple[System, Experiment]]]:
    """Return the four experiments by name."""
    return {PPATC: ppatc, ATC: atc, PPATC_HALF: ppatc_half, ATC_HALF: atc_half}


def initial_attitude() -> tuple[Array, Array]:
    """Return q_BN, scalar first, and omega_BN_B in rad/s, of Table 1."""
    _, th, psi = theta = np.radians(THETA_0)
    s, c = np.sin(psi), np.cos(psi)
    G = np.array([[c * np.cos(th), s, 0], [-s * np.cos(th), c, 0], [np.sin(th), 0, 1]])  # (3)
    return Rotation.from_euler("XYZ", theta).as_quat(scalar_first=True), G @ np.radians(THETA_DOT_0)


def _flight(name: str, controller: str, gain_factor: float) -> tuple[System, Experiment]:
    q_BN, omega_BN_B = initial_attitude()
    system = System(
        name=name,
        components={
            "guidance": "EulerSinusoid",
            "environment": "HarmonicTorque",
            "controller": controller,
            "plant": "FlexibleSpacecraft",
        },
        connections=[
            Connection("plant.q_BN", "controller.q_BN", "after_step"),
            Connection("plant.omega_BN_B", "controller.omega_BN_B", "after_step"),
            Connection("guidance.q_RN", "controller.q_RN", "after_step"),
            Connection("guidance.omega_RN_R", "controller.omega_RN_R", "after_step"),
            Connection("guidance.omega_dot_RN_R", "controller.omega_dot_RN_R", "after_step"),
            Connection("controller.tau_command_B", "plant.tau_B", "at_point"),
            # A known function of time: its mean over the step is at hand without an iteration, and second order.
            Connection("environment.tau_dist_B", "plant.tau_dist_B", "midpoint"),
        ],
        held={"plant.h_B": [0.0, 0.0, 0.0]},
        vehicle={
            "J": Value(J, "kg.m2"),
            "delta": Value(np.hstack([F_1, F_2]).T, "kg(1/2).m"),
            "Omega": Value(np.tile(OMEGA, 2), "rad/s"),
            "zeta": [ZETA] * 8,
        },
        parameters={
            "plant.q_BN": q_BN,
            "plant.omega_BN_B": Value(omega_BN_B, "rad/s"),
            "guidance.amplitude": Value([0.5, 1.0, -0.5], "deg"),
            "guidance.frequency": Value([0.1, 0.1, 0.1], "rad/s"),
            "guidance.phase": Value([0.0, 0.0, 0.0], "rad"),
            "guidance.bias": Value([0.0, 0.0, 0.0], "rad"),
            "environment.bias": Value([0.0045, 0.0, 0.0045], "N.m"),
            "environment.sine": Value([0.0, 0.0045, 0.0045], "N.m"),
            "environment.cosine": Value([0.0045, 0.0045, 0.0], "N.m"),
            "environment.frequency": Value(0.0011, "rad/s"),
            **_gains(gain_factor),
            **(_performance() if controller == "PrescribedPerformance" else {}),
        },
    )
    return system, Experiment(stop_time=STOP_TIME, communication_step_size=1e-3, every=10)


def _gains(factor: float) -> dict[str, Any]:
    return {
        "controller.angle_unit": Value(1.0, "deg"),
        "controller.Lambda": LAMBDA,
        "controller.K": [factor * k for k in K],
        "controller.sigma": SIGMA,
        "controller.tau_w": factor * TAU_W,
        "controller.tau_mu": factor * TAU_MU,
        "controller.beta": BETA,
        "controller.gamma": GAMMA,
        "controller.centres": CENTRES,
        "controller.rate_centres": RATE_CENTRES,
        "controller.width": WIDTH,
        "controller.rate_width": WIDTH,
    }


def _performance() -> dict[str, Any]:
    return {
        "controller.rho_0": Value([RHO_0] * 3, "deg"),
        "controller.rho_inf": Value([RHO_INF] * 3, "deg"),
        "controller.k": [DECAY] * 3,
        "controller.overshoot": [OVERSHOOT] * 3,
    }


# What the paper plots


def angles(quaternions: Array) -> Array:
    """Return the Euler angles of sequence 1-2-3 of rows of scalar-first quaternions, deg."""
    return rotations(quaternions).as_euler("XYZ", degrees=True)


def tracking_error(run: Result) -> Array:
    """Return e = theta - theta_d, deg, shape (n, 3)."""
    difference = angles(run["plant.q_BN"]) - angles(run["guidance.q_RN"])
    return (difference + 180) % 360 - 180


def bound(time: Array) -> Array:
    """Return rho, deg."""
    return (RHO_0 - RHO_INF) * np.exp(-DECAY * (time - time[0])) + RHO_INF  # (5)


# Claims


def _largest(run: Result, begin: float = STEADY) -> Array:
    return np.max(np.abs(tracking_error(run)[window(run, begin)]), axis=0)


def _settling(run: Result) -> list[float]:
    e = tracking_error(run)
    times = [settling_time(run.time, e[:, [i]], RHO_INF) for i in range(3)]
    return [np.inf if t is None else t for t in times]


def _margins(run: Result) -> tuple[Array, Array]:
    """Return the extremes of z = e / rho, taken towards the side where e starts, per axis."""
    e = tracking_error(run)
    z = e / bound(run.time)[:, None] * np.where(e[0] >= 0, 1.0, -1.0)
    return z.min(axis=0), z.max(axis=0)


def _within_bounds(run: Result) -> dict[str, bool]:
    least, most = _margins(run)
    return {axis: bool(-OVERSHOOT <= a and b < 1) for axis, a, b in zip(AXES, least, most, strict=True)}


def _swings(run: Result) -> list[int]:
    """Return how often e goes through zero from one swing beyond 0.005 deg to the next, per axis."""
    counts: list[int] = []
    for column in tracking_error(run).T:
        signs = np.sign(column[np.abs(column) > RHO_INF])
        counts.append(int(np.count_nonzero(np.diff(signs))))
    return counts


def _undershoot(run: Result) -> Array:
    """Return how far e goes beyond zero to the other side, deg, per axis."""
    e = tracking_error(run)
    return np.max(-e * np.where(e[0] >= 0, 1.0, -1.0), axis=0).clip(0.0)


def _ppatc_steady(runs: Mapping[str, Result]) -> Measured:
    largest = _largest(runs[PPATC])
    return Measured(f"{shown(largest)} deg", per_axis(largest, lambda e: e <= RHO_INF))


def _ppatc_bounds(runs: Mapping[str, Result]) -> Measured:
    least, most = _margins(runs[PPATC])
    spans = ", ".join(f"{axis} {a:.3f} to {b:.3f}" for axis, a, b in zip(AXES, least, most, strict=True))
    return Measured(f"|e|/rho: {spans}", _within_bounds(runs[PPATC]))


def _ppatc_first(runs: Mapping[str, Result]) -> Measured:
    fast, slow = _settling(runs[PPATC]), _settling(runs[ATC])
    text = f"{'/'.join(f'{t:.1f}' for t in fast)} s, ATC {'/'.join(f'{t:.1f}' for t in slow)} s"
    return Measured(text, {axis: a < b for axis, a, b in zip(AXES, fast, slow, strict=True)})


def _atc_misses(runs: Mapping[str, Result]) -> Measured:
    largest = _largest(runs[ATC])
    return Measured(f"{shown(largest)} deg", per_axis(largest, lambda e: e > RHO_INF))


def _atc_oscillates(runs: Mapping[str, Result]) -> Measured:
    counts, depth = _swings(runs[ATC]), _undershoot(runs[ATC])
    text = f"reversals {'/'.join(map(str, counts))}, undershoot {shown(depth)} deg"
    return Measured(text, per_axis(counts, lambda n: n >= 2))


def _half_ppatc(runs: Mapping[str, Result]) -> Measured:
    full, half = runs[PPATC], runs[PPATC_HALF]
    reduced = tracking_error(half)
    original = tracking_error(full)
    change = np.array([np.interp(half.time, full.time, column) for column in original.T]).T - reduced
    late = np.max(np.abs(change[window(half, 20.0)]), axis=0)
    most = np.max(np.abs(change), axis=0)
    holds = per_axis(most, lambda d: d <= 0.1 * RHO_0, "change,") | per_axis(
        late, lambda d: d <= 0.1 * RHO_INF, "late,"
    )
    holds |= {f"bounds, {axis}": good for axis, good in _within_bounds(half).items()}
    holds |= per_axis(_largest(half), lambda e: e <= RHO_INF, "accuracy,")
    return Measured(f"change at most {shown(most)} deg, after 20 s {shown(late)} deg", holds)


def _half_atc(runs: Mapping[str, Result]) -> Measured:
    before, after = _largest(runs[ATC]), _largest(runs[ATC_HALF])
    shallow, deep = _undershoot(runs[ATC]), _undershoot(runs[ATC_HALF])
    holds = per_axis(after / before, lambda ratio: ratio > 1.1, "accuracy,")
    worse = (deep > 1.1 * shallow) & (deep > RHO_INF)
    holds |= {f"oscillation, {axis}": bool(w) for axis, w in zip(AXES, worse, strict=True)}
    text = f"steady {shown(before)} -> {shown(after)} deg, undershoot {shown(shallow)} -> {shown(deep)} deg"
    return Measured(text, holds)


def _vibration(run: Result, begin: float, end: float) -> float:
    """Return the amplitude of mode 1 of panel 1, from its rate: that hides the slow part due to the reference."""
    return float(np.max(np.abs(run["plant.eta_dot"][window(run, begin, end), 0]))) / float(OMEGA[0])


def _suppressed(runs: Mapping[str, Result]) -> Measured:
    run = runs[PPATC]
    early, late = _vibration(run, 20.0, 50.0), _vibration(run, 170.0, 200.0)
    # Rate of decay between windows 150 s apart, over the panel's own; a motionless panel has no decay to compare.
    rate = np.log(early / late) / 150.0 / (ZETA * OMEGA[0]) if early > 0 and late > 0 else np.inf
    peaks = [float(np.max(np.abs(runs[name]["plant.eta"][:, 0]))) for name in (PPATC, ATC)]
    text = f"peak eta_11 {peaks[0]:.2g}, ATC {peaks[1]:.2g} kg^1/2 m; decay {rate:.2f} times its own damping's"
    holds = {
        "decays": late < early / 2 or early == 0,
        "faster than by its own damping": bool(rate > 1.5),
        "excited no more than by ATC": peaks[0] <= 1.1 * peaks[1],
    }
    return Measured(text, holds)


def _claim(
    text: str, said: str, criterion: str, measure: Callable[[Mapping[str, Result]], Measured], *runs: str
) -> Claim:
    return Claim(
        paper="zhang2018",
        text=text,
        paper_number=said,
        criterion=criterion,
        runs=runs,
        until=STOP_TIME,
        measure=measure,
    )


CLAIMS = (
    _claim(
        "PPATC: steady-state error within 0.005 deg",
        "0.005 deg",
        "max |e_i| from 100 s on is at most 0.005 deg, on each axis",
        _ppatc_steady,
        PPATC,
    ),
    _claim(
        "PPATC: error within its bounds, no overshoot",
        "0 < |e|/rho < 1",
        "e_i keeps its sign and stays below rho at every row, on each axis",
        _ppatc_bounds,
        PPATC,
    ),
    _claim(
        "PPATC settles before ATC",
        "figures 2-4",
        "the last time at which |e_i| exceeds 0.005 deg is earlier than with ATC, on each axis",
        _ppatc_first,
        PPATC,
        ATC,
    ),
    _claim(
        "ATC misses the accuracy of 0.005 deg",
        "> 0.005 deg",
        "max |e_i| from 100 s on is more than 0.005 deg, on each axis",
        _atc_misses,
        ATC,
    ),
    _claim(
        "ATC: error visibly oscillates",
        "figures 2-4",
        "e_i reverses at least twice between swings of more than 0.005 deg, on each axis",
        _atc_oscillates,
        ATC,
    ),
    _claim(
        "half gains: PPATC changes little and keeps its bounds",
        "figures 9-11",
        "e_i changes by at most 10 % of rho_0 at any time and of rho_inf from 20 s on, stays within its bounds, and "
        "within 0.005 deg from 100 s on, on each axis",
        _half_ppatc,
        PPATC,
        PPATC_HALF,
    ),
    _claim(
        "half gains: ATC less accurate, oscillates more",
        "figures 9-11",
        "max |e_i| from 100 s on grows by more than 10 %; the undershoot too, to more than 0.005 deg; on each axis",
        _half_atc,
        ATC,
        ATC_HALF,
    ),
    _claim(
        "PPATC suppresses the panels' vibration",
        "figure 8",
        "mode 1 of panel 1: its vibration more than halves from 20-50 s to 170-200 s; more than 1.5 times as fast as "
        "by the panel's own damping; its peak is at most 10 % above that with ATC",
        _suppressed,
        PPATC,
        ATC,
    ),
)


# Figures

SHORT = {PPATC: "PPATC", ATC: "ATC", PPATC_HALF: "PPATC, half gains", ATC_HALF: "ATC, half gains"}
LOOKS: dict[str, dict[str, Any]] = {  # blue: PPATC, orange: ATC, the paler with half gains
    "PPATC": {"color": plots.COLOURS[0], "linestyle": plots.LINES[0]},
    "ATC": {"color": plots.COLOURS[1], "linestyle": plots.LINES[1]},
    "PPATC, half gains": {"color": plots.COLOURS[5], "linestyle": plots.LINES[2]},
    "ATC, half gains": {"color": plots.COLOURS[4], "linestyle": plots.LINES[3], "linewidth": 1.8},
}


def figures(results: Mapping[str, Result]) -> dict[str, Figure]:
    """Return the paper's figures 2-11, as far as `results` has the runs."""
    runs = {SHORT[name]: results[name] for name in SHORT if name in results and len(results[name]) > 1}
    full = {name: runs[name] for name in ("PPATC", "ATC") if name in runs}
    half = {name: run for name, run in runs.items() if name not in full}
    drawn: dict[str, Figure] = {}
    with mpl.rc_context(plots.STYLE):
        if full:
            drawn["fig02-04_tracking_error"] = _errors(full, "Tracking error (figures 2-4)")
        if "PPATC" in full:
            run = full["PPATC"]
            drawn["fig05_attitude"] = _attitude(run)
            drawn["fig06_rates"] = _rates(run)
            drawn["fig07_torque"] = _torque(run)
            if series(run, "plant.eta") is not None:
                drawn["fig08_modal_coordinates"] = _modes(run)
        if half:
            drawn["fig09-11_tracking_error_half_gains"] = _errors(
                full | half, "Tracking error, half gains (figures 9-11)"
            )
    return drawn


def _errors(runs: Mapping[str, Result], title: str) -> Figure:
    """Draw e per axis with the performance bounds: the transient on the left, the steady state on the right."""
    end = max(run.time[-1] for run in runs.values())
    columns = 2 if end > STEADY else 1
    figure, grid = plots.panels(3, columns, title, height=2.1)
    longest = max(runs.values(), key=lambda run: run.time[-1])
    rho = bound(longest.time)
    errors = {name: tracking_error(run) for name, run in runs.items()}
    for i, (row, axis) in enumerate(zip(grid, AXES, strict=True)):
        for name, run in runs.items():
            for ax in row:
                ax.plot(run.time, errors[name][:, i], label=name, **LOOKS[name])
        lo, hi = (-OVERSHOOT, 1.0) if THETA_0[i] >= 0 else (-1.0, OVERSHOOT)
        for ax in row:
            ax.fill_between(longest.time, lo * rho, hi * rho, color="#000000", alpha=0.07, linewidth=0, label="bounds")
            for side in (lo, hi):
                ax.plot(longest.time, side * rho, color=plots.GREY, linewidth=0.8)
        row[0].set_ylabel(f"$e_{i + 1}$, {axis} (deg)")
        row[0].set_xlim(0, min(60.0, end))
        if columns == 2:
            row[1].set_xlim(STEADY, end)
            row[1].set_ylim(-1.3 * RHO_INF, 1.3 * RHO_INF)
    if columns == 2:
        grid[0][0].set_title("transient")
        grid[0][1].set_title("steady state")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=5)
    return figure


def _attitude(run: Result) -> Figure:
    traces = {"body": (run.time, angles(run["plant.q_BN"])), "reference": (run.time, angles(run["guidance.q_RN"]))}
    names = [rf"${symbol}$, {axis}" for symbol, axis in zip((r"\varphi", r"\theta", r"\psi"), AXES, strict=True)]
    figure, _ = plots.stack(traces, names, "deg", "Attitude, PPATC (figure 5)")
    plots.legend(figure)
    return figure


def _rates(run: Result) -> Figure:
    traces = {"body": (run.time, np.degrees(run["plant.omega_BN_B"]))}
    wanted = plots.reference_rate(run)
    if wanted is not None:
        traces["reference"] = (run.time, np.degrees(wanted))
    figure, _ = plots.stack(traces, [rf"$\omega_{axis}$" for axis in "xyz"], "deg/s", "Body rate, PPATC (figure 6)")
    plots.legend(figure)
    return figure


def _torque(run: Result) -> Figure:
    """Draw u on the left, and on the right what remains after the first seconds."""
    rows = run["controller.tau_command_B"]
    later = 20.0
    columns = 2 if run.time[-1] > 1.5 * later else 1
    figure, grid = plots.panels(3, columns, "Control torque, PPATC (figure 7)")
    for i, row in enumerate(grid):
        row[0].plot(run.time, rows[:, i], label="PPATC", **plots.look(0))
        row[0].set_ylabel(plots.label(f"$u_{i + 1}$, {AXES[i]}", "N.m"))
        row[0].set_xlim(0, min(later, run.time[-1]))
        if columns == 2:
            rest = run.time >= later
            row[1].plot(run.time[rest], rows[rest, i], label="PPATC", **plots.look(0))
            row[1].set_xlim(later, run.time[-1])
    if columns == 2:
        grid[0][0].set_title(f"first {later:g} s")
        grid[0][1].set_title(f"from {later:g} s on")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure)
    return figure


def _modes(run: Result) -> Figure:
    traces = {"PPATC": (run.time, run["plant.eta"][:, :4])}
    names = [rf"$\eta_{{1{i + 1}}}$" for i in range(4)]
    figure, _ = plots.stack(traces, names, "kg(1/2).m", "Modal coordinates of panel 1, PPATC (figure 8)", width=0.9)
    plots.legend(figure)
    return figure
