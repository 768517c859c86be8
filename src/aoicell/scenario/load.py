"""Reading a scenario file, and its schema for editors."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from aoicell.errors import ScenarioError, shown
from aoicell.scenario.cases import cases_of
from aoicell.scenario.complaints import dotted, explain
from aoicell.scenario.model import Scenario
from aoicell.toml_table import read_toml


def load_scenario(path: Path, **overrides: Any) -> Scenario:
    """Read and check a scenario with all its cases; `overrides` that are not None replace keys.

    `cell` may be a path relative to the file. Raises ScenarioError.
    """
    values = read_toml(path, "no such scenario file", ScenarioError)
    try:
        _override(values, {key: value for key, value in overrides.items() if value is not None})
        _find_cells(path.parent, values)
        scenario = Scenario(**values)
        cases_of(scenario)
    except ValidationError as error:
        raise ScenarioError(f"{path}: {explain(error, Scenario)}") from None
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from None
    return scenario


def scenario_schema() -> dict[str, Any]:
    """The JSON schema of a scenario file, for editors that complete and check TOML."""
    schema = Scenario.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _override(values: dict[str, Any], overrides: dict[str, Any]) -> None:
    sweep = values.get("sweep")
    for key, value in overrides.items():
        if isinstance(sweep, dict) and key in sweep:
            raise ScenarioError(
                f"'{key}' = {shown(value)}: it would replace nothing, for 'sweep.{key}' gives the "
                "values; change them there"
            )
        values[key] = value


def _find_cells(base: Path, values: dict[str, Any]) -> None:
    """Make the folders of cells absolute, those of a sweep and of cases, too.

    What is no text is left to the complaints about types; "" is the shipped cell.
    """
    tables: list[tuple[list[str], dict[str, Any]]] = [([], values)]
    cases = values.get("cases")
    for name, case in cases.items() if isinstance(cases, dict) else ():
        if isinstance(case, dict):
            tables.append((["cases", name], case))
    for place, table in tables:
        if isinstance(table.get("cell"), str):
            table["cell"] = _folder(base, table["cell"], dotted([*place, "cell"]))
    sweep = values.get("sweep")
    if isinstance(sweep, dict) and isinstance(sweep.get("cell"), list):
        sweep["cell"] = [
            _folder(base, cell, f"sweep.cell.{index}") if isinstance(cell, str) else cell
            for index, cell in enumerate(sweep["cell"])
        ]


def _folder(base: Path, cell: str, key: str) -> str:
    if not cell:
        return cell
    try:
        folder = (base / cell).resolve()
        known = (folder / "nominal.toml").is_file()
    except (OSError, ValueError, RuntimeError):  # no path at all; links that go round
        known = False
    if not known:
        raise ScenarioError(
            f"'{key}' = {shown(cell)}: there is no nominal.toml in it; "
            f"name a cell's folder, relative to {base}"
        )
    return str(folder)
