"""The planned views of the shipped board keep what they promise, by means other than the planner's:
MuJoCo's rays for what is visible, its contacts for the way there.
"""

import mujoco
import numpy as np
import pytest

from aoicell.nominal import Nominal, View, load_views
from aoicell.planning.coverage import Inspector
from aoicell.planning.reach import Reach
from aoicell.planning.scene import board_scene
from aoicell.planning.table import CoverageTable, tabulate
from aoicell.planning.targets import Hidden
from aoicell.planning.view_search import markers_in
from aoicell.planning.views import area_bound
from aoicell.resources import find
from aoicell.sim.cell import SimCell
from aoicell.sim.world import World
from aoicell.transforms import apply

COMPONENTS = np.array([0, 0, 1, 0, 0, 0], np.uint8)  # MuJoCo's geometry group of parts


@pytest.fixture(scope="module")
def views() -> tuple[View, ...]:
    return load_views(find("models", "server_board") / "planned.toml")


@pytest.fixture(scope="module")
def scene(nominal: Nominal) -> tuple[Inspector, list[Hidden]]:
    scene, hidden = board_scene(nominal)
    return Inspector(scene), hidden


@pytest.fixture(scope="module")
def table(
    nominal: Nominal, views: tuple[View, ...], scene: tuple[Inspector, list[Hidden]]
) -> CoverageTable:
    kinds = {c.id: c.kind for c in nominal.board.components}
    return tabulate(scene[0], views, scene[1], kinds)


def test_all_components_are_covered(nominal: Nominal, table: CoverageTable) -> None:
    assert table.coverage == 1.0
    assert {row.target for row in table.targets} == {c.id for c in nominal.board.components}
    assert {row.target: row.reason for row in table.targets if row.state != "seen"} == {
        "CPU1": "it lies under HS1",
        "CPU2": "it lies under HS2",
        "U22": "it lies under HS3",
        "U31": "it lies under HS4",
    }


def test_with_at_most_twice_the_pictures_of_the_area_bound(
    nominal: Nominal, views: tuple[View, ...]
) -> None:
    bound = area_bound(nominal.board, nominal.cameras["hand"], 5.0)
    assert len(views) <= 2 * bound


def test_each_picture_has_a_marker(nominal: Nominal, views: tuple[View, ...]) -> None:
    camera = nominal.cameras["hand"]
    assert all(markers_in(nominal.board, camera, view) for view in views)


def test_mujoco_drives_there_and_sees_it(
    nominal: Nominal,
    views: tuple[View, ...],
    scene: tuple[Inspector, list[Hidden]],
    ideal_world: World,
) -> None:
    """Every pose on a way without contact; from the true lens, rays to what is said to be seen."""
    inspector, reach, cell = scene[0], Reach(nominal), SimCell(ideal_world)
    best = np.zeros(len(inspector.scene.features))
    for view in views:
        cell.move(reach.of(view).q)  # raises Unreachable when bodies would touch
        assert ideal_world.contacts() == []
        T_base_camera = ideal_world.truth().T_base_camera
        best = np.maximum(best, _visible(inspector, view, ideal_world, T_base_camera))
        cell.move(nominal.q_home)
    needed = [feature.share for feature in inspector.scene.features]
    short = np.flatnonzero(best < np.array(needed) - 1e-9)
    names = [f"{inspector.scene.features[k].target} {best[k]:.2f}" for k in short]
    assert names == []


def _visible(inspector: Inspector, view: View, world: World, T_base_camera: object) -> np.ndarray:
    """Shares of the features (F,) that rays reach and the picture holds, by the real solids."""
    features, camera = inspector.scene.features, world.camera("hand")
    T_world_board = world.nominal.T_world_base * world.T_base_board
    T_board_camera = world.T_base_board.actInv(T_base_camera)
    np.testing.assert_allclose(
        T_board_camera.homogeneous, view.T_target_camera.homogeneous, atol=1e-6
    )
    centre = T_world_board.act(T_board_camera.translation)
    points = np.vstack([f.points for f in features])
    rays = apply(T_world_board, points) - centre
    lengths = np.linalg.norm(rays, axis=1)
    dist, hit = np.empty(len(rays)), np.empty(len(rays), np.int32)
    mujoco.mj_multiRay(
        world.model, world.data, centre, (rays / lengths[:, None]).ravel(), COMPONENTS, True, -1,
        hit, dist, None, len(rays), 10.0,
    )  # fmt: skip
    clear = (hit < 0) | (dist > lengths - 1e-3)  # the body of a part may end just below its box
    owner = np.repeat(np.arange(len(features)), [len(f.points) for f in features])
    share = np.bincount(owner, clear) / np.bincount(owner)
    T_camera_board = T_board_camera.inverse()
    inside = [camera.sees(f.corners, T_camera_board, margin_px=30) for f in features]
    return np.where(inside, share, 0.0)
