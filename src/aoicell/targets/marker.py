"""Markers of any kind: the project's own, and those that packages bring."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol

from aoicell.errors import InputError, did_you_mean
from aoicell.observation import Image
from aoicell.plugins import load_plugin, plugin_names
from aoicell.targets.cross_marker import CrossMarker
from aoicell.transforms import Array

GROUP = "aoicell.markers"


class Marker(Protocol):
    """A square print with four points on it, clockwise from the top left.

    Its frame: origin at the centre, x to the right and y up as one looks at the print.
    """

    @property
    def size(self) -> float:
        """Side of the square (m)."""

    @property
    def crosses(self) -> Array:
        """The four points (4, 3) in the marker's frame (m)."""

    @property
    def outline(self) -> Array:
        """Corners of the square (4, 3) in the marker's frame (m)."""

    def print_image(self, pixels: int = 640) -> Image:
        """The print as seen from the front, grey (H, W)."""

    def detect(self, grey: Image) -> list[Array]:
        """Points (4, 2) in px of each such marker in a picture, up to quarter turns."""


MARKERS: Mapping[str, Callable[[float, float], Marker]] = MappingProxyType({"cross": CrossMarker})


def marker_kinds() -> list[str]:
    """All kinds that a board's file may name."""
    return [*MARKERS, *(name for name in plugin_names(GROUP) if name not in MARKERS)]


def make_marker(kind: str, size: float, pitch: float) -> Marker:
    """A marker of a kind; lengths in metres. Raises InputError for an unknown kind."""
    if kind in MARKERS:
        return MARKERS[kind](size, pitch)
    if kind not in marker_kinds():
        raise InputError(f"marker kind '{kind}': {did_you_mean(kind, marker_kinds())}")
    marker: Marker = load_plugin(GROUP, kind)(size, pitch)
    return marker
