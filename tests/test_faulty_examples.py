"""The examples with faults, each against what shares nothing with the master: DOP853, the covariance in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from cosim import Result

from .test_examples import empty, read_only, run  # noqa: F401  (fixtures)

DEG_H = np.pi / 180 / 3600


@pytest.mark.slow
def test_a_wheel_at_half_its_torque(read_only, empty):  # noqa: F811
    """J w' + w x (J w + h) + h' = d, h' = -health tau_c, tau_c = -2 b^2 J qv - 2 c b J w; health of y .5 from 50 s on.

    At rest 2 b^2 J health qv = d. The iterated exchange is of order 4: (b h)^4 = 2e-7 of the motion's size.
    """
    printed = run([str(read_only / "wheel_at_half.py")], empty)
    assert "error at 150 s" in printed
    result = Result.read(empty / "results" / "wheel_at_half")
    (fault,) = result.info["faults"]
    assert fault["words"] == "parameter of wheels.health[2], value 0.5, from 50 s"
    J, b, c, d = np.diag([300.0, 200.0, 250.0]), 0.2, 0.7, np.full(3, 2e-3)

    def rates(t, z, health):
        q, w, h = z[:4], z[4:7], z[7:]
        torque = health * (-2 * b**2 * J @ q[1:] - 2 * c * b * J @ w)
        spin = np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]) / 2
        return [*spin, *np.linalg.solve(J, d + torque - np.cross(w, J @ w + h)), *-torque]

    z = np.array([1.0, *np.zeros(9)])
    for begin, end, health in ((0.0, 50.0, np.ones(3)), (50.0, 150.0, np.array([1.0, 0.5, 1.0]))):
        times = result.time[(result.time >= begin) & (result.time <= end)]
        leg = solve_ivp(rates, (begin, end), z, "DOP853", times, args=(health,), rtol=1e-12, atol=1e-14)
        z = leg.y[:, -1]
        mine = np.isin(result.time, times)
        assert_allclose(result["plant.q_BN"][mine], leg.y[:4].T, atol=2e-7 * 1e-3 + 1e-9)
        assert_allclose(result["wheels.wheel_momentum"][mine], leg.y[7:].T, atol=1e-6)
    still = d / (2 * b**2 * np.diag(J))
    assert_allclose(result["plant.q_BN"][-1, 1:], still * [1, 2, 1], rtol=1e-3)  # e^(-b c 100 s), and 0.3 N m s of h


@pytest.mark.slow
def test_a_tracker_that_is_lost_and_a_gyro_bias_that_steps(read_only, empty):  # noqa: F811
    """Between measurements the variance of an axis is P - 2 t C + t^2 B + sigma_v^2 t + sigma_u^2 t^3 / 3.

    That holds for a body at rest; what the gyro's error turns in a minute, 1e-3 rad, mixes the axes by its square.
    """
    files = [str(read_only / name) for name in ("sensor_faults.py", "sensor_faults.toml")]
    run(["-m", "cosim", "run", files[0], "--fault", files[1]], empty)
    result = Result.read(empty / "results" / "sensor_faults")
    t, sigma, of_bias = result.time, result["filter.sigma_q_BN"], result["filter.sigma_bias"]
    lost = (t >= 100) & (t < 160)
    assert len(set(result["filter.exposure_time"][lost])) == 1 and len(set(result["tracker.exposure_time"][lost])) > 100
    cross = np.column_stack([result[f"filter.P_cross[{i},{i}]"] for i in (1, 2, 3)])
    k = np.flatnonzero(lost)[0]
    s = (t - t[k])[:, None]
    sigma_v, sigma_u = np.radians(0.01) / 60, np.radians(5) / 3600**1.5
    variance = sigma[k] ** 2 - 2 * s * cross[k + 1] + s**2 * of_bias[k] ** 2 + sigma_v**2 * s + sigma_u**2 * s**3 / 3
    assert_allclose(sigma[lost] ** 2, variance[lost], rtol=2e-6)  # P_cross is a state: its row is one sample later
    assert (sigma[t == 159.9] > 3 * sigma[k]).all() and (sigma[-1] < 1.1 * sigma[k]).all()
    given = (result["filter.omega_BN_B_measured"] - result["gyro.omega_BN_B"]) / DEG_H
    assert_allclose(given, np.where(t[:, None] >= 200, [20.0, 0.0, 0.0], 0.0), atol=1e-9)
    off = result["filter.bias"][-1] - result["gyro.bias"][-1] - np.array([20.0, 0.0, 0.0]) * DEG_H
    assert (abs(off) < 4 * of_bias[-1]).all()
