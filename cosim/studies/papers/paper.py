"""A published control system: its words are light, and what judges, draws and flies is imported when it is asked for.

__init__.py   SETTLED: the attitude error within which its runs count as settled, deg
system.py     the experiments: a function each, `foo_bar` for `<paper>-foo-bar`, annotated to return a `Flight`
claims.py     CLAIMS, in the paper's order
figures.py    draw(results): the paper's figures for which `results` has the runs, by file name
"""

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.errors import UnknownName
from cosim.studies.papers.bibliography import entries

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cosim.results.result import Result
    from cosim.studies.papers.claims import Claim
    from cosim.studies.papers.flight import Flight


@dataclass(frozen=True)
class Paper:
    """A paper by the name of its package."""

    key: str

    @property
    def title(self) -> str:
        """Authors, title, year."""
        return entries()[self.key].title

    @property
    def settled(self) -> float:
        """The attitude error within which its runs count as settled in their metrics, deg."""
        return self._module().SETTLED

    @cached_property
    def experiments(self) -> Mapping[str, str]:
        """The experiments by name, each with the first line of its docstring; read, for an import takes longer."""
        text = (Path(__file__).parent / self.key / "system.py").read_text(encoding="utf-8")
        functions = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
        return {
            f"{self.key}-{function.name.replace('_', '-')}": (ast.get_docstring(function) or "").partition("\n")[0]
            for function in functions
            if function.returns is not None and ast.unparse(function.returns) == "Flight" and function.name[0] != "_"
        }

    def make(self, experiment: str) -> "Flight":
        """Return the system and the experiment of one of `experiments`."""
        function: Callable[[], Flight] = getattr(
            self._module("system"), experiment.removeprefix(f"{self.key}-").replace("-", "_")
        )
        return function()

    @property
    def claims(self) -> "Sequence[Claim]":
        """The claims, in the paper's order."""
        return self._module("claims").CLAIMS

    def draw(self, results: "Mapping[str, Result]") -> "dict[str, Figure]":
        """Return the paper's figures for which `results` has the runs, by file name."""
        return self._module("figures").draw(results)

    def _module(self, name: str = "") -> Any:
        return import_module(".".join(filter(None, (__package__, self.key, name))))


PAPERS = {key: Paper(key) for key in ("zhang2018", "xiao2011", "ye2016", "li2014", "geng2012")}


def find(key: str) -> Paper:
    """Return a paper by its key; raises `UnknownName` with the nearest."""
    if key not in PAPERS:
        raise UnknownName("paper", key, "the list of papers", list(PAPERS))
    return PAPERS[key]


def find_owner(experiment: str) -> Paper | None:
    """Return the paper that has an experiment, or None for a system that is no paper's."""
    return next((paper for paper in PAPERS.values() if experiment in paper.experiments), None)


def describe() -> dict[str, str]:
    """Return the experiments of all papers by name, each with the first line of its docstring."""
    return {name: text for paper in PAPERS.values() for name, text in paper.experiments.items()}


def scenario(experiment: str) -> "Flight":
    """Return a paper's system and experiment; raises `UnknownName` with the nearest."""
    owner = find_owner(experiment)
    if owner is None:
        raise UnknownName("system", experiment, "the papers' experiments", list(describe()))
    return owner.make(experiment)
