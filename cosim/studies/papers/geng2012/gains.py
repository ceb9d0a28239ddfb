"""Arrays of geng2012: gain of x, surface, centres of the network. Rows are axes; columns belong to e, eta, w or eta'.

GAIN is linear-quadratic, of the nominal model; it minimises the integral of 11.2 |e|^2 + 390 |w|^2 + 20 |eta'|^2 +
|u|^2; the paper prints none. SURFACE is its D, printed with one zero more in rows 2 and 3. CENTRES are uniform from
-0.5 to 0.5 (NumPy's default_rng(0)); rows: roll, pitch, yaw, three rates, three torques G x; columns: neurons.
`design` is the rule for another vehicle:
    x' = A x + B u,  M = J - delta^T delta,  a = 2 zeta Omega eta' + Omega^2 eta
    e' = w,  w' = M^-1 (u + delta^T a),  eta'' = -a - delta w'                                    (1)
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

WEIGHTS = {"e": 11.2, "eta": 0.0, "omega": 390.0, "eta_dot": 20.0}
GAIN = {
    "e": [
        [-3.3458366813933473, 0.02179175796482875, -0.07001443228061373],
        [-0.021488955837458423, -3.346538878257615, -0.014688808229649426],
        [0.0701079611726861, 0.014235715471792173, -3.3458754038644667],
    ],
    "eta": [
        [0.9321865783812631, -1.4738567625575003, 2.110057249144641, 0.8890932688120804],
        [0.2871211936868313, 0.5654741038540592, 1.0416144769762377, -0.6870504886587654],
        [-0.005030470151337705, -0.8822980856157848, 0.16112111089198475, 0.1479333529798724],
    ],
    "omega": [
        [-30.682203972554497, -0.41763980424699093, -1.3826508623855296],
        [-0.7917331015474023, -28.368198160598084, -0.6637076845219281],
        [-0.0791537609838126, -0.38708730581126993, -31.604413978612396],
    ],
    "eta_dot": [
        [2.0610316160008706, 0.7406510084336475, 0.1039419222146349, 0.36071786827469593],
        [0.48991491007103943, 1.7451691144595733, 1.343829150885184, -0.8282593332607514],
        [0.270285965645732, -1.1066989288752538, -0.4908783523236472, -0.32935720449558853],
    ],
}
SURFACE = {
    "e": [[1.02, 0, 0], [0, 1.02, 0], [0, 0, 1.4]],
    "eta": [[-1, 1.2, 1, 0], [0, 0, 0, 0], [0, 3.0486e-6, 0, 0]],
    "omega": [[4, 0, 0], [0, 4, 0], [0, 0, 6.3]],
    "eta_dot": [[-0.0041, 0, 0, 0], [0, 1.052e-5, 0, 0], [0, 0, 0, 0]],
}
CENTRES = [
    [
        0.1369616873214543,
        -0.2302132862361297,
        -0.4590264760638053,
        -0.4834723644714709,
        0.3132702392002724,
        0.4127555772777217,
    ],
    [
        0.10663577576717986,
        0.2294965609839984,
        0.04362499146542287,
        0.4350724237877682,
        0.31585355412153215,
        -0.4972614998298519,
    ],
    [
        0.35740427658756935,
        -0.46641442469453565,
        0.22965544642994407,
        -0.324344379397441,
        0.3631789223498866,
        0.04146122024909171,
    ],
    [
        -0.20028810946261522,
        -0.07731277880234155,
        -0.47168032885453703,
        -0.37571672350043606,
        0.17062441469363032,
        0.1471895115742501,
    ],
    [
        0.11538511148125385,
        -0.11632244573811656,
        0.497209935789211,
        0.4808353387762301,
        0.1855419844806947,
        0.1504592762678163,
    ],
    [
        0.18844673057094008,
        -0.11107857602089621,
        -0.3649034949775888,
        0.2214883401940817,
        0.025354322475725888,
        -0.18975812444104434,
    ],
    [
        -0.014164641168210923,
        0.38948783434900025,
        0.4340435159562497,
        -0.14220480329092977,
        0.07152983072976093,
        -0.17813060892405785,
    ],
    [
        0.0943000301996968,
        -0.16208877449286674,
        -0.10838099947183877,
        0.3902743520047923,
        -0.2728424064666203,
        0.12318714468604242,
    ],
    [
        -0.4159846564176152,
        0.3326441476533978,
        0.28709830748868337,
        -0.26063055700704785,
        0.3764842308107038,
        -0.44143196519480565,
    ],
]


def design(vehicle: Mapping[str, Any]) -> dict[str, Any]:
    """Return the controller's gain of x for a vehicle (J, delta, Omega, zeta; without modes: J), and its surface.

    The surface keeps its columns of e and w; those of the modes, which drop out of it on the paper's own vehicle but
    for rounding, belong to that vehicle's modes and are zero here.
    """
    from scipy.linalg import solve_continuous_are  # slow to import, and the paper's own vehicle needs no design

    J, delta, Omega, zeta = (
        np.asarray(getattr(value, "value", value), float)
        for value in (vehicle.get(name, []) for name in ("J", "delta", "Omega", "zeta"))
    )
    n = Omega.size
    delta, stiffness, damping = delta.reshape(n, 3), np.diag(Omega**2), np.diag(2 * zeta * Omega)
    inverse = np.linalg.inv(J - delta.T @ delta)
    rate = np.hstack([np.zeros((3, 3)), inverse @ delta.T @ stiffness, np.zeros((3, 3)), inverse @ delta.T @ damping])
    elastic = np.hstack([np.zeros((n, 3)), stiffness, np.zeros((n, 3)), damping])
    A = np.vstack(
        [
            np.eye(3, 6 + 2 * n, 3 + n),
            np.eye(n, 6 + 2 * n, 6 + n),
            rate,
            -elastic - delta @ rate,
        ]
    )  # (1)
    B = np.vstack([np.zeros((3 + n, 3)), inverse, -delta @ inverse])  # (1)
    sizes = {"e": 3, "eta": n, "omega": 3, "eta_dot": n}
    Q = np.diag(np.concatenate([np.full(size, WEIGHTS[name]) for name, size in sizes.items()]))
    gain = -B.T @ solve_continuous_are(A, B, Q, np.eye(3))
    columns = dict(zip(sizes, np.split(gain, np.cumsum(list(sizes.values()))[:-1], axis=1), strict=True))
    return {
        **{f"controller.G_{name}": part.tolist() for name, part in columns.items()},
        **{f"controller.D_{name}": np.zeros((3, n)).tolist() for name in ("eta", "eta_dot")},
    }
