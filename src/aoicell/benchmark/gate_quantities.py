"""The quantities that the gate compares, and the test that fits each."""

from dataclasses import dataclass

import numpy as np

from aoicell.benchmark.gate_statistics import (
    Evidence,
    Flags,
    paired_means,
    paired_rates,
    unpaired_means,
    unpaired_rates,
)
from aoicell.benchmark.snapshot import MethodTrials
from aoicell.transforms import Array

FEWEST = 4  # units on a side: a standard deviation of fewer says next to nothing

SIGNED = ("x_mm", "y_mm", "z_mm")
MEANS = (*SIGNED, "residual_mm", "detected_px")
RATES = ("refused", "failed", "silent_wrong", "undetected")


def quantities(trials: MethodTrials, tolerance_mm: float) -> dict[str, Array]:
    """Everything that is tested, worlds by trials; of corrected trials, the events of all."""
    corrected = trials.outcome == "corrected"
    values = {name: np.where(corrected, trials.values[name], np.nan) for name in MEANS}
    events = {
        "refused": trials.outcome == "refused",
        "failed": trials.outcome == "failed",
        "silent_wrong": corrected & (trials.values["unwarned_mm"] > tolerance_mm),
        "undetected": corrected & np.isnan(values["detected_px"]),
    }
    return {**values, **{name: event.astype(float) for name, event in events.items()}}


@dataclass(frozen=True)
class Question:
    """One quantity of one method: every trial before (W, T) and after, NaN where it has none."""

    case: str
    method: str
    quantity: str
    before: Array
    after: Array


@dataclass(frozen=True)
class Comparison:
    """In pairs or not; with worlds as the units of means, or trials."""

    paired: bool
    by_world: bool

    def enough(self, question: Question) -> bool:
        """Whether there are units enough on both sides."""
        return all(len(units) >= FEWEST for units in self._units(question))

    def evidence(self, question: Question, level: float) -> Evidence:
        """The test that fits, with `level` as its rate of false alarms."""
        if question.quantity not in RATES:
            before, after = self._units(question)
            return (paired_means if self.paired else unpaired_means)(before, after, level)
        if self.paired:
            return paired_rates(question.before.ravel() > 0, question.after.ravel() > 0, level)
        return unpaired_rates(question.before.mean(axis=1), question.after.mean(axis=1), level)

    def _units(self, question: Question) -> tuple[Array, Array]:
        """The independent values of both sides, (N,) each in pairs, else (N,) and (M,)."""
        before, after = question.before, question.after
        known_before, known_after = np.isfinite(before), np.isfinite(after)
        if self.paired:
            known_before = known_after = known_before & known_after
        if not self.by_world:
            return before[known_before], after[known_after]
        return _world_means(before, known_before), _world_means(after, known_after)


def _world_means(values: Array, known: Flags) -> Array:
    """The mean of each world (W, T) that has a known value."""
    counts = known.sum(axis=1)
    sums = np.where(known, values, 0.0).sum(axis=1)
    means: Array = sums[counts > 0] / counts[counts > 0]
    return means
