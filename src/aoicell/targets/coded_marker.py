"""Cross markers that say which one they are and which way up they stand.

Each of the four crosses is upright or diagonal. A quarter turn leaves both kinds as they are and
moves them on by one place, so a code is read clockwise from any cross. Of the sixteen patterns a
code may be no rotation of itself, else the orientation stays open, nor of another code:

    0000  the plain marker         equal to itself after a quarter turn
    1000  code "1", 4 rotations
    1100  code "2", 4 rotations
    1010  not used                 equal to itself after a half turn
    1110  code "3", 4 rotations
    1111  not used                 equal to itself after a quarter turn

That leaves three identities. A board with more markers repeats them: each still tells its
orientation, and the layout tells apart those of the same code.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.observation import Image
from aoicell.targets.cross_marker import find_markers
from aoicell.targets.cross_pattern import CrossPattern, Turned, check_room
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import Array

CODES: Mapping[str, Turned] = MappingProxyType(
    {
        "1": (True, False, False, False),
        "2": (True, True, False, False),
        "3": (True, True, True, False),
    }
)


@dataclass(frozen=True)
class CodedMarker(CrossPattern):
    """A cross marker of one code: the crosses that are diagonal, clockwise from the top left."""

    code: str = "1"

    def __post_init__(self) -> None:
        check_room("coded", self.size, self.pitch)
        if self.code not in CODES:
            raise InputError(f"coded marker: code '{self.code}' is none; known: {', '.join(CODES)}")

    def print_image(self, pixels: int = 640) -> Image:
        """The print as seen from the front (H, W)."""
        return self.drawing(CODES[self.code], pixels)

    def detect(self, grey: Image) -> list[Array]:
        """Cross centres (4, 2) px of all coded markers, from the top left clockwise."""
        return [seen.uv_px for seen in self.sight(grey)]

    def sight(self, grey: Image, camera: Camera | None = None) -> list[MarkerSighting]:
        """All coded markers in the raw picture, of any code."""
        seen = []
        for found in find_markers(grey, self, camera):
            read = read_code(found.turned)
            if read is not None:
                code, first = read
                uv, sigma = np.roll(found.uv_px, -first, axis=0), np.roll(found.sigma_px, -first)
                seen.append(MarkerSighting(uv, sigma, code))
        return seen


def read_code(turned: Turned) -> tuple[str, int] | None:
    """The code of crosses that are read clockwise, and which of them is the print's top left."""
    for code, pattern in CODES.items():
        for first in range(4):
            if turned[first:] + turned[:first] == pattern:
                return code, first
    return None
