"""Runs: the same on any number of workers, resumed, interrupted, killed."""

import os
import signal
import sqlite3
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.runs import (
    CHEAP,
    results,
    said_by,
    start_run,
    workers_in_this_process,
    workers_of,
)

from aoicell.benchmark import work
from aoicell.benchmark.runner import Progress, run_scenario
from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError, Refused
from aoicell.scenario import Scenario

Results = tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The cheap scenario on one worker, uninterrupted, in a process that has done other things."""
    folder = tmp_path_factory.mktemp("alone") / "run"
    with workers_in_this_process():
        run_scenario(CHEAP, folder)
    return folder


@pytest.fixture(scope="module")
def expected(alone: Path) -> Results:
    return results(alone)


@pytest.fixture
def in_this_process() -> Iterator[None]:
    with workers_in_this_process():
        yield


def stored_trials(folder: Path) -> int:
    try:
        return RunStore(folder).count_trials()
    except (InputError, sqlite3.Error):  # not yet begun
        return 0


def wait_for_trials(folder: Path, count: int, seconds: float = 90) -> None:
    end = time.monotonic() + seconds
    while stored_trials(folder) < count:
        assert time.monotonic() < end, "the run does not get on"
        time.sleep(0.02)


# -- The same everywhere ------------------------------------------------------------------------


def test_one_worker_does_every_trial_once(alone: Path, expected: Results) -> None:
    trials, worlds, summary = expected
    keys = [(t["world"], t["trial"], t["method"]) for t in trials]
    assert len(keys) == len(set(keys)) == CHEAP.trials * len(CHEAP.methods)
    assert [world["world"] for world in worlds] == [0, 1]
    assert {t["number"] for t in trials} == set(range(CHEAP.trials))
    assert summary["methods"]["aoicell"]["corrected"] == CHEAP.trials


def test_two_workers_find_the_same_bit_for_bit_although_one_is_killed(
    expected: Results, tmp_path: Path
) -> None:
    """A dead worker is replaced, its trial repeated, and every trial counted once."""
    seen: list[tuple[int, int]] = []
    crews: list[list[int]] = []

    def watch(progress: Progress) -> None:
        seen.append((progress.done, progress.total))
        if progress.done in (2, CHEAP.trials - 1):
            crews.append(workers_of(os.getpid()))
        if progress.done == 2:
            os.kill(crews[0][0], signal.SIGKILL)

    run_scenario(CHEAP, tmp_path, watch, workers=2)
    assert results(tmp_path) == expected
    assert seen == [(done, CHEAP.trials) for done in range(CHEAP.trials + 1)]
    before, after = crews
    assert len(before) == len(after) == 2
    assert before[0] not in after


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 8])
def test_many_workers_find_the_same_bit_for_bit(
    expected: Results, tmp_path: Path, workers: int
) -> None:
    run_scenario(CHEAP, tmp_path, workers=workers)
    assert results(tmp_path) == expected


@pytest.mark.usefixtures("in_this_process")
def test_one_trial_can_be_repeated_alone(expected: Results, tmp_path: Path) -> None:
    run_scenario(CHEAP, tmp_path, only=8)
    trials, worlds, _ = results(tmp_path)
    assert trials == [t for t in expected[0] if t["number"] == 8]
    assert worlds == expected[1][1:2]


def test_the_number_of_a_trial_has_its_range(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--only 12: the scenario's trials have the numbers 0 to"):
        run_scenario(CHEAP, tmp_path / "run", only=12)
    assert not (tmp_path / "run").exists()


# -- Going on -----------------------------------------------------------------------------------


@pytest.mark.usefixtures("in_this_process")  # the one that goes on
def test_a_killed_runner_loses_nothing_and_goes_on(expected: Results, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    process = start_run(CHEAP, folder, "--workers", "1")
    wait_for_trials(folder, 3)
    crew = workers_of(process.pid)
    assert crew
    process.kill()
    process.wait()
    kept = stored_trials(folder)
    assert 3 <= kept < CHEAP.trials
    assert not (folder / "summary.json").exists()
    seen: list[int] = []
    run_scenario(CHEAP, folder, lambda p: seen.append(p.done), resume=True)
    assert seen[0] == kept  # what was done is not done again
    assert results(folder) == expected
    wait_until_gone(crew)


def wait_until_gone(processes: list[int]) -> None:
    """Workers without a runner end by themselves."""
    end = time.monotonic() + 30
    while any(Path(f"/proc/{p}").exists() for p in processes):
        assert time.monotonic() < end, "orphans stay behind"
        time.sleep(0.05)


def test_control_c_ends_cleanly_and_keeps_what_is_done(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    longer = CHEAP.model_copy(update={"trials_per_world": 60, "methods": ["paper"]})
    process = start_run(longer, folder, "--workers", "1")
    wait_for_trials(folder, 2)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: the workers get it, too
    assert process.wait(60) == 130
    lines = said_by(folder).strip().splitlines()
    assert len(lines) == 1, lines
    assert f"of {longer.trials} trials, which are kept in {folder}; --resume goes on" in lines[0]
    assert 2 <= stored_trials(folder) < longer.trials


def test_a_changed_scenario_is_not_mixed_with_another(alone: Path) -> None:
    before = results(alone)
    changed = CHEAP.model_copy(update={"seed": 6})
    with pytest.raises(InputError, match=r"holds a run with 'seed' = 5, not 6; give the same"):
        run_scenario(changed, alone, resume=True)
    assert results(alone) == before


def test_what_is_finished_is_not_run_again(alone: Path, expected: Results) -> None:
    seen: list[int] = []
    run_scenario(CHEAP, alone, lambda p: seen.append(p.done), workers=1, resume=True)
    assert seen == [CHEAP.trials]
    assert results(alone) == expected


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_killed_at_a_random_moment(expected: Results, tmp_path: Path, seed: int) -> None:
    """The runner and a worker in turn, at any moment of the run, and again while it goes on."""
    rng = np.random.default_rng(seed)
    folder = tmp_path / "run"
    more: list[str] = []
    for _ in range(10):
        process = start_run(CHEAP, folder, "--workers", "2", *more)
        try:
            assert process.wait(rng.uniform(1, 12)) == 0
            break
        except subprocess.TimeoutExpired:
            pass
        victims = workers_of(process.pid) if rng.random() < 0.5 else []
        if victims:
            os.kill(int(rng.choice(victims)), signal.SIGKILL)
            assert process.wait(180) == 0
            break
        process.kill()
        process.wait()
        more = ["--resume"]
    else:
        assert start_run(CHEAP, folder, *more).wait(180) == 0
    assert results(folder) == expected


# -- What goes wrong ----------------------------------------------------------------------------


FOUR = CHEAP.model_copy(update={"trials_per_world": 2})


@pytest.mark.usefixtures("in_this_process")
def test_a_world_that_is_refused_refuses_its_trials_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepare, calls = work.prepare, []

    def refusing(scenario: Scenario, nominal: Any, world: int) -> Any:
        calls.append(world)
        if world == 0:
            raise Refused("hand-eye: 2 views are too few")
        return prepare(scenario, nominal, world)

    monkeypatch.setattr(work, "prepare", refusing)
    summary = run_scenario(FOUR, tmp_path)
    assert calls == [0, 1]  # a world is not calibrated again for each of its trials
    assert summary["methods"]["paper"]["refused"] == 2
    assert summary["methods"]["paper"]["corrected"] == 2
    refused = list(RunStore(tmp_path).trials("world = 0"))
    assert {r.reason for r in refused} == {"hand-eye: 2 views are too few"}
    assert [r.number for r in refused if r.method == "paper"] == [0, 1]


@pytest.mark.usefixtures("in_this_process")
def test_a_defect_costs_its_own_trials(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any) -> Any:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(work, "prepare", broken)
    summary = run_scenario(FOUR, tmp_path)
    assert summary["methods"]["aoicell"]["failed"] == 4
    assert {t.reason for t in RunStore(tmp_path).trials()} == {
        "ZeroDivisionError: division by zero"
    }


@pytest.mark.usefixtures("in_this_process")
def test_bad_input_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_display(*_: Any) -> Any:
        raise InputError("no OpenGL to render with")

    monkeypatch.setattr(work, "prepare", no_display)
    with pytest.raises(InputError, match="no OpenGL"):
        run_scenario(FOUR, tmp_path)


@pytest.mark.usefixtures("in_this_process")
def test_a_trial_that_kills_every_worker_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_trial, calls = work.run_trial, []

    def deadly(session: Any, trial: int) -> Any:
        calls.append(trial)
        if session.world.as_built.world == 1 and trial == 0:
            raise SystemExit
        return run_trial(session, trial)

    monkeypatch.setattr(work, "run_trial", deadly)
    summary = run_scenario(FOUR.model_copy(update={"methods": ["paper"]}), tmp_path)
    assert summary["methods"]["paper"]["failed"] == 1
    assert summary["methods"]["paper"]["corrected"] == 3
    (fatal,) = RunStore(tmp_path).trials("outcome = 'failed'")
    assert (fatal.world, fatal.trial, fatal.number) == (1, 0, 2)
    assert fatal.reason == "RuntimeError: 3 workers died over this trial"


# -- Progress -----------------------------------------------------------------------------------


def test_progress_tells_rate_and_remaining_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(time, "perf_counter", lambda: now)
    progress = Progress(done=10, total=30, started=100.0)
    assert progress.seconds_left is None
    progress.done, progress.here = 14, 4
    now = 102.0
    assert progress.trials_per_second == 2
    assert progress.seconds_left == 8
