"""How bright a fixed chessboard is, compared with how bright it was when the board was taught."""

import cv2
import numpy as np

from aoicell.observation import Image
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import Array

SATURATED = 250.0  # grey; a brighter square may be brighter than it looks
_DARKEST = 0.5  # grey: half of the least that a picture can show
_HALF = 0.25  # of a square's side: how much of it is looked at, from its centre


def light_change(
    board: Chessboard, taught: tuple[Image, Array], now: tuple[Image, Array]
) -> float | None:
    """Natural logarithm of the light now over the light as taught, by the board's white squares;
    by its black ones where the white are saturated, and None where all are.

    Both pictures (H, W) come with the board's inner corners (N, 2), in the same order.
    """
    before, after = (_brightness(board, *seen) for seen in (taught, now))
    white = before > (before.min() + before.max()) / 2
    honest = (before < SATURATED) & (after < SATURATED)
    for usable in (white & honest, ~white & honest):
        if usable.any():
            ratios = np.maximum(after[usable], _DARKEST) / np.maximum(before[usable], _DARKEST)
            return float(np.log(ratios).mean())
    return None


def _brightness(board: Chessboard, image: Image, corners: Array) -> Array:
    """Mean grey value (N,) of the middle of each square between four inner corners."""
    grid = corners.reshape(board.rows, board.columns, 2)
    across, down = grid[:-1, 1:] - grid[:-1, :-1], grid[1:, :-1] - grid[:-1, :-1]
    centres = (grid[:-1, :-1] + grid[1:, 1:]) / 2
    steps = np.linspace(-_HALF, _HALF, 7)
    x, y = np.meshgrid(steps, steps)
    points = (
        centres[..., None, None, :]
        + x[..., None] * across[..., None, None, :]
        + y[..., None] * down[..., None, None, :]
    ).reshape(-1, steps.size**2, 2)
    u, v = np.moveaxis(points.astype(np.float32), -1, 0)
    values = cv2.remap(image, u, v, cv2.INTER_LINEAR)
    return np.asarray(values.mean(axis=1), dtype=float)
