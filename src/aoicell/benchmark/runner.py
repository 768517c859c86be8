"""Runs a scenario on local processes or a cluster, and keeps every finished trial."""

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from aoicell.benchmark.environment import describe_environment
from aoicell.benchmark.schedule import Schedule
from aoicell.benchmark.store import RunStore, TrialWriter
from aoicell.benchmark.summary import summarise
from aoicell.benchmark.trial import unprepared
from aoicell.benchmark.values import trial_values
from aoicell.benchmark.work import Task, TaskResult, numbered, work
from aoicell.benchmark.workers import Worker, dask_workers, local_workers
from aoicell.errors import InputError, Interrupted
from aoicell.scenario import Case, Scenario, cases_of

AHEAD = 2  # trials at a worker: one that runs, one that waits for it
LIVES = 3  # so many workers may die over a trial


@dataclass
class Progress:
    """How far a run is: trials stored and in all, and those of this session, with their pace."""

    done: int
    total: int
    started: float = field(default_factory=time.perf_counter)
    here: int = 0
    busy_seconds: float = 0.0
    render_seconds: float = 0.0
    sums: dict[str, tuple[float, int]] = field(default_factory=dict)

    @property
    def trials_per_second(self) -> float:
        """Since this session began."""
        return self.here / max(time.perf_counter() - self.started, 1e-9)

    @property
    def seconds_left(self) -> float | None:
        """At the present rate; None before the first trial."""
        return (self.total - self.done) / self.trials_per_second if self.here else None

    @property
    def mean_mm(self) -> dict[str, float]:
        """Running mean of the residual by method, over this session's corrected trials."""
        return {method: total / count for method, (total, count) in self.sums.items()}

    def add(self, result: TaskResult) -> None:
        """Count a trial."""
        self.done += 1
        self.here += 1
        self.busy_seconds += result.seconds
        self.render_seconds += result.render_seconds
        for record in result.records:
            left = trial_values(record)["residual_mm"]
            if left is not None:
                total, count = self.sums.get(record.method, (0.0, 0))
                self.sums[record.method] = (total + left, count + 1)


Report = Callable[[Progress], None]


def run_scenario(
    scenario: Scenario,
    folder: Path,
    report: Report = lambda progress: None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    only: int | None = None,
) -> dict[str, Any]:
    """Run all trials, leave the run directory behind and return its summary.

    On `workers` processes of this machine (default: as many as help), or on the Dask cluster
    whose `scheduler` is named; the results are the same bit for bit. `resume` goes on with
    what lies in `folder`; `only` runs the trial of that number alone.

    Raises InputError for a folder of another scenario, and Interrupted on Ctrl-C.
    """
    cases = cases_of(scenario)
    total = sum(case.scenario.trials for case in cases)
    if only is not None and not 0 <= only < total:
        raise InputError(f"--only {only}: the scenario's trials have the numbers 0 to {total - 1}")
    store = RunStore(folder)
    _begin(store, scenario, resume)
    done = store.count_trials()
    progress = Progress(done, total if only is None else done + 1)
    report(progress)
    try:
        with _crew(cases, progress, workers, scheduler) as crew, store.writing() as writer:
            _run(Schedule(cases, store.trials_done, only), crew, _Keeper(store, writer), progress,
                 report)  # fmt: skip
    except KeyboardInterrupt:
        raise Interrupted(
            f"stopped after {progress.done} of {progress.total} trials, which are kept in "
            f"{folder}; --resume goes on"
        ) from None
    share = progress.render_seconds / max(progress.busy_seconds, 1e-9)
    summary = summarise(scenario, store, progress.trials_per_second, share)
    store.write_json("summary.json", summary)
    return summary


def _begin(store: RunStore, scenario: Scenario, resume: bool) -> None:
    """An empty run directory, or the one to go on in."""
    environment = {**describe_environment(), "seed": scenario.seed}
    if not resume or not store.exists:
        store.create(scenario, environment)
        return
    stored = store.scenario()
    for key in type(scenario).model_fields:
        before, now = getattr(stored, key), getattr(scenario, key)
        if before != now:
            raise InputError(
                f"--resume: {store.folder} holds a run with '{key}' = {before!r}, not {now!r}; "
                "give the same scenario, or another directory with --out"
            )
    first = store.read_json("environment.json")
    others = first.pop("resumed_in", [])
    if environment != first and environment not in others:
        store.write_json("environment.json", {**first, "resumed_in": [*others, environment]})


def _crew(
    cases: Sequence[Case], progress: Progress, workers: int | None, scheduler: str | None
) -> AbstractContextManager[list[Worker]]:
    if scheduler is not None:
        return dask_workers(scheduler)
    if workers is None:
        worlds = sum(case.scenario.worlds for case in cases)
        useful = max(min(worlds, progress.total), progress.total // 16)
        workers = min(os.cpu_count() or 1, max(useful, 1))
    return local_workers(workers)


class _Keeper:
    """Stores what comes back; the files of a trial before its row."""

    def __init__(self, store: RunStore, writer: TrialWriter) -> None:
        self._store, self._writer = store, writer

    def keep(self, task: Task, result: TaskResult) -> None:
        for (view, trial, method), png in result.images.items():
            path = self._store.image_path(task.world, view, trial, method, task.case.index)
            self._store.add_image(path, png)
        if result.world is not None:
            self._writer.add_world(result.world)
        self._writer.add_trial(task.case.scenario.seed, result.records)


def _run(
    schedule: Schedule, crew: Sequence[Worker], keeper: _Keeper, progress: Progress, report: Report
) -> None:
    """Keep every worker busy until nothing is left."""
    running: dict[Future[TaskResult], tuple[int, Task]] = {}  # in the order of submission
    deaths: dict[int, int] = {}

    def fill() -> None:
        for index, worker in enumerate(crew):
            while sum(i == index for i, _ in running.values()) < AHEAD:
                task = schedule.next_for(index)
                if task is None:
                    break
                running[worker.submit(work, task)] = (index, task)

    def keep(task: Task, result: TaskResult) -> None:
        keeper.keep(task, result)
        progress.add(result)
        report(progress)

    fill()
    while running:
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in [f for f in running if f in finished]:
            if future not in running:
                continue  # given back with another one of its worker
            index, task = running[future]
            error = future.exception()
            if error is None:
                del running[future]
                keep(task, future.result())
            elif crew[index].died(error):
                lost = [t for f, (i, t) in running.items() if i == index and not _succeeded(f)]
                for other in [f for f, (i, t) in running.items() if i == index and t in lost]:
                    del running[other]
                deaths[task.number] = deaths.get(task.number, 0) + 1
                if deaths[task.number] >= LIVES:
                    lost.remove(task)
                    keep(task, _fatal(task))
                schedule.give_back(index, lost)
            else:
                raise error
        fill()


def _succeeded(future: "Future[TaskResult]") -> bool:
    return future.done() and future.exception() is None


def _fatal(task: Task) -> TaskResult:
    """The result of a trial that takes every worker down with it."""
    defect = RuntimeError(f"{LIVES} workers died over this trial")
    scenario = task.case.scenario
    records = unprepared(scenario, task.world, task.trial, defect)
    return TaskResult(numbered(records, task), None, {}, 0.0, 0.0)
