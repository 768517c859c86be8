"""Arm poses from which chessboard 2 can be photographed, in the cell as designed.

Reachable on the taught joint branch, away from limits and singular postures, free of contact,
with the whole board in the picture whatever the tolerances do.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from aoicell.errors import Unreachable
from aoicell.nominal import Nominal, View
from aoicell.robot.collision import CollisionModel
from aoicell.surroundings import collision_model
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import SE3, Array

_PATH_STEP = float(np.radians(3))  # of the fastest joint, between two checks for contact


@dataclass(frozen=True)
class CandidateConfig:
    """Where cameras are drawn about the board, and what an arm pose has to keep away from.

    The camera looks at a point up to `aim_share` of the board's sides off its centre. All of
    the board stays `margin_px` inside the picture: a mount, a lens and a board that are three
    standard deviations off design move it by about as much. `branch_deg` is the furthest that
    a joint may be from where it is at the start of the hand-eye poses; the last one, which only
    rolls the camera, is free. Rolls of more than a quarter turn either way matter: what is wrong
    with the print turns over in the picture, and what it feigns of the camera cancels.
    """

    distance_mm: tuple[float, float] = (350.0, 650.0)
    tilt_deg: float = 35.0
    roll_deg: float = 150.0
    aim_share: float = 0.5
    margin_px: float = 120.0
    limit_deg: float = 10.0
    singularity: float = 0.08
    branch_deg: float = 120.0
    clearance_mm: float = 20.0


def hand_eye_start(nominal: Nominal) -> Array:
    """Joint angles (rad) of the taught start above chessboard 2: the branch of all poses."""
    T_base_camera = nominal.T_base_tabletarget * nominal.hand_eye_start.T_target_camera
    return nominal.arm.ik(_flange(nominal, T_base_camera), nominal.q_home, "hand-eye start")


def candidates(
    nominal: Nominal, count: int, rng: np.random.Generator, config: CandidateConfig
) -> list[Array]:
    """Joint angles (rad) of `count` usable poses, drawn evenly over what the config allows.

    Raises Unreachable when only one in a hundred draws, or fewer, can be used.
    """
    cell, q_start = collision_model(nominal, config.clearance_mm / 1e3), hand_eye_start(nominal)
    found: list[Array] = []
    for _, view in zip(range(100 * count), _draws(nominal.tabletarget, rng, config), strict=False):
        q = _posture(nominal, view, q_start, config)
        if q is not None and cell.touching(q) is None:
            found.append(q)
        if len(found) == count:
            return found
    raise Unreachable(
        f"calibration poses: {len(found)} of {100 * count} draws can be used, {count} are wanted; "
        "allow other distances and tilts, or move chessboard 2 closer to the arm"
    )


def free_path(cell: CollisionModel, q_from: Array, q_to: Array) -> bool:
    """Whether nothing touches on the straight joint path between two postures (rad)."""
    steps = max(1, int(np.ceil(np.abs(q_to - q_from).max() / _PATH_STEP)))
    shares = np.linspace(0, 1, steps + 1)[1:, None]
    return cell.first_touch(q_from + shares * (q_to - q_from)) is None


def _draws(board: Chessboard, rng: np.random.Generator, config: CandidateConfig) -> Iterator[View]:
    reach = config.aim_share * np.array(board.size) / 2
    while True:
        x, y = rng.uniform(-reach, reach)
        a, b = np.radians(rng.uniform(-config.tilt_deg, config.tilt_deg, 2))
        roll = float(np.radians(rng.uniform(-config.roll_deg, config.roll_deg)))
        distance = rng.uniform(*config.distance_mm) / 1e3
        yield View("candidate", distance, (a, b), roll, (x, y, 0.0))


def _posture(nominal: Nominal, view: View, q_start: Array, config: CandidateConfig) -> Array | None:
    """Joint angles (rad) for a view of the board; None where it is not to be used."""
    T_target_camera = view.T_target_camera
    camera, corners = nominal.cameras["hand"], nominal.tabletarget.corners
    if not camera.sees(corners, T_target_camera.inverse(), config.margin_px):
        return None
    T_base_flange = _flange(nominal, nominal.T_base_tabletarget * T_target_camera)
    try:
        q = nominal.arm.ik(T_base_flange, q_start)
    except Unreachable:
        return None
    good = (
        np.abs(q - q_start)[:-1].max() <= np.radians(config.branch_deg)
        and nominal.arm.limit_margin(q) >= np.radians(config.limit_deg)
        and nominal.arm.singularity_margin(q) >= config.singularity
    )
    return q if good else None


def _flange(nominal: Nominal, T_base_camera: SE3) -> SE3:
    return T_base_camera * nominal.T_flange_camera.inverse()
