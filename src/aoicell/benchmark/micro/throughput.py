"""How much of a run goes into taking its pictures, and what a second worker brings."""

import time
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from aoicell.benchmark.trial import Session, prepare, run_trial
from aoicell.benchmark.workers import Worker, compute_on_one_thread, local_workers
from aoicell.nominal import load_nominal
from aoicell.observation import CameraName, Cell, Observation, RobotState
from aoicell.resources import find
from aoicell.scenario import load_scenario
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array

SECONDS, QUICK_SECONDS = 60.0, 10.0


@dataclass(frozen=True)
class Pace:
    """What one worker did: trials, pictures, and the seconds that each way took."""

    trials: int
    pictures: int
    trial_seconds: float
    capture_seconds: float
    render_seconds: float


class _Noting:
    """A cell that keeps the joint targets at which pictures are taken."""

    def __init__(self, cell: Cell, world: World) -> None:
        self._cell, self._world = cell, world
        self.taken: list[tuple[SE3, Array]] = []

    def move(self, q: ArrayLike) -> None:
        self._cell.move(q)
        self._q = np.array(q)

    def state(self) -> RobotState:
        return self._cell.state()

    def capture(self, camera: CameraName = "hand") -> Observation:
        self.taken.append((self._world.T_base_board, self._q))
        return self._cell.capture(camera)


def bench_throughput(quick: bool = False) -> dict[str, Any]:
    """Trials against the same pictures through `SimCell`, and two workers against one.

    Each worker alternates: a trial with both methods, then the same moves and pictures alone.
    The worlds are prepared before. Ratios above 1 cannot be: a trial takes all its pictures.
    """
    seconds = QUICK_SECONDS if quick else SECONDS
    with local_workers(2) as crew:
        _all([(worker, index, 0.0) for index, worker in enumerate(crew)])
        one = _all([(crew[0], 0, seconds)])
        two = _all([(worker, index, seconds) for index, worker in enumerate(crew)])
    return {
        "name": "throughput",
        "rows": [_row(1, one), _row(2, two)],
        "ratios": {
            "trials_over_capture": round(_sum(two, "capture_seconds") / _trial_seconds(two), 4),
            "trials_over_render": round(_sum(two, "render_seconds") / _trial_seconds(two), 4),
            "two_workers_over_one": round(_rate(two) / _rate(one), 4),
        },
    }


def _all(calls: list[tuple[Worker, int, float]]) -> list[Pace]:
    futures = [worker.submit(measure, index, seconds) for worker, index, seconds in calls]
    return [future.result() for future in futures]


@cache
def _session(world: int) -> Session:
    compute_on_one_thread()
    scenario = load_scenario(find("scenarios", "random_displacement"))
    return prepare(scenario, scenario.fitted(load_nominal(scenario.cell_folder)), world)


def measure(world: int, seconds: float) -> Pace:
    """For at least so many seconds: trials, and the same pictures without them."""
    session = _session(world)
    noting = _Noting(session.cell, session.world)
    noted = replace(session, cell=noting)
    trials, trial_seconds, capture_seconds, render_seconds = 0, 0.0, 0.0, 0.0
    while trial_seconds + capture_seconds < seconds:
        noting.taken.clear()
        start = time.perf_counter()
        run_trial(noted, trials)
        trial_seconds += time.perf_counter() - start
        took, rendered = _retake(session, trials, noting.taken)
        capture_seconds += took
        render_seconds += rendered
        trials += 1
    pictures = trials * len(noting.taken)
    return Pace(trials, pictures, trial_seconds, capture_seconds, render_seconds)


def _retake(session: Session, trial: int, taken: list[tuple[SE3, Array]]) -> tuple[float, float]:
    """Seconds of the same moves and pictures, and of the bare renders among them."""
    world, rendered, start = session.world, session.world.render_seconds, time.perf_counter()
    world.begin(trial)
    for T_base_board, q in taken:
        world.place_board(T_base_board)
        session.cell.move(q)
        session.cell.capture()
    took = time.perf_counter() - start
    world.place_board(session.T_base_board_taught)
    return took, world.render_seconds - rendered


def _row(workers: int, paces: list[Pace]) -> dict[str, Any]:
    return {
        "workers": workers,
        "trials": sum(p.trials for p in paces),
        "pictures": sum(p.pictures for p in paces),
        "trials_per_second": round(_rate(paces), 4),
        "ms_per_picture": round(
            1e3 * _sum(paces, "capture_seconds") / sum(p.pictures for p in paces), 1
        ),
    }


def _rate(paces: list[Pace]) -> float:
    return sum(p.trials / p.trial_seconds for p in paces)


def _sum(paces: list[Pace], name: str) -> float:
    return float(sum(getattr(pace, name) for pace in paces))


def _trial_seconds(paces: list[Pace]) -> float:
    return _sum(paces, "trial_seconds")
