"""The folder of a line: its settings, and its boards in SQLite, one transaction each."""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from aoicell.benchmark.line.records import BoardRecord, SetUpRecord
from aoicell.benchmark.line.settings import LineSettings, read_settings
from aoicell.benchmark.store import connected, write_whole
from aoicell.errors import InputError

_SCHEMA = """
CREATE TABLE IF NOT EXISTS set_ups (slot INTEGER PRIMARY KEY, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS boards (
  number INTEGER PRIMARY KEY, slot INTEGER, set_up INTEGER, verdict TEXT, truth TEXT, cause TEXT,
  residual_mm REAL, predicted_mm REAL, bound_mm REAL, mount REAL, light REAL, left_mm REAL,
  arm_seconds REAL, compute_seconds REAL, record TEXT NOT NULL);
"""
_BOARD, _SET_UP = TypeAdapter(BoardRecord), TypeAdapter(SetUpRecord)


class LineStore:
    """Writes and reads the folder of a line. A process that is killed loses the board under way."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._database, self._settings = folder / "boards.sqlite", folder / "line.toml"

    def create(self, settings: LineSettings) -> None:
        """Start anew; what an earlier line left here is replaced. Raises InputError."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{self.folder}: no folder can be made here ({error.strerror}); "
                "name another with --out"
            ) from None
        for name in ("line.html", "summary.json", "line.png", "line.svg", "line.pdf"):
            (self.folder / name).unlink(missing_ok=True)
        for suffix in ("", "-wal", "-shm"):
            Path(f"{self._database}{suffix}").unlink(missing_ok=True)
        with closing(connected(self._database)) as connection:
            connection.executescript(_SCHEMA)
        write_whole(self._settings, settings.to_toml().encode())

    @property
    def exists(self) -> bool:
        """Whether a line was begun here."""
        return self._database.is_file() and self._settings.is_file()

    def settings(self) -> LineSettings:
        """What the line was begun with."""
        return read_settings(self._settings)

    @contextmanager
    def writing(self) -> Iterator["LineWriter"]:
        """One connection for all that is added."""
        with closing(connected(self._database)) as connection:
            yield LineWriter(connection)

    def write_json(self, name: str, values: dict[str, Any]) -> None:
        """A JSON file of the folder."""
        write_whole(self.folder / name, (json.dumps(values, indent=2) + "\n").encode())

    def boards(self) -> list[BoardRecord]:
        """All boards, in their order."""
        return [_BOARD.validate_json(text) for text in self._records("boards", "number")]

    def set_ups(self) -> list[SetUpRecord]:
        """All set-ups, in their order."""
        return [_SET_UP.validate_json(text) for text in self._records("set_ups", "slot")]

    def _records(self, table: str, key: str) -> list[str]:
        if not self.exists:
            raise InputError(f"{self.folder}: no line was begun here; line.toml is missing")
        try:
            with closing(connected(self._database)) as connection:
                rows = connection.execute(f"SELECT record FROM {table} ORDER BY {key}")
                return [text for (text,) in rows]
        except sqlite3.DatabaseError as error:
            raise InputError(f"{self._database}: not a readable store ({error})") from None


class LineWriter:
    """Adds boards and set-ups."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def add_set_up(self, record: SetUpRecord) -> None:
        """Keep a set-up; the same again, after an interruption, replaces it."""
        with self._connection:
            self._connection.execute(
                "INSERT OR REPLACE INTO set_ups VALUES (?, ?)",
                (record.slot, json.dumps(asdict(record))),
            )

    def add_board(self, r: BoardRecord) -> None:
        """Keep a board with all that belongs to it."""
        row = (
            r.number, r.slot, r.set_up, r.verdict, r.truth, r.cause, r.residual_mm, r.predicted_mm,
            r.bound_mm, r.status.mount, r.status.light, r.status.left_mm, r.arm_seconds,
            r.compute_seconds, json.dumps(asdict(r)),
        )  # fmt: skip
        with self._connection:
            marks = ", ".join("?" * len(row))
            self._connection.execute(f"INSERT INTO boards VALUES ({marks})", row)
