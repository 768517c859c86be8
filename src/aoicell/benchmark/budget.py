"""The error budget: each source alone, all but each, all together, for every method.

Many cells are drawn for each case; a cell's value is the mean residual of its trials. Each
case uses the same draws, so differences between cases are differences between sources.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aoicell.benchmark.store import Columns, RunStore
from aoicell.errors import AoicellError, InputError
from aoicell.scenario import cases_of

QUANTITIES = ("residual_mm", "lateral_mm", "true_px")

_KINDS = {"as it stands": "all", "alone": "alone", "without": "without"}  # of a scenario's cases


@dataclass(frozen=True)
class Estimate:
    """A mean over cells with its 95 % confidence interval.

    `cells` (N,) are the cells' own values, each the mean over its tests; `tests` (M,) the values
    of the single tests, that is trials, of all cells.
    """

    mean: float
    low: float
    high: float
    cells: tuple[float, ...]
    tests: tuple[float, ...]


Table = dict[tuple[str, str, str, str], Estimate]  # by kind, source, method, quantity


@dataclass(frozen=True)
class Budget:
    """The whole study: estimates, and how many trials of each case and method were refused."""

    table: Table
    refused: dict[tuple[str, str, str], int]
    trials: int


def read_budget(store: RunStore) -> Budget:
    """The budget of a run whose scenario isolates and ablates error sources.

    Raises InputError for another run, and AoicellError when a trial failed: a defect is no
    residual.
    """
    scenario = store.scenario()
    if not (scenario.isolate and scenario.ablate):
        raise InputError(
            f"{store.folder}: no error budget; its scenario needs isolate and ablate, as in "
            "error_budget"
        )
    names = ("case_index", "world", "trial", "method", "outcome", "reason", *QUANTITIES)
    trials = store.columns("trials", names)
    failed = trials["outcome"] == "failed"
    if failed.any():
        raise AoicellError(f"{store.folder}: a trial failed, {trials['reason'][failed][0]}")
    table: Table = {}
    refused = {}
    for case in cases_of(scenario):
        kind = _KINDS.get(case.kind)
        if kind is None:
            continue
        for method in scenario.methods:
            mine = (trials["case_index"] == case.index) & (trials["method"] == method)
            declined = mine & (trials["outcome"] == "refused")
            refused[kind, case.label, method] = int(declined.sum())
            for quantity in QUANTITIES:
                cells = _by_cell(trials, mine, quantity)
                if cells:
                    table[kind, case.label, method, quantity] = _estimate(cells)
    return Budget(table, refused, scenario.trials)


def _by_cell(trials: Columns, mine: Any, quantity: str) -> list[list[float]]:
    """The known values of each cell's tests; a cell without any is left out."""
    known = mine & np.isfinite(trials[quantity])
    worlds, values = trials["world"][known], trials[quantity][known]
    return [values[worlds == world].tolist() for world in np.unique(worlds)]


def _estimate(by_cell: Sequence[Sequence[float]], resamples: int = 2000) -> Estimate:
    """Mean with a bootstrap percentile interval (Efron and Tibshirani 1993, chapter 13)."""
    cells = [float(np.mean(tests)) for tests in by_cell]
    array = np.array(cells)
    rng = np.random.default_rng(0)
    means = rng.choice(array, (resamples, len(array))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    tests = tuple(value for tests in by_cell for value in tests)
    return Estimate(float(array.mean()), float(low), float(high), tuple(cells), tests)


def shares(table: Table, method: str, quantity: str) -> dict[str, float]:
    """Share of each source in the sum of squared contributions, each source alone."""
    squares = {
        source: float(np.mean(np.square(estimate.cells)))
        for (kind, source, m, q), estimate in table.items()
        if (kind, m, q) == ("alone", method, quantity)
    }
    total = sum(squares.values())
    return {source: square / total for source, square in squares.items()} if total else {}


def percentile_of(value: float, values: Sequence[float]) -> float:
    """Share of `values` (percent), of cells or of single tests, that lie below a value."""
    return 100 * float(np.mean(np.asarray(values) < value))


def as_rows(budget: Budget) -> list[dict[str, Any]]:
    """The budget as plain rows, for JSON."""
    return [
        {
            "kind": kind, "source": source, "method": method, "quantity": quantity,
            "trials": budget.trials, "refused": budget.refused.get((kind, source, method), 0),
            "mean": e.mean, "low": e.low, "high": e.high, "cells": list(e.cells),
            "tests": list(e.tests),
        }
        for (kind, source, method, quantity), e in budget.table.items()
    ]  # fmt: skip
