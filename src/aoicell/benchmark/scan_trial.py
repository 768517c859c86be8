"""One scan of an unknown board in a simulated cell, scored against the design and the truth."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from aoicell.nominal import Nominal, View
from aoicell.observation import Image, RobotState, to_grey
from aoicell.pipeline import METHODS, calibrate, photograph_targets
from aoicell.planning.depth import DepthImage
from aoicell.planning.scan import ScanArea, plan_scan, take_scan
from aoicell.planning.scan_comparison import (
    Comparison,
    compare,
    designed_footprints,
    designed_targets,
    distances_px,
)
from aoicell.planning.scanned_model import ModelConfig, ScannedModel, build_model
from aoicell.registration import designed_layout
from aoicell.sim.cell import SimCell
from aoicell.sim.depth_noise import DepthSensor
from aoicell.sim.drawing import stream
from aoicell.sim.mesh_twin import MeshTwin
from aoicell.sim.rgbd import RgbdCell
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, from_xyz_rpy

LEAST_HEIGHT = 0.0003  # designed parts that stand out less are no targets of a scan (m)
LIES_WITHIN = (0.03, float(np.radians(15)))  # of its place: the board is put down there (m, rad)

HandEye = Literal["calibrated", "nominal"]


@dataclass(frozen=True, eq=False)
class ScanTrial:
    """What came of a scan: `first` of the depth images, how many there were, how far the board
    was found from its true pose, and how long each stage took.
    """

    model: ScannedModel
    comparison: Comparison
    first: DepthImage
    images: int
    board_mm: float
    board_deg: float
    seconds: dict[str, float]


def run_scan(
    world: World,
    sensor: DepthSensor,
    area: ScanArea,
    hand_eye: HandEye = "calibrated",
    config: ModelConfig | None = None,
    tell: Callable[[str], None] = lambda phase: None,
) -> ScanTrial:
    """Calibrate, throw the board down, scan it, build its model and compare it with the design.

    The world was built for the cell of `with_rgbd`. `tell` hears what is being done.
    """
    seconds, start = dict[str, float](), time.perf_counter()

    def lap(name: str) -> None:
        nonlocal start
        seconds[name], start = round(time.perf_counter() - start, 2), time.perf_counter()

    tell("calibrating")
    T_base_camera = _camera_poses(world, hand_eye)
    lap("calibrate")
    plan = plan_scan(world.nominal, area, sensor.distance)
    lap("plan")
    world.begin(0)
    world.place_board(_thrown_down(world))
    count, cell = len(plan.qs), RgbdCell(world, sensor)
    try:
        images = list(take_scan(cell, plan, lambda done: tell(f"scanning: {done} of {count}")))
    finally:
        cell.close()
    lap("pictures")
    tell("building the model")
    model = build_model(images, T_base_camera, area, config)
    lap("model")
    board = world.nominal.board
    targets = designed_targets(board, LEAST_HEIGHT)
    comparison = compare(model.bumps, targets, designed_footprints(board))
    T_base_board = model.T_base_board * comparison.T_scan_board
    return ScanTrial(
        model,
        comparison,
        images[0],
        count,
        distance_mm(T_base_board, world.T_base_board),
        distance_deg(T_base_board, world.T_base_board),
        seconds,
    )


def _camera_poses(world: World, hand_eye: HandEye) -> Callable[[RobotState], SE3]:
    """Where the depth camera is at a state of the robot, as estimated or as designed."""
    nominal = world.nominal
    if hand_eye == "nominal":
        return lambda state: state.T_base_flange * nominal.T_flange_camera
    pictures = photograph_targets(SimCell(world), nominal)
    return calibrate(pictures, nominal, [METHODS["aoicell"]])["aoicell"].T_base_camera


def _thrown_down(world: World) -> SE3:
    """Where the board lies: somewhere about its place."""
    built, (most, turn) = world.as_built, LIES_WITHIN
    rng = stream(built.seed, built.world, 0, "scanned_board")
    x, y = rng.uniform(-most, most, 2)
    return world.T_base_board * from_xyz_rpy([x, y, 0], [0, 0, rng.uniform(-turn, turn)])


def virtual_views(trial: ScanTrial, design: Nominal) -> tuple[list[tuple[View, Image]], Array]:
    """What the design's inspection views would show of the model, and how far (px) the crosses
    that are found there lie from where the design has them.
    """
    camera, T_scan_board = design.cameras["hand"], trial.comparison.T_scan_board
    crosses = np.concatenate(list(designed_layout(design.board, design.marker).values()))
    twin = MeshTwin(trial.model, camera)
    images, distances = [], []
    try:
        for view in design.inspection_views:
            image = twin.render(T_scan_board * view.T_target_camera, SE3.Identity())
            expected = camera.project(crosses, view.T_target_camera.inverse())
            distances.append(distances_px(design.marker.detect(to_grey(image)), expected))
            images.append((view, image))
    finally:
        twin.close()
    return images, np.concatenate(distances)
