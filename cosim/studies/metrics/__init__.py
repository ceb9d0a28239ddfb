"""What an attitude run achieved, in numbers: pointing, effort, vibration, momentum.

    attitude.py   all metrics of a run
    pointing.py   settling time, APE and RPE
    torque.py     the torque on the body, also that of clusters whose momentum it takes
    momentum.py   whether the total angular momentum was kept
    table.py      metrics of several runs side by side
    domain.py     whether the controller reports that its law did not hold
    rows.py       rows of a result as arrays

Numbers are what the recorded rows show: a peak between two rows is not seen. A metric whose variables are not recorded
is left out. Keys carry their unit.
"""

from cosim.studies.metrics.attitude import measure, not_measured
from cosim.studies.metrics.domain import out_of_domain
from cosim.studies.metrics.pointing import (
    THRESHOLD,
    attitude_error,
    reference_rate,
    settled_after,
    settling_time,
    slew_end,
)
from cosim.studies.metrics.rows import first, rotations, series, settings
from cosim.studies.metrics.table import MetricTable, tabulate
from cosim.studies.metrics.torque import torque

__all__ = [
    "THRESHOLD",
    "MetricTable",
    "attitude_error",
    "first",
    "measure",
    "not_measured",
    "out_of_domain",
    "reference_rate",
    "rotations",
    "series",
    "settings",
    "settled_after",
    "settling_time",
    "slew_end",
    "tabulate",
    "torque",
]
