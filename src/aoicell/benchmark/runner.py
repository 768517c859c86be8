"""Runs a scenario: worlds one after the other, trials within them, records into a store."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from aoicell.benchmark.environment import describe_environment
from aoicell.benchmark.records import TrialRecord, WorldRecord
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.summary import summarise
from aoicell.benchmark.trial import Session, describe, prepare, refused_world, run_trial
from aoicell.errors import Refused
from aoicell.nominal import load_nominal
from aoicell.scenario import Scenario

Progress = Callable[[str, int, int], None]  # what is being done, trials done, trials in all


def run_scenario(scenario: Scenario, folder: Path, progress: Progress) -> dict[str, Any]:
    """Run all trials, leave the run directory behind and return its summary."""
    store = RunStore(folder)
    store.create(scenario, {**describe_environment(), "seed": scenario.seed})
    nominal = load_nominal(scenario.cell_folder)
    trials: list[TrialRecord] = []
    worlds: list[WorldRecord] = []
    render_seconds, start = 0.0, time.perf_counter()
    for index in range(scenario.worlds):
        progress(f"world {index + 1}: calibrating and teaching", len(trials), scenario.trials)
        try:
            session = prepare(scenario, nominal, index)
        except Refused as refusal:
            if scenario.worlds == 1:
                raise
            trials += refused_world(scenario, index, refusal)
            for record in trials[-scenario.trials_per_world * len(scenario.methods) :]:
                store.add_trial(record)
            continue
        worlds.append(describe(session))
        store.add_world(worlds[-1])
        _keep_standards(store, session)
        for trial in range(scenario.trials_per_world):
            done = index * scenario.trials_per_world + trial
            progress(f"world {index + 1}, trial {trial + 1}", done, scenario.trials)
            for result in run_trial(session, trial):
                trials.append(result.record)
                store.add_trial(result.record)
                if scenario.store.images:
                    for view, image in result.images.items():
                        name = store.image_path(index, view, trial, result.record.method)
                        store.add_image(name, image)
        render_seconds += session.world.render_seconds
        session.world.close()
    seconds = time.perf_counter() - start
    progress("done", scenario.trials, scenario.trials)
    summary = summarise(
        scenario, worlds, trials, scenario.trials / seconds, render_seconds / seconds
    )
    store.write_json("summary.json", summary)
    return summary


def _keep_standards(store: RunStore, session: Session) -> None:
    if session.scenario.store.images:
        for view in session.taught.views:
            path = store.image_path(session.world.as_built.world, view.id)
            store.add_image(path, view.standard)
