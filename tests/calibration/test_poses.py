"""The fixed sets of poses: the paper's Table 2, and what each of them sees."""

import numpy as np
import pytest

from aoicell.calibration.poses import INTRINSIC_VIEWS, SETUP_MOTIONS, TABLE_2
from aoicell.nominal import Nominal
from aoicell.transforms import SE3, apply, from_rvec

# As printed: cm along and degrees about X, Y, Z.
PRINTED = {
    "A": ((0, 0, 0), (0, 0, 0)),
    "B": ((0, 30, 10), (30, 0, 0)),
    "C": ((0, -30, -10), (-30, 0, 0)),
    "D": ((-30, 0, 0), (0, 30, 0)),
    "E": ((30, 0, 0), (0, -30, 0)),
    "F": ((0, 0, 0), (0, 0, 30)),
}


def start(nominal: Nominal) -> SE3:
    """T_base_flange of the hand-eye start."""
    look = nominal.T_base_tabletarget * nominal.hand_eye_start.T_target_camera
    return look * nominal.T_flange_camera.inverse()


def sees_the_table_board(nominal: Nominal, T_base_flange: SE3) -> bool:
    T_camera_target = (T_base_flange * nominal.T_flange_camera).actInv(nominal.T_base_tabletarget)
    return nominal.cameras["hand"].sees(nominal.tabletarget.corners, T_camera_target, margin_px=30)


def test_table_2_is_the_papers() -> None:
    assert list(TABLE_2) == list(PRINTED)
    for id, (cm, deg) in PRINTED.items():
        expected = from_rvec(np.radians(deg), np.array(cm) / 100)
        np.testing.assert_allclose(TABLE_2[id].homogeneous, expected.homogeneous, atol=1e-12)


@pytest.mark.parametrize("id", list(TABLE_2))
def test_every_pose_of_table_2_sees_the_whole_board(nominal: Nominal, id: str) -> None:
    assert sees_the_table_board(nominal, start(nominal) * TABLE_2[id])


def test_read_in_base_axes_the_camera_would_look_away(nominal: Nominal) -> None:
    turned = SE3(start(nominal).rotation, np.zeros(3))
    there = SE3(np.eye(3), start(nominal).translation)
    seen = [sees_the_table_board(nominal, there * dT * turned) for dT in TABLE_2.values()]
    assert sum(seen) <= 2  # A and F do not move


def test_the_intrinsic_views_fill_the_picture_and_lean_both_ways(nominal: Nominal) -> None:
    camera, corners = nominal.cameras["hand"], nominal.tabletarget.corners
    assert len({view.id for view in INTRINSIC_VIEWS}) == len(INTRINSIC_VIEWS)
    Ts = [view.T_target_camera.inverse() for view in INTRINSIC_VIEWS]
    assert all(camera.sees(corners, T, margin_px=30) for T in Ts)
    uv = np.concatenate([camera.project(corners, T) for T in Ts])
    span = (uv.max(axis=0) - uv.min(axis=0)) / [camera.width, camera.height]
    assert (span > 0.65).all()
    leans = np.degrees([view.tilt for view in INTRINSIC_VIEWS])
    assert (leans.min(axis=0) <= -15).all()
    assert (leans.max(axis=0) >= 15).all()


def test_the_tripod_sees_the_front_of_both_boards_in_every_set_up_pose(nominal: Nominal) -> None:
    camera, T_base_tripod = nominal.cameras["tripod"], nominal.T_base_tripod
    boards = [(nominal.tabletarget, nominal.T_base_tabletarget)]
    boards += [
        (nominal.armtarget, nominal.T_base_flange_setup * dT * nominal.T_flange_armtarget)
        for dT in SETUP_MOTIONS
    ]
    for board, T_base_target in boards:
        T = T_base_tripod.actInv(T_base_target)
        assert camera.sees(board.corners, T, margin_px=15)
        facing = -apply(T, [[0, 0, 0]])[0] @ T.rotation[:, 2] / np.linalg.norm(T.translation)
        assert np.degrees(np.arccos(facing)) < 65
