"""Every torque-commanding attitude controller on every attitude plant: one slew, one disturbance, one table.

    vehicles.py   plants, each with a cluster that takes a torque command
    laws.py       controllers, and each made to fit a vehicle
    own.py        the names, files and systems that both may be given as
    mission.py    the slew, the disturbance, the start, the thresholds: the same for all
    cell.py       one flight: its system, and the figures of its run
    table.py      all flights, and the table

Gains are not retuned.
"""

from cosim.studies.comparison.cell import COLUMNS
from cosim.studies.comparison.mission import Mission
from cosim.studies.comparison.own import Unsuited, check_names
from cosim.studies.comparison.table import Table, compare, make_row

__all__ = ["COLUMNS", "Mission", "Table", "Unsuited", "check_names", "compare", "make_row"]
