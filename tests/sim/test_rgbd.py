from dataclasses import replace

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.nominal import View, load_nominal
from aoicell.pipeline import flange_target
from aoicell.planning.depth import DepthImage
from aoicell.resources import data_root
from aoicell.sim.depth_noise import STRUCTURED_LIGHT
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL, TYPICAL
from aoicell.sim.rgbd import RgbdCell, with_rgbd
from aoicell.sim.world import World
from aoicell.transforms import apply

CAMERA = Camera.pinhole(450.0, 480, 300)
SENSOR = replace(STRUCTURED_LIGHT, camera=CAMERA)
EXACT = replace(SENSOR, disparity_sigma_px=0.0, lateral_sigma_px=0.0, depth_step=1e-9, trueness=0.0)
VIEW = View("from the side", 0.45, (0.25, -0.15), 0.3, (0.02, 0.03, 0.0))


def image_of(sensor, tolerances, seed=0):
    """A depth image of the board from the side, and the world that it shows."""
    nominal = with_rgbd(load_nominal(data_root() / "cell"), sensor)
    world = World(nominal, draw(nominal, tolerances, seed))
    cell = RgbdCell(world, sensor)
    cell.move(flange_target(nominal, nominal.T_base_board, VIEW, nominal.q_home))
    image = cell.capture_depth()
    cell.close()
    world.close()
    return image, world


@pytest.fixture(scope="module")
def exact() -> tuple[DepthImage, World]:
    return image_of(EXACT, IDEAL)


@pytest.fixture(scope="module")
def typical() -> tuple[DepthImage, World]:
    return image_of(SENSOR, TYPICAL)


def test_depth_and_colour_have_the_size_of_the_sensor(exact):
    image, _ = exact
    assert image.depth.shape == (CAMERA.height, CAMERA.width)
    assert image.colour.shape == (CAMERA.height, CAMERA.width, 3)
    assert image.camera.focal_px == pytest.approx(CAMERA.focal_px, rel=1e-6)


def test_the_points_lie_where_the_board_is(exact):
    image, world = exact
    T_board_camera = world.truth().T_camera_board.inverse()
    points = apply(T_board_camera, image.points())
    x, y, z = np.moveaxis(points, 2, 0)
    for marker in world.nominal.board.markers:
        inside = np.hypot(x - marker.x, y - marker.y) < 0.02
        if inside.sum() > 100:
            assert z[inside] == pytest.approx(marker.z, abs=3e-5)
            break
    else:
        pytest.fail("no marker is in the picture")
    top = world.nominal.board.component("HS2").top
    assert np.nanmax(z) == pytest.approx(top, abs=1e-4)


def test_edges_in_depth_and_colour_are_at_the_same_pixels(exact):
    image, world = exact
    corner = np.array([[*(-0.5 * np.array(world.nominal.board.size[:2])), 0.0]])
    for sign in ([1, 1], [1, -1], [-1, 1], [-1, -1]):
        uv = world.project(corner * [*sign, 1])[0]
        if (uv > 5).all() and (uv < [CAMERA.width - 6, CAMERA.height - 6]).all():
            u, v = np.rint(uv).astype(int)
            patch = np.s_[v - 4 : v + 5, u - 4 : u + 5]
            green = image.colour[patch][..., 1] > image.colour[patch][..., 0] + 20
            higher = image.depth[patch] < np.nanmax(image.depth[patch]) - 0.006
            seen = np.isfinite(image.depth[patch])
            assert (green == higher)[seen].mean() > 0.85
            return
    pytest.fail("no corner of the board is in the picture")


def test_a_typical_device_is_a_little_off_and_noisy(exact, typical):
    (clean, _), (noisy, world) = exact, typical
    assert noisy.camera.focal_px != pytest.approx(world.camera("hand").focal_px, rel=1e-5)
    assert noisy.camera.focal_px == pytest.approx(world.camera("hand").focal_px, rel=6e-3)
    assert np.isnan(noisy.depth).mean() > np.isnan(clean.depth).mean()


def test_the_controllers_pose_is_that_of_its_nominal_kinematics(typical):
    image, world = typical
    fk = world.nominal.arm.fk(image.state.q)
    assert image.state.T_base_flange.homogeneous == pytest.approx(fk.homogeneous)


def test_the_same_seed_gives_the_same_image_and_another_seed_another_one(typical):
    first, _ = typical
    again, other = (image_of(SENSOR, TYPICAL, seed)[0] for seed in (0, 1))
    assert np.array_equal(first.depth, again.depth, equal_nan=True)
    assert np.array_equal(first.colour, again.colour)
    assert not np.array_equal(first.depth, other.depth, equal_nan=True)
