"""A notch, and what it is for: the growth of a mode at 4 Hz in flight is that of the sampled loop's eigenvalues."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from cosim import simulate

from .notched import notched

J, DELTA, OMEGA = (300.0, 200.0), (7.0, 6.0), 2 * np.pi * np.array([3.66, 3.62])
ZETA, SAMPLE, NOTCH = 0.002, 0.1, 2 * np.pi * 4
B, C = 2 * np.pi * 0.3, 0.7  # of the controller


def growth(axis: int, depth: float) -> tuple[float, float]:
    """The real part, 1/s, and the frequency, Hz, of the loop's eigenvalue near 4 Hz, about an axis at rest.

    x = e, w, eta, eta', l, b and the torque tau, held for a sample: J w' + delta eta'' = tau,
    eta'' + 2 zeta Omega eta' + Omega^2 eta = -delta w'; u = -J (b^2 e + 2 c b w) into the notch, which is continuous;
    what comes out at a sample is the torque from the next sample on.
    """
    j, d, o = J[axis], DELTA[axis], OMEGA[axis]
    pull = np.array([0, 0, o**2, 2 * ZETA * o, 0, 0, 0])  # sigma: eta'' = -sigma - delta w'
    torque = np.array([0, 0, 0, 0, 0, 0, 1.0])
    w_dot = (torque + d * pull) / (j - d**2)
    u = -j * np.array([B**2, 2 * C * B, 0, 0, 0, 0, 0])
    unit = np.eye(7)
    rates = [unit[1], w_dot, unit[3], -pull - d * w_dot, NOTCH * unit[5], NOTCH * (u - unit[4] - unit[5]), 0 * torque]
    step = expm(SAMPLE * np.array(rates))
    shown = u - (1 - depth) * unit[5]  # zeta_p = 1/2, zeta_z = depth/2
    # at the sample the torque becomes what was shown at the sample before, which is one more state
    loop = np.zeros((8, 8))
    loop[:7, :7], loop[6], loop[7, :7] = step, 0, shown @ step
    loop[6, 7] = 1
    values, vectors = np.linalg.eig(loop)
    mode = np.argmax(np.abs(vectors[2] * o) / np.linalg.norm(vectors[:2], axis=0))
    return float(np.log(abs(values[mode])) / SAMPLE), float(np.angle(values[mode]) / (2 * np.pi * SAMPLE))


@pytest.mark.parametrize(("depth", "stable"), [(0.1, True), (1.0, False)], ids=["notch", "none"])
def test_a_mode_grows_without_the_notch_and_dies_out_with_it(depth, stable):
    """The growth of the peaks of eta' from 40 s to 118 s, after the slew.

    A line between points loses (w h)^2/12 of a sine, 1.3e-3 at 4 Hz and 5 ms. Of the 0.14 1/s that the feedback adds to
    the growth without a notch, and of what a notch lets through of it, that is 1.9e-4 1/s; the peaks are seen at points
    5 ms apart, 2e-3 of their size at most, which over 78 s makes less than 1e-4 1/s.
    """
    run = simulate(*notched(depth))
    late, t = np.arange(40, 118, 2.0), run.time
    for axis in (0, 1):
        expected, frequency = growth(axis, depth)
        assert_allclose(frequency, 4.0, atol=0.05)
        assert (expected < 0) == stable
        rate = np.abs(run["plant.eta_dot"][:, axis])
        peaks = [np.log(rate[(t >= a) & (t < a + 2)].max()) for a in late]
        assert_allclose(np.polyfit(late, peaks, 1)[0], expected, atol=1.9e-4 + 1e-4)
