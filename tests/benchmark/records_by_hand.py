"""Records made by hand, and run directories that hold them."""

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.benchmark.records import (
    HandEyeRecord,
    MarkerRecord,
    TrialRecord,
    ViewRecord,
    WorldRecord,
)
from aoicell.benchmark.store import RunStore
from aoicell.scenario import Scenario

EYE = np.eye(4).tolist()
SCENARIO = Scenario(name="s", seed=3, methods=["paper", "aoicell"])


def marker(px: float | None = 2.0, id: str = "M2") -> MarkerRecord:
    uv = None if px is None else [[1.5, 2.5]] * 4
    return MarkerRecord(id, px, 1.9, None if px is None else px * 0.19, uv, uv)


def view(id: str = "V1", mm: float = 1.0, px: tuple[float | None, ...] = (2.0,)) -> ViewRecord:
    markers = [marker(p, f"M{k}") for k, p in enumerate(px, start=2)]
    vector = [0.36 * mm, -0.48 * mm, 0.8 * mm]
    return ViewRecord(
        id, 20, mm, vector, None, 0.6 * mm, 0.8 * mm, 0.1 * mm, markers, EYE, EYE
    )  # fmt: skip


def trial(trial: int = 0, method: str = "paper", **changes: Any) -> TrialRecord:
    values: dict[str, Any] = {
        "case": 0,
        "number": trial,
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


def refused(number: int = 0, method: str = "paper", **changes: Any) -> TrialRecord:
    return trial(
        number, method, outcome="refused", reason="marker M1 is missing", displacement_mm=250.0,
        measured_shift_mm=None, correction_seconds=None, views=[], **changes,
    )  # fmt: skip


def world(index: int = 0, floor: float = 0.03) -> WorldRecord:
    hand_eye = HandEyeRecord(
        "paper", EYE, [9.0, 0.0, 2.0], [0.1, 0.2, 0.3], [9.1, 0.1, 2.1], 0.2, 0.01, 0.5, 0.1, 6
    )
    return WorldRecord(0, index, floor, [hand_eye], ["hand picture 3: no chessboard"])


def stored(
    folder: Path,
    trials: Iterable[TrialRecord],
    worlds: Iterable[WorldRecord] = (),
    scenario: Scenario = SCENARIO,
) -> RunStore:
    """A run directory with these records."""

    def place(record: TrialRecord) -> tuple[int, int, int]:
        return record.case, record.world, record.trial

    store = RunStore(folder)
    store.create(scenario, {"python": "3"})
    with store.writing() as writer:
        for record in worlds:
            writer.add_world(record)
        for _, records in groupby(sorted(trials, key=place), key=place):
            writer.add_trial(scenario.seed, list(records))
    return store
