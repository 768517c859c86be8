"""What a window on a cell shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from aoicell.observation import Image
from aoicell.transforms import SE3


@dataclass(frozen=True, eq=False)
class Axes:
    """A frame to draw: red x, green y, blue z, `length` in m. `body` carries it.

    An estimate has thin, long axes, so that both can be seen where it is good.
    """

    name: str
    T_body_frame: SE3
    body: str = "world"
    length: float = 0.10
    estimate: bool = False


@dataclass(frozen=True, eq=False)
class Shown:
    """All that changes. `picture` is RGB (H, W, 3); a row without value is a heading.

    A frame that is not named any more disappears.
    """

    Ts_world_body: Mapping[str, SE3] = field(default_factory=dict)
    axes: Sequence[Axes] = ()
    picture: Image | None = None
    caption: str = ""
    rows: Sequence[tuple[str, str]] = ()


class Controls(Protocol):
    """What the window's buttons act upon; they come from threads of their own."""

    def toggle(self) -> bool:
        """Pause, or go on; whether it is paused now."""

    def step(self) -> None:
        """Go on to the next halt, and pause there."""
