"""The signals of a system as FMUs, for tools that have no place for time series."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cosim.ssp.archive import file_name
from cosim.ssp.signals import instance_names
from cosim.system.signal import Signal
from cosim.system.wiring import Channel, Feed, Wiring
from fmus.description.units import Conversion
from fmus.export.table.table_fmu import Output, build_table


def build_tables(wiring: Wiring, folder: Path, platforms: Sequence[str]) -> dict[str, Path]:
    """Write an FMU for the signals of each component that they feed, into a folder; return them by their feeds.

    Raises `BuildError`.
    """
    names = instance_names(wiring)
    return {
        name: build_table(
            folder / f"{file_name(names[name])}.fmu",
            [_output(channel, wiring, feed) for channel in feed.channels],
            wiring.descriptions[feed.component].units,
            platforms,
            f"signals that feed {feed.component}",
        )
        for name, feed in wiring.feeds.items()
    }


def _output(channel: Channel, wiring: Wiring, feed: Feed) -> Output:
    """Return an output in the unit of the input that it feeds."""
    signal, element = channel.signal, channel.element
    how = next(link.conversion for link in wiring.links if link.target == channel.target and link.fed)
    variable = wiring.descriptions[feed.component].variables[channel.target.variable]
    about = replace(variable, description=f"{signal.interpolation} between the samples of {signal.label}")
    return Output(about, signal.degree, signal.time, _numbers(signal, element, how))


def _numbers(signal: Signal, element: int, how: Conversion) -> np.ndarray:
    """Return values, or the coefficients of a cubic, in the input's unit: factor u + offset."""
    if signal.degree < 3:
        return np.array([how(y) for y in signal.values[:, element].tolist()])
    found = how.factor * signal.coefficients()[:, element]
    found[:, 0] += how.offset
    return found
