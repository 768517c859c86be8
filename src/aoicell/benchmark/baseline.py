"""A baseline: a snapshot of a run as a small JSON file.

The scenario stands in it as a whole and not as a hash: what differs can then be named, and a
key that a later version adds takes its default.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from aoicell.benchmark.snapshot import DECIMALS, MethodTrials, Snapshot
from aoicell.errors import InputError, ScenarioError
from aoicell.scenario import Scenario, cases_of
from aoicell.transforms import Array

SCHEMA = 1
_LETTERS = {"corrected": "c", "refused": "r", "failed": "f"}


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, protected_namespaces=())


_Numbers = list[Annotated[float, Field(allow_inf_nan=False)] | None]


class _Method(_Strict):
    """One letter and one number of each quantity a trial, world by world."""

    case: int
    method: str
    outcomes: Annotated[str, Field(pattern="^[crf]+$")]
    x_mm: _Numbers
    y_mm: _Numbers
    z_mm: _Numbers
    residual_mm: _Numbers
    detected_px: _Numbers
    unwarned_mm: _Numbers


class _File(_Strict):
    format: Literal[1] = Field(alias="schema")
    scenario: dict[str, Any]
    environment: dict[str, Any]
    trials: list[_Method]


def write_baseline(path: Path, taken: Snapshot) -> int:
    """Write the file and return its size in bytes. Raises InputError where none can be."""
    text = "\n".join(_lines(taken)) + "\n"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"{path}: no baseline can be written here ({error.strerror}); name another file with "
            "--baseline"
        ) from None
    return len(text.encode())


def _lines(taken: Snapshot) -> Iterator[str]:
    """One line a column, so that a changed baseline reads well as a difference of text."""
    yield f'{{"schema": {SCHEMA},'
    yield f'"scenario": {json.dumps(taken.scenario.model_dump())},'
    yield f'"environment": {json.dumps(taken.environment)},'
    separator = '"trials": ['
    for (case, method), trials in taken.trials.items():
        letters = "".join(_LETTERS[outcome] for outcome in trials.outcome.ravel().tolist())
        yield f'{separator}{{"case": {case}, "method": {json.dumps(method)},'
        yield f'"outcomes": "{letters}"' + "".join(
            f',\n"{name}": {_compact(values)}' for name, values in trials.values.items()
        )
        separator = "}, "
    yield "}]}"


def _compact(values: Array) -> str:
    numbers = [None if np.isnan(value) else value for value in values.ravel().tolist()]
    return json.dumps(numbers, separators=(",", ":"))


def read_baseline(path: Path) -> Snapshot:
    """Read a baseline. Raises InputError that names the file and what is wrong with it."""
    again = "write it anew with --update"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such baseline; write it with --update") from None
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: not a readable baseline ({error}); {again}") from None
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema != SCHEMA:
        raise InputError(
            f"{path}: its schema is {json.dumps(schema)}, this version reads {SCHEMA}; {again}"
        )
    try:
        file = _File.model_validate(content)
        scenario = Scenario(**file.scenario)
        return Snapshot(str(path), scenario, file.environment, _trials(file, scenario))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(f"{path}: '{place}': {first['msg']}; {again}") from None
    except (ValueError, ScenarioError) as error:
        raise InputError(f"{path}: {error}; {again}") from None


def _trials(file: _File, scenario: Scenario) -> dict[tuple[int, str], MethodTrials]:
    """The columns in their shapes. Raises ValueError where they do not fit the scenario."""
    words = {letter: outcome for outcome, letter in _LETTERS.items()}
    found = {(part.case, part.method): part for part in file.trials}
    trials = {}
    for case in cases_of(scenario):
        shape = case.scenario.worlds, case.scenario.trials_per_world
        for method in scenario.methods:
            part = found.pop((case.index, method), None)
            if part is None:
                raise ValueError(f"case {case.index} has no trials by '{method}'")
            columns = {name: getattr(part, name) for name in DECIMALS}
            for name, column in {"outcomes": part.outcomes, **columns}.items():
                if len(column) != case.scenario.trials:
                    raise ValueError(
                        f"case {case.index}, '{method}': '{name}' has {len(column)} entries for "
                        f"{case.scenario.trials} trials"
                    )
            outcome = np.array([words[letter] for letter in part.outcomes]).reshape(shape)
            values = {name: np.array(c, dtype=float).reshape(shape) for name, c in columns.items()}
            trials[case.index, method] = MethodTrials(outcome, values)
    if found:
        raise ValueError(f"it has trials of {next(iter(found))}, which its scenario does not")
    return trials
