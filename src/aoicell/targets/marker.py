"""Markers of any kind: the project's own, and those that packages bring."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import InputError, did_you_mean
from aoicell.observation import Image
from aoicell.plugins import load_plugin, plugin_names
from aoicell.targets.coded_marker import CODES, CodedMarker
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.cross_pattern import least_size
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.targets.tag_markers import CHARUCO_CODES, TAG_CODES, CharucoMarker, TagMarker
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
        """Points (4, 2) in px of each such marker in a picture, clockwise.

        Up to quarter turns, unless the marker bears a code.
        """


@runtime_checkable
class Sighted(Protocol):
    """A marker that tells more about what it finds than `Marker.detect` does."""

    def sight(self, grey: Image, camera: Camera | None = None) -> list[MarkerSighting]:
        """Each such marker in a raw picture; with the camera its distortion is in the model."""


@dataclass(frozen=True)
class MarkerKind:
    """How markers of a kind are made from (size, pitch, code), and which there are.

    `codes`: what tells one from another, "" for a kind without. `least_size` gives the side of the
    smallest square (m) for a pitch (m), `share` the usual pitch in shares of the side.
    """

    make: Callable[[float, float, str], Marker]
    codes: tuple[str, ...]
    least_size: Callable[[float], float]
    share: float


def _numbers(count: int) -> tuple[str, ...]:
    return tuple(map(str, range(count)))


MARKERS: Mapping[str, MarkerKind] = MappingProxyType(
    {
        "cross": MarkerKind(
            lambda size, pitch, _: CrossMarker(size, pitch), ("",), least_size, 0.6
        ),
        "coded": MarkerKind(
            lambda size, pitch, code: CodedMarker(size, pitch, code=code),
            tuple(CODES), least_size, 0.6,
        ),
        "apriltag": MarkerKind(TagMarker, _numbers(TAG_CODES), TagMarker.least_size, 0.8),
        "charuco": MarkerKind(
            CharucoMarker, _numbers(CHARUCO_CODES), CharucoMarker.least_size, 0.6
        ),
    }
)  # fmt: skip


def marker_kinds() -> list[str]:
    """All kinds that a board's file may name."""
    return [*MARKERS, *(name for name in plugin_names(GROUP) if name not in MARKERS)]


def find_kind(kind: str) -> MarkerKind:
    """A kind by its name; one that another package brings has no codes.

    Raises InputError for an unknown name.
    """
    if kind in MARKERS:
        return MARKERS[kind]
    if kind not in marker_kinds():
        raise InputError(f"marker kind '{kind}': {did_you_mean(kind, marker_kinds())}")

    def make(size: float, pitch: float, _: str) -> Marker:
        marker: Marker = load_plugin(GROUP, kind)(size, pitch)
        return marker

    return MarkerKind(make, ("",), lambda pitch: pitch, 0.6)


def make_marker(kind: str, size: float, pitch: float, code: str = "") -> Marker:
    """A marker of a kind; lengths in metres. Without a code it bears the kind's first.

    Raises InputError for an unknown kind or code, and for points that do not fit into the square.
    """
    known = find_kind(kind)
    return known.make(size, pitch, code or known.codes[0])


def sight_markers(
    marker: Marker, grey: Image, camera: Camera | None = None
) -> list[MarkerSighting]:
    """Each marker of this kind in a raw picture; with the camera its distortion is in the model.

    A marker of another package may know no more than to `detect`: without a code or sigma.
    """
    if isinstance(marker, Sighted):
        return marker.sight(grey, camera)
    return [MarkerSighting(uv, np.full(4, np.nan)) for uv in marker.detect(grey)]
