"""What was made to go wrong, how the trials ended, and whether refusals spoke of it."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.values import trial_values
from aoicell.errors import Why
from aoicell.sim.adversity import Cause

_HIDDEN: frozenset[Why] = frozenset(
    {"marker_not_found", "reference_not_found", "reference_unclear", "inconsistent"}
)
_DOUBTFUL: frozenset[Why] = frozenset({"marker_not_found", "inconsistent", "ambiguous", "too_far"})
_AWAY: frozenset[Why] = frozenset({"marker_not_found", "too_far", "ambiguous", "unreachable"})
_CHANGED: frozenset[Why] = frozenset({"contradicted"})
_BOUND: frozenset[Why] = frozenset({"bound_above_tolerance"})

# Which refusals speak of what really went wrong. That the bound is above the tolerance is true
# whenever it is said: fewer markers, a poor picture, or the cell's own calibration made it so.
ACCEPTABLE: Mapping[Cause, frozenset[Why]] = MappingProxyType(
    {
        "none": _BOUND,
        "occlusion": _HIDDEN | _BOUND,
        "glare": _HIDDEN | _BOUND,
        "blur": _HIDDEN | _BOUND,
        "wrong_marker": _DOUBTFUL | _BOUND,
        "second_board": _DOUBTFUL | _BOUND,
        "moved_camera": _CHANGED | _BOUND,
        "stale_calibration": _CHANGED | _BOUND,
        "out_of_range": _AWAY | _BOUND,
    }
)


def beyond_bound(trial: TrialRecord) -> bool:
    """Whether a view of a corrected trial is off by more than the software said (99.9 %)."""
    return any(v.bound_mm is not None and v.residual_mm > v.bound_mm for v in trial.views)


def silent_wrong(trial: TrialRecord, tolerance_mm: float) -> bool:
    """Whether a view of a corrected trial is off by more than its bound and the tolerance."""
    return trial.outcome == "corrected" and (trial_values(trial)["unwarned_mm"] or 0) > tolerance_mm


def by_cause(trials: Iterable[TrialRecord], tolerance_mm: float) -> dict[str, Any]:
    """For each injected cause: how many trials, how they ended, and the refusals by kind.

    `matched` counts the refusals that speak of the cause, `beyond_bound` the corrected trials
    with a view beyond its 99.9 % bound.
    """
    counts: dict[str, Any] = {}
    for trial in trials:
        c = counts.setdefault(
            trial.injected,
            {"trials": 0, "corrected": 0, "refused": 0, "failed": 0, "matched": 0,
             "beyond_bound": 0, "silent_wrong": 0, "reasons": {}},
        )  # fmt: skip
        c["trials"] += 1
        c[trial.outcome] += 1
        c["beyond_bound"] += beyond_bound(trial)
        c["silent_wrong"] += silent_wrong(trial, tolerance_mm)
        if trial.outcome == "refused":
            c["matched"] += trial.cause in ACCEPTABLE.get(trial.injected, ())  # type: ignore[call-overload]
            c["reasons"][trial.cause] = c["reasons"].get(trial.cause, 0) + 1
    return counts
