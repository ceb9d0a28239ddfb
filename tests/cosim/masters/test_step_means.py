"""A step mean that is read again at a communication point is the newest one, whatever the point itself knows yet."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from .. import both
from ..c_fmu import build, real
from ..fakes import Clock, Fake, Mean, describe
from ..flights import run
from ..tiny_fmu import changed


class TestRefreshedMeans:
    """Both(mean, now) = feedthrough of a step mean and of an input that is at_point, so that it is read again.

    The mean of (t^2)' over the last step of its source, in closed form t_a + t_b over (t_a, t_b); a slow source's
    newest mean is that of the step that it is ahead with, of which the point itself knows nothing yet.
    """

    STEPS = ({}, {"mean": 2}, {"mean": 3}, {"mean": 4, "both": 2}, {"mean": 2, "both": 2})

    class Both(Fake):
        def __init__(self, name):
            inputs = ["mean", "now"]
            super().__init__(name, describe(inputs=inputs, outputs=["y"], feedthrough={"y": ("mean", "now")}))

        def evaluate(self, v):
            v["y"] = 1000.0 * v["mean"] + v["now"]

    @staticmethod
    def newest_mean(time, h, period):
        """The mean over the step of the source that ends at t, or goes on beyond it: the one taken last."""
        k = np.round(time / h).astype(int)
        begin = np.where(k > 0, (k - 1) // period * period, 0)
        stop = k[-1]
        end = np.minimum(begin + period, stop)
        return np.where(k > 0, (begin + end) * h, 0.0)

    def expected(self, time, h, steps):
        """What `both` shows: evaluated again at the ends of its own steps, and in between as it was there."""
        period = steps.get("both", 1)
        fresh = 1000.0 * self.newest_mean(time, h, steps.get("mean", 1)) + time
        shown = np.arange(len(time)) // period * period
        shown[-1] = len(time) - 1
        return fresh[shown]

    @pytest.mark.parametrize("steps", STEPS, ids=str)
    def test_in_python(self, steps):
        slaves = [self.Both("both"), Mean("mean"), Clock("clock")]
        links = [("mean.y", "both.mean"), ("clock.y", "both.now", "at_point")]
        result = run(slaves, links, stop=1.2, steps=steps)
        assert_allclose(result["both.y"], self.expected(result.time, 0.1, steps), rtol=1e-12)

    @pytest.mark.parametrize("steps", STEPS, ids=str)
    def test_in_the_kernel(self, steps, tmp_path):
        mean = build(tmp_path, "Mean", [real("y")], step="y = ((t + h) * (t + h) - t * t) / h;")
        text = mean_marked(mean, "y")
        clock = build(tmp_path, "Clock", [real("y")], step="y = t + h;")
        variables = [real("mean", "input"), real("now", "input"), real("y", depends="mean now")]
        reader = build(tmp_path, "Both", variables, outputs="y = 1000 * mean + now;")
        system = both.of(
            {"both": reader, "mean": text, "clock": clock},
            [("mean.y", "both.mean", None), ("clock.y", "both.now", "at_point")],
            steps=steps,
        )
        result = both.fly(system, stop=1.2)
        assert_allclose(result["both.y"], self.expected(result.time, 0.1, steps), rtol=1e-12)


def mean_marked(path, variable):
    """Mark an output as a step mean, as our FMUs do."""
    mark = f'<Slave refresh="true"><StepMean variable="{variable}"/></Slave>'
    return changed(path, path.with_name("Marked.fmu"), xml=lambda text: text.replace('<Slave refresh="true"/>', mark))
