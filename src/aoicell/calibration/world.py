"""World set-up with two chessboards: where does the table's board stand in the robot's base?

A tripod camera sees chessboard 1 on the arm and chessboard 2 on the table at once. With A,
the flange pose from the controller, and B, board 1 to board 2 from the picture:
T_base_tabletarget = A * T_flange_armtarget * B.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.calibration.hand_eye import HandEyeConfig, solve_hand_eye
from aoicell.camera import Camera
from aoicell.errors import Implausible
from aoicell.targets.chessboard import Chessboard, half_turn
from aoicell.targets.pose import TargetPose, solve_pose
from aoicell.transforms import SE3, Array, apply, distance_mm, mean_pose


@dataclass(frozen=True)
class TripodView:
    """Corners (N, 2) of both boards in one tripod picture, and the flange pose at that instant."""

    uv_armtarget: Array
    uv_tabletarget: Array
    T_base_flange: SE3


@dataclass(frozen=True)
class WorldSetup:
    """Chessboard 2 in the base, and chessboard 1 on the flange as it was assumed or measured.

    `scatter_mm`: rms distance of the board's origin from its mean over the views.
    """

    T_base_tabletarget: SE3
    T_flange_armtarget: SE3
    scatter_mm: float
    views: int


@dataclass(frozen=True)
class _Pair:
    """Both boards in one picture, their readings settled."""

    T_base_flange: SE3
    T_tripod_armtarget: SE3
    T_tripod_tabletarget: SE3


def set_up_world(
    views: Sequence[TripodView],
    camera: Camera,
    armtarget: Chessboard,
    tabletarget: Chessboard,
    T_flange_armtarget: SE3,
    T_base_tabletarget: SE3,
) -> WorldSetup:
    """From one picture, the bracket as designed (the paper's way); from five or more, measured.

    The last two arguments are the design poses: they settle the half turns.
    """
    pairs = [
        _settle(view, camera, armtarget, tabletarget, T_flange_armtarget, T_base_tabletarget)
        for view in views
    ]
    bracket = _measure_bracket(pairs) if len(pairs) >= 5 else T_flange_armtarget
    boards = [
        p.T_base_flange * bracket * p.T_tripod_armtarget.actInv(p.T_tripod_tabletarget)
        for p in pairs
    ]
    mean = mean_pose(boards)
    scatter = float(np.sqrt(np.mean([distance_mm(T, mean) ** 2 for T in boards])))
    return WorldSetup(mean, bracket, scatter, len(views))


def _measure_bracket(pairs: Sequence[_Pair]) -> SE3:
    """T_flange_armtarget: eye to hand is the same A X = Z B with the base seen from the flange."""
    result = solve_hand_eye(
        [p.T_base_flange.inverse() for p in pairs],
        [p.T_tripod_armtarget for p in pairs],
        HandEyeConfig(max_scatter_mm=30.0),
    )
    return result.T_base_target


def _settle(
    view: TripodView,
    camera: Camera,
    armtarget: Chessboard,
    tabletarget: Chessboard,
    T_flange_armtarget: SE3,
    T_base_tabletarget: SE3,
) -> _Pair:
    """Which reading of each even board fits the designed layout best."""
    expected = (view.T_base_flange * T_flange_armtarget).actInv(T_base_tabletarget)
    corners = tabletarget.corners
    best: tuple[float, TargetPose, TargetPose] | None = None
    for flip_1, flip_2 in itertools.product((False, True), repeat=2):
        uv_1 = half_turn(view.uv_armtarget) if flip_1 else view.uv_armtarget
        uv_2 = half_turn(view.uv_tabletarget) if flip_2 else view.uv_tabletarget
        board_1 = solve_pose(armtarget.corners, uv_1, camera, name="chessboard 1")
        board_2 = solve_pose(tabletarget.corners, uv_2, camera, name="chessboard 2")
        relative = board_1.T_camera_target.actInv(board_2.T_camera_target)
        gap = np.linalg.norm(apply(relative, corners) - apply(expected, corners), axis=1).mean()
        if best is None or gap < best[0]:
            best = (float(gap), board_1, board_2)
    assert best is not None
    gap, board_1, board_2 = best
    if gap > 0.1:
        raise Implausible(
            f"world set-up: chessboard 2 lies {gap * 1e3:.0f} mm from its designed place as seen "
            "from chessboard 1; check the designed poses and which board is which"
        )
    return _Pair(view.T_base_flange, board_1.T_camera_target, board_2.T_camera_target)
