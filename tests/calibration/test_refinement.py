"""The joint refinement of hand-eye and arm, judged at arm poses that it has not seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from aoicell.calibration.hand_eye import HandEye, solve_hand_eye
from aoicell.calibration.poses import INTRINSIC_VIEWS, TABLE_2
from aoicell.calibration.refinement import refine_hand_eye
from aoicell.nominal import Nominal, View
from aoicell.pipeline import flange_target
from aoicell.robot import Arm
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, from_rvec

X_OFFSET = from_rvec(np.radians([0.8, -0.5, 0.6]), [0.009, -0.001, 0.002])
Z_OFFSET = from_rvec([0, 0, np.radians(1.0)], [0.005, -0.003, 0])


@dataclass(frozen=True)
class Rig:
    """A true arm, hand-eye and table board, and what the camera shows of them."""

    nominal: Nominal
    arm: Arm

    @property
    def X(self) -> SE3:
        return self.nominal.T_flange_camera * X_OFFSET

    @property
    def Z(self) -> SE3:
        return self.nominal.T_base_tabletarget * Z_OFFSET

    def corners(self, q: Array) -> Array:
        return project(self.nominal, self.arm, self.X, self.Z, q)

    def closed_form(self, qs: Sequence[Array]) -> tuple[HandEye, list[SE3]]:
        camera, points = self.nominal.cameras["hand"], self.nominal.tabletarget.corners
        Bs = [solve_pose(points, self.corners(q), camera).T_camera_target for q in qs]
        return solve_hand_eye([self.nominal.arm.fk(q) for q in qs], Bs), Bs


def project(nominal: Nominal, arm: Arm, X: SE3, Z: SE3, q: Array) -> Array:
    return nominal.cameras["hand"].project(nominal.tabletarget.corners, (arm.fk(q) * X).actInv(Z))


def looks(nominal: Nominal, views: Sequence[View]) -> list[Array]:
    return [flange_target(nominal, nominal.T_base_tabletarget, v, nominal.q_home) for v in views]


@pytest.fixture(scope="module")
def qs(nominal: Nominal) -> list[Array]:
    """The poses that the procedure takes."""
    start = looks(nominal, [nominal.hand_eye_start])[0]
    T_start, arm = nominal.arm.fk(start), nominal.arm
    return looks(nominal, INTRINSIC_VIEWS) + [
        arm.ik(T_start * dT, start) for dT in TABLE_2.values()
    ]


@pytest.fixture(scope="module")
def unused(nominal: Nominal) -> list[Array]:
    """Other poses of the same kind."""
    rng = np.random.default_rng(1)
    tilts, rolls = np.radians(rng.uniform(-20, 20, (12, 2))), np.radians(rng.uniform(-40, 40, 12))
    distances = rng.uniform(0.45, 0.6, 12)
    return looks(
        nominal,
        [
            View("unused", d, (t[0], t[1]), r)
            for d, t, r in zip(distances, tilts, rolls, strict=True)
        ],
    )


def refine(rig: Rig, start: HandEye, qs: Sequence[Array], Bs: Sequence[SE3]) -> tuple[HandEye, Arm]:
    nominal = rig.nominal
    return refine_hand_eye(
        start, nominal.arm, nominal.tabletarget, nominal.cameras["hand"],
        [rig.corners(q) for q in qs], qs, Bs,
    )  # fmt: skip


def prediction_px(rig: Rig, arm: Arm, hand_eye: HandEye, qs: Sequence[Array]) -> float:
    X, Z = hand_eye.T_flange_camera, hand_eye.T_base_target
    gaps = [project(rig.nominal, arm, X, Z, q) - rig.corners(q) for q in qs]
    return float(np.sqrt(np.mean(np.square(gaps)) * 2))


@pytest.mark.parametrize("seed", range(3))
def test_it_predicts_unused_poses_five_times_better_than_the_closed_form(
    nominal: Nominal, qs: list[Array], unused: list[Array], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    offsets, shifts = np.radians(0.1) * rng.standard_normal(6), 5e-4 * rng.standard_normal((6, 3))
    rig = Rig(nominal, nominal.arm.corrected(offsets, shifts))
    closed, Bs = rig.closed_form(qs)
    refined, arm = refine(rig, closed, qs, Bs)
    before = prediction_px(rig, nominal.arm, closed, unused)
    after = prediction_px(rig, arm, refined, unused)
    assert before > 0.2
    assert after < before / 5
    assert refined.scatter_mm < closed.scatter_mm / 5


def test_with_an_exact_arm_and_exact_corners_the_mount_is_exact(
    nominal: Nominal, qs: list[Array]
) -> None:
    rig = Rig(nominal, nominal.arm)
    _, Bs = rig.closed_form(qs)
    off = from_rvec(np.radians([0.4, -0.3, 0.2]), [2e-3, -1e-3, 3e-3])
    start = HandEye(rig.X * off, rig.Z * off.inverse(), 0.0, 0.0, len(qs))
    refined, arm = refine(rig, start, qs, Bs)
    assert distance_mm(refined.T_flange_camera, rig.X) < 1e-3
    assert distance_deg(refined.T_flange_camera, rig.X) < 1e-4
    assert distance_mm(refined.T_base_target, rig.Z) < 1e-3
    assert distance_mm(arm.fk(qs[0]), nominal.arm.fk(qs[0])) < 1e-3
    assert refined.views == len(qs)
    assert refined.scatter_mm < 1e-2


def test_the_nominal_arm_is_left_alone(nominal: Nominal, qs: list[Array]) -> None:
    rig = Rig(nominal, nominal.arm.corrected(np.full(6, 1e-3), np.full((6, 3), 1e-4)))
    before = nominal.arm.fk(qs[0]).homogeneous
    closed, Bs = rig.closed_form(qs)
    refine(rig, closed, qs, Bs)
    np.testing.assert_array_equal(nominal.arm.fk(qs[0]).homogeneous, before)
