"""The run directory: resolved scenario, trials in SQLite, summary, environment, images.

A trial with all its methods is one transaction in a write-ahead log: a run that is killed at
any moment keeps every trial that it has finished, and no part of another.
"""

import json
import os
import shutil
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from aoicell.benchmark.records import InspectionRecord, TrialRecord, WorldRecord
from aoicell.benchmark.values import (
    OF_BOARDS,
    QUANTITIES,
    board_values,
    marker_values,
    trial_values,
    view_values,
)
from aoicell.errors import InputError
from aoicell.scenario import Scenario, load_scenario

_KEY = "case_index INTEGER, world INTEGER, trial INTEGER, method TEXT"
_VALUES = ", ".join(f"{name} REAL" for name in QUANTITIES)
_SCHEMA = f"""
CREATE TABLE IF NOT EXISTS worlds (
  case_index INTEGER, world INTEGER, record TEXT NOT NULL, PRIMARY KEY (case_index, world));
CREATE TABLE IF NOT EXISTS trials (
  {_KEY}, number INTEGER, seed INTEGER, outcome TEXT, reason TEXT,
  cause TEXT, injected TEXT, displacement_mm REAL,
  turn_deg REAL, measured_shift_mm REAL, correction_seconds REAL, {_VALUES},
  record TEXT NOT NULL,
  PRIMARY KEY (case_index, world, trial, method));
CREATE TABLE IF NOT EXISTS views (
  {_KEY}, view TEXT, {_VALUES},
  PRIMARY KEY (case_index, world, trial, method, view));
CREATE TABLE IF NOT EXISTS markers (
  {_KEY}, view TEXT, marker TEXT, detected_px REAL, true_px REAL, image_mm REAL,
  PRIMARY KEY (case_index, world, trial, method, view, marker));
CREATE TABLE IF NOT EXISTS boards (
  {_KEY}, verdict TEXT, {", ".join(f"{name} REAL" for name in OF_BOARDS)},
  PRIMARY KEY (case_index, world, trial, method));
CREATE TABLE IF NOT EXISTS parts (
  {_KEY}, component TEXT, kind TEXT, planted TEXT, tolerated INTEGER, width_mm REAL, depth_mm REAL,
  shift_mm REAL, rotation_deg REAL, state TEXT, called INTEGER, confidence REAL,
  shift_error_mm REAL, view TEXT,
  PRIMARY KEY (case_index, world, trial, method, component));
CREATE TABLE IF NOT EXISTS registrations (
  {_KEY}, view TEXT, state TEXT, own_px REAL, error_px REAL,
  PRIMARY KEY (case_index, world, trial, method, view));
"""
OF_INSPECTIONS = ("boards", "parts", "registrations")  # empty in a run that does not inspect
TABLES = ("trials", "views", "markers", *OF_INSPECTIONS)
Columns = dict[str, NDArray[Any]]


class RunStore:
    """Writes and reads one run directory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.images = folder / "images"
        self.figures = folder / "figures"
        self._database = folder / "trials.sqlite"

    # -- Writing ------------------------------------------------------------------------------

    def create(self, scenario: Scenario, environment: Mapping[str, Any]) -> None:
        """Start an empty run; what an earlier run left under the same name is replaced.

        Raises InputError when a file stands in the way.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.folder}: no run directory can be made here ({error.strerror}); "
                "name another with --out"
            ) from None
        for old in (self.images, self.figures):
            shutil.rmtree(old, ignore_errors=True)
        for name in ("summary.json", "report.html", "budget.json"):
            (self.folder / name).unlink(missing_ok=True)
        for suffix in ("", "-wal", "-shm"):
            Path(f"{self._database}{suffix}").unlink(missing_ok=True)
        with closing(connected(self._database)) as connection:
            connection.executescript(_SCHEMA)
        self.write_json("environment.json", environment)
        write_whole(self.folder / "scenario.toml", scenario.to_toml().encode())

    @contextmanager
    def writing(self) -> Iterator["TrialWriter"]:
        """One connection for all that a run adds.

        Raises InputError where another version's tables are in the way.
        """
        self.refuse_other_versions()
        with closing(connected(self._database)) as connection:
            yield TrialWriter(connection)

    def write_json(self, name: str, values: Mapping[str, Any]) -> None:
        """A JSON file of the run directory."""
        write_whole(self.folder / name, (json.dumps(values, indent=2) + "\n").encode())

    def add_image(self, path: Path, png: bytes) -> None:
        """Keep an encoded picture."""
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, png)

    def image_path(
        self, world: int, view: str, trial: int | None = None, method: str = "", case: int = 0
    ) -> Path:
        """Where a standard image (no trial) or a new image lies."""
        what = "standard" if trial is None else f"test{trial + 1}_{method}"
        prefix = f"case{case}_" if case else ""
        return self.images / f"{prefix}world{world}_{view}_{what}.png"

    # -- Reading ------------------------------------------------------------------------------

    @property
    def exists(self) -> bool:
        """Whether a run was begun here."""
        return self._database.is_file() and (self.folder / "scenario.toml").is_file()

    def refuse_other_versions(self) -> None:
        """Raises InputError where the tables are not as this version makes them."""
        for table, names in _names_by_table().items():
            other = sorted({*self._kinds(table)} ^ {*names})
            if other:
                raise InputError(
                    f"{self.folder}: its table '{table}' differs in {', '.join(other)}, so "
                    "another version made it; run the scenario again"
                )

    def scenario(self) -> Scenario:
        """The resolved scenario of the run."""
        return load_scenario(self.folder / "scenario.toml")

    def read_json(self, name: str) -> dict[str, Any]:
        """A JSON file of the run directory."""
        try:
            return dict(json.loads((self.folder / name).read_text()))
        except (OSError, ValueError) as error:
            raise InputError(f"{self.folder / name}: not readable ({error})") from None

    def worlds(self) -> list[WorldRecord]:
        """All worlds of the run, by case."""
        adapter = TypeAdapter(WorldRecord)
        rows = self._query("SELECT record FROM worlds ORDER BY case_index, world")
        return [adapter.validate_json(text) for (text,) in rows]

    def trials(self, where: str = "1", *values: Any) -> Iterator[TrialRecord]:
        """Trials by case, world, trial and method, one by one; `where` is an SQL condition."""
        adapter = TypeAdapter(TrialRecord)
        order = "ORDER BY case_index, world, trial, method"
        for (text,) in self._query(f"SELECT record FROM trials WHERE {where} {order}", *values):
            yield adapter.validate_json(text)

    def columns(self, table: str, names: Sequence[str] = ()) -> Columns:
        """Columns (N,) of one of `TABLES` by name, all but the record; null becomes NaN.

        Raises InputError where the run's store has no such table.
        """
        kinds = self._kinds(table)
        chosen = list(names) or [name for name in kinds if name != "record"]
        order = "ORDER BY case_index, world, trial, method"
        rows = self._query(f"SELECT {', '.join(chosen)} FROM {table} {order}")
        types = {"REAL": float, "INTEGER": int, "TEXT": object}
        dtypes = [(name, types[kinds[name]]) for name in chosen]
        data = np.fromiter(
            (tuple(np.nan if cell is None else cell for cell in row) for row in rows), dtypes
        )
        return {name: data[name] for name in chosen}

    def _kinds(self, table: str) -> dict[str, str]:
        """The SQL types of a table's columns, by name."""
        kinds = {row[1]: row[2] for row in self._query(f"PRAGMA table_info({table})")}
        if not kinds:
            raise InputError(
                f"{self.folder}: its store has no table '{table}', so another version made it; "
                "run the scenario again"
            )
        return kinds

    def trials_done(self, case: int, world: int) -> set[int]:
        """Numbers within their world of the trials that are stored."""
        query = "SELECT DISTINCT trial FROM trials WHERE case_index = ? AND world = ?"
        return {trial for (trial,) in self._query(query, case, world)}

    def count_trials(self) -> int:
        """How many trials are stored."""
        query = "SELECT COUNT(*) FROM (SELECT DISTINCT case_index, world, trial FROM trials)"
        return int(next(iter(self._query(query)))[0])

    def _query(self, query: str, *values: Any) -> Iterator[tuple[Any, ...]]:
        if not self._database.is_file():
            raise InputError(f"{self.folder}: not a run directory; trials.sqlite is missing")
        try:
            with closing(connected(self._database)) as connection:
                yield from connection.execute(query, values)
        except sqlite3.DatabaseError as error:
            raise InputError(f"{self._database}: not a readable store ({error})") from None


class TrialWriter:
    """Adds worlds and trials to a run."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def add_world(self, record: WorldRecord) -> None:
        """Keep what was calibrated in a world; a second worker's equal record is passed over."""
        with self._connection:
            self._connection.execute(
                "INSERT OR IGNORE INTO worlds VALUES (?, ?, ?)",
                (record.case, record.world, json.dumps(asdict(record))),
            )

    def add_trial(self, seed: int, records: Iterable[TrialRecord]) -> None:
        """Keep one trial with all its methods and all that belongs to them, in one transaction."""
        with self._connection:
            for r in records:
                key = {"case_index": r.case, "world": r.world, "trial": r.trial, "method": r.method}
                row = {
                    **key, "number": r.number, "seed": seed, "outcome": r.outcome,
                    "reason": r.reason, "cause": r.cause, "injected": r.injected,
                    "displacement_mm": r.displacement_mm,
                    "turn_deg": r.turn_deg, "measured_shift_mm": r.measured_shift_mm,
                    "correction_seconds": r.correction_seconds, **trial_values(r),
                    "record": json.dumps(asdict(r)),
                }  # fmt: skip
                self._insert("trials", row)
                for v in r.views:
                    here = {**key, "view": v.id}
                    self._insert("views", {**here, **view_values(v)})
                    for m in v.markers:
                        self._insert("markers", {**here, "marker": m.id, **marker_values(m)})
                if r.inspection is not None:
                    self._add_inspection(key, r.inspection)

    def _add_inspection(self, key: Mapping[str, Any], inspection: InspectionRecord) -> None:
        row = {**key, "verdict": inspection.verdict, **board_values(inspection)}
        self._insert("boards", row)
        for part in inspection.parts:
            values = asdict(part)
            del values["box_px"], values["reason"]  # they stay in the record
            self._insert("parts", {**key, **values})
        for registration in inspection.registrations:
            self._insert("registrations", {**key, **asdict(registration)})

    def _insert(self, table: str, row: Mapping[str, Any]) -> None:
        names, marks = ", ".join(row), ", ".join("?" * len(row))
        query = f"INSERT INTO {table} ({names}) VALUES ({marks})"
        self._connection.execute(query, list(row.values()))


def _names_by_table() -> dict[str, list[str]]:
    """The columns of each table, as this version makes them."""
    with closing(sqlite3.connect(":memory:")) as empty:
        empty.executescript(_SCHEMA)
        return {
            table: [row[1] for row in empty.execute(f"PRAGMA table_info({table})")]
            for table in TABLES
        }


def connected(database: Path) -> sqlite3.Connection:
    """A database with a write-ahead log: a process that is killed loses nothing that it wrote."""
    connection = sqlite3.connect(database)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("PRAGMA synchronous=NORMAL")
    return connection


def write_whole(path: Path, data: bytes) -> None:
    """The whole file or none of it, also for a process that is killed."""
    part = path.with_name(f".{path.name}.part")
    part.write_bytes(data)
    os.replace(part, path)
