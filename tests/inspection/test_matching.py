"""Where a part is against its reference: signs, units and frames, on a board of known truth."""

from dataclasses import replace

import numpy as np
import pytest

from aoicell.board import Tolerance
from aoicell.inspection import Reference, ViewInspection, inspect_view
from aoicell.transforms import from_twist
from inspection.flat_boards import T_CAMERA_BOARD, Flat, Pose, flat_reference, painted, photograph
from inspection.scenes import ROTATED, SHIFTED, TOLERATED, called, is_finite

MM, DEG = 1e-3, np.pi / 180
MOVED: dict[str, Pose] = {
    "U0": (0.5 * MM, 0, 0),
    "U3": (0, 0.5 * MM, 0),
    "U7": (-1 * MM, 0, 0),
    "U18": (2 * MM, 1 * MM, 0),
    "U11": (0, 0, 10 * DEG),
    "U13": (0, 0, -20 * DEG),
    "U16": (0.12 * MM, -0.08 * MM, 0),  # within 0.2 mm,
    "U5": (0, 0, 3 * DEG),  # and within 5 deg
}
SHIFTS = [id for id, (x, y, _) in MOVED.items() if np.hypot(x, y) > 0.2 * MM]
TURNS = [id for id, (_, _, turn) in MOVED.items() if abs(turn) > 5 * DEG]


@pytest.fixture(scope="module")
def misplaced(flat: Flat) -> ViewInspection:
    """The flat board with `MOVED` parts, itself lying elsewhere and turned."""
    T = T_CAMERA_BOARD * from_twist([2 * MM, -1 * MM, 0, 0, 0, 1.5 * DEG])
    new = photograph(painted(flat.board, MOVED), T, seed=3)
    return inspect_view(new, flat.reference, flat.board)


@pytest.mark.parametrize("id", MOVED)
def test_a_part_is_measured_where_it_is(misplaced: ViewInspection, id: str) -> None:
    """In the board's frame, although camera and board are turned."""
    finding, (x, y, turn) = misplaced.findings[id], MOVED[id]
    assert finding.shift == pytest.approx((x, y), abs=0.06 * MM)
    assert finding.rotation == pytest.approx(turn, abs=0.5 * DEG)


def test_small_moves_are_measured_whole(flat: Flat) -> None:
    """A tenth of a pixel, a quarter, a third: on average over many parts to a tenth of it."""
    sizes = 1e-3 * np.array([0.02, -0.02, 0.05, -0.05, 0.07, -0.07])
    moved = {
        part.id: (size, 0.0, 0.0)
        for part, size in zip(flat.board.components, np.resize(sizes, 20), strict=True)
    }
    findings = inspect_view(
        photograph(painted(flat.board, moved), seed=5), flat.reference, flat.board
    ).findings
    true = np.array([moved[id][0] for id in findings])
    measured = np.array([finding.shift[0] for finding in findings.values()])
    assert (true @ measured) / (true @ true) == pytest.approx(1, abs=0.1)


def test_states_are_those_of_the_tolerances(misplaced: ViewInspection) -> None:
    assert {misplaced.findings[id].state for id in SHIFTS} == {"shifted"}
    assert {misplaced.findings[id].state for id in TURNS} == {"rotated"}
    assert sorted(called(misplaced)) == sorted([*SHIFTS, *TURNS])
    assert misplaced.foreign == ()
    assert is_finite(misplaced)
    assert all(misplaced.findings[id].reason for id in [*SHIFTS, *TURNS])


def test_a_wider_class_accepts_more_and_a_narrower_one_less(flat: Flat) -> None:
    new = photograph(painted(flat.board, {"U8": (0.3 * MM, 0, 0)}), seed=4)
    for shift, state in ((0.1, "shifted"), (0.5, "present")):
        parts = [replace(c, tolerance="own") for c in flat.board.components]
        board = replace(
            flat.board, components=tuple(parts), tolerances={"own": Tolerance(shift * MM, 5 * DEG)}
        )
        finding = inspect_view(new, flat.reference, board).findings["U8"]
        assert finding.state == state
        assert finding.shift == pytest.approx((0.3 * MM, 0), abs=0.06 * MM)


@pytest.mark.parametrize("turn_deg", [25, -100])
def test_what_may_turn_as_it_likes_is_not_rotated(flat: Flat, turn_deg: float) -> None:
    parts = [replace(c, tolerance="free") for c in flat.board.components]
    board = replace(
        flat.board, components=tuple(parts), tolerances={"free": Tolerance(0.5 * MM, np.pi)}
    )
    new = photograph(painted(flat.board, {"U8": (0, 0, turn_deg * DEG)}), seed=4)
    finding = inspect_view(new, flat.reference, board).findings["U8"]
    assert finding.state == "present"
    assert finding.rotation == pytest.approx(turn_deg * DEG, abs=0.5 * DEG)


@pytest.mark.parametrize("turn_deg", [168.0, -170.0])
def test_what_looks_alike_after_a_half_turn_has_not_made_it(flat: Flat, turn_deg: float) -> None:
    alike = ("U7", "U12")
    reference = flat_reference(painted(flat.board, alike=alike))
    moved = dict.fromkeys(alike, (6e-4, -4e-4, np.radians(turn_deg)))
    new = photograph(painted(flat.board, moved, alike=alike), seed=5)
    inspection = inspect_view(new, reference, flat.board)
    assert sorted(called(inspection)) == sorted(alike)
    for id in alike:
        finding = inspection.findings[id]
        less = np.radians(turn_deg - np.copysign(180, turn_deg))
        assert finding.rotation == pytest.approx(less, abs=np.radians(1))
        assert finding.shift == pytest.approx((6e-4, -4e-4), abs=1e-4)


def test_a_dot_tells_a_half_turn(flat: Flat) -> None:
    ids = ("U7", "U12")
    reference = flat_reference(painted(flat.board, alike=ids, dotted=ids))
    moved = {"U7": (0.0, 0.0, np.pi), "U12": (3e-4, 0.0, np.pi - 0.05)}
    new = photograph(painted(flat.board, moved, alike=ids, dotted=ids), seed=5)
    inspection = inspect_view(new, reference, flat.board)
    assert sorted(called(inspection)) == sorted(ids)


def test_a_reference_that_shows_the_parts_off_measures_against_itself(flat: Flat) -> None:
    """The golden sample is the standard, not the design."""
    reference: Reference = flat_reference(painted(flat.board, {"U8": (0.3 * MM, 0, 0)}))
    finding = inspect_view(photograph(flat.plane, seed=5), reference, flat.board).findings["U8"]
    assert finding.state == "shifted"
    assert finding.shift == pytest.approx((-0.3 * MM, 0), abs=0.06 * MM)


# ---- in the cell -------------------------------------------------------------------------------


@pytest.mark.parametrize("id", SHIFTED)
def test_a_shifted_part_of_the_server_board(inspected: ViewInspection, id: str) -> None:
    assert inspected.findings[id].state == "shifted"
    assert inspected.findings[id].shift == pytest.approx(SHIFTED[id], abs=0.1 * MM)


@pytest.mark.parametrize("id", ROTATED)
def test_a_turned_part_of_the_server_board(inspected: ViewInspection, id: str) -> None:
    assert inspected.findings[id].state == "rotated"
    assert inspected.findings[id].rotation == pytest.approx(ROTATED[id], abs=2 * DEG)


@pytest.mark.parametrize("id", TOLERATED)
def test_a_shift_within_the_class_is_present(inspected: ViewInspection, id: str) -> None:
    assert inspected.findings[id].state == "present"
    assert inspected.findings[id].shift == pytest.approx(TOLERATED[id], abs=0.1 * MM)


@pytest.mark.parametrize("light", [0.65, 1.25])
def test_a_part_that_moved_far_is_found_in_other_light(flat: Flat, light: float) -> None:
    moved: dict[str, Pose] = {
        "U2": (3 * MM, -2 * MM, 0),
        "U9": (0, 0, 2.0),
        "U13": (-3 * MM, 3 * MM, 0),
    }
    new = photograph(painted(flat.board, moved), seed=6, light=light)
    findings = inspect_view(new, flat.reference, flat.board).findings
    for id, (x, y, turn) in moved.items():
        assert findings[id].shift == pytest.approx((x, y), abs=0.06 * MM), id
        assert findings[id].rotation == pytest.approx(turn, abs=0.5 * DEG), id
