"""Crosses are found where the truth puts them, and nowhere else."""

from collections.abc import Callable, Mapping

import cv2
import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.observation import Image
from aoicell.sim.cell import SimCell
from aoicell.sim.world import World
from aoicell.targets.cross_marker import CrossMarker, turned
from aoicell.targets.pose import rms
from aoicell.transforms import Array

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]

MARKER = CrossMarker()


def test_points_go_clockwise_from_the_top_left() -> None:
    half = 0.018
    expected = [[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]]
    np.testing.assert_allclose(MARKER.crosses, expected)
    np.testing.assert_allclose(MARKER.outline, np.array(expected) / 0.018 * 0.030)


def test_the_print() -> None:
    image = MARKER.print_image(600)  # 0.1 mm a pixel
    assert image.shape == (600, 600)
    assert (image[:15] == 0).all()  # the frame, 1.5 mm
    assert (image[16:28, 16:-16] == 255).all()
    for u, v in ((120, 120), (480, 120), (480, 480), (120, 480)):  # 18 mm from the middle
        assert image[v, u] == 0
        assert image[v, u + 85] == 0  # an arm of 9 mm
        assert image[v - 85, u] == 0
        assert image[v, u + 95] == 255
        assert image[v + 15, u + 15] == 255  # clear of the stroke of 2.25 mm
    dark = (255 - image[20:300, 20:300].astype(float)).sum() / 255 * 1e-8
    assert dark == pytest.approx(2.25e-3 * (2 * 18e-3 - 2.25e-3), rel=1e-3)


def test_the_print_is_the_same_after_a_quarter_turn() -> None:
    image = MARKER.print_image(300).astype(int)
    assert np.abs(image - np.rot90(image)).max() <= 1  # half a grey value rounds either way


def test_quarter_turns() -> None:
    uv = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    np.testing.assert_array_equal(turned(uv, 0), uv)
    np.testing.assert_array_equal(turned(uv, 1), [[0, 1], [0, 0], [1, 0], [1, 1]])
    np.testing.assert_array_equal(turned(turned(uv, 1), 3), uv)


def nearest_turn(uv_px: Array, expected_px: Array) -> float:
    """rms over the best of the four readings (px): the order has to be clockwise."""
    return min(rms(turned(uv_px, k) - expected_px) for k in range(4))


def flat_picture(angle_deg: float, mm_per_pixel: float) -> tuple[Image, Array]:
    """The marker on a dark ground, as a camera straight above sees it, and its true crosses."""
    pixels = 600
    scale = 60 / pixels / mm_per_pixel
    c, s = np.cos(np.radians(angle_deg)) * scale, np.sin(np.radians(angle_deg)) * scale
    middle, centre = (pixels - 1) / 2, np.array([151.3, 148.6])
    turn = np.array([[c, -s], [s, c]])
    fine = 4
    warp = np.column_stack([turn, centre - turn @ [middle, middle]])
    big = np.column_stack([warp[:, :2] * fine, warp[:, 2] * fine + (fine - 1) / 2])
    print_ = (40 + MARKER.print_image(pixels).astype(float) * 0.7).astype(np.uint8)
    warped = cv2.warpAffine(
        print_, big, (300 * fine, 300 * fine), flags=cv2.INTER_AREA, borderValue=60
    )
    grey = cv2.GaussianBlur(
        cv2.resize(warped, (300, 300), interpolation=cv2.INTER_AREA), (0, 0), 0.7
    )
    points = MARKER.crosses[:, :2] * [1, -1] * 1e3 / 60 * pixels
    return np.asarray(grey, dtype=np.uint8), points @ turn.T + centre


@pytest.mark.parametrize("angle", [0.0, 7.0, 45.0, 100.0, 181.0])
@pytest.mark.parametrize("mm_per_pixel", [0.3, 0.43])
def test_a_drawn_marker(angle: float, mm_per_pixel: float) -> None:
    grey, expected = flat_picture(angle, mm_per_pixel)
    (found,) = MARKER.detect(grey)
    assert nearest_turn(found, expected) < 0.03


@pytest.mark.parametrize(
    ("pose", "visible"),
    [
        ("P_check", {"M1"}),
        ("overview", {"M1", "M2", "M3", "M4"}),
        ("V1", {"M2"}),
        ("V2", {"M3"}),
        ("V3", {"M4"}),
        ("V4", {"M2"}),
    ],
)
def test_rendered_markers(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses, pose: str, visible: set[str]
) -> None:
    cell = SimCell(ideal_world)
    cell.move(taught_poses(nominal)[pose])
    found = MARKER.detect(cell.capture().grey)
    assert len(found) == len(visible)
    for id in visible:
        expected = ideal_world.project(ideal_world.marker_points(id, MARKER.crosses))
        assert min(nearest_turn(uv, expected) for uv in found) < 0.01, id


def test_crosses_come_clockwise(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    cell = SimCell(ideal_world)
    cell.move(taught_poses(nominal)["overview"])
    for uv in MARKER.detect(cell.capture().grey):
        x, y = uv[1] - uv[0], uv[3] - uv[0]
        assert x[0] * y[1] - x[1] * y[0] > 0


def test_nothing_is_found_on_a_chessboard(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    cell = SimCell(ideal_world)
    cell.move(taught_poses(nominal)["start"])
    assert MARKER.detect(cell.capture().grey) == []
    assert MARKER.detect(nominal.tabletarget.print_image(60)) == []


def test_nothing_is_found_on_bare_components(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    cell = SimCell(ideal_world)
    cell.move(taught_poses(nominal)["overview"])
    grey = cell.capture().grey.copy()
    for marker in nominal.board.markers:
        outline = ideal_world.project(ideal_world.marker_points(marker.id, MARKER.outline * 1.1))
        cv2.fillConvexPoly(grey, np.rint(outline).astype(np.int32), 60)
    assert MARKER.detect(grey) == []


def test_nothing_is_found_in_noise_or_emptiness(rng: np.random.Generator) -> None:
    assert MARKER.detect(np.full((300, 400), 128, dtype=np.uint8)) == []
    assert MARKER.detect(rng.integers(0, 256, (300, 400), dtype=np.uint8)) == []


def test_a_square_with_four_dots_is_no_marker() -> None:
    grey = np.full((300, 300), 220, dtype=np.uint8)
    cv2.rectangle(grey, (50, 50), (250, 250), 20, 6)
    for u, v in ((90, 90), (210, 90), (210, 210), (90, 210)):
        cv2.circle(grey, (u, v), 25, 20, -1)
    assert MARKER.detect(grey) == []
