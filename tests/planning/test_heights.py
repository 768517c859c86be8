"""A ray is stopped exactly where a box stands in its way."""

import numpy as np
import pytest
from helpers.small_boards import board, component
from hypothesis import given
from hypothesis import strategies as st

from aoicell.planning.heights import CELL, heights_of

WALL = board(component("W", "connector", 0, 0, (10, 40, 20)))  # x from -5 to 5 mm, 20 mm high
FIELD = heights_of(WALL)


def sees(point_mm: tuple[float, float, float], centre_mm: tuple[float, float, float]) -> bool:
    point, centre = np.array([point_mm]) / 1e3, np.array(centre_mm) / 1e3
    return bool(FIELD.clear(point, centre)[0])


def test_heights_are_those_of_the_boxes() -> None:
    xy = np.array([[0, 0], [0.004, 0.019], [0.02, 0], [0, 0.03], [0.2, 0]])
    heights = FIELD.at(xy)
    np.testing.assert_allclose(heights[:4], [0.02, 0.02, 0, 0], atol=1e-6)
    assert np.isnan(heights[4])


def test_a_part_stands_on_what_carries_it() -> None:
    tower = heights_of(
        board(
            component("HS", "heatsink", 0, 0, (4, 4, 8), z_mm=2, on="U"),
            component("U", "chip", 0, 0, (10, 10, 2)),
        )
    )
    xy = np.array([[0, 0], [0.004, 0.0]])
    np.testing.assert_allclose(tower.at(xy), [0.010, 0.002], atol=1e-6)


def test_a_turned_box_covers_its_own_footprint() -> None:
    turned = heights_of(board(component("J", "connector", 0, 0, (30, 4, 5), rotation_deg=90)))
    assert turned.at(np.array([[0, 0.014]]))[0] == pytest.approx(0.005)
    assert turned.at(np.array([[0.014, 0]]))[0] == 0


def test_straight_from_above_nothing_hides() -> None:
    assert sees((6, 0, 0), (6, 0, 500))
    assert sees((0, 0, 20), (0, 0, 500))


def test_nothing_is_seen_from_below_or_through_the_wall() -> None:
    assert not sees((10, 0, 0), (10, 0, -100))
    assert not sees((10, 0, 0), (-500, 0, 100))
    assert sees((10, 0, 0), (500, 0, 100))


@given(
    gap_mm=st.floats(1, 20), y_mm=st.floats(-15, 15), lean=st.floats(0.05, 1.2),
)  # fmt: skip
def test_the_wall_hides_what_it_should(gap_mm: float, y_mm: float, lean: float) -> None:
    """From behind the wall, a point is seen when the ray passes over its near edge."""
    over = gap_mm / lean - 20  # mm that the ray passes over the edge at x = 5 mm
    seen = sees((5 + gap_mm, y_mm, 0), (5 + gap_mm - 500 * lean, y_mm, 500))
    if abs(over) * lean > 2 * CELL * 1e3:  # a cell decides the rest
        assert seen == (over > 0)


def test_the_board_itself_is_no_obstacle() -> None:
    flat = heights_of(board())
    points = np.array([[0.03, 0.02, 0.0], [-0.049, -0.039, 0.0]])
    assert flat.clear(points, np.array([0.4, -0.3, 0.3])).all()
