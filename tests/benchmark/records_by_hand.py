"""Records made by hand."""

from typing import Any

import numpy as np

from aoicell.benchmark.records import (
    HandEyeRecord,
    MarkerRecord,
    TrialRecord,
    ViewRecord,
    WorldRecord,
)

EYE = np.eye(4).tolist()


def marker(px: float | None = 2.0, id: str = "M2") -> MarkerRecord:
    uv = None if px is None else [[1.5, 2.5]] * 4
    return MarkerRecord(id, px, 1.9, None if px is None else px * 0.19, uv, uv)


def view(id: str = "V1", mm: float = 1.0, px: tuple[float | None, ...] = (2.0,)) -> ViewRecord:
    markers = [marker(p, f"M{k}") for k, p in enumerate(px, start=2)]
    return ViewRecord(id, 20, mm, 0.6 * mm, 0.8 * mm, 0.1 * mm, markers, EYE, EYE)


def trial(trial: int = 0, method: str = "paper", **changes: Any) -> TrialRecord:
    values: dict[str, Any] = {
        "world": 0,
        "trial": trial,
        "method": method,
        "outcome": "corrected",
        "reason": "",
        "displacement_mm": 50.0,
        "turn_deg": 10.0,
        "measured_shift_mm": 49.0,
        "correction_seconds": 0.01,
        "T_base_board_taught": EYE,
        "T_base_board_now": EYE,
        "views": [view()],
    }
    return TrialRecord(**{**values, **changes})


def refused(number: int = 0, method: str = "paper") -> TrialRecord:
    return trial(
        number, method, outcome="refused", reason="marker M1 is missing", displacement_mm=250.0,
        measured_shift_mm=None, correction_seconds=None, views=[],
    )  # fmt: skip


def world(index: int = 0, floor: float = 0.03) -> WorldRecord:
    hand_eye = HandEyeRecord(
        "paper", EYE, [9.0, 0.0, 2.0], [0.1, 0.2, 0.3], [9.1, 0.1, 2.1], 0.2, 0.01, 0.5, 0.1, 6
    )
    return WorldRecord(index, floor, [hand_eye], ["hand picture 3: no chessboard"])
