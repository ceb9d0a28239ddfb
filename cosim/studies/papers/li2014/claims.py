"""The claims of li2014, each with the criterion that decides it, from the plant's variables."""

from collections.abc import Mapping

import numpy as np

from cosim.results.result import Result
from cosim.studies.papers.claims import Claim, Measure, Measured
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
    NN,
    NN_SPECTRUM,
    NO_NN,
    NO_NN_SPECTRUM,
    PRINTED_START,
    SPECTRUM_TIME,
    STOP_TIME,
)

ACCURACY = 1e-6  # m, the paper's
ANGLE = 1e-6  # rad, where an attitude counts as zero
STRONGEST_FORCE = 20e-3  # N, of the ion thruster


def _position(runs: Mapping[str, Result]) -> Measured:
    found, without = (tail(runs[name], relative_position(runs[name])) for name in (NN, NO_NN))
    return Measured(f"{found:.3g} m (without the network {without:.3g} m)", {"within": found <= ACCURACY})


def _attitudes(runs: Mapping[str, Result]) -> Measured:
    pairs = [[tail(runs[name], angles(runs[name])) for angles in (attitude, relative_attitude)] for name in (NN, NO_NN)]
    (satellite, mass), (a, b) = pairs
    text = f"{satellite:.2g} and {mass:.2g} rad (without the network {a:.2g} and {b:.2g} rad)"
    return Measured(text, {"satellite": satellite <= ANGLE, "test mass": mass <= ANGLE})


def _compensates(runs: Mapping[str, Result]) -> Measured:
    with_network, without = (tail(runs[name], relative_position(runs[name])) for name in (NN, NO_NN))
    ratio = without / with_network if with_network > 0 else np.inf
    (f, on), (_, off) = (residual_density(runs[name]) for name in (NN_SPECTRUM, NO_NN_SPECTRUM))
    gain = off[:, 0] / np.where(on[:, 0] > 0, on[:, 0], np.inf)
    slow, fast = (float(np.median(gain[np.abs(f - at) <= 0.1 * at])) for at in (5e-3, 0.1))
    text = f"error smaller by {ratio:.2g} in the tail, {slow:.2g} at 5 mHz, {fast:.2g} at 0.1 Hz"
    return Measured(text, {"tail": ratio >= 10, "5 mHz": slow >= 10, "0.1 Hz": fast >= 10})


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


def _claim(text: str, said: str, criterion: str, measure: Measure, until: float, *runs: str) -> Claim:
    return Claim(
        paper="li2014", text=text, paper_number=said, criterion=criterion, runs=runs, until=until, measure=measure
    )


CLAIMS = (
    _claim(
        "the relative position goes to zero, within 1e-6 m",
        "1e-6 m",
        "the largest |component| over 100-200 s is at most 1e-6 m",
        _position,
        STOP_TIME,
        NN,
        NO_NN,
    ),
    _claim(
        "attitude and relative attitude go to zero",
        "figures 2-3",
        "the largest angle over 100-200 s is at most 1e-6 rad, of satellite and of test mass",
        _attitudes,
        STOP_TIME,
        NN,
        NO_NN,
    ),
    _claim(
        "the network compensates the unknown",
        "text",
        "it makes the error smaller at least ten times: over 100-200 s, at 5 mHz and at 0.1 Hz",
        _compensates,
        STOP_TIME,
        NN,
        NO_NN,
        NN_SPECTRUM,
        NO_NN_SPECTRUM,
    ),
    _claim(
        "meets drag-free needs with the thrusters that it names",
        "text",
        "the force asked for at the printed start is at most 20 mN, and with the limits the test mass stays free",
        _thrusters,
        CAGE_TIME,
        NN,
        PRINTED_START,
    ),
    _claim(
        "beyond the paper: residual acceleration within drag-free requirements",
        "none",
        "x axis, LVLH, gusts, network: the satellite's density is at most 2.5e-8 m/s2/sqrt(Hz) (GOCE, 5-100 mHz), the "
        "test mass's at most 3e-14 (1 + (f/3 mHz)^2) (LISA Pathfinder, 2.5-30 mHz); with ideal actuators, and with "
        "limits and noise",
        _quiet,
        SPECTRUM_TIME,
        NN_SPECTRUM,
        NO_NN_SPECTRUM,
        ACTUATORS,
    ),
)
