"""Snapshots whose numbers are known."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from benchmark.records_by_hand import stored as store_records
from benchmark.records_by_hand import trial as trial_record
from benchmark.records_by_hand import view

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.snapshot import DECIMALS, MethodTrials, Snapshot
from aoicell.benchmark.store import RunStore
from aoicell.scenario import Scenario, cases_of

ENVIRONMENT = {"python": "3.12.1", "machine": "x86_64", "packages": {"numpy": "2.4.6"}}


def noisy(scenario: Scenario, seed: int = 0, where: str = "run") -> Snapshot:
    """Corrected trials: signed means about zero, half of their variance shared by a world."""
    rng = np.random.default_rng([scenario.seed, seed])
    trials = {}
    for case in cases_of(scenario):
        worlds, each = case.scenario.worlds, case.scenario.trials_per_world
        for method in scenario.methods:
            x, y, z = (
                0.05 * rng.standard_normal((worlds, 1)) + 0.05 * rng.standard_normal((worlds, each))
                for _ in "xyz"
            )
            length = np.sqrt(x**2 + y**2 + z**2)
            px = 4 * length + 0.1 * rng.random((worlds, each))
            values = dict(zip(DECIMALS, (x, y, z, length, px, length), strict=True))
            rounded = {name: np.round(values[name], digits) for name, digits in DECIMALS.items()}
            outcome = np.full((worlds, each), "corrected")
            trials[case.index, method] = MethodTrials(outcome, rounded)
    return Snapshot(where, scenario, ENVIRONMENT, trials)


def changed(
    taken: Snapshot, method: str, *, outcome: Any = None, where: str = "run", **values: Any
) -> Snapshot:
    """The same with other outcomes (W, T), or with quantities (W, T) replaced, of one method."""
    trials = dict(taken.trials)
    if "residual_mm" in values:  # no bound is stated
        values.setdefault("unwarned_mm", values["residual_mm"])
    for (case, name), old in taken.trials.items():
        if name == method:
            new = old.outcome if outcome is None else np.broadcast_to(outcome, old.outcome.shape)
            trials[case, name] = MethodTrials(new, {**old.values, **values})
    return Snapshot(where, taken.scenario, taken.environment, trials)


def shifted(taken: Snapshot, method: str, **by: Any) -> Snapshot:
    """The same with something added to quantities of one method (of the first case)."""
    old = taken.trials[0, method].values
    return changed(taken, method, **{name: old[name] + step for name, step in by.items()})


def stored(taken: Snapshot, folder: Path) -> RunStore:
    """A run directory from which the same snapshot is taken, of a scenario with one case."""
    records = [
        _record(taken.trials[0, method], method, world, trial, taken.scenario.trials_per_world)
        for method in taken.scenario.methods
        for world, trial in np.ndindex(taken.scenario.worlds, taken.scenario.trials_per_world)
    ]
    return store_records(folder, records, scenario=taken.scenario)


def _record(mine: MethodTrials, method: str, world: int, trial: int, each: int) -> TrialRecord:
    value = {name: float(values[world, trial]) for name, values in mine.values.items()}
    one = view(mm=value["residual_mm"], px=(value["detected_px"],))
    one = replace(one, vector_mm=[value[axis] for axis in ("x_mm", "y_mm", "z_mm")])
    return trial_record(
        trial, method, world=world, number=world * each + trial,
        outcome=str(mine.outcome[world, trial]), views=[one],
    )  # fmt: skip
