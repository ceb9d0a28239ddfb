"""How long an internal step may be for the dynamics at the start; the twin of native/internal_step.c, which derives it.

What is warned of where solver.step is set, and the step that is taken where it is 0.

Eigenvalues are numpy's. Above LARGEST_MATRIX states only the largest modulus is sought, by the growth of J^k v, and
taken for an eigenvalue that decays: of a big component only instability is found.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmus.description.annotations import GROWS

LARGEST_MATRIX, GROWTH_STEPS = 100, 200
LOSS, REVOLUTIONS, ALWAYS_FITS = 1e-3, 100, 0.1
HALVINGS = 60
AUTOMATIC, DIGITS, OTHERWISE, LONGEST = 0.1, 2, 1e-3, 1e9

_FITS, _OFF, _UNSTABLE = 0, 1, 2


@dataclass(frozen=True)
class InternalStep:
    """What is told where an internal step is too long; times in s.

    longest: the longest that is not. advice: one that would do. rate: |lambda| in 1/s of the eigenvalue to blame.
    """

    longest: float
    advice: float
    rate: float
    unstable: bool

    def told(self, name: str, h: float) -> str:
        """Return the warning of a step h that is too long."""
        head = f"{name}: an internal step of {h:.3g} s is too long for its dynamics: at the start"
        if self.unstable:
            body = f"a rate of {self.rate:.3g} 1/s decays, {GROWS}"
        else:
            body = f"it turns or swings at a rate of {self.rate:.3g} 1/s, of which RK4 loses more than {LOSS:g}"
            body += f" in {REVOLUTIONS:g} revolutions"
        return f"{head} {body}. solver.step = {self.advice:.3g} s would do."


def judged(times: Callable[[np.ndarray], np.ndarray], states: int, h: float) -> InternalStep | None:
    """Return what is to be told of internal steps up to h s, None where RK4 follows the dynamics.

    times: the product of df/dx with a vector, both of shape (states,).
    """
    if not 0 < h < math.inf or not states:
        return None
    found = _eigenvalues(times, states) if states <= LARGEST_MATRIX else _fastest(times, states)
    which = _worst(found, h)
    if which is None:
        return None
    low, high = 0.0, h
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _worst(found, middle) is None else (low, middle)
    unstable = _too_long(which * h) == _UNSTABLE
    advice = 0.5 * low if unstable else low  # where it is just stable, what decays hardly does
    digit = 10 ** math.floor(math.log10(advice))
    return InternalStep(low, math.floor(advice / digit) * digit, abs(which), unstable)


def automatic(times: Callable[[np.ndarray], np.ndarray], states: int) -> float:
    """Return the longest internal step that an FMU takes of itself, s; infinite where nothing moves by itself."""
    if not states:
        return math.inf
    found = _eigenvalues(times, states) if states <= LARGEST_MATRIX else _fastest(times, states)
    if not found:
        return OTHERWISE
    fastest = max(abs(value) for value in found)
    if fastest * LONGEST <= AUTOMATIC:
        return math.inf
    step = AUTOMATIC / fastest
    digit = math.pow(10, math.floor(math.log10(step)) - DIGITS + 1)
    return math.floor(step / digit * (1 + 1e-6)) * digit


def _eigenvalues(times: Callable[[np.ndarray], np.ndarray], states: int) -> Sequence[complex]:
    jacobian = np.column_stack([times(seed) for seed in np.eye(states)])
    if not np.isfinite(jacobian).all():
        return []
    try:
        return [complex(value) for value in np.linalg.eigvals(jacobian)]
    except np.linalg.LinAlgError:  # it does not converge
        return []


def _fastest(times: Callable[[np.ndarray], np.ndarray], states: int) -> Sequence[complex]:
    vector, growth = np.array([math.cos(1.0 + i * i) for i in range(states)]), 0.0
    for k in range(GROWTH_STEPS):
        vector = times(vector)
        size = float(np.linalg.norm(vector))
        if not 0 < size < math.inf:
            return []
        vector = vector / size
        growth += math.log(size) if k >= GROWTH_STEPS // 2 else 0.0
    return [complex(-math.exp(growth / (GROWTH_STEPS - GROWTH_STEPS // 2)))]


def _too_long(z: complex) -> int:
    """Return whether a step is too long for an eigenvalue, z = lambda h."""
    if abs(z) <= ALWAYS_FITS:
        return _FITS
    size = abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4))))
    if z.real < 0 and size >= 1:
        return _UNSTABLE
    if not abs(z.imag) > abs(z.real):
        return _FITS
    steps = 2 * math.pi * REVOLUTIONS / abs(z.imag)
    if z.real < 0:
        steps = min(steps, 1 / (math.e * -z.real))
    return _OFF if size == 0 or abs(math.log(size) - z.real) * steps > LOSS else _FITS


def _worst(eigenvalues: Sequence[complex], h: float) -> complex | None:
    """Return for which eigenvalue a step is too long, the fastest of the worst kind."""
    kinds = [(_too_long(value * h), abs(value), value) for value in eigenvalues]
    kind, _, value = max(kinds, key=lambda entry: entry[:2], default=(_FITS, 0.0, 0j))
    return None if kind == _FITS else value
