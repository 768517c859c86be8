"""The drift of a line: as much as stated, in one direction, and no trace of what was before."""

from collections.abc import Iterator

import numpy as np
import pytest
from conftest import TaughtPoses

from aoicell.nominal import Nominal
from aoicell.sim.drawing import draw
from aoicell.sim.drift import CellDrift, DriftRates
from aoicell.sim.profiles import TYPICAL
from aoicell.sim.world import World
from aoicell.transforms import angle_of, distance_deg, distance_mm

RATES = DriftRates(mount_mm=0.2, mount_deg=0.03, light_percent=10, light_deg=2)


@pytest.fixture(scope="module")
def world(nominal: Nominal) -> Iterator[World]:
    world = World(nominal, draw(nominal, TYPICAL, seed=3))
    yield world
    world.close()


def lamps(world: World) -> np.ndarray:
    model, head = world.model, world.model.vis.headlight
    return np.concatenate(
        [model.light_ambient.ravel(), model.light_diffuse.ravel(), model.light_specular.ravel(),
         model.light_dir.ravel(), head.ambient, head.diffuse, head.specular]
    )  # fmt: skip


@pytest.mark.parametrize("boards", [50, 100, 400])
def test_the_mount_creeps_by_what_is_stated(world: World, boards: int) -> None:
    drift = CellDrift(world, RATES, seed=1)
    drift.apply(boards)
    built = world.as_built.geometry.T_flange_camera
    assert distance_mm(world.geometry.T_flange_camera, built) == pytest.approx(0.002 * boards)
    turn = distance_deg(world.geometry.T_flange_camera, built)
    assert turn == pytest.approx(0.0003 * boards, rel=1e-6)
    seen = world.T_base_body("arm/flange").actInv(world.T_base_body("hand"))
    assert distance_mm(seen, world.geometry.T_flange_camera) < 1e-6


def test_it_goes_on_in_the_direction_in_which_it_began(world: World) -> None:
    drift = CellDrift(world, RATES, seed=1)
    one, two = (drift.T_camera_moved(board) for board in (100, 200))
    np.testing.assert_allclose(two.translation, 2 * one.translation)
    np.testing.assert_allclose((one * one).rotation, two.rotation, atol=1e-12)


def test_the_lamps_change_by_what_is_stated(world: World) -> None:
    drift, built = CellDrift(world, RATES, seed=1), world.as_built.light
    light = drift.light(100)
    assert abs(light.level / built.level - 1) == pytest.approx(0.1)
    drift.apply(100)
    before = world.model.light_dir.copy()
    drift.apply(0)
    for now, then in zip(world.model.light_dir, before, strict=True):
        # about an axis that may lie anywhere, a lamp's direction changes by no more than the turn
        assert np.degrees(np.arccos(np.clip(now @ then, -1, 1))) < 2 + 1e-6
    assert np.abs(before - world.model.light_dir).max() > 1e-3
    assert (light.gradient, light.flicker) == (built.gradient, built.flicker)


def test_lamps_that_were_changed_shine_as_if_compiled_so(world: World) -> None:
    drift = CellDrift(world, RATES, seed=1)
    for board in (300, 20, 70):  # whatever was before
        drift.apply(board)
    changed = lamps(world)
    world._compile()  # with the light that it has now
    np.testing.assert_array_equal(changed, lamps(world))
    drift.apply(0)
    assert world.light == world.as_built.light
    assert np.abs(lamps(world) - changed).max() > 1e-3


def test_a_brighter_lamp_makes_a_brighter_picture(world: World, taught_poses: TaughtPoses) -> None:
    world.arrive(taught_poses(world.nominal)["start"])  # above the table
    drift = CellDrift(world, DriftRates(light_percent=20), seed=1)
    drift.apply(0)
    before = float(world.pinhole_picture("hand").mean())
    drift.apply(100)
    ratio = drift.light(100).level / drift.light(0).level
    after = float(world.pinhole_picture("hand").mean())
    drift.apply(0)
    assert after / before == pytest.approx(ratio, abs=0.03)


def test_directions_hang_on_the_seed_alone(world: World) -> None:
    first, again = (CellDrift(world, RATES, seed=1).T_camera_moved(100) for _ in range(2))
    other = CellDrift(world, RATES, seed=2).T_camera_moved(100)
    faster = CellDrift(world, DriftRates(mount_mm=2), seed=1).T_camera_moved(100)
    assert first == again
    assert np.linalg.norm(first.translation - other.translation) > 1e-5
    np.testing.assert_allclose(faster.translation, 10 * first.translation, atol=1e-15)
    assert angle_of(faster) == 0
