"""The boards that the tests look at: a painted one, and one of the simulated cell."""

from collections.abc import Iterator

import numpy as np
import pytest

from aoicell.inspection import Reference, ViewInspection, inspect_view
from aoicell.inspection.virtual_picture import drawing
from aoicell.nominal import Nominal
from aoicell.sim.drawing import draw
from aoicell.sim.population import draw_scatter, populated
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.twin import NominalTwin
from aoicell.sim.world import World
from inspection.flat_boards import Flat, flat_board, flat_reference, painted
from inspection.scenes import DEFECTS, Look, Scene


@pytest.fixture(scope="session")
def flat() -> Flat:
    """The painted board and its standard image."""
    board = flat_board()
    plane = painted(board)
    plane.setflags(write=False)
    return Flat(board, plane, flat_reference(plane))


@pytest.fixture(scope="session")
def scene(nominal: Nominal) -> Iterator[Scene]:
    """A drawn cell."""
    world = World(nominal, draw(nominal, TYPICAL, seed=0))
    world.begin()
    yield Scene(world)
    world.close()


@pytest.fixture(scope="session")
def taught(scene: Scene) -> Look:
    """The taught board from view V3."""
    return scene.look("V3")


@pytest.fixture(scope="session")
def twin(nominal: Nominal) -> Iterator[NominalTwin]:
    """The cell as designed."""
    twin = NominalTwin(nominal)
    yield twin
    twin.close()


@pytest.fixture(scope="session")
def reference(taught: Look, twin: NominalTwin, nominal: Nominal) -> Reference:
    """The standard of V3, with the design as drawn for it."""
    pose = (taught.T_base_camera, taught.T_camera_board)
    drawn = drawing(twin, nominal.cameras["hand"], taught.camera, *pose)
    return Reference("V3", (taught.grey,), taught.T_camera_board, taught.camera, drawing=drawn)


@pytest.fixture(scope="session")
def golden(scene: Scene) -> Look:
    """Another good board in the taught one's place."""
    board = scene.world.nominal.board
    return scene.look("V3", populated(board, (), draw_scatter(board, 0, 0, 1000)))


@pytest.fixture(scope="session")
def spoilt(scene: Scene, golden: Look) -> Look:
    """A board with `DEFECTS`, seen from slightly elsewhere; all else varies as good boards do."""
    board = scene.world.nominal.board
    population = populated(board, DEFECTS, draw_scatter(board, 0, 0, 0))
    return scene.look("V3", population, np.radians([0.1, -0.05, 0.08, 0.1, -0.1, 0.3]))


@pytest.fixture(scope="session")
def inspected(spoilt: Look, reference: Reference, nominal: Nominal) -> ViewInspection:
    """What is found on the board with `DEFECTS`."""
    return inspect_view(spoilt.grey, reference, nominal.board)
