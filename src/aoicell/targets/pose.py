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


def motion_jacobian(points: Array, camera: Camera, T: SE3) -> Array:
    """Pixels of points (N, 3) of a frame at pose T in the camera, per small motion of that frame.

    The motion is (rotation vector, translation) in camera axes; the result is (2N, 6).
    """
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
        J = motion_jacobian(ps, camera, T)
        delta, *_ = np.linalg.lstsq(J, reprojection(ps, uv, camera, T).ravel(), rcond=None)
        turn = Rotation.from_rotvec(delta[:3]).as_matrix()
        T = SE3(turn @ T.rotation, T.translation + delta[3:])
        if np.abs(delta).max() < 1e-12:
            break
    J = motion_jacobian(ps, camera, T)
    return T, J.T @ J


def planar_candidates(points: ArrayLike, uv_px: ArrayLike, camera: Camera) -> list[SE3]:
    """Two starts for a planar target with z out of its print: the homography's pose and its twin.

    The twin's normal is the mirror image about the line of sight (Schweighofer and Pinz 2006):
    a small target's tilt is told badly from it. Unrefined; empty when the target would be seen
    from behind, as it is when the point order is mirrored.
    """
    ps, xy = np.asarray(points, dtype=float), camera.unproject(uv_px)
    H, _ = cv2.findHomography(ps[:, :2], xy)
    if H is None or not np.isfinite(H).all():
        return []
    H = np.asarray(H, dtype=float) * np.sign(H[2] @ [*ps[:, :2].mean(axis=0), 1])  # in front
    x, y, t = H.T * 2 / (np.linalg.norm(H[:, 0]) + np.linalg.norm(H[:, 1]))
    U, _, Vt = np.linalg.svd(np.column_stack([x, y, np.cross(x, y)]))
    T = SE3(U @ Vt, t)
    centre = T.act(ps.mean(axis=0))
    if not is_rigid(T) or T.rotation[:, 2] @ centre >= 0:
        return []
    sight = -centre / np.linalg.norm(centre)
    axis = np.cross(T.rotation[:, 2], sight)
    lean = np.arctan2(np.linalg.norm(axis), T.rotation[:, 2] @ sight)
    if lean < 1e-6:
        return [T]
    turn = from_rvec(2 * lean * axis / np.linalg.norm(axis), np.zeros(3)).rotation
    return [T, SE3(turn @ T.rotation, centre + turn @ (T.translation - centre))]


def solve_pose(
    points: ArrayLike,
    uv_px: ArrayLike,
    camera: Camera,
    sigma_px: float = 0.05,
    name: str = "target",
) -> TargetPose:
    """Pose of a (nearly) planar target from points (N, 3) in its frame and raw pixels (N, 2).

    Both planar solutions are refined on the raw pixels and the better one is returned.
    Raises Implausible when no solution is finite, in front of the camera and facing it.
    """
    ps = np.asarray(points, dtype=float)
    if len(ps) < 4:
        raise Implausible(f"{name}: {len(ps)} points do not fix a pose; at least 4 are needed")
    solved = []
    for T_start in planar_candidates(_flatten(ps), uv_px, camera):
        T, normal = refine_pose(ps, uv_px, camera, T_start)
        if is_rigid(T) and (apply(T, ps)[:, 2] > 0).all():
            solved.append((rms(reprojection(ps, uv_px, camera, T)), T, normal))
    if not solved:
        raise Implausible(
            f"{name}: no pose in front of the camera and facing it fits the {len(ps)} points; "
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
