"""Gaussian radial basis functions.

    h_j = exp(-1/2 sum_g |x_g - c_gj|^2 / b_g^2),  c_gj column j of the centres of group g, b_g its width   (1)

A network whose inputs have different units takes them in groups, each with its own centres and width; a paper that
writes exp(-|x - c|^2 / b^2) has the width b / sqrt(2) here.
Source: C. Zhang, Y. Sun, G. Ma, C. Li, Prescribed performance adaptive attitude tracking control for flexible
spacecraft, J. Harbin Inst. Tech. 50(4), 2018, the line above equation (12).
"""

from typing import Any

import casadi as ca


def gaussian(*groups: tuple[Any, Any, Any]) -> Any:
    """Return the column of node values h; each group is (x, centres with one column a node, width)."""
    distance2 = 0
    for x, centres, width in groups:
        offset = (ca.repmat(x, 1, centres.shape[1]) - centres) / width
        distance2 = distance2 + ca.sum1(offset**2).T
    return ca.exp(-distance2 / 2)  # (1)
