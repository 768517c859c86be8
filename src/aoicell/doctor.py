"""Self-tests that a stranger can trust: does this machine render and compute what it should?"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import AoicellError
from aoicell.nominal import Nominal
from aoicell.sim.as_built import designed
from aoicell.sim.backend import opengl_description
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL, TYPICAL
from aoicell.sim.scene import ARM
from aoicell.sim.world import World
from aoicell.targets.layout import identify
from aoicell.transforms import Array, angle_of


@dataclass(frozen=True)
class Check:
    """One self-test: what was measured, in which unit, against which limit."""

    name: str
    passed: bool
    detail: str


def diagnose(nominal: Nominal) -> Iterator[Check]:
    """Run the self-tests one after the other; an error ends its own test only."""
    yield _guarded("OpenGL", lambda: (True, opengl_description()))
    ideal = World(nominal, draw(nominal, IDEAL, seed=0))
    yield _guarded("forward kinematics", lambda: _kinematics(nominal, ideal))
    yield _guarded("known points, no lens errors", lambda: _known_points(nominal, ideal))
    yield _guarded("camera frame and pixel convention", lambda: _conventions(nominal, ideal))
    ideal.close()
    # the lens of a typical camera on an otherwise ideal cell
    knobs = {"k1": TYPICAL.k1, "focal_percent": 1.0, "principal_px": 10.0}
    bent = World(nominal, draw(nominal, IDEAL.model_copy(update=knobs), seed=0))
    yield _guarded("known points, distorted lens", lambda: _known_points(nominal, bent))
    bent.close()


def _guarded(name: str, test: Callable[[], tuple[bool, str]]) -> Check:
    try:
        passed, detail = test()
    except AoicellError as error:
        passed, detail = False, str(error)
    return Check(name, passed, detail)


def _kinematics(nominal: Nominal, world: World, draws: int = 1000) -> tuple[bool, str]:
    """Pinocchio against MuJoCo over random joint vectors."""
    arm, rng = nominal.arm, np.random.default_rng(0)
    metres, radians = 0.0, 0.0
    for _ in range(draws):
        q = rng.uniform(arm.lower, arm.upper)
        world.arrive(q)
        gap = arm.fk(q).actInv(world.T_base_body(ARM + "flange"))
        metres = max(metres, float(np.linalg.norm(gap.translation)))
        radians = max(radians, angle_of(gap))
    detail = f"Pinocchio and MuJoCo agree within {metres:.1e} m and {radians:.1e} rad"
    return max(metres, radians) < 1e-9, f"{detail} over {draws} joint vectors (limit 1e-9)"


def _overview_errors(nominal: Nominal, world: World) -> tuple[Array, Camera]:
    """Detected minus projected cross centres (N, 2) px of all markers in one picture."""
    design = designed(nominal)
    T_base_flange = (
        nominal.T_base_board * nominal.overview.T_target_camera * nominal.T_flange_camera.inverse()
    )
    world.begin()  # home: the test before may have left the arm anywhere
    cell = SimCell(world)
    cell.move(nominal.arm.ik(T_base_flange, nominal.q_home, "overview"))
    picture, camera = cell.capture(), world.camera("hand")
    marker = nominal.marker
    layout = {id: world.marker_crosses(id) for id in design.Ts_board_marker}
    T_camera_board = world.truth().T_camera_board
    uvs = identify(marker.detect(picture.grey), layout, camera, T_camera_board)
    errors = [uv - camera.project(layout[id], T_camera_board) for id, uv in uvs.items()]
    if len(errors) < len(layout):
        return np.full((1, 2), np.nan), camera
    return np.concatenate(errors), camera


def _known_points(nominal: Nominal, world: World) -> tuple[bool, str]:
    errors, _ = _overview_errors(nominal, world)
    rms = float(np.sqrt((errors**2).sum(axis=1).mean()))
    detail = f"{len(errors)} cross centres lie {rms:.4f} px rms from their projection"
    return rms < 0.05, f"{detail} (limit 0.05)"


def _conventions(nominal: Nominal, world: World) -> tuple[bool, str]:
    """A mirrored or turned camera would not find the markers; a half-pixel shift would show."""
    errors, camera = _overview_errors(nominal, world)
    du, dv = errors.mean(axis=0)
    centred = np.array_equal(camera.K[:2, 2], [(camera.width - 1) / 2, (camera.height - 1) / 2])
    detail = f"x right, y down, z forward; mean shift ({du:+.4f}, {dv:+.4f}) px"
    return bool(
        centred and max(abs(du), abs(dv)) < 0.05
    ), f"{detail}, the top-left centre is (0, 0)"
