"""The calibrated cell: lens, hand-eye and arm refined together, and how sure all of it is.

Everything that maps joint angles to pixels is one Gaussian belief. What one picture says about
another, through a displacement of the board, follows from it with its uncertainty: errors that
both pictures share cancel, others do not, and the covariance knows which.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.calibration.bundle import Noise, Solution
from aoicell.calibration.hand_eye import HandEye, HandEyeConfig, checked
from aoicell.calibration.measurement import corrected_arm, cross, project_with_derivatives
from aoicell.calibration.parameters import DEFAULT_PRIOR, LENSES, ArmPrior, Estimate, Model
from aoicell.calibration.problem import CalibrationView, Eye, Fixture, Problem, Sight
from aoicell.calibration.selection import fit
from aoicell.calibration.uncertainty import uncertainty_of
from aoicell.camera import Camera
from aoicell.observation import RobotState
from aoicell.robot import Arm
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import SE3, Array

_EYE, _TARGET = "camera", "tabletarget"
_MODEL = Model("k1k2p1p2", "joint_terms")


@dataclass(frozen=True)
class CellModel:
    """What is believed of camera and arm.

    `covariance` (P, P) belongs to the intrinsics, the twist of T_flange_camera in its own axes,
    and the joint terms, one after the other. Standard deviations: `arrival` of each joint angle
    (rad) at one arrival, `sigma_px` of a pixel coordinate of a corner.
    """

    camera: Camera
    T_flange_camera: SE3
    arm: Arm
    covariance: Array
    arrival: float
    sigma_px: float

    @property
    def size(self) -> int:
        """Number of parameters P."""
        return len(self.covariance)

    def T_base_camera(self, q: Array) -> SE3:
        """The camera at joint angles q (rad)."""
        return self.arm.fk(q) * self.T_flange_camera

    def camera_twists(self, q: Array) -> Array:
        """Twist of the camera in its own axes (m, rad) per parameter, (6, P)."""
        by_flange = self.T_flange_camera.toActionMatrixInverse()
        joints = np.hstack([self.arm.jacobian(q), self.arm.origin_jacobian(q)])
        lens = np.zeros((6, self.size - 6 - joints.shape[1]))
        return np.hstack([lens, np.eye(6), by_flange @ joints])

    def arrival_covariance(self, q: Array) -> Array:
        """Covariance (6, 6) of the camera's twist, in its own axes, at one arrival at q (rad)."""
        twists = self.T_flange_camera.toActionMatrixInverse() @ self.arm.jacobian(q) * self.arrival
        return np.asarray(twists @ twists.T)

    def pixel_derivatives(self, points: Array) -> tuple[Array, Array]:
        """Of points (N, 3) in the camera: pixels by their common twist (2N, 6), by parameter
        (2N, P). The twist moves a point x by v + w x x.
        """
        _, by_point, by_intrinsics = project_with_derivatives(self.camera, points)
        free = [*range(4), *(4 + k for k in LENSES[_MODEL.lens])]
        by_parameter = np.zeros((2 * len(points), self.size))
        by_parameter[:, : len(free)] = by_intrinsics[:, free]
        turns = cross(points[:, None, :], by_point)  # g . (w x x) = w . (x x g)
        return np.concatenate([by_point, turns], axis=2).reshape(-1, 6), by_parameter

    def by_focal(self, by_parameter: Array) -> Array:
        """Pixels per relative focal length (2N,), from their derivatives by parameter."""
        return np.asarray(by_parameter[:, :2] @ np.diag(self.camera.K)[:2])


def refine_cell(
    start: HandEye,
    arm: Arm,
    target: Chessboard,
    camera: Camera,
    uvs_px: Sequence[Array],
    states: Sequence[RobotState],
    Ts_camera_target: Sequence[SE3],
    prior: ArmPrior = DEFAULT_PRIOR,
) -> tuple[HandEye, CellModel]:
    """The cell that explains the corners (N, 2) of all views best.

    Intrinsics, hand-eye and joint terms from one least squares in which each view may deviate by
    the arm's repeatability, whose size is estimated with it. Raises Implausible.
    """
    ids = np.arange(len(target.corners))
    views = tuple(
        CalibrationView(
            str(i), state.T_base_flange, (Sight(_EYE, _TARGET, ids, uv),), state.q
        )
        for i, (state, uv) in enumerate(zip(states, uvs_px, strict=True), start=1)
    )  # fmt: skip
    eye, fixture = Eye(_EYE, camera, "flange"), Fixture(_TARGET, target.corners)
    problem = Problem((eye,), (fixture,), views, arm)
    begin = Estimate(
        T_mount_eye={_EYE: start.T_flange_camera},
        T_mount_fixture={_TARGET: start.T_base_target},
        cameras={_EYE: camera},
        scales={_TARGET: 1.0},
        deviations=np.zeros((len(views), 6)),
    )
    noise = Noise(0.05, prior.deviation_mm / 1e3, float(np.radians(prior.deviation_deg)))
    solution = fit(problem, _MODEL, begin, noise, prior)
    model = _model_of(solution)
    Ts_base_flange = [model.arm.fk(state.q) for state in states]
    Z = solution.estimate.T_mount_fixture[_TARGET]
    hand_eye = checked(model.T_flange_camera, Z, Ts_base_flange, Ts_camera_target, HandEyeConfig())
    return hand_eye, model


def _model_of(solution: Solution) -> CellModel:
    estimate, blocks = solution.estimate, solution.layout.blocks
    arm = corrected_arm(solution.problem, estimate)
    assert arm is not None  # joint terms are part of the model
    kept = np.concatenate(
        [
            np.arange(blocks[key].start, blocks[key].stop)
            for key in (("intrinsics", _EYE), ("eye", _EYE), ("joints", "arm"))
        ]
    )
    uncertainty = uncertainty_of(solution)
    return CellModel(
        camera=estimate.cameras[_EYE],
        T_flange_camera=estimate.T_mount_eye[_EYE],
        arm=arm,
        covariance=uncertainty.covariance[np.ix_(kept, kept)],
        arrival=_arrival(solution, arm),
        sigma_px=solution.noise.sigma,
    )


def _arrival(solution: Solution, arm: Arm) -> float:
    """One standard deviation of a joint angle (rad) that deviates the flange as the views do.

    The flange deviates because the joints do: what that makes of positions and what it makes of
    directions each give an estimate, and their geometric mean is taken.
    """
    qs = [view.q for view in solution.problem.views if view.q is not None]
    Js = np.array([arm.jacobian(q) for q in qs])
    squares = (Js**2).sum(axis=2).mean(axis=0)
    by_place = solution.noise.deviation_m / np.sqrt(squares[:3].mean())
    by_turn = solution.noise.deviation_rad / np.sqrt(squares[3:].mean())
    return float(np.sqrt(by_place * by_turn))
