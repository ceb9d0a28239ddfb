"""Every torque-commanding attitude controller on every attitude plant: one slew, one disturbance, one table.

    vehicles.py   the plants of the papers, each with a cluster that takes a torque command
    laws.py       the controllers of the papers, and each made to fit a vehicle
    mission.py    the slew, the disturbance, the start, the thresholds: the same for all
    cell.py       one flight: its system, and the figures of its run
    table.py      all flights, and the table

Gains are not retuned.
"""

from cosim.studies.comparison import mission
from cosim.studies.comparison.cell import COLUMNS
from cosim.studies.comparison.table import Table, compare, make_row

__all__ = ["COLUMNS", "Table", "compare", "make_row", "mission"]
