"""What an experiment of a paper is: its system, and how that is flown."""

from cosim.system import Experiment, System

Flight = tuple[System, Experiment]
