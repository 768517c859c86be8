"""ChArUco boards: a chessboard with a marker in each white square."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aoicell.errors import InputError
from aoicell.observation import Image
from aoicell.targets.crossings import (
    EdgeWindow,
    checker_contrast,
    has_checkers,
    settle_crossings,
)
from aoicell.targets.fiducials import (
    Markers,
    check_ids,
    homography,
    marker_cells,
    transformed,
)
from aoicell.targets.prints import Canvas
from aoicell.targets.sighting import Sighting, enough, opencv_frame
from aoicell.transforms import SE3, Array

_NEEDED = 6
_NEAREST = 4  # markers that say where a corner is


@dataclass(frozen=True)
class Charuco:
    """`columns` x `rows` squares of side `square`, markers of side `marker` in the white ones (m).

    Markers are numbered row by row from the top left. The top left square is black; with
    `legacy` (OpenCV before 4.6) it is white when `rows` is even. `points`: inner corners, row by
    row from the top left, as OpenCV numbers them. Frame: origin at the middle of the board, x
    right, y up as one looks at the print, z out of it. OpenCV's has its origin at the board's top
    left corner (the outer one), x right, y down, z into the print: `T_target_opencv`.
    """

    columns: int
    rows: int
    square: float
    marker: float
    dictionary: str = "DICT_6X6_250"
    legacy: bool = False

    def __post_init__(self) -> None:
        if not 0 < self.marker < self.square:
            raise InputError(
                f"charuco: markers of {self.marker * 1e3:g} mm do not fit into squares of "
                f"{self.square * 1e3:g} mm"
            )
        check_ids("charuco", self.dictionary, self._markers.ids)

    @cached_property
    def points(self) -> Array:
        """Inner corners ((columns - 1) * (rows - 1), 3) in the target's frame (m)."""
        x = (np.arange(1, self.columns) - self.columns / 2) * self.square
        y = (self.rows / 2 - np.arange(1, self.rows)) * self.square
        grid_x, grid_y = np.meshgrid(x, y)
        return np.column_stack([grid_x.ravel(), grid_y.ravel(), np.zeros(grid_x.size)])

    @property
    def half_turns(self) -> bool:
        """Never: the markers tell which way round the board is."""
        return False

    @property
    def T_target_opencv(self) -> SE3:
        """OpenCV's frame: origin at the outer top left corner, x right, y down, z into it."""
        return opencv_frame(-self.columns * self.square / 2, self.rows * self.square / 2)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the print (m), a white margin of half a square included."""
        return (self.columns + 1) * self.square, (self.rows + 1) * self.square

    def print_image(self, pixels_per_metre: float = 4000.0) -> Image:
        """The print as seen from the front (H, W)."""
        canvas = Canvas(self.size, pixels_per_metre)
        board = (self.columns * self.square, self.rows * self.square)
        canvas.cells(1.0 - self._white, (0.0, 0.0), board)
        for id, corners in zip(self._markers.ids, self._markers.corners, strict=True):
            centre = corners.mean(axis=0)
            side = (self.marker, self.marker)
            canvas.cells(marker_cells(self.dictionary, id), (centre[0], centre[1]), side)
        return canvas.image()

    def sight(self, grey: Image, name: str = "charuco") -> Sighting:
        """The inner corners in view, black on white or white on black.

        The markers say where each corner has to be; there it is looked for. Raises TargetNotFound
        when there are fewer than six, or all of them in one row.
        """
        markers = self._markers.find(grey, name)
        seen = (
            self._corners_near(grey, markers)
            if markers
            else Sighting(np.arange(0), np.empty((0, 2)))
        )
        what = (
            f"{len(markers)} of {len(self._markers.ids)} markers of {self.dictionary} and "
            f"{len(seen.ids)} of {len(self.points)} corners in the {grey.shape[1]}x"
            f"{grey.shape[0]} picture, at least {_NEEDED} corners are needed"
        )
        return enough(seen, self.points, _NEEDED, what, name)

    def _corners_near(self, grey: Image, markers: dict[int, Array]) -> Sighting:
        """Corners where the board's markers put them, if they are checkered there."""
        predicted, x, y = self._predicted(markers)
        reach = 0.45 * (np.abs(x) + np.abs(y))
        inside = (predicted > reach) & (predicted < np.array(grey.shape[::-1]) - 1 - reach)
        ids = np.flatnonzero(inside.all(axis=1))
        if not len(ids):
            return Sighting(ids, np.empty((0, 2)))
        uv, x, y = predicted[ids], x[ids], y[ids]
        uv = settle_crossings(grey, uv, x, y, self._window)
        sharp = np.isfinite(uv).all(axis=1)
        ids, uv, x, y = ids[sharp], uv[sharp], x[sharp], y[sharp]
        row, column = np.divmod(ids, self.columns - 1)
        contrasts = checker_contrast(grey, uv, x, y, 0.6 * self._rim)
        kept = has_checkers(contrasts, column, row)
        return Sighting(ids[kept], uv[kept])

    def _predicted(self, markers: dict[int, Array]) -> tuple[Array, Array, Array]:
        """Corners (N, 2) and steps of a square along x and down, from the markers found (px).

        Each by a homography of the markers nearest to it: a lens bends the board as a whole.
        """
        places = np.array(list(markers))
        corners, uvs = self._markers.corners[places], np.array(list(markers.values()))
        gaps = np.linalg.norm(self.points[:, None] - corners.mean(axis=1)[None], axis=2)
        x, y = np.array([[self.square / 2, 0, 0], [0, -self.square / 2, 0]])
        predicted = []
        for point, nearest in zip(self.points, gaps.argsort(axis=1)[:, :_NEAREST], strict=True):
            H = homography(corners[nearest].reshape(-1, 3), uvs[nearest].reshape(-1, 2))
            predicted.append(transformed(H, point + np.array([0 * x, x, -x, y, -y])))
        at = np.array(predicted)
        return at[:, 0], at[:, 1] - at[:, 2], at[:, 3] - at[:, 4]

    @cached_property
    def _white(self) -> Array:
        """Which squares (rows, columns) are white."""
        row, column = np.indices((self.rows, self.columns))
        first = 1 if self.legacy and self.rows % 2 == 0 else 0
        return np.asarray((row + column + first) % 2 == 1, dtype=float)

    @cached_property
    def _markers(self) -> Markers:
        row, column = np.nonzero(self._white)
        centre = np.column_stack([
            (column + 0.5 - self.columns / 2) * self.square,
            (self.rows / 2 - row - 0.5) * self.square,
            np.zeros(len(row)),
        ])  # fmt: skip
        half = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * self.marker / 2
        ids = tuple(range(len(row)))
        return Markers(
            self.dictionary, ids, centre[:, None] + half, room=self._rim * self.square / self.marker
        )

    @property
    def _window(self) -> EdgeWindow:
        """Profiles end before the marker begins."""
        reach = 0.8 * self._rim
        return EdgeWindow(low=min(0.12, reach), high=min(0.25, reach), whole=0.7)

    @property
    def _rim(self) -> float:
        """Width of the white around a marker, in squares."""
        return (1 - self.marker / self.square) / 2
