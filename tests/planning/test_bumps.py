import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aoicell.planning.bumps import BumpConfig, find_bumps, least_height
from aoicell.planning.heights import HeightField
from aoicell.planning.scanned_board import raster

CELL = 0.00025
SIZE = (0.10, 0.08)


def field(parts, sigma=1e-5, unseen=()):
    """Boxes (x, y, width, depth, height, turn) on a plane, later ones on top; m and rad."""
    columns, rows = (round((side + 0.01) / CELL) for side in SIZE)
    origin = (-(columns - 1) / 2 * CELL, -(rows - 1) / 2 * CELL)
    z = sigma * np.random.default_rng(0).standard_normal((rows, columns))
    heights = HeightField(z, origin, CELL)
    for x, y, width, depth, height, turn in parts:
        z[_inside(heights, x, y, width, depth, turn)] = height
    for x, y, width, depth in unseen:
        z[_inside(heights, x, y, width, depth, 0.0)] = np.nan
    return heights


def _inside(heights, x, y, width, depth, turn):
    xs, ys = raster(heights)
    c, s = np.cos(turn), np.sin(turn)
    u, v = c * (xs - x) + s * (ys - y), -s * (xs - x) + c * (ys - y)
    return (np.abs(u) <= width / 2) & (np.abs(v) <= depth / 2)


@settings(max_examples=20, deadline=None)
@given(
    st.floats(-0.03, 0.03), st.floats(-0.02, 0.02), st.floats(-1.4, 1.4), st.floats(0.0008, 0.03)
)
def test_a_part_is_found_with_its_place_turn_size_and_height(x, y, turn, height):
    (bump,) = find_bumps(field([(x, y, 0.02, 0.008, height, turn)]), SIZE)
    assert (bump.x, bump.y) == pytest.approx((x, y), abs=CELL)
    assert (bump.width, bump.depth) == pytest.approx((0.02, 0.008), abs=2.5 * CELL)
    assert np.sin(bump.rotation - turn) == pytest.approx(0, abs=0.03)
    assert bump.height == pytest.approx(height, abs=5e-5)


def test_the_smallest_part_of_a_board_is_found():
    (bump,) = find_bumps(field([(0.01, 0.02, 0.0016, 0.0008, 0.0005, 0)]), SIZE)
    assert (bump.x, bump.y) == pytest.approx((0.01, 0.02), abs=CELL)


def test_noise_alone_is_no_bump_however_strong():
    for sigma in (1e-5, 1e-4, 5e-4):
        assert find_bumps(field([], sigma), SIZE) == []


def test_the_least_height_follows_the_noise():
    config = BumpConfig()
    assert least_height(field([], 1e-5), config) == config.least_height
    assert least_height(field([], 2e-4), config) == pytest.approx(config.sigmas * 2e-4, rel=0.05)


def test_modules_in_touching_slots_are_targets_of_their_own():
    slots = [(0.0, 0.0, 0.06, 0.030, 0.007, 0)]
    modules = [(0.0, y, 0.05, 0.004, 0.030, 0) for y in (-0.0094, 0.0, 0.0094)]
    bumps = find_bumps(field(slots + modules), SIZE)
    assert sorted(bump.y for bump in bumps) == pytest.approx([-0.0094, 0, 0.0094], abs=CELL)
    assert [bump.height for bump in bumps] == pytest.approx([0.030] * 3, abs=1e-4)


@pytest.mark.parametrize("seen", [True, False], ids=["ground seen", "ground unseen"])
def test_the_fins_of_a_heat_sink_are_one_target(seen):
    base = [(0.0, 0.0, 0.04, 0.03, 0.012, 0)]
    places = np.linspace(-0.018, 0.018, 8)
    fins = [(x, 0.0, 0.0015, 0.03, 0.030, 0) for x in places]
    between = (places[1:] + places[:-1]) / 2
    unseen = [] if seen else [(x, 0.0, 0.0039, 0.03) for x in between]
    (bump,) = find_bumps(field(base + fins, unseen=unseen), SIZE)
    assert (bump.width, bump.depth) == pytest.approx((0.0375, 0.03), abs=1e-3)


def test_a_splinter_amid_the_unseen_is_none():
    parts = [(0.0, 0.0, 0.003, 0.0006, 0.02, 0)]
    around = [(0.0, 0.002, 0.01, 0.0034), (0.0, -0.002, 0.01, 0.0034)]
    assert find_bumps(field(parts, unseen=around), SIZE) == []


def test_what_lies_off_the_board_is_none():
    assert find_bumps(field([(0.0525, 0.0, 0.003, 0.003, 0.01, 0)]), SIZE) == []


def test_the_highest_comes_first():
    bumps = find_bumps(
        field([(0.02, 0, 0.01, 0.01, 0.002, 0), (-0.02, 0, 0.01, 0.01, 0.02, 0)]), SIZE
    )
    assert [round(bump.x, 2) for bump in bumps] == [-0.02, 0.02]
