"""Inspections in numbers: what counts as found, as an escape, as a false call."""

from pathlib import Path
from typing import Any

import pytest

from aoicell.benchmark.inspection_summary import inspections
from aoicell.benchmark.records import InspectionRecord, PartRecord, RegistrationRecord
from aoicell.benchmark.values import board_values, escaped, is_false_call
from benchmark.records_by_hand import stored, trial


def part(component: str = "R1", planted: str = "missing", **changes: Any) -> PartRecord:
    values: dict[str, Any] = {
        "component": component, "kind": "resistor", "planted": planted, "tolerated": False,
        "width_mm": 1.6, "depth_mm": 0.8, "shift_mm": 0.0, "rotation_deg": 0.0, "state": "absent",
        "called": True, "confidence": 0.9, "shift_error_mm": None, "view": "V1",
        "box_px": [1.0, 2.0, 3.0, 4.0],
    }  # fmt: skip
    return PartRecord(**{**values, **changes})


PARTS = [
    part("R1"),
    part("R2", state="present", called=False),  # escapes
    part("R3", state="no_verdict", called=False),  # neither found nor escaped
    part("R4", "shifted", state="shifted", shift_mm=0.5, shift_error_mm=0.04),
    part("R5", "shifted", state="present", called=False, tolerated=True, shift_error_mm=0.02),
    part("R6", "", state="wrong_part"),  # a good part
    part("R7", "shifted", state="shifted", tolerated=True, shift_error_mm=None),
]


def board(parts: list[PartRecord]) -> InspectionRecord:
    registrations = [
        RegistrationRecord("V1", "registered", 0.1, 0.2),
        RegistrationRecord("V2", "no_verdict", None, 30.0),
    ]
    return InspectionRecord("fail", 231, 5, 2, parts, registrations)


def test_a_defect_that_is_tolerated_is_none() -> None:
    values = board_values(board(PARTS))
    assert (values["defects"], values["found"]) == (4, 2)
    assert values["escapes_missing"] == 1
    assert values["false_calls"] == 2  # R6, and R7 that its class allows
    assert (values["good_components"], values["no_verdict"], values["unseen"]) == (231, 5, 2)


@pytest.mark.parametrize(
    ("width", "depth", "counts"), [(1.0, 0.5, True), (0.5, 1.0, True), (0.9, 0.9, False)]
)
def test_only_missing_parts_of_a_size_escape(width: float, depth: float, counts: bool) -> None:
    missed = part(state="present", called=False, width_mm=width, depth_mm=depth)
    assert escaped(missed) is counts
    assert not escaped(part(state="no_verdict", called=False))
    assert not escaped(part(planted="shifted", state="present", called=False))


def test_what_is_planted_and_called_is_no_false_call() -> None:
    assert not is_false_call(part())
    assert not is_false_call(part(planted="", called=False))


def test_the_summary_of_a_run_goes_method_by_method(tmp_path: Path) -> None:
    trials = [
        trial(k, method, inspection=board(PARTS[: 4 if method == "paper" else 7]))
        for k in range(2)
        for method in ("aoicell", "paper")
    ]
    found = inspections(stored(tmp_path, trials), ["aoicell", "paper"])
    assert found["aoicell"]["defects"] == 8
    assert found["aoicell"]["false_calls"] == 4
    assert found["paper"]["false_calls"] == 0
    assert found["aoicell"]["by_kind"] == {
        "missing": {"defects": 6, "found": 2},
        "shifted": {"defects": 2, "found": 2},
    }
    assert found["aoicell"]["shift_error_mm"]["mean"] == pytest.approx(0.03)
    assert found["paper"]["shift_error_mm"]["mean"] == pytest.approx(0.04)
    # a view that was given up has no registration that could be off
    assert found["aoicell"]["registration_px"]["max"] == 0.2
    assert found["aoicell"]["registrations"] == {"no_verdict": 2, "registered": 2}
    assert found["aoicell"]["verdicts"] == {"fail": 2}


def test_a_run_that_does_not_inspect_has_no_boards(tmp_path: Path) -> None:
    found = inspections(stored(tmp_path, [trial(0)]), ["paper"])
    assert found["paper"]["defects"] == 0
    assert found["paper"]["shift_error_mm"]["mean"] is None
