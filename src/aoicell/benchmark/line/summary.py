"""A line in a few numbers: its `summary.json`."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.line.settings import LineSettings
from aoicell.benchmark.line.store import LineStore
from aoicell.benchmark.statistics import statistics

SCHEMA = 1


def summarise(settings: LineSettings, store: LineStore) -> dict[str, Any]:
    """What the boards so far amount to; `cycle_seconds` has measured times in it, the rest none.

    A board is `wrong` when it passed and should have failed (`escaped`), or the other way round
    (`false_alarmed`). What comes first stands as the board's number, null when it never came.
    """
    boards, set_ups = store.boards(), store.set_ups()
    verdicts = Counter(board.verdict for board in boards)
    return {
        "schema": SCHEMA,
        "profile": settings.profile,
        "seed": settings.seed,
        "drift_per_100_boards": asdict(settings.rates),
        "boards": len(boards),
        "verdicts": {v: verdicts[v] for v in ("pass", "fail", "no_verdict")},
        "no_verdict_causes": dict(Counter(b.cause for b in boards if b.cause)),
        "defective": sum(b.planted > 0 for b in boards),
        "wrong": {
            "escaped": sum(b.is_wrong and b.verdict == "pass" for b in boards),
            "false_alarmed": sum(b.is_wrong and b.verdict == "fail" for b in boards),
        },
        "parts": {
            "planted": sum(b.planted for b in boards),
            "unseen": sum(b.unseen for b in boards),
            "escapes": sum(b.escapes for b in boards),
            "false_calls": sum(b.false_calls for b in boards),
        },
        "alarms": alarms_of(boards),
        "first_warning_board": _first(boards, "warning"),
        "first_recalibrate_board": _first(boards, "recalibrate"),
        "first_contradicted_board": next(
            (b.number for b in boards if b.cause == "contradicted"), None
        ),
        "first_wrong_verdict_board": next((b.number for b in boards if b.is_wrong), None),
        "set_ups_before_board": [record.before_board for record in set_ups],
        "run_length": settings.run_length,
        "residual_mm": statistics(b.residual_mm for b in boards),
        "bound_mm": statistics(b.bound_mm for b in boards),
        "outside_bound": sum(outside_bound(b) for b in boards),
        "cycle_seconds": {
            "arm": statistics(b.arm_seconds for b in boards),
            "compute": statistics(b.compute_seconds for b in boards),
            "total": statistics(b.arm_seconds + b.compute_seconds for b in boards),
        },
        "boards_per_hour": _per_hour(boards),
    }


def alarms_of(boards: Sequence[BoardRecord]) -> list[dict[str, Any]]:
    """All alarms in their order, with the number of the board that raised them."""
    return [{"board": board.number, **asdict(alarm)} for board in boards for alarm in board.alarms]


def outside_bound(board: BoardRecord) -> bool:
    """Whether a view's residual lies above the 99.9 % bound that was stated."""
    largest = max(board.residuals_mm.values(), default=0.0)
    return board.bound_mm is not None and largest > board.bound_mm


def _first(boards: Sequence[BoardRecord], level: str) -> int | None:
    return next((b.number for b in boards if any(a.level == level for a in b.alarms)), None)


def _per_hour(boards: Sequence[BoardRecord]) -> float | None:
    """One board after the other: nothing is computed while the arm moves."""
    seconds = sum(board.arm_seconds + board.compute_seconds for board in boards)
    return 3600 * len(boards) / seconds if seconds else None
