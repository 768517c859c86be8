"""Counts and intervals of inspections, and how a part ends."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from aoicell.benchmark.records import PartRecord
from aoicell.report.inspection_numbers import binomial_interval, interval, outcome, percent, rows
from report.inspection_runs import escape, false_call, part


@given(st.integers(1, 3000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_is_the_exact_one(counts: tuple[int, int]) -> None:
    exact = binomtest(*counts).proportion_ci(0.95, method="exact")
    assert binomial_interval(*counts) == pytest.approx((exact.low, exact.high), abs=1e-9)


def test_shares_and_intervals_as_texts() -> None:
    assert percent(1995, 2000) == "99.75"
    assert percent(12, 47_400, 3) == "0.025"
    assert percent(0, 0) == interval(0, 0) == "–"
    assert interval(1995, 2000) == "99.42–99.92"
    assert interval(0, 47_400, 3) == "0.000–0.008"


@pytest.mark.parametrize(
    ("record", "verdict", "ended"),
    [
        (part(), "fail", "found"),
        (part(state="shifted"), "fail", "found"),  # called, if by another name
        (escape(), "pass", "escaped"),
        (escape(width_mm=0.6, depth_mm=0.3), "pass", "missed"),  # smaller than what must be found
        (escape(planted="rotated"), "pass", "missed"),
        (part(state="no_verdict", called=False), "no_verdict", "no verdict"),
        (part(planted="foreign_object", state="", called=False), "pass", "missed"),
        (part(planted="foreign_object", state="", called=False), "no_verdict", "no verdict"),
        (false_call(), "fail", "false call"),
        (part(planted="shifted", tolerated=True, state="shifted"), "fail", "false call"),
        (part(planted="shifted", tolerated=True, state="present", called=False), "pass", "allowed"),
    ],
)
def test_how_a_part_ends(record: PartRecord, verdict: str, ended: str) -> None:
    assert outcome(record, verdict) == ended


def _found(**changes: Any) -> dict[str, Any]:
    statistics = {"mean": 0.0123, "p50": 0.01, "p95": 0.0456, "max": 0.1}
    return {
        "verdicts": {"fail": 190, "no_verdict": 10}, "defects": 2000, "found": 1990,
        "escapes_missing": 1, "good_components": 40_000, "false_calls": 30, "no_verdict": 500,
        "unseen": 7, "shift_error_mm": statistics, "registrations": {"registered": 790},
        "registration_px": {**statistics, "p95": None}, "by_kind": {}, **changes,
    }  # fmt: skip


def test_the_headline_has_a_value_for_each_method() -> None:
    found = rows({"paper": _found(found=1000), "aoicell": _found()})
    by_name = {row.name: row for row in found}
    assert by_name["boards"].values == ["200", "200"]
    assert by_name["— passed/failed/no verdict"].values[0] == "0/190/10"
    assert by_name["detection rate, %"].values == ["50.00", "99.50"]
    assert by_name["detection rate, %"].goal == "≥ 99"
    assert by_name["false calls, %"].values[1] == "0.075"
    assert by_name["missing parts said present"].values == ["1", "1"]
    assert by_name["shift error, mean, mm"].values[1] == "0.012"
    assert by_name["registration error, 95 %, px"].values[1] == "–"
    assert by_name["— registered/degraded/lost"].values[1] == "790/0/0"
