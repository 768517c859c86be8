"""The tests against SciPy's, and against simulated data whose truth is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, ttest_1samp, ttest_ind

from aoicell.benchmark.gate_statistics import (
    holm,
    paired_means,
    paired_rates,
    unpaired_means,
    unpaired_rates,
)
from aoicell.transforms import Array

LEVEL = 0.01


def too_many(rate: float, of: int) -> int:
    """More false alarms than a test of this rate raises once in 1000 simulations."""
    return int(binom.isf(1e-3, of, rate))


def worlds(rng: np.random.Generator, n: int = 10, trials: int = 5) -> Array:
    """Trials (n, trials) that share a calibration in each world: half of their variance."""
    return np.asarray(rng.normal(0, 1, (n, 1)) + rng.normal(0, 1, (n, trials)))


# -- Means --------------------------------------------------------------------------------


def test_pairs_are_compared_as_scipy_does(rng: np.random.Generator) -> None:
    before, after = rng.normal(0, 1, 10), rng.normal(0.5, 1, 10)
    ours, theirs = paired_means(before, after, LEVEL), ttest_1samp(after - before, 0)
    interval = theirs.confidence_interval(1 - LEVEL)
    assert ours.p == pytest.approx(theirs.pvalue)
    assert (ours.low, ours.high) == pytest.approx((interval.low, interval.high))
    assert (ours.before, ours.after) == pytest.approx((before.mean(), after.mean()))


def test_independent_samples_are_compared_as_scipy_does(rng: np.random.Generator) -> None:
    before, after = rng.normal(0, 1, 6), rng.normal(1, 3, 15)
    ours = unpaired_means(before, after, LEVEL)
    theirs = ttest_ind(after, before, equal_var=False)
    interval = theirs.confidence_interval(1 - LEVEL)
    assert ours.p == pytest.approx(theirs.pvalue)
    assert (ours.low, ours.high) == pytest.approx((interval.low, interval.high))


@pytest.mark.parametrize("test", [paired_means, unpaired_means])
def test_samples_without_spread_are_no_division_by_zero(test: type[paired_means]) -> None:
    same = test(np.full(5, 0.1), np.full(5, 0.1), LEVEL)
    assert (same.p, same.low, same.high, same.detectable) == (1, 0, 0, 0)
    moved = test(np.full(5, 0.125), np.full(5, 0.25), LEVEL)
    assert (moved.p, moved.change) == (0, 0.125)


def test_equal_samples_differ_by_exactly_nothing(rng: np.random.Generator) -> None:
    values = rng.normal(0, 1, 50)
    same = paired_means(values, values.copy(), LEVEL)
    assert (same.p, same.change, same.low, same.high) == (1, 0, 0, 0)


def test_pairs_find_what_is_small_beside_the_spread(rng: np.random.Generator) -> None:
    before = rng.normal(0, 1, 10)
    after = before + 0.05 + rng.normal(0, 0.01, 10)
    assert paired_means(before, after, LEVEL).p < 1e-4
    assert unpaired_means(before, after, LEVEL).p > 0.5


@pytest.mark.parametrize("skewed", [False, True])
def test_worlds_as_units_keep_the_false_alarms_that_trials_do_not(skewed: bool) -> None:
    rng, n = np.random.default_rng(1), 500
    by_world = by_trial = 0
    for _ in range(n):
        before, after = worlds(rng), worlds(rng)
        if skewed:
            before, after = np.exp(before), np.exp(after)
        by_world += unpaired_means(before.mean(axis=1), after.mean(axis=1), LEVEL).p < LEVEL
        by_trial += unpaired_means(before.ravel(), after.ravel(), LEVEL).p < LEVEL
    assert by_world <= too_many(LEVEL, n)
    assert by_trial > 1.5 * too_many(LEVEL, n)


def test_pairs_of_worlds_keep_their_false_alarms() -> None:
    rng, n = np.random.default_rng(2), 500
    means = [(worlds(rng).mean(axis=1), worlds(rng).mean(axis=1)) for _ in range(n)]
    alarms = sum(paired_means(before, after, LEVEL).p < 0.1 for before, after in means)
    assert 30 < alarms < too_many(0.1, n)


@pytest.mark.parametrize("test", [paired_means, unpaired_means])
def test_what_is_called_detectable_is_found_with_80_percent(test: type[paired_means]) -> None:
    rng, n = np.random.default_rng(3), 400
    samples = [(rng.normal(0, 1, 12), rng.normal(0, 1, 12)) for _ in range(n)]
    shift = np.mean([test(*both, LEVEL).detectable or 0 for both in samples])
    found = sum(test(before, after + shift, LEVEL).p < LEVEL for before, after in samples)
    assert 0.72 < found / n < 0.88


@pytest.mark.parametrize("test", [paired_means, unpaired_means])
@pytest.mark.parametrize(
    ("before", "after", "nearer"),
    [(-0.5, 0.0, True), (0.5, 0.1, True), (-0.5, 0.3, True), (0.0, 0.5, False), (0.1, -0.1, False),
     (-0.3, 0.5, False), (0.5, 0.5, False)],
)  # fmt: skip
def test_nearer_to_zero_is_said_when_it_is_sure(
    test: type[paired_means], before: float, after: float, nearer: bool, rng: np.random.Generator
) -> None:
    noise = rng.normal(0, 0.05, (2, 10))
    samples = noise - noise.mean(axis=1, keepdims=True) + [[before], [after]]
    assert test(*samples, LEVEL).nearer is nearer
    assert test(*-samples, LEVEL).nearer is nearer


# -- Rates --------------------------------------------------------------------------------


def flags(*hit: int, of: int = 20) -> np.ndarray:
    return np.isin(np.arange(of), hit)


def test_mcnemar_counts_what_changed_alone() -> None:
    ten = range(10)
    evidence = paired_rates(flags(*ten), flags(*ten, 15, 16, 17), LEVEL)
    assert evidence.p == pytest.approx(2 * 0.5**3)
    assert (evidence.before, evidence.after) == (0.5, 0.65)
    assert evidence.low < 0.15 < evidence.high
    back = paired_rates(flags(*ten, 15, 16, 17), flags(*ten), LEVEL)
    assert (back.p, back.low, back.high) == (evidence.p, -evidence.high, -evidence.low)
    assert paired_rates(flags(1), flags(2), LEVEL).p == 1


def test_no_events_at_all_leave_a_doubt() -> None:
    for evidence in (
        paired_rates(flags(), flags(), LEVEL),
        unpaired_rates(np.zeros(20), np.zeros(20), LEVEL),
    ):
        assert (evidence.p, evidence.change) == (1, 0)
        assert -0.5 < evidence.low < -0.05
        assert 0.05 < evidence.high < 0.5


def test_a_detectable_rate_is_found_with_80_percent(rng: np.random.Generator) -> None:
    never, n = flags(of=50), 300
    share = paired_rates(never, never, LEVEL).detectable or 0
    found = sum(paired_rates(never, rng.random(50) < share, LEVEL).p <= LEVEL for _ in range(n))
    assert 0.72 < found / n < 0.88
    zeros = np.zeros(12)
    share = unpaired_rates(zeros, zeros, LEVEL).detectable or 0
    hits = [(rng.random(12) < share).astype(float) for _ in range(n)]
    found = sum(unpaired_rates(zeros, hit, LEVEL).p <= LEVEL for hit in hits)
    assert 0.72 < found / n < 0.88


def test_too_few_worlds_detect_no_rate_at_all() -> None:
    assert unpaired_rates(np.zeros(4), np.zeros(4), 1e-4).detectable is None
    assert paired_rates(flags(of=4), flags(of=4), 1e-4).detectable is None


@pytest.mark.parametrize("rate", [0.02, 0.1, 0.5, 0.9])
def test_rates_of_whole_worlds_keep_their_false_alarms(rate: float) -> None:
    rng, n = np.random.default_rng(4), 300
    alarms = sum(
        unpaired_rates(*(rng.random((2, 10)) < rate).astype(float), LEVEL).p < LEVEL
        for _ in range(n)
    )
    assert alarms <= too_many(LEVEL, n)


# -- Many at once -------------------------------------------------------------------------


def test_holm_on_the_steps_of_a_ladder() -> None:
    assert holm([0.04, 0.001, 0.02, 0.012], 0.05) == [True, True, True, True]
    assert holm([0.04, 0.013, 0.001, 0.03], 0.05) == [False, True, True, False]
    assert holm([0.02, 0.02, 0.02], 0.05) == [False, False, False]
    assert holm([], 0.05) == []


@given(st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_holm_lies_between_bonferroni_and_no_correction(ps: list[float]) -> None:
    judged = list(zip(ps, holm(ps, 0.05), strict=True))
    real = [p for p, yes in judged if yes]
    chance = [p for p, yes in judged if not yes]
    assert max(real, default=0) <= 0.05
    assert min(chance, default=1) > 0.05 / len(ps)
    assert max(real, default=0) <= min(chance, default=1)
