"""Marker grids are found in part or whole, each corner by its id."""

import cv2
import numpy as np
import pytest
from helpers.printed import FINER, picture, rms_off, seen_from

from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.aruco_grid import ArucoGrid
from aoicell.targets.fiducials import dictionary_of
from aoicell.transforms import apply, translation

GRID = ArucoGrid(5, 4, 0.040, 0.010, first_id=7)


def test_points_are_opencvs_in_its_frame() -> None:
    theirs = cv2.aruco.GridBoard(
        (5, 4), 0.040, 0.010, dictionary_of(GRID.dictionary), np.arange(7, 27)
    )
    points = np.concatenate(theirs.getObjPoints())
    np.testing.assert_allclose(apply(GRID.T_target_opencv, points), GRID.points, atol=1e-7)


def test_the_print_is_opencvs() -> None:
    known = dictionary_of("DICT_4X4_50")
    grid = ArucoGrid(3, 2, 0.042, 0.014)
    theirs = cv2.aruco.GridBoard((3, 2), 0.042, 0.014, known).generateImage((154, 98))
    np.testing.assert_array_equal(grid.print_image(1000)[14:-14, 14:-14], theirs)


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.35, -0.2), (-0.3, 0.45)])
@pytest.mark.parametrize("roll", [0.0, 3.0])
def test_all_corners_within_a_twentieth_of_a_pixel(tilt: tuple[float, float], roll: float) -> None:
    T = seen_from(tilt, roll)
    seen = GRID.sight(picture((GRID, T)))
    assert seen.ids.tolist() == list(range(80))
    assert rms_off(seen, GRID, T) < 0.05


def test_blurred_and_noisy() -> None:
    T = seen_from((0.3, 0.2), distance=0.6)
    seen = GRID.sight(picture((GRID, T), blur_px=1.0, noise=3))
    assert rms_off(seen, GRID, T) < 0.1


@pytest.mark.parametrize("aim", [(0.12, 0.0), (-0.1, 0.08)])
def test_a_grid_that_is_partly_outside(aim: tuple[float, float]) -> None:
    T = seen_from((0.2, 0.1), distance=0.35, aim=aim)
    seen = GRID.sight(picture((GRID, T)))
    assert 8 <= len(seen.ids) < 80
    assert rms_off(seen, GRID, T) < 0.05


def test_a_grid_that_is_partly_covered() -> None:
    def hand(fine: Image) -> None:
        cv2.circle(fine, (330 * FINER, 230 * FINER), 70 * FINER, 120, -1)

    T = seen_from((0.2, 0.1))
    seen = GRID.sight(picture((GRID, T), cover=hand))
    assert 30 < len(seen.ids) < 76
    assert rms_off(seen, GRID, T) < 0.1


def test_white_on_black() -> None:
    T = seen_from((0.2, 0.1))
    seen = GRID.sight(np.asarray(255 - picture((GRID, T)), dtype=np.uint8))
    assert len(seen.ids) == 80
    assert rms_off(seen, GRID, T) < 0.05


def test_a_stray_marker_with_one_of_its_ids_is_left_out() -> None:
    T = seen_from((0.2, 0.1), distance=0.7)
    stray = translation(0.22, 0.12) * T
    seen = GRID.sight(picture((ArucoGrid(1, 1, 0.05, 0.02, first_id=10), stray), (GRID, T)))
    assert seen.ids.tolist() == list(range(80))
    assert rms_off(seen, GRID, T) < 0.05


def test_two_boards_of_other_ids_do_not_disturb() -> None:
    T = seen_from(distance=0.9)
    left, right = (translation(x, 0) * T for x in (-0.17, 0.17))
    one, other = ArucoGrid(5, 4, 0.04, 0.01), ArucoGrid(5, 4, 0.04, 0.01, first_id=20)
    grey = picture((one, left), (other, right))
    assert rms_off(one.sight(grey), one, left) < 0.1
    assert rms_off(other.sight(grey), other, right) < 0.1


def test_one_marker_of_many_is_not_enough() -> None:
    grey = picture((ArucoGrid(1, 1, 0.04, 0.02, first_id=9), seen_from()))
    says = "view 2: 1 of 20 markers of DICT_4X4_50 in the 640x480 picture, at least 2 needed"
    with pytest.raises(TargetNotFound, match=says):
        GRID.sight(grey, "view 2")


def test_a_blank_picture() -> None:
    with pytest.raises(TargetNotFound, match="0 of 20 markers"):
        GRID.sight(np.full((480, 640), 128, dtype=np.uint8))


def test_ids_beyond_the_dictionary_are_bad_input() -> None:
    with pytest.raises(InputError, match=r"ids 40 to 59 are not all in DICT_4X4_50, .* 0 to 49"):
        ArucoGrid(5, 4, 0.04, 0.01, first_id=40)


def test_a_grid_of_another_layout_is_refused() -> None:
    grey = picture((GRID, seen_from((0.2, 0.1))))
    other = ArucoGrid(4, 5, 0.040, 0.010, first_id=7)
    with pytest.raises(TargetNotFound, match=r"view 1: only \d of the 20 markers .* check its col"):
        other.sight(grey, "view 1")
