"""A flat board that is painted, not rendered: its pictures are exact to a hundredth of a pixel.

Parts are 0.1 mm high, so that a picture of the painted plane shows them where they are.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from helpers.small_boards import board, component

from aoicell.board import BoardDesign, Component
from aoicell.camera import Camera
from aoicell.inspection import Reference
from aoicell.inspection.shown import shown_by
from aoicell.inspection.virtual_picture import Drawing
from aoicell.observation import Image
from aoicell.transforms import SE3, Array, looking_at

CAMERA = Camera(
    np.array([[2000, 0, 610], [0, 2010, 440], [0, 0, 1.0]]), 1200, 900,
    np.array([-0.08, 0.05, 0.001, -0.0005, 0.0]),
)  # fmt: skip
T_CAMERA_BOARD = looking_at((0.004, -0.003, 0), 0.4, (0.1, -0.08), roll=1.0).inverse()
SIZE_MM = (180, 140)
_PX_PER_MM = 10
_GREY, _NOISE = 75.0, 0.6
Pose = tuple[float, float, float]  # x, y (m) and a turn (rad) against the design


def flat_board() -> BoardDesign:
    """Twenty chips, U0 to U19, in rows of five; every other one is turned."""
    chips = [
        component(f"U{5 * row + column}", "chip", 34 * (column - 2), 33 * (row - 1.5),
                  (9, 6, 0.1), rotation_deg=30 * ((row + column) % 2))
        for row in range(4) for column in range(5)
    ]  # fmt: skip
    return board(*chips, size_mm=SIZE_MM)


@dataclass(frozen=True)
class Flat:
    """The flat board, as it is painted, and its standard image."""

    board: BoardDesign
    plane: Array
    reference: Reference


def painted(
    design: BoardDesign,
    moved: Mapping[str, Pose] | None = None,
    missing: tuple[str, ...] = (),
    padded: tuple[str, ...] = (),
    alike: tuple[str, ...] = (),
    dotted: tuple[str, ...] = (),
    blank: tuple[str, ...] = (),
    marked: Mapping[str, Array] | None = None,
) -> Array:
    """The board's grey values from above, row 0 at its -y edge; parts that `moved` lie off.

    Parts that are `padded` stand on two bright pads; those `alike` look so after a half turn, but
    for a dot in the corner of those `dotted`; those `blank` have no marks.
    """
    shape = (SIZE_MM[1] * _PX_PER_MM, SIZE_MM[0] * _PX_PER_MM)
    rng = np.random.default_rng(1)
    print_ = cv2.resize(rng.standard_normal((70, 90)), shape[::-1], interpolation=cv2.INTER_CUBIC)
    plane = _GREY + 5 * np.sign(print_) * (np.abs(print_) > print_.std())
    for number, part in enumerate(design.components):
        if part.id in padded:
            _stamp(plane, part, _pads(), (part.x, part.y, part.rotation))
        x, y, turn = (moved or {}).get(part.id, (0.0, 0.0, 0.0))
        if part.id not in missing:
            marks = np.random.default_rng(number + 10).choice([35.0, 35.0, 150.0], (6, 8))
            if part.id in alike:
                marks = np.maximum(marks, marks[::-1, ::-1])
            if part.id in blank:
                marks[:] = 35.0
            marks = (marked or {}).get(part.id, marks)
            if part.id in dotted:
                marks[0, 0], marks[-1, -1] = 150.0, 35.0
            _stamp(plane, part, marks, (part.x + x, part.y + y, part.rotation + turn))
    return cv2.GaussianBlur(plane, (0, 0), 1.2)


def _pads() -> Array:
    pads = np.full((6, 8), 150.0)
    pads[:, 2:6] = _GREY
    return pads


def _stamp(plane: Array, part: Component, marks: Array, pose: Pose) -> None:
    """Paint one part, dark, with its marks."""
    width, depth = (round(side * 1e3 * _PX_PER_MM) for side in (part.width, part.depth))
    face = cv2.resize(marks, (width - 16, depth - 16), interpolation=cv2.INTER_NEAREST)
    face = cv2.copyMakeBorder(face, 8, 8, 8, 8, cv2.BORDER_CONSTANT, value=35.0)
    x, y, turn = pose
    R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    middle = pixels(np.array([x, y]))
    reach = int(np.hypot(width, depth) / 2) + 2
    left, low = np.rint(middle).astype(int) - reach
    window = plane[low : low + 2 * reach, left : left + 2 * reach]
    M = np.column_stack([R, middle - [left, low] - R @ [(width - 1) / 2, (depth - 1) / 2]])
    size = window.shape[::-1]
    area = cv2.warpAffine(np.ones_like(face), M, size)
    seen = cv2.warpAffine(face, M, size, borderMode=cv2.BORDER_REPLICATE)
    window[:] = (1 - area) * window + area * seen


def pixels(xy: Array) -> Array:
    """Columns and rows (..., 2) of the painted plane at places (..., 2; m) on the board."""
    return np.asarray(xy * 1e3 * _PX_PER_MM + np.array(SIZE_MM) * _PX_PER_MM / 2 - 0.5)


def photograph(
    plane: Array, T_camera_board: SE3 = T_CAMERA_BOARD, seed: int = 0, light: float = 1.0
) -> Image:
    """The painted board as `CAMERA` sees it, with noise that goes by the seed."""
    T = T_camera_board.inverse()
    rays = _rays() @ T.rotation.T
    places = T.translation[:2] - (T.translation[2] / rays[:, 2])[:, None] * rays[:, :2]
    at = pixels(places).astype(np.float32).reshape(CAMERA.height, CAMERA.width, 2)
    seen = cv2.remap(plane, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=20.0) * light
    noise = np.random.default_rng(seed).normal(0, _NOISE, seen.shape)
    return np.asarray(np.clip(np.rint(seen + noise), 0, 255), np.uint8)


@cache
def _rays() -> Array:
    """The direction (N, 3) in which each pixel of `CAMERA` looks."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    xy = CAMERA.unproject(np.column_stack([u.ravel(), v.ravel()]))
    return np.column_stack([xy, np.ones(len(xy))])


def flat_reference(plane: Array) -> Reference:
    """The flat board's standard image."""
    return Reference("flat", (photograph(plane),), T_CAMERA_BOARD, CAMERA)


def flat_drawing(
    design: BoardDesign, bare: Image, T_camera_board: SE3 = T_CAMERA_BOARD,
    ways: tuple[Image, Image] | None = None,
) -> Drawing:  # fmt: skip
    """The flat board as it would be drawn, with a picture of it without its parts; `ways`: with
    its parts as they should be, and turned by half. Without, nothing tells one from the other.
    """
    shown = shown_by(design, CAMERA, T_camera_board)
    designed, turned = ways or (bare, bare)
    return Drawing(designed, turned, bare, np.maximum(shown.numbers, -1), shown.heights)
