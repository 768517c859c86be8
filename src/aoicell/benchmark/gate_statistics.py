"""What tells a real change from chance.

The unit of every test is what can be taken as independent: a world where trials of one world
share its calibration, else a trial. Changes are "after minus before".

Means: Student's test on the differences of pairs, Welch's (Biometrika 34, 1947) without pairs.
Rates in pairs: McNemar's test, exact, with the interval of Bonett & Price (J. Educ. Behav.
Stat. 37, 2012). Rates without pairs: Welch's test on the worlds' rates, with one world added to
each side where the event always happens and one where it never does, as Agresti & Caffo (Am.
Stat. 54, 2000) add two successes and two failures: no events at all are then no certainty.
Many tests: Holm (Scand. J. Stat. 6, 1979).
"""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, betaincinv, ndtri, stdtr, stdtrit

from aoicell.transforms import Array

POWER = 0.8
_SURE = 0.01  # false alarm rate of `nearer`

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Evidence:
    """A change between two samples, and how sure it is.

    `low` to `high` is the interval of the change, `p` the probability of one at least as large
    by chance, `detectable` the smallest change that is found with 80 % (None: no change is).
    `nearer`: the mean after is closer to zero than before, with 99 % confidence.
    """

    before: float
    after: float
    low: float
    high: float
    p: float
    detectable: float | None
    nearer: bool

    @property
    def change(self) -> float:
        """After minus before."""
        return self.after - self.before


def paired_means(before: Array, after: Array, level: float) -> Evidence:
    """Units (N,) before and after, in the same order; `level` is the rate of false alarms.

    Equal samples have p = 1 exactly, and a change that is the same in all pairs p = 0.
    """
    n = len(before)

    def error(values: Array) -> float:
        return float(np.std(values, ddof=1) / np.sqrt(n))

    errors = error(after - before), error(after + before)
    return _student(before.mean(), after.mean(), *errors, n - 1, level)


def unpaired_means(before: Array, after: Array, level: float) -> Evidence:
    """Independent units (N,) before and (M,) after."""
    n, m = len(before), len(after)
    part, other = float(np.var(before, ddof=1)) / n, float(np.var(after, ddof=1)) / m
    weights = part**2 / (n - 1) + other**2 / (m - 1)
    freedom = (part + other) ** 2 / weights if weights else n + m - 2
    error = float(np.sqrt(part + other))
    return _student(before.mean(), after.mean(), error, error, freedom, level)


def _student(
    before: Any, after: Any, error: float, error_of_sum: float, freedom: float, level: float
) -> Evidence:
    """A change of means from its standard error, and that of the sum of both means."""
    change, both = float(after - before), float(after + before)
    half = float(-stdtrit(freedom, level / 2)) * error
    p = 2 * stdtr(freedom, -abs(change) / error) if error else float(change == 0)
    # |after| < |before| means that the sum of the two has the other sign than their difference
    nearer = -both * np.sign(change) > -stdtrit(freedom, _SURE) * error_of_sum
    found = half + stdtrit(freedom, POWER) * error
    return Evidence(
        float(before), float(after), change - half, change + half, float(p), float(found),
        bool(nearer),
    )  # fmt: skip


def paired_rates(before: Flags, after: Flags, level: float) -> Evidence:
    """Whether an event happened in each of the same trials (N,)."""
    n = len(before)
    came, went = int((after & ~before).sum()), int((before & ~after).sum())
    q_came, q_went = (came + 1) / (n + 2), (went + 1) / (n + 2)
    centre = q_came - q_went
    half = float(-ndtri(level / 2) * np.sqrt((q_came + q_went - centre**2) / (n + 2)))
    p = _mcnemar(came, went)
    found = _detectable_rate(n, lambda k: _mcnemar(k, 0) <= level)
    return Evidence(
        float(before.mean()), float(after.mean()), max(centre - half, -1), min(centre + half, 1),
        p, found, went > came,
    )  # fmt: skip


def _mcnemar(came: int, went: int) -> float:
    return min(1.0, 2 * float(bdtr(min(came, went), came + went, 0.5)))


def unpaired_rates(before: Array, after: Array, level: float) -> Evidence:
    """Rates of an event in independent worlds (N,) before and (M,) after.

    `detectable` is the share of worlds in which it always happens, where it never did.
    """
    n, m = len(before), len(after)

    def compared(before: Array, after: Array) -> Evidence:
        return unpaired_means(np.append(before, [0, 1]), np.append(after, [0, 1]), level)

    def found(k: int) -> bool:
        return compared(np.zeros(n), (np.arange(m) < k).astype(float)).p <= level

    evidence = compared(before, after)
    return replace(
        evidence, before=float(before.mean()), after=float(after.mean()),
        low=max(evidence.low, -1), high=min(evidence.high, 1),
        p=evidence.p if evidence.change else 1.0, detectable=_detectable_rate(m, found),
    )  # fmt: skip


def _detectable_rate(n: int, found: Callable[[int], bool]) -> float | None:
    """The rate with which so many of `n` units are hit in 80 % of all cases that it is found."""
    k = bisect_left(range(n + 1), True, key=found)
    return float(betaincinv(k, n - k + 1, POWER)) if k <= n else None


def holm(ps: Sequence[float], alpha: float) -> list[bool]:
    """Which changes are real, with a probability of at most `alpha` for any false alarm."""
    real = [False] * len(ps)
    for rank, index in enumerate(np.argsort(ps, kind="stable")):
        if ps[index] > alpha / (len(ps) - rank):
            break
        real[index] = True
    return real
