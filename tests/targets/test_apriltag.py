"""AprilTags, single and in grids, are found upright as the AprilTag project prints them."""

import numpy as np
import pytest
from helpers.printed import picture, rms_off, seen_from

from aoicell.errors import InputError, TargetNotFound
from aoicell.targets.apriltag import AprilTag

SINGLE = AprilTag(0.100, first_id=7)
GRID = AprilTag(0.040, columns=4, rows=3, gap=0.012)
CODE_0 = {"tag36h11": 0xD5D628584, "tag25h9": 0x155CBF1, "tag16h5": 0x231B}
"""Tag 0 of each family as the AprilTag project publishes it: bits by row from the top left."""


@pytest.mark.parametrize("family", CODE_0)
def test_the_print_stands_upright(family: str) -> None:
    tag = AprilTag(0.080, family=family)
    side = {"tag36h11": 6, "tag25h9": 5, "tag16h5": 4}[family]
    cells = side + 6  # a border of one and a margin of two on each side
    image = tag.print_image((side + 2) * 10 / 0.080)
    assert image.shape == (10 * cells, 10 * cells)
    inside = image[5::10, 5::10][3:-3, 3:-3] // 255
    bits = [int(bit) for bit in f"{CODE_0[family]:0{side**2}b}"]
    np.testing.assert_array_equal(inside.ravel(), bits)


def test_corners_go_clockwise_from_the_top_left() -> None:
    expected = [[-0.05, 0.05, 0], [0.05, 0.05, 0], [0.05, -0.05, 0], [-0.05, -0.05, 0]]
    np.testing.assert_allclose(SINGLE.points, expected)


def test_kalibrs_grids_count_from_the_bottom() -> None:
    upwards = AprilTag(0.040, columns=4, rows=3, gap=0.012, from_bottom=True)
    by_tag, reference = upwards.points.reshape(3, 4, 4, 3), GRID.points.reshape(3, 4, 4, 3)
    np.testing.assert_allclose(by_tag, reference[::-1])
    T = seen_from((0.3, -0.2))
    seen = upwards.sight(picture((upwards, T)))
    assert rms_off(seen, upwards, T) < 0.05
    wrong = GRID.points[seen.ids] - upwards.points[seen.ids]
    assert np.abs(wrong).max() > 0.1


@pytest.mark.parametrize("tag", [SINGLE, GRID], ids=["single", "grid"])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.35, -0.2), (-0.3, 0.45)])
@pytest.mark.parametrize("roll", [0.0, 3.0])
def test_all_corners_within_a_twentieth_of_a_pixel(
    tag: AprilTag, tilt: tuple[float, float], roll: float
) -> None:
    T = seen_from(tilt, roll)
    seen = tag.sight(picture((tag, T)))
    assert seen.ids.tolist() == list(range(len(tag.points)))
    assert rms_off(seen, tag, T) < 0.05


def test_a_grid_in_part() -> None:
    T = seen_from((0.2, 0.1), distance=0.35, aim=(0.08, 0.04))
    seen = GRID.sight(picture((GRID, T)))
    assert 8 <= len(seen.ids) < 48
    assert rms_off(seen, GRID, T) < 0.05


def test_white_on_black() -> None:
    T = seen_from((0.2, 0.1))
    seen = GRID.sight(np.asarray(255 - picture((GRID, T)), dtype=np.uint8))
    assert rms_off(seen, GRID, T) < 0.05


def test_another_id_is_another_tag() -> None:
    with pytest.raises(TargetNotFound, match="view 1: 0 of 1 tags of DICT_APRILTAG_36h11"):
        AprilTag(0.100, first_id=8).sight(picture((SINGLE, seen_from())), "view 1")


def test_a_single_tag_that_is_cut_off_is_not_found() -> None:
    with pytest.raises(TargetNotFound, match="0 of 1 tags"):
        SINGLE.sight(picture((SINGLE, seen_from(distance=0.35, aim=(0.11, 0)))))


def test_impossible_tags_are_bad_input() -> None:
    with pytest.raises(InputError, match="did you mean 'tag36h11'"):
        AprilTag(0.1, family="36h11")
    with pytest.raises(InputError, match="ids 587 to 587"):
        AprilTag(0.1, first_id=587)
    with pytest.raises(InputError, match="gap 2 mm is narrower than a tag's cell; at least 5 mm"):
        AprilTag(0.04, columns=2, rows=2, gap=0.002)
