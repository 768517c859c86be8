"""Dots are found and put in order, the large one at the origin."""

import cv2
import numpy as np
import pytest
from helpers.printed import FINER, picture, rms_off, seen_from

from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.circle_grid import CircleGrid
from aoicell.targets.sighting import Sighting
from aoicell.transforms import SE3, apply, translation

MARKED = CircleGrid(8, 8, 0.020, origin_dot=True)
OBLONG = CircleGrid(9, 6, 0.022)
GRIDS = [
    MARKED, OBLONG, CircleGrid(9, 7, 0.020, origin_dot=True),
    CircleGrid(4, 11, 0.016, asymmetric=True), CircleGrid(5, 8, 0.016, asymmetric=True),
]  # fmt: skip


def off(seen: Sighting, grid: CircleGrid, T: SE3) -> float:
    """Rms in the better reading where the print has two (px)."""
    turned = Sighting(seen.ids[::-1], seen.uv_px) if grid.half_turns else seen
    return min(rms_off(seen, grid, T), rms_off(turned, grid, T))


def test_points_are_opencvs_in_its_frame() -> None:
    staggered = CircleGrid(4, 11, 0.016, asymmetric=True)
    theirs = [[(2 * j + i % 2) * 0.016, i * 0.016, 0] for i in range(11) for j in range(4)]
    np.testing.assert_allclose(
        apply(staggered.T_target_opencv, theirs), staggered.points, atol=1e-12
    )
    theirs = [[j * 0.022, i * 0.022, 0] for i in range(6) for j in range(9)]
    np.testing.assert_allclose(apply(OBLONG.T_target_opencv, theirs), OBLONG.points, atol=1e-12)


def test_which_grids_have_two_readings() -> None:
    assert [grid.half_turns for grid in GRIDS] == [False, True, False, False, True]
    for grid in GRIDS:
        image = grid.print_image(1000)
        assert np.array_equal(image, image[::-1, ::-1]) == grid.half_turns


def test_the_large_dot_is_at_the_lower_left() -> None:
    image = MARKED.print_image(2000)
    assert image[-80:, :80].mean() < 0.95 * image[:80, :80].mean()
    np.testing.assert_array_equal(image[:80, :80], image[:80, -80:][:, ::-1])


@pytest.mark.parametrize("grid", GRIDS, ids=["marked", "oblong", "both", "odd", "even"])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.35, -0.2), (-0.4, 0.5)])
@pytest.mark.parametrize("roll", [0.0, 2.5])
def test_all_dots_within_a_twentieth_of_a_pixel(
    grid: CircleGrid, tilt: tuple[float, float], roll: float
) -> None:
    T = seen_from(tilt, roll)
    seen = grid.sight(picture((grid, T)))
    assert len(seen.ids) == len(grid.points)
    assert off(seen, grid, T) < 0.05


@pytest.mark.parametrize("distance", [0.4, 1.2])
def test_the_detection_adapts_to_the_size_of_the_dots(distance: float) -> None:
    T = seen_from((0.2, 0.1), distance=distance)
    seen = MARKED.sight(picture((MARKED, T)))
    assert len(seen.ids) == 64
    assert off(seen, MARKED, T) < 0.1


def test_white_on_black_blurred_and_noisy() -> None:
    T = seen_from((0.2, 0.1))
    grey = picture((MARKED, T), blur_px=1.2, noise=3)
    assert off(MARKED.sight(np.asarray(255 - grey, dtype=np.uint8)), MARKED, T) < 0.1


def test_the_perspective_bias_is_as_stated() -> None:
    """A large dot's centroid lies f (r / Z)^2 sin a cos a from its centre."""
    grid, a = CircleGrid(4, 3, 0.05, dot=0.8), 0.5
    T = seen_from((a, 0.0), roll=0.0)
    # nearly noiseless and straight through the middle, where distance and angle are Z and a
    seen = grid.sight(picture((grid, T), noise=0.2))
    bias = off(seen, grid, T)
    assert bias == pytest.approx(903 * (0.02 / 0.5) ** 2 * np.sin(a) * np.cos(a), rel=0.25)


def test_a_dot_that_the_picture_cuts_is_left_out() -> None:
    T = seen_from(roll=0.0, distance=0.4, aim=(0.0, 0.0))
    reach = 320 / 903 * 0.4  # half of the picture's width at that distance (m)
    T = translation(0.07 - reach + 0.002, 0) * T  # first column: 2 mm inside
    seen = MARKED.sight(picture((MARKED, T)))
    missing = set(range(64)) - set(seen.ids.tolist())
    assert 5 <= len(missing) <= 8
    assert missing <= set(range(0, 64, 8))
    assert rms_off(seen, MARKED, T) < 0.05


def test_a_covered_dot_is_not_made_up() -> None:
    def finger(fine: Image) -> None:
        cv2.circle(fine, (320 * FINER, 240 * FINER), 25 * FINER, 120, -1)

    grey = picture((MARKED, seen_from((0.2, 0.1))), cover=finger)
    with pytest.raises(TargetNotFound, match=r"no grid of 8x8 dots .* at most [56][0-9] dots"):
        MARKED.sight(grey, "view 5")


def test_clutter_does_not_matter(rng: np.random.Generator) -> None:
    def dirt(fine: Image) -> None:
        for u, v, r in rng.uniform([20, 20, 3], [620, 60, 7], (25, 3)):
            cv2.circle(fine, (int(u * FINER), int(v * FINER)), int(r * FINER), 20, -1)

    T = seen_from((0.2, 0.1), distance=0.6)
    assert rms_off(MARKED.sight(picture((MARKED, T), cover=dirt)), MARKED, T) < 0.05


def test_a_grid_without_its_large_dot_is_refused() -> None:
    plain = CircleGrid(9, 6, 0.022)
    asked = CircleGrid(9, 6, 0.022, origin_dot=True)
    with pytest.raises(TargetNotFound, match="view 1: a grid of 9x6 dots, but none at its lower"):
        asked.sight(picture((plain, seen_from())), "view 1")
    turned = CircleGrid(6, 9, 0.022, origin_dot=True)
    with pytest.raises(TargetNotFound, match="which way columns and rows go"):
        asked.sight(picture((turned, seen_from())))


def test_a_larger_grid_is_not_taken_for_it() -> None:
    with pytest.raises(TargetNotFound, match="in several ways"):
        CircleGrid(8, 6, 0.022).sight(picture((OBLONG, seen_from())))


@pytest.mark.parametrize("grey", [
    np.full((480, 640), 128, dtype=np.uint8),
    np.random.default_rng(0).integers(0, 256, (480, 640), dtype=np.uint8),
], ids=["blank", "noise"])  # fmt: skip
def test_where_there_is_no_grid(grey: Image) -> None:
    with pytest.raises(TargetNotFound, match="no grid of 8x8 dots in the 640x480 picture"):
        MARKED.sight(grey)


def test_ambiguous_grids_are_bad_input() -> None:
    with pytest.raises(InputError, match="quarter turn"):
        CircleGrid(7, 7, 0.02)
    with pytest.raises(InputError, match="no origin dot"):
        CircleGrid(4, 11, 0.02, origin_dot=True, asymmetric=True)
