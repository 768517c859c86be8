"""Two boards in one picture are told apart, or refused."""

import cv2
import numpy as np
import pytest
from helpers.printed import BENT, Paper, picture, rms_off, seen_from

from aoicell.camera import Camera
from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.pairs import sight_pair
from aoicell.targets.sighting import Sighting
from aoicell.transforms import SE3, translation

LARGE, SMALL = Chessboard(8, 6, 0.022, 0.022), Chessboard(8, 6, 0.015, 0.015)
OTHER = Chessboard(7, 4, 0.022, 0.022)
"""Its corners would fit into the others'."""


def beside(x: float, distance: float, roll: float = 0.1) -> SE3:
    """A board that stands at x (m) of the picture's middle."""
    return translation(x) * seen_from((0.2, -0.1), roll, distance)


def shot(*boards: tuple[Chessboard, SE3]) -> Image:
    return picture(*[(Paper(board), T) for board, T in boards])


def off(seen: Sighting, board: Chessboard, T: SE3, camera: Camera = BENT) -> float:
    """Rms in the better reading (px)."""
    turned = Sighting(seen.ids[::-1], seen.uv_px) if board.half_turns else seen
    return min(rms_off(seen, board, T, camera), rms_off(turned, board, T, camera))


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("second", [SMALL, OTHER], ids=["by size", "by layout"])
def test_each_board_is_the_one_asked_for(second: Chessboard, side: int) -> None:
    T_1, T_2 = beside(side * 0.13, 0.75), beside(-side * 0.14, 0.75, 1.4)
    grey = shot((LARGE, T_1), (second, T_2))
    for boards in ((LARGE, second), (second, LARGE)):
        seen = dict(zip(boards, sight_pair(grey, boards), strict=True))
        assert off(seen[LARGE], LARGE, T_1) < 0.05
        assert off(seen[second], second, T_2) < 0.05


def test_images_that_are_equally_large_are_refused() -> None:
    grey = shot((LARGE, beside(0.14, 0.75)), (SMALL, beside(-0.12, 0.75 * 15 / 22, 1.4)))
    with pytest.raises(TargetNotFound, match=r"setup 2: .* cannot be told apart, .* and .* px"):
        sight_pair(grey, (LARGE, SMALL), "setup 2")


def test_boards_that_nothing_tells_apart_are_bad_input() -> None:
    blank = np.full((48, 64), 128, dtype=np.uint8)
    with pytest.raises(InputError, match="8x6 corners and equal squares"):
        sight_pair(blank, (LARGE, Chessboard(8, 6, 0.022)))


@pytest.mark.parametrize("missing", [LARGE, OTHER])
def test_both_have_to_be_there(missing: Chessboard) -> None:
    present = OTHER if missing is LARGE else LARGE
    grey = shot((present, beside(0.1, 0.75)))
    with pytest.raises(TargetNotFound, match=f"of {missing.columns}x{missing.rows} inner corners"):
        sight_pair(grey, (LARGE, OTHER))


def test_a_part_of_the_large_board_is_not_the_small_one() -> None:
    """findChessboardCorners would take a board for one with fewer corners."""
    grey = cv2.GaussianBlur(shot((LARGE, beside(0.0, 0.5))), (0, 0), 0.5)
    with pytest.raises(TargetNotFound):
        sight_pair(np.asarray(grey, dtype=np.uint8), (OTHER, LARGE))
