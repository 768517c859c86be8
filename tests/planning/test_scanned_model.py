"""From depth images of known boxes to a model of the board. Needs the extra `scan`."""

import numpy as np
import pytest
import trimesh

from aoicell.errors import InputError, Refused
from aoicell.planning.fusion import FusionConfig, fuse, open3d
from aoicell.planning.meshes import read_mesh
from aoicell.planning.scan import ScanArea
from aoicell.planning.scanned_model import ModelConfig, build_model
from aoicell.transforms import apply, from_xyz_rpy, translation
from planning.seen_boxes import scan_of

pytest.importorskip("open3d", reason="Open3D is not installed: pip install 'aoicell[scan]'")

T_BASE_AREA = from_xyz_rpy([0.3, 0.8, 0.4], [0.02, -0.01, 1.5])
AREA = ScanArea(T_BASE_AREA, 0.13, 0.11, 0.03)
CONFIG = ModelConfig(fusion=FusionConfig(voxel=0.00075))
TABLE = ([-0.3, -0.3, -0.01], [0.3, 0.3, 0.0], (90, 90, 90))
PCB = ([-0.04, -0.03, 0.004], [0.04, 0.03, 0.006], (0, 120, 0))
TALL = ([-0.03, 0.005, 0.006], [-0.015, 0.015, 0.016], (200, 0, 0))
FLAT = ([0.01, -0.02, 0.006], [0.025, -0.010, 0.009], (0, 0, 200))


def flange(state):
    return state.T_base_flange


@pytest.fixture(scope="module")
def model():
    return build_model(scan_of([TABLE, PCB, TALL, FLAT], T_BASE_AREA), flange, AREA, CONFIG)


def test_the_board_is_found_in_base(model):
    off = (T_BASE_AREA * translation(z=0.006)).actInv(model.T_base_board)
    assert np.abs(off.translation).max() < 4e-4
    assert off.rotation == pytest.approx(np.eye(3), abs=5e-3)
    assert model.board.size == pytest.approx((0.08, 0.06, 0.006), abs=1e-3)


def test_its_parts_are_bumps(model):
    tall, flat = model.bumps
    assert (tall.x, tall.y, tall.height) == pytest.approx((-0.0225, 0.01, 0.010), abs=4e-4)
    assert (flat.x, flat.y, flat.height) == pytest.approx((0.0175, -0.015, 0.003), abs=4e-4)
    assert (tall.width, tall.depth) == pytest.approx((0.015, 0.010), abs=1e-3)


def test_the_photo_has_the_colours_from_above(model):
    for x, y, rgb in ((-0.0225, 0.01, (200, 0, 0)), (0.0175, -0.015, (0, 0, 200)),
                      (0.03, 0.02, (0, 120, 0))):  # fmt: skip
        column, row = np.rint((np.array([x, y]) - model.heights.origin) / model.heights.cell)
        assert model.photo[int(row), int(column)] == pytest.approx(rgb, abs=3)


def test_uv_are_the_places_in_the_photo(model):
    red = (model.photo[..., 0] > 150) & (model.photo[..., 2] < 50)
    rows, columns = red.shape
    low, high = ([-0.028, 0.007], [-0.017, 0.013])
    xy = model.surface.vertices[:, :2]
    inside = ((xy > low) & (xy < high)).all(axis=1) & (model.surface.vertices[:, 2] > 0.009)
    places = (model.uv[inside] * [columns, rows]).astype(int)
    assert inside.sum() > 20
    assert red[places[:, 1], places[:, 0]].mean() > 0.95


def test_the_table_is_not_part_of_the_surface(model):
    assert model.surface.vertices[:, 2].min() > -0.004
    assert np.abs(model.surface.vertices[:, 0]).max() < 0.05


def test_files_are_read_as_planning_reads_meshes(model, tmp_path):
    model.write_mesh(tmp_path / "model.ply")
    mesh = read_mesh(tmp_path / "model.ply")  # in metres, about its middle
    assert mesh.size == pytest.approx((0.08, 0.06, mesh.size[2]), abs=1.5e-3)
    first = model.rows()[0]
    assert first["designator"] == "B001"
    near = np.hypot(*(mesh.vertices[:, :2] * 1e3 - [first["x_mm"], first["y_mm"]]).T) < 3
    assert mesh.vertices[near, 2].max() == pytest.approx(0, abs=4e-4)  # the tall one's top
    colours = trimesh.load(tmp_path / "model.ply").visual.vertex_colors
    assert colours[near & (mesh.vertices[:, 2] > -0.001), 0].mean() > 150


def test_a_wrong_hand_eye_moves_the_board_with_it():
    wrong = translation(0.005, 0, 0)

    def shifted(state):
        return state.T_base_flange * wrong  # along the camera's own x

    surface = fuse(scan_of([TABLE, PCB, TALL], T_BASE_AREA), shifted, AREA, CONFIG.fusion)
    high = surface.vertices[surface.vertices[:, 2] > 0.0155]
    assert np.median(high[:, 0]) == pytest.approx(-0.0225 + 0.005, abs=1.5e-3)


def test_the_surface_is_that_of_the_boxes():
    surface = fuse(scan_of([TABLE, PCB, TALL], T_BASE_AREA), flange, AREA, CONFIG.fusion)
    x, y, z = surface.vertices.T
    inner = (np.abs(x) < 0.035) & (np.abs(y) < 0.025) & (y < 0) & (z < 0.008)
    assert z[inner] == pytest.approx(0.006, abs=3e-4)
    normals = trimesh.Trimesh(surface.vertices, surface.faces, process=False).face_normals
    assert np.median(normals[:, 2]) > 0.9  # outward is up
    moved = surface.moved(T_BASE_AREA)
    assert moved.vertices == pytest.approx(apply(T_BASE_AREA, surface.vertices))


def test_an_empty_area_is_refused():
    images = scan_of([TABLE, PCB], T_BASE_AREA)
    elsewhere = ScanArea(T_BASE_AREA * translation(z=1.0), 0.1, 0.1, 0.05)
    with pytest.raises(Refused, match="no surface inside the scan area"):
        fuse(images, flange, elsewhere, CONFIG.fusion)


@pytest.mark.parametrize("voxel", [0.0, 1e-5, 0.1])
def test_a_senseless_voxel_is_named(voxel):
    with pytest.raises(InputError, match="voxel"):
        FusionConfig(voxel=voxel)


def test_the_library_is_there():
    assert hasattr(open3d(), "t")
