"""A run in a few numbers: `summary.json`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from aoicell.benchmark.inspection_summary import inspections
from aoicell.benchmark.records import WorldRecord
from aoicell.benchmark.refusals import by_cause
from aoicell.benchmark.statistics import statistics
from aoicell.benchmark.store import Columns, RunStore
from aoicell.benchmark.values import mean
from aoicell.scenario import Scenario, cases_of

# names in the summary, and in the store
_QUANTITIES = {
    "displacement_mm": "displacement_mm",
    "residual_mm": "residual_mm",
    "residual_lateral_mm": "lateral_mm",
    "residual_depth_mm": "depth_mm",
    "residual_deg": "deg",
    "predicted_mm": "predicted_mm",
    "residual_px": "detected_px",
    "residual_true_px": "true_px",
    "image_mm": "image_mm",
    "correction_seconds": "correction_seconds",
}


def summarise_method(trials: Columns, tolerance_mm: float) -> dict[str, Any]:
    """One method over its trials; refused and failed trials count, but are left out of means.

    A corrected trial is silently wrong when a view of it lies outside the method's own stated
    99.9 % bound and above the scenario's tolerance; a method that states none has no bound.
    """
    outcome = trials["outcome"]
    corrected = outcome == "corrected"
    summary: dict[str, Any] = {
        "trials": len(outcome),
        "corrected": int(corrected.sum()),
        "refused": int((outcome == "refused").sum()),
        "failed": int((outcome == "failed").sum()),
        "silent_wrong": int((trials["unwarned_mm"][corrected] > tolerance_mm).sum()),
    }
    for name, column in _QUANTITIES.items():
        summary[name] = statistics(trials[column][corrected])
    left, moved = summary["residual_mm"]["mean"], summary["displacement_mm"]["mean"]
    summary["coverage_95"] = mean(c for c in trials["covered"][corrected] if np.isfinite(c))
    summary["compensation"] = 1 - left / moved if left is not None and moved else None
    return summary


def summarise(
    scenario: Scenario,
    store: RunStore,
    trials_per_second: float,
    render_seconds_share: float,
) -> dict[str, Any]:
    """The whole run; the last two numbers and `correction_seconds` are times, not results.

    `methods` is over all trials; a scenario of several cases has them one by one in `cases`.
    """
    results = summarise_columns(scenario, store.columns("trials"), store.worlds())
    if scenario.inspect:
        for method, inspection in inspections(store, scenario.methods).items():
            results["methods"][method]["inspection"] = inspection
    return {
        "schema": 1,
        "scenario": scenario.name,
        "seed": scenario.seed,
        "profile": scenario.profile,
        **results,
        **({"injected": _injected(scenario, store)} if scenario.inject else {}),
        "trials_per_second": trials_per_second,
        "render_seconds_share": render_seconds_share,
    }


def _injected(scenario: Scenario, store: RunStore) -> dict[str, Any]:
    """By method, what was made to go wrong and how that ended."""
    return {
        name: by_cause(store.trials("method = ?", name), scenario.tolerance_mm)
        for name in scenario.methods
    }


def summarise_columns(
    scenario: Scenario, trials: Columns, worlds: Sequence[WorldRecord]
) -> dict[str, Any]:
    """`methods`, `arm_floor_mm` and `cases` of the summary, from what the store holds."""
    summary: dict[str, Any] = {
        "methods": _by_method(scenario, trials),
        "arm_floor_mm": mean(world.arm_floor_mm for world in worlds),
    }
    cases = cases_of(scenario)
    if len(cases) > 1:
        summary["cases"] = [
            {
                "kind": case.kind,
                "label": case.label,
                "methods": _by_method(case.scenario, _where(trials, "case_index", case.index)),
                "arm_floor_mm": _floor(worlds, case.index),
            }
            for case in cases
        ]
    return summary


def _by_method(scenario: Scenario, trials: Columns) -> dict[str, Any]:
    return {
        name: summarise_method(_where(trials, "method", name), scenario.tolerance_mm)
        for name in scenario.methods
    }


def _where(trials: Columns, column: str, value: Any) -> Columns:
    chosen = trials[column] == value
    return {name: values[chosen] for name, values in trials.items()}


def _floor(worlds: Sequence[WorldRecord], case: int) -> float | None:
    return mean(world.arm_floor_mm for world in worlds if world.case == case)
