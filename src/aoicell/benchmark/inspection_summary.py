"""What inspections found, in a few numbers: for `summary.json` and the report."""

from typing import Any

import numpy as np

from aoicell.benchmark.statistics import statistics
from aoicell.benchmark.store import Columns, RunStore
from aoicell.benchmark.values import OF_BOARDS


def summarise_inspection(boards: Columns, parts: Columns, registrations: Columns) -> dict[str, Any]:
    """One method over its boards; the columns are its rows of the store's tables.

    `registration_px` is the true error, over all views that were not given up; `shift_error_mm`
    over all shifts that were measured. `by_kind` has what was planted and found, by kind of
    defect.
    """
    summary: dict[str, Any] = {name: int(boards[name].sum()) for name in OF_BOARDS}
    summary["verdicts"] = counted(boards["verdict"])
    summary["shift_error_mm"] = statistics(parts["shift_error_mm"])
    judged = registrations["state"] != "no_verdict"
    summary["registration_px"] = statistics(registrations["error_px"][judged])
    summary["registrations"] = counted(registrations["state"])
    summary["by_kind"] = _by_kind(parts)
    return summary


def _by_kind(parts: Columns) -> dict[str, dict[str, int]]:
    real = (parts["planted"] != "") & (parts["tolerated"] == 0)
    return {
        kind: {
            "defects": int((real & (parts["planted"] == kind)).sum()),
            "found": int((real & (parts["planted"] == kind) & (parts["called"] == 1)).sum()),
        }
        for kind in sorted({*parts["planted"][real]})
    }


def counted(values: Any) -> dict[str, int]:
    """How often each of the values (N,) comes."""
    names, counts = np.unique(values.astype(str), return_counts=True)
    return {str(name): int(count) for name, count in zip(names, counts, strict=True)}


def inspections(store: RunStore, methods: list[str]) -> dict[str, dict[str, Any]]:
    """The summary of each method of a run that inspects, over all its cases."""
    tables = [store.columns(name) for name in ("boards", "parts", "registrations")]
    return {
        method: summarise_inspection(*(_of_method(columns, method) for columns in tables))
        for method in methods
    }


def _of_method(columns: Columns, method: str) -> Columns:
    mine = columns["method"] == method
    return {name: values[mine] for name, values in columns.items()}
