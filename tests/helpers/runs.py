"""Small runs without pictures, and what of them has to be the same every time."""

import os
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from aoicell.benchmark.store import RunStore
from aoicell.scenario import Scenario

CHEAP = Scenario(
    name="cheap", profile="typical", pictures=False, worlds=2, trials_per_world=6, seed=5
)


def results(folder: Path) -> tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]:
    """Trials, worlds and summary of a run, without the times in them."""
    store = RunStore(folder)
    trials = [asdict(trial) for trial in store.trials()]
    for trial in trials:
        del trial["correction_seconds"]
    summary = store.read_json("summary.json")
    for name in ("trials_per_second", "render_seconds_share"):
        del summary[name]
    for methods in [summary["methods"], *(case["methods"] for case in summary.get("cases", []))]:
        for method in methods.values():
            del method["correction_seconds"]
    return trials, [asdict(world) for world in store.worlds()], summary


def start_run(scenario: Scenario, folder: Path, *arguments: str) -> "subprocess.Popen[bytes]":
    """`aoicell run` as a process (and session) of its own; what it says goes to `said_by`."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    file = folder.parent / f"{folder.name}.toml"
    file.write_text(scenario.to_toml())
    with folder.with_suffix(".said").open("wb") as said:
        return subprocess.Popen(
            [sys.executable, "-m", "aoicell", "run", str(file), "--out", str(folder), *arguments],
            stdout=subprocess.DEVNULL,
            stderr=said,
            start_new_session=True,
            env={**os.environ, "COLUMNS": "200"},
        )


def said_by(folder: Path) -> str:
    """The messages of the last `start_run` into a folder."""
    return folder.with_suffix(".said").read_text()


def workers_of(runner: int) -> list[int]:
    """Process numbers of the spawned workers of a runner."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rsplit(")", 1)[1].split()[1])
            command = (stat.parent / "cmdline").read_bytes()
        except (OSError, IndexError):
            continue
        if parent == runner and b"spawn_main" in command:
            found.append(int(stat.parent.name))
    return found
