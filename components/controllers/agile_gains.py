"""Gains and surface of the agile spacecraft's integral sliding mode, and centres of its network: start values.

GAIN: linear-quadratic, of the nominal model; it minimises the integral of 11.2 |e|^2 + 390 |w|^2 + 20 |eta'|^2 + |u|^2.
SURFACE: as printed, with one zero less in rows 2 and 3. A row is an axis; the columns belong to e, eta, w or eta'.
Centres: rows Euler angles 3-2-1, rate, G x; a column a node; uniform from -0.5 to 0.5.

Source: SURFACE: Y. Geng, W. Wu, G. Ma, Neural network compensation of flexible satellite rapid maneuver, J. Harbin
Inst. Tech. 44(5), 2012, section 4. GAIN and the centres are not in the paper.
"""

from typing import Any

import numpy as np

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
    "e": np.diag([1.02, 1.02, 1.4]),
    "eta": [[-1, 1.2, 1, 0], [0, 0, 0, 0], [0, 3.0486e-6, 0, 0]],
    "omega": np.diag([4, 4, 6.3]),
    "eta_dot": [[-0.0041, 0, 0, 0], [0, 1.052e-5, 0, 0], [0, 0, 0, 0]],
}


def columns(values: Any) -> Any:
    """Return a start for as many modes as the component has: of fewer the first columns, further columns zero."""

    def start(component: Any) -> np.ndarray:
        own = np.asarray(values)[:, : component.modes]
        return np.pad(own, ((0, 0), (0, component.modes - own.shape[1])))

    return start


def centres(first: int) -> Any:
    """Return a start for the centres of one group of three inputs, for any number of nodes."""
    return lambda component: np.random.default_rng(0).random((9, component.nodes))[first : first + 3] - 0.5
