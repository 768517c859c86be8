"""Which trials are handed out, to whom, and that none is lost or doubled."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.benchmark.schedule import JOIN_AT, Schedule
from aoicell.benchmark.work import Task
from aoicell.scenario import Case, Scenario, cases_of


def cases(worlds: int, trials: int, sweep: int = 1) -> list[Case]:
    seeds = {"sweep": {"seed": list(range(sweep))}} if sweep > 1 else {}
    scenario = Scenario(name="s", worlds=worlds, trials_per_world=trials, **seeds)  # type: ignore[arg-type]
    return cases_of(scenario)


def nothing_done(case: int, world: int) -> set[int]:
    return set()


def place(task: Task) -> tuple[int, int]:
    return task.case.index, task.world


@given(
    worlds=st.integers(1, 4),
    trials=st.integers(1, 12),
    sweep=st.integers(1, 3),
    crew=st.integers(1, 5),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_trial_is_done_once_whoever_dies(
    worlds: int, trials: int, sweep: int, crew: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    schedule = Schedule(cases(worlds, trials, sweep), nothing_done)
    held: dict[int, list[Task]] = {worker: [] for worker in range(crew)}
    done: Counter[int] = Counter()
    for _ in range(1000):
        for worker, tasks in held.items():
            while len(tasks) < 2 and (task := schedule.next_for(worker)) is not None:
                tasks.append(task)
        busy = [worker for worker, tasks in held.items() if tasks]
        if not busy:
            break
        worker = int(rng.choice(busy))
        if rng.random() < 0.2:
            schedule.give_back(worker, held[worker])
            held[worker] = []
        else:
            done[held[worker].pop(0).number] += 1
    assert done == Counter(range(sweep * worlds * trials))


def test_a_number_tells_case_world_and_trial() -> None:
    schedule = Schedule(cases(2, 3, sweep=2), nothing_done)
    tasks = [task for _ in range(12) if (task := schedule.next_for(0)) is not None]
    assert [task.number for task in tasks] == list(range(12))
    assert [(*place(t), t.trial) for t in tasks[:7]] == [
        (0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 1, 0), (0, 1, 1), (0, 1, 2), (1, 0, 0)
    ]  # fmt: skip
    assert schedule.next_for(0) is None


def test_each_worker_stays_in_its_world() -> None:
    schedule = Schedule(cases(3, 4), nothing_done)
    first, second = schedule.next_for(0), schedule.next_for(1)
    assert first is not None
    assert second is not None
    assert place(first) != place(second)
    for _ in range(3):
        again = schedule.next_for(0)
        assert again is not None
        assert place(again) == place(first)


@pytest.mark.parametrize(("trials", "joins"), [(JOIN_AT, False), (JOIN_AT + 1, True)])
def test_a_world_is_joined_where_that_is_worth_its_preparation(trials: int, joins: bool) -> None:
    schedule = Schedule(cases(1, trials), nothing_done)
    assert schedule.next_for(0) is not None
    assert (schedule.next_for(1) is not None) is joins


def test_what_is_done_is_passed_over() -> None:
    schedule = Schedule(cases(2, 3), lambda case, world: {0, 1, 2} if world == 0 else {1})
    tasks = [task for _ in range(3) if (task := schedule.next_for(0)) is not None]
    assert [(task.world, task.trial) for task in tasks] == [(1, 0), (1, 2)]


def test_only_one_trial() -> None:
    schedule = Schedule(cases(2, 3), nothing_done, only=4)
    task = schedule.next_for(0)
    assert task is not None
    assert (task.world, task.trial, task.number) == (1, 1, 4)
    assert schedule.next_for(0) is None
