"""The cell as one belief, fitted to projected views of a drawn arm."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from aoicell.calibration.cell_model import CellModel, refine_cell
from aoicell.calibration.hand_eye import HandEye
from aoicell.calibration.poses import INTRINSIC_VIEWS, TABLE_2
from aoicell.nominal import Nominal
from aoicell.observation import RobotState
from aoicell.pipeline import flange_target
from aoicell.targets.pose import solve_pose
from aoicell.transforms import Array, apply, distance_mm, from_twist

REPEAT = 1.5e-5


@pytest.fixture(scope="module")
def fitted(nominal: Nominal) -> tuple[CellModel, list[Array], object]:
    """Eighteen views of chessboard 2 by an arm whose axes and origins are off, and the belief."""
    rng = np.random.default_rng(3)
    arm = nominal.arm.corrected(
        3e-4 * rng.standard_normal(6),
        np.hstack([2e-4 * rng.standard_normal((6, 3)), 3e-4 * rng.standard_normal((6, 2))]),
    )
    X = nominal.T_flange_camera * from_twist([1e-3, -5e-4, 8e-4, 4e-3, -3e-3, 5e-3])
    design = nominal.cameras["hand"]
    camera = replace(
        design, K=design.K + np.diag([15, 15, 0]), distortion=np.array([-0.08, 0.02, 1e-4, 0, 0])
    )
    board, Z = nominal.tabletarget, nominal.T_base_tabletarget
    start = flange_target(nominal, Z, nominal.hand_eye_start, nominal.q_home)
    qs = [flange_target(nominal, Z, view, start) for view in INTRINSIC_VIEWS]
    qs += [nominal.arm.ik(nominal.arm.fk(start) * dT, start) for dT in TABLE_2.values()]
    uvs, states, poses = [], [], []
    for q in qs:
        T = (arm.fk(q + REPEAT * rng.standard_normal(6)) * X).actInv(Z)
        uv = camera.project(board.corners, T) + 0.02 * rng.standard_normal((len(board.corners), 2))
        uvs.append(uv)
        states.append(RobotState(q, nominal.arm.fk(q)))
        poses.append(solve_pose(board.corners, uv, camera).T_camera_target)
    begin = HandEye(nominal.T_flange_camera, Z, 0.0, 0.0, len(qs))
    _, model = refine_cell(begin, nominal.arm, board, camera, uvs, states, poses)
    return model, qs, (arm, X, camera)


def test_it_predicts_an_unseen_arrival(fitted: tuple[CellModel, list[Array], object]) -> None:
    """Between two postures, where what cannot be told from the base cancels."""
    model, qs, (arm, X, _) = fitted  # type: ignore[misc]
    gaps = []
    for a, b in zip(qs[:6], qs[6:12], strict=True):
        believed = model.T_base_camera(a).actInv(model.T_base_camera(b))
        true = (arm.fk(a) * X).actInv(arm.fk(b) * X)
        gaps.append(distance_mm(believed, true))
    assert np.mean(gaps) < 0.05


def test_it_knows_the_repeatability_and_the_noise(
    fitted: tuple[CellModel, list[Array], object],
) -> None:
    model, *_ = fitted
    assert REPEAT / 1.8 < model.arrival < REPEAT * 1.8
    assert model.sigma_px == pytest.approx(0.02, rel=0.15)


def test_its_derivatives_are_those_of_the_model(
    fitted: tuple[CellModel, list[Array], object],
) -> None:
    model, qs, _ = fitted
    q, step = qs[3], 1e-6
    by_parameter = model.camera_twists(q)
    for k in (8, 11, 14, 19, 20, 24, 33, 49):  # hand-eye, offsets, origins, tilts
        x = np.zeros(model.size)
        x[k] = step
        moved = replace(
            model,
            T_flange_camera=model.T_flange_camera * from_twist(x[8:14]),
            arm=model.arm.corrected(x[14:20], x[20:].reshape(6, 5)),
        )
        twist = pin.log6(model.T_base_camera(q).actInv(moved.T_base_camera(q))).vector
        np.testing.assert_allclose(twist / step, by_parameter[:, k], atol=1e-4)
    points = np.array([[0.05, -0.02, 0.5], [-0.1, 0.07, 0.6]])
    by_twist, by_lens = model.pixel_derivatives(points)
    before = model.camera.project(points)
    for k in range(6):
        x = step * np.eye(6)[k]
        uv = model.camera.project(apply(from_twist(x), points))
        np.testing.assert_allclose((uv - before).ravel() / step, by_twist[:, k], rtol=1e-3, atol=1)
    K = model.camera.K.copy()
    K[0, 0] += step
    uv = replace(model.camera, K=K).project(points)
    np.testing.assert_allclose((uv - before).ravel() / step, by_lens[:, 0], atol=1e-5)
