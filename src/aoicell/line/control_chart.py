"""Control charts: when is a change from board to board more than chance?

Readings of an unchanged cell scatter about a mean that nobody knows. Each is compared with the mean
of those before it, which leaves standard normal innovations, independent of each other and of that
mean, as long as nothing changes (Hawkins 1987; Quesenberry 1991). A multivariate EWMA of them tells
of slow changes (Lowry, Woodall, Champ and Rigdon 1992). Its limit follows from how many boards may
pass until the first false alarm on the average (ARL), by the Markov chain of Runger and Prabhu
(1996): without a change the length of the average alone is one.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import chndtr, ndtri, stdtr

from aoicell.transforms import Array

_RINGS = 60  # of the Markov chain; the run length is then exact to about 1 %


def innovations(readings: Array, covariance: Array) -> Array:
    """Standard normal (N - 1, p) from readings (N, p) of known covariance (p, p), unknown mean."""
    n = np.arange(1, len(readings))[:, None]
    means = np.cumsum(readings, axis=0)[:-1] / n
    apart = (readings[1:] - means) * np.sqrt(n / (n + 1))
    L = np.linalg.cholesky(covariance)
    return np.asarray(np.linalg.solve(L, apart.T).T).reshape(-1, readings.shape[1])


def studentised(readings: Array) -> Array:
    """Standard normal (N - 2, 1) from numbers (N,) whose spread is not known either.

    The innovation over the spread of the readings before has Student's distribution.
    """
    values = []
    for n in range(2, len(readings)):
        before = readings[:n]
        spread = before.std(ddof=1)
        if spread == 0:  # no noise at all: any change is one
            values.append(np.sign(readings[n] - before[0]) * 8.0)
            continue
        apart = (readings[n] - before.mean()) * np.sqrt(n / (n + 1)) / spread
        # by the smaller tail, which is the one that a float can tell
        tail = max(stdtr(n - 1, -abs(apart)), np.finfo(float).tiny)
        values.append(-np.sign(apart) * ndtri(tail))
    return np.array(values).reshape(-1, 1)


@dataclass(frozen=True)
class Chart:
    """An EWMA of p numbers: each new one counts `weight`; the first false alarm is to come after
    `run_length` readings on the average.
    """

    size: int
    weight: float = 0.2
    run_length: float = 1000.0

    @property
    def limit(self) -> float:
        """Of the statistic, in squared standard deviations of the average."""
        return _limit(self.size, self.weight, self.run_length)

    def statistics(self, values: Array) -> Array:
        """The statistic (N,) after each of standard normal values (N, p)."""
        squares, average = [], np.zeros(self.size)
        for value in values:
            average = self.weight * value + (1 - self.weight) * average
            squares.append(float(average @ average))
        return np.array(squares) * (2 - self.weight) / self.weight


def average_run_length(size: int, weight: float, limit: float) -> float:
    """How many readings pass on the average until the statistic first exceeds the limit, while
    nothing changes.
    """
    radius = np.sqrt(limit * weight / (2 - weight))
    step = 2 * radius / (2 * _RINGS + 1)
    rings = np.arange(_RINGS + 1)
    noncentral = ((1 - weight) / weight * step * rings) ** 2
    edges = ((rings + 0.5) * step / weight) ** 2
    below = chndtr(edges[None, :], size, noncentral[:, None])
    Q = np.diff(below, axis=1, prepend=0.0)
    return float(np.linalg.solve(np.eye(len(Q)) - Q, np.ones(len(Q)))[0])


@cache
def _limit(size: int, weight: float, run_length: float) -> float:
    def surplus(limit: float) -> float:
        return float(np.log(average_run_length(size, weight, limit) / run_length))

    return float(brentq(surplus, 0.1, 20.0 + 6 * size + 4 * np.log(run_length), xtol=1e-6))
