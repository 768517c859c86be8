from dataclasses import replace

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.errors import InputError, Unreachable
from aoicell.nominal import load_nominal
from aoicell.observation import RobotState
from aoicell.planning.scan import ScanArea, ScanConfig, area_about, plan_scan, take_scan, times_seen
from aoicell.resources import data_root
from aoicell.robot.collision import Solid
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL
from aoicell.sim.world import World
from aoicell.surroundings import collision_model
from aoicell.transforms import SE3, apply

DISTANCE = 0.45


@pytest.fixture(scope="module")
def nominal():
    design = load_nominal(data_root() / "cell")
    return replace(design, cameras={**design.cameras, "hand": Camera.pinhole(1805.0, 1944, 1200)})


@pytest.fixture(scope="module")
def area(nominal):
    return area_about(nominal, 0.60, 0.52)


@pytest.fixture(scope="module")
def plan(nominal, area):
    return plan_scan(nominal, area, DISTANCE)


def test_the_area_lies_on_the_table_about_the_boards_place(nominal, area):
    middle = area.T_base_area.translation
    assert middle[:2] == pytest.approx(nominal.T_base_board.translation[:2])
    assert middle[2] == pytest.approx(nominal.T_base_tabletarget.translation[2])


def test_every_place_is_seen_in_several_pictures(plan, nominal, area):
    assert times_seen(plan.views, area, nominal.cameras["hand"]).min() >= 2


def test_the_camera_is_where_the_view_says(plan, nominal, area):
    for q, view in zip(plan.qs, plan.views, strict=True):
        T_base_camera = nominal.arm.fk(q) * nominal.T_flange_camera
        aim = apply(area.T_base_area, np.array(view.aim))
        assert apply(T_base_camera.inverse(), aim) == pytest.approx([0, 0, DISTANCE], abs=1e-6)
        assert T_base_camera.rotation[2, 2] == pytest.approx(
            -np.cos(view.tilt[0]) * np.cos(view.tilt[1]), abs=1e-6
        )


def test_postures_keep_their_margins(plan, nominal):
    config = ScanConfig()
    for q in plan.qs:
        assert nominal.arm.limit_margin(q) >= config.limit_margin
        assert nominal.arm.singularity_margin(q) >= config.singularity


def test_mujoco_accepts_every_move_over_a_board_anywhere_in_the_area(plan, nominal):
    world = World(nominal, draw(nominal, IDEAL, 0), pictures=False)
    for q in plan.qs:
        world.drive(q)  # refuses contact


def test_a_scan_leans_to_all_four_sides(plan):
    assert {tuple(np.sign(view.tilt)) for view in plan.views} == {
        (0, 0), (1, 0), (-1, 0), (0, 1), (0, -1),
    }  # fmt: skip


def test_an_area_out_of_reach_is_refused_with_what_is_left_out(nominal, area):
    far = SE3(area.T_base_area.rotation, area.T_base_area.translation + [0.9, 0.6, 0])
    with pytest.raises(Unreachable, match="poses are left out, the first at x"):
        plan_scan(nominal, replace(area, T_base_area=far), DISTANCE)


def test_a_pose_that_would_touch_is_left_out(nominal, area, monkeypatch):
    def with_wall(design, clearance):
        T = area.T_base_area * SE3(np.eye(3), np.array([0.0, 0.0, 0.5]))
        return collision_model(design, clearance, [Solid("wall", (0.05, 1.0, 0.9), T)])

    monkeypatch.setattr("aoicell.planning.scan.collision_model", with_wall)
    with pytest.raises(Unreachable, match=r"wall would touch|would touch wall"):
        plan_scan(nominal, area, DISTANCE)


@pytest.mark.parametrize("side", [0.0, -1.0, 3.0, float("nan")])
def test_a_senseless_area_is_named(side):
    with pytest.raises(InputError, match="scan area: its width"):
        ScanArea(SE3.Identity(), side, 0.5)


def test_a_scan_takes_one_image_a_pose_in_their_order(plan):
    class Recorder:
        def __init__(self):
            self.q = None

        def move(self, q):
            self.q = q

        def state(self):
            return RobotState(self.q, SE3.Identity())

        def capture_depth(self):
            return self.q

    told = []
    assert list(take_scan(Recorder(), plan, told.append)) == list(plan.qs)
    assert told == list(range(1, len(plan.qs) + 1))
