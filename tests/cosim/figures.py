"""What of a figure lies outside its page, for tests of what is drawn."""

from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

OF_ANY_RUN = frozenset({"attitude", "attitude_error", "rates", "torque", "modal_coordinates", "cluster"})
"""Names of the figures that any run has, which no paper's figure may take."""

DOT = 1.0  # an edge is drawn half a line wide


def cut_off(figure: Figure) -> list[str]:
    """Names of legends, titles, and axes with their labels, of which a part is cut off."""
    figure.draw_without_rendering()
    page = figure.bbox

    def cut(box: Bbox) -> bool:
        return box.x0 < page.x0 - DOT or box.x1 > page.x1 + DOT or box.y0 < page.y0 - DOT or box.y1 > page.y1 + DOT

    parts = {f"legend {i}": legend.get_window_extent() for i, legend in enumerate(figure.legends)}
    if figure._suptitle is not None:
        parts["title"] = figure._suptitle.get_window_extent()
    for i, ax in enumerate(figure.axes):
        if ax.get_visible():
            parts[f"axes {i} {ax.get_ylabel()}"] = ax.get_tightbbox()
            if ax.get_legend() is not None:
                parts[f"legend of axes {i}"] = ax.get_legend().get_window_extent()
    return [name for name, box in parts.items() if box is not None and cut(box)]
