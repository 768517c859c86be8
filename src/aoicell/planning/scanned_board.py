"""Where an unknown board lies in a scan, and its outline.

Seen from above, the area has two large flat surfaces: the table, and over it the board. What is
higher than half way from one to the other is board; straight lines are laid along its four sides,
where it is bare (a connector may stand out over an edge), and give its frame and its size.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.errors import Refused
from aoicell.planning.heights import HeightField
from aoicell.transforms import SE3, Array

Mask = NDArray[np.bool_]

_STEPS = 12  # in which the plane is narrowed down


@dataclass(frozen=True)
class BoardConfig:
    """`least_height` (m) of the board over the table; `least_share` of the area that the flat
    surface of either has to cover; `flat` (m): what belongs to a flat surface; `near` (m): what
    belongs to a side; `straight`: the share of the outline that has to.
    """

    least_height: float = 0.001
    least_share: float = 0.03
    flat: float = 0.0004
    near: float = 0.0015
    straight: float = 0.5


@dataclass(frozen=True)
class ScannedBoard:
    """A board as found: its frame (centre of the upper side, x along the longer side, z up).

    `size` (x, y, height over the table; m), `outline` (N, 2) of all that stands out from the table,
    connectors included. Nothing tells which of the two long sides is the front: x may be turned
    by half a turn against the design's.
    """

    T_area_board: SE3
    size: tuple[float, float, float]
    outline: Array
    rms: float


def find_board(heights: HeightField, config: BoardConfig | None = None) -> ScannedBoard:
    """The board in a raster of heights over the area (frame `area`).

    Raises Refused when there are no two flat surfaces, the board reaches the border of the area, or
    its outline is no rectangle.
    """
    config = config or BoardConfig()
    T_area_plane, gap = _plane(heights, config)
    z = T_area_plane.rotation[:, 2]
    x, y = raster(heights)
    over = (np.dstack([x, y, heights.heights]) - T_area_plane.translation) @ z
    board = _largest(np.nan_to_num(over, nan=-np.inf) > -gap / 2)
    if board[0].any() or board[-1].any() or board[:, 0].any() or board[:, -1].any():
        raise Refused("scan: the board reaches the border of the scanned area; make it larger")
    outline, bare = _outline(heights, board, over, config)
    corners, rms = _sides(outline, bare, heights.cell, config)
    centre, (x_side, y_side) = corners.mean(axis=0), _axes(corners)
    x_axis = np.array([*x_side, -(x_side @ z[:2]) / z[2]])  # in the board's own plane
    x_axis /= np.linalg.norm(x_axis)
    R = np.column_stack([x_axis, np.cross(z, x_axis), z])
    level = (T_area_plane.translation @ z - centre @ z[:2]) / z[2]
    T_area_board = SE3(R, np.array([*centre, level]))
    long, short = (np.ptp(corners @ axis) for axis in (x_side, y_side))
    local = (outline - centre) @ np.column_stack([x_side, y_side])
    return ScannedBoard(T_area_board, (float(long), float(short), gap), local, rms)


def _levels(heights: HeightField, config: BoardConfig) -> tuple[float, float]:
    """Heights (m) of the table and of the board's surface."""
    values, step = heights.heights[np.isfinite(heights.heights)], config.flat / 2
    if not len(values):
        raise Refused("scan: nothing was seen in the scanned area")
    count, edges = np.histogram(values, np.arange(values.min() - step, values.max() + step, step))
    share = np.convolve(count, np.ones(3), mode="same") / heights.heights.size
    peaks = np.flatnonzero(share >= config.least_share)
    middle = (edges[:-1] + edges[1:]) / 2
    if len(peaks):
        # noise and a leaning area widen a level, but leave it in one piece
        apart = np.diff(peaks) * step > config.least_height
        runs = np.split(peaks, np.flatnonzero(apart) + 1)
        tops = [run[share[run].argmax()] for run in runs]
        if len(tops) > 1:
            above = max(tops[1:], key=lambda top: share[top])
            return float(middle[tops[0]]), float(middle[above])
    raise Refused(
        "scan: no board was found: the area shows no flat surface of "
        f"{config.least_share:.0%} of its size that is {config.least_height * 1e3:g} mm over the "
        "table"
    )


def _plane(heights: HeightField, config: BoardConfig) -> tuple[SE3, float]:
    """The plane of the board's surface (its x and y mean nothing), and how far under it the
    table is (m). The whole area may lean: the calibration that a scan rests on is not exact.
    """
    table, offset = _levels(heights, config)
    x, y = raster(heights)
    z, slope = heights.heights, np.zeros(2)
    start = max(config.flat, (offset - table) / 3)
    for tolerance in np.geomspace(start, config.flat, _STEPS):
        near = np.abs(z - (slope[0] * x + slope[1] * y + offset)) < tolerance
        design = np.column_stack([x[near], y[near], np.ones(near.sum())])
        (*slope, offset), *_ = np.linalg.lstsq(design, z[near], rcond=None)
        # the surface is not symmetric about its peak where parts and prints lie on it
        offset = float(np.median(z[near] - design[:, :2] @ slope))
    under = slope[0] * x + slope[1] * y + offset - z
    gap = float(np.median(under[under > (offset - table) / 2]))
    normal = np.array([-slope[0], -slope[1], 1.0])
    normal /= np.linalg.norm(normal)
    x_axis = np.cross([0.0, 1.0, 0.0], normal)
    x_axis /= np.linalg.norm(x_axis)
    R = np.column_stack([x_axis, np.cross(normal, x_axis), normal])
    return SE3(R, np.array([0.0, 0.0, offset])), gap


def raster(heights: HeightField) -> tuple[Array, Array]:
    """X and y (rows, columns) of the cells (m)."""
    rows, columns = heights.heights.shape
    x = heights.origin[0] + heights.cell * np.arange(columns)
    y = heights.origin[1] + heights.cell * np.arange(rows)
    across, along = np.meshgrid(x, y)
    return across, along


def _largest(mask: Mask) -> Mask:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count < 2:
        raise Refused("scan: nothing stands out from the table")
    largest: Mask = labels == 1 + stats[1:, cv2.CC_STAT_AREA].argmax()
    return largest


def _outline(
    heights: HeightField, board: Mask, over: Array, config: BoardConfig
) -> tuple[Array, Mask]:
    """The outermost cells (N, 2; m), and which of them are edges of the bare board.

    `over`: heights (rows, columns) over the board's plane.
    """
    contours, _ = cv2.findContours(board.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cells = max(contours, key=cv2.contourArea)[:, 0]
    side = 2 * round(config.near / heights.cell) + 1
    inside = np.where(board, np.nan_to_num(over, nan=np.inf), -np.inf)
    highest = cv2.dilate(inside, np.ones((side, side), np.uint8))[cells[:, 1], cells[:, 0]]
    return heights.origin + heights.cell * cells.astype(float), highest < config.near


def _sides(outline: Array, bare: Mask, cell: float, config: BoardConfig) -> tuple[Array, float]:
    """Corners (4, 2) in order, and how far the outline is off the sides (rms, m)."""
    if bare.sum() < 100:
        raise Refused("scan: parts stand over all of the board's edges; its frame is not to be had")
    points = outline[bare]
    corners = cv2.boxPoints(cv2.minAreaRect(points.astype(np.float32))).astype(float)
    lines, used, squares = [], 0, 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        normal = np.array([b[1] - a[1], a[0] - b[0]]) / np.linalg.norm(b - a)
        on_side = points[np.abs((points - a) @ normal) < config.near]
        if len(on_side) < 20:
            raise Refused("scan: a side of the board is not bare anywhere; its frame is not clear")
        vx, vy, x, y = cv2.fitLine(
            on_side.astype(np.float32), cv2.DIST_HUBER, 0, 1e-6, 1e-6
        ).ravel()
        outward = np.array([-vy, vx]) * np.sign(
            (np.array([x, y]) - points.mean(axis=0)) @ [-vy, vx]
        )
        off = (on_side - [x, y]) @ outward
        # a cell's middle is inside: the edge lies half a cell further out
        lines.append(np.array([*outward, -outward @ [x, y] - cell / 2]))
        used, squares = used + len(on_side), squares + float(off @ off)
    if used < config.straight * len(points):
        raise Refused(
            f"scan: only {used / len(points):.0%} of the board's outline lies along a rectangle; "
            "boards of other shapes have no frame here"
        )
    crossings = [np.cross(lines[i - 1], lines[i]) for i in range(4)]
    return np.array([c[:2] / c[2] for c in crossings]), float(np.sqrt(squares / used))


def _axes(corners: Array) -> tuple[Array, Array]:
    """Unit vectors along the long and the short sides, the long one towards the area's x."""
    first = corners[1] - corners[0] + corners[2] - corners[3]
    second = corners[2] - corners[1] + corners[3] - corners[0]
    x = first if np.linalg.norm(first) > np.linalg.norm(second) else second
    x = x / np.linalg.norm(x) * (1 if x[0] >= 0 else -1)
    return x, np.array([-x[1], x[0]])
