"""Coded square markers (ArUco, AprilTag): found by OpenCV, corners by their straight sides.

A corner is where two sides of the black square cross. The sides are sampled near the corner
only: a lens bends a long one. On synthetic pictures of three grids (four views each, blur up to
1 px, noise up to 3 grey values) that errs by 0.02-0.08 px rms; OpenCV's refinements err by
0.23-0.70 (SUBPIX), 0.55-0.69 (CONTOUR) and 0.13-0.17 px (APRILTAG, once half a pixel is taken
off both coordinates: it takes a pixel's corner for its centre).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from aoicell.errors import InputError, TargetNotFound, did_you_mean
from aoicell.observation import Image
from aoicell.targets.crossings import EdgeWindow, refine_crossings, settle_crossings
from aoicell.targets.sighting import Sighting
from aoicell.transforms import Array

DICTIONARIES = tuple(sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_")))
BLUR_PX = 2.5  # how far from a corner blur rounds the sides
LENGTH_PX = 40.0  # of a side that is looked at: a lens bends a long one
_REACH = 0.6  # of a cell: beyond it the black border ends
_FALSE = 0.6  # a marker lies that far (in its sides) from where the others put it: a false one


@lru_cache(maxsize=32)
def dictionary_of(name: str) -> cv2.aruco.Dictionary:
    """One of OpenCV's predefined dictionaries, by its name (DICT_...)."""
    if name not in DICTIONARIES:
        raise InputError(f"dictionary '{name}': {did_you_mean(name, DICTIONARIES)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def modules(dictionary: str) -> int:
    """Cells along a marker's side, the black border of one cell included."""
    return dictionary_of(dictionary).markerSize + 2


def marker_cells(dictionary: str, id: int) -> Array:
    """A marker's cells (n, n), 1 for black, as OpenCV prints it."""
    known = dictionary_of(dictionary)
    bits = cv2.aruco.generateImageMarker(known, id, modules(dictionary))
    return np.asarray(bits == 0, dtype=float)


def check_ids(name: str, dictionary: str, ids: Sequence[int]) -> None:
    """Raises InputError for ids that the dictionary does not have."""
    count = len(dictionary_of(dictionary).bytesList)
    if min(ids) < 0 or max(ids) >= count:
        raise InputError(
            f"{name}: ids {min(ids)} to {max(ids)} are not all in {dictionary}, "
            f"which has 0 to {count - 1}"
        )


def grid_corners(columns: int, rows: int, marker: float, gap: float) -> Array:
    """Corners (rows * columns, 4, 3) of a grid of markers about its middle (m).

    Row by row from the top left; each marker clockwise from its top left as one looks at it.
    """
    pitch = marker + gap
    x = (np.arange(columns) - (columns - 1) / 2) * pitch
    y = ((rows - 1) / 2 - np.arange(rows)) * pitch
    centres = np.stack([*np.meshgrid(x, y), np.zeros((rows, columns))], axis=-1).reshape(-1, 1, 3)
    square = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * marker / 2
    corners: Array = centres + square
    return corners


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers of one target: ids of a dictionary, and corners (N, 4, 3) in its frame (m).

    `room`: how much white there is around each marker, in its sides.
    """

    dictionary: str
    ids: tuple[int, ...]
    corners: Array
    room: float = np.inf

    def find(self, grey: Image, name: str) -> dict[int, Array]:
        """Refined corners (4, 2) px by the marker's place in `ids`, false ones left out.

        Raises TargetNotFound when three markers and a tenth of them lie elsewhere than on this
        target: it is described wrongly.
        """
        found = _detected(grey, self.dictionary)
        places = {id: place for place, id in enumerate(self.ids)}
        mine = [(places[id], uv) for id, uv in found if id in places]
        if not mine:
            return {}
        uvs = self._refine(grey, np.array([uv for _, uv in mine]))
        whole = [(k, uv) for (k, _), uv in zip(mine, uvs, strict=True) if np.isfinite(uv).all()]
        kept, seen = _consistent(whole, self.corners), {place for place, _ in whole}
        if len(seen) - len(kept) > max(2, 0.1 * len(seen)):
            raise TargetNotFound(
                f"{name}: only {len(kept)} of the {len(seen)} markers in the picture lie as on the "
                "described target; check its columns, rows, sizes, ids and pattern"
            )
        return kept

    def sight(self, grey: Image, name: str, what: str = "markers") -> Sighting:
        """Corners of all markers that were found; at least two of them where there are more."""
        found = self.find(grey, name)
        needed = min(2, len(self.ids))
        if len(found) < needed:
            raise TargetNotFound(
                f"{name}: {len(found)} of {len(self.ids)} {what} of {self.dictionary} in the "
                f"{grey.shape[1]}x{grey.shape[0]} picture, at least {needed} needed; "
                "bring more of the target into view, in focus"
            )
        places = sorted(found)
        ids = np.concatenate([4 * place + np.arange(4) for place in places])
        return Sighting(ids, np.concatenate([found[place] for place in places]))

    def _refine(self, grey: Image, uvs_px: Array) -> Array:
        """Corners (N, 4, 2) where the sides cross; NaN beyond the edge of the picture."""
        along, back = np.roll(uvs_px, -1, axis=1) - uvs_px, np.roll(uvs_px, 1, axis=1) - uvs_px
        sides = np.asarray(np.linalg.norm(along, axis=2))
        rough, fine = self._windows(float(sides.min()))
        uv, x, y = (v.reshape(-1, 2) for v in (uvs_px, along, back))
        for _ in range(2):
            uv = np.nan_to_num(refine_crossings(grey, uv, x, y, rough))
        uv = np.nan_to_num(settle_crossings(grey, uv, x, y, fine))
        reach = min(fine.high * float(sides.max()), fine.half_px)
        beyond = (uv <= reach) | (uv >= np.array(grey.shape[::-1]) - 1 - reach)
        refined = np.where(beyond.any(axis=1, keepdims=True), np.nan, uv)
        return refined.reshape(-1, 4, 2)

    def _windows(self, side_px: float) -> tuple[EdgeWindow, EdgeWindow]:
        """Along the sides clear of the blurred corner; across them within border and margin.

        OpenCV's corners are a few hundredths of a side off: it takes a wide one first.
        """
        reach = min(_REACH / modules(self.dictionary), 0.8 * self.room)
        start = float(np.clip(BLUR_PX / side_px, 0.05, 0.2))
        arms = ((start, min(0.45, start + LENGTH_PX / side_px)),)
        wide = min(reach, 0.07)
        return (
            EdgeWindow(arms, low=wide, high=wide, profiles=12),
            EdgeWindow(arms, low=min(0.02, reach), high=reach, profiles=16, whole=0.7),
        )


def _detected(grey: Image, dictionary: str) -> list[tuple[int, Array]]:
    """Ids and coarse corners (4, 2) px of every marker of a dictionary, black or white ones."""
    corners, ids, _ = _detector(dictionary).detectMarkers(grey)
    if ids is None:
        return []
    uvs = [np.asarray(c, dtype=float).reshape(4, 2) for c in corners]
    return list(zip((int(id) for id in np.ravel(ids)), uvs, strict=True))


@lru_cache(maxsize=32)
def _detector(dictionary: str) -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.detectInvertedMarker = True
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    parameters.minMarkerPerimeterRate = 0.02
    return cv2.aruco.ArucoDetector(dictionary_of(dictionary), parameters)


def homography(points: Array, uv_px: Array, tolerance_px: float | None = None) -> Array:
    """From the print (N, >=2) to the picture (N, 2); with a tolerance, by what most agree on."""
    method = 0 if tolerance_px is None else cv2.RANSAC
    H, _ = cv2.findHomography(points[:, :2], uv_px, method, tolerance_px or 3.0)
    return np.full((3, 3), np.nan) if H is None else np.asarray(H, dtype=float)


def transformed(H: Array, points: Array) -> Array:
    """Points (N, >=2) of the print in the picture (N, 2)."""
    uvw = points[:, :2] @ H[:, :2].T + H[:, 2]
    uv: Array = uvw[:, :2] / uvw[:, 2:]
    return uv


def _consistent(found: Sequence[tuple[int, Array]], corners: Array) -> dict[int, Array]:
    """The markers that lie together as on the print; the nearer one where an id comes twice."""
    if len(found) < 2:
        return dict(found)
    sides = [np.linalg.norm(uv - np.roll(uv, 1, axis=0), axis=1) for _, uv in found]
    tolerance = _FALSE * float(np.median(sides))
    points = np.concatenate([corners[place] for place, _ in found])
    H = homography(points, np.concatenate([uv for _, uv in found]), tolerance)
    best: dict[int, tuple[float, Array]] = {}
    for place, uv in found:
        gap = float(np.linalg.norm(uv - transformed(H, corners[place]), axis=1).max())
        if gap < tolerance and gap < best.get(place, (np.inf, uv))[0]:
            best[place] = gap, uv
    return {place: uv for place, (_, uv) in best.items()}
