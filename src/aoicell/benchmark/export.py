"""A run's store as tables for other programs: CSV and Parquet."""

import csv
from pathlib import Path
from typing import Literal

import numpy as np

from aoicell.benchmark.store import OF_INSPECTIONS, TABLES, Columns, RunStore
from aoicell.errors import InputError

Format = Literal["csv", "parquet"]


def export(store: RunStore, folder: Path, format: Format) -> list[Path]:
    """Write `trials`, `views` and `markers` into a folder.

    One row a trial and method, one a view of them, one a marker in a view. Of a run that inspects
    also `boards`, `parts` (planted defects and false calls) and `registrations`. Raises InputError
    when the package for Parquet is missing, or when an older version made the run.
    """
    write = {"csv": _write_csv, "parquet": _write_parquet}[format]
    idle = () if store.scenario().inspect else OF_INSPECTIONS
    tables = {name: store.columns(name) for name in TABLES if name not in idle}
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, columns in tables.items():
        written.append(folder / f"{name}.{format}")
        write(written[-1], columns)
    return written


def _write_csv(path: Path, columns: Columns) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            writer.writerow("" if value != value else value for value in row)  # no number: empty


def _write_parquet(path: Path, columns: Columns) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(
            "Parquet needs the package pyarrow; type: pip install 'aoicell[parquet]'"
        ) from None
    arrays = {
        name: pyarrow.array(column, mask=np.isnan(column) if column.dtype.kind == "f" else None)
        for name, column in columns.items()
    }
    parquet.write_table(pyarrow.table(arrays), path)
