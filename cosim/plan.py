"""What flights of one kind share, worked out once."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from cosim.masters import events
from cosim.masters.initialization.initialize import Initialization
from cosim.masters.kernel.library import signal_functions
from cosim.masters.master import Course
from cosim.results.effective import Effective
from cosim.slaves.tabulated import Tabulated
from cosim.system import feeds
from cosim.system.events import Change
from cosim.system.wiring import Wiring
from cosim.time import Schedule


@dataclass(frozen=True)
class Plan:
    """What flights of one kind share; `wiring` has the timings that they fly."""

    wiring: Wiring
    course: Course
    initialization: Initialization
    effective: Effective
    info: Mapping[str, Any]
    signals: Mapping[str, feeds.Pieces]
    events: events.Plan

    def tabulated(self) -> dict[str, Tabulated]:
        """Return the instances that signals are, new ones: they cost no more than a reset would."""
        return {
            name: Tabulated(feed, feeds.description(feed), self.signals[name], signal_functions)
            for name, feed in self.wiring.feeds.items()
        }


def on(schedule: Schedule, changes: tuple[Change, ...]) -> tuple[Change, ...]:
    """Return changes at the points of the schedule that a master flies, which may have more of them."""
    return tuple(replace(c, point=point) for c, point in zip(changes, schedule.event_points, strict=True))
