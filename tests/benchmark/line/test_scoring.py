"""When a verdict on a board is wrong."""

from dataclasses import replace

import pytest

from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.line.scoring import _is_unclear, _right_verdict
from aoicell.benchmark.records import PartRecord
from aoicell.line.monitor import Status
from aoicell.nominal import Nominal
from aoicell.sim.board_turns import looks_alike

STATUS = Status(0, 0, (0.0,) * 7, (0.0,) * 7, 0, 0)


def part(component: str, planted: str, **values: float) -> PartRecord:
    return PartRecord(
        component=component, kind="", planted=planted, tolerated=False, width_mm=1, depth_mm=1,
        shift_mm=values.get("shift_mm", 0.0), rotation_deg=values.get("rotation_deg", 0.0),
        state="", called=True, confidence=1, shift_error_mm=None, view="V1", box_px=None,
    )  # fmt: skip


def board(verdict: str, truth: str) -> BoardRecord:
    return BoardRecord(
        number=0, slot=0, set_up=-1, verdict=verdict, reason="", cause="", truth=truth, planted=0,
        unseen=0, escapes=0, false_calls=0, residuals_mm={}, predicted_mm=None, bound_mm=None,
        reading=None, status=STATUS, alarms=[], drifted_mm=0, drifted_deg=0, drifted_light=0,
        arm_seconds=1, compute_seconds=1,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("verdict", "truth", "wrong"),
    [
        ("pass", "pass", False), ("fail", "fail", False), ("pass", "fail", True),
        ("fail", "pass", True), ("pass", "either", False), ("fail", "either", False),
        ("no_verdict", "fail", False), ("no_verdict", "pass", False), ("no_verdict", "", False),
    ],
)  # fmt: skip
def test_only_a_verdict_can_be_wrong(verdict: str, truth: str, wrong: bool) -> None:
    assert board(verdict, truth).is_wrong is wrong


@pytest.mark.parametrize(("beside_mm", "unclear"), [(0.04, True), (-0.04, True), (0.06, False)])
def test_a_shift_at_the_limit_is_right_either_way(
    nominal: Nominal, beside_mm: float, unclear: bool
) -> None:
    component = nominal.board.components[0]
    limit = 1e3 * nominal.board.tolerance(component).shift
    shifted = part(component.id, "shifted", shift_mm=limit + beside_mm, rotation_deg=45)
    assert _is_unclear(shifted, nominal.board) is unclear
    assert not _is_unclear(replace(shifted, planted="missing"), nominal.board)


def test_a_turn_at_the_limit_counts_from_what_looks_the_same(nominal: Nominal) -> None:
    chip = next(c for c in nominal.board.components if looks_alike(c) == 2 and c.kind == "resistor")
    limit = 57.29578 * nominal.board.tolerance(chip).rotation
    for angle in (limit, -limit, 180 + limit, 180 - limit):
        assert _is_unclear(part(chip.id, "rotated", rotation_deg=angle), nominal.board)
    assert not _is_unclear(part(chip.id, "rotated", rotation_deg=90.0), nominal.board)


def test_one_clear_defect_decides() -> None:
    missing, at_limit = part("R1", "missing"), part("R2", "shifted")
    assert _right_verdict([], set()) == "pass"
    assert _right_verdict([missing, at_limit], {"R2"}) == "fail"
    assert _right_verdict([at_limit], {"R2"}) == "either"
    assert _right_verdict([], {"R2"}) == "either"  # within its tolerance, but hardly
