"""Counting how trials ended in which something was made to go wrong, on records by hand."""

from dataclasses import replace

import pytest

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.refusals import ACCEPTABLE, beyond_bound, by_cause, silent_wrong
from aoicell.sim.adversity import CAUSES
from benchmark.records_by_hand import refused, trial, view

TOLERANCE_MM = 0.3


def corrected(*left_and_bound: tuple[float, float | None], injected: str = "none") -> TrialRecord:
    """One view for each pair of mm."""
    views = [replace(view(mm=left), bound_mm=bound) for left, bound in left_and_bound]
    return trial(views=views, injected=injected)


@pytest.mark.parametrize(
    ("left", "bound", "beyond", "silent"),
    [
        (0.1, 0.2, False, False),
        (0.25, 0.2, True, False),  # within what the scenario tolerates
        (0.35, 0.4, False, False),  # as the software said
        (0.45, 0.4, True, True),
        (0.35, None, False, True),  # nothing was said
    ],
)
def test_silent_is_beyond_the_bound_and_the_tolerance(
    left: float, bound: float | None, beyond: bool, silent: bool
) -> None:
    record = corrected((0.01, 0.2), (left, bound))
    assert beyond_bound(record) is beyond
    assert silent_wrong(record, TOLERANCE_MM) is silent
    assert not silent_wrong(replace(record, outcome="refused"), TOLERANCE_MM)


def test_refusals_are_counted_by_cause() -> None:
    counts = by_cause(
        [
            corrected((0.1, 0.2), injected="glare"),
            corrected((0.9, 0.2), injected="glare"),
            refused(injected="glare", cause="marker_not_found"),
            refused(injected="glare", cause="contradicted"),
            refused(injected="moved_camera", cause="contradicted"),
        ],
        TOLERANCE_MM,
    )
    assert counts["glare"] == {
        "trials": 4, "corrected": 2, "refused": 2, "failed": 0, "matched": 1, "beyond_bound": 1,
        "silent_wrong": 1, "reasons": {"marker_not_found": 1, "contradicted": 1},
    }  # fmt: skip
    assert counts["moved_camera"]["matched"] == 1


def test_every_cause_has_its_refusals() -> None:
    assert set(ACCEPTABLE) == set(CAUSES)
    assert "contradicted" not in ACCEPTABLE["none"]
