import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.nominal import View
from aoicell.planning.fusion import Surface
from aoicell.planning.heights import HeightField
from aoicell.planning.scanned_board import ScannedBoard
from aoicell.planning.scanned_model import ScannedModel
from aoicell.sim.mesh_twin import BACKGROUND, MeshTwin
from aoicell.transforms import SE3, from_xyz_rpy

CAMERA = Camera.pinhole(500.0, 320, 240)
CELL = 0.001
COLOURS = {(-1, -1): (200, 30, 30), (1, -1): (30, 200, 30), (-1, 1): (30, 30, 200),
           (1, 1): (200, 200, 30)}  # fmt: skip


@pytest.fixture(scope="module")
def twin():
    """A plate of 0.1 x 0.08 m with a colour of its own in each quarter."""
    rows, columns = 80, 100
    origin = (-(columns - 1) / 2 * CELL, -(rows - 1) / 2 * CELL)
    photo = np.zeros((rows, columns, 3), np.uint8)
    for (x, y), rgb in COLOURS.items():
        photo[
            40 if y > 0 else 0 : 80 if y > 0 else 40, 50 if x > 0 else 0 : 100 if x > 0 else 50
        ] = rgb
    n = 20
    u, v = np.meshgrid(np.linspace(-0.05, 0.05, n + 1), np.linspace(-0.04, 0.04, n + 1))
    vertices = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)])
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    model = ScannedModel(
        SE3.Identity(), ScannedBoard(SE3.Identity(), (0.1, 0.08, 0.01), np.zeros((0, 2)), 0.0),
        Surface(vertices, faces), HeightField(np.zeros((rows, columns)), origin, CELL), photo, (),
    )  # fmt: skip
    twin = MeshTwin(model, CAMERA)
    yield twin
    twin.close()


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.3, -0.2)])
def test_colours_are_where_the_camera_model_projects_them(twin, tilt):
    view = View("v", 0.25, tilt, 0.4, (0.005, -0.003, 0.0))
    T_base_board = from_xyz_rpy([0.4, 0.7, 0.2], [0.05, 0.1, 0.8])
    image = twin.render(T_base_board * view.T_target_camera, T_base_board)
    assert image.shape == (240, 320, 3)
    for (x, y), rgb in COLOURS.items():
        for fx, fy in ((0.5, 0.5), (0.94, 0.92), (0.06, 0.08)):
            point = np.array([[x * 0.05 * fx, y * 0.04 * fy, 0.0]])
            u, v = np.rint(CAMERA.project(point, view.T_target_camera.inverse())[0]).astype(int)
            assert image[v, u] == pytest.approx(rgb, abs=6)


def test_its_edge_is_where_the_camera_model_projects_it(twin):
    view = View("v", 0.25)
    image = twin.render(view.T_target_camera, SE3.Identity())
    lit = np.abs(image.astype(int) - BACKGROUND).sum(axis=2) > 20
    columns = np.flatnonzero(lit[120])
    left, right = CAMERA.project(
        np.array([[-0.05, 0, 0], [0.05, 0, 0]]), view.T_target_camera.inverse()
    )[:, 0]
    assert (columns[0], columns[-1]) == pytest.approx((left, right), abs=0.8)
