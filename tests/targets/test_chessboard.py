"""Corners are found where a known homography, or the true pose, puts them."""

from collections.abc import Callable, Mapping

import cv2
import numpy as np
import pytest

from aoicell.errors import InputError, TargetNotFound
from aoicell.nominal import Nominal
from aoicell.observation import Image
from aoicell.sim.cell import SimCell
from aoicell.sim.world import World
from aoicell.targets.chessboard import Chessboard, half_turn
from aoicell.targets.pose import rms
from aoicell.transforms import SE3, Array, looking_at

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]

BOARD = Chessboard(columns=8, rows=6, square=0.015, margin=0.0075)
SIZE = (800, 600)
PIXELS_PER_SQUARE = 80
OVERSAMPLING = 4


def homography(angle_deg: float, scale: float = 3400.0, centre: tuple[float, float] = (400, 300),
               slant: tuple[float, float] = (0.0, 0.0)) -> Array:  # fmt: skip
    """Pixels of points (x, y) on the board (m): y is up there and down in the picture."""
    c, s = np.cos(np.radians(angle_deg)) * scale, np.sin(np.radians(angle_deg)) * scale
    return np.array([[c, -s, centre[0]], [-s, -c, centre[1]], [slant[0], slant[1], 1.0]])


def through(H: Array, xy: Array) -> Array:
    uvw = np.column_stack([xy[:, :2], np.ones(len(xy))]) @ H.T
    return uvw[:, :2] / uvw[:, 2:]


def picture(*Hs: Array, board: Chessboard = BOARD, size: tuple[int, int] = SIZE) -> Image:
    """The print warped by each homography, over grey, sampled four times finer and averaged."""
    width, height = board.size
    print_ = board.print_image(PIXELS_PER_SQUARE)
    rows, columns = print_.shape
    # pixel (i, j) of the print is centred at half a pixel from its edges
    step_x, step_y = width / columns, height / rows
    texel = np.array(
        [[step_x, 0, -width / 2 + step_x / 2], [0, -step_y, height / 2 - step_y / 2], [0, 0, 1]]
    )
    fine = np.array([[OVERSAMPLING, 0, 1.5], [0, OVERSAMPLING, 1.5], [0, 0, 1]])
    shape = (size[0] * OVERSAMPLING, size[1] * OVERSAMPLING)
    canvas = np.full(shape[::-1], 90, dtype=np.uint8)
    for H in Hs:
        warp = fine @ H @ texel
        mask = cv2.warpPerspective(np.full_like(print_, 255), warp, shape)
        warped = cv2.warpPerspective(print_, warp, shape)
        canvas = np.where(mask > 127, 40 + warped // 255 * 160, canvas).astype(np.uint8)
    small = cv2.resize(canvas, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 0.6), dtype=np.uint8)


def off(uv_px: Array, expected_px: Array) -> float:
    """Largest distance, in the better of the two readings (px)."""
    return min(
        float(np.linalg.norm(reading - expected_px, axis=1).max())
        for reading in (uv_px, half_turn(uv_px))
    )


def test_corners_go_row_by_row_from_the_top_left() -> None:
    corners = BOARD.corners
    assert corners.shape == (48, 3)
    np.testing.assert_allclose(corners[0], [-0.0525, 0.0375, 0])
    np.testing.assert_allclose(corners[1] - corners[0], [0.015, 0, 0], atol=1e-15)
    np.testing.assert_allclose(corners[8] - corners[0], [0, -0.015, 0], atol=1e-15)
    np.testing.assert_allclose(corners.mean(axis=0), 0, atol=1e-15)


def test_the_outline_is_the_plates_size() -> None:
    assert BOARD.size == pytest.approx((0.150, 0.120))
    np.testing.assert_allclose(np.ptp(BOARD.outline, axis=0), [0.150, 0.120, 0])


def test_the_print_has_margins_and_changes_at_each_square() -> None:
    image = BOARD.print_image(20)
    assert image.shape == (160, 200)
    assert (image[:10] == 255).all()
    assert (image[:, -10:] == 255).all()
    inside = image[20:-10:20, 20:-10:20]
    assert (inside[:, 1:] != inside[:, :-1]).all()
    assert (inside[1:] != inside[:-1]).all()


def test_an_even_board_is_the_same_after_a_half_turn() -> None:
    image = BOARD.print_image(20)
    np.testing.assert_array_equal(image, image[::-1, ::-1])
    np.testing.assert_allclose(half_turn(BOARD.corners)[:, :2], -BOARD.corners[:, :2], atol=1e-15)


@pytest.mark.parametrize("angle", [0.0, 3.0, 37.0, 90.0, 123.0, 180.0, -95.0])
def test_corners_of_a_turned_board(angle: float) -> None:
    H = homography(angle)
    assert off(BOARD.detect(picture(H)), through(H, BOARD.corners)) < 0.05


@pytest.mark.parametrize("slant", [(1.2, 0.4), (-0.8, 1.5)])
@pytest.mark.parametrize("scale", [1700.0, 2900.0])
def test_corners_of_a_slanted_board(slant: tuple[float, float], scale: float) -> None:
    H = homography(20, scale, slant=slant)
    assert off(BOARD.detect(picture(H)), through(H, BOARD.corners)) < 0.05


def test_the_order_is_clockwise_as_seen_from_the_front() -> None:
    for angle in range(0, 360, 45):
        uv = BOARD.detect(picture(homography(angle))).reshape(6, 8, 2)
        x, y = uv[0, 1] - uv[0, 0], uv[1, 0] - uv[0, 0]
        assert x[0] * y[1] - x[1] * y[0] > 0


def test_a_dark_or_dim_picture_serves_as_well() -> None:
    H = homography(10)
    dim = (picture(H) // 4 + 5).astype(np.uint8)
    assert off(BOARD.detect(dim), through(H, BOARD.corners)) < 0.1


@pytest.mark.parametrize("centre", [(190, 300), (400, 150), (610, 300), (400, 470)])
def test_a_board_that_is_cut_off_is_not_found(centre: tuple[float, float]) -> None:
    with pytest.raises(TargetNotFound, match="tabletarget"):
        BOARD.detect(picture(homography(0, centre=centre)), "tabletarget")


def test_a_blank_picture_says_what_is_missing_where() -> None:
    blank = np.full((600, 800), 128, dtype=np.uint8)
    says = "tabletarget: no chessboard of 8x6 inner corners in the 800x600 picture"
    with pytest.raises(TargetNotFound, match=says) as caught:
        BOARD.detect(blank, "tabletarget")
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("large_left", [True, False])
def test_two_boards_come_larger_first(large_left: bool) -> None:
    left, right = (190.0, 300.0), (600.0, 300.0)
    near = homography(5, 2300, left if large_left else right)
    far = homography(-12, 1700, right if large_left else left)
    first, second = BOARD.detect_pair(picture(near, far))
    assert off(first, through(near, BOARD.corners)) < 0.05
    assert off(second, through(far, BOARD.corners)) < 0.05


def test_a_pair_needs_both() -> None:
    with pytest.raises(TargetNotFound, match="boards"):
        BOARD.detect_pair(picture(homography(5)), "boards")


@pytest.mark.parametrize(("columns", "rows"), [(7, 6), (8, 5), (7, 7)])
@pytest.mark.parametrize("angle", [0.0, 50.0, 140.0, 230.0, 320.0])
def test_colours_tell_which_way_round_another_board_is(
    columns: int, rows: int, angle: float
) -> None:
    board, H = Chessboard(columns, rows, 0.015, 0.0075), homography(angle)
    uv, expected = board.detect(picture(H, board=board)), through(H, board.corners)
    readings = [uv, half_turn(uv)] if board.half_turns else [uv]
    assert min(np.linalg.norm(r - expected, axis=1).max() for r in readings) < 0.05


def test_what_looks_the_same_after_a_half_turn() -> None:
    for columns, rows in [(8, 6), (7, 7), (9, 5), (7, 6), (9, 6)]:
        board = Chessboard(columns, rows, 0.015)
        image = board.print_image(4)
        assert board.half_turns == np.array_equal(image, image[::-1, ::-1])


def test_a_board_that_looks_the_same_after_a_quarter_turn_is_bad_input() -> None:
    with pytest.raises(InputError, match="6x6 inner corners look the same after a quarter turn"):
        Chessboard(6, 6, 0.02)


def test_a_sighting_has_all_corners_in_order() -> None:
    grey = picture(homography(20))
    seen = BOARD.sight(grey)
    np.testing.assert_array_equal(seen.ids, np.arange(48))
    np.testing.assert_array_equal(seen.uv_px, BOARD.detect(grey))


def test_a_corner_beside_its_square_is_noticed() -> None:
    """OpenCV's quick finder takes the corner of an outer square for an inner one now and then."""
    grey, corners = picture(homography(20)), through(homography(20), BOARD.corners)
    assert BOARD._refine(grey, corners) is not None
    x, y = BOARD.steps(corners)
    wrong = corners.copy()
    wrong[0] -= x[0] + y[0]
    assert BOARD._refine(grey, wrong) is None
    assert BOARD._refine(grey, corners + x) is None


def true_corners(world: World) -> Array:
    T_camera_target = world.truth().T_base_camera.actInv(world.geometry.T_base_tabletarget)
    return world.geometry.cameras["hand"].project(
        world.nominal.tabletarget.corners, T_camera_target
    )


@pytest.mark.parametrize(
    ("T_target_camera", "limit_px"),
    [
        (looking_at([0, 0, 0], 0.5), 0.03),
        (looking_at([0, 0, 0], 0.5, roll=0.5), 0.012),
        (looking_at([0, 0, 0], 0.55, tilt=(0.35, -0.25), roll=0.2), 0.012),
        # edges square with the raster: aliasing moves whole edges
        (looking_at([0, 0, 0], 0.6, tilt=(0.5, 0)), 0.06),
    ],
    ids=["straight", "turned", "tilted and turned", "tilted"],
)
def test_rendered_corners(
    ideal_world: World, nominal: Nominal, T_target_camera: SE3, limit_px: float
) -> None:
    T_base_flange = nominal.T_base_tabletarget * T_target_camera * nominal.T_flange_camera.inverse()
    cell = SimCell(ideal_world)
    cell.move(nominal.arm.ik(T_base_flange, nominal.q_home))
    uv, expected = nominal.tabletarget.detect(cell.capture().grey), true_corners(ideal_world)
    assert min(rms(uv - expected), rms(half_turn(uv) - expected)) < limit_px


def test_the_tripod_sees_both_boards(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    cell = SimCell(ideal_world)
    cell.move(taught_poses(nominal)["setup"])
    found = nominal.tabletarget.detect_pair(cell.capture("tripod").grey)
    camera = ideal_world.geometry.cameras["tripod"]
    T_tripod_base = ideal_world.geometry.T_base_tripod.inverse()
    near = T_tripod_base * ideal_world.T_base_body("armtarget")
    far = T_tripod_base * ideal_world.geometry.T_base_tabletarget
    assert off(found[0], camera.project(nominal.armtarget.corners, near)) < 0.15
    assert off(found[1], camera.project(nominal.tabletarget.corners, far)) < 0.15
