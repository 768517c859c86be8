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

    `cell` and `views` may be paths relative to the file. Raises ScenarioError.
    """
    values = read_toml(path, "no such scenario file", ScenarioError)
    try:
        _override(values, {key: value for key, value in overrides.items() if value is not None})
        _find_paths(path.parent, values)
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


def _find_paths(base: Path, values: dict[str, Any]) -> None:
    """Make the paths of cells and views absolute, those of a sweep and of cases, too.

    What is no text is left to the complaints about types; "" stays for what is shipped.
    """
    tables: list[tuple[list[str], dict[str, Any]]] = [([], values)]
    cases, sweep = values.get("cases"), values.get("sweep")
    for name, case in cases.items() if isinstance(cases, dict) else ():
        if isinstance(case, dict):
            tables.append((["cases", name], case))
    for key, find in (("cell", _folder), ("views", _file)):
        for place, table in tables:
            if isinstance(table.get(key), str):
                table[key] = find(base, table[key], dotted([*place, key]))
        if isinstance(sweep, dict) and isinstance(sweep.get(key), list):
            sweep[key] = [
                find(base, path, f"sweep.{key}.{index}") if isinstance(path, str) else path
                for index, path in enumerate(sweep[key])
            ]


def _folder(base: Path, cell: str, key: str) -> str:
    return _existing(
        base, cell, "nominal.toml",
        f"'{key}' = {shown(cell)}: there is no nominal.toml in it; "
        f"name a cell's folder, relative to {base}",
    )  # fmt: skip


def _file(base: Path, views: str, key: str) -> str:
    return _existing(
        base, views, "",
        f"'{key}' = {shown(views)}: there is no such file; "
        f"name a file of views, relative to {base}",
    )  # fmt: skip


def _existing(base: Path, path: str, inside: str, complaint: str) -> str:
    if not path:
        return path
    try:
        found = (base / path).resolve()
        known = (found / inside).is_file()
    except (OSError, ValueError, RuntimeError):  # no path at all; links that go round
        known = False
    if not known:
        raise ScenarioError(complaint)
    return str(found)
