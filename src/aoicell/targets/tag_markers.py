"""AprilTags and ChArUco boards as drop-in markers: on the same square, with four points each."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.apriltag import FAMILIES, AprilTag
from aoicell.targets.charuco import Charuco
from aoicell.targets.cross_pattern import corners_of
from aoicell.targets.fiducials import Markers, dictionary_of, homography, marker_cells, transformed
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.targets.prints import Canvas
from aoicell.transforms import Array

FAMILY = "tag36h11"
TAG_CODES = 50  # of the 587 of the family: more than a board has markers
DICTIONARY = "DICT_4X4_250"
SQUARES = 5  # along a side of the ChArUco board, so that its inner corners are four by four
ON_BOARD = SQUARES**2 // 2  # ArUco markers
CHARUCO_CODES = 20
# Standard deviation a coordinate of a tag's corner: what is left without noise, and what is added
# by noise as large as the contrast of the print. Measured: `aoicell bench markers`.
TAG_SIGMA_PX, TAG_NOISE_PX = 0.025, 1.2
_MARGIN = 0.6  # of what was found, around it: where its corners are looked for


@dataclass(frozen=True)
class _SquareMarker:
    """A square of side `size` with four points at `pitch` and a code, in metres."""

    size: float = 0.060
    pitch: float = 0.036
    code: str = "0"

    @property
    def crosses(self) -> Array:
        """The four points (4, 3) in the marker's frame (m), clockwise from the top left."""
        return corners_of(self.pitch)

    @property
    def outline(self) -> Array:
        """Corners of the square (4, 3) in the marker's frame (m), clockwise from the top left."""
        return corners_of(self.size)


@dataclass(frozen=True)
class TagMarker(_SquareMarker):
    """An AprilTag of family 36h11; the points are its corners, the code is its id."""

    def __post_init__(self) -> None:
        _check_code("apriltag", self.code, TAG_CODES)
        _check_size("apriltag", self.size, self.pitch, TagMarker.least_size(self.pitch))

    @staticmethod
    def least_size(pitch: float) -> float:
        """Side (m) of the smallest square: the tag and a cell of white around it."""
        return pitch * 10 / 8

    def print_image(self, pixels: int = 640) -> Image:
        """The print as seen from the front (H, W), the tag upright."""
        canvas = Canvas((self.size, self.size), pixels / self.size)
        cells = np.rot90(marker_cells(FAMILIES[FAMILY], int(self.code)), 2)
        canvas.cells(cells, (0.0, 0.0), (self.pitch, self.pitch))
        return canvas.image()

    def detect(self, grey: Image) -> list[Array]:
        """Corners (4, 2) px of all such tags, from the top left clockwise."""
        return [seen.uv_px for seen in self.sight(grey)]

    def sight(self, grey: Image, camera: Camera | None = None) -> list[MarkerSighting]:
        """All tags of the family in the raw picture; the camera is not needed."""
        seen = []
        for id, corners in _detected(grey, FAMILIES[FAMILY]):
            if id >= TAG_CODES:
                continue
            part, origin = _around(grey, corners)
            try:
                uv = AprilTag(self.pitch, first_id=id).sight(part).uv_px + origin
            except TargetNotFound:  # at the edge of the picture, or too soft
                continue
            sigma = np.hypot(TAG_SIGMA_PX, TAG_NOISE_PX * _noise_over_contrast(part))
            seen.append(MarkerSighting(uv, np.full(4, sigma), str(id)))
        return seen


@dataclass(frozen=True)
class CharucoMarker(_SquareMarker):
    """A ChArUco board of 5 x 5 squares; the points are the outermost of its inner corners.

    All inner corners that are seen fix the four by a homography. The code says which ArUco
    markers it carries: code k those from 12 k on.
    """

    def __post_init__(self) -> None:
        _check_code("charuco", self.code, CHARUCO_CODES)
        _check_size("charuco", self.size, self.pitch, CharucoMarker.least_size(self.pitch))

    @staticmethod
    def least_size(pitch: float) -> float:
        """Side (m) of the smallest square: the board, without a margin."""
        return pitch * SQUARES / (SQUARES - 2)

    def print_image(self, pixels: int = 640) -> Image:
        """The print as seen from the front (H, W)."""
        return self._board(int(self.code)).print_image(pixels / self.size)

    def detect(self, grey: Image) -> list[Array]:
        """The four points (4, 2) px of all such boards, from the top left clockwise."""
        return [seen.uv_px for seen in self.sight(grey)]

    def sight(self, grey: Image, camera: Camera | None = None) -> list[MarkerSighting]:
        """All such boards in the raw picture; with the camera its distortion is in the model."""
        corners: dict[int, list[Array]] = {}
        for id, uv in _detected(grey, DICTIONARY):
            if id < ON_BOARD * CHARUCO_CODES:
                corners.setdefault(id // ON_BOARD, []).append(uv)
        seen = [
            self._sight(grey, code, np.concatenate(uvs), camera) for code, uvs in corners.items()
        ]
        return [sighting for sighting in seen if sighting is not None]

    def _sight(
        self, grey: Image, code: int, near: Array, camera: Camera | None
    ) -> MarkerSighting | None:
        part, origin = _around(grey, near)
        board = self._board(code)
        try:
            found = board.sight(part)
        except TargetNotFound:
            return None
        uv = found.uv_px + origin if camera is None else camera.undistort(found.uv_px + origin)
        points = board.points[found.ids, :2]
        H = homography(points, uv)
        scatter = np.sqrt(((transformed(H, points) - uv) ** 2).sum() / max(2 * len(uv) - 8, 1))
        outer = transformed(H, self.crosses)
        if not np.isfinite(outer).all() or scatter > _MOST_SCATTER_PX:
            return None
        sigma = np.full(4, scatter * np.sqrt(_OUTER_VARIANCE * len(board.points) / len(uv)))
        return MarkerSighting(outer if camera is None else _raw(camera, outer), sigma, str(code))

    def _board(self, code: int) -> "_NumberedCharuco":
        square = self.pitch / (SQUARES - 2)
        return _NumberedCharuco(SQUARES, SQUARES, square, 0.75 * square, DICTIONARY,
                                number=code, side=self.size)  # fmt: skip


_MOST_SCATTER_PX = 1.0  # of a board's corners; more is another thing
_OUTER_VARIANCE = 0.6  # of an outermost point of a 4 x 4 grid fitted by a homography


@dataclass(frozen=True)
class _NumberedCharuco(Charuco):
    """A ChArUco board with the `number`th lot of ArUco markers, on a square of side `side` (m)."""

    number: int = 0
    side: float = 0.060

    @property
    def size(self) -> tuple[float, float]:
        return self.side, self.side

    @cached_property
    def _markers(self) -> Markers:
        first = Charuco(self.columns, self.rows, self.square, self.marker, self.dictionary)._markers
        ids = tuple(id + self.number * len(first.ids) for id in first.ids)
        return Markers(self.dictionary, ids, first.corners, first.room)


def _detected(grey: Image, dictionary: str) -> list[tuple[int, Array]]:
    """Ids and rough corners (4, 2) px of all markers of a dictionary."""
    corners, ids, _ = _detector(dictionary).detectMarkers(grey)
    if ids is None:
        return []
    uvs = [np.asarray(uv, dtype=float).reshape(4, 2) for uv in corners]
    return list(zip((int(id) for id in np.ravel(ids)), uvs, strict=True))


@lru_cache(maxsize=4)
def _detector(dictionary: str) -> cv2.aruco.ArucoDetector:
    return cv2.aruco.ArucoDetector(dictionary_of(dictionary))


def _around(grey: Image, uv_px: Array) -> tuple[Image, Array]:
    """The part of a picture around points (N, 2) px, and where it begins (u, v)."""
    low, high = uv_px.min(axis=0), uv_px.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    left, top = np.maximum(np.floor(low - margin), 0).astype(int)
    right, bottom = np.ceil(high + margin).astype(int) + 1
    return np.ascontiguousarray(grey[top:bottom, left:right]), np.array([left, top], dtype=float)


def _noise_over_contrast(grey: Image) -> float:
    """Of a print in black and white, from what even areas of it look like under a Laplacian."""
    dark, bright = np.percentile(grey, [10, 90])
    rough = np.median(np.abs(cv2.Laplacian(grey, cv2.CV_32F, ksize=1)))
    return float(1.4826 * rough / np.sqrt(20) / max(bright - dark, 1.0))


def _raw(camera: Camera, ideal_px: Array) -> Array:
    """Raw pixels (N, 2) of what an ideal pinhole with the same K would show at `ideal_px`."""
    homogeneous = np.column_stack([ideal_px, np.ones(len(ideal_px))])
    return camera.project(np.linalg.solve(camera.K, homogeneous.T).T)


def _check_code(kind: str, code: str, count: int) -> None:
    if not (code.isdecimal() and int(code) < count):
        raise InputError(
            f"{kind} marker: code '{code}' is none; give a number from 0 to {count - 1}"
        )


def _check_size(kind: str, size: float, pitch: float, least: float) -> None:
    if size < least - 1e-9:
        raise InputError(
            f"{kind} marker: points at a pitch of {pitch * 1e3:g} mm do not fit into "
            f"{size * 1e3:g} mm; the square has to be {least * 1e3:g} mm at least"
        )
