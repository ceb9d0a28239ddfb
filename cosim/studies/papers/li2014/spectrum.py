"""What li2014 is about: how quiet the test mass is, and how far cage and attitudes are off.

amplitude spectral density: square root of the one-sided power density by Welch's method, Hann windows of 400 s   (1)
residual acceleration of the test mass: that of spring and damper only                                            (2)
of the satellite: what acts on it besides gravity, (f_command + f_dist) / m_sc; without control f_dist / m_sc     (3)
tail: the largest |component| over the axes and over 100-200 s                                                    (4)

Requirements, of two kinds. LISA Pathfinder: on the acceleration between two test masses, 3e-14 m/s2/sqrt(Hz), rising
with the square of the frequency above 3 mHz, 1-30 mHz (ESA, LISA Pathfinder, Objectives; here as 1 + (f/3 mHz)^2).
GOCE: on the satellite's own acceleration, which its gradiometer senses, 5-100 mHz (E. Canuto, B. Bona, G. Calafiore, M.
Indri, Drag free control for the European satellite GOCE, CDC 2002, which has the band); the level 2.5e-8 is often
quoted, its source was not found.
"""

import numpy as np

from cosim.arrays import FloatArray
from cosim.results.result import Result
from cosim.studies.metrics import rotations
from cosim.studies.papers.claims import window
from cosim.studies.papers.li2014.system import M_SC

SETTLED = 200.0  # s, the spectral densities are of what follows
SEGMENT = 400.0  # s
BAND = (5e-3, 0.1)  # Hz
TAIL = 100.0, 200.0  # s

LISA_BAND = (1e-3, 30e-3)  # Hz
GOCE_REQUIREMENT = 2.5e-8  # m/s2/sqrt(Hz)
GOCE_BAND = (5e-3, 0.1)  # Hz


def density(time: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return frequencies (Hz) and amplitude spectral density, a column an axis; rows are evenly spaced in time."""
    chosen = time >= SETTLED
    step = float(np.median(np.diff(time)))
    length = min(round(SEGMENT / step), int(np.count_nonzero(chosen)))
    from scipy.signal import welch  # slow to import

    f, power = welch(rows[chosen], 1 / step, nperseg=length, detrend="linear", axis=0)  # (1)
    return f, np.sqrt(power)


def residual_density(run: Result) -> tuple[FloatArray, FloatArray]:
    """Return the density of the test mass's residual acceleration, m/s2/sqrt(Hz), S axes."""
    return density(run.time, run["plant.residual_acceleration_S"])  # (2)


def satellite_density(run: Result) -> tuple[FloatArray, FloatArray]:
    """Return the density of the satellite's residual acceleration, m/s2/sqrt(Hz), S axes."""
    return density(run.time, (run["plant.f_command_S"] + run["plant.f_dist_S"]) / M_SC)  # (3)


def drag_density(run: Result) -> tuple[FloatArray, FloatArray]:
    """Return the density of the satellite's acceleration by drag and sunlight, m/s2/sqrt(Hz), S axes."""
    return density(run.time, run["environment.f_dist_B"] / M_SC)  # (3)


def lisa_pathfinder(f: FloatArray) -> FloatArray:
    """Return the requirement of LISA Pathfinder at frequencies in Hz, m/s2/sqrt(Hz)."""
    return 3e-14 * (1 + (f / 3e-3) ** 2)


def above_lisa_pathfinder(spectrum: tuple[FloatArray, FloatArray], axis: int = 0) -> float:
    """Return the largest density of an axis over the requirement of LISA Pathfinder, in its band."""
    f, values = spectrum
    inside = (f >= LISA_BAND[0]) & (f <= LISA_BAND[1] + 1e-9)
    return float((values[inside, axis] / lisa_pathfinder(f[inside])).max())


def highest(spectrum: tuple[FloatArray, FloatArray], axis: int = 0, band: tuple[float, float] = BAND) -> float:
    """Return the largest density of an axis in a band."""
    f, values = spectrum
    return float(values[(f >= band[0] - 1e-9) & (f <= band[1] + 1e-9), axis].max())


def relative_position(run: Result) -> FloatArray:
    """Return r_rel, m."""
    return run["plant.r_rel"]


def attitude(run: Result) -> FloatArray:
    """Return the angles 3-2-1 (roll, pitch, yaw) from the reference to the satellite, rad."""
    difference = rotations(run["guidance.q_RN"]).inv() * rotations(run["plant.q_SN"])
    return difference.as_euler("ZYX")[:, ::-1]


def relative_attitude(run: Result) -> FloatArray:
    """Return the angles 3-2-1 (roll, pitch, yaw) from the satellite to the test mass, rad."""
    return rotations(run["plant.q_TS"]).as_euler("ZYX")[:, ::-1]


def tail(run: Result, rows: FloatArray) -> float:
    """Return the largest |component| over 100-200 s."""
    return float(np.abs(rows[window(run, *TAIL)]).max())  # (4)


def contact(run: Result) -> float | None:
    """Return the time at which the test mass reached its cage, s; None if it did not."""
    return float(run["plant.contact_time"].ravel()[-1]) if run["plant.cage_contact"].ravel()[-1] > 0.5 else None
