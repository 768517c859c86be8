"""What a run is compared by, of every trial and method: outcome, signed means, residual, px."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError
from aoicell.resources import data_root
from aoicell.scenario import Scenario, cases_of
from aoicell.transforms import Array

DECIMALS = {
    "x_mm": 4, "y_mm": 4, "z_mm": 4, "residual_mm": 4, "detected_px": 3, "unwarned_mm": 4,
}  # fmt: skip


@dataclass(frozen=True)
class MethodTrials:
    """The trials of one method in one case: worlds W by trials in a world T.

    `outcome` (W, T) holds words, `values` numbers (W, T) by quantity, NaN where there is none.
    """

    outcome: NDArray[np.str_]
    values: Mapping[str, Array]


@dataclass(frozen=True)
class Snapshot:
    """What is compared of a run, rounded; `trials` by case and method, `where` names it.

    Paths in `scenario` are relative to the project's data, or bare names.
    """

    where: str
    scenario: Scenario
    environment: Mapping[str, Any]
    trials: Mapping[tuple[int, str], MethodTrials]


def snapshot(store: RunStore) -> Snapshot:
    """Take it from a finished run.

    Raises InputError for a folder that is no run, or a run that is not complete.
    """
    if not store.exists:
        raise InputError(f"{store.folder}: not a run directory; name one that `aoicell run` made")
    keys = ("case_index", "world", "trial", "method", "outcome")
    try:
        columns = store.columns("trials", (*keys, *DECIMALS))
    except KeyError as missing:
        raise InputError(
            f"{store.folder}: its store has no column {missing}, so another version made it; "
            "run the scenario again"
        ) from None
    scenario = store.scenario()
    trials = {}
    for case in cases_of(scenario):
        shape = case.scenario.worlds, case.scenario.trials_per_world
        for method in scenario.methods:
            mine = (columns["case_index"] == case.index) & (columns["method"] == method)
            place = f"case {case.index}, " if case.index else ""
            _refuse_gaps(columns["world"][mine], columns["trial"][mine], shape, store.folder, place)
            values = {
                name: np.round(columns[name][mine].astype(float), digits).reshape(shape)
                for name, digits in DECIMALS.items()
            }
            outcome = columns["outcome"][mine].astype(str).reshape(shape)
            trials[case.index, method] = MethodTrials(outcome, values)
    portable = Scenario(**_portable(scenario.model_dump()))
    environment = store.read_json("environment.json")
    made_with = {key: environment.get(key) for key in ("python", "machine", "packages", "git")}
    return Snapshot(str(store.folder), portable, made_with, trials)


def _refuse_gaps(
    worlds: Array, trials: Array, shape: tuple[int, int], folder: Path, place: str
) -> None:
    """Every trial of every world has to be there."""
    there = set(zip(worlds.tolist(), trials.tolist(), strict=True))
    missing = [key for key in np.ndindex(shape) if key not in there]
    if missing:
        world, trial = missing[0]
        raise InputError(
            f"{folder}: {len(missing)} of {shape[0] * shape[1]} trials are missing, the first is "
            f"{place}world {world}, trial {trial}; finish the run with --resume"
        )


def _portable(value: Any, key: str = "") -> Any:
    """The scenario's values with paths that mean the same on another machine."""
    if isinstance(value, Mapping):
        return {name: _portable(part, name) for name, part in value.items()}
    if isinstance(value, list):
        return [_portable(part, key) for part in value]
    if key not in ("cell", "views") or not value:
        return value
    folder, root = Path(value), data_root()
    if folder == root / "cell":
        return ""  # the shipped one
    return folder.relative_to(root).as_posix() if folder.is_relative_to(root) else folder.name
