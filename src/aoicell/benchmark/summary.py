"""A run in a few numbers: `summary.json`."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from aoicell.benchmark.records import TrialRecord, ViewRecord, WorldRecord
from aoicell.scenario import Scenario

Statistics = dict[str, float | None]


def statistics(values: Iterable[float | None]) -> Statistics:
    """Mean, median, 95th percentile and maximum; null when there is no value."""
    known = np.array([v for v in values if v is not None], dtype=float)
    if known.size == 0:
        return {"mean": None, "p50": None, "p95": None, "max": None}
    return {
        "mean": float(known.mean()),
        "p50": float(np.percentile(known, 50)),
        "p95": float(np.percentile(known, 95)),
        "max": float(known.max()),
    }


def trial_mean(record: TrialRecord, name: str) -> float | None:
    """A trial's value of a view's quantity: the mean over its views."""
    return _mean(getattr(view, name) for view in record.views)


def view_px(view: ViewRecord, name: str) -> float | None:
    """A view's mean of a marker's quantity (detected_px, true_px, image_mm)."""
    return _mean(getattr(marker, name) for marker in view.markers)


def trial_px(record: TrialRecord, name: str) -> float | None:
    """A trial's value of a marker's quantity: the mean over its views."""
    return _mean(view_px(view, name) for view in record.views)


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def summarise_method(records: Sequence[TrialRecord], tolerance_mm: float) -> dict[str, Any]:
    """One method over all its trials; refused and failed trials count, but are left out of means.

    No method states a bound of its error yet, so a corrected trial beyond the scenario's
    tolerance is silently wrong.
    """
    corrected = [r for r in records if r.outcome == "corrected"]
    residual = [trial_mean(r, "residual_mm") for r in corrected]
    displacement = statistics(r.displacement_mm for r in corrected)
    summary: dict[str, Any] = {
        "trials": len(records),
        "corrected": len(corrected),
        "refused": sum(r.outcome == "refused" for r in records),
        "failed": sum(r.outcome == "failed" for r in records),
        "silent_wrong": sum(r is not None and r > tolerance_mm for r in residual),
        "displacement_mm": displacement,
        "residual_mm": statistics(residual),
        "residual_lateral_mm": statistics(trial_mean(r, "lateral_mm") for r in corrected),
        "residual_depth_mm": statistics(trial_mean(r, "depth_mm") for r in corrected),
        "residual_deg": statistics(trial_mean(r, "deg") for r in corrected),
        "residual_px": statistics(trial_px(r, "detected_px") for r in corrected),
        "residual_true_px": statistics(trial_px(r, "true_px") for r in corrected),
        "image_mm": statistics(trial_px(r, "image_mm") for r in corrected),
        "compensation": None,
        "correction_seconds": statistics(r.correction_seconds for r in corrected),
    }
    left, moved = summary["residual_mm"]["mean"], displacement["mean"]
    if left is not None and moved:
        summary["compensation"] = 1 - left / moved
    return summary


def summarise(
    scenario: Scenario,
    worlds: Sequence[WorldRecord],
    trials: Sequence[TrialRecord],
    trials_per_second: float,
    render_seconds_share: float,
) -> dict[str, Any]:
    """The whole run; the last two numbers and `correction_seconds` are times, not results."""
    return {
        "schema": 1,
        "scenario": scenario.name,
        "seed": scenario.seed,
        "profile": scenario.profile,
        "methods": {
            name: summarise_method([t for t in trials if t.method == name], scenario.tolerance_mm)
            for name in scenario.methods
        },
        "arm_floor_mm": _mean(world.arm_floor_mm for world in worlds),
        "trials_per_second": trials_per_second,
        "render_seconds_share": render_seconds_share,
    }
