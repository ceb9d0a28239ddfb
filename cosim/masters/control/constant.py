"""Every step counts, and all are of one size."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cosim.masters.master import Outcome
from cosim.masters.point import Point


@dataclass(frozen=True)
class Constant:
    """Goes from communication point to communication point, or `far`."""

    def until(self, point: Point, last: int, *, far: bool) -> int:
        """Return the next communication point, or `far` the last that may be gone to."""
        return last if far else point.index + 1

    def accepts(self, outcome: Outcome) -> bool:
        """Accept whatever came."""
        return True

    def told(self) -> Mapping[str, Any]:
        """Return nothing: all is said by the experiment."""
        return {}

    def memory(self) -> Any:
        """Return nothing: no step depends on those before."""
        return None

    def recall(self, memory: Any) -> None:
        """Remember nothing."""
