"""adcs plot and adcs metrics: what is chosen is drawn, a paper is called what it is, every run is in the table."""

import csv
import io
import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from cosim import Experiment, Library, System, simulate
from cosim.results.result import Result
from cosim.studies import metrics, papers
from cosim.studies.papers import overlaid

CHANGED = ("--set", "controller.rho_inf=0.01 deg")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Folders of 1 s of zhang2018-ppatc as published and with a wider bound, and of a unit without attitude."""
    folder = tmp_path_factory.mktemp("flown")
    system, experiment = papers.scenario("zhang2018-ppatc")
    short = Experiment(stop_time=1.0, communication_step_size=1e-3, every=10, master=experiment.master)
    locate = Library()

    def judge(run):
        return metrics.measure(run, 0.005)

    simulate(system, short, out=folder / "own", locate=locate, metrics=judge)
    wider = System(**{**vars(system), "parameters": system.parameters | {"controller.rho_inf": np.radians([0.01] * 3)}})
    simulate(wider, short, out=folder / "wide", locate=locate, metrics=judge)
    alone = System(name="alone", components={"disturbance": "HarmonicTorque"})
    simulate(alone, Experiment(stop_time=1.0, communication_step_size=0.1), out=folder / "alone", locate=locate)
    return folder


def drawn(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if path.suffix in (".png", ".pdf", ".svg")}


class TestPlot:
    def test_chosen_variables_in_two_formats(self, adcs, flown, folder):
        done = adcs("plot", flown / "own", "--vars", "plant.omega_*", "--format", "pdf,svg", "--size", "6x4", "-o", "p")
        assert (done.status, done.out.split()) == (0, ["p/variables.pdf", "p/variables.svg"])
        assert drawn(folder / "p") == {"variables.pdf", "variables.svg"}

    def test_the_difference_of_two_runs_says_at_which_times(self, adcs, flown, folder):
        done = adcs("plot", flown / "own", flown / "wide", "--difference", "--vars", "plant.q_BN", "-o", "d")
        assert done.status == 0 and drawn(folder / "d") == {"difference.png"}
        assert "wide less own at 101 common times, of 101 and 101 rows" in done.err

    def test_several_results_give_one_table_of_metrics(self, adcs, flown):
        done = adcs("plot", flown / "own", flown / "wide", "--vars", "plant.energy", "-o", "t")
        lines = done.out.splitlines()
        assert lines[0].split() == ["metric", "own", "wide"]
        assert any(line.startswith("peak torque (N.m)") for line in lines)

    def test_a_changed_run_has_the_papers_figures_and_they_say_so(self, adcs, flown, folder, monkeypatch):
        seen = catch(monkeypatch)
        done = adcs("plot", flown / "wide", "-o", "w")
        assert done.status == 0 and {"fig05_attitude.png", "torque.png"} <= drawn(folder / "w")
        assert seen["fig05_attitude"] == "Attitude, PPATC (figure 5)\nnot as published: controller.rho_inf"
        assert "not as published" not in seen["attitude_error"]

    def test_the_published_run_is_flown_and_drawn_behind(self, adcs, flown, folder, monkeypatch):
        legends = {}

        def save(figures, *arguments):
            legends.update({n: [t.get_text() for t in f.legends[0].texts] for n, f in figures.items() if f.legends})
            return []

        monkeypatch.setattr("cosim.studies.plots.save", save)
        done = adcs("plot", flown / "wide", "--published", "-o", "p")
        assert "zhang2018-ppatc as published: flown to 1 s, to be drawn behind" in done.err
        assert "PPATC, published" in legends["fig02-04_tracking_error"]
        assert (
            "body, published" in legends["fig05_attitude"] and "reference, published" not in legends["fig05_attitude"]
        )
        assert not any("published" in text for text in legends["attitude_error"])

    def test_two_runs_of_one_experiment_are_over_one_another(self, flown):
        runs = {name: Result.read(flown / name) for name in ("own", "wide")}
        figures = overlaid.draw_papers(runs, Library()).figures
        texts = [text.get_text() for text in figures["fig07_torque"].legends[0].texts]
        assert texts == ["PPATC", "PPATC, wide"]

    def test_of_three_runs_of_one_experiment_the_first_is_shown_and_that_is_said(self, flown):
        runs = {name: Result.read(flown / "own") for name in ("a", "b", "c")}
        assert overlaid.draw_papers(runs, Library()).notes == [
            "the figures of zhang2018 show a, not b, c: of an experiment two runs at most"
        ]

    def test_a_swapped_controller_has_no_figures_of_the_paper_and_that_is_said(self, flown):
        run = Result.read(flown / "own")
        run.info["swaps"] = [{"instance": "controller"}]
        done = overlaid.draw_papers({"mine": run}, Library())
        assert (done.figures, done.notes) == (
            {},
            ["mine: no figures of zhang2018, for another FMU flew as controller"],
        )

    def test_a_run_that_has_recorded_less_says_what_is_missing(self, flown):
        run = Result.read(flown / "own")
        kept = [n for n in run.table.column_names if not n.startswith("controller.")]
        done = overlaid.draw_papers({"mine": Result(run.table.select(kept), run.info)}, Library())
        assert done.figures == {}
        assert done.notes == ['no figures of zhang2018: unknown variable "controller.tau_command_B" in the result.']

    def test_bounds_are_those_of_the_run(self, flown):
        """rho = (rho_0 - rho_inf) exp(-k t) + rho_inf with rho_0 = 0.3 deg, k = 0.2 1/s of the paper's Table."""
        run = Result.read(flown / "wide")
        figure = overlaid.draw_papers({"wide": run}, Library()).figures["fig02-04_tracking_error"]
        upper = max((line for line in figure.axes[0].lines), key=lambda line: line.get_ydata()[0])
        start, decay = upper.get_ydata()[0], settings(run, "controller.k")[0]
        assert upper.get_ydata()[-1] == pytest.approx((start - 0.01) * np.exp(-decay) + 0.01)

    def test_what_departs_from_the_paper_is_found_by_its_name(self, flown):
        own, wide = (Result.read(flown / name) for name in ("own", "wide"))
        assert overlaid.departures(own, Library()) == []
        assert overlaid.departures(wide, Library()) == ["controller.rho_inf"]
        wide.info["communication_step_size"] = 2e-3
        wide.info["master"] = {"name": "Iterated"}
        wide.info["held"]["plant.h_B[2]"]["value"] = 1.0
        assert overlaid.departures(wide, Library()) == ["controller.rho_inf", "plant.h_B", "the step", "the master"]


def settings(run, name):
    return [v["value"] for key, v in run.info["parameters"].items() if key.startswith(f"{name}[")]


def catch(monkeypatch) -> dict[str, str]:
    """Titles of the figures that are written, by file name."""
    from cosim.studies import plots

    seen, save = {}, plots.save

    def told(figures, *arguments):
        seen.update({name: figure.get_suptitle() for name, figure in figures.items()})
        return save(figures, *arguments)

    monkeypatch.setattr(plots, "save", told)
    return seen


class TestMetrics:
    def test_a_table_of_runs_of_different_systems_is_blank_where_one_has_no_such_metric(self, adcs, flown):
        done = adcs("metrics", flown / "own", flown / "alone", "--format", "csv")
        head, *rows = list(csv.reader(io.StringIO(done.out)))
        assert head == ["metric", "own", "alone"]
        cells = {row[0]: row[1:] for row in rows}
        assert cells["system"] == ["zhang2018-ppatc", "alone"]
        assert cells["settling time (s)"] == ["not reached", ""]
        expected = Result.read(flown / "own").info["metrics"]["peak torque (N.m)"]
        assert [float(cells[f"peak torque (N.m) [{i}]"][0]) for i in (1, 2, 3)] == expected
        assert cells["settling threshold, largest component (deg)"] == ["0.005", ""]
        assert "alone: not measured: attitude" in done.err

    def test_as_json_every_run_has_its_own(self, adcs, flown):
        done = adcs("metrics", flown / "own", flown / "wide", "--format", "json")
        found = json.loads(done.out)
        assert list(found) == ["own", "wide"]
        assert found["own"]["metrics"] == Result.read(flown / "own").info["metrics"]

    def test_as_markdown(self, adcs, flown):
        lines = adcs("metrics", flown / "own", flown / "wide", "--format", "markdown").out.splitlines()
        assert lines[:2] == ["| metric | own | wide |", "| --- | --- | --- |"]
        assert len({line.count("|") for line in lines}) == 1

    def test_one_threshold_for_all(self, adcs, flown):
        done = adcs("metrics", flown / "own", flown / "wide", "--settled", "5 deg", "--format", "json")
        for run in json.loads(done.out).values():
            assert run["metrics"]["settling threshold, largest component (deg)"] == pytest.approx(5.0)
            assert run["metrics"]["settling time (s)"] == 0.0

    def test_as_text(self, adcs, flown):
        out = adcs("metrics", flown / "own").out
        assert "settling threshold, largest component (deg)  0.005" in out
        assert "settling counted from (s)" in out

    def test_runs_of_one_name_are_told_apart_by_their_paths(self, adcs, flown, folder):
        for name in ("a", "b"):
            shutil.copytree(flown / "alone", folder / name / "run")
        head = adcs("metrics", "a/run", "b/run", "--format", "csv").out.splitlines()[0]
        assert head == "metric,a/run,b/run"


class TestBadInput:
    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--vars", "plant.omga_BN_B"], 'unknown variable "plant.omga_BN_B" in the result. Did you mean'),
            (["--format", "jpeg"], 'unknown format "jpeg" in figures. There: png, pdf, svg.'),
            (["--size", "big"], "--size 'big' is no size. Write width x height in inch, as in 6x4 or 3.5x2.5."),
            (["--size", "6x0"], "--size '6x0': a height of 0 inch; it must be 1 to 100 inch."),
            (["--size", "1500x900"], "--size '1500x900': a width of 1500 inch; it must be 1 to 100 inch."),
            (["--difference"], "--difference is of two results, the second less the first; 1 are named."),
            (["--dpi", "0"], "greater than or equal to 20"),
        ],
    )
    def test_what_plot_refuses(self, adcs, flown, folder, arguments, words):
        done = adcs("plot", flown / "own", "--out", "none", *arguments)
        assert done.status == 2 and words in " ".join(done.err.split())
        assert not (folder / "none").exists()

    def test_a_published_run_is_one_of_a_paper(self, adcs, flown):
        done = adcs("plot", flown / "alone", "--published")
        assert done.status == 2
        assert "--published: no result is of a paper's experiment with the FMUs of the paper, here is alone" in done.err

    @pytest.mark.parametrize("command", ["plot", "metrics"])
    def test_an_empty_folder(self, adcs, folder, command):
        (folder / "empty").mkdir()
        assert "empty: there is no result in it" in adcs(command, "empty").err

    @pytest.mark.parametrize("command", ["plot", "metrics"])
    @pytest.mark.parametrize(("rows", "words"), [(0, "no row"), (1, "one row")])
    def test_a_run_without_rows(self, adcs, flown, folder, command, rows, words):
        run = Result.read(flown / "own")
        (folder / "short").mkdir()
        import pyarrow.parquet as pq

        pq.write_table(run.table.slice(0, rows), folder / "short" / "result.parquet")
        done = adcs(command, "short")
        assert done.status == 2
        assert f"short: its run has recorded {words}, nothing can be drawn or measured of it" in done.err

    def test_a_format_of_metrics(self, adcs, flown):
        assert 'unknown format "xls" in tables of metrics' in adcs("metrics", flown / "own", "--format", "xls").err

    def test_runs_without_a_common_time(self, adcs, flown, folder):
        run = Result.read(flown / "own")
        shifted = run.table.set_column(0, run.table.field(0), pa.array(run.time + 0.0005))
        (folder / "late").mkdir()
        import pyarrow.parquet as pq

        pq.write_table(shifted, folder / "late" / "result.parquet")
        done = adcs("plot", flown / "own", "late", "--difference")
        assert done.status == 2 and "NothingInCommon: the runs have no time in common" in done.err
