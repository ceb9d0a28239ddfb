"""The conditions on parameters that components share: what they let through, and the element that a message names."""

import numpy as np
import pytest
from helpers import Point

from components.framework import Component, Parameter, flag_conditions, not_negative, positive


class Asking(Component):
    n: int = 2

    mass = Parameter(unit="kg", start=2.0, doc="scalar that must be positive")
    A = Parameter(unit="N.m", shape=("n", 3), start=1.0, doc="matrix that must be positive")
    ratio = Parameter(unit="1", shape=(2,), doc="column that must not be negative")
    option = Parameter(unit="1", start=1.0, doc="option")

    def check(self, t, x, u, p):
        conditions = positive(self, p, "mass", "A")
        return [*conditions, *not_negative(self, p, "ratio"), *flag_conditions(self, p, "option")]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (dict(mass=0.0), "mass = 0 kg: it must be positive."),
        (dict(mass=np.nan), "mass = nan kg: it must be positive."),
        (dict(A=[[1, 1, -2], [1, 1, 1]]), "A[1,3] = -2 N.m: it must be positive."),
        (dict(A=[[1, 1, 1], [0, 1, 1]]), "A[2,1] = 0 N.m: it must be positive."),
        (dict(ratio=[0, -1e-300]), "ratio[2] = -1e-300: it must not be negative."),
        (dict(ratio=[np.nan, 0]), "ratio[1] = nan: it must not be negative."),
        (dict(option=-1.0), "option = -1: it must be 0 or 1."),
        (dict(option=0.5), "option = 0.5: it must be 0 or 1."),
    ],
)
def test_the_element_that_breaks_a_condition_is_named(values, message):
    assert Point(Asking(), **values).violated() == [message]


@pytest.mark.parametrize("values", [{}, dict(option=0.0), dict(mass=1e-300), dict(ratio=[1.0, 0.0])])
def test_what_is_allowed_passes(values):
    assert Point(Asking(), **values).violated() == []


def test_nothing_is_asked_of_a_parameter_without_elements():
    assert Point(Asking(n=0)).violated() == []
