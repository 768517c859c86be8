"""The four numbers that stand for a distribution."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Statistics = dict[str, float | None]


def statistics(values: Iterable[float | None] | NDArray[Any]) -> Statistics:
    """Mean, median, 95th percentile and maximum; null when there is no value."""
    known = np.array([np.nan if v is None else v for v in values], dtype=float)
    known = known[np.isfinite(known)]
    if known.size == 0:
        return {"mean": None, "p50": None, "p95": None, "max": None}
    p50, p95 = np.percentile(known, [50, 95])
    return {
        "mean": float(known.mean()), "p50": float(p50), "p95": float(p95), "max": float(known.max())
    }  # fmt: skip
