"""The light on a printed board, now against then."""

import cv2
import numpy as np
import pytest

from aoicell.line.reference_light import light_change
from aoicell.observation import Image
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import Array

BOARD = Chessboard(columns=8, rows=6, square=0.015, margin=0.01)
WHITE, BLACK = 180.0, 30.0


def seen(factor: float, angle_deg: float = 10, shift_px: float = 0.0) -> tuple[Image, Array]:
    """The board under so much light, turned and shifted in the picture; its corners."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    uv = BOARD.corners[:, :2] * [1, -1] * 3000 @ np.array([[c, -s], [s, c]]).T + [
        400,
        300 + shift_px,
    ]
    v, u = np.mgrid[:600, :800]
    at = np.stack([u - 400, v - 300 - shift_px], axis=-1) @ np.array([[c, -s], [s, c]]) / 45
    odd = (np.floor(at[..., 0] + 0.5) + np.floor(at[..., 1] + 0.5)) % 2
    image = cv2.GaussianBlur(np.where(odd == 1, WHITE, BLACK), (0, 0), 1.0) * factor
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), uv


@pytest.mark.parametrize("factor", [0.7, 0.95, 1.0, 1.1, 1.3])
def test_the_change_is_that_of_the_light(factor: float) -> None:
    change = light_change(BOARD, seen(1.0), seen(factor, shift_px=7.3))
    assert change == pytest.approx(np.log(factor), abs=0.004)


def test_a_half_turn_of_the_board_changes_nothing() -> None:
    image, corners = seen(1.0)
    assert light_change(BOARD, seen(0.9), (image, corners)) == pytest.approx(
        -np.log(0.9), abs=0.004
    )
    turned, uv = seen(1.0, angle_deg=190)
    assert light_change(BOARD, seen(0.9), (turned, uv)) == pytest.approx(-np.log(0.9), abs=0.004)


def test_a_darkness_is_a_finite_number() -> None:
    image, corners = seen(1.0)
    change = light_change(BOARD, (image, corners), (np.zeros_like(image), corners))
    assert change == pytest.approx(np.log(0.5 / WHITE), abs=0.1)


@pytest.mark.parametrize("factors", [(1.0, 1.6), (1.6, 1.0)])
def test_where_white_is_saturated_black_tells(factors: tuple[float, float]) -> None:
    change = light_change(BOARD, *(seen(factor) for factor in factors))
    assert change == pytest.approx(np.log(factors[1] / factors[0]), abs=0.02)


def test_nothing_is_told_where_all_is_white() -> None:
    image, corners = seen(1.0)
    assert light_change(BOARD, (image, corners), (np.full_like(image, 255), corners)) is None
