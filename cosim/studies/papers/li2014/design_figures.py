"""The figures of li2014's readings: signs, feed-forward and Gamma on both models, and Lyapunov's function."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from components.numbers.li2014 import GAMMA
from cosim.results.result import Result
from cosim.studies import plots
from cosim.studies.papers.li2014.lyapunov import lyapunov
from cosim.studies.papers.li2014.spectrum import attitude, relative_attitude, relative_position
from cosim.studies.papers.li2014.system import (
    CONSISTENT,
    DESIGN,
    DESIGN_CONSISTENT,
    DESIGN_GAMMA,
    DESIGN_NO_NN,
    DESIGN_PRINTED,
    GAMMA_10,
    NN,
    NO_NN,
    PRINTED,
)

VARIANTS = {  # label -> on the design model, on the full equations
    "network": (DESIGN, NN),
    "no network": (DESIGN_NO_NN, NO_NN),
    "printed signs": (DESIGN_PRINTED, PRINTED),
    "consistent feed-forward": (DESIGN_CONSISTENT, CONSISTENT),
    r"$\Gamma$ = 10": (DESIGN_GAMMA, GAMMA_10),
}
LOOKS: dict[str, dict[str, Any]] = {label: plots.look(i) for i, label in enumerate(VARIANTS)}
ROWS = (
    (r"$|r|$ (m)", relative_position),
    (r"$|\varphi_{sc}|$ (rad)", attitude),
    (r"$|\varphi_{rel}|$ (rad)", relative_attitude),
)
LEARNING = {
    "network": (DESIGN, GAMMA),
    "consistent feed-forward": (DESIGN_CONSISTENT, GAMMA),
    r"$\Gamma$ = 10": (DESIGN_GAMMA, 10 * GAMMA),
}
END = 50.0  # s


def draw_variants(flown: Mapping[str, Result]) -> Figure | None:
    """Draw the largest |component| of figures 1 to 3 of all variants; None where one of the models was not flown."""
    if not all(any(pair[model] in flown for pair in VARIANTS.values()) for model in (0, 1)):
        return None
    figure, grid = plots.panels(3, 2, "Largest component of figures 1 to 3: signs, feed-forward and Gamma", 2.0)
    for row, (text, rows) in zip(grid, ROWS, strict=True):
        for column, ax in enumerate(row):
            for label, pair in VARIANTS.items():
                if pair[column] in flown:
                    run = flown[pair[column]]
                    _log(ax, run.time, np.max(np.abs(rows(run)), axis=1), label)
            ax.set_ylim(1e-19, 1e-1)
        row[0].set_ylabel(text)
    grid[0][0].set_title("design model (7) to (9)")
    grid[0][1].set_title("full equations")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=5)
    return figure


def draw_lyapunov(flown: Mapping[str, Result]) -> Figure | None:
    """Draw Lyapunov's function of the three loops, and how far the weights are from the true ones."""
    known = {
        label: (flown[name].time, lyapunov(flown[name], Gamma))
        for label, (name, Gamma) in LEARNING.items()
        if name in flown
    }
    if not known:
        return None
    figure, grid = plots.panels(3, 2, "Lyapunov's function (19) on the design model: it falls, not to zero", 2.0)
    names = list(next(iter(known.values()))[1])
    for row, name in zip(grid, names, strict=True):
        for label, (time, loops) in known.items():
            _log(row[0], time, loops[name].V / loops[name].V[0], label)
            _log(row[1], time, loops[name].distance, label)
        row[0].set_ylabel(f"{name}: V / V(0)")
        row[1].set_ylabel(r"$|W^* - \hat W| / |W^*|$")
        for ax in row:
            ax.set_xlim(0, min(END, max(time[-1] for time, _ in known.values())))
    grid[0][0].set_title("V of (19), over its start")
    grid[0][1].set_title("error of the weights")
    figure.align_ylabels([row[0] for row in grid])
    plots.legend(figure, columns=3)
    return figure


def _log(ax: Axes, time: Any, values: Any, label: str) -> None:
    ax.semilogy(time, np.where(values > 0, values, np.nan), label=label, **LOOKS[label])
