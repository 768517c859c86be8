"""What a worker does: one trial at a time, in a world that it keeps ready."""

import ctypes
import gc
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from aoicell.benchmark.localisation_trial import run_localisation_trial
from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.trial import Session, describe, prepare, run_trial, unprepared
from aoicell.benchmark.workers import compute_on_one_thread
from aoicell.errors import AoicellError, Refused
from aoicell.nominal import load_nominal
from aoicell.observation import Observation
from aoicell.scenario import Case

ImageKey = tuple[str, int | None, str]  # view, trial, method; no trial for a standard image


@dataclass(frozen=True)
class Task:
    """One trial of a case; `number` counts over the whole run."""

    case: Case
    world: int
    trial: int
    number: int


@dataclass(frozen=True)
class TaskResult:
    """Records of all methods, encoded pictures where they are kept, and what it took.

    `world` comes with the first trial after the world was prepared.
    """

    records: tuple[TrialRecord, ...]
    world: WorldRecord | None
    images: Mapping[ImageKey, bytes]
    seconds: float
    render_seconds: float


@dataclass
class _Ready:
    """The world that this process has at hand: one, since a renderer takes 100 MB."""

    key: tuple[Case, int] | None = None
    session: Session | Exception | None = None


_ready = _Ready()
# an OpenGL context belongs to a thread, and a cluster's worker may have several
_thread = ThreadPoolExecutor(1, thread_name_prefix="aoicell")
_nominal = cache(load_nominal)


def work(task: Task) -> TaskResult:
    """Run one trial; called on a worker. An error that is no refusal of the trial escapes."""
    return _thread.submit(_work, task).result()


def _work(task: Task) -> TaskResult:
    compute_on_one_thread()
    start, fresh = time.perf_counter(), _ready.key != (task.case, task.world)
    if fresh:
        _prepare(task)
    scenario, session = task.case.scenario, _ready.session
    if not isinstance(session, Session):
        assert session is not None
        records = unprepared(scenario, task.world, task.trial, session)
        took = time.perf_counter() - start
        return TaskResult(numbered(records, task), None, {}, took, 0.0)
    rendered = 0.0 if fresh else session.world.render_seconds
    run = run_trial if scenario.visit else run_localisation_trial
    results = run(session, task.trial)
    images: dict[ImageKey, bytes] = {}
    if scenario.store.images:
        for result in results:
            for view, picture in result.images.items():
                images[view, task.trial, result.record.method] = _png(picture)
        if fresh:
            images |= {(v.id, None, ""): _png(v.standard) for v in session.taught.views}
    return TaskResult(
        records=numbered([result.record for result in results], task),
        world=replace(describe(session), case=task.case.index) if fresh else None,
        images=images,
        seconds=time.perf_counter() - start,
        render_seconds=session.world.render_seconds - rendered,
    )


def _prepare(task: Task) -> None:
    """Take down the world at hand and make the task's; a refusal is kept for all its trials."""
    if isinstance(_ready.session, Session):
        _ready.session.world.close()
    _ready.key = _ready.session = None
    _trim_memory()
    scenario = task.case.scenario
    try:
        _ready.session = prepare(
            scenario, scenario.fitted(_nominal(scenario.cell_folder)), task.world
        )
    except Refused as refusal:
        _ready.session = refusal
    except AoicellError:  # bad input: for the whole run
        raise
    except Exception as defect:
        _ready.session = defect
    _ready.key = (task.case, task.world)


def _trim_memory() -> None:
    """Hand freed memory back: what a world leaves behind in glibc's heap grows to gigabytes."""
    gc.collect()
    with suppress(OSError, AttributeError):  # another C library
        ctypes.CDLL("libc.so.6").malloc_trim(0)


def numbered(records: Sequence[TrialRecord], task: Task) -> tuple[TrialRecord, ...]:
    """The records with their place in the whole run."""
    return tuple(replace(r, case=task.case.index, number=task.number) for r in records)


def _png(observation: Observation) -> bytes:
    """The picture, lossless."""
    image = observation.image
    ok, data = cv2.imencode(".png", image if image.ndim == 2 else image[:, :, ::-1])
    if not ok:
        raise RuntimeError("OpenCV could not encode a picture as PNG")
    return np.asarray(data).tobytes()
