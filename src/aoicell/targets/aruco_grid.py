"""Grids of ArUco markers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aoicell.observation import Image
from aoicell.targets.fiducials import Markers, check_ids, grid_corners, marker_cells
from aoicell.targets.prints import Canvas
from aoicell.targets.sighting import Sighting, opencv_frame
from aoicell.transforms import SE3, Array


@dataclass(frozen=True)
class ArucoGrid:
    """`columns` x `rows` markers of side `marker` (m), `gap` metres apart, as OpenCV's GridBoard.

    Numbered row by row from the top left, from `first_id`; `points` are the markers' corners,
    each marker's clockwise from its top left. Frame: origin at the middle of the grid, x right,
    y up as one looks at the print, z out of it. OpenCV's has its origin at the first corner of
    the first marker, x right, y down, z into the print: `T_target_opencv`.
    """

    columns: int
    rows: int
    marker: float
    gap: float
    dictionary: str = "DICT_4X4_50"
    first_id: int = 0

    def __post_init__(self) -> None:
        check_ids("aruco_grid", self.dictionary, self._ids)

    @property
    def points(self) -> Array:
        """Corners of the markers (4 * columns * rows, 3) in the target's frame (m)."""
        return self._markers.corners.reshape(-1, 3)

    @property
    def half_turns(self) -> bool:
        """Never: each marker is known by its id."""
        return False

    @property
    def T_target_opencv(self) -> SE3:
        """OpenCV's frame: origin at the first corner, x right, y down, z into the print."""
        x, y, _ = self.points[0]
        return opencv_frame(x, y)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the print (m), a white margin of a gap included."""
        pitch = self.marker + self.gap
        return self.columns * pitch + self.gap, self.rows * pitch + self.gap

    def print_image(self, pixels_per_metre: float = 4000.0) -> Image:
        """The print as seen from the front (H, W)."""
        canvas = Canvas(self.size, pixels_per_metre)
        for id, corners in zip(self._ids, self._markers.corners, strict=True):
            centre = corners.mean(axis=0)
            side = (self.marker, self.marker)
            canvas.cells(marker_cells(self.dictionary, id), (centre[0], centre[1]), side)
        return canvas.image()

    def sight(self, grey: Image, name: str = "aruco_grid") -> Sighting:
        """Corners of the markers in view, black on white or white on black.

        Raises TargetNotFound when there are fewer than two of them (one, if there is but one).
        """
        return self._markers.sight(grey, name)

    @property
    def _ids(self) -> tuple[int, ...]:
        return tuple(np.arange(self.columns * self.rows) + self.first_id)

    @cached_property
    def _markers(self) -> Markers:
        corners = grid_corners(self.columns, self.rows, self.marker, self.gap)
        return Markers(self.dictionary, self._ids, corners, room=self.gap / self.marker)
