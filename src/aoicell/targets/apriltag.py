"""AprilTags: a single one, or a grid of them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from aoicell.errors import InputError, did_you_mean
from aoicell.observation import Image
from aoicell.targets.fiducials import Markers, check_ids, grid_corners, marker_cells, modules
from aoicell.targets.prints import Canvas
from aoicell.targets.sighting import Sighting, opencv_frame
from aoicell.transforms import SE3, Array

FAMILIES = {f"tag{code}": f"DICT_APRILTAG_{code}" for code in ("16h5", "25h9", "36h10", "36h11")}


@dataclass(frozen=True)
class AprilTag:
    """One tag of side `tag` (m, the black border's outer edge), or `columns` x `rows` of them.

    Tags are `gap` metres apart and numbered from `first_id`, row by row from the top left, or,
    with `from_bottom`, from the bottom left upwards as Kalibr's grids are (whose tags have a
    border of two cells, though: those are not read). `points`: corners tag by tag in the order
    of the ids, each tag's clockwise from its top left.

    Frame: origin at the middle, x right, y up as one looks at the print with the tags upright,
    z out of it. Upright is what the AprilTag project prints; OpenCV's own pictures of these tags
    stand on their head, and its detector's first corner is the bottom right one. The AprilTag
    library's frame of a single tag is x right, y down, z into the tag, about the same origin:
    `T_target_opencv` of a single tag. Of a grid that is x right, y down from the top left corner.
    """

    tag: float
    first_id: int = 0
    family: str = "tag36h11"
    columns: int = 1
    rows: int = 1
    gap: float = 0.0
    from_bottom: bool = False

    def __post_init__(self) -> None:
        if self.family not in FAMILIES:
            raise InputError(
                f"apriltag family '{self.family}': {did_you_mean(self.family, FAMILIES)}"
            )
        if self.columns * self.rows > 1 and self.gap < self._module:
            raise InputError(
                f"apriltag: gap {self.gap * 1e3:g} mm is narrower than a tag's cell; at least "
                f"{self._module * 1e3:g} mm of white between tags are needed"
            )
        check_ids("apriltag", self._dictionary, self._ids)

    @property
    def points(self) -> Array:
        """Corners of the tags (4 * columns * rows, 3) in the target's frame (m)."""
        return self._corners.reshape(-1, 3)

    @property
    def half_turns(self) -> bool:
        """Never: each tag is known by its id."""
        return False

    @property
    def T_target_opencv(self) -> SE3:
        """Origin at a single tag's centre, else top left; x right, y down, z into the print."""
        if self.columns * self.rows == 1:
            return opencv_frame(0.0, 0.0)
        ps = self.points
        return opencv_frame(float(ps[:, 0].min()), float(ps[:, 1].max()))

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the print (m), a white margin of two cells included."""
        pitch, border = self.tag + self.gap, 4 * self._module - self.gap
        return self.columns * pitch + border, self.rows * pitch + border

    def print_image(self, pixels_per_metre: float = 4000.0) -> Image:
        """The print as seen from the front (H, W), tags upright."""
        canvas = Canvas(self.size, pixels_per_metre)
        for id, corners in zip(self._ids, self._corners, strict=True):
            centre = corners.mean(axis=0)
            upright = np.rot90(marker_cells(self._dictionary, id), 2)
            canvas.cells(upright, (centre[0], centre[1]), (self.tag, self.tag))
        return canvas.image()

    def sight(self, grey: Image, name: str = "apriltag") -> Sighting:
        """Corners of the tags in view, black on white or white on black.

        Raises TargetNotFound when there are fewer than two of them (one, if there is but one).
        """
        seen = self._markers.sight(grey, name, "tags")
        return Sighting(seen.ids, seen.uv_px.reshape(-1, 4, 2)[:, _UPRIGHT].reshape(-1, 2))

    @property
    def _dictionary(self) -> str:
        return FAMILIES[self.family]

    @property
    def _ids(self) -> tuple[int, ...]:
        return tuple(np.arange(self.columns * self.rows) + self.first_id)

    @property
    def _module(self) -> float:
        return self.tag / modules(self._dictionary)

    @cached_property
    def _corners(self) -> Array:
        corners = grid_corners(self.columns, self.rows, self.tag, self.gap)
        if not self.from_bottom:
            return corners
        return corners.reshape(self.rows, self.columns, 4, 3)[::-1].reshape(-1, 4, 3)

    @cached_property
    def _markers(self) -> Markers:
        room = self.gap / self.tag if self.columns * self.rows > 1 else np.inf
        return Markers(self._dictionary, self._ids, self._corners[:, _UPRIGHT], room)


_UPRIGHT = [2, 3, 0, 1]  # OpenCV's corners by ours, and ours by OpenCV's
