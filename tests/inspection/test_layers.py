"""What moves with a part and what stays: pads and print do not hold it back."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.inspection import Reference, inspect_view
from aoicell.transforms import from_twist
from inspection.flat_boards import (
    T_CAMERA_BOARD,
    Flat,
    Pose,
    flat_drawing,
    flat_reference,
    painted,
    photograph,
)

MM, DEG = 1e-3, np.pi / 180
MOVED: dict[str, Pose] = {
    "U3": (0.1 * MM, 0, 0),
    "U6": (0, -0.15 * MM, 0),
    "U12": (0, 0, 2 * DEG),
    "U16": (0, 0, -3 * DEG),
    "U18": (1.2 * MM, 0.4 * MM, 0),
}
PARTS = tuple(f"U{n}" for n in range(20))


@pytest.fixture(scope="module")
def padded(flat: Flat) -> Reference:
    """Every part stands on bright pads, as the drawing knows."""
    bare = photograph(painted(flat.board, missing=PARTS, padded=PARTS), seed=9)
    reference = flat_reference(painted(flat.board, padded=PARTS))
    return replace(reference, drawing=flat_drawing(flat.board, bare))


def test_pads_that_stay_do_not_hold_a_part_back(flat: Flat, padded: Reference) -> None:
    """Small moves are measured whole, to a twentieth of a pixel."""
    T = T_CAMERA_BOARD * from_twist([1 * MM, 2 * MM, 0, 0, 0, 1 * DEG])
    new = photograph(painted(flat.board, MOVED, padded=PARTS), T, seed=3)
    inspection = inspect_view(new, padded, flat.board)
    for id, (x, y, turn) in MOVED.items():
        finding = inspection.findings[id]
        assert finding.shift == pytest.approx((x, y), abs=0.02 * MM), id
        assert finding.rotation == pytest.approx(turn, abs=0.3 * DEG), id
    still = [inspection.findings[id] for id in PARTS if id not in MOVED]
    assert max(np.hypot(*finding.shift) for finding in still) < 0.02 * MM


def test_a_part_without_marks_is_found_by_its_outline(flat: Flat) -> None:
    """Once it has gone, only its edges tell where it is: against the board that is there now."""
    ids, moved = ("U7", "U13"), {"U7": (1.7 * MM, 0.9 * MM, 0.0), "U13": (-0.6 * MM, 2 * MM, 0.0)}
    reference = flat_reference(painted(flat.board, blank=ids))
    bare = photograph(painted(flat.board, missing=PARTS), seed=9)
    known = replace(reference, drawing=flat_drawing(flat.board, bare))
    new = photograph(painted(flat.board, moved, blank=ids), seed=4)
    inspection = inspect_view(new, known, flat.board)
    for id, (x, y, _) in moved.items():
        assert inspection.findings[id].state == "shifted"
        assert inspection.findings[id].shift == pytest.approx((x, y), abs=0.05 * MM), id
