"""ChArUco corners are found where the truth puts them, by their own ids."""

import cv2
import numpy as np
import pytest
from helpers.printed import BENT, FINER, picture, rms_off, seen_from

from aoicell.camera import Camera
from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.charuco import Charuco
from aoicell.targets.fiducials import dictionary_of
from aoicell.transforms import apply, translation

WIDE = Camera(
    np.array([[480.0, 0, 320], [0, 480, 240], [0, 0, 1]]),
    640,
    480,
    np.array([-0.28, 0.07, 0, 0, 0]),
)
BOARD = Charuco(8, 6, 0.030, 0.022)
LEGACY = Charuco(7, 6, 0.030, 0.015, "DICT_4X4_50", legacy=True)


def by_opencv(board: Charuco) -> cv2.aruco.CharucoBoard:
    made = cv2.aruco.CharucoBoard(
        (board.columns, board.rows), board.square, board.marker, dictionary_of(board.dictionary)
    )
    made.setLegacyPattern(board.legacy)
    return made


@pytest.mark.parametrize("board", [BOARD, LEGACY, Charuco(5, 7, 0.036, 0.018)])
def test_points_are_opencvs_in_its_frame(board: Charuco) -> None:
    theirs = by_opencv(board).getChessboardCorners()
    np.testing.assert_allclose(apply(board.T_target_opencv, theirs), board.points, atol=1e-8)


@pytest.mark.parametrize(
    "board",
    [Charuco(4, 3, 0.030, 0.018, "DICT_4X4_50"), Charuco(4, 4, 0.030, 0.018, "DICT_4X4_50", True)],
)
def test_the_print_is_opencvs(board: Charuco) -> None:
    ours = board.print_image(2000)
    size = (board.columns * 60, board.rows * 60)
    theirs = by_opencv(board).generateImage(size)
    np.testing.assert_array_equal(ours[30:-30, 30:-30], theirs)


@pytest.mark.parametrize("board", [BOARD, LEGACY], ids=["new", "legacy"])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.35, -0.2), (-0.3, 0.45)])
@pytest.mark.parametrize("roll", [0.0, 3.0])
def test_all_corners_within_a_twentieth_of_a_pixel(
    board: Charuco, tilt: tuple[float, float], roll: float
) -> None:
    T = seen_from(tilt, roll)
    seen = board.sight(picture((board, T)))
    assert len(seen.ids) == len(board.points)
    assert rms_off(seen, board, T) < 0.05


def test_small_blurred_and_noisy() -> None:
    T = seen_from((0.3, 0.2), distance=0.8)
    seen = BOARD.sight(picture((BOARD, T), blur_px=1.0, noise=3))
    assert len(seen.ids) > 25
    assert rms_off(seen, BOARD, T) < 0.1


def test_the_legacy_print_is_not_the_new_one() -> None:
    T = seen_from()
    new = Charuco(7, 6, 0.030, 0.015, "DICT_4X4_50")
    with pytest.raises(TargetNotFound, match=r"view 1: only 18 of the 21 markers .* pattern"):
        new.sight(picture((LEGACY, T)), "view 1")


def test_through_a_wide_lens() -> None:
    """Barrel distortion by 60 px in the corners of the picture."""
    T = seen_from((0.2, 0.1), distance=0.22)
    seen = BOARD.sight(picture((BOARD, T), camera=WIDE))
    assert len(seen.ids) > 30
    assert rms_off(seen, BOARD, T, WIDE) < 0.1


@pytest.mark.parametrize("aim", [(0.10, 0.0), (-0.08, 0.07), (0.0, -0.09)])
def test_a_board_that_is_partly_outside(aim: tuple[float, float]) -> None:
    T = seen_from((0.2, 0.1), distance=0.35, aim=aim)
    seen = BOARD.sight(picture((BOARD, T)))
    assert 6 <= len(seen.ids) < len(BOARD.points)
    assert rms_off(seen, BOARD, T) < 0.05


def test_a_board_that_is_partly_covered() -> None:
    def hand(fine: Image) -> None:
        cv2.ellipse(fine, (300 * FINER, 260 * FINER), (80 * FINER, 60 * FINER), 20, 0, 360, 120, -1)

    T = seen_from((0.2, 0.1))
    seen = BOARD.sight(picture((BOARD, T), cover=hand))
    assert 15 < len(seen.ids) < 33
    assert rms_off(seen, BOARD, T) < 0.1
    assert np.linalg.norm(seen.uv_px - BENT.project(BOARD.points[seen.ids], T), axis=1).max() < 0.4


def test_white_on_black() -> None:
    T = seen_from((0.2, 0.1))
    seen = BOARD.sight(np.asarray(255 - picture((BOARD, T)), dtype=np.uint8))
    assert len(seen.ids) == len(BOARD.points)
    assert rms_off(seen, BOARD, T) < 0.05


def test_clutter_does_not_matter() -> None:
    """Another board's markers, of the same dictionary, lie elsewhere in the picture."""
    T = seen_from((0.2, 0.1), distance=0.7)
    other = seen_from(roll=1.0, distance=1.0, aim=(0.0, 0.0))
    other = translation(0.22, 0.12) * other
    grey = picture((Charuco(3, 3, 0.05, 0.035), other), (BOARD, T))
    seen = BOARD.sight(grey)
    assert len(seen.ids) >= 30
    assert rms_off(seen, BOARD, T) < 0.05


def test_too_few_corners_are_counted() -> None:
    T = seen_from(distance=0.5, roll=0.0)
    grey = picture((BOARD, T))
    grey[:, 180:] = 90
    says = (
        r"view 3: \d of 24 markers of DICT_6X6_250 and [0-5] of 35 corners in the 640x480 picture"
    )
    with pytest.raises(TargetNotFound, match=says):
        BOARD.sight(grey, "view 3")


@pytest.mark.parametrize("grey", [
    np.full((480, 640), 128, dtype=np.uint8),
    np.random.default_rng(0).integers(0, 256, (480, 640), dtype=np.uint8),
], ids=["blank", "noise"])  # fmt: skip
def test_where_there_is_no_board(grey: Image) -> None:
    with pytest.raises(TargetNotFound, match=r"0 of 24 markers .* 0 of 35 corners") as caught:
        BOARD.sight(grey)
    assert caught.value.exit_code == 3


def test_impossible_boards_are_bad_input() -> None:
    with pytest.raises(InputError, match="30 mm do not fit into squares of 30 mm"):
        Charuco(5, 7, 0.03, 0.03)
    with pytest.raises(InputError, match="ids 0 to 59 are not all in DICT_4X4_50"):
        Charuco(12, 10, 0.03, 0.02, "DICT_4X4_50")
    with pytest.raises(InputError, match="did you mean 'DICT_6X6_250'"):
        Charuco(5, 7, 0.03, 0.02, "DICT_6X6_25")
