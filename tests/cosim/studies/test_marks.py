"""Events and faults in figures over time: a line where each is, once in the legend, nothing of it beyond the page."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from cosim import At, Experiment, Fault, Library, simulate
from cosim.studies import papers, plots
from cosim.studies.papers import overlaid
from cosim.studies.plots import style
from cosim.studies.plots.marks import mark


@pytest.fixture(scope="module")
def flown():
    """1 s of zhang2018-ppatc with half the torque for a while, and a sensor that is off from 0.6 s on."""
    system, experiment = papers.scenario("zhang2018-ppatc")
    happens = {
        "events": [At(0.5, {"plant.solver.step": 5e-4})],
        "faults": [
            Fault("scale", "plant.tau_B", 0.5, start=0.2, until=0.4),
            Fault("bias", "controller.omega_BN_B", 1e-7, start=0.6),
        ],
    }
    short = Experiment(stop_time=1.0, communication_step_size=1e-3, every=10, master=experiment.master, **happens)
    return simulate(system, short, locate=Library())


def marks(ax):
    """When and what the lines across a panel are."""
    return [(line.get_xdata()[0], line.get_label()) for line in ax.lines if line.get_label() in ("event", "fault")]


WANTED = [(0.2, "fault"), (0.4, "fault"), (0.5, "event"), (0.6, "fault")]


def test_every_figure_over_time_has_them(flown):
    figures = plots.draw({"run": flown}) | plots.draw_variables({"run": flown}, ["plant.*"])
    figures |= overlaid.draw_papers({"run": flown}, Library()).figures
    assert {"attitude_error", "torque", "variables", "fig05_attitude"} <= figures.keys()
    for figure in figures.values():
        for ax in figure.axes:
            begin, end = ax.get_xlim()
            assert marks(ax) == [m for m in WANTED if begin <= m[0] <= end]
        texts = [text.get_text() for text in figure.legends[0].texts]
        assert texts.count("event") == texts.count("fault") == 1
        width = figure.legends[0].get_window_extent(FigureCanvasAgg(figure).get_renderer()).width
        assert width <= figure.bbox.width
    assert figures["fig05_attitude"].get_suptitle() == "Attitude, PPATC (figure 5)\nnot as published: events, faults"


def test_what_a_run_has_not_come_to_is_not_drawn(flown):
    """Of two runs each line once; the longer one has come to all."""
    early = type(flown)(flown.table.slice(0, 46), flown.info)  # to 0.45 s
    (figure,) = plots.draw_variables({"early": early}, ["plant.energy"]).values()
    assert marks(figure.axes[0]) == WANTED[:2]
    assert figure.axes[0].get_xlim()[1] < 0.5
    (figure,) = plots.draw_variables({"early": early, "run": flown}, ["plant.energy"]).values()
    assert marks(figure.axes[0]) == WANTED


def test_other_panels_have_none(flown):
    """A spectrum, and a panel that ends before; one with a legend of its own names what it has."""
    figure = Figure()
    spectrum, short, own = figure.subplots(1, 3)
    for ax, label in ((spectrum, "frequency (Hz)"), (short, style.TIME), (own, style.TIME)):
        ax.plot([0.0, 0.9], [0.0, 1.0], label="curve")
        ax.set_xlabel(label)
    short.set_xlim(0.0, 0.3)
    own.legend()
    mark({"figure": figure}, {"run": flown})
    assert [marks(ax) for ax in figure.axes] == [[], WANTED[:1], WANTED]
    assert [text.get_text() for text in own.get_legend().texts] == ["curve", "fault", "event"]


def test_without_any_a_figure_is_as_it_was(flown):
    plain = type(flown)(flown.table, {**flown.info, "events": [], "faults": []})
    (figure,) = plots.draw_variables({"run": plain}, ["plant.energy"]).values()
    assert marks(figure.axes[0]) == [] and not np.isnan(figure.axes[0].get_ylim()).any()
