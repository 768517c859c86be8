"""All that the page of a run is made from, read once."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.store import Columns, RunStore
from aoicell.benchmark.summary import summarise_columns
from aoicell.benchmark.values import OF_MARKERS
from aoicell.errors import InputError
from aoicell.report.inspection_data import InspectionData, read_inspection
from aoicell.scenario import Case, Scenario, cases_of

_OF_MARKERS = ("case_index", "method", "view", "marker", *OF_MARKERS)


@dataclass(frozen=True)
class RunData:
    """A run in memory.

    `trials` has all rows of the store. `scope` names what the distributions and the tables by
    view and by marker are about: where a scenario also stands as it is beside its changed
    cases, that case alone, else all. `methods` is the summary of the scope, `shown`, `views`
    and `markers` are its rows; `markers` has one row a marker, view, trial and method.
    `inspection` is of the scope, too, where the scenario inspects.
    """

    scenario: Scenario
    cases: list[Case]
    scope: str
    trials: Columns
    shown: Columns
    views: Columns
    markers: Columns
    worlds: list[WorldRecord]
    methods: dict[str, Any]
    by_case: list[dict[str, Any]]
    arm_floor_mm: float | None
    environment: dict[str, Any]
    pace: dict[str, Any] | None
    inspection: InspectionData | None = None

    @property
    def planned(self) -> int:
        """How many trials the scenario asks for."""
        return sum(case.scenario.trials for case in self.cases)

    @property
    def done(self) -> int:
        """How many trials are stored."""
        return len(np.unique(self.trials["number"]))

    @property
    def finished(self) -> bool:
        """Whether the run came to its end; a single trial that was repeated does, too."""
        return self.pace is not None

    @property
    def takes_sources_apart(self) -> bool:
        """Whether the scenario asks for an error budget."""
        return bool(self.scenario.isolate and self.scenario.ablate)

    @property
    def tolerances_mm(self) -> tuple[float, float]:
        """The least and the largest tolerance of the cases in scope."""
        values = [case.scenario.tolerance_mm for case in self.cases_in_scope]
        return min(values), max(values)

    @property
    def cases_in_scope(self) -> list[Case]:
        """The scenario as it stands where it does, else all its cases."""
        return self.cases[:1] if _stands_alone(self.cases) else self.cases


def read_run(store: RunStore) -> RunData:
    """Read a run directory.

    Raises InputError where there is none, no trial in it yet, or another version's tables.
    """
    if not store.exists:
        raise InputError(
            f"{store.folder}: not a run directory (scenario.toml and trials.sqlite are looked "
            "for); name one that 'aoicell run' has written"
        )
    store.refuse_other_versions()
    scenario = store.scenario()
    trials = store.columns("trials")
    if not len(trials["number"]):
        raise InputError(f"{store.folder}: no trial is finished yet; go on with --resume first")
    cases, worlds = cases_of(scenario), store.worlds()
    summary = summarise_columns(scenario, trials, worlds)
    methods, floor = summary["methods"], summary["arm_floor_mm"]
    shown, views, markers = trials, store.columns("views"), store.columns("markers", _OF_MARKERS)
    scope = "" if len(cases) == 1 else f"all {len(cases)} cases together"
    if _stands_alone(cases):
        scope = "the scenario as it stands"
        shown, views, markers = (_first_case(columns) for columns in (shown, views, markers))
        worlds = [world for world in worlds if world.case == 0]
        methods, floor = (summary["cases"][0][key] for key in ("methods", "arm_floor_mm"))
    finished = (store.folder / "summary.json").is_file()
    inspected = (
        read_inspection(store, scenario.methods, trials, _stands_alone(cases))
        if scenario.inspect else None
    )  # fmt: skip
    return RunData(
        scenario, cases, scope, trials, shown, views, markers, worlds, methods,
        summary.get("cases", []), floor, store.read_json("environment.json"),
        store.read_json("summary.json") if finished else None, inspected,
    )  # fmt: skip


def choose(columns: Columns, chosen: Any) -> Columns:
    """The rows that a mask (N,) or indices name."""
    return {name: values[chosen] for name, values in columns.items()}


def case_name(case: Case) -> str:
    """`shift_mm = 10 to 20`, `without gravity`, `gravity alone`, `as it stands`."""
    if case.kind in ("without", "as it stands"):
        return f"{case.kind} {case.label}".strip()
    return f"{case.label} alone" if case.kind == "alone" else case.label


def worst_of(store: RunStore, trials: Columns, method: str, count: int) -> list[TrialRecord]:
    """The trials of a method that ended worst: defects first, then the largest residuals."""
    mine = np.flatnonzero((trials["method"] == method) & (trials["outcome"] != "refused"))
    left = np.where(trials["outcome"] == "failed", np.inf, trials["residual_mm"])[mine]
    order = mine[np.argsort(-left, kind="stable")][:count]
    numbers = [int(trials["number"][row]) for row in order]
    marks = ", ".join("?" * len(numbers))
    found = store.trials(f"method = ? AND number IN ({marks})", method, *numbers)
    return sorted(found, key=lambda record: numbers.index(record.number))


def _stands_alone(cases: list[Case]) -> bool:
    return len(cases) > 1 and cases[0].kind == "as it stands"


def _first_case(columns: Columns) -> Columns:
    return choose(columns, columns["case_index"] == 0)
