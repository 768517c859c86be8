"""Reads a board's folder: `board.toml` and the component list that it names."""

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.board.design import (
    KINDS,
    MARKER_ROLES,
    BoardDesign,
    Component,
    MarkerDesign,
    Tolerance,
)
from aoicell.board.layout import check_components, check_markers
from aoicell.errors import ModelError, did_you_mean
from aoicell.targets.marker import find_kind, marker_kinds
from aoicell.toml_table import TomlTable
from aoicell.transforms import Array

COLUMNS = ("id kind x_mm y_mm rotation_deg width_mm depth_mm height_mm label on").split()
TOLERANCE = "tolerance"  # one more column, which a list need not have
MAX_TOLERANCE_MM = 50.0
MAX_HEIGHT_MM = 60.0
MAX_SIDE_MM = 1000.0  # no board or part of one that this project inspects is larger


def load_board(folder: Path) -> BoardDesign:
    """Read and check a board's folder; raises ModelError that names file, place and value."""
    path = Path(folder) / "board.toml"
    table = TomlTable.read(path)
    size_mm = _within(table, "size_mm", 0.1, MAX_SIDE_MM, count=3)
    red, green, blue = _within(table, "colour", 0, 1, count=3)
    markers = table.each("marker") if "marker" in table.values else []
    tolerances = _tolerances(table)
    csv_path = path.parent / table.text("components")
    rows = _read_rows(csv_path)
    _check_tolerances(csv_path, rows, tolerances)
    board = BoardDesign(
        name=table.text("name"),
        size=(size_mm[0] / 1e3, size_mm[1] / 1e3, size_mm[2] / 1e3),
        colour=(red, green, blue),
        components=_stack(csv_path, rows),
        markers=tuple(map(_marker, markers)),
        tolerances=tolerances,
    )
    check_markers(path, board)
    check_components(csv_path, board, {c.id: line for line, c in rows})
    return board


# ---- board.toml --------------------------------------------------------------------------------


def _marker(table: TomlTable) -> MarkerDesign:
    def number(key: str, low: float, high: float) -> float:
        return float(_within(table, key, low, high, count=1)[0])

    size_mm = number("size_mm", 1, MAX_SIDE_MM)
    kind = _one_of(table, "kind", marker_kinds())
    codes = find_kind(kind).codes
    return MarkerDesign(
        id=table.text("id"),
        kind=kind,
        x=number("x_mm", -MAX_SIDE_MM, MAX_SIDE_MM) / 1e3,
        y=number("y_mm", -MAX_SIDE_MM, MAX_SIDE_MM) / 1e3,
        z=number("z_mm", 0, MAX_HEIGHT_MM) / 1e3,
        rotation=math.radians(number("rotation_deg", -360, 360)),
        size=size_mm / 1e3,
        pitch=number("pitch_mm", 0.1, size_mm) / 1e3,
        role=_one_of(table, "role", MARKER_ROLES),
        code=_one_of(table, "code", codes) if "code" in table.values else codes[0],
    )


def _tolerances(table: TomlTable) -> dict[str, Tolerance]:
    """The tolerance classes, `[tolerance.<name>]`, by name."""
    if TOLERANCE not in table.values:
        return {}
    classes = table.sub(TOLERANCE)
    if not isinstance(classes.values, Mapping):
        raise table.complaint(TOLERANCE, wanted=f"tables, [{TOLERANCE}.<name>]")
    return {name: _tolerance(classes.sub(name)) for name in classes.values}


def _tolerance(table: TomlTable) -> Tolerance:
    shift_mm = _within(table, "shift_mm", 0.001, MAX_TOLERANCE_MM, count=1)[0]
    rotation_deg = _within(table, "rotation_deg", 0.01, 180, count=1)[0]
    return Tolerance(float(shift_mm) / 1e3, math.radians(rotation_deg))


def _within(table: TomlTable, key: str, low: float, high: float, count: int) -> Array:
    numbers = table.numbers(key, count=count)
    if np.any(numbers < low) or np.any(numbers > high):
        what = "a number" if count == 1 else f"{count} numbers"
        raise table.complaint(key, wanted=f"{what} from {low:g} to {high:g}")
    return numbers


def _one_of(table: TomlTable, key: str, choices: Iterable[str]) -> str:
    value = table.text(key)
    if value not in choices:
        raise table.complaint(key, wanted=" or ".join(map(repr, choices)))
    return value


# ---- the component list ------------------------------------------------------------------------


def _read_rows(path: Path) -> list[tuple[int, Component]]:
    """(line number, component with z = 0) for every row."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [c for c in COLUMNS if c not in (reader.fieldnames or [])]
            if missing:
                raise ModelError(
                    f"{path}, line 1: column {missing[0]!r} is missing; the header is"
                    f" {','.join(COLUMNS)}"
                )
            return [(reader.line_num, _row(path, reader.line_num, row)) for row in reader]
    except OSError:
        raise ModelError(f"{path}: no such file; board.toml names it as the components") from None
    except (csv.Error, UnicodeDecodeError) as error:
        raise ModelError(f"{path}: not a CSV file in UTF-8: {error}") from None


def _row(path: Path, line: int, row: dict[str, Any]) -> Component:
    if None in row or None in row.values():
        count = len(COLUMNS) + (TOLERANCE in row)
        raise ModelError(f"{path}, line {line}: give exactly {count} values")

    def place(column: str) -> str:
        return f"{path}, line {line}, column {column}: {row[column]!r}"

    def number(column: str, low: float, high: float) -> float:
        try:
            value = float(row[column])
        except ValueError:
            raise ModelError(f"{place(column)} is not a number") from None
        if not low <= value <= high:
            raise ModelError(f"{place(column)} is out of range; give {low:g} to {high:g}")
        return value

    if not re.fullmatch(r"\w[\w.-]*", row["id"]):
        raise ModelError(f"{place('id')} is no id; give a name of letters and digits")
    if row["kind"] not in KINDS:
        raise ModelError(f"{place('kind')} is no kind; {did_you_mean(row['kind'], KINDS)}")
    return Component(
        id=row["id"],
        kind=row["kind"],
        x=number("x_mm", -MAX_SIDE_MM, MAX_SIDE_MM) / 1e3,
        y=number("y_mm", -MAX_SIDE_MM, MAX_SIDE_MM) / 1e3,
        z=0.0,
        rotation=math.radians(number("rotation_deg", -360, 360)),
        width=number("width_mm", 0.1, MAX_SIDE_MM) / 1e3,
        depth=number("depth_mm", 0.1, MAX_SIDE_MM) / 1e3,
        height=number("height_mm", 0.05, MAX_HEIGHT_MM) / 1e3,
        label=row["label"],
        on=row["on"],
        tolerance=row.get(TOLERANCE, ""),
    )


def _check_tolerances(
    path: Path, rows: Iterable[tuple[int, Component]], known: Mapping[str, Tolerance]
) -> None:
    for line, component in rows:
        if component.tolerance and component.tolerance not in known:
            raise ModelError(
                f"{path}, line {line}, column {TOLERANCE}: {component.tolerance!r} is no class of "
                f"board.toml; {did_you_mean(component.tolerance, known)}"
            )


def _stack(path: Path, rows: list[tuple[int, Component]]) -> tuple[Component, ...]:
    """The components with their heights: each stands on its parent, which may come later."""
    by_id: dict[str, Component] = {}
    for line, component in rows:
        if component.id in by_id:
            raise ModelError(
                f"{path}, line {line}, column id: {component.id!r} is there already; "
                "give every component its own id"
            )
        by_id[component.id] = component

    def base(line: int, component: Component, seen: tuple[str, ...]) -> float:
        if not component.on:
            return 0.0
        place = f"{path}, line {line}, column on: {component.on!r}"
        if component.on not in by_id:
            raise ModelError(f"{place} is no component; {did_you_mean(component.on, by_id)}")
        if component.on in seen:
            raise ModelError(f"{place} makes {component.id} stand on itself; name what carries it")
        parent = by_id[component.on]
        return parent.height + base(line, parent, (*seen, parent.id))

    return tuple(replace(c, z=base(line, c, (c.id,))) for line, c in rows)
