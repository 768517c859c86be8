"""`summary.json` from records made by hand."""

import json
from pathlib import Path
from typing import Any

import pytest

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.statistics import statistics
from aoicell.benchmark.summary import summarise, summarise_method
from aoicell.scenario import Scenario

from .records_by_hand import refused, stored, trial, view, world

NOTHING = {"mean": None, "p50": None, "p95": None, "max": None}
STATISTICS = (
    "displacement_mm residual_mm residual_lateral_mm residual_depth_mm residual_deg residual_px"
    " image_mm correction_seconds"
).split()


def test_statistics() -> None:
    assert statistics(range(101)) == {"mean": 50, "p50": 50, "p95": 95, "max": 100}
    assert statistics([None, 3.0, None]) == {"mean": 3, "p50": 3, "p95": 3, "max": 3}
    assert statistics([]) == statistics([None]) == NOTHING


def of_method(folder: Path, records: list[TrialRecord], tolerance_mm: float) -> dict[str, Any]:
    return summarise_method(stored(folder, records).columns("trials"), tolerance_mm)


def test_refused_trials_count_and_are_left_out_of_the_means(tmp_path: Path) -> None:
    records = [
        trial(0, views=[view(mm=1.0, px=(2.0,))]),
        trial(1, views=[view(mm=3.0, px=(6.0,))], displacement_mm=30.0),
        refused(2),
        trial(3, outcome="failed", views=[], correction_seconds=None),
    ]
    summary = of_method(tmp_path, records, tolerance_mm=5.0)
    assert (summary["trials"], summary["corrected"]) == (4, 2)
    assert (summary["refused"], summary["failed"], summary["silent_wrong"]) == (1, 1, 0)
    assert summary["displacement_mm"]["mean"] == 40
    assert summary["residual_mm"] == {"mean": 2, "p50": 2, "p95": pytest.approx(2.9), "max": 3}
    assert summary["residual_lateral_mm"]["max"] == pytest.approx(1.8)
    assert summary["residual_depth_mm"]["max"] == pytest.approx(2.4)
    assert summary["residual_deg"]["mean"] == pytest.approx(0.2)
    assert summary["residual_px"]["mean"] == 4
    assert summary["residual_true_px"]["mean"] == pytest.approx(1.9)
    assert summary["image_mm"]["max"] == pytest.approx(6 * 0.19)
    assert summary["compensation"] == pytest.approx(1 - 2 / 40)
    assert summary["correction_seconds"]["mean"] == pytest.approx(0.01)


@pytest.mark.parametrize("records", [[], [refused()]])
def test_without_a_corrected_trial_there_are_no_numbers(
    tmp_path: Path, records: list[TrialRecord]
) -> None:
    summary = of_method(tmp_path, records, 5.0)
    assert summary["trials"] == len(records)
    assert all(summary[name] == NOTHING for name in STATISTICS)
    assert summary["compensation"] is None
    assert summary["silent_wrong"] == 0


def test_without_a_displacement_there_is_no_compensation(tmp_path: Path) -> None:
    assert of_method(tmp_path, [trial(displacement_mm=0.0)], 5.0)["compensation"] is None


def test_a_corrected_trial_beyond_the_tolerance_is_silently_wrong(tmp_path: Path) -> None:
    records = [
        trial(0, views=[view(mm=4.9)]),
        trial(1, views=[view(mm=5.1)]),
        trial(2, views=[view("V1", mm=1.0), view("V2", mm=30.0)]),
        refused(3),
    ]
    for tolerance, wrong in ((5.0, 2), (40.0, 0)):
        assert of_method(tmp_path, records, tolerance)["silent_wrong"] == wrong


def test_the_summary_has_the_agreed_keys(tmp_path: Path) -> None:
    scenario = Scenario(name="x", seed=7, profile="paper")
    trials = [trial(), trial(method="aoicell", views=[view(mm=0.1)])]
    store = stored(tmp_path, trials, [world(0, 0.02), world(1, 0.04)], scenario)
    summary = summarise(scenario, store, 1.5, 0.25)
    assert json.loads(json.dumps(summary)) == summary
    assert summary["schema"] == 1
    assert (summary["scenario"], summary["seed"], summary["profile"]) == ("x", 7, "paper")
    assert summary["arm_floor_mm"] == pytest.approx(0.03)
    assert (summary["trials_per_second"], summary["render_seconds_share"]) == (1.5, 0.25)
    assert list(summary["methods"]) == ["paper", "aoicell_one_look", "aoicell"]
    for method in summary["methods"].values():
        assert {"trials", "corrected", "refused", "failed", "silent_wrong", "compensation"} < set(
            method
        )
        for name in STATISTICS:
            assert set(method[name]) == {"mean", "p50", "p95", "max"}
    means = [summary["methods"][m]["residual_mm"]["mean"] for m in ("paper", "aoicell")]
    assert means == [1.0, 0.1]


def test_a_sweep_has_its_cases_one_by_one(tmp_path: Path) -> None:
    scenario = Scenario(name="x", sweep={"knobs": {"noise_grey": [1.0, 2.0]}}, methods=["paper"])
    trials = [trial(0, views=[view(mm=1.0)]), trial(0, case=1, number=2, views=[view(mm=3.0)])]
    summary = summarise(scenario, stored(tmp_path, trials, scenario=scenario), 1.0, 0.0)
    assert [case["label"] for case in summary["cases"]] == ["noise_grey = 1.0", "noise_grey = 2.0"]
    means = [case["methods"]["paper"]["residual_mm"]["mean"] for case in summary["cases"]]
    assert means == [1.0, 3.0]
    assert summary["methods"]["paper"]["residual_mm"]["mean"] == 2.0
