"""Pose of a target from its points in one picture: both planar solutions, refined, checked."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from aoicell.camera import Camera
from aoicell.errors import Implausible
from aoicell.transforms import SE3, Array, apply, from_rvec, is_rigid, to_rvec


@dataclass(frozen=True)
class TargetPose:
    """Pose of a target in the camera frame, with its quality.

    `covariance` (6, 6) belongs to a small motion (rotation vector in rad, then
    translation in m) in camera axes, T = (exp(w) R, t + dt), for `sigma_px` of noise.
    `ambiguity` is the other planar solution's rms over this one's: near 1, the tilt
    cannot be told from its mirror image; infinite when there is no other.
    """

    T_camera_target: SE3
    rms_px: float
    covariance: Array
    sigma_px: float
    ambiguity: float = np.inf


def reprojection(points: ArrayLike, uv_px: ArrayLike, camera: Camera, T: SE3) -> Array:
    """Measured minus projected pixels (N, 2)."""
    return np.asarray(uv_px, dtype=float) - camera.project(points, T)


def rms(residuals_px: Array) -> float:
    """Root of the mean squared length of (N, 2) residuals, per point."""
    return float(np.sqrt((residuals_px**2).sum(axis=1).mean()))


def _jacobian(points: Array, camera: Camera, T: SE3) -> Array:
    """Pixels per small motion (rotation vector, translation) in camera axes, (2N, 6)."""
    ps = apply(T, points)
    _, J = cv2.projectPoints(ps[:, None], np.zeros(3), np.zeros(3), camera.K, camera.distortion)
    J_point = np.asarray(J)[:, 3:6].reshape(-1, 2, 3)  # by translation = by the point itself
    arms = ps - T.translation
    J_rotation = np.cross(arms[:, None, :], J_point)  # d(w x a) . g = w . (a x g)
    return np.concatenate([J_rotation, J_point], axis=2).reshape(-1, 6)


def refine_pose(
    points: ArrayLike, uv_px: ArrayLike, camera: Camera, T_start: SE3, steps: int = 20
) -> tuple[SE3, Array]:
    """Gauss-Newton on the reprojection error; the pose and the normal matrix J^T J (6, 6)."""
    ps, uv = np.asarray(points, dtype=float), np.asarray(uv_px, dtype=float)
    T = T_start
    for _ in range(steps):
        J = _jacobian(ps, camera, T)
        delta, *_ = np.linalg.lstsq(J, reprojection(ps, uv, camera, T).ravel(), rcond=None)
        turn = Rotation.from_rotvec(delta[:3]).as_matrix()
        T = SE3(turn @ T.rotation, T.translation + delta[3:])
        if np.abs(delta).max() < 1e-12:
            break
    J = _jacobian(ps, camera, T)
    return T, J.T @ J


def planar_candidates(points: ArrayLike, uv_px: ArrayLike, camera: Camera) -> list[SE3]:
    """Both solutions of the planar pose problem (IPPE, Collins and Bartoli 2014), unrefined."""
    ps, xy = np.asarray(points, dtype=float), camera.unproject(uv_px)
    _, rvecs, tvecs, _ = cv2.solvePnPGeneric(
        ps[:, None], xy[:, None], np.eye(3), np.zeros(5), flags=cv2.SOLVEPNP_IPPE
    )
    candidates = [from_rvec(r, t) for r, t in zip(rvecs, tvecs, strict=True)]
    return [T for T in candidates if is_rigid(T) and (apply(T, ps)[:, 2] > 0).all()]


def solve_pose(
    points: ArrayLike,
    uv_px: ArrayLike,
    camera: Camera,
    sigma_px: float = 0.05,
    name: str = "target",
) -> TargetPose:
    """Pose of a (nearly) planar target from points (N, 3) in its frame and raw pixels (N, 2).

    Both planar solutions are refined on the raw pixels and the better one is returned.
    Raises Implausible when no solution is finite, right-handed and in front of the camera.
    """
    ps = np.asarray(points, dtype=float)
    solved = []
    for T_start in planar_candidates(_flatten(ps), uv_px, camera):
        T, normal = refine_pose(ps, uv_px, camera, T_start)
        if is_rigid(T) and (apply(T, ps)[:, 2] > 0).all():
            solved.append((rms(reprojection(ps, uv_px, camera, T)), T, normal))
    if not solved:
        raise Implausible(
            f"{name}: no pose in front of the camera fits the {len(ps)} points; "
            "check the point order and the intrinsics"
        )
    solved.sort(key=lambda item: item[0])
    best_rms, T, normal = solved[0]
    others = [r for r, T_other, _ in solved[1:] if not T_other.isApprox(T, 1e-6)]
    return TargetPose(
        T_camera_target=T,
        rms_px=best_rms,
        covariance=np.asarray(np.linalg.pinv(normal) * sigma_px**2, dtype=float),
        sigma_px=sigma_px,
        ambiguity=others[0] / max(best_rms, 1e-9) if others else np.inf,
    )


def _flatten(points: Array) -> Array:
    """The points moved onto z = 0, as the planar solver demands; the refinement uses the real z."""
    return np.column_stack([points[:, :2], np.zeros(len(points))])


def motion_between(T_1: SE3, T_2: SE3) -> Array:
    """The small motion (rotation vector, translation) of T_1 to T_2, as `covariance` has it."""
    rvec, _ = to_rvec(SE3(T_2.rotation @ T_1.rotation.T, np.zeros(3)))
    return np.concatenate([rvec, T_2.translation - T_1.translation])
