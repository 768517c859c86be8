"""Cells that are calibrated and taught once in a test run: a plugin with session fixtures.

A test module asks for them with `pytest_plugins = ["helpers.sessions"]`.
"""

from collections.abc import Iterator

import pytest

from aoicell.benchmark.trial import Session, prepare
from aoicell.nominal import Nominal
from aoicell.pipeline import (
    METHODS,
    calibrate,
    photograph_board,
    photograph_targets,
    teach,
)
from aoicell.resources import find
from aoicell.scenario import Scenario, load_scenario
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL
from aoicell.sim.world import World
from aoicell.targets.detector import IN_PICTURES, Remembering
from helpers.fence import fenced
from helpers.figures import png_alone
from helpers.running import Rehearsal, Run, run_cli


@pytest.fixture(scope="session")
def ideal_rehearsal(nominal: Nominal) -> Iterator[Rehearsal]:
    scenario = Scenario(
        name="twenty",
        profile="ideal",
        trials_per_world=20,
        displacement={"shift_mm": {"min": 0, "max": 60}},  # type: ignore[arg-type]
    )
    world = World(nominal, draw(nominal, IDEAL, scenario.seed))
    cell, detector = fenced(SimCell(world)), Remembering(IN_PICTURES)
    methods = [method for method in METHODS.values() if method.name != "uncorrected"]
    pictures = photograph_targets(cell, nominal)
    calibrations = calibrate(pictures, nominal, methods, detector)
    taught = photograph_board(cell, nominal)
    templates = {m.name: teach(taught, calibrations[m.name], nominal, m, detector) for m in methods}
    session = Session(
        scenario,
        nominal,
        world,
        cell,
        detector,
        {m.name: m for m in methods},
        calibrations,
        taught,
        templates,
        world.T_base_board,
    )
    yield Rehearsal(session, pictures)
    world.close()


@pytest.fixture(scope="session")
def ideal_session(ideal_rehearsal: Rehearsal) -> Session:
    """Profile `ideal`, behind the fence."""
    return ideal_rehearsal.session


@pytest.fixture(scope="session")
def paper_session(nominal: Nominal) -> Iterator[Session]:
    """The demo's own world, with the methods in the other order."""
    scenario = load_scenario(find("scenarios", "two_tests"))
    reversed_methods = {"methods": scenario.methods[::-1]}
    session = prepare(scenario.model_copy(update=reversed_methods), nominal, 0)
    yield session
    session.world.close()


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """`aoicell demo --json`, once."""
    folder = tmp_path_factory.mktemp("demo") / "run"
    with png_alone():
        return run_cli("demo", "--json", "--out", folder, folder=folder)


@pytest.fixture(scope="session")
def doctor_run() -> Run:
    """`aoicell doctor --json`, once."""
    return run_cli("doctor", "--json")
