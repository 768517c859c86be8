"""The solvers that the hand-eye benchmark compares: pictures and poses in, a prediction out."""

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from aoicell.calibration.calibrate import calibrate
from aoicell.calibration.closed_forms import CLOSED_FORMS, ClosedForm, solve_closed_form
from aoicell.calibration.intrinsics import Intrinsics, calibrate_intrinsics
from aoicell.calibration.measurement import corrected_arm
from aoicell.calibration.problem import CalibrationView, Eye, Fixture, Problem, Sight
from aoicell.camera import Camera
from aoicell.errors import Implausible, Refused
from aoicell.nominal import Nominal
from aoicell.robot import Arm
from aoicell.transforms import SE3, Array, to_quat_wxyz

OURS, STRONGEST = "aoicell", "vision-calibration"
_EYE, _TARGET = "hand", "tabletarget"


@dataclass(frozen=True)
class Taken:
    """Corners (N, 2) of chessboard 2 as detected in each picture, and the joint angles there."""

    nominal: Nominal
    qs: tuple[Array, ...]
    uvs_px: tuple[Array, ...]

    @property
    def Ts_base_flange(self) -> list[SE3]:
        """What the controller says."""
        return [self.nominal.arm.fk(q) for q in self.qs]

    def first(self, count: int) -> "Taken":
        """The first so many pictures."""
        return Taken(self.nominal, self.qs[:count], self.uvs_px[:count])


@dataclass(frozen=True)
class Solved:
    """A camera on an arm that sees a board; `freedoms` are what nothing told, parameter by name."""

    arm: Arm
    camera: Camera
    T_flange_camera: SE3
    T_base_target: SE3
    freedoms: tuple[tuple[str, ...], ...] = ()

    def predict(self, q: Array, points: Array) -> Array:
        """Pixels (N, 2) of the board's points (N, 3) from joint angles q (rad)."""
        T_base_camera = self.arm.fk(q) * self.T_flange_camera
        return self.camera.project(points, T_base_camera.actInv(self.T_base_target))


# Raises Refused where no answer stands.
Solver = Callable[[Taken], Solved]


def ours(taken: Taken) -> Solved:
    """The joint refinement as `aoicell calibrate` has it, with the arm's joint angles."""
    nominal, board = taken.nominal, taken.nominal.tabletarget
    every = np.arange(len(board.corners))
    views = [
        CalibrationView(f"{k + 1}", T, (Sight(_EYE, _TARGET, every, uv),), q)
        for k, (T, q, uv) in enumerate(
            zip(taken.Ts_base_flange, taken.qs, taken.uvs_px, strict=True)
        )
    ]
    eye = Eye(_EYE, nominal.cameras["hand"], "flange")
    fixture = Fixture(_TARGET, board.corners, half_turns=board.half_turns)
    report = calibrate(Problem((eye,), (fixture,), tuple(views), nominal.arm))
    if report.solution is None:
        raise Implausible("; ".join(report.reasons))
    estimate, uncertainty = report.solution.estimate, report.uncertainty
    return Solved(
        corrected_arm(report.solution.problem, estimate) or nominal.arm,
        estimate.cameras[_EYE],
        estimate.T_mount_eye[_EYE],
        estimate.T_mount_fixture[_TARGET],
        tuple(f.parameters for f in uncertainty.unobservable) if uncertainty else (),
    )


def gauge_freedoms(solved: Solved) -> dict[str, list[str]]:
    """Terms of the arm that do the same as a motion of the board or of the camera alone."""
    gauge: dict[str, list[str]] = {}
    for term, *others in solved.freedoms:
        poses = {name.rsplit(" ", 1)[0] for name in others}
        if len(poses) == 1 and min(poses).startswith("T_"):
            gauge.setdefault(min(poses), []).append(term)
    if f"T_flange_{_EYE}" in gauge:  # no parameter of its own: it is the same product
        gauge[f"T_flange_{_EYE}"].append("the last link")
    return gauge


def closed_form_names() -> tuple[str, ...]:
    """What the rows of OpenCV's solvers are called."""
    return tuple(_called(method) for method in CLOSED_FORMS)


def _called(method: ClosedForm) -> str:
    return f"OpenCV {method}"


def closed_form(method: ClosedForm, intrinsics: Intrinsics, taken: Taken) -> Solved:
    """One of OpenCV's, given the camera and the boards' poses of its own calibrateCamera."""
    result = solve_closed_form(taken.Ts_base_flange, intrinsics.Ts_camera_target, method)
    return Solved(taken.nominal.arm, intrinsics.camera, result.X, result.Z)


def solve_all(taken: Taken) -> dict[str, Solved | Refused]:
    """What every solver makes of the same pictures, by its name; a refusal where it has none."""
    intrinsics = calibrate_intrinsics(
        taken.nominal.tabletarget, taken.uvs_px, taken.nominal.cameras["hand"]
    )
    solvers: dict[str, Solver] = {OURS: ours}
    for method in CLOSED_FORMS:
        solvers[_called(method)] = partial(closed_form, method, intrinsics)
    if strongest_is_here():
        solvers |= {name: partial(vision_calibration, name) for name in ROBOTS}
    return {name: answer(solver, taken) for name, solver in solvers.items()}


def answer(solver: Solver, taken: Taken) -> Solved | Refused:
    """What a solver makes of pictures, or its refusal."""
    try:
        return solver(taken)
    except Refused as refusal:
        return refusal


# -- vision-calibration (extra `bench`) ------------------------------------------------------

# How exact its arm is said to be: rotation (rad) and translation (m), one sigma. As it comes,
# exact, and as the profile's arm is (joint zeros and axes 0.02 deg each, links 0.2 mm each).
_ARM_AS_IT_IS = (float(np.radians(0.05)), 4e-4)
ROBOTS: Mapping[str, tuple[float, float] | None] = MappingProxyType({
    STRONGEST: (float(np.radians(0.5)), 1e-3),
    f"{STRONGEST}, arm as it is": _ARM_AS_IT_IS,
    f"{STRONGEST}, arm exact": None,
})  # fmt: skip


def strongest_is_here() -> bool:
    """Whether vision-calibration is installed."""
    return importlib.util.find_spec("vision_calibration") is not None


def vision_calibration(name: str, taken: Taken) -> Solved:
    """Its joint refinement of intrinsics, hand-eye, board and, where allowed, the arm's poses."""
    vc: Any = importlib.import_module("vision_calibration")
    points = [tuple(p) for p in taken.nominal.tabletarget.corners.tolist()]
    views = [
        vc.SingleCamHandeyeView(
            vc.Observation(points, [tuple(p) for p in uv.tolist()]), _pose(vc, T)
        )
        for T, uv in zip(taken.Ts_base_flange, taken.uvs_px, strict=True)
    ]
    sigmas = ROBOTS[name]
    robot = vc.RobotPoseConfig(False) if sigmas is None else vc.RobotPoseConfig(True, *sigmas)
    config = vc.SingleCamHandeyeCalibrationConfig(
        robot_poses=robot, solver=vc.SolverConfig(max_iters=200)
    )
    try:
        found = vc.run_single_cam_handeye(vc.SingleCamHandeyeDataset(views), config)
    except (RuntimeError, ValueError) as error:
        raise Implausible(f"{name}: {error}") from None
    camera = _camera(found.camera, taken.nominal.cameras["hand"])
    return Solved(
        taken.nominal.arm, camera, _se3(found.gripper_se3_camera), _se3(found.base_se3_target)
    )


def _pose(vc: Any, T: SE3) -> Any:
    w, x, y, z = to_quat_wxyz(T.rotation)
    return vc.Pose((x, y, z, w), tuple(T.translation.tolist()))


def _se3(pose: Any) -> SE3:
    R = Rotation.from_quat(pose.rotation_xyzw).as_matrix()
    return SE3(R, np.array(pose.translation_xyz))


def _camera(found: Any, size: Camera) -> Camera:
    k, d = found.intrinsics, found.distortion
    K = np.array([[k.fx, k.skew, k.cx], [0, k.fy, k.cy], [0, 0, 1.0]])
    return Camera(K, size.width, size.height, np.array([d.k1, d.k2, d.p1, d.p2, d.k3]))
