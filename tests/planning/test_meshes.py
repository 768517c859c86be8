"""A mesh as the board: units, frame, relief, targets, and its virtual image."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from aoicell.errors import InputError
from aoicell.nominal import Nominal, View
from aoicell.planning.heights import HeightField
from aoicell.planning.meshes import (
    BoardMesh,
    cell_with,
    grid_features,
    heights_of_mesh,
    read_mesh,
)
from aoicell.planning.virtual import virtual_images
from aoicell.sim.twin import NominalTwin


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plate of 200 x 120 x 10 mm off its origin, with a block of 40 x 40 x 30 mm on its left."""
    plate = trimesh.creation.box((200, 120, 10))
    block = trimesh.creation.box((40, 40, 30))
    block.apply_translation((-60, 0, 20))
    part = trimesh.util.concatenate([plate, block])
    part.apply_translation((500, -300, 70))
    path = tmp_path_factory.mktemp("meshes")
    for suffix in ("stl", "ply", "obj"):
        part.export(path / f"part.{suffix}")
    return path


@pytest.fixture(scope="module")
def mesh(folder: Path) -> BoardMesh:
    return read_mesh(folder / "part.stl", "mm")


@pytest.fixture(scope="module")
def field(mesh: BoardMesh) -> HeightField:
    return heights_of_mesh(mesh)


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_the_frame_is_at_the_centre_of_the_upper_side(folder: Path, suffix: str) -> None:
    mesh = read_mesh(folder / f"part.{suffix}", "mm")
    assert mesh.size == pytest.approx((0.2, 0.12, 0.04))
    np.testing.assert_allclose(mesh.vertices.min(axis=0), [-0.1, -0.06, -0.04], atol=1e-6)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), [0.1, 0.06, 0.0], atol=1e-6)


def test_a_mesh_in_mm_read_as_m(folder: Path) -> None:
    with pytest.raises(InputError, match=r"read in m it is 200 x 120 x 40 m.*say --unit mm"):
        read_mesh(folder / "part.stl")


def test_what_is_no_mesh(folder: Path) -> None:
    (folder / "text.stl").write_text("no mesh")
    (folder / "text.xyz123").write_text("no mesh")
    for name in ("text.stl", "text.xyz123", "nothing.stl"):
        with pytest.raises(InputError, match=name):
            read_mesh(folder / name, "mm")
    with pytest.raises(InputError, match="did you mean 'mm'"):
        read_mesh(folder / "part.stl", "mmm")


def test_the_relief(field: HeightField) -> None:
    xy = np.array([[-0.06, 0], [-0.06, 0.018], [0.05, 0.03], [-0.03, 0], [0.11, 0]])
    np.testing.assert_allclose(field.at(xy)[:4], [0, 0, -0.03, -0.03], atol=1e-6)
    assert np.isnan(field.at(xy)[4])
    assert np.isfinite(field.heights).mean() > 0.97  # no gaps within


def test_it_hides_what_is_behind(field: HeightField) -> None:
    beside = np.array([[-0.035, 0, -0.03]])  # 5 mm right of the block
    assert field.clear(beside, np.array([0.1, 0, 0.5]))[0]
    assert not field.clear(beside, np.array([-0.2, 0, 0.5]))[0]


def test_targets_lie_on_upward_faces(mesh: BoardMesh, field: HeightField) -> None:
    features = grid_features(mesh, field, 0.01)
    points = np.array([feature.points[0] for feature in features])
    on_block = (np.abs(points[:, 0] + 0.06) < 0.02) & (np.abs(points[:, 1]) < 0.02)
    np.testing.assert_allclose(points[:, 2], np.where(on_block, 0, -0.03), atol=1e-6)
    assert on_block.sum() >= 9
    assert all(feature.normal == pytest.approx([0, 0, 1]) for feature in features)


def test_a_slope_has_its_normal(tmp_path: Path) -> None:
    roof = trimesh.creation.box((100, 100, 20))
    roof.apply_transform(trimesh.transformations.rotation_matrix(np.radians(20), (0, 1, 0)))
    roof.export(tmp_path / "roof.stl")
    mesh = read_mesh(tmp_path / "roof.stl", "mm")
    features = grid_features(mesh, heights_of_mesh(mesh), 0.02)
    normals = np.array([f.normal for f in features if np.abs(f.points[0, :2]).max() < 0.04])
    expected = [np.sin(np.radians(20)), 0, np.cos(np.radians(20))]
    np.testing.assert_allclose(normals.mean(axis=0), expected, atol=0.02)


def test_no_grid_point_on_it(folder: Path) -> None:
    upright = trimesh.creation.box((100, 100, 1))
    upright.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    upright.export(folder / "upright.stl")
    mesh = read_mesh(folder / "upright.stl", "mm")
    with pytest.raises(InputError, match="no point of a 10 mm grid lies on an upward face"):
        grid_features(mesh, heights_of_mesh(mesh), 0.01)


def test_its_virtual_image_shows_it_where_it_lies(mesh: BoardMesh, nominal: Nominal) -> None:
    """The block's upper edges are where the camera's projection has them."""
    cell = cell_with(nominal, mesh)
    underside = cell.T_base_board.translation[2] - mesh.size[2]
    board_underside = nominal.T_base_board.translation[2] - nominal.board.size[2]
    assert underside == pytest.approx(board_underside)
    twin, camera = NominalTwin(cell, mesh), cell.cameras["hand"]
    view = View("V", 0.45, aim=(-0.02, 0.0, 0.0))
    ((_, image),) = virtual_images(twin, [view], cell.T_base_board)
    twin.close()
    grey = image.astype(float).mean(axis=2)
    corner = np.array([[-0.04, 0.0, 0.0]])  # middle of the block's right upper edge
    wall = np.array([[-0.04, 0.0, -0.03]])  # its foot, which is seen from the right
    T = view.T_target_camera.inverse()
    (u_top, v), (u_foot, _) = camera.project(corner, T)[0], camera.project(wall, T)[0]
    row = grey[round(v)]
    dark = np.flatnonzero(np.abs(np.diff(row[int(u_foot) - 40 : int(u_top) + 40])) > 3)
    edges = dark + int(u_foot) - 40 + 0.5
    assert np.abs(edges - u_top).min() < 1.5
    assert np.abs(edges - u_foot).min() < 1.5
