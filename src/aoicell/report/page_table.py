"""A table of the page: columns with units, cells with a text to read and a value to sort by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

Value = str | float | int | None


@dataclass(frozen=True)
class Column:
    """A heading with its unit; `digits` decimals for a column of numbers, None for one of text."""

    name: str
    unit: str = ""
    digits: int | None = None


@dataclass(frozen=True)
class Cell:
    """What is read, and for a number what it is sorted by."""

    text: str
    sort_by: str = ""


@dataclass(frozen=True)
class Table:
    """Rows below headings; `id` is its place in the page, `note` a line below it."""

    id: str
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    note: str = ""


def make_table(
    id: str, caption: str, columns: Sequence[Column], rows: Sequence[Sequence[Value]],
    note: str = "",
) -> Table:  # fmt: skip
    """Write every value out as its column asks for."""
    cells = [
        [_cell(value, column) for value, column in zip(row, columns, strict=True)] for row in rows
    ]
    return Table(id, caption, columns, cells, note)


def _cell(value: Value, column: Column) -> Cell:
    if isinstance(value, str):
        return Cell(value)
    if value is None or not np.isfinite(value):
        return Cell("–")
    return Cell(number(value, column.digits or 0), repr(float(value)))


def number(value: float | None, digits: int) -> str:
    """With a true minus, and without one where the digits show nothing but zeros."""
    if value is None or not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0 else text.replace("-", "−")
