"""Small runs without pictures, and what of them has to be the same every time."""

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest.mock import patch

from aoicell.benchmark import runner, work
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.trial import Session
from aoicell.scenario import Scenario

CHEAP = Scenario(
    name="cheap", profile="typical", methods=["paper", "aoicell"], pictures=False, worlds=2,
    trials_per_world=6, seed=5,
)  # fmt: skip


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


class _Here:
    """The crew of one: this process. A call that raises SystemExit counts as a dead worker."""

    def __enter__(self) -> "list[_Here]":
        return [self]

    def __exit__(self, *_: object) -> None:
        pass

    def submit(self, function: Any, task: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        try:
            future.set_result(function(task))
        except BaseException as error:
            future.set_exception(error)
        return future

    def died(self, error: BaseException) -> bool:
        return isinstance(error, SystemExit)


@contextmanager
def workers_in_this_process() -> Iterator[None]:
    """Local workers that are no processes: they start at once, and a test can put defects in."""
    with patch.object(runner, "local_workers", lambda count: _Here()):
        yield
    if isinstance(work._ready.session, Session):
        work._ready.session.world.close()
    work._ready.key = work._ready.session = None
