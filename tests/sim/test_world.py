"""The simulated truth: where the arm really is, what a picture shows, what is drawn anew."""

import ctypes.util
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from aoicell.errors import ModelError, RenderingUnavailable
from aoicell.nominal import Nominal, load_nominal
from aoicell.resources import data_root
from aoicell.sim.backend import make_renderer
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL, PAPER
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.targets.chessboard import half_turn
from aoicell.targets.pose import rms
from aoicell.transforms import SE3, Array, distance_mm, from_xyz_rpy, rotation, translation

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]


@pytest.fixture(scope="module")
def loose_world(nominal: Nominal) -> World:
    """A world whose arm differs from the design in every way, and arrives exactly."""
    arm = Tolerances(joint_zero_deg=0.5, link_mm=3.0, axis_deg=0.5)
    return World(nominal, draw(nominal, arm, seed=3))


@pytest.fixture(scope="module")
def unsteady_world(nominal: Nominal) -> World:
    """A world whose arm differs from the design and repeats itself within 0.1 mm; no more."""
    arm = Tolerances(repeatability_mm=0.1, joint_zero_deg=0.1, link_mm=0.5, axis_deg=0.02)
    return World(nominal, draw(nominal, arm, seed=0))


def test_mujoco_and_pinocchio_agree_on_the_design(
    ideal_world: World, nominal: Nominal, rng: np.random.Generator
) -> None:
    arm = nominal.arm
    for q in rng.uniform(arm.lower, arm.upper, (1000, 6)):
        ideal_world.arrive(q)
        difference = ideal_world.T_base_body("arm/flange").homogeneous - arm.fk(q).homogeneous
        assert np.abs(difference).max() < 1e-9


def as_built_fk(world: World, q: Array) -> SE3:
    """The chain from the URDF with the drawn corrections, multiplied out by hand."""
    joints = {
        j.find("parent").get("link"): j  # type: ignore[union-attr]
        for j in ET.parse(world.nominal.arm.urdf).iter("joint")
    }
    T, link = SE3.Identity(), "base"
    corrections = iter(world.geometry.joint_corrections)
    angles = iter(np.asarray(q) + world.geometry.joint_offsets)
    while link in joints:
        joint = joints[link]
        origin = joint.find("origin")
        assert origin is not None
        xyz, rpy = ([float(v) for v in origin.get(key, "0 0 0").split()] for key in ("xyz", "rpy"))
        T = T * from_xyz_rpy(xyz, rpy) * next(corrections)
        if joint.get("type") == "revolute":
            axis = np.array([float(v) for v in joint.find("axis").get("xyz").split()])  # type: ignore[union-attr]
            turn = Rotation.from_rotvec(axis * next(angles)).as_matrix()
            T = T * SE3(turn, np.zeros(3))
        link = joint.find("child").get("link")  # type: ignore[union-attr]
    return T


def test_the_drawn_arm_is_the_one_that_moves(
    loose_world: World, nominal: Nominal, rng: np.random.Generator
) -> None:
    arm = nominal.arm
    for q in rng.uniform(arm.lower, arm.upper, (100, 6)):
        loose_world.arrive(q)
        found, expected = loose_world.T_base_body("arm/flange"), as_built_fk(loose_world, q)
        assert np.abs(found.homogeneous - expected.homogeneous).max() < 1e-9
        assert distance_mm(found, arm.fk(q)) > 0.1


def test_bodies_stand_where_they_were_drawn(paper_world: World) -> None:
    geometry, T_base_flange = paper_world.geometry, paper_world.T_base_body("arm/flange")
    expected = {
        "hand": T_base_flange * geometry.T_flange_camera,
        "armtarget": T_base_flange * geometry.T_flange_armtarget,
        "tabletarget": geometry.T_base_tabletarget,
        "tripod": geometry.T_base_tripod,
        "board": geometry.T_base_board,
    }
    for name, T in expected.items():
        difference = paper_world.T_base_body(name).homogeneous - T.homogeneous
        assert np.abs(difference).max() < 1e-9, name


def test_repeatability(unsteady_world: World, nominal: Nominal, taught_poses: TaughtPoses) -> None:
    arm, count = nominal.arm, 400
    poses = taught_poses(nominal)
    variances = []
    for name in ("start", "P_check", "overview", "V2"):
        arrivals = []
        for _ in range(count):
            unsteady_world.arrive(poses[name])
            arrivals.append(unsteady_world.T_base_body("arm/flange").translation)
        exact = as_built_fk(unsteady_world, poses[name]).translation
        errors = np.array(arrivals) - exact
        sigma = 0.1e-3 / 3.6
        assert np.abs(errors.mean(axis=0)).max() < 4 * 2 * sigma / np.sqrt(count)
        variances.append((errors**2).mean())
        assert np.sqrt(variances[-1]) == pytest.approx(sigma, rel=0.15), name
    assert arm.dof == 6


def test_a_new_trial_restarts_the_streams(paper_world: World, nominal: Nominal) -> None:
    def arrivals(trial: int) -> list[bytes]:
        paper_world.begin(trial)
        found = []
        for q in (nominal.q_home, nominal.q_home + 0.01):
            paper_world.arrive(q)
            found.append(paper_world.T_base_body("arm/flange").homogeneous.tobytes())
        return found

    first = arrivals(0)
    assert arrivals(1) != first
    assert arrivals(0) == first
    assert len(set(first)) == 2


def test_two_arrivals_differ(paper_world: World, nominal: Nominal) -> None:
    paper_world.arrive(nominal.q_home)
    one = paper_world.T_base_body("hand")
    paper_world.arrive(nominal.q_home)
    assert 0 < distance_mm(one, paper_world.T_base_body("hand")) < 1


def test_placing_the_board_moves_the_truth(paper_world: World) -> None:
    point = np.array([[0.05, 0.02, 0.0]])
    before, uv = paper_world.truth(), paper_world.project(point)
    moved = before.T_base_board * translation(0.02, -0.01) * rotation("z", 0.1)
    paper_world.place_board(moved)
    after = paper_world.truth()
    assert np.abs(after.T_base_board.homogeneous - moved.homogeneous).max() == 0
    assert np.abs(paper_world.T_base_body("board").homogeneous - moved.homogeneous).max() < 1e-9
    np.testing.assert_array_equal(after.T_base_camera.homogeneous, before.T_base_camera.homogeneous)
    assert np.abs(paper_world.project(point) - uv).max() > 10
    camera = paper_world.geometry.cameras["hand"]
    expected = camera.project(point, after.T_base_camera.actInv(moved))
    np.testing.assert_allclose(paper_world.project(point), expected, atol=1e-9)


def test_marker_points_are_where_the_marker_really_sticks(
    paper_world: World, ideal_world: World
) -> None:
    for design in paper_world.nominal.board.markers:
        drawing = [design.x, design.y, design.z]
        (centre,) = paper_world.marker_points(design.id, [[0, 0, 0]])
        off_mm = (centre - drawing) * 1e3
        assert 0 < np.linalg.norm(off_mm[:2]) < 5 * PAPER.marker_mm
        assert 0 < abs(off_mm[2]) < 5 * PAPER.marker_lift_mm
        np.testing.assert_array_equal(ideal_world.marker_points(design.id, [[0, 0, 0]]), [drawing])


def test_a_marker_stays_in_the_boards_plane_unless_it_is_lifted(paper_world: World) -> None:
    nominal = paper_world.nominal
    stuck = draw(nominal, PAPER.model_copy(update={"marker_lift_mm": 0.0}), seed=0).geometry
    for design in nominal.board.markers:
        centre, side = paper_world.marker_points(design.id, [[0, 0, 0], [design.size / 2, 0, 0]])
        assert stuck.Ts_board_marker[design.id].translation[2] == design.z
        assert side[2] == centre[2], "it is lifted as a whole, not tilted"
        np.testing.assert_array_equal(stuck.Ts_board_marker[design.id].translation[:2], centre[:2])


def test_the_same_seed_gives_the_same_picture(nominal: Nominal, paper_world: World) -> None:
    pictures = [paper_world.picture("hand") for _ in range(2)]
    assert pictures[0].shape == (1200, 1600)
    assert paper_world.picture("hand", colour=True).shape == (1200, 1600, 3)
    assert (pictures[0] != pictures[1]).any(), "noise is new in each picture"
    twin = World(nominal, draw(nominal, PAPER, seed=0))
    twin.begin()
    # the picture is taken after the first arrival in both
    paper_world.begin()
    paper_world.arrive(nominal.q_home)
    twin.arrive(nominal.q_home)
    assert paper_world.picture("hand").tobytes() == twin.picture("hand").tobytes()
    twin.close()


def test_a_distorted_picture_shows_points_where_the_camera_projects_them(
    nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    bent = Tolerances(k1=-0.08, focal_percent=1.0, principal_px=10.0, mount_deg=0.7)
    world = World(nominal, draw(nominal, bent, seed=1))
    camera = world.geometry.cameras["hand"]
    assert camera.distortion[0] == -0.08
    start = taught_poses(nominal)["start"]
    for x, y in ((0, 0), (0.045, 0.03), (-0.045, 0.03)):
        motion = translation(x, y) * rotation("z", np.radians(20))
        world.arrive(nominal.arm.ik(nominal.arm.fk(start) * motion, start))
        corners = nominal.tabletarget.corners
        T = world.truth().T_base_camera.actInv(world.geometry.T_base_tabletarget)
        uv = nominal.tabletarget.detect(world.picture("hand"))
        expected = camera.project(corners, T)
        assert min(rms(uv - expected), rms(half_turn(uv) - expected)) < 0.02
    world.close()


def test_home_is_free_of_contact_and_a_crash_is_named(
    ideal_world: World, nominal: Nominal, taught_poses: TaughtPoses
) -> None:
    assert ideal_world.contacts() == []
    start = taught_poses(nominal)["start"]
    low = nominal.arm.fk(start) * translation(z=0.54)
    ideal_world.arrive(nominal.arm.ik(low, start))
    assert any("hand" in pair for pair in ideal_world.contacts())
    ideal_world.arrive(start)
    assert ideal_world.contacts() == []


def test_world_is_unhurt_when_the_caller_reuses_its_array(
    ideal_world: World, nominal: Nominal
) -> None:
    q = nominal.q_home.copy()
    ideal_world.arrive(q)
    q += 1
    np.testing.assert_array_equal(ideal_world.q_command, nominal.q_home)


# ---- what can be missing -----------------------------------------------------------------------


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the cell and its models, free to be broken."""
    shutil.copytree(data_root() / "models", tmp_path / "models")
    shutil.copytree(data_root() / "cell", tmp_path / "cell")
    return tmp_path


def build(copy: Path) -> str:
    nominal = load_nominal(copy / "cell")
    as_built = draw(nominal, IDEAL, seed=0)
    with pytest.raises(ModelError) as caught:
        World(nominal, as_built)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("mesh", "named_in"),
    [
        ("ra620_1621/meshes/link_3_body.stl", "ra620_1621.urdf"),
        ("ra620_1621/meshes/link_3_hull_1.stl", "ra620_1621.urdf"),
        ("camera/meshes/camera_lens.stl", "camera.toml"),
        ("tripod/meshes/tripod_legs_tubes.stl", "camera.toml"),
    ],
)
def test_a_missing_mesh_is_named(copy: Path, mesh: str, named_in: str) -> None:
    (copy / "models" / mesh).unlink()
    message = build(copy)
    assert Path(mesh).name in message
    assert named_in in message


def test_a_missing_room_is_named(copy: Path) -> None:
    (copy / "cell" / "cell.xml").unlink()
    assert "cell.xml: no such file" in build(copy)


@pytest.mark.parametrize("content", ["<mujoco", "<mujoco><worldbody><geum/></worldbody></mujoco>"])
def test_a_broken_room_is_named(copy: Path, content: str) -> None:
    (copy / "cell" / "cell.xml").write_text(content)
    assert "cell.xml" in build(copy)


def test_a_mesh_entry_without_a_file_is_named(copy: Path) -> None:
    file = copy / "models" / "camera" / "camera.toml"
    file.write_text(file.read_text().replace('file = "meshes/camera_lens.stl"', ""))
    assert "camera.toml" in build(copy)


def test_no_opengl_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise RuntimeError("no display\nand more lines")

    monkeypatch.setattr(mujoco, "Renderer", refuse)
    with pytest.raises(RenderingUnavailable, match="no OpenGL to render with") as caught:
        make_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 64, 48)
    assert "make setup" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


PROGRAM = """
from aoicell.errors import RenderingUnavailable
try:
    from aoicell.sim.backend import make_renderer
    import mujoco
    make_renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 64, 48)
except RenderingUnavailable as error:
    print("refused:", error)
"""


@pytest.mark.parametrize(
    "environment",
    [
        {"MUJOCO_GL": "egl", "PYOPENGL_PLATFORM": "osmesa"},
        pytest.param(
            {"MUJOCO_GL": "osmesa"},
            marks=pytest.mark.skipif(
                ctypes.util.find_library("OSMesa") is not None, reason="OSMesa is there"
            ),
        ),
    ],
    ids=["no EGL", "no OSMesa"],
)
def test_a_process_without_opengl_is_told_so(environment: dict[str, str]) -> None:
    inherited = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**inherited, **environment}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.stdout.startswith("refused: no OpenGL to render with"), result.stderr[-500:]
