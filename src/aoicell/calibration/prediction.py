"""Where a calibrated eye sees a point from an arm pose, and how far off that may be."""

from dataclasses import dataclass

import numpy as np

from aoicell.calibration.bundle import Solution
from aoicell.calibration.measurement import corrected_arm, flange_pose, project_with_derivatives
from aoicell.calibration.parameters import LENSES
from aoicell.calibration.print_form import form_basis
from aoicell.calibration.problem import CalibrationView
from aoicell.calibration.uncertainty import Uncertainty
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array, apply


@dataclass(frozen=True)
class Prediction:
    """Where points appear from an arm pose, with covariances.

    `uv_px` (N, 2) and `cov_px` (N, 2, 2) are NaN for an eye without intrinsics; `points` (N, 3)
    in the camera (m) and `cov_m` (N, 3, 3).
    """

    uv_px: Array
    cov_px: Array
    points: Array
    cov_m: Array

    @property
    def std_px(self) -> Array:
        """Root of the summed variances of u and v, (N,)."""
        return np.asarray(np.sqrt(np.trace(self.cov_px, axis1=1, axis2=2)))

    @property
    def std_mm(self) -> Array:
        """Root of the summed variances of x, y and z, (N,)."""
        return np.asarray(np.sqrt(np.trace(self.cov_m, axis1=1, axis2=2))) * 1e3


@dataclass(frozen=True)
class _Look:
    """Points (N, 3) in a camera and their derivatives by parameters (N, 3, P) and flange."""

    points: Array
    by_parameters: Array
    by_flange: Array


def predict(
    solution: Solution,
    uncertainty: Uncertainty,
    eye: str,
    at: CalibrationView | SE3,
    points: Array,
    on: str | None = None,
    arrival: bool = False,
) -> Prediction:
    """Where an eye sees points (N, 3) of the fixture `on`, or of the base, from an arm pose.

    `at` is T_base_flange as the controller has it, or a view with joint angles, which are
    needed where joint terms were estimated. With `arrival` the covariances also hold for one
    arrival of the arm. Raises InputError without the joint angles.
    """
    view = at if isinstance(at, CalibrationView) else CalibrationView("work point", at, ())
    look = _look(solution, eye, view, np.asarray(points, dtype=float), on)
    J, cov = look.by_parameters, uncertainty.covariance
    arrives = arrival and solution.layout.model.robot != "exact"
    D = look.by_flange * (solution.noise.deviation * uncertainty.inflation * arrives)
    cov_m = J @ cov @ J.transpose(0, 2, 1) + D @ D.transpose(0, 2, 1)
    camera = solution.estimate.cameras.get(eye)
    count = len(look.points)
    if camera is None:
        return Prediction(
            np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan), look.points, cov_m
        )
    uv, by_point, by_intrinsics = project_with_derivatives(camera, look.points)
    J_uv, D_uv = by_point @ J, by_point @ D
    where = solution.layout.blocks.get(("intrinsics", eye))
    if where is not None:
        free = [*range(4), *(4 + k for k in LENSES[solution.layout.model.lens])]
        J_uv[:, :, where] += by_intrinsics.reshape(count, 2, -1)[:, :, free]
    cov_px = J_uv @ cov @ J_uv.transpose(0, 2, 1) + D_uv @ D_uv.transpose(0, 2, 1)
    return Prediction(uv, cov_px, look.points, cov_m)


def _look(
    solution: Solution, eye: str, view: CalibrationView, points: Array, on: str | None
) -> _Look:
    problem, estimate, blocks = solution.problem, solution.estimate, solution.layout.blocks
    arm = corrected_arm(problem, estimate)
    if arm is not None and view.q is None:
        raise InputError(
            f"view '{view.id}': the arm's joint terms were estimated; a prediction needs the joint "
            "angles of its pose"
        )
    A = flange_pose(view, arm)
    X = estimate.T_mount_eye[eye]
    Y = SE3.Identity() if on is None else estimate.T_mount_fixture[on]
    eye_moves = problem.eye(eye).mount == "flange"
    target_moves = on is not None and problem.fixture(on).mount == "flange"
    T = (A * X if eye_moves else X).actInv(A * Y if target_moves else Y)
    scale = 1.0 if on is None else estimate.scales[on]
    shaped, formed = on is not None and ("form", on) in blocks, points
    if on is not None and shaped:
        basis = form_basis(problem.fixture(on).points, points)
        formed = points + basis @ estimate.form(on)
    x = apply(T, scale * formed)
    by_camera = np.concatenate([np.tile(-np.eye(3), (len(x), 1, 1)), _skews(x)], axis=2)
    by_target = -by_camera @ T.toActionMatrix()
    by_flange = np.zeros((len(x), 3, 6))
    if eye_moves:
        by_flange += by_camera @ X.toActionMatrixInverse()
    if target_moves:
        by_flange += by_target @ Y.toActionMatrixInverse()
    J = np.zeros((len(x), 3, solution.layout.size))
    J[:, :, blocks["eye", eye]] = by_camera
    if on is not None:
        J[:, :, blocks["fixture", on]] = by_target
        if ("scale", on) in blocks:
            J[:, :, blocks["scale", on]] = ((x - T.translation) / scale)[:, :, None]
        if shaped:
            J[:, :, blocks["form", on]] = scale * (T.rotation @ basis)
    if arm is not None and view.q is not None:
        twists = np.hstack([arm.jacobian(view.q), arm.origin_jacobian(view.q)])
        J[:, :, blocks["joints", "arm"]] = by_flange @ twists
    return _Look(x, J, by_flange)


def _skews(x: Array) -> Array:
    """Cross product matrices (N, 3, 3)."""
    return np.asarray(np.cross(x[:, None, :], np.eye(3)[None]).transpose(0, 2, 1))
