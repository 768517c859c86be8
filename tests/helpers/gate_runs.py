"""Finished runs made in this process, with or without a bias in the corrected poses."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from aoicell.benchmark import trial as trials
from aoicell.benchmark.environment import describe_environment
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.trial import Session, prepare, run_trial
from aoicell.correction import Correction
from aoicell.nominal import Nominal
from aoicell.online import Looked, Online
from aoicell.scenario import Scenario
from aoicell.transforms import translation


@contextmanager
def prepared(scenario: Scenario, nominal: Nominal) -> Iterator[list[Session]]:
    """All worlds of a scenario, calibrated and taught."""
    sessions = [prepare(scenario, nominal, world) for world in range(scenario.worlds)]
    yield sessions
    for session in sessions:
        session.world.close()


def store_run(sessions: Sequence[Session], folder: Path) -> RunStore:
    """Run every trial of the worlds and store it, as the runner does."""
    scenario = sessions[0].scenario
    store = RunStore(folder)
    store.create(scenario, describe_environment())
    with store.writing() as writer:
        for session in sessions:
            for trial in range(scenario.trials_per_world):
                results = run_trial(session, trial)
                writer.add_trial(scenario.seed, [result.record for result in results])
    return store


def plant_bias(monkeypatch: pytest.MonkeyPatch, axis: str, mm: float) -> None:
    """The first look's corrected poses put the camera beside where it should be, along its axis."""
    relocate: Callable[..., Correction] = trials.relocate

    def biased(looked: Looked, online: Online) -> Correction:
        correction, calibration = relocate(looked, online), online.calibration
        T_flange_camera = calibration.hand_eye.T_flange_camera
        step = T_flange_camera * translation(**{axis: mm / 1e3}) * T_flange_camera.inverse()
        views = []
        for view in correction.views:
            T_base_flange = view.T_base_flange * step
            q = calibration.arm.ik(T_base_flange, view.q, view.id)
            views.append(replace(view, T_base_flange=T_base_flange, q=q))
        return replace(correction, views=tuple(views))

    monkeypatch.setattr(trials, "relocate", biased)
