"""What each component looks like in the reference: the pixels that tell of it, and of nothing else.

A pixel belongs to what it shows; a rim of bare board around a component tells where it ends. A
blurred border with a neighbour is no evidence, and neither are side walls where the upper side is
seen, but for their crest: their light comes from elsewhere when the board lies elsewhere.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign, Component
from aoicell.camera import Camera
from aoicell.inspection.findings import Box
from aoicell.inspection.planes import Plane, slopes
from aoicell.inspection.shown import BARE, HOLLOW, Shown
from aoicell.inspection.warping import on_plane
from aoicell.transforms import SE3, Array

MOSTLY = 0.4  # share of a component that is seen of one that hardly anything stands on
_BLUR_PX = 1.5  # so far a border is blurred
_BORDER_PX = 2.5  # so far from a neighbour that is in its place to less than a pixel
_LEAST_EVIDENCE = 0.25  # of what is seen of a component
_ROUNDS = 5  # of limiting what is picked to once
_EVEN = 0.1  # grey values a pixel: what is no steeper than that is picked evenly
_PLAIN, _MOST_OF_IT = 15.0, (10, 85)  # grey values between these percentiles: less is no mark
_CREST_PX = 2.0  # of a wall, below the upper side: where that ends shows there
_TOP = 0.7  # of a round part's radius: clear of its flanks


@dataclass(frozen=True)
class TemplateConfig:
    """Which pixels count: a `rim_px` of bare board, at most `most_px` of a component, thinned out
    least where it is steep (`most_hollow_px` of a hollow one, evenly), at least `least_px`. Side
    walls count where upper sides are fewer than `few_px`; a component of which less than
    `least_share` is seen is not looked at. Along the edges of hollow parts, `parallax_px` show
    anything.
    """

    rim_px: int = 2
    most_px: int = 1200
    most_hollow_px: int = 1800
    least_px: int = 12
    few_px: int = 50
    least_share: float = 0.075
    parallax_px: int = 3


@dataclass(frozen=True)
class Template:
    """A component, and its number in the board's list, as the reference shows it in n pixels, which
    are the share `visible` of its outline.

    `uv` (n, 2); grey `values`, their `slopes` (n, 2) and their `spread` (n,) over good boards;
    `inside` (n,) is false on the rim, `core` (n,) true where no border is near, `wall` (n,) on the
    crest of side walls.
    `arms` (n, 2): from its middle to what a pixel shows, in the board's plane (m).
    `centre_px` is the middle of its upper side, `D` (2, 2) the pixels that it moves by a metre
    along the board's x and y.
    """

    component: Component
    number: int
    box: Box
    visible: float
    uv: NDArray[np.float32]
    values: Array
    slopes: Array
    spread: Array
    inside: NDArray[np.bool_]
    core: NDArray[np.bool_]
    wall: NDArray[np.bool_]
    arms: Array
    centre_px: Array
    D: Array

    @property
    def hollow(self) -> bool:
        """Whether one sees what is behind it, between its upper sides or what stands on it."""
        return _is_hollow(self.component, self.visible)

    def within(self, mask: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of its pixels (n,) lie in a mask (H, W)."""
        at = self.uv.astype(int)
        return np.asarray(mask[at[:, 1], at[:, 0]] > 0)

    @cached_property
    def px_per_m(self) -> float:
        """How large it is shown, over both directions."""
        return float(np.sqrt(abs(np.linalg.det(self.D))))

    @cached_property
    def plain(self) -> bool:
        """Whether hardly anything but its outline tells where it is."""
        low, high = np.percentile(self.values[self.core], _MOST_OF_IT)
        return bool(high - low < _PLAIN)


def _is_hollow(component: Component, visible: float) -> bool:
    return component.kind in HOLLOW or visible < MOSTLY


def templates_of(
    mean: Plane, spread: Plane, shown: Shown, board: BoardDesign, camera: Camera,
    T_camera_board: SE3, config: TemplateConfig,
) -> dict[str, Template]:  # fmt: skip
    """By id, the components of which the reference shows enough."""
    steep = slopes(mean)
    found = {}
    for number, component in enumerate(board.components):
        D, centre_px = _scale(component, camera, T_camera_board)
        window = _window(shown, number, config.rim_px)
        if window is None or shown.shares[number] < config.least_share:
            continue
        mask, wall, depth, heights = _evidence(shown, window, number, board, config)
        if board.tolerance(component).rotation >= np.pi:
            disc = _round(component, window, centre_px, D)
            mask, depth = mask & disc, depth * disc
        rows, columns = np.nonzero(mask)
        seen = int((depth > 0).sum())
        evident = int((depth[mask & ~wall] > 0).sum())
        if evident < max(config.least_px, _LEAST_EVIDENCE * seen):
            continue
        if _is_hollow(component, shown.shares[number]):
            keep = np.arange(0, len(rows), -(-len(rows) // config.most_hollow_px))
        else:
            keep = _telling(np.hypot(*steep[window][rows, columns].T), config.most_px)
        rows, columns = rows[keep], columns[keep]
        inside, core = depth[rows, columns] > 0, depth[rows, columns] > _BLUR_PX
        at = (rows + window[0].start, columns + window[1].start)
        found[component.id] = Template(
            component, number,
            (window[1].start, window[0].start, window[1].stop, window[0].stop),
            float(shown.shares[number] * evident / seen),
            np.column_stack([at[1], at[0]]).astype(np.float32),
            mean[at].astype(float), steep[at].astype(float), spread[at].astype(float),
            inside, core if core.sum() >= config.least_px else inside, wall[rows, columns],
            _arms(component, at, heights[rows, columns], camera, T_camera_board), centre_px, D,
        )  # fmt: skip
    return found


def _telling(steep: Array, most: int) -> NDArray[np.intp]:
    """Which of the pixels (n,) to keep: all over, and the denser the steeper they are."""
    if len(steep) <= most:
        return np.arange(len(steep))
    chances = steep.astype(float) + max(steep.mean(dtype=float), _EVEN)
    for _ in range(_ROUNDS):  # none more than once
        chances = np.minimum(chances, chances.sum() / most)
    places = np.cumsum(chances) / chances.sum() * most
    return np.unique(np.searchsorted(places, np.arange(most) + 0.5))


def _round(
    component: Component, window: tuple[slice, slice], centre_px: Array, D: Array
) -> NDArray[np.bool_]:
    """The pixels (h, w) of a window on the top of a part that may stand any way round.

    Its flanks do not turn with it: light and parallax stay where they are.
    """
    v, u = np.mgrid[window[0], window[1]]
    arms = (np.stack([u, v], axis=-1) - centre_px) @ np.linalg.inv(D).T
    radius = _TOP * min(component.width, component.depth) / 2
    return np.asarray(np.linalg.norm(arms, axis=-1) < radius)


def _scale(component: Component, camera: Camera, T: SE3) -> tuple[Array, Array]:
    """Pixels per metre of the board's plane (2, 2) at the middle of the upper side, and that."""
    step = 1e-4
    middle = np.array([component.x, component.y, component.top])
    uv = camera.project(middle + step * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), T)
    return (uv[1:] - uv[0]).T / step, uv[0]


def _arms(
    component: Component, at: tuple[NDArray[np.intp], NDArray[np.intp]], heights: Plane,
    camera: Camera, T: SE3,
) -> Array:  # fmt: skip
    """From a component's middle to what rows and columns show at those heights (m), (n, 2)."""
    uv = np.column_stack([at[1], at[0]]).astype(float)
    low, high = (on_plane(uv, z, camera, T)[:, :2] for z in (0.0, 1.0))
    xy = low + (high - low) * heights[:, None]  # straight along the ray
    return np.asarray(xy - [component.x, component.y], float)


def _window(shown: Shown, number: int, margin: int) -> tuple[slice, slice] | None:
    """Rows and columns that hold what is seen of a component, with a margin."""
    left, top, right, bottom = (int(edge) for edge in shown.boxes[number])
    if right <= left:
        return None
    height, width = shown.numbers.shape
    return (
        slice(max(top - margin, 0), min(bottom + margin, height)),
        slice(max(left - margin, 0), min(right + margin, width)),
    )


def _evidence(
    shown: Shown, window: tuple[slice, slice], number: int, board: BoardDesign,
    config: TemplateConfig,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], Plane, Plane]:  # fmt: skip
    """The pixels of a window (h, w) that tell of a component, which of them are about the crest of
    its walls, how deep (px) in it they lie, and how high (m) what they show of it is: about it, its
    edge.
    """
    pad = 16  # neighbours just outside the window count as well
    wide = tuple(
        slice(max(s.start - pad, 0), min(s.stop + pad, size))
        for s, size in zip(window, shown.numbers.shape, strict=True)
    )
    numbers = shown.numbers[wide]
    own = numbers == number
    allowed = (numbers == BARE) | own
    component = board.components[number]
    for other in np.unique(numbers[(numbers >= 0) & ~own]):
        neighbour = board.components[other]
        if neighbour.id == component.on:
            allowed |= numbers == other
            continue
        allowed &= _distance(numbers != other) > _BORDER_PX
    if component.kind in HOLLOW:
        allowed &= _distance(own) > config.parallax_px
    else:
        allowed &= _distance(~own) <= config.rim_px
    walls = own & ~shown.tops[wide]
    border = np.zeros_like(walls)
    if (allowed & own & ~walls).sum() >= config.few_px:
        if not _is_hollow(component, shown.shares[number]):
            border = own & (_distance(~walls) <= 1) & (_distance(walls | ~own) <= _CREST_PX)
        allowed &= (_distance(~walls) > 1) | border
    inner = tuple(
        slice(s.start - w.start, s.stop - w.start) for s, w in zip(window, wide, strict=True)
    )
    _, nearest = cv2.distanceTransformWithLabels(
        (~own).astype(np.uint8), cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
    )
    heights = np.append(0, shown.heights[wide][own]).astype(np.float32)[nearest]
    return allowed[inner], border[inner], _distance(own)[inner], heights[inner]


def _distance(mask: NDArray[np.bool_]) -> Plane:
    """How far (px) each pixel of the mask is from those that are not in it."""
    return np.asarray(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 3), np.float32)
