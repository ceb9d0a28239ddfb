"""The list of papers: light to read, and the same as what flies."""

import os
import subprocess
import sys

import pytest

from cosim.studies import papers
from cosim.studies.papers.paper import Paper

HEAVY = {"casadi", "components", "fmpy", "matplotlib", "numpy", "pyarrow", "scipy"}


def loaded(code: str) -> set[str]:
    """The modules that a new process has after running code."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, "-c", f"import sys; {code}; print(*sys.modules)"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("name", papers.describe())
def test_an_experiment_has_the_name_of_its_function(name):
    assert papers.scenario(name)[0].name == name


def test_every_function_that_makes_a_flight_is_listed_with_its_words():
    for paper in papers.PAPERS.values():
        system = paper._module("system")
        made = [f for n, f in vars(system).items() if n[0] != "_" and getattr(f, "__module__", "") == system.__name__]
        functions = [f for f in made if f.__annotations__.get("return") is system.Flight]
        assert list(paper.experiments.values()) == [f.__doc__.partition("\n")[0] for f in functions]


def test_names_and_titles_are_read_without_importing_what_flies_or_draws():
    listed = loaded("from cosim.studies import papers; papers.describe(); [p.title for p in papers.PAPERS.values()]")
    assert not listed & HEAVY


def test_a_scenario_imports_its_own_paper_only_and_neither_claims_nor_figures():
    modules = loaded("from cosim.studies import papers; papers.scenario('zhang2018-ppatc')")
    assert "cosim.studies.papers.zhang2018.system" in modules
    others = [name for name in modules for key in papers.PAPERS if name.startswith(f"cosim.studies.papers.{key}.")]
    assert others == ["cosim.studies.papers.zhang2018.system"]
    assert not modules & {"casadi", "matplotlib", "pyarrow", "cosim.studies.papers.claims"}


def test_claims_are_judged_without_drawing():
    code = "from cosim.studies import papers, metrics; [p.claims for p in papers.PAPERS.values()]"
    assert not loaded(code) & {"matplotlib", "casadi"}


def test_a_paper_is_its_package():
    paper = Paper("zhang2018")
    assert paper.title.endswith("(2018)") and paper.settled == 0.005
    assert papers.find_owner("zhang2018-atc") == paper and papers.find_owner("mine") is None


@pytest.mark.parametrize("paper", papers.PAPERS.values(), ids=lambda paper: paper.key)
def test_a_paper_draws_nothing_of_the_runs_of_others(paper):
    """After Ctrl-C there are runs of the first papers only."""
    assert paper.draw({}) == {}
    assert paper.draw({"another-paper": range(2)}) == {}
