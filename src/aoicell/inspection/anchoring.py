"""Where the design lies in a reference picture: by the parts themselves.

A calibrated pose puts the board where its markers are, and markers are glued on to some tenths of
a millimetre and of a degree, which makes up to 3 mm at the other end of the board. Two steps slide
and turn the board in its plane to where its parts are: first until edges lie under the designed
outlines of all of them, near the pose given if there are few; then to their middles. Most parts,
their pads and their printed frames look alike after a half turn, and about which point they do is
told exactly by the picture alone.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign, Component
from aoicell.camera import Camera
from aoicell.inspection.planes import Plane, slopes
from aoicell.inspection.shown import Shown
from aoicell.observation import Image
from aoicell.transforms import SE3, Array, from_xyz_rpy

_LEAST_SHARE = 0.5  # of a component that has to be seen for its outline to count
_SPACING = 0.4e-3  # m, from one point of an outline to the next
_MOST_POINTS = 120  # of one component: no large one outvotes the rest
_SMOOTHING_PX = 2.0
# slides that are tried: up to so far (m) along x and y, a step, up to so far turned, a step
_COARSE = (4e-3, 0.5e-3, np.radians(1.0), np.radians(0.2))
_NEAR = (1e-3, 0.25e-3, np.radians(0.6), np.radians(0.1))  # with fewer than `_FEWEST` parts
_FINE = (0.5e-3, 0.125e-3, np.radians(0.2), np.radians(0.05))
_FEW = 8  # of the outlines' points, one in so many tells where to look more closely
_CAP = 20.0  # grey values a pixel: a stronger edge counts no more

_HIGHEST = 2e-3  # m: of taller parts, top and foot have different middles
_LARGEST = 20e-3  # m
_FRAME = 0.4e-3  # m about a part that are alike as well
_SEARCH = 0.5e-3  # m, of a middle about where the outlines have it
_ALIKE = 0.6  # correlation with its own half turn
_FEWEST = 6


def anchored(
    grey: Image, board: BoardDesign, camera: Camera, T_camera_board: SE3, shown: Shown
) -> SE3:
    """T_camera_board of the design in the picture (H, W), near a pose at which it is `shown`."""
    visible = [
        component
        for component, share in zip(board.components, shown.shares, strict=True)
        if share > _LEAST_SHARE
    ]
    if not visible:
        return T_camera_board
    picture = grey.astype(np.float32)
    T = _by_outlines(picture, visible, camera, T_camera_board)
    return _by_middles(picture, visible, camera, T)


# -- Outlines ---------------------------------------------------------------------------------


def _by_outlines(picture: Plane, components: Sequence[Component], camera: Camera, T: SE3) -> SE3:
    smooth = cv2.GaussianBlur(picture, (0, 0), _SMOOTHING_PX)
    steep = slopes(np.asarray(smooth, np.float32))
    ps, along = np.split(np.concatenate([_outline(c) for c in components]), 2, axis=1)
    uv, J, middle = _slides(ps, camera, T)
    ahead = camera.project(ps + along * 1e-4, T) - uv
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    normals = ahead @ np.array([[0, 1], [-1, 0]])

    def strength(slide: Array, some: slice) -> float:
        at = (uv[some] + J[some] @ slide).astype(np.float32)
        found = cv2.remap(steep, at[:, :1], at[:, 1:], cv2.INTER_LINEAR)[:, 0]
        across = np.abs((found * normals[some]).sum(axis=1))
        return float(np.minimum(across, _CAP).sum())

    best = np.zeros(3)
    far = (_COARSE, slice(None, None, _FEW))
    near = (_NEAR, slice(None))
    for tried, some in (near if len(components) < _FEWEST else far, (_FINE, slice(None))):
        slides = best + _grid(*tried)
        best = slides[int(np.argmax([strength(slide, some) for slide in slides]))]
    return _slid(T, middle, best)


def _grid(reach: float, step: float, turn: float, turn_step: float) -> Array:
    """Slides (N, 3) about none, the shortest first: of equals, it is taken."""
    steps, turns = (
        np.arange(-most, most + size / 2, size) for most, size in ((reach, step), (turn, turn_step))
    )
    slides = np.array(list(product(steps, steps, turns)))
    lengths = np.linalg.norm(slides / [reach, reach, turn], axis=1)
    return np.asarray(slides[np.argsort(lengths, kind="stable")])


def _outline(component: Component) -> Array:
    """Points and directions (N, 6) on the upper outline."""
    corners = np.column_stack([component.footprint, np.full(4, component.top)])
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(edges, axis=1)
    spacing = max(_SPACING, lengths.sum() / _MOST_POINTS)
    rows = []
    for corner, edge, length in zip(corners, edges, lengths, strict=True):
        count = max(int(length / spacing), 2)
        t = (np.arange(count) + 0.5)[:, None] / count
        rows.append(np.hstack([corner + t * edge, np.tile(edge / length, (count, 1))]))
    return np.concatenate(rows)


# -- Middles ----------------------------------------------------------------------------------


def _by_middles(picture: Plane, components: Sequence[Component], camera: Camera, T: SE3) -> SE3:
    small = [c for c in components if c.height < _HIGHEST and max(c.width, c.depth) < _LARGEST]
    if len(small) < _FEWEST:
        return T
    middles = np.array([[c.x, c.y, c.z + c.height / 2] for c in small])
    uv, J, middle = _slides(middles, camera, T)
    scale = camera.focal_px / float(T.translation[2])
    offsets = [
        _off_middle(picture, at, int((np.hypot(c.width, c.depth) / 2 + _FRAME) * scale), scale)
        for c, at in zip(small, uv, strict=True)
    ]
    found = np.array([offset is not None for offset in offsets])
    if found.sum() < _FEWEST:
        return T
    wanted = np.array([offset for offset in offsets if offset is not None])
    return _slid(T, middle, _robust(J[found], wanted))


def _off_middle(picture: Plane, at: Array, radius: int, scale: float) -> Array | None:
    """How far (2,) px from a pixel the point lies about which a half turn changes least.

    The square about the pixel, turned, is looked for in the picture; it is found twice as far off.
    """
    reach = int(2 * _SEARCH * scale) + 1
    u, v = np.rint(at).astype(int)
    low, high = np.array([u, v]) - radius - reach, np.array([u, v]) + radius + reach + 1
    if (low < 0).any() or (high > picture.shape[::-1]).any():
        return None
    window = picture[low[1] : high[1], low[0] : high[0]]
    turned = window[reach:-reach, reach:-reach][::-1, ::-1]
    score = cv2.matchTemplate(window, np.ascontiguousarray(turned), cv2.TM_CCOEFF_NORMED)
    _, best, _, (x, y) = cv2.minMaxLoc(score)
    edge = 2 * reach
    if best < _ALIKE or not (0 < x < edge and 0 < y < edge):
        return None
    peak = [x + _vertex(score[y, x - 1 : x + 2]), y + _vertex(score[y - 1 : y + 2, x])]
    return np.array([u, v]) + (np.array(peak) - reach) / 2 - at


def _vertex(values: NDArray[Any]) -> float:
    """Where the parabola through three values at -1, 0, 1 has its top."""
    before, at, after = (float(value) for value in values)
    return 0.5 * (before - after) / (before - 2 * at + after + 1e-12)


def _robust(J: Array, wanted: Array) -> Array:
    """The slide (3,) that serves the wishes (N, 2) px best; Cauchy's weights."""
    weights = np.ones(len(wanted))
    for _ in range(15):
        JW = J * weights[:, None, None]
        A, b = np.einsum("nia,nib->ab", JW, J), np.einsum("nia,ni->a", JW, wanted)
        slide = np.linalg.solve(A, b)
        left = np.linalg.norm(wanted - J @ slide, axis=1)
        weights = 1 / (1 + (left / max(float(np.median(left)), 0.05)) ** 2)
    return np.asarray(slide)


# -- Slides -----------------------------------------------------------------------------------


def _slides(ps: Array, camera: Camera, T: SE3) -> tuple[Array, Array, Array]:
    """Pixels (N, 2) of points (N, 3), how they move (N, 2, 3) with a slide (x, y; m, and a turn)
    of the board about a point (3,), and that point.
    """
    middle, delta = ps.mean(axis=0) * [1, 1, 0], 1e-4
    uv = camera.project(ps, T)
    moves = ([delta, 0, 0], [0, delta, 0], delta * np.cross([0, 0, 1], ps - middle))
    J = np.stack([(camera.project(ps + move, T) - uv) / delta for move in moves], axis=2)
    return uv, J, middle


def _slid(T_camera_board: SE3, middle: Array, slide: Array) -> SE3:
    x, y, turn = slide
    about = SE3(np.eye(3), middle)
    return T_camera_board * about * from_xyz_rpy([x, y, 0], [0, 0, turn]) * about.inverse()
