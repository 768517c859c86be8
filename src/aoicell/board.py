"""The designed board: its components, its markers, and the checks that make a folder one.

A folder holds `board.toml` (outline, colour, markers) and the component list that it names.
Frame `board`: origin at the centre of the PCB's top surface, z up. Metres and radians.
"""

from __future__ import annotations

import csv
import math
import re
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aoicell.errors import InputError, ModelError, did_you_mean

KINDS = (
    "socket heatsink dimm_slot dimm_module chip connector capacitor resistor inductor screw label"
    " crystal battery led"
).split()
MARKER_KINDS = ("cross",)
MARKER_ROLES = ("positioning", "measuring")
COLUMNS = ("id kind x_mm y_mm rotation_deg width_mm depth_mm height_mm label on").split()
REAR_OVERHANG = 0.005  # how far a connector may stand out over the rear (+y) edge
MARKER_CLEARANCE = 0.002
MAX_HEIGHT = 0.060
MAX_SIDE = 1.0  # no board or part of one that this project inspects is larger
_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Component:
    """One part; `x, y` is the footprint's centre, `z` its underside above the board's surface."""

    id: str
    kind: str
    x: float
    y: float
    z: float
    rotation: float
    width: float
    depth: float
    height: float
    label: str
    on: str = ""

    @property
    def footprint(self) -> NDArray[np.float64]:
        """The four corners in the board's plane, (4, 2), anticlockwise."""
        return _rectangle(self.x, self.y, self.rotation, self.width, self.depth)

    @property
    def top(self) -> float:
        """Height of the upper side above the board's surface."""
        return self.z + self.height


@dataclass(frozen=True)
class MarkerDesign:
    """A printed plate; `x, y, z` is the centre of its face, `pitch` the distance of its crosses."""

    id: str
    kind: str
    x: float
    y: float
    z: float
    rotation: float
    size: float
    pitch: float
    role: str


@dataclass(frozen=True)
class BoardDesign:
    """The whole board; `size` is (x, y, thickness), `colour` the solder mask's RGB in 0..1."""

    name: str
    size: tuple[float, float, float]
    colour: tuple[float, float, float]
    components: tuple[Component, ...]
    markers: tuple[MarkerDesign, ...]

    def component(self, id: str) -> Component:
        """The component of that id; raises InputError with the nearest id when there is none."""
        for component in self.components:
            if component.id == id:
                return component
        hint = did_you_mean(id, (c.id for c in self.components))
        raise InputError(f"board {self.name}: there is no component {id!r}; {hint}")


def load_board(folder: Path) -> BoardDesign:
    """Read and check a board's folder; raises ModelError that names file, place and value."""
    path = Path(folder) / "board.toml"
    table = _read_toml(path)
    size = _three(path, table, "size_mm", 0.1, MAX_SIDE * 1e3)
    colour = _three(path, table, "colour", 0, 1)
    markers = tuple(_marker(path, n, m) for n, m in enumerate(table.get("marker", []), start=1))
    csv_path = path.parent / _text(path, "", table, "components")
    rows = _read_rows(csv_path)
    board = BoardDesign(
        name=_text(path, "", table, "name"),
        size=(size[0] / 1e3, size[1] / 1e3, size[2] / 1e3),
        colour=colour,
        components=_stack(csv_path, rows),
        markers=markers,
    )
    _check_markers(path, board)
    _check_layout(csv_path, board, {c.id: line for line, c in rows})
    return board


# ---- board.toml --------------------------------------------------------------------------------


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ModelError(f"{path}: the file is missing; a board's folder needs one") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ModelError(f"{path}: not a TOML file: {error}") from None


def _text(path: Path, place: str, table: dict[str, Any], key: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value:
        raise ModelError(f"{path}{place}: {key} = {value!r}; give a text")
    return value


def _three(
    path: Path, table: dict[str, Any], key: str, low: float, high: float
) -> tuple[float, float, float]:
    value = table.get(key)
    numbers = isinstance(value, list) and all(type(v) in (int, float) for v in value)
    if not numbers or len(value or []) != 3 or not all(low <= v <= high for v in value or []):
        raise ModelError(f"{path}: {key} = {value!r}; give three numbers from {low:g} to {high:g}")
    x, y, z = value or []
    return float(x), float(y), float(z)


def _marker(path: Path, number: int, table: dict[str, Any]) -> MarkerDesign:
    place = f", marker {number} ({table.get('id', 'without id')})"

    def number_of(key: str, low: float, high: float) -> float:
        value = table.get(key)
        if type(value) not in (int, float) or not low <= float(value or 0) <= high:
            raise ModelError(f"{path}{place}: {key} = {value!r}; give {low:g} to {high:g}")
        return float(value or 0)

    def one_of(key: str, choices: Iterable[str]) -> str:
        value = _text(path, place, table, key)
        if value not in choices:
            raise ModelError(f"{path}{place}: {key} = {value!r}; {did_you_mean(value, choices)}")
        return value

    reach = MAX_SIDE * 1e3
    size_mm = number_of("size_mm", 1, reach)
    return MarkerDesign(
        id=_text(path, place, table, "id"),
        kind=one_of("kind", MARKER_KINDS),
        x=number_of("x_mm", -reach, reach) / 1e3,
        y=number_of("y_mm", -reach, reach) / 1e3,
        z=number_of("z_mm", 0, MAX_HEIGHT * 1e3) / 1e3,
        rotation=math.radians(number_of("rotation_deg", -360, 360)),
        size=size_mm / 1e3,
        pitch=number_of("pitch_mm", 0.1, size_mm) / 1e3,
        role=one_of("role", MARKER_ROLES),
    )


# ---- components.csv ----------------------------------------------------------------------------


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
    except FileNotFoundError:
        raise ModelError(f"{path}: the file that board.toml names is missing") from None
    except (csv.Error, UnicodeDecodeError) as error:
        raise ModelError(f"{path}: not a CSV file in UTF-8: {error}") from None


def _row(path: Path, line: int, row: dict[str, Any]) -> Component:
    if None in row or None in row.values():
        raise ModelError(f"{path}, line {line}: give exactly {len(COLUMNS)} values")

    def number(column: str, low: float, high: float) -> float:
        place = f"{path}, line {line}, column {column}: {row[column]!r}"
        try:
            value = float(row[column])
        except ValueError:
            raise ModelError(f"{place} is not a number") from None
        if not low <= value <= high:
            raise ModelError(f"{place} is out of range; give {low:g} to {high:g}")
        return value

    if not re.fullmatch(r"\w[\w.-]*", row["id"]):
        raise ModelError(
            f"{path}, line {line}, column id: {row['id']!r}; give a name of letters and digits"
        )
    if row["kind"] not in KINDS:
        raise ModelError(
            f"{path}, line {line}, column kind: {row['kind']!r}; {did_you_mean(row['kind'], KINDS)}"
        )
    reach = MAX_SIDE * 1e3
    return Component(
        id=row["id"],
        kind=row["kind"],
        x=number("x_mm", -reach, reach) / 1e3,
        y=number("y_mm", -reach, reach) / 1e3,
        z=0.0,
        rotation=math.radians(number("rotation_deg", -360, 360)),
        width=number("width_mm", 0.1, reach) / 1e3,
        depth=number("depth_mm", 0.1, reach) / 1e3,
        height=number("height_mm", 0.05, MAX_HEIGHT * 1e3) / 1e3,
        label=row["label"],
        on=row["on"],
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
            raise ModelError(f"{place} makes {component.id} stand on itself")
        parent = by_id[component.on]
        return parent.height + base(line, parent, (*seen, parent.id))

    return tuple(Component(**{**vars(c), "z": base(line, c, (c.id,))}) for line, c in rows)


# ---- the layout --------------------------------------------------------------------------------


def _check_markers(path: Path, board: BoardDesign) -> None:
    seen = {c.id for c in board.components}
    for number, marker in enumerate(board.markers, start=1):
        place = f"{path}, marker {number}"
        if marker.id in seen:
            raise ModelError(f"{place}: id = {marker.id!r} is there already; give it its own")
        seen.add(marker.id)
        plate = _rectangle(marker.x, marker.y, marker.rotation, marker.size, marker.size)
        half = np.array(board.size[:2]) / 2 + _TOLERANCE
        if np.any(np.abs(plate) > half):
            raise ModelError(
                f"{place}: {marker.id} at x_mm = {marker.x * 1e3:g}, y_mm = {marker.y * 1e3:g}"
                f" leaves the outline of {_outline(board)}"
            )


def _check_layout(path: Path, board: BoardDesign, lines: dict[str, int]) -> None:
    """Every footprint inside the outline, clear of the markers and of every other footprint."""
    parents = {c.id: c.on for c in board.components}
    half_x, half_y = board.size[0] / 2 + _TOLERANCE, board.size[1] / 2 + _TOLERANCE
    plates = [
        (m.id, _rectangle(m.x, m.y, m.rotation, m.size, m.size, MARKER_CLEARANCE))
        for m in board.markers
    ]
    done: list[tuple[Component, NDArray[np.float64]]] = []
    for component in board.components:
        place = f"{path}, line {lines[component.id]}: {component.id}"
        corners = component.footprint
        rear = half_y + (REAR_OVERHANG if component.kind == "connector" else 0.0)
        low, high = corners.min(axis=0), corners.max(axis=0)
        if low[0] < -half_x or high[0] > half_x or low[1] < -half_y or high[1] > rear:
            raise ModelError(
                f"{place} at x_mm = {component.x * 1e3:g}, y_mm = {component.y * 1e3:g}"
                f" leaves the outline of {_outline(board)}"
            )
        for marker_id, plate in plates:
            if rectangles_overlap(corners, plate):
                raise ModelError(
                    f"{place} is nearer than {MARKER_CLEARANCE * 1e3:g} mm to marker {marker_id}"
                )
        for other, other_corners in done:
            if rectangles_overlap(corners, other_corners) and not _stacked(
                component.id, other.id, parents.__getitem__
            ):
                raise ModelError(
                    f"{place} overlaps {other.id} (line {lines[other.id]}); move one, or name"
                    " in column on what it stands on"
                )
        done.append((component, corners))


def _stacked(a: str, b: str, parent_of: Callable[[str], str]) -> bool:
    """Whether one of the two stands, directly or not, on the other."""

    def stands_on(upper: str, lower: str) -> bool:
        while upper := parent_of(upper):
            if upper == lower:
                return True
        return False

    return stands_on(a, b) or stands_on(b, a)


def rectangles_overlap(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether two rectangles, (4, 2) corners each, share area; touching edges do not count."""
    for corners in (a, b):  # separating axes: the two edge directions of each
        for edge in (corners[1] - corners[0], corners[3] - corners[0]):
            axis = edge / np.hypot(*edge)
            on_a, on_b = a @ axis, b @ axis
            if on_a.max() <= on_b.min() + _TOLERANCE or on_b.max() <= on_a.min() + _TOLERANCE:
                return False
    return True


def _rectangle(
    x: float, y: float, rotation: float, width: float, depth: float, margin: float = 0.0
) -> NDArray[np.float64]:
    half = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (
        [width / 2 + margin, depth / 2 + margin]
    )
    c, s = math.cos(rotation), math.sin(rotation)
    corners: NDArray[np.float64] = half @ np.array([[c, s], [-s, c]]) + [x, y]
    return corners


def _outline(board: BoardDesign) -> str:
    return f"{board.size[0] * 1e3:g} x {board.size[1] * 1e3:g} mm"
