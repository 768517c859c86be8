"""What the gate calls worse, better, or nothing; and what it declines to compare."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.snapshots import ENVIRONMENT, changed, noisy, shifted

from aoicell.benchmark.gate import GateResult, PracticalSizes, check
from aoicell.benchmark.snapshot import Snapshot
from aoicell.errors import InputError, Refused
from aoicell.scenario import Scenario

BOTH = ["paper", "aoicell"]
TEN = Scenario(name="ten", worlds=10, trials_per_world=5, methods=BOTH, pictures=False)
ONE = Scenario(name="one", worlds=1, trials_per_world=20, methods=BOTH, pictures=False)
BASELINE, ONE_BASELINE = noisy(TEN, where="b.json"), noisy(ONE, where="b.json")


def with_seed(seed: int, scenario: Scenario = TEN, **changes: Any) -> Snapshot:
    return noisy(scenario.model_copy(update={"seed": seed, **changes}))


def changes(result: GateResult) -> dict[str, str]:
    """The verdicts on what changed, by quantity of the method aoicell."""
    assert all(c.method == "aoicell" for v in ("regressed", "improved") for c in result.of(v))
    return {c.quantity: c.verdict for v in ("regressed", "improved") for c in result.of(v)}


# -- The same seeds -----------------------------------------------------------------------


def test_the_same_numbers_are_no_change() -> None:
    result = check(noisy(TEN), BASELINE)
    assert result.paired
    assert result.passed
    assert {change.p for change in result.changes} == {1.0}
    assert {change.change for change in result.changes} == {0.0}
    assert len(result.changes) == 2 * 9


@pytest.mark.parametrize("scenario", [TEN, ONE])
@pytest.mark.parametrize("axis", ["x_mm", "y_mm", "z_mm"])
@pytest.mark.parametrize("mm", [0.05, -0.05])
def test_a_bias_is_found_though_the_magnitude_stays(
    scenario: Scenario, axis: str, mm: float
) -> None:
    baseline = noisy(scenario)
    result = check(shifted(baseline, "aoicell", **{axis: mm}), baseline)
    assert changes(result) == {axis: "regressed"}
    (change,) = result.of("regressed")
    assert change.change == pytest.approx(mm)
    assert (change.low, change.high) == pytest.approx((mm, mm))
    assert not result.passed


def test_what_is_real_but_small_does_not_count() -> None:
    run = shifted(BASELINE, "aoicell", x_mm=0.019, residual_mm=0.019, detected_px=0.09)
    result = check(run, BASELINE)
    assert result.passed
    assert max(change.p for change in result.changes if change.change) < 1e-6
    assert changes(check(run, BASELINE, PracticalSizes(mm=0.018))) == {
        "x_mm": "regressed",
        "residual_mm": "regressed",
    }
    assert changes(check(run, BASELINE, PracticalSizes(px=0.08))) == {"detected_px": "regressed"}


def test_what_is_large_but_by_chance_does_not_count() -> None:
    values = BASELINE.trials[0, "aoicell"].values["residual_mm"].copy()
    values[3, 2] += 5  # one bad trial: 0.1 mm in the mean
    result = check(changed(BASELINE, "aoicell", residual_mm=values), BASELINE)
    change = next(c for c in result.changes if c.method == "aoicell" and c.quantity[:3] == "res")
    assert change.change == pytest.approx(0.1)
    assert change.verdict == "not shown"
    assert result.passed


def test_a_world_that_changed_as_a_whole_is_one_observation() -> None:
    values = BASELINE.trials[0, "aoicell"].values["residual_mm"].copy()
    values[3] += 1  # a calibration
    assert check(changed(BASELINE, "aoicell", residual_mm=values), BASELINE).passed


@pytest.mark.parametrize("quantity", ["residual_mm", "detected_px"])
def test_magnitudes_fail_when_they_grow_and_only_then(quantity: str) -> None:
    more, less = (shifted(BASELINE, "aoicell", **{quantity: step}) for step in (0.2, -0.2))
    assert changes(check(more, BASELINE)) == {quantity: "regressed"}
    result = check(less, BASELINE)
    assert changes(result) == {quantity: "improved"}
    assert result.passed


@pytest.mark.parametrize(("scenario", "verdict"), [(TEN, "improved"), (ONE, "regressed")])
def test_a_bias_that_goes_is_better_where_worlds_are_many(scenario: Scenario, verdict: str) -> None:
    good = noisy(scenario)
    biased = shifted(good, "aoicell", y_mm=-0.3)
    assert changes(check(good, biased)) == {"y_mm": verdict}


def test_a_bias_that_only_turns_round_is_worse() -> None:
    left, right = (shifted(BASELINE, "aoicell", y_mm=step) for step in (-0.1, 0.1))
    assert changes(check(right, left)) == {"y_mm": "regressed"}


@pytest.mark.parametrize("scenario", [TEN, ONE])
@pytest.mark.parametrize("outcome", ["refused", "failed"])
def test_refusals_and_failures_are_counted(scenario: Scenario, outcome: str) -> None:
    baseline = noisy(scenario)
    often = np.where(
        np.arange(scenario.worlds * scenario.trials_per_world) % 4, outcome, "corrected"
    )
    run = changed(baseline, "aoicell", outcome=often.reshape(scenario.worlds, -1))
    assert changes(check(run, baseline)) == {outcome: "regressed"}
    back = check(baseline, run)
    assert changes(back) == {outcome: "improved"}
    assert back.passed


def test_silently_wrong_and_undetected_trials_are_counted() -> None:
    values = BASELINE.trials[0, "aoicell"].values
    bad = np.arange(50).reshape(10, 5) % 3 == 0
    run = changed(
        BASELINE, "aoicell",
        residual_mm=np.where(bad, TEN.tolerance_mm + 1, values["residual_mm"]),
        detected_px=np.where(bad, np.nan, values["detected_px"]),
    )  # fmt: skip
    found = changes(check(run, BASELINE))
    assert found["silent_wrong"] == found["undetected"] == "regressed"


def test_when_nothing_is_corrected_any_more_the_means_are_undecided() -> None:
    result = check(changed(BASELINE, "aoicell", outcome="refused"), BASELINE)
    assert changes(result) == {"refused": "regressed"}
    assert len(result.undecided) == 5
    assert "aoicell: too few trials of run have x_mm to test" in result.undecided
    never = changed(BASELINE, "aoicell", outcome="refused")
    assert check(never, never).passed  # as before: nothing to decide


def test_too_few_pairs_are_declined() -> None:
    two = noisy(ONE.model_copy(update={"trials_per_world": 2}))
    with pytest.raises(Refused, match="fewer than 4 trials"):
        check(two, two)


def test_more_trials_than_the_baseline_has_are_left_out() -> None:
    many = with_seed(0, worlds=12, trials_per_world=6)
    values = {name: v.copy() for name, v in many.trials[0, "aoicell"].values.items()}
    then = BASELINE.trials[0, "aoicell"].values
    for name in values:
        values[name][:10, :5] = then[name]
        values[name][10:] += 9
    paper = BASELINE.trials[0, "paper"].values
    padded = {name: np.pad(v, ((0, 2), (0, 1)), constant_values=7) for name, v in paper.items()}
    run = changed(changed(many, "aoicell", **values), "paper", **padded)
    result = check(run, BASELINE)
    assert {change.change for change in result.changes} == {0.0}
    assert any("more trials than the baseline" in note for note in result.notes)


# -- Other seeds --------------------------------------------------------------------------


def test_other_seeds_find_a_large_change_and_say_what_they_would_find() -> None:
    run = shifted(with_seed(1), "aoicell", x_mm=0.3, residual_mm=0.5)
    result = check(run, BASELINE)
    assert not result.paired
    assert changes(result) == {"x_mm": "regressed", "residual_mm": "regressed"}
    paired = check(noisy(TEN), BASELINE)
    for now, then in zip(result.changes, paired.changes, strict=True):
        assert now.detectable is not None
        assert then.detectable is not None
        assert now.detectable > 2 * then.detectable
    assert "other seeds (0 before, 1 now): 10 worlds before and 10 now" in result.compared


def test_other_seeds_may_have_other_numbers_of_worlds_and_trials() -> None:
    run = shifted(with_seed(1, worlds=15, trials_per_world=3), "aoicell", x_mm=0.3)
    assert changes(check(run, BASELINE)) == {"x_mm": "regressed"}


@pytest.mark.parametrize("worlds", [1, 3])
def test_too_few_worlds_of_other_seeds_are_declined(worlds: int) -> None:
    few = with_seed(1, worlds=worlds)
    for run, baseline in ((few, BASELINE), (replace(BASELINE, where="run"), few)):
        with pytest.raises(Refused, match=rf"one of them has {worlds} world.*4 worlds on each"):
            check(run, baseline)


def test_unchanged_runs_with_other_seeds_hardly_ever_alarm() -> None:
    """At 1 % more than 4 of 60 come about once in 2500 times."""
    alarms = sum(not check(with_seed(seed), BASELINE).passed for seed in range(1, 61))
    assert alarms <= 4


# -- What cannot be compared --------------------------------------------------------------


@pytest.mark.parametrize(
    ("updates", "complaint"),
    [
        ({"tolerance_mm": 4.0}, "'tolerance_mm' is 4.0 and was 5.0"),
        ({"profile": "paper"}, "'profile' is 'paper' and was 'typical'"),
        ({"knobs": {"k1": 0.1}}, "'knobs.k1' is 0.1 and was None"),
        ({"methods": ["paper"]}, "run has no trials by 'aoicell', which b.json has"),
        ({"worlds": 9}, "run has 9 worlds of 5 trials, b.json 10 of 5 with the same seed"),
        ({"trials_per_world": 4}, "run has 10 worlds of 4 trials"),
    ],
)
def test_another_experiment_is_named_in_one_sentence(
    updates: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(InputError, match=re.escape(complaint)) as error:
        check(with_seed(0, **updates), BASELINE)
    assert "\n" not in str(error.value)
    assert "--update" in str(error.value)


def test_labels_and_new_methods_are_no_other_experiment() -> None:
    baseline = noisy(TEN.model_copy(update={"methods": ["paper"]}))
    run = with_seed(0, name="renamed", title="x")
    result = check(replace(run, trials={**run.trials, **baseline.trials}), baseline)
    assert {change.method for change in result.changes} == {"paper"}
    assert result.passed
    assert result.notes == ("aoicell: not in the baseline, so not compared; --update adds it",)


def test_another_machine_is_said() -> None:
    packages = {"numpy": "2.5.0", "aoicell": "9"}
    run = replace(BASELINE, environment={**ENVIRONMENT, "packages": packages})
    result = check(run, BASELINE)
    (note,) = result.notes
    assert "made with numpy 2.4.6 (now 2.5.0): " in note
    assert result.passed


def test_each_case_is_compared_with_its_own() -> None:
    sweep = TEN.model_copy(update={"sweep": {"knobs": {"k1": [-0.1, -0.2]}}})
    baseline = noisy(sweep)
    trials = dict(baseline.trials)
    old = trials[1, "aoicell"]
    moved = {**old.values, "z_mm": old.values["z_mm"] + 0.1}
    result = check(
        replace(baseline, trials={**trials, (1, "aoicell"): replace(old, values=moved)}), baseline
    )
    assert len(result.changes) == 36
    assert [(c.case, c.quantity) for c in result.of("regressed")] == [("sweep k1 = -0.2", "z_mm")]


@pytest.mark.parametrize("size", [-0.1, float("nan"), float("inf")])
def test_a_practical_size_is_a_length(size: float) -> None:
    with pytest.raises(InputError, match="practical size in mm"):
        PracticalSizes(mm=size)
