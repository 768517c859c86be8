"""What each pixel of a picture shows: against geometry that one can work out by hand."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.board import BoardDesign, MarkerDesign
from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.inspection.shown import BARE, MARKER, NOTHING, Shown, shown_by
from aoicell.inspection.virtual_picture import BEYOND, Drawing
from aoicell.transforms import SE3, looking_at

CAMERA = Camera.pinhole(1000.0, 800, 600)  # at 0.5 m: 2 px a millimetre, middle at (399.5, 299.5)
DOWN = looking_at((0, 0, 0), 0.5).inverse()
BOARD = board(
    component("A", "chip", 20, 10, (10, 4, 1)),
    component("B", "connector", -30, 0, (8, 8, 20)),
    component("C", "chip", -47, 0, (6, 6, 1)),
    component("D", "chip", 0, -25, (20, 20, 5)),
    component("E", "dimm_module", 0, -25, (24, 24, 10), z_mm=5, on="D"),
    component("F", "chip", 0, 250, (5, 5, 1)),
)


@pytest.fixture(scope="module")
def shown() -> Shown:
    return shown_by(BOARD, CAMERA, DOWN)


def number(id: str) -> int:
    return next(n for n, c in enumerate(BOARD.components) if c.id == id)


def at(points: Shown, T: SE3, x_mm: float, y_mm: float, z_mm: float = 0.0) -> tuple[int, int]:
    """Row and column of a point of the board."""
    [[u, v]] = CAMERA.project([[x_mm / 1e3, y_mm / 1e3, z_mm / 1e3]], T)
    return round(v), round(u)


def test_pixels_know_what_they_show(shown: Shown) -> None:
    """With y up on the board and down in the picture."""
    assert shown.numbers[300, 400] == BARE
    assert shown.numbers[300 - 20, 400 + 40] == number("A")
    assert shown.numbers[300 + 20, 400 + 40] == BARE
    assert shown.numbers[300, 400 - 62] == number("B")
    assert shown.numbers[300, 400 + 102] == NOTHING, "beyond the right edge"
    assert shown.numbers[300 - 84, 400] == NOTHING, "beyond the rear edge"


def test_heights_are_those_of_the_surface(shown: Shown) -> None:
    assert shown.heights[300, 400] == 0
    assert shown.heights[at(shown, DOWN, 20, 10, 1)] == pytest.approx(1e-3, abs=1e-6)
    assert shown.heights[at(shown, DOWN, -30, 0, 20)] == pytest.approx(20e-3, abs=1e-6)
    assert shown.heights[at(shown, DOWN, 0, -25, 15)] == pytest.approx(15e-3, abs=1e-6)
    assert shown.heights.max() < 20.01e-3


def test_the_board_ends_at_its_edge_through_a_bent_lens() -> None:
    """Its corners lie far beyond the picture, where no lens model holds; its edges are curves."""
    bent = replace(CAMERA, distortion=np.array([-0.45, 0.2, 0.0, 0.0, 0.0]))
    near = looking_at((0.045, 0, 0), 0.15).inverse()
    shown = shown_by(board(size_mm=(100, 300)), bent, near)
    for y in np.linspace(-35, 35, 8):
        for x, surface in ((49.7, BARE), (50.3, NOTHING)):
            [[u, v]] = bent.project([[x / 1e3, y / 1e3, 0.0]], near)
            assert shown.numbers[round(v), round(u)] == surface


def test_a_side_wall_is_seen_outside_the_top(shown: Shown) -> None:
    """The camera stands over the middle: of what stands on the left it sees the right wall."""
    row, column = at(shown, DOWN, -26, 0, 10)
    assert shown.numbers[row, column] == number("B")
    assert not shown.tops[row, column]
    assert 2e-3 < shown.heights[row, column] < 18e-3
    assert shown.tops[at(shown, DOWN, -30, 0, 20)]


def test_a_box_is_the_outline(shown: Shown) -> None:
    left, top, right, bottom = shown.boxes[number("A")]
    scale = 1000 / 0.499  # px a metre, at its top
    assert (left, right) == pytest.approx((400 + 0.015 * 2000, 400 + 0.025 * scale), abs=1.5)
    assert (top, bottom) == pytest.approx((300 - 0.012 * scale, 300 - 0.008 * 2000), abs=1.5)


def test_what_is_covered_is_not_shown(shown: Shown) -> None:
    assert shown.shares[number("D")] < 0.05
    assert shown.shares[number("A")] == pytest.approx(1, abs=0.06)
    assert shown.shares[number("E")] == pytest.approx(1, abs=0.06)


def test_what_is_out_of_the_picture_is_not_shown(shown: Shown) -> None:
    assert shown.shares[number("F")] == 0
    assert list(shown.boxes[number("F")]) == [0, 0, 0, 0]


def test_the_tall_hide_what_stands_behind_them(shown: Shown) -> None:
    """C stands beside B, away from the camera: less of it is seen from the right."""
    straight = shown.shares[number("C")]
    aside = shown_by(BOARD, CAMERA, looking_at((-0.04, 0, 0), 0.5, (0, -0.6)).inverse())
    other = shown_by(BOARD, CAMERA, looking_at((-0.04, 0, 0), 0.5, (0, 0.6)).inverse())
    worst = min((aside, other), key=lambda s: s.shares[number("C")])
    best = max((aside, other), key=lambda s: s.shares[number("C")])
    assert worst.shares[number("C")] < 0.7 < best.shares[number("C")]
    assert straight == pytest.approx(1, abs=0.1)


def test_a_turned_camera_sees_the_same_elsewhere() -> None:
    T = looking_at((0.01, 0, 0), 0.45, (0.2, -0.1), roll=2.0).inverse()
    seen = shown_by(BOARD, CAMERA, T)
    for id in ("A", "B", "C"):
        c = BOARD.component(id)
        row, column = at(seen, T, c.x * 1e3, c.y * 1e3, c.top * 1e3)
        assert seen.numbers[row, column] == number(id)
        assert seen.heights[row, column] == pytest.approx(c.top, abs=1e-5)


def test_a_marker_is_no_bare_board() -> None:
    marker = MarkerDesign("M", "cross", 0.03, -0.02, 5e-4, 0, 12e-3, 7e-3, "positioning")
    design: BoardDesign = replace(BOARD, components=(), markers=(marker,))
    seen = shown_by(design, CAMERA, DOWN)
    assert seen.numbers[at(seen, DOWN, 30, -20)] == MARKER
    assert (seen.numbers == MARKER).sum() == pytest.approx((12 * 2) ** 2, rel=0.1)
    assert len(seen.shares) == 0


def test_a_drawing_knows_shapes_that_are_no_boxes(shown: Shown) -> None:
    """A round part leaves the corners of its box free; through a hollow one, others are seen."""
    numbers, heights = np.maximum(shown.numbers, -1), shown.heights.copy()
    row, column = at(shown, DOWN, -30, 0, 20)
    v, u = np.mgrid[:600, :800]
    outside = (numbers == number("B")) & (np.hypot(u - column, v - row) > 10)
    numbers[outside], heights[outside] = -1, 0
    numbers[at(shown, DOWN, 0, -25, 15)] = number("D")
    numbers[:, :100] = BEYOND
    black = np.zeros((600, 800), np.uint8)
    drawing = Drawing(black, black, black, numbers, heights)
    exact = shown_by(BOARD, CAMERA, DOWN, drawing)
    assert outside[:, 100:].sum() > 20
    assert (exact.numbers[:, 100:][outside[:, 100:]] == BARE).all()
    assert exact.numbers[row, column] == number("B")
    assert (exact.numbers[:, :100] == shown.numbers[:, :100]).all(), "boxes, where it ends"
    hollow = at(shown, DOWN, 0, -25, 15)
    assert exact.numbers[hollow] == number("E")
    assert exact.solids[hollow] == number("D")
    assert exact.shares == pytest.approx(shown.shares), "of whole outlines"


def test_a_drawing_of_another_board_is_refused() -> None:
    numbers = np.full((600, 800), 17, np.int16)
    black = np.zeros((600, 800), np.uint8)
    drawing = Drawing(black, black, black, numbers, np.zeros((600, 800), np.float32))
    with pytest.raises(InputError, match="component number 17, but the board has 6; draw this"):
        shown_by(BOARD, CAMERA, DOWN, drawing)
