"""The page's numbers: verdicts, headline, and every table, held against records made by hand."""

from pathlib import Path

import numpy as np
import pytest
from benchmark.records_by_hand import trial, view

from aoicell.benchmark.records import TrialRecord
from aoicell.report.page_data import read_run
from aoicell.report.page_figures import by_case, prediction
from aoicell.report.page_table import Column, make_table, number
from aoicell.report.page_tables import (
    cases_table,
    hand_eye_table,
    markers_table,
    refusals_table,
    views_table,
)
from aoicell.report.page_verdict import headline, predictions, significant, verdicts
from report.page_runs import METHODS, finished, last_refused, page_without_figures, records


def test_the_method_that_leaves_least_comes_first(tmp_path: Path) -> None:
    found = verdicts(read_run(finished(tmp_path, last_refused())))
    assert [(v.method, v.holds, v.left) for v in found] == [
        ("aoicell", True, "0.450"), ("paper", False, "5.25"),
    ]  # fmt: skip
    assert dict(found[0].counts) == {"silently wrong": 0, "refused": 1, "failed": 0, "trials": 6}
    assert dict(found[1].counts)["silently wrong"] == 4  # with view V2, which leaves twice as much


def test_the_headline_stands_beside_the_paper(tmp_path: Path) -> None:
    rows = {row.name: row for row in headline(read_run(finished(tmp_path, records())))}
    assert rows["left, from truth"].values == [
        ["5.250", "5.250", "8.625", "9.000"], ["0.525", "0.525", "0.863", "0.900"],
    ]  # fmt: skip
    assert rows["between the pictures"].printed == "21.09"
    assert "stated by the method" not in rows


def test_views(tmp_path: Path) -> None:
    views = views_table(read_run(finished(tmp_path, records())))
    row = next(r for r in views.rows if (r[0].text, r[1].text) == ("V2", "aoicell"))
    shown = dict(zip([f"{c.name} {c.unit}".strip() for c in views.columns], row, strict=True))
    assert shown["trials"].text == "6"
    assert shown["left mm"].text == "0.700"  # 0.2 x (1 + .. + 6) / 6
    assert shown["most mm"].text == "1.200"
    assert [shown[f"{axis} mm"].text for axis in "xyz"] == ["0.252", "−0.336", "0.560"]
    assert float(shown["left mm"].sort_by) == pytest.approx(0.7)


def test_markers(tmp_path: Path) -> None:
    markers = markers_table(read_run(finished(tmp_path, records())))
    seen = {
        (view_id.text, marker.text): (seen_in.text, missed.text, px.text)
        for view_id, marker, method, seen_in, missed, px, *_ in markers.rows
        if method.text == "paper"
    }
    assert seen == {
        ("V1", "M2"): ("6", "0", "35.00"),
        ("V2", "M2"): ("6", "0", "70.00"),
        ("V2", "M3"): ("0", "6", "–"),
    }


def test_refusals_are_counted_by_reason_whatever_numbers_it_holds(tmp_path: Path) -> None:
    reasons = ["marker M1 is 3.25 mm off", "marker M1 is -4 mm off", "marker M2 is 3 mm off"]
    trials = [trial(k, "aoicell") for k in range(3)]
    trials += [
        trial(k, outcome="refused", reason=reason, views=[], displacement_mm=40.0 + k)
        for k, reason in enumerate(reasons)
    ]
    table = refusals_table(read_run(finished(tmp_path, trials, worlds=1)))
    assert [[cell.text for cell in row[2:]] for row in table.rows] == [
        ["marker M1 is … mm off", "2", "66.7", "40.0", "41.0", "0"],
        ["marker M2 is 3 mm off", "1", "33.3", "42.0", "42.0", "2"],
    ]


def test_hand_eyes(tmp_path: Path) -> None:
    table = hand_eye_table(read_run(finished(tmp_path, records())))
    assert [cell.text for cell in table.rows[1]] == [
        "2", "paper", "9.00", "0.00", "2.00", "0.374", "0.200", "0.0100", "0.500", "0.100", "6",
    ]  # fmt: skip
    assert "paper: 0.200 mm on average over 2 worlds" in table.note


def test_predicted_against_actual(tmp_path: Path) -> None:
    def stating(record: TrialRecord) -> TrialRecord:
        if record.method == "paper":
            return record
        views = [type(v)(**{**vars(v), "predicted_mm": 0.5}) for v in record.views]
        return TrialRecord(**{**vars(record), "views": views})

    run = read_run(finished(tmp_path, [stating(r) for r in records()]))
    assert [drawing.name for drawing in prediction(run)] == ["predicted_against_actual"]
    assert predictions(run) == [
        "paper states no error of its own.",
        "aoicell: in 50 % of 6 trials less is left than it predicted; the median of actual over "
        "predicted is 1.05, the largest 1.80.",
    ]


def sweep_records() -> list[TrialRecord]:
    return [
        trial(k, method, case=case, number=2 * case + k, views=[view(mm=mm * (case + 1))])
        for case in range(3)
        for k in range(2)
        for method, mm in zip(METHODS, (1.0, 0.1), strict=True)
    ]


def test_a_sweep_is_told_case_by_case(tmp_path: Path) -> None:
    lifts = {"displacement": {"lift_mm": [{"min": 0.0, "max": float(k)} for k in range(3)]}}
    store = finished(tmp_path, sweep_records(), worlds=1, trials_per_world=2, sweep=lifts)
    run = read_run(store)
    assert [drawing.name for drawing in by_case(run)] == ["residual_by_case"]
    left = [row[7].text for row in cases_table(run).rows if row[1].text == "aoicell"]
    assert left == ["0.100", "0.200", "0.300"]
    text = page_without_figures(store).text
    assert "about all 3 cases together" in text
    assert "lift_mm = 0.0 to 2.0" in text


def test_beside_changed_cases_the_scenario_as_it_stands_is_the_headline(tmp_path: Path) -> None:
    cases = {"low": {"tolerance_mm": 1.0}, "high": {"tolerance_mm": 2.0}}
    store = finished(tmp_path, sweep_records(), worlds=1, trials_per_world=2, cases=cases)
    run = read_run(store)
    assert run.methods["aoicell"]["residual_mm"]["mean"] == pytest.approx(0.1)
    assert set(run.shown["case_index"]) == set(run.views["case_index"]) == {0}
    assert len(run.markers["view"]) == 4
    assert run.tolerances_mm == (5.0, 5.0)
    assert "about the scenario as it stands" in page_without_figures(store).text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(-0.0004, 3, "0.000"), (-1.26, 1, "−1.3"), (3.0, 0, "3"), (None, 2, "–"), (np.nan, 2, "–")],
)
def test_numbers(value: float | None, digits: int, text: str) -> None:
    assert number(value, digits) == text


def test_significant_digits() -> None:
    assert [significant(v) for v in (18.223, 0.297, 0.0123, 1234.4, 0.0, None)] == [
        "18.2", "0.297", "0.0123", "1234", "0.00", "–",
    ]  # fmt: skip


def test_a_cell_without_a_value_has_nothing_to_sort_by() -> None:
    table = make_table("t", "", [Column("a", "mm", 2), Column("b")], [[None, "x"], [0.126, "y"]])
    assert [row[0].sort_by for row in table.rows] == ["", "0.126"]
    assert [row[0].text for row in table.rows] == ["–", "0.13"]
