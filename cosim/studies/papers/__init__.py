"""The published control systems that come with the project: their experiments, claims and figures.

paper.py    what a paper has, and the only list of them; names and words are there without any import
flight.py   what an experiment is
claims.py   what a claim is, and how it is judged
single.py   what one run decides and shows
overlaid.py figures from runs of experiments, as published or not, over one another
"""

from cosim.studies.papers.paper import PAPERS, Paper, describe, find, find_owner, scenario
from cosim.studies.papers.single import draw_run, explain_open, judge_run

__all__ = [
    "PAPERS",
    "Paper",
    "describe",
    "draw_run",
    "explain_open",
    "find",
    "find_owner",
    "judge_run",
    "scenario",
]
