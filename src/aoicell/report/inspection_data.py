"""What a run has inspected, read for its page."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from aoicell.benchmark.inspection_summary import summarise_inspection
from aoicell.benchmark.records import PartRecord
from aoicell.benchmark.store import Columns, RunStore
from aoicell.report.inspection_numbers import WRONG, Outcome, outcome


class BoardKey(NamedTuple):
    """One board as one method saw it; world and trial count from 0."""

    case: int
    world: int
    trial: int
    method: str


@dataclass(frozen=True)
class Part:
    """A part that was wrong or was called so, the trial that shows it, and how it ended.

    `record` lacks what only the trial's own record has: the box and the reason.
    """

    key: BoardKey
    number: int
    record: PartRecord
    outcome: Outcome

    @property
    def is_wrong(self) -> bool:
        """Whether the verdict on it is wrong."""
        return self.outcome in WRONG


@dataclass(frozen=True)
class InspectionData:
    """All boards of the page's scope: `verdicts` by board, `methods` as in `summary.json`.

    `seen` names the boards' views, `registrations` has the rows of the store's table.
    """

    methods: dict[str, Any]
    verdicts: Mapping[BoardKey, str]
    numbers: Mapping[BoardKey, int]
    seen: Mapping[BoardKey, list[str]]
    parts: list[Part]
    registrations: Columns

    @property
    def boards(self) -> dict[str, int]:
        """How many boards each method has inspected."""
        return {method: sum(i["verdicts"].values()) for method, i in self.methods.items()}


def read_inspection(
    store: RunStore, methods: list[str], trials: Columns, first_case: bool
) -> InspectionData:
    """Read the inspections of all trials, or of the first case alone.

    Raises InputError where the store has no tables of inspections.
    """
    tables = {name: store.columns(name) for name in ("boards", "parts", "registrations")}
    if first_case:
        tables = {name: _where(t, t["case_index"] == 0) for name, t in tables.items()}
    boards, parts, registrations = tables.values()
    numbers = dict(zip(_keys(trials), map(int, trials["number"]), strict=True))
    verdicts = dict(zip(_keys(boards), map(str, boards["verdict"]), strict=True))
    seen: dict[BoardKey, list[str]] = {}
    for key, view in zip(_keys(registrations), registrations["view"], strict=True):
        seen.setdefault(key, []).append(str(view))
    return InspectionData(
        methods={
            method: summarise_inspection(
                *(_where(t, t["method"] == method) for t in (boards, parts, registrations))
            )
            for method in methods
        },
        verdicts=verdicts, numbers={key: numbers[key] for key in verdicts}, seen=seen,
        parts=[
            Part(key, numbers[key], record, outcome(record, verdicts[key]))
            for key, record in zip(_keys(parts), _records(parts), strict=True)
        ],
        registrations=registrations,
    )  # fmt: skip


def _keys(columns: Columns) -> list[BoardKey]:
    names = ("case_index", "world", "trial", "method")
    return [BoardKey(*key) for key in zip(*(columns[n].tolist() for n in names), strict=True)]


def _records(parts: Columns) -> list[PartRecord]:
    flags = {name: parts[name] == 1 for name in ("tolerated", "called")}
    parts = {**parts, **flags}
    names = [name for name in PartRecord.__annotations__ if name in parts]
    return [
        PartRecord(**dict(zip(names, map(_known, row), strict=True)), box_px=None)
        for row in zip(*(parts[name].tolist() for name in names), strict=True)
    ]


def _known(value: Any) -> Any:
    """The value, or None where the store has none."""
    return None if isinstance(value, float) and np.isnan(value) else value


def _where(columns: Columns, mask: Any) -> Columns:
    return {name: values[mask] for name, values in columns.items()}
