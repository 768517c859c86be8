"""The error budget: each source alone, all but each, all together, for every method.

Many cells are drawn for each case; a cell's value is the mean residual of its trials. Each
case uses the same draws, so differences between cases are differences between sources.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.sources import SOURCES, all_but, only
from aoicell.benchmark.summary import trial_mean, trial_px
from aoicell.benchmark.trial import prepare, refused_world, run_trial
from aoicell.errors import AoicellError, Refused
from aoicell.nominal import load_nominal
from aoicell.scenario import Scenario
from aoicell.sim.tolerances import Tolerances

QUANTITIES = ("residual_mm", "lateral_mm", "true_px")


@dataclass(frozen=True)
class Case:
    """One choice of tolerances: `kind` is alone, without or all."""

    kind: str
    source: str
    tolerances: Tolerances


@dataclass(frozen=True)
class Estimate:
    """A mean over cells with its 95 % confidence interval, and the cells' own values (N,)."""

    mean: float
    low: float
    high: float
    cells: tuple[float, ...]


Table = dict[tuple[str, str, str, str], Estimate]  # by kind, source, method, quantity


@dataclass(frozen=True)
class Budget:
    """The whole study: estimates, and how many trials of each case and method were refused."""

    table: Table
    refused: dict[tuple[str, str, str], int]
    trials: int


def cases(scenario: Scenario) -> Iterator[Case]:
    """All together, then each source alone and all but each, where it is not off anyway."""
    profile = scenario.tolerances
    yield Case("all", "", profile)
    for source in SOURCES:
        alone = only(profile, source)
        if alone != Tolerances():
            yield Case("alone", source, alone)
            yield Case("without", source, all_but(profile, source))


_nominal = cache(load_nominal)  # one a worker


def run_cell(scenario: Scenario, tolerances: Tolerances, world: int) -> list[TrialRecord]:
    """All trials of one drawn cell under given tolerances."""
    case = scenario.model_copy(
        update={"knobs": tolerances.model_dump(), "profile": "ideal", "worlds": 1}
    )
    try:
        session = prepare(case, _nominal(case.cell_folder), world)
    except Refused as refusal:
        return refused_world(case, world, refusal)
    try:
        trials = range(case.trials_per_world)
        return [result.record for trial in trials for result in run_trial(session, trial)]
    finally:
        session.world.close()


def run_budget(
    scenario: Scenario, executor: Executor, progress: Callable[[int, int], None]
) -> Budget:
    """Run all cases over all cells of the scenario. The order of completion does not matter.

    Raises AoicellError on the first trial that fails: a defect is no residual.
    """
    all_cases = list(cases(scenario))
    futures = {
        executor.submit(run_cell, scenario, case.tolerances, world): (case, world)
        for case in all_cases
        for world in range(scenario.worlds)
    }
    values: dict[tuple[str, str, str, str], dict[int, float]] = {}
    refused: dict[tuple[str, str, str], int] = {}
    for done, future in enumerate(_as_completed(executor, futures), start=1):
        case, world = futures[future]
        records = future.result()
        for method in scenario.methods:
            key_of_case = (case.kind, case.source, method)
            declined = sum(r.method == method and r.outcome == "refused" for r in records)
            refused[key_of_case] = refused.get(key_of_case, 0) + declined
            for quantity in QUANTITIES:
                value = _cell_value([r for r in records if r.method == method], quantity)
                if value is not None:
                    key = (case.kind, case.source, method, quantity)
                    values.setdefault(key, {})[world] = value
        progress(done, len(futures))
    keys: list[tuple[str, str, str, str]] = [
        (case.kind, case.source, method, quantity)
        for case in all_cases
        for method in scenario.methods
        for quantity in QUANTITIES
    ]
    estimates = {key: _estimate([v for _, v in sorted(values[key].items())])
                 for key in keys if key in values}  # fmt: skip
    return Budget(estimates, refused, scenario.trials)


def _as_completed(executor: Executor, futures: Iterable[Future[Any]]) -> Iterator[Future[Any]]:
    """Finished cells as they come; on an error or an interrupt the queued ones are dropped."""
    try:
        yield from as_completed(futures)
    except BaseException:
        executor.shutdown(cancel_futures=True)
        raise


def _cell_value(records: Sequence[TrialRecord], quantity: str) -> float | None:
    """Mean over a cell's corrected trials; None when it has none."""
    for record in records:
        if record.outcome == "failed":
            raise AoicellError(f"budget: {record.method} failed, {record.reason}")
    value = trial_px if quantity.endswith("_px") else trial_mean
    known = [v for r in records if (v := value(r, quantity)) is not None]
    return float(np.mean(known)) if known else None


def _estimate(cells: Sequence[float], resamples: int = 2000) -> Estimate:
    """Mean with a bootstrap percentile interval (Efron and Tibshirani 1993, chapter 13)."""
    array = np.array(cells)
    rng = np.random.default_rng(0)
    means = rng.choice(array, (resamples, len(array))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return Estimate(float(array.mean()), float(low), float(high), tuple(cells))


def shares(table: Table, method: str, quantity: str) -> dict[str, float]:
    """Share of each source in the sum of squared contributions, each source alone."""
    squares = {
        source: float(np.mean(np.square(estimate.cells)))
        for (kind, source, m, q), estimate in table.items()
        if (kind, m, q) == ("alone", method, quantity)
    }
    total = sum(squares.values())
    return {source: square / total for source, square in squares.items()} if total else {}


def percentile_of(value: float, cells: Sequence[float]) -> float:
    """Share of cells (percent) that lie below a value."""
    return 100 * float(np.mean(np.asarray(cells) < value))


def as_rows(budget: Budget) -> list[dict[str, Any]]:
    """The budget as plain rows, for JSON."""
    return [
        {
            "kind": kind, "source": source, "method": method, "quantity": quantity,
            "trials": budget.trials, "refused": budget.refused.get((kind, source, method), 0),
            "mean": e.mean, "low": e.low, "high": e.high, "cells": list(e.cells),
        }
        for (kind, source, method, quantity), e in budget.table.items()
    ]  # fmt: skip
