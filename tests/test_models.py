"""The assets keep their contract: documented, licensed, and the same to every reader."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh
import yourdfpy

from aoicell.nominal import Nominal, load_nominal
from aoicell.robot import Arm
from aoicell.sim.as_built import Light, designed, plain_surfaces
from aoicell.sim.scene import build_model

ROOT = Path(__file__).parents[1]
URDF = ROOT / "models" / "ra620_1621" / "ra620_1621.urdf"
FOLDERS = [p for p in sorted((ROOT / "models").iterdir()) if p.is_dir() and p.name[0] not in "_."]
MESHES = sorted((ROOT / "models").glob("*/meshes/*.stl"))
PNG = b"\x89PNG\r\n\x1a\n"


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm(URDF)


@pytest.fixture(scope="module")
def nominal() -> Nominal:
    return load_nominal(ROOT / "cell")


@pytest.fixture(scope="module")
def postures(arm: Arm) -> np.ndarray:
    return np.random.default_rng(0).uniform(arm.lower, arm.upper, (50, arm.dof))


@pytest.mark.parametrize("folder", [*FOLDERS, ROOT / "cell"], ids=relative)
def test_a_folder_is_documented_licensed_and_pictured(folder: Path) -> None:
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert "Apache License" in (folder / "LICENSE").read_text(encoding="utf-8")
    pictures = list(folder.glob("*.png"))
    assert pictures
    for picture in pictures:
        assert picture.read_bytes().startswith(PNG)
        assert f"({picture.name})" in readme
    assert "source" in readme.lower()  # of the dimensions


def test_yourdfpy_and_pinocchio_agree_on_the_arm(arm: Arm, postures: np.ndarray) -> None:
    robot = yourdfpy.URDF.load(str(URDF), load_meshes=False, load_collision_meshes=False)
    assert tuple(robot.actuated_joint_names) == arm.joint_names
    for q in postures:
        robot.update_cfg(q)
        T_base_flange = robot.get_transform("flange", "base")
        assert pytest.approx(T_base_flange, abs=1e-9) == arm.fk(q).homogeneous


def test_so_does_mujoco(arm: Arm, postures: np.ndarray) -> None:
    model = mujoco.MjModel.from_xml_path(str(URDF))
    data = mujoco.MjData(model)
    for q in postures:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        flange, T = data.body("flange"), arm.fk(q)
        assert flange.xpos == pytest.approx(T.translation, abs=1e-9)
        assert flange.xmat.reshape(3, 3) == pytest.approx(T.rotation, abs=1e-9)


def test_the_arm_has_the_makers_dimensions(arm: Arm) -> None:
    """a1 + a2 + sqrt(a3^2 + d4^2) = 1621.2 mm, from the joint axes at zero."""
    model = pin.buildModelFromUrdf(str(URDF))
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.zeros(6))
    y, z = np.array([data.oMi[i].translation[1:] for i in range(1, 7)]).T * 1e3
    d1, a1, a2 = z[1], y[1], z[2] - z[1]
    a3, d4 = z[4] - z[2], y[4] - y[2]
    d6 = arm.fk(np.zeros(6)).translation[1] * 1e3 - y[4]
    assert [d1, a1, a2, a3, d4, d6] == pytest.approx([525, 150, 770, 150, 685, 110], abs=1e-6)
    assert a1 + a2 + np.hypot(a3, d4) == pytest.approx(1621.2, abs=0.05)


def test_at_zero_the_arm_points_along_y(arm: Arm) -> None:
    T = arm.fk(np.zeros(6))
    assert T.translation == pytest.approx([0, 0.945, 1.445], abs=1e-9)
    assert T.rotation @ [0, 0, 1] == pytest.approx([0, 1, 0], abs=1e-9)
    assert T.rotation @ [1, 0, 0] == pytest.approx([1, 0, 0], abs=1e-9)


@pytest.mark.parametrize("path", MESHES, ids=relative)
def test_a_mesh_is_in_metres_and_a_hull_is_convex(path: Path) -> None:
    mesh = trimesh.load_mesh(path)
    assert np.all(np.isfinite(mesh.vertices))
    assert 0.001 < np.abs(mesh.bounds).max() < 2
    if "_hull_" in path.stem:
        assert mesh.is_watertight
        assert mesh.volume > 0
        assert depth_outside(mesh.vertices, mesh) < 1e-6


def depth_outside(points: np.ndarray, mesh: trimesh.Trimesh) -> float:
    """How far (m) a point lies in front of a face's plane: none does if the mesh is convex."""
    keep = mesh.area_faces > 1e-10  # a sliver has no reliable normal
    normals, origins = mesh.face_normals[keep], mesh.triangles_center[keep]
    return float((points @ normals.T - np.sum(origins * normals, axis=1)).max())


def test_the_meshes_that_the_files_name_are_all_there_is() -> None:
    for folder in {path.parent.parent for path in MESHES}:
        named = "".join(p.read_text() for p in [*folder.glob("*.urdf"), *folder.glob("*.toml")])
        for path in folder.glob("meshes/*.stl"):
            assert f"meshes/{path.name}" in named, relative(path)


def test_the_scene_steps_without_a_warning(nominal: Nominal) -> None:
    pinholes = {
        name: (camera.width, camera.height, camera.focal_px)
        for name, camera in nominal.cameras.items()
    }
    model = build_model(nominal, designed(nominal), pinholes, Light(), plain_surfaces())
    data = mujoco.MjData(model)
    data.qpos[:] = nominal.q_home
    mujoco.mj_step(model, data, 100)
    assert [warning.number for warning in data.warning] == [0] * len(data.warning)
    assert np.isfinite(data.qpos).all()
