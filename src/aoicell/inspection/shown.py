"""What each pixel of a picture shows, by the design: rays against the components' boxes.

Boxes stand upright, so that a ray meets three slabs (Kay and Kajiya 1986): two pairs of side walls
and the pair of top and underside.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign, Component
from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.inspection.virtual_picture import BEYOND, Drawing
from aoicell.transforms import SE3, Array, apply

BARE, MARKER, NOTHING = -1, -2, -3  # in place of a component's number
HOLLOW = ("dimm_module",)
_GRID_PX = 16  # the lens bends so little within it that rays may be interpolated
_EDGES = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


@dataclass(frozen=True)
class Shown:
    """For each pixel (H, W): the number of the component that it shows, or BARE, MARKER, NOTHING;
    the height of that surface over the laminate (m); whether it is an upper side.

    `shares` (N,): what is seen of the outline of each component's box, hidden parts and those
    beyond the picture's edge taken off. `solids` (H, W): the number that a drawing has there, also
    through hollow parts; where it has none, that of the box.
    `boxes` (N, 4): left, top, right, bottom (px, exclusive) of what is seen, zeros for nothing.
    """

    numbers: NDArray[np.int16]
    heights: NDArray[np.float32]
    tops: NDArray[np.bool_]
    shares: Array
    solids: NDArray[np.int16]
    boxes: NDArray[np.intp]


def shown_by(
    board: BoardDesign, camera: Camera, T_camera_board: SE3, drawing: Drawing | None = None
) -> Shown:
    """What a picture of the board at that pose shows where: by its components' boxes, or by a
    drawing of their solids at that pose.

    Raises InputError for a drawing of another board.
    """
    if drawing is not None and drawing.numbers.max(initial=-1) >= len(board.components):
        raise InputError(
            f"the drawing shows component number {drawing.numbers.max()}, but the board has "
            f"{len(board.components)}; draw this board"
        )
    rays, origin = _rays(camera, T_camera_board)
    shape = (camera.height, camera.width)
    heights = np.zeros(shape, np.float32)
    flat = _flat(board, origin, rays)
    numbers = flat.copy()
    tops = np.ones(shape, bool)
    nearest = (-origin[2] / rays[..., 2]).astype(np.float32)
    whole, windows = np.zeros(len(board.components)), {}
    for number, component in enumerate(board.components):
        outline = silhouette(component, camera, T_camera_board)
        whole[number] = max(cv2.contourArea(outline), 1.0)
        window = _window(outline, camera)
        if window is None:
            continue
        reach, on_top = _meet(component, origin, rays[window])
        hit = reach < nearest[window]
        windows[number] = window
        nearest[window][hit] = reach[hit]
        numbers[window][hit] = number
        tops[window][hit] = on_top[hit]
        heights[window][hit] = (origin[2] + reach * rays[window][..., 2])[hit]
    seen = np.bincount(numbers[numbers >= 0].ravel(), minlength=len(whole))
    solids = numbers
    if drawing is not None:
        solids = np.where(drawing.numbers >= 0, drawing.numbers, numbers)
        numbers, heights, tops = _drawn(board, drawing, flat, numbers, heights, tops)
    boxes = np.array([_seen(numbers, number, windows) for number in range(len(whole))])
    return Shown(
        numbers,
        heights,
        tops,
        np.minimum(seen / whole, 1.0),
        solids,
        boxes.reshape(-1, 4),
    )


def _drawn(
    board: BoardDesign, drawing: Drawing, flat: NDArray[np.int16], numbers: NDArray[np.int16],
    heights: NDArray[np.float32], tops: NDArray[np.bool_],
) -> tuple[NDArray[np.int16], NDArray[np.float32], NDArray[np.bool_]]:  # fmt: skip
    """Numbers, heights and upper sides with the solids in place of the boxes."""
    known, solid = drawing.numbers != BEYOND, drawing.numbers >= 0
    hollow = [number for number, c in enumerate(board.components) if c.kind in HOLLOW]
    known &= ~np.isin(numbers, hollow) & ~np.isin(drawing.numbers, hollow)
    exact = np.where(known, np.where(solid, drawing.numbers, flat), numbers)
    high = np.where(known, np.where(solid, drawing.heights, np.float32(0)), heights)
    return exact, high, np.where(exact == numbers, tops, exact < 0)


def _seen(
    numbers: NDArray[np.int16], number: int,
    windows: Mapping[int, tuple[slice, slice]],
) -> tuple[int, int, int, int]:  # fmt: skip
    """The box of what is seen of a component."""
    if number not in windows:
        return (0, 0, 0, 0)
    rows, columns = window = windows[number]
    left, top, width, height = cv2.boundingRect((numbers[window] == number).astype(np.uint8))
    left, top = left + columns.start, top + rows.start
    return (left, top, left + width, top + height) if width else (0, 0, 0, 0)


def _rays(camera: Camera, T_camera_board: SE3) -> tuple[NDArray[np.float32], Array]:
    """Directions (H, W, 3) of all pixels and the camera's centre (3,), in the board's frame."""
    u = np.arange(0, camera.width + _GRID_PX, _GRID_PX, dtype=float)
    v = np.arange(0, camera.height + _GRID_PX, _GRID_PX, dtype=float)
    xy = camera.unproject(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
    T = T_camera_board.inverse()
    grid = (np.column_stack([xy, np.ones(len(xy))]) @ T.rotation.T).reshape(len(v), len(u), 3)
    return spread_grid(grid, _GRID_PX, (camera.height, camera.width)), T.translation


def spread_grid(grid: Array, step: int, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Values (H, W, ...) in every pixel from those at every `step`-th pixel, linear between."""
    rows, columns = np.arange(shape[0]) / step, np.arange(shape[1]) / step
    u, v = (a.astype(np.float32) for a in np.meshgrid(columns, rows))
    return np.asarray(cv2.remap(grid.astype(np.float32), u, v, cv2.INTER_LINEAR), np.float32)


def _flat(board: BoardDesign, origin: Array, rays: NDArray[np.float32]) -> NDArray[np.int16]:
    """The bare laminate and its markers, (H, W)."""
    numbers = np.full(rays.shape[:2], NOTHING, np.int16)
    half = np.array(board.size[:2]) / 2
    plates = [(marker.plate(), marker.z, MARKER) for marker in board.markers]
    for corners, z, number in [(_EDGES * half, 0.0, BARE), *plates]:
        reach = (z - origin[2]).astype(np.float32) / rays[..., 2]
        inside = np.ones(numbers.shape, bool)
        for next_to in (1, 3):
            side = corners[next_to] - corners[0]
            side = side / (side @ side)
            along = (rays[..., :2] @ side.astype(np.float32)) * reach
            along += np.float32((origin[:2] - corners[0]) @ side)
            inside &= (along >= 0) & (along <= 1)
        numbers[inside] = number
    return numbers


def silhouette(component: Component, camera: Camera, T_camera_board: SE3) -> NDArray[np.float32]:
    """The corners (n, 1, 2) px of the outline of a component's box."""
    low, high = (
        np.column_stack([component.footprint, np.full(4, z)]) for z in (component.z, component.top)
    )
    uv = camera.project(apply(T_camera_board, np.vstack([low, high])))
    return np.asarray(cv2.convexHull(uv.astype(np.float32)), np.float32)


def _window(outline: NDArray[np.float32], camera: Camera) -> tuple[slice, slice] | None:
    """Rows and columns of the picture that an outline may cover; None if it covers none."""
    (left, top), (right, bottom) = outline[:, 0].min(axis=0), outline[:, 0].max(axis=0)
    rows = slice(max(int(top), 0), min(int(bottom) + 2, camera.height))
    columns = slice(max(int(left), 0), min(int(right) + 2, camera.width))
    return (rows, columns) if rows.start < rows.stop and columns.start < columns.stop else None


def _meet(
    component: Component, origin: Array, rays: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """How far (H, W) along each ray the component's box is, inf if missed; whether from above."""
    c, s = np.cos(component.rotation), np.sin(component.rotation)
    R = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1.0]])
    start = R @ (origin - [component.x, component.y, component.z + component.height / 2])
    along = rays @ R.T.astype(np.float32)
    half = np.array([component.width, component.depth, component.height]) / 2
    with np.errstate(divide="ignore"):
        near = (-np.sign(along) * half - start) / along
        far = (np.sign(along) * half - start) / along
    enter, leave = near.max(axis=-1), far.min(axis=-1)
    reach = np.where((enter < leave) & (enter > 0), enter, np.inf).astype(np.float32)
    return reach, near.argmax(axis=-1) == 2
