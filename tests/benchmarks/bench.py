"""What the benchmarks share: rounds that interleave what is compared, ratios against a budget, one table.

The machine may be busy, so a figure is a ratio: in every round each contestant runs once, in turn, and `ratio` is the
median over the rounds of its time by the reference's time of the same round. `least` is the ratio of the two least
times. The spread of the reference's times (quartiles) tells how noisy the machine was.
"""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median, quantiles

sys.path[:0] = [str(Path(__file__).resolve().parents[2])]


def rounds(contestants: Mapping[str, Callable[[], float]], count: int) -> dict[str, list[float]]:
    """Run each contestant `count` times after one warm-up, in turn; each returns the seconds that it took."""
    for contestant in contestants.values():
        contestant()
    times: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(count):
        for name, contestant in contestants.items():
            times[name].append(contestant())
    return times


def clocked(
    call: Callable[[], object], per: int = 1, clock: Callable[[], float] = time.perf_counter
) -> Callable[[], float]:
    """A contestant: seconds of a call, by the clock or of CPU (`time.process_time`), divided by how many it does."""

    def run() -> float:
        began = clock()
        call()
        return (clock() - began) / per

    return run


def ratio(times: Sequence[float], reference: Sequence[float]) -> float:
    return median(a / b for a, b in zip(times, reference, strict=True))


def compare(
    title: str, times: Mapping[str, Sequence[float]], reference: str, budgets: Mapping[str, float], unit: float = 1e-6
) -> None:
    """Print the times, in microseconds, of each contestant and its ratios to the reference."""
    base = times[reference]
    low, _, high = quantiles(base, n=4)
    print(f"\n{title}")
    print(f"{len(base)} rounds; quartiles of the reference: {low / unit:.4g} to {high / unit:.4g} us")
    rows = [("", "median us", "least us", "ratio", "least", "budget", "")]
    for name, own in times.items():
        found, budget = ratio(own, base), budgets.get(name)
        verdict = "" if budget is None else "kept" if found <= budget else "MISSED"
        numbers = (f"{median(own) / unit:.4g}", f"{min(own) / unit:.4g}", f"{found:.2f}", f"{min(own) / min(base):.2f}")
        rows.append((name, *numbers, "" if budget is None else f"<= {budget:g}", verdict))
    table(rows)


def limits(title: str, rows: Sequence[tuple[str, float, str, float | None]]) -> None:
    """Print figures that have limits of their own: what, figure, unit, limit."""
    print(f"\n{title}")
    lines = [("", "measured", "budget", "")]
    for what, figure, unit, limit in rows:
        verdict = "" if limit is None else "kept" if figure <= limit else "MISSED"
        lines.append((what, f"{figure:.4g} {unit}", "" if limit is None else f"<= {limit:g} {unit}", verdict))
    table(lines)


def verdict(what: str, figure: float, sense: str, limit: float) -> tuple[str, str, str, str]:
    """Return the row of a figure that is to be at most, <=, or at least, >=, its limit."""
    kept = figure <= limit if sense == "<=" else figure >= limit
    return what, f"{figure:.3g}", f"{sense} {limit:g}", "kept" if kept else "MISSED"


def table(rows: Sequence[Sequence[str]]) -> None:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for first, *rest in rows:
        cells = (cell.rjust(width) for cell, width in zip(rest, widths[1:], strict=True))
        print("  ".join([first.ljust(widths[0]), *cells]).rstrip())
