"""The claims of li2014, each with the criterion that decides it, from the plant's variables."""

from collections.abc import Mapping, Sequence

import numpy as np

from components.numbers.li2014 import GAMMA
from cosim.results.result import Result
from cosim.studies.metrics import settling_time
from cosim.studies.papers.claims import Claim, Measure, Measured, Readings, format_all
from cosim.studies.papers.li2014.lyapunov import lyapunov
from cosim.studies.papers.li2014.spectrum import (
    GOCE_REQUIREMENT,
    above_lisa_pathfinder,
    attitude,
    contact,
    highest,
    relative_attitude,
    relative_position,
    residual_density,
    satellite_density,
    tail,
)
from cosim.studies.papers.li2014.system import (
    ACTUATORS,
    CAGE_TIME,
    CONSISTENT,
    DESIGN,
    DESIGN_CONSISTENT,
    DESIGN_GAMMA,
    DESIGN_NO_NN,
    DESIGN_PRINTED,
    GAMMA_10,
    NN,
    NN_SPECTRUM,
    NO_NN,
    NO_NN_SPECTRUM,
    PRINTED,
    PRINTED_START,
    SPECTRUM_TIME,
    STOP_TIME,
)

ACCURACY = 1e-6  # m, the paper's
ANGLE = 1e-6  # rad, where an attitude counts as zero
NOTHING = 1e-15  # rad, of an angle of 0.02 rad a rounding
STRONGEST_FORCE = 20e-3  # N, of the ion thruster
ROUNDING, HELD, GONE = 1e-12, 0.01, 1e-3  # of V: what may grow, what commands held for 2 ms change, what counts as zero


PAPERS_OWN = {  # readings of what the paper flew, the most literal first -> with the network, without
    "design model as printed": (DESIGN_PRINTED, DESIGN_NO_NN),
    "design model": (DESIGN, DESIGN_NO_NN),
    "design model, Gamma = 10": (DESIGN_GAMMA, DESIGN_NO_NN),
    "full equations": (NN, NO_NN),
    "full equations, Gamma = 10": (GAMMA_10, NO_NN),
}
FLOWN = tuple(dict.fromkeys(name for pair in PAPERS_OWN.values() for name in pair))
CHOSEN = "gains k = 1/s, lambda = 1/s2, Gamma, the grid, W(0) = 0, starts of y and z, a drag of 7 mN"


def _position(runs: Mapping[str, Result]) -> Readings:
    readings: dict[str, Measured] = {}
    for reading, names in PAPERS_OWN.items():
        found, without = (tail(runs[name], relative_position(runs[name])) for name in names)
        text = f"{found:.3g} m (without the network {without:.3g} m)"
        readings[reading] = Measured(text, {"within": found <= ACCURACY})
    return readings


def _attitudes(runs: Mapping[str, Result]) -> Readings:
    readings: dict[str, Measured] = {}
    for reading, names in PAPERS_OWN.items():
        pairs = [[tail(runs[name], angles(runs[name])) for angles in (attitude, relative_attitude)] for name in names]
        (satellite, mass), (a, b) = pairs
        text = f"{satellite:.2g} and {mass:.2g} rad (without the network {a:.2g} and {b:.2g} rad)"
        readings[reading] = Measured(text, {"satellite": satellite <= ANGLE, "test mass": mass <= ANGLE})
    return readings


def _compensates(runs: Mapping[str, Result]) -> Readings:
    readings: dict[str, Measured] = {}
    for reading in ("design model", "full equations"):
        found, without = (tail(runs[name], relative_position(runs[name])) for name in PAPERS_OWN[reading])
        ratio = without / found if found > 0 else np.inf
        text = f"error smaller by {ratio:.2g} in the tail"
        readings[reading] = Measured(text, {"tail": ratio >= 10})
    (f, on), (_, off) = (residual_density(runs[name]) for name in (NN_SPECTRUM, NO_NN_SPECTRUM))
    gain = off[:, 0] / np.where(on[:, 0] > 0, on[:, 0], np.inf)
    slow, fast = (float(np.median(gain[np.abs(f - at) <= 0.1 * at])) for at in (5e-3, 0.1))
    whole = readings["full equations"]
    text = f"{whole.text}, {slow:.2g} at 5 mHz, {fast:.2g} at 0.1 Hz"
    holds = {**whole.holds, "5 mHz": slow >= 10, "0.1 Hz": fast >= 10}
    return readings | {"full equations": Measured(text, holds)}


def _theorem(runs: Mapping[str, Result]) -> Readings:
    readings: dict[str, Measured] = {}
    for reading, name, Gamma in (
        ("design model as printed", DESIGN_PRINTED, GAMMA),
        ("design model", DESIGN, GAMMA),
        ("design model, Gamma = 10", DESIGN_GAMMA, 10 * GAMMA),
    ):
        time, loops = runs[name].time, lyapunov(runs[name], Gamma).values()
        grown = max(float(np.diff(loop.V).max() / loop.V[0]) for loop in loops)
        spans = np.diff(time)
        lost = [spans @ (loop.V_dot[1:] + loop.V_dot[:-1]) / 2 / (loop.V[-1] - loop.V[0]) for loop in loops]
        left = [float(loop.V[-1] / loop.V[0]) for loop in loops]
        errors = [tail(runs[name], rows(runs[name])) for rows in (relative_position, attitude, relative_attitude)]
        distances = [loop.distance[-1] for loop in loops]
        text = (
            f"V never grows, it falls by {format_all(lost, 4)} of the integral of (20), to {format_all(left, 2)} of "
            f"its start; |W* - W| ends at {format_all(distances, 2)} of |W*|; x1 ends below {max(errors):.2g} m or rad"
            if grown <= ROUNDING
            else f"V grows by {grown:.2g} of its start"
        )
        holds = {
            "V never grows": grown <= ROUNDING,
            "V' is (20)": all(abs(ratio - 1) <= HELD for ratio in lost),
            "x to zero": max(errors) <= ANGLE,
            "negative definite": max(left) <= GONE,
        }
        readings[reading] = Measured(text, holds)
    unknown = Measured("f depends on time there: no constant W, nothing to judge", {})
    return readings | {"full equations": unknown}


def _printed_signs(runs: Mapping[str, Result]) -> Readings:
    readings: dict[str, Measured] = {}
    for reading, names in (("plant and law", (DESIGN_PRINTED, DESIGN)), ("law alone", (PRINTED, NN))):
        printed, other = (relative_attitude(runs[name]) for name in names)
        moved = float(np.abs(printed - other).max())
        text = f"relative attitude moved by at most {moved:.2g} rad"
        readings[reading] = Measured(text, {"unmoved": moved <= ANGLE})
    return readings


def _consistent(runs: Mapping[str, Result]) -> Readings:
    readings: dict[str, Measured] = {}
    for reading, names in (("design model", (DESIGN_CONSISTENT, DESIGN)), ("full equations", (CONSISTENT, NN))):
        angles = [(runs[name], relative_attitude(runs[name])) for name in names]
        found, printed = (tail(run, rows) for run, rows in angles)
        times = [settling_time(run.time, rows, ANGLE) for run, rows in angles]
        after, before = (np.inf if time is None else time for time in times)
        text = f"{found:.2g} rad, with the printed one {printed:.2g}; within 1e-6 rad at {after:.1f} s, {before:.1f} s"
        holds = {"settles no later": bool(after <= before)}
        left = {"tail": found <= printed / 10} if printed > NOTHING else {}
        readings[reading] = Measured(text, left | holds)
    return readings


def _thrusters(runs: Mapping[str, Result]) -> Measured:
    asked = float(np.abs(runs[NN]["controller.f_command_S"][0]).max())
    caught = contact(runs[PRINTED_START])
    then = "the test mass stays free" if caught is None else f"the test mass is at its cage after {caught:.1f} s"
    text = f"asks {asked:.3g} N of thrusters with 20 mN; limited, {then}"
    return Measured(text, {"command": asked <= STRONGEST_FORCE, "free": caught is None})


def _quiet(runs: Mapping[str, Result]) -> Measured:
    on, off, real = (residual_density(runs[name]) for name in (NN_SPECTRUM, NO_NN_SPECTRUM, ACTUATORS))
    peaks = [highest(spectrum) for spectrum in (on, off, real)]
    satellite = [highest(satellite_density(runs[name])) for name in (NN_SPECTRUM, ACTUATORS)]
    ratios = [above_lisa_pathfinder(spectrum) for spectrum in (on, off, real)]
    text = (
        f"test mass {peaks[0]:.3g}, without the network {peaks[1]:.3g}, with limits and noise {peaks[2]:.2g} "
        f"m/s2/sqrt(Hz): {ratios[0]:.2g}, {ratios[1]:.2g}, {ratios[2]:.2g} of LISA Pathfinder's; satellite "
        f"{satellite[0]:.2g}, with limits and noise {satellite[1]:.2g} m/s2/sqrt(Hz)"
    )
    holds = {
        "GOCE, network": satellite[0] <= GOCE_REQUIREMENT,
        "GOCE, limits and noise": satellite[1] <= GOCE_REQUIREMENT,
        "LISA Pathfinder, network": ratios[0] <= 1,
        "LISA Pathfinder, limits and noise": ratios[2] <= 1,
    }
    return Measured(text, holds)


def _claim(
    text: str,
    said: str,
    criterion: str,
    measure: Measure,
    runs: Sequence[str],
    until: float = STOP_TIME,
    depends: str = "",
    beyond: bool = False,
) -> Claim:
    return Claim(
        paper="li2014",
        text=text,
        paper_number=said,
        criterion=criterion,
        runs=runs,
        until=until,
        measure=measure,
        depends=depends,
        beyond=beyond,
    )


UNKNOWN = "f: on the design model constant weights, on the full equations drag and gravity along an orbit"
CLAIMS = (
    _claim(
        "the relative position goes to zero, within 1e-6 m",
        "1e-6 m",
        "the largest |component| over 100-200 s is at most 1e-6 m",
        _position,
        FLOWN,
        depends=f"{CHOSEN}; {UNKNOWN}",
    ),
    _claim(
        "attitude and relative attitude go to zero",
        "figures 2-3",
        "the largest angle over 100-200 s is at most 1e-6 rad, of satellite and of test mass",
        _attitudes,
        FLOWN,
        depends=f"{CHOSEN}; the threshold; {UNKNOWN}",
    ),
    _claim(
        "the network compensates the unknown",
        "text",
        "it makes the error smaller at least ten times: over 100-200 s; on the full equations at 5 mHz and 0.1 Hz too",
        _compensates,
        (DESIGN, DESIGN_NO_NN, NN, NO_NN, NN_SPECTRUM, NO_NN_SPECTRUM),
        depends=f"{CHOSEN}; the factor, the frequencies, the gusts; {UNKNOWN}",
    ),
    _claim(
        "theorem 1: V' of (20) is negative definite, so x11 and z12 go to zero from anywhere",
        "(19)-(23)",
        f"per loop: V never grows from row to row by more than {ROUNDING:g} of its start; it falls by the integral of "
        f"(20) within {100 * HELD:g} %; x1 over 100-200 s at most 1e-6; negative definite in all that V is made of: V "
        f"falls below {GONE:g} of its start",
        _theorem,
        (DESIGN_PRINTED, DESIGN, DESIGN_GAMMA),
        depends=f"{CHOSEN}; f = W^T h with equal weights",
    ),
    _claim(
        "meets drag-free needs with the thrusters that it names",
        "text, without limits",
        "the force asked for at the printed start is at most 20 mN, and with the limits the test mass stays free",
        _thrusters,
        (NN, PRINTED_START),
        CAGE_TIME,
        depends="the thrusters' limits, all ours; gains k = 1/s, lambda = 1/s2",
        beyond=True,
    ),
    _claim(
        "residual acceleration within drag-free requirements",
        "none",
        "x axis, LVLH, gusts, network: the satellite's density is at most 2.5e-8 m/s2/sqrt(Hz) (GOCE, 5-100 mHz), the "
        "test mass's at most 3e-14 (1 + (f/3 mHz)^2) (LISA Pathfinder, 2.5-30 mHz); with ideal actuators, and with "
        "limits and noise",
        _quiet,
        (NN_SPECTRUM, NO_NN_SPECTRUM, ACTUATORS),
        SPECTRUM_TIME,
        depends="limits, noise and gusts, all ours; gains of the flight with limits",
        beyond=True,
    ),
    _claim(
        "the printed signs of a2, b2 do no harm, for the law cancels spring and damper",
        "+K_r/I_tm, +D_r/I_tm",
        "the relative attitude with the printed signs and with those of (5) differ by at most 1e-6 rad, always",
        _printed_signs,
        (DESIGN_PRINTED, DESIGN, PRINTED, NN),
        depends="the threshold; the spring's torque is small beside the law's",
        beyond=True,
    ),
    _claim(
        "the consistent feed-forward, u2 and what network 2 has learnt, keeps the satellite's disturbance from loop 3",
        "u2 alone",
        "the largest relative attitude over 100-200 s is at most a tenth of that with the printed feed-forward, where "
        "that is above rounding (1e-15 rad); it is within 1e-6 rad no later",
        _consistent,
        (DESIGN_CONSISTENT, DESIGN, CONSISTENT, NN),
        depends=f"the factor, the threshold; {UNKNOWN}",
        beyond=True,
    ),
)
