import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aoicell.board import load_board
from aoicell.planning.bumps import Bump
from aoicell.planning.scan_comparison import (
    compare,
    designed_footprints,
    designed_targets,
    distances_px,
)
from aoicell.resources import data_root
from aoicell.transforms import apply, rotation, translation

BOARD = load_board(data_root() / "models" / "server_board")
TARGETS = designed_targets(BOARD, 0.0003)


def bumps_of(targets, T_scan_board, off=0.0):
    places = apply(T_scan_board, np.array([[t.x + off, t.y, 0] for t in targets]))
    return [
        Bump(x, y, 0.0, t.width, t.depth, t.height + 1e-4)
        for (x, y, _), t in zip(places, targets, strict=True)
    ]


@settings(max_examples=10, deadline=None)
@given(st.floats(-0.001, 0.001), st.floats(-0.003, 0.003), st.sampled_from([0.0, np.pi]))
def test_the_frame_of_the_scan_is_laid_over_that_of_the_design(shift, turn, half):
    T_scan_board = translation(shift, -shift) * rotation("z", turn + half)
    comparison = compare(bumps_of(TARGETS, T_scan_board), TARGETS)
    assert len(comparison.matches) == len(TARGETS)
    assert not comparison.missed
    assert not comparison.extra
    assert comparison.position_errors.max() < 1e-6
    assert comparison.height_errors == pytest.approx(1e-4)
    assert comparison.T_scan_board.homogeneous == pytest.approx(T_scan_board.homogeneous, abs=1e-6)


def test_errors_are_found_minus_designed():
    found = bumps_of(TARGETS, translation())
    last = found[-1]
    found[-1] = Bump(last.x + 0.001, last.y, 0.0, last.width, last.depth, last.height)
    match = next(m for m in compare(found, TARGETS).matches if m.target is TARGETS[-1])
    assert match.error == pytest.approx((0.001, 0.0), abs=5e-5)


def test_what_is_missing_or_too_much_is_named():
    found = bumps_of(TARGETS[3:], translation())
    found.append(Bump(0.5, 0.5, 0.0, 0.01, 0.01, 0.01))
    comparison = compare(found, TARGETS)
    assert comparison.missed == tuple(TARGETS[:3])
    assert comparison.extra == (found[-1],)


def test_a_piece_of_a_part_is_told_from_what_is_not_of_the_design():
    footprints = designed_footprints(BOARD)
    latch = BOARD.component("SLOT_A1")
    x, y = latch.place(0.48 * latch.width, 0.0)
    piece, nothing = Bump(x, y, 0, 0.002, 0.002, 0.007), Bump(0.0, 0.2, 0, 0.002, 0.002, 0.007)
    turned = [
        Bump(-b.x, -b.y, b.rotation, b.width, b.depth, b.height)
        for b in [*bumps_of(TARGETS, translation()), piece, nothing]
    ]
    comparison = compare(turned, TARGETS, footprints)
    assert comparison.pieces == (turned[-2],)
    assert comparison.extra == (turned[-1],)


def test_nothing_found_matches_nothing():
    comparison = compare([], TARGETS)
    assert not comparison.matches
    assert len(comparison.missed) == len(TARGETS)
    assert comparison.position_errors.shape == (0,)


def test_targets_are_what_is_uppermost_and_stands_out():
    ids = {t.id for t in TARGETS}
    assert {"HS1", "DIMM_A1", "M1", "R1"} <= ids
    assert not {"CPU1", "SLOT_A1", "LBL1"} & ids
    heat_sink = next(t for t in TARGETS if t.id == "HS1")
    assert heat_sink.height == pytest.approx(0.0305)


def test_crosses_are_measured_where_one_was_found():
    expected = np.array([[100.0, 100.0], [500.0, 500.0]])
    found = [np.array([[101.0, 100.0], [300.0, 300.0]])]
    assert distances_px(found, expected) == pytest.approx([1.0])
    assert len(distances_px([], expected)) == 0
