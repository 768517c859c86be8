"""The closed forms of hand-eye calibration in OpenCV: starts for the refinement, and baselines.

All solve A_v X B_v = Z over the views: A = T_base_flange and B = T_camera_target measured,
X = T_flange_camera and Z = T_base_target unknown (eye in hand). Eye to hand is the same with
A inverted: X = T_base_camera, Z = T_flange_target. Each answer is checked, because they
return NaN, mirrored rotations and targets behind the camera with success.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, get_args

import cv2
import numpy as np

from aoicell.errors import Implausible, InputError, did_you_mean
from aoicell.transforms import SE3, Array, apply, is_rigid, mean_pose

ClosedForm = Literal["tsai", "park", "horaud", "andreff", "daniilidis", "shah", "li"]
CLOSED_FORMS: tuple[ClosedForm, ...] = get_args(ClosedForm)

_HAND_EYE = MappingProxyType(
    {
        "tsai": cv2.CALIB_HAND_EYE_TSAI,  # Tsai, Lenz 1989
        "park": cv2.CALIB_HAND_EYE_PARK,  # Park, Martin 1994
        "horaud": cv2.CALIB_HAND_EYE_HORAUD,  # Horaud, Dornaika 1995
        "andreff": cv2.CALIB_HAND_EYE_ANDREFF,  # Andreff, Horaud, Espiau 1999
        "daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,  # Daniilidis 1999
    }
)
_ROBOT_WORLD = MappingProxyType(
    {
        "shah": cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH,  # Shah 2013
        "li": cv2.CALIB_ROBOT_WORLD_HAND_EYE_LI,  # Li, Wang, Wu 2010
    }
)


@dataclass(frozen=True)
class ClosedFormResult:
    """X and Z of A X B = Z, and how far the target strays: `gaps` (views,) in m.

    A gap is the distance between the target's origin through a view and in Z.
    """

    method: ClosedForm
    X: SE3
    Z: SE3
    gaps: Array

    @property
    def scatter_mm(self) -> float:
        """Root mean square of the gaps."""
        return float(np.sqrt(np.mean(self.gaps**2))) * 1e3


def solve_closed_form(As: Sequence[SE3], Bs: Sequence[SE3], method: ClosedForm) -> ClosedFormResult:
    """One closed form over at least three views.

    Raises Implausible when the answer is not finite, not right-handed, or hopeless.
    """
    if method not in CLOSED_FORMS:
        raise InputError(f"closed form: unknown '{method}'; {did_you_mean(method, CLOSED_FORMS)}")
    if len(As) < 3 or len(As) != len(Bs):
        raise Implausible(
            f"closed form '{method}': {len(As)} arm poses and {len(Bs)} target poses; it takes at "
            "least three of each, in pairs"
        )
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        X, Z = (_hand_eye if method in _HAND_EYE else _robot_world)(As, Bs, method)
    except cv2.error as error:
        raise Implausible(
            f"closed form '{method}': OpenCV gave up over {len(As)} views ({error.err}); take "
            "views with more rotation about two axes"
        ) from None
    finally:
        cv2.utils.logging.setLogLevel(level)  # what it would print is raised here instead
    if not (is_rigid(X, 1e-4) and is_rigid(Z, 1e-4)):
        raise Implausible(
            f"closed form '{method}': no right-handed rigid transform came out of {len(As)} views; "
            "take views with more rotation about two axes"
        )
    result = ClosedFormResult(method, X, Z, gaps(As, Bs, X, Z))
    _check_in_front(As, Bs, result)
    return result


def every_closed_form(
    As: Sequence[SE3], Bs: Sequence[SE3]
) -> tuple[list[ClosedFormResult], list[Implausible]]:
    """What all seven make of the same views: the answers that stand, and why the rest do not."""
    solved, failed = [], []
    for method in CLOSED_FORMS:
        try:
            solved.append(solve_closed_form(As, Bs, method))
        except Implausible as reason:
            failed.append(reason)
    return solved, failed


def gaps(As: Sequence[SE3], Bs: Sequence[SE3], X: SE3, Z: SE3) -> Array:
    """Distance (views,) in m of the target's origin through each view from its place in Z."""
    return np.array(
        [
            np.linalg.norm((A * X * B).translation - Z.translation)
            for A, B in zip(As, Bs, strict=True)
        ]
    )


def scale_from_motion(As: Sequence[SE3], Bs: Sequence[SE3], X: SE3) -> tuple[float, float, SE3]:
    """How much larger the target is than declared, its standard deviation, and X to go with it.

    With the rotations known, R_A R_X (s t_B) + R_A t_X - t_Z = -t_A is linear in s, t_X, t_Z:
    the arm's own motion is the measuring rod. Infinite deviation when nothing tells.
    """
    rows, rhs = [], []
    for A, B in zip(As, Bs, strict=True):
        turned = (A.rotation @ X.rotation @ B.translation)[:, None]
        rows.append(np.hstack([turned, A.rotation, -np.eye(3)]))
        rhs.append(-A.translation)
    M, y = np.vstack(rows), np.concatenate(rhs)
    solution, _, rank, _ = np.linalg.lstsq(M, y, rcond=1e-9)
    if rank < 7 or len(y) <= 7:
        return 1.0, np.inf, X
    variance = float(((M @ solution - y) ** 2).sum()) / (len(y) - 7)
    std = float(np.sqrt(variance * np.linalg.inv(M.T @ M)[0, 0]))
    return float(solution[0]), std, SE3(X.rotation, solution[1:4])


def _hand_eye(As: Sequence[SE3], Bs: Sequence[SE3], method: str) -> tuple[SE3, SE3]:
    R, t = cv2.calibrateHandEye(
        [A.rotation for A in As],
        [A.translation for A in As],
        [B.rotation for B in Bs],
        [B.translation for B in Bs],
        method=_HAND_EYE[method],  # by position it would be taken for an output
    )
    X = SE3(np.asarray(R, dtype=float), np.ravel(t).astype(float))
    Zs = [A * X * B for A, B in zip(As, Bs, strict=True)]
    finite = is_rigid(X, 1e-4)
    return X, mean_pose(Zs) if finite else X


def _robot_world(As: Sequence[SE3], Bs: Sequence[SE3], method: str) -> tuple[SE3, SE3]:
    inverses = [A.inverse() for A in As]
    R_Z, t_Z, R_X, t_X = cv2.calibrateRobotWorldHandEye(
        [B.rotation for B in Bs],
        [B.translation for B in Bs],
        [A.rotation for A in inverses],
        [A.translation for A in inverses],
        method=_ROBOT_WORLD[method],
    )
    X = SE3(np.asarray(R_X, dtype=float), np.ravel(t_X).astype(float))
    Z = SE3(np.asarray(R_Z, dtype=float), np.ravel(t_Z).astype(float))
    ok = np.isfinite(X.homogeneous).all() and np.isfinite(Z.homogeneous).all()
    return (X.inverse(), Z.inverse()) if ok else (X, Z)


def _check_in_front(As: Sequence[SE3], Bs: Sequence[SE3], result: ClosedFormResult) -> None:
    """The target where X and Z put it has to lie on the camera's side, as it was seen to."""
    behind = 0
    for A, B in zip(As, Bs, strict=True):
        expected = apply((A * result.X).actInv(result.Z), np.zeros(3))
        behind += bool(expected[2] <= 0 < B.translation[2])
    if behind > len(As) / 2:
        raise Implausible(
            f"closed form '{result.method}': it puts the target behind the camera in {behind} of "
            f"{len(As)} views; check the direction of the poses"
        )
