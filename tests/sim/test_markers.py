"""The chosen markers are what the world shows, with and without pictures."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.observation import Observation
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL
from aoicell.sim.projection import NOISE_OVER_CROSS, DetectionNoise, ProjectingDetector
from aoicell.sim.world import World
from aoicell.targets.detector import IN_PICTURES
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.targets.pose import rms
from aoicell.transforms import Array

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]


@pytest.fixture(params=["coded", "charuco"])
def coded_world(request: pytest.FixtureRequest, nominal: Nominal) -> Iterator[World]:
    changed = nominal.with_markers(request.param)
    world = World(changed, draw(changed, IDEAL, seed=0))
    yield world
    world.close()


def overview(world: World, poses: Mapping[str, Array]) -> Observation:
    cell = SimCell(world)
    cell.move(poses["overview"])
    return cell.capture()


def by_centre(seen: list[MarkerSighting]) -> list[MarkerSighting]:
    return sorted(seen, key=lambda s: tuple(s.uv_px.mean(axis=0)))


def test_pictures_and_projection_tell_the_same(
    coded_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    shown, marker = overview(coded_world, taught_poses(nominal)), coded_world.nominal.marker
    projected = ProjectingDetector(coded_world, DetectionNoise())
    seen = by_centre(IN_PICTURES.sightings(shown, marker, coded_world.camera("hand")))
    expected = by_centre(projected.sightings(shown, marker))
    assert [s.code for s in seen] == [s.code for s in expected]
    assert len(seen) == 4
    for found, true in zip(seen, expected, strict=True):
        assert rms(found.uv_px - true.uv_px) < 0.06
    for true, uv in zip(expected, by_centre(projected.sightings(shown, marker)), strict=True):
        np.testing.assert_array_equal(true.uv_px, uv.uv_px)


def test_projected_sightings_state_their_noise(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    shown = overview(ideal_world, taught_poses(nominal))
    noise = DetectionNoise(cross_px=0.03, cross_dust=40e-6)
    for seen in ProjectingDetector(ideal_world, noise).sightings(shown, nominal.marker):
        assert seen.code is None
        expected = np.hypot(0.03, 40e-6 * 2667 / 1.15)
        np.testing.assert_allclose(seen.sigma_px, expected, rtol=0.05)


@pytest.mark.parametrize("kind", NOISE_OVER_CROSS)
def test_each_kind_has_its_own_noise(
    kind: str, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    changed = nominal.with_markers(kind)
    world = World(changed, draw(changed, IDEAL, seed=0), pictures=False)
    world.arrive(taught_poses(nominal)["overview"])
    shown = world.observe(Observation(np.zeros((0, 0), np.uint8), SimCell(world).state(), "hand"))
    exact, noisy = (
        np.concatenate(
            [s.uv_px for s in ProjectingDetector(world, n).sightings(shown, changed.marker)]
        )
        for n in (DetectionNoise(), DetectionNoise(cross_px=0.1))
    )
    spread = float(np.sqrt(np.mean((noisy - exact) ** 2)))
    assert spread == pytest.approx(0.1 * NOISE_OVER_CROSS[kind].sensor, rel=0.4)
    world.close()
