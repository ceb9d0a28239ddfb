"""Figures of components, each flown or evaluated from the component itself: name -> what draws it and its caption."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import freqs_zpk, ss2zpk
from scipy.spatial.transform import Rotation

from components.catalog import CATALOG
from components.framework.component import start_vector
from components.mathematics import bearing
from cosim import Connection, Experiment, Result, Signal, System, Value, simulate

DEGREE = np.pi / 180
INCH = (6.4, 2.9)  # a figure with one row of axes

Drawn = tuple[Any, str]
"""A figure and its caption."""


def alone(component: str, stop: float, step: float, **values: Any) -> Result:
    """Fly one component; a `Signal` feeds an input, any other value sets a parameter."""
    fed = {f"unit.{name}": value for name, value in values.items() if isinstance(value, Signal)}
    system = System(
        name="alone",
        components={"unit": component},
        parameters={f"unit.{name.replace('__', '.')}": v for name, v in values.items() if not isinstance(v, Signal)},
        inputs=fed,
        hold_unconnected=True,
    )
    return simulate(system, Experiment(stop_time=stop, communication_step_size=step))


def response(name: str, **values: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies, in Hz, and the complex gain of a signal with one element, from its own equations."""
    part = CATALOG[name](width=1, unit="N.m", **values)
    groups = {"x": part.states, "u": part.inputs, "p": part.parameters, "c": part.calculated_parameters}
    at = {key: ca.SX.sym(key, part.size(group)) for key, group in groups.items()}
    functions = part.functions
    arguments = {"t": 0.0, **at}
    rates, outputs = (f(*(arguments.get(n, 0.0) for n in f.name_in())) for f in (functions.rates, functions.outputs))
    blocks = [ca.jacobian(f, at[v]) for f in (rates, outputs) for v in ("x", "u")]
    numbers = ca.Function("linear", list(at.values()), blocks)(*(start_vector(g) for g in groups.values()))
    A, B, C, D = (np.array(block) for block in numbers)
    f = np.geomspace(0.1, 100, 400)
    zeros, poles, gain = ss2zpk(A, B, C[:1], D[:1])
    return f, freqs_zpk(zeros, poles, gain, 2 * np.pi * f)[1]


def row(count: int = 1, **size: Any) -> tuple[Any, Any]:
    return plt.subplots(1, count, figsize=INCH, layout="constrained", **size)


def named(ax: Any, x: str, y: str) -> None:
    ax.set(xlabel=x, ylabel=y)
    ax.grid(color="#d9d9d9")


def notch() -> Drawn:
    figure, axes = row(2)
    for depth, style in ((0.0, "-"), (0.1, "--"), (0.5, ":")):
        f, H = response("Notch", zeta_z=[0.5 * depth], zeta_p=[0.5], frequency=[8 * np.pi])
        gain = 20 * np.log10(np.maximum(np.abs(H), 1e-3))
        axes[0].semilogx(f, gain, style, label=f"zeta_z = {0.5 * depth:g}")
        axes[1].semilogx(f, np.angle(H) / DEGREE, style)
    named(axes[0], "frequency (Hz)", "gain (dB)")
    named(axes[1], "frequency (Hz)", "phase (deg)")
    axes[0].set_ylim(-45, 3)
    axes[0].legend(loc="lower left")
    return figure, "Frequency response for a frequency of 4 Hz and zeta_p = 0.5."


def passes(name: str, caption: str, **values: Any) -> Drawn:
    """Draw what a signal makes of a sine of 1 Hz."""
    sine = Signal.of(lambda t: np.sin(2 * np.pi * t), step=0.005, stop=2.0)
    run = alone(f"{name}:width=1,unit=N.m", 2.0, 0.005, u=sine, **values)
    figure, ax = row()
    ax.plot(run.time, run["unit.u"], "--", label="u")
    ax.plot(run.time, run["unit.y"], label="y")
    named(ax, "time (s)", "N m")
    ax.legend(loc="upper right")
    return figure, caption


def slew() -> Drawn:
    figure, axes = row(3)
    for smooth, style in ((1, "-"), (0, "--")):
        run = alone("Slew", 130.0, 0.1, angle=Value(60, "deg"), smooth=smooth)
        turned = 2 * np.arctan2(run["unit.q_RN"][:, 2], run["unit.q_RN"][:, 0])
        curves = (turned, run["unit.omega_RN_R"][:, 1], run["unit.omega_dot_RN_R"][:, 1])
        for ax, curve in zip(axes, curves, strict=True):
            ax.plot(run.time, curve / DEGREE, style, label="smooth" if smooth else "bang-bang")
    for ax, unit in zip(axes, ("angle (deg)", "rate (deg/s)", "acceleration (deg/s2)"), strict=True):
        named(ax, "time (s)", unit)
    axes[0].legend(loc="lower right")
    return figure, "A turn of 60 deg within 1 deg/s and 0.1 deg/s2."


def wheels() -> Drawn:
    figure, ax = row()
    speed = np.linspace(-8, 8, 801)
    for static, style in ((0.0, "--"), (2e-3, "-")):
        torque = np.array([float(bearing.friction(w, 1e-3, static, 1.0, 1e-4)) for w in speed])
        ax.plot(speed, 1e3 * torque, style, label=f"static_friction = {1e3 * static:g} mN m")
    named(ax, "wheel_speed (rad/s)", "friction (mN m)")
    ax.legend(loc="upper left")
    return figure, "Friction: coulomb_friction 1 mN m, stribeck_speed 1 rad/s, friction 0.1 mN m s/rad."


def gyro() -> Drawn:
    T, sigma_v, sigma_u = 0.1, 1e-5, 1e-6
    values = {"angle_random_walk": [sigma_v] * 3, "rate_random_walk": [sigma_u] * 3}
    run = alone("Gyro", 4000.0, T, sample_time=T, **values)
    angle = np.cumsum(run["unit.omega_BN_B"], axis=0) * T
    sizes = np.unique(np.geomspace(1, len(angle) // 8, 30).astype(int))
    deviation = [
        np.sqrt(np.mean((angle[2 * n :] - 2 * angle[n:-n] + angle[: -2 * n]) ** 2) / 2) / (n * T) for n in sizes
    ]
    tau = sizes * T
    figure, ax = row()
    ax.loglog(tau, deviation, "o", ms=3.5, label="measured, three axes")
    ax.loglog(tau, np.sqrt(sigma_v**2 / tau + sigma_u**2 * tau / 3), label="(sigma_v^2 / tau + sigma_u^2 tau / 3)^1/2")
    named(ax, "averaging time tau (s)", "Allan deviation (rad/s)")
    ax.legend(loc="upper center")
    return figure, "Allan deviation of 4000 s at rest, sigma_v = 1e-5 rad/s^1/2, sigma_u = 1e-6 rad/s^3/2."


def star_tracker() -> Drawn:
    rate = 0.01  # rad/s
    turn = Signal.of(lambda t: [np.cos(rate * t / 2), np.sin(rate * t / 2), 0, 0], step=0.05, stop=4.0)
    late = {"sample_time": 0.05, "samples_per_measurement": 10, "latency": 0.25}
    run = alone("StarTracker", 4.0, 0.05, q_BN_true=turn, cross_noise=Value(30, "arcsec"), **late)
    figure, ax = row()
    for name, style, label in (("q_BN_true", "--", "attitude"), ("q_BN", "-", "measured")):
        ax.step(run.time, 2 * np.arcsin(run[f"unit.{name}"][:, 1]) / DEGREE, style, where="post", label=label)
    named(ax, "time (s)", "turned about x (deg)")
    ax.legend(loc="upper left")
    return figure, "A turn at 0.01 rad/s seen twice a second, 0.25 s late, with 30 arcsec of noise."


def mekf() -> Drawn:
    walks = {"angle_random_walk": Value(0.02, "deg/h^(1/2)"), "rate_random_walk": Value(0.5, "deg/h^(3/2)")}
    noise = {"cross_noise": Value(5, "arcsec"), "roll_noise": Value(30, "arcsec")}
    measured = {
        "gyro.omega_BN_B": "filter.omega_BN_B_measured",
        "tracker.q_BN": "filter.q_BN_measured",
        "tracker.exposure_time": "filter.exposure_time",
        "tracker.valid": "filter.valid_measured",
    }
    true = [("q_BN", "gyro"), ("omega_BN_B", "gyro"), ("q_BN", "tracker")]
    system = System(
        name="estimating",
        components={"plant": "FlexibleSpacecraft:modes=0", "gyro": "Gyro", "tracker": "StarTracker", "filter": "MEKF"},
        connections=[
            *(Connection(f"plant.{name}", f"{sensor}.{name}_true", "after_step") for name, sensor in true),
            *(Connection(source, target, "after_step") for source, target in measured.items()),
        ],
        parameters={
            "plant.omega_BN_B": Value([0.1, 0, 0], "deg/s"),
            "gyro.integrating": 1,
            "gyro.bias": Value([3, -2, 4], "deg/h"),
            "tracker.samples_per_measurement": 5,
            "tracker.sample_time": 0.1,
            **{f"{unit}.sample_time": 0.1 for unit in ("gyro", "filter")},
            **{f"gyro.{name}": value for name, value in walks.items()},
            **{f"tracker.{name}": value for name, value in noise.items()},
            **{f"filter.{name}": value for name, value in (walks | noise).items()},
        },
        hold_unconnected=True,
    )
    run = simulate(system, Experiment(stop_time=300.0, communication_step_size=0.1))
    figure, axes = row(2)
    turned = (Rotation.from_quat(run[f"{unit}.q_BN"], scalar_first=True) for unit in ("plant", "filter"))
    off = next(turned).inv() * next(turned)
    bias = run["filter.bias"] - run["gyro.bias"]
    hour = 3600 / DEGREE
    for ax, error, sigma in (
        (axes[0], off.as_rotvec() * hour, run["filter.sigma_q_BN"] * hour),
        (axes[1], bias * hour, run["filter.sigma_bias"] * hour),
    ):
        for i, name in enumerate("xyz"):
            ax.plot(run.time, error[:, i], lw=0.9, color=f"C{i}", label=name)
            ax.plot(run.time, 3 * sigma[:, i], ":", lw=0.9, color=f"C{i}")
            ax.plot(run.time, -3 * sigma[:, i], ":", lw=0.9, color=f"C{i}")
    named(axes[0], "time (s)", "attitude (arcsec)")
    named(axes[1], "time (s)", "bias (deg/h)")
    axes[0].set_ylim(-40, 40)
    axes[1].set_ylim(-6, 6)
    axes[0].legend(loc="upper right", ncols=3)
    return figure, "Estimate less truth, with three deviations to either side (dotted); tracker at 2 Hz, gyro at 10 Hz."


FIGURES: dict[str, Callable[[], Drawn]] = {
    "Delay": lambda: passes("Delay", "A sine of 1 Hz, one sample of 0.1 s late.", sample_time=0.1),
    "Gyro": gyro,
    "LowPass": lambda: passes("LowPass", "A sine of 1 Hz through a low-pass of 1 Hz.", bandwidth=Value(1, "Hz")),
    "MEKF": mekf,
    "Notch": notch,
    "Quantiser": lambda: passes("Quantiser", "A sine in steps of 0.25 N m.", quantum=0.25),
    "RateLimiter": lambda: passes("RateLimiter", "A sine of 1 Hz that may change by 3 N m/s.", rate=3.0),
    "ReactionWheels": wheels,
    "Saturation": lambda: passes("Saturation", "A sine within 0.6 N m.", limit=0.6),
    "Slew": slew,
    "StarTracker": star_tracker,
}
