"""Runs of zhang2018 made of error curves, and its claims by their words."""

import numpy as np
import pyarrow as pa

from cosim.results.result import Result
from cosim.studies import papers
from cosim.studies.papers.claims import Claim

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


def claim(start: str) -> Claim:
    (found,) = [c for c in papers.PAPERS["zhang2018"].claims if c.text.startswith(start)]
    return found


def in_radians(runs):
    return {f"{name}-rad": run for name, run in runs.items()}


def in_both(runs):
    return runs | in_radians(runs)
