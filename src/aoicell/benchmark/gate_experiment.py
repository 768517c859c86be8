"""Whether a run and a baseline are of the same experiment, and what a reader should know."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from aoicell.benchmark.gate_quantities import Comparison
from aoicell.benchmark.snapshot import Snapshot
from aoicell.errors import InputError
from aoicell.scenario import Case

Pairs = Sequence[tuple[Case, Case]]  # the cases of run and baseline

_DRAWS = {"seed", "worlds", "trials_per_world"}  # may differ: more of the same
_LABELS = {"name", "title", "store", "methods"}  # change no number


def refuse_other_experiments(run: Snapshot, baseline: Snapshot) -> None:
    """Raise InputError that names the first key or method that differs."""
    now, then = (s.scenario.model_dump(exclude=_DRAWS | _LABELS) for s in (run, baseline))
    for key, after, before in differences(now, then):
        raise InputError(
            f"{run.where} is not of the experiment of {baseline.where}: '{key}' is {after!r} and "
            f"was {before!r}; run the baseline's scenario, or write a new baseline with --update"
        )
    for method in baseline.scenario.methods:
        if method not in run.scenario.methods:
            raise InputError(
                f"{run.where} has no trials by '{method}', which {baseline.where} has; run all "
                "its methods, or write a new baseline with --update"
            )


def differences(now: Any, then: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Dotted keys with both values, where two nested tables differ."""
    if isinstance(now, Mapping) and isinstance(then, Mapping):
        for name in {**now, **then}:
            place = f"{key}.{name}" if key else name
            yield from differences(now.get(name), then.get(name), place)
    elif now != then:
        yield key, now, then


def refuse_fewer_trials(run: Snapshot, baseline: Snapshot, pairs: Pairs) -> None:
    """Raise InputError where the run does not have every trial of the baseline."""
    for now, then in pairs:
        here, there = shape(now), shape(then)
        if here[0] < there[0] or here[1] < there[1]:
            raise InputError(
                f"{run.where} has {here[0]} worlds of {here[1]} trials, {baseline.where} "
                f"{there[0]} of {there[1]} with the same seed: trials are missing; run as many, "
                "or write a new baseline with --update"
            )


def shape(case: Case) -> tuple[int, int]:
    """Worlds, and trials in each."""
    return case.scenario.worlds, case.scenario.trials_per_world


def remarks(run: Snapshot, baseline: Snapshot, pairs: Pairs, paired: bool) -> Iterator[str]:
    """What a reader should know beside the table."""
    new = [m for m in run.scenario.methods if m not in baseline.scenario.methods]
    if new:
        yield f"{' and '.join(new)}: not in the baseline, so not compared; --update adds it"
    if paired and any(shape(now) != shape(then) for now, then in pairs):
        yield "the run has more trials than the baseline; only those that both have are compared"
    others = [
        f"{key} {then} (now {now})"
        for key, now, then in differences(_made_with(run), _made_with(baseline))
    ]
    if others:
        yield (
            f"the baseline was made with {', '.join(others)}: what that changes is not told from "
            "what the code changed, except that only changes beyond the practical sizes count"
        )


def _made_with(taken: Snapshot) -> dict[str, Any]:
    environment = taken.environment
    own = {key: environment.get(key) for key in ("python", "machine")}
    packages = dict(environment.get("packages") or {})
    packages.pop("aoicell", None)  # a new version of it is what is checked
    return {**own, **packages}


def describe(run: Snapshot, baseline: Snapshot, pairs: Pairs, how: Comparison) -> str:
    """The comparison and its assumptions in a sentence."""
    worlds, trials = np.sum([(w, w * t) for w, t in (shape(then) for _, then in pairs)], axis=0)
    if not how.paired:
        return (
            f"other seeds ({baseline.scenario.seed} before, {run.scenario.seed} now): {worlds} "
            f"worlds before and {sum(shape(now)[0] for now, _ in pairs)} now, independent of each "
            "other; trials of one world are not, so the means and rates of worlds are tested"
        )
    pairs_of = f"the same seeds: {trials} pairs of trials in {worlds} world"
    if how.by_world:
        return (
            f"{pairs_of}s; trials of one world share its calibration, so the means of worlds are "
            "tested, and rates by trial for these worlds as they are"
        )
    return (
        f"{pairs_of}{'s' if worlds > 1 else ''}, independent as long as no other world is meant; "
        "every real move of a signed mean counts as worse"
    )
