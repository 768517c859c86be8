"""The cell of the line's tests, calibrated and taught once."""

from collections.abc import Iterator

import pytest
from helpers.fence import fenced

from aoicell.benchmark.trial import prepare_in, senses
from aoicell.nominal import Nominal
from aoicell.sim.drawing import draw
from aoicell.sim.world import World
from line.cells import SCENARIO, TaughtCell


@pytest.fixture(scope="session")
def _taught_cell(nominal: Nominal) -> Iterator[TaughtCell]:
    world = World(nominal, draw(nominal, SCENARIO.tolerances, SCENARIO.seed), pictures=False)
    cell, detector = senses(SCENARIO, world)
    session = prepare_in(world, fenced(cell), detector, SCENARIO)
    yield TaughtCell(session, session.online("aoicell"))
    world.close()


@pytest.fixture
def taught_cell(_taught_cell: TaughtCell) -> Iterator[TaughtCell]:
    """At rest as it was built; whatever a test does to it is undone."""
    _taught_cell.rewind()
    yield _taught_cell
    _taught_cell.rewind()
