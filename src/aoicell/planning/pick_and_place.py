"""Targets from a pick-and-place list: designator, place, rotation, side and package of each part.

Units are never guessed: they stand in the header (`x_mm`, `Center-X(mm)`) or are stated apart.
Every line that is wrong is reported, not only the first.
"""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from aoicell.board.design import rectangle
from aoicell.errors import InputError
from aoicell.planning.heights import HeightField
from aoicell.planning.targets import Feature
from aoicell.transforms import Array

LENGTH_UNITS = {"mm": 1e-3, "m": 1.0, "mil": 25.4e-6, "in": 25.4e-3}
NAMES: Mapping[str, tuple[str, ...]] = {
    "designator": ("designator", "refdes", "ref", "reference", "id"),
    "x": ("x", "posx", "midx", "centerx", "refx"),
    "y": ("y", "posy", "midy", "centery", "refy"),
    "rotation": ("rotation", "rot", "angle"),
    "side": ("side", "layer", "tb"),
    "package": ("package", "footprint", "pattern"),
    "width": ("width",),
    "depth": ("depth", "length"),
}
TOP_SIDE = ("top", "t", "toplayer", "f.cu", "front")
BOTTOM_SIDE = ("bottom", "b", "bot", "bottomlayer", "b.cu", "back")

# Bodies by EIA size code, in mm: the code is the size in hundredths of an inch, rounded.
EIA_MM = {
    "0201": (0.6, 0.3), "0402": (1.0, 0.5), "0603": (1.6, 0.8), "0805": (2.0, 1.25),
    "1206": (3.2, 1.6), "1210": (3.2, 2.5), "1812": (4.5, 3.2), "2010": (5.0, 2.5),
    "2512": (6.3, 3.2),
}  # fmt: skip
POINT = 2e-3  # side of the square that is looked at where no size is known (m)
_ACROSS = 3  # samples along each side of a target


@dataclass(frozen=True)
class Placement:
    """One line of a list: m and rad in the frame `board`; `size` is (width, depth)."""

    designator: str
    x: float
    y: float
    rotation: float
    package: str
    size: tuple[float, float]
    line: int


def read_placements(path: Path, unit: str | None = None) -> list[Placement]:
    """Read a list; raises InputError with all that is wrong with its lines.

    `unit` is that of lengths whose header names none.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            rows = [(reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except OSError:
        raise InputError(f"{path}: no such file; --targets names a list of placements") from None
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a CSV file in UTF-8: {error}") from None
    if not rows:
        raise InputError(f"{path}: is empty; the header is designator,x_mm,y_mm,rotation_deg,side")
    columns = _columns(path, rows[0][1], unit)
    found: list[Placement] = []
    wrong: list[str] = []
    lines: dict[str, int] = {}
    for number, row in rows[1:]:
        placement, complaints = _placement(number, row, columns)
        if placement is not None and placement.designator in lines:
            first = lines[placement.designator]
            complaints = [f"{placement.designator!r} is there already, in line {first}"]
        if complaints or placement is None:
            wrong.append(f"line {number}: {'; '.join(complaints)}")
            continue
        lines[placement.designator] = number
        found.append(placement)
    raise_all(path, wrong)
    if not found:
        raise InputError(f"{path}: names no target; give a line for each")
    return found


def raise_all(path: Path, wrong: Sequence[str]) -> None:
    """Raise InputError with one line for each complaint; do nothing where there is none."""
    if wrong:
        count = "1 line is" if len(wrong) == 1 else f"{len(wrong)} lines are"
        raise InputError("\n  ".join([f"{path}: {count} wrong", *wrong]))


def placement_features(
    path: Path, placements: Sequence[Placement], field: HeightField
) -> list[Feature]:
    """What must be seen of each placement: its body's outline, as high as what is there.

    Raises InputError with every line whose target is not on the board.
    """
    features, wrong = [], []
    for p in placements:
        flat = _samples(p)
        heights = field.at(flat)
        if not np.isfinite(heights).any():  # its very centre a scan may not have seen
            wrong.append(
                f"line {p.line}: {p.designator} at ({p.x * 1e3:g}, {p.y * 1e3:g}) mm is not on "
                "the board; the origin is its centre"
            )
            continue
        top = float(np.nanmedian(heights))
        points = np.column_stack([flat, np.where(np.isfinite(heights), heights, top)])
        outline = rectangle(p.x, p.y, p.rotation, *p.size)
        corners = np.column_stack([outline, np.full(4, top)])
        features.append(Feature(p.designator, p.package or "target", "top", points, corners))
    raise_all(path, wrong)
    return features


def _samples(p: Placement) -> Array:
    width, depth = p.size
    shares = (np.arange(_ACROSS) + 0.5) / _ACROSS - 0.5
    c, s = math.cos(p.rotation), math.sin(p.rotation)
    own = [(a * width, b * depth) for a in shares for b in shares]
    return np.array([(p.x + c * x - s * y, p.y + s * x + c * y) for x, y in own])


# ---- header and lines --------------------------------------------------------------------------


@dataclass(frozen=True)
class _Column:
    index: int
    title: str
    factor: float = 1.0  # to SI


def _columns(path: Path, header: Sequence[str], unit: str | None) -> dict[str, _Column]:
    """Where each quantity stands, and in which unit."""
    found: dict[str, _Column] = {}
    for index, title in enumerate(header):
        text = title.strip().lower()
        said = re.search(r"[_ (\[](mm|mil|in|m|deg)[)\]]?$", text)
        plain = re.sub(r"[^a-z]", "", text[: said.start()] if said else text)
        name = next((n for n, names in NAMES.items() if plain in names), None)
        if name is None:
            continue
        factor = 1.0
        if name in ("x", "y", "width", "depth"):
            own = said[1] if said else unit
            if own not in LENGTH_UNITS:
                raise InputError(
                    f"{path}, line 1: column {title.strip()!r} says no unit; name it {plain}_mm, "
                    f"or say --unit with one of {', '.join(LENGTH_UNITS)}"
                )
            factor = LENGTH_UNITS[own]
        found[name] = _Column(index, title.strip(), factor)
    missing = [name for name in ("designator", "x", "y") if name not in found]
    if missing:
        raise InputError(
            f"{path}, line 1: there is no column for {' and '.join(missing)}; the header is "
            "designator,x_mm,y_mm,rotation_deg,side,package"
        )
    return found


def _placement(
    line: int, row: Sequence[str], columns: Mapping[str, _Column]
) -> tuple[Placement | None, list[str]]:
    """The placement of a line, or all that is wrong with it."""
    wrong: list[str] = []

    def text(name: str) -> str:
        column = columns.get(name)
        return row[column.index].strip() if column and column.index < len(row) else ""

    def number(name: str, needed: bool) -> float | None:
        value = text(name)
        if not value and not needed:
            return None
        try:
            parsed = float(value)
        except ValueError:
            parsed = math.nan
        if not math.isfinite(parsed):
            wrong.append(f"column {columns[name].title}: {value!r} is not a number")
            return None
        return parsed * columns[name].factor

    designator = text("designator")
    if not designator:
        wrong.append("it has no designator")
    x, y, degrees = number("x", True), number("y", True), number("rotation", False)
    wrong += _side(designator, text("side"))
    width, depth = number("width", False), number("depth", False)
    if (width is not None and width <= 0) or (depth is not None and depth <= 0):
        wrong.append("its size is not above 0")
    if wrong or x is None or y is None:
        return None, wrong
    size = (width, depth) if width and depth else package_size(text("package"))
    rotation = math.radians(degrees or 0.0)
    return Placement(designator, x, y, rotation, text("package"), size, line), []


def _side(designator: str, side: str) -> list[str]:
    plain = re.sub(r"[^a-z.]", "", side.lower())
    if not plain or plain in TOP_SIDE:
        return []
    if plain in BOTTOM_SIDE:
        return [f"{designator} is on the underside, which lies on the table; leave it out"]
    return [f"side {side!r} is neither 'top' nor 'bottom'"]


def package_size(package: str) -> tuple[float, float]:
    """Width and depth (m) that a package's name tells: an EIA code, or '5x6mm'; else a point."""
    measured = re.search(r"(\d+(?:\.\d+)?)\s*x\s*(\d+(?:\.\d+)?)\s*mm", package, re.IGNORECASE)
    if measured:
        return float(measured[1]) / 1e3, float(measured[2]) / 1e3
    code = re.search(r"(?<!\d)(" + "|".join(EIA_MM) + r")(?!\d)", package)
    if code:
        width, depth = EIA_MM[code[1]]
        return width / 1e3, depth / 1e3
    return POINT, POINT
