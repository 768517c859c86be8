"""The run directory: resolved scenario, trials in SQLite, summary, environment, images."""

import json
import shutil
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
from pydantic import TypeAdapter

from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.summary import view_px
from aoicell.errors import InputError
from aoicell.observation import Observation
from aoicell.scenario import Scenario, load_scenario

_SCHEMA = """
CREATE TABLE IF NOT EXISTS worlds (world INTEGER PRIMARY KEY, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS trials (
  world INTEGER, trial INTEGER, method TEXT, outcome TEXT, reason TEXT,
  displacement_mm REAL, turn_deg REAL, record TEXT NOT NULL,
  PRIMARY KEY (world, trial, method));
CREATE TABLE IF NOT EXISTS views (
  world INTEGER, trial INTEGER, method TEXT, view TEXT, residual_mm REAL, lateral_mm REAL,
  depth_mm REAL, deg REAL, detected_px REAL, true_px REAL, image_mm REAL,
  PRIMARY KEY (world, trial, method, view));
"""


class RunStore:
    """Writes and reads one run directory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.images = folder / "images"
        self.figures = folder / "figures"
        self._database = folder / "trials.sqlite"

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
        (self.folder / "summary.json").unlink(missing_ok=True)
        for suffix in ("", "-wal", "-shm"):
            Path(f"{self._database}{suffix}").unlink(missing_ok=True)
        (self.folder / "scenario.toml").write_text(scenario.to_toml())
        self.write_json("environment.json", environment)
        with closing(self._connect()) as connection:
            connection.executescript(_SCHEMA)

    def _connect(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self._database)
        connection.execute("PRAGMA journal_mode=WAL")
        return connection

    def add_world(self, record: WorldRecord) -> None:
        """Keep what was calibrated in a world."""
        with closing(self._connect()) as connection, connection:
            connection.execute(
                "INSERT INTO worlds VALUES (?, ?)", (record.world, json.dumps(asdict(record)))
            )

    def add_trial(self, record: TrialRecord) -> None:
        """Keep one method's trial and its views, in one transaction."""
        key = (record.world, record.trial, record.method)
        with closing(self._connect()) as connection, connection:
            connection.execute(
                "INSERT INTO trials VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                (*key, record.outcome, record.reason, record.displacement_mm, record.turn_deg,
                 json.dumps(asdict(record))),
            )  # fmt: skip
            connection.executemany(
                "INSERT INTO views VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (*key, v.id, v.residual_mm, v.lateral_mm, v.depth_mm, v.deg,
                     *(view_px(v, name) for name in ("detected_px", "true_px", "image_mm")))
                    for v in record.views
                ],
            )  # fmt: skip

    def worlds(self) -> list[WorldRecord]:
        """All worlds of the run."""
        adapter = TypeAdapter(WorldRecord)
        return [adapter.validate_json(text) for text in self._column("worlds", "world")]

    def trials(self) -> list[TrialRecord]:
        """All trials, by world, trial and method."""
        adapter = TypeAdapter(TrialRecord)
        rows = self._column("trials", "world, trial, method")
        return [adapter.validate_json(text) for text in rows]

    def _column(self, table: str, order: str) -> list[str]:
        if not self._database.is_file():
            raise InputError(f"{self.folder}: not a run directory; trials.sqlite is missing")
        try:
            with closing(self._connect()) as connection:
                rows = connection.execute(f"SELECT record FROM {table} ORDER BY {order}")
                return [text for (text,) in rows]
        except sqlite3.DatabaseError as error:
            raise InputError(f"{self._database}: not a readable store ({error})") from None

    def scenario(self) -> Scenario:
        """The resolved scenario of the run."""
        return load_scenario(self.folder / "scenario.toml")

    def write_json(self, name: str, values: Mapping[str, Any]) -> None:
        """A JSON file of the run directory."""
        (self.folder / name).write_text(json.dumps(values, indent=2) + "\n")

    def read_json(self, name: str) -> dict[str, Any]:
        """A JSON file of the run directory."""
        try:
            return dict(json.loads((self.folder / name).read_text()))
        except (OSError, ValueError) as error:
            raise InputError(f"{self.folder / name}: not readable ({error})") from None

    def image_path(self, world: int, view: str, trial: int | None = None, method: str = "") -> Path:
        """Where a standard image (no trial) or a new image lies."""
        what = "standard" if trial is None else f"test{trial + 1}_{method}"
        return self.images / f"world{world}_{view}_{what}.png"

    def add_image(self, path: Path, observation: Observation) -> None:
        """Keep a picture, lossless."""
        path.parent.mkdir(parents=True, exist_ok=True)
        image = observation.image
        cv2.imwrite(str(path), image if image.ndim == 2 else image[:, :, ::-1])
