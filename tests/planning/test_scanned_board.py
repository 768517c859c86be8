import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aoicell.errors import Refused
from aoicell.planning.heights import HeightField
from aoicell.planning.scanned_board import find_board, raster
from aoicell.transforms import apply, from_xyz_rpy

CELL, SIZE = 0.0005, (0.30, 0.26)
BOARD = (0.16, 0.12)


def field(x=0.0, y=0.0, turn=0.0, gap=0.012, lean=0.0, parts=(), sigma=0.0):
    """A board `gap` over a table, each part (x, y, width, depth, height) on it; m and rad."""
    columns, rows = (round(side / CELL) for side in SIZE)
    origin = (-(columns - 1) / 2 * CELL, -(rows - 1) / 2 * CELL)
    heights = HeightField(np.zeros((rows, columns)), origin, CELL)
    xs, ys = raster(heights)
    c, s = np.cos(turn), np.sin(turn)
    u, v = c * (xs - x) + s * (ys - y), -s * (xs - x) + c * (ys - y)
    z = np.where((np.abs(u) <= BOARD[0] / 2) & (np.abs(v) <= BOARD[1] / 2), gap, 0.0)
    for px, py, width, depth, height in parts:
        z[(np.abs(u - px) <= width / 2) & (np.abs(v - py) <= depth / 2)] = gap + height
    noise = sigma * np.random.default_rng(0).standard_normal(z.shape)
    return HeightField(z + lean * xs + noise, origin, CELL)


@settings(max_examples=8, deadline=None)
@given(st.floats(-0.03, 0.03), st.floats(-0.03, 0.03), st.floats(-0.5, 0.5), st.floats(0.002, 0.03))
def test_a_board_is_found_where_it_lies(x, y, turn, gap):
    board = find_board(field(x, y, turn, gap, parts=[(0.02, 0.01, 0.05, 0.04, 0.02)]))
    expected = from_xyz_rpy([x, y, gap], [0, 0, turn])
    off = expected.actInv(board.T_area_board)
    assert np.abs(off.translation).max() < 3e-4
    assert off.rotation == pytest.approx(np.eye(3), abs=3e-3)
    assert board.size == pytest.approx((*BOARD, gap), abs=5e-4)


def test_its_x_axis_is_the_longer_side_towards_the_areas_x():
    board = find_board(field(turn=np.pi / 2 - 0.3))
    assert board.T_area_board.rotation[0, 0] > 0
    assert board.size[0] > board.size[1]


def test_a_leaning_area_is_levelled():
    board = find_board(field(lean=0.01, sigma=5e-5))
    assert board.T_area_board.rotation[2, 0] == pytest.approx(0.01, abs=5e-4)
    assert board.size[2] == pytest.approx(0.012, abs=2e-4)


def test_what_stands_out_over_an_edge_moves_no_side():
    bare = find_board(field())
    overhung = find_board(field(parts=[(-0.03, BOARD[1] / 2, 0.05, 0.02, 0.015)]))
    assert overhung.size == pytest.approx(bare.size, abs=2e-4)
    assert overhung.outline[:, 1].max() > BOARD[1] / 2 + 0.008
    assert apply(overhung.T_area_board, np.zeros(3)) == pytest.approx([0, 0, 0.012], abs=2e-4)


def test_unseen_cells_do_no_harm():
    heights = field(turn=0.2)
    heights.heights[np.random.default_rng(1).random(heights.heights.shape) < 0.05] = np.nan
    assert find_board(heights).size[:2] == pytest.approx(BOARD, abs=1e-3)


def test_an_empty_table_is_refused():
    with pytest.raises(Refused, match="no board was found"):
        find_board(field(gap=0.0, sigma=2e-5))


def test_nothing_seen_is_refused():
    with pytest.raises(Refused, match="nothing was seen"):
        find_board(HeightField(np.full((50, 50), np.nan), (0, 0), CELL))


def test_a_board_at_the_border_is_refused():
    with pytest.raises(Refused, match="reaches the border"):
        find_board(field(x=0.09))


def test_a_round_board_is_refused():
    heights = field(gap=0.0)
    centre = tuple(side // 2 for side in heights.heights.shape[::-1])
    z = cv2.circle(heights.heights.astype(np.float32), centre, 150, 0.012, -1)
    with pytest.raises(Refused, match=r"along a rectangle|not bare"):
        find_board(HeightField(z.astype(float), heights.origin, CELL))
