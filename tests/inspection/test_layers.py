"""What moves with a part and what stays: pads and print do not hold it back."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.inspection import Reference, inspect_view
from aoicell.inspection.inspect import STANDARD
from aoicell.inspection.standard import standard_of
from aoicell.transforms import SE3, from_twist
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
    "U3": (0.3 * MM, 0, 0),
    "U6": (0, -0.25 * MM, 0),
    "U12": (0, 0, 3 * DEG),
    "U16": (0, 0, -4 * DEG),
    "U18": (1.2 * MM, 0.4 * MM, 0),
}
PARTS = tuple(f"U{n}" for n in range(20))


def padded(flat: Flat, T_estimate: SE3 = T_CAMERA_BOARD) -> Reference:
    """Every part stands on bright pads, as the drawing knows; it is drawn where an estimate has the
    board.
    """
    plane = painted(flat.board, missing=PARTS, padded=PARTS)
    drawing = flat_drawing(flat.board, photograph(plane, T_estimate, seed=9), T_estimate)
    reference = flat_reference(painted(flat.board, padded=PARTS))
    return replace(reference, T_camera_board=T_estimate, drawing=drawing)


def undrawn(flat: Flat) -> Reference:
    return replace(padded(flat), drawing=None)


def errors(flat: Flat, reference: Reference, ids: tuple[str, ...] = PARTS) -> tuple[float, float]:
    """How far off shifts (m) and turns (rad) are measured at most, with `MOVED` parts."""
    T = T_CAMERA_BOARD * from_twist([1 * MM, 2 * MM, 0, 0, 0, 1 * DEG])
    new = photograph(painted(flat.board, MOVED, padded=PARTS), T, seed=3)
    findings = inspect_view(new, reference, flat.board).findings
    poses = {id: MOVED.get(id, (0.0, 0.0, 0.0)) for id in ids}
    shifts = [np.hypot(*np.subtract(findings[id].shift, pose[:2])) for id, pose in poses.items()]
    turns = [abs(findings[id].rotation - pose[2]) for id, pose in poses.items()]
    return float(max(shifts)), float(max(turns))


@pytest.mark.parametrize("off", [(0, 0, 0), (0.8 * MM, -0.6 * MM, 0.2 * DEG)])
def test_pads_that_stay_do_not_hold_a_part_back(flat: Flat, off: Pose) -> None:
    """Small moves are measured whole, to a sixteenth of a pixel; also if it was drawn aside. One
    that has left its pads is drawn back to them by a tenth.
    """
    estimate = T_CAMERA_BOARD * from_twist([off[0], off[1], 0, 0, 0, off[2]])
    reference, near = padded(flat, estimate), tuple(id for id in PARTS if id != "U18")
    shift, turn = errors(flat, reference, near)
    far, far_turn = errors(flat, reference, ("U18",))
    assert shift < 0.015 * MM
    assert far < 0.03 * MM
    assert max(turn, far_turn) < 0.4 * DEG


def test_without_a_drawing_they_do(flat: Flat) -> None:
    """U3 is taken for less off than it is, and U12 for less turned."""
    (drawn, drawn_turn), (blind, blind_turn) = (
        errors(flat, reference, ("U3", "U12")) for reference in (padded(flat), undrawn(flat))
    )
    assert blind > 1.5 * drawn
    assert blind_turn > 1.5 * drawn_turn


def test_a_part_without_marks_is_found_by_its_outline(flat: Flat) -> None:
    """Once it has gone, only its edges tell where it is: against the board that is there now."""
    ids, moved = ("U7", "U13"), {"U7": (1.7 * MM, 0.9 * MM, 0.0), "U13": (-0.6 * MM, 2 * MM, 0.0)}
    reference = flat_reference(painted(flat.board, blank=ids))
    bare = photograph(painted(flat.board, missing=PARTS), seed=9)
    known = replace(reference, drawing=flat_drawing(flat.board, bare))
    new = photograph(painted(flat.board, moved, blank=ids), seed=4)
    inspection = inspect_view(new, known, flat.board)
    tools = standard_of(known, flat.board, STANDARD).tools
    assert {id for id in PARTS if tools[id].template.plain} == set(ids)
    for id, (x, y, _) in moved.items():
        assert inspection.findings[id].state == "shifted"
        assert inspection.findings[id].shift == pytest.approx((x, y), abs=0.02 * MM), id
