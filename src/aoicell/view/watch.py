"""Calibrates, teaches and runs a world's trials as a run does, in front of a browser."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.trial import prepare_in, run_trial, senses
from aoicell.errors import InputError, Refused
from aoicell.nominal import load_nominal
from aoicell.observation import Cell
from aoicell.pipeline import Calibration
from aoicell.scenario import Scenario, cases_of
from aoicell.sim.drawing import draw
from aoicell.sim.meshes import body_shapes
from aoicell.sim.world import World
from aoicell.targets.detector import Detector
from aoicell.view.address import invitation
from aoicell.view.display import Display
from aoicell.view.watched import Gate, WatchedCell

if TYPE_CHECKING:
    from aoicell.view.window import Window

Say = Callable[[str], None]


def watch(
    scenario: Scenario,
    say: Say,
    *,
    only: int | None = None,
    host: str = "127.0.0.1",
    port: int = 0,
    speed: float = 1.0,
    once: bool = False,
) -> list[TrialRecord]:
    """Show one world while it is calibrated, taught and put through its trials.

    The first world of the first case with all its trials; `only` shows the trial of that number
    of the run alone. `say` is told where to look. The arm moves at `speed` times its own; the
    results are those of a run. Waits for a browser before the start, and for Ctrl-C at the end;
    with `once` for neither, and it ends after the first trial. Raises InputError for a number,
    host or port that is no good.
    """
    if not speed > 0:
        raise InputError(f"--speed {speed:g}: above 0, as in 1 for the arm's own")
    Window = _window()
    scenario, world_index, trials = _chosen(scenario, only)
    trials = trials[:1] if once else trials
    nominal = scenario.fitted(load_nominal(scenario.cell_folder))
    as_built = draw(nominal, scenario.tolerances, scenario.seed, world_index)
    world, gate = World(nominal, as_built, scenario.pictures), Gate()
    cell, detector = senses(scenario, world)
    display = Display(scenario, world, detector, gate, speed)
    title = f"aoicell: {scenario.name}"
    try:
        with Window(body_shapes(world.model), gate, title, host, port) as window:
            display.show = window.show
            display.tell("waiting for a browser")
            say(invitation(window.host, window.port))
            if not once:
                window.wait_for_browser()
            watched = WatchedCell(cell, display)
            _run(scenario, world, watched, detector, display, trials)
            display.tell("finished")
            if not once:
                _wait_for_ctrl_c()
    except KeyboardInterrupt:
        say("stopped")
    finally:
        world.close()
    return display.records


def _window() -> "type[Window]":
    """Only here, since viser is an optional extra."""
    try:
        from aoicell.view.window import Window
    except ImportError as error:
        raise InputError(
            f"view: {error.name or 'viser'} is not installed; 'pip install \"aoicell[view]\"' "
            "brings it"
        ) from None
    return Window


def _wait_for_ctrl_c() -> None:
    while True:
        time.sleep(3600)


def _chosen(scenario: Scenario, only: int | None) -> tuple[Scenario, int, Sequence[int]]:
    """The case, the world in it, and the trials in that."""
    cases = [case.scenario for case in cases_of(scenario)]
    if only is None:
        return cases[0], 0, range(cases[0].trials_per_world)
    total = sum(case.trials for case in cases)
    if not 0 <= only < total:
        raise InputError(f"--only {only}: the scenario's trials have the numbers 0 to {total - 1}")
    for case in cases:
        if only < case.trials:
            break
        only -= case.trials
    world, trial = divmod(only, case.trials_per_world)
    return case, world, [trial]


def _run(
    scenario: Scenario, world: World, cell: Cell, detector: Detector, display: Display,
    trials: Sequence[int],
) -> None:  # fmt: skip
    """Calibration, teaching and trials, each told to the display."""

    def tell(phase: str, calibrations: Mapping[str, Calibration]) -> None:
        known = list(calibrations.values())
        display.tell(phase, calibrating=not known, calibration=known[-1] if known else None)

    try:
        session = prepare_in(world, cell, detector, scenario, tell=tell)
    except Refused as refusal:
        display.tell(f"refused: {refusal}")
        return
    for trial in trials:
        for name, method in session.methods.items():  # one at a time: the display tells which
            display.begin(session, trial, name)
            [result] = run_trial(replace(session, methods={name: method}), trial)
            display.end(result.record)
