"""What is made to go wrong: it shows as it should, and leaves nothing behind."""

from collections.abc import Iterator

import numpy as np
import pytest
from conftest import TaughtPoses

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.sim.adversity import BOARD, CAUSES, Adversity, Cause, draw_adversity, injected
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL
from aoicell.sim.props import PROPS
from aoicell.sim.spoiling import Blur, Reflection
from aoicell.sim.world import World
from aoicell.targets.marker import sight_markers
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, from_rvec, translation

KNOCK = from_rvec([0.002, -0.001, 0.003], [0.001, 0.0005, -0.0007])


@pytest.fixture(scope="module")
def world(nominal: Nominal, taught_poses: TaughtPoses) -> Iterator[World]:
    """Above the board, with all that could get in the way put away."""
    world = World(nominal, draw(nominal, IDEAL, seed=0), props=True)
    world.arrive(taught_poses(nominal)["overview"])
    yield world
    world.close()


def picture(world: World) -> Array:
    """The first of a trial, from where the arm is."""
    world._pictures = BOARD
    return world.picture("hand").astype(float)


@pytest.fixture(scope="module")
def untouched(world: World) -> Array:
    """That picture, before anything went wrong."""
    return picture(world)


def changed(before: Array, after: Array) -> float:
    """Share of pixels that are not what they were."""
    return float((np.abs(after - before) > 3).mean())


@pytest.mark.parametrize("cause", CAUSES)
def test_a_cause_leaves_nothing_behind(world: World, untouched: Array, cause: Cause) -> None:
    T, camera = world.truth().T_base_camera, world.camera("hand")
    with injected(world, draw_adversity(cause, world, np.random.default_rng(4))):
        pass
    assert (picture(world) == untouched).all()
    assert world.truth().T_base_camera == T
    assert world.camera("hand") is camera


@pytest.mark.parametrize("cause", [c for c in CAUSES if c not in ("none", "out_of_range")])
def test_every_cause_shows(world: World, untouched: Array, cause: Cause) -> None:
    shown = []
    for seed in range(2):
        with injected(world, draw_adversity(cause, world, np.random.default_rng(seed))):
            shown.append(changed(untouched, picture(world)))
    assert max(shown) > 0.003


def test_the_same_draw_is_the_same(world: World) -> None:
    first, again = (
        draw_adversity("second_board", world, np.random.default_rng(5)) for _ in range(2)
    )
    other = draw_adversity("second_board", world, np.random.default_rng(6))
    assert first.props == again.props
    assert first.props != other.props


def test_only_what_is_out_is_seen(world: World, untouched: Array) -> None:
    with injected(world, Adversity("occlusion", props={"cable": translation(z=-3.0)})):
        assert changed(untouched, picture(world)) == 0  # the others are not in the way meanwhile
    for prop in PROPS:
        T = world.T_base_board * translation(z=0.03)
        with injected(world, Adversity("occlusion", props={prop: T})):
            assert changed(untouched, picture(world)) > 0.001, prop


def detected(world: World) -> Array:
    """Crosses (16, 2) px of the board's markers as detected, nearest to where they truly are."""
    grey = picture(world).astype(np.uint8)
    found = np.concatenate([s.uv_px for s in sight_markers(world.nominal.marker, grey)])
    true = true_crosses(world)
    return np.array([found[np.linalg.norm(found - uv, axis=1).argmin()] for uv in true])


def true_crosses(world: World) -> Array:
    markers = world.geometry.Ts_board_marker
    return np.concatenate([world.project(world.marker_crosses(id)) for id in markers])


@pytest.mark.parametrize(
    "adversity",
    [
        Adversity("moved_camera", T_camera_moved=KNOCK),
        Adversity("stale_calibration", focal=1.004),
        Adversity("stale_calibration", principal_px=(6.0, -4.0)),
    ],
)
def test_pictures_show_the_changed_camera(world: World, adversity: Adversity) -> None:
    as_taught = true_crosses(world)
    with injected(world, adversity):
        now = true_crosses(world)
        assert np.linalg.norm(now - as_taught, axis=1).max() > 1
        assert np.linalg.norm(detected(world) - now, axis=1).max() < 0.08


def test_the_camera_is_moved_in_its_own_axes(world: World) -> None:
    T = world.truth().T_base_camera
    with injected(world, Adversity("moved_camera", T_camera_moved=KNOCK)):
        moved = world.truth().T_base_camera
    assert distance_mm(moved, T * KNOCK) < 1e-9
    assert distance_deg(moved, T * KNOCK) < 1e-6


def test_the_lens_drifts_by_what_is_said(world: World) -> None:
    before: Camera = world.camera("hand")
    with injected(world, Adversity("stale_calibration", focal=1.002, principal_px=(3.0, 1.0))):
        after = world.camera("hand")
        np.testing.assert_allclose(np.diag(after.K)[:2], np.diag(before.K)[:2] * 1.002)
        np.testing.assert_allclose(after.K[:2, 2] - before.K[:2, 2], [3.0, 1.0])


def test_a_reflection_is_where_the_lamp_is(world: World, untouched: Array) -> None:
    place = world.T_base_board.act(np.array([0.05, 0.03, 0.0]))
    with injected(world, Adversity("glare", spoils=((BOARD, Reflection(place, 0.004, 3000)),))):
        after = picture(world)
    v, u = np.argwhere((after == 255) & (untouched < 255)).mean(axis=0)
    np.testing.assert_allclose([u, v], world.project([[0.05, 0.03, 0.0]])[0], atol=2)
    assert (after >= untouched).all()


def test_a_spoiled_picture_is_that_one_alone(world: World, untouched: Array) -> None:
    with injected(world, Adversity("blur", spoils=((BOARD + 1, Blur(sigma_px=6)),))):
        assert changed(untouched, picture(world)) == 0


def test_blur_runs_along_its_motion() -> None:
    dot = np.zeros((41, 41, 3), dtype=np.uint8)
    dot[20, 20] = 255
    moved = Blur(motion_px=(9.0, 0.0))(dot, SE3.Identity(), 1000.0)[:, :, 0].astype(float)
    v, u = np.mgrid[:41, :41] - 20
    assert (moved * u**2).sum() > 5 * moved.sum()
    assert (moved * v**2).sum() < 0.5 * moved.sum()
