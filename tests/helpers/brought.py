"""What another package might bring."""

from dataclasses import dataclass, replace

from aoicell.pipeline import METHODS
from aoicell.targets.cross_marker import CrossMarker

MINE = replace(METHODS["aoicell"], name="mine")


@dataclass(frozen=True)
class BigMarker(CrossMarker):
    """A cross marker twice as large."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", 2 * self.size)
