"""What a change since an old calibration does at the work point, if that is used anyway.

The work points are the middles of the targets of the new views. A target is located in a
picture by the old intrinsics and placed by the old mount; the error is its distance from where
it is by the changed ones.
"""

from dataclasses import dataclass

import numpy as np

from aoicell.calibration.drift_statistics import ChangeTest
from aoicell.calibration.measurement import shaped_points
from aoicell.calibration.parameters import Estimate, Layout, retract
from aoicell.calibration.problem import Problem, Sight
from aoicell.calibration.starts import SightPoses
from aoicell.targets.pose import refine_pose
from aoicell.transforms import SE3, Array


@dataclass(frozen=True)
class Effect:
    """Errors at the work points (mm): root mean square, its standard deviation, and the largest."""

    rms_mm: float
    std_mm: float
    max_mm: float


def working_error(
    problem: Problem, layout: Layout, old: Estimate, new: Estimate, change: ChangeTest,
    directions: Array,
) -> Effect:  # fmt: skip
    """The error of the `old` estimate where the `new` one holds.

    `change` led from one to the other along `directions` (P, k); its covariance becomes that of
    the error by finite differences.
    """
    errors = _errors(problem, old, new)
    std = np.sqrt(np.diag(change.covariance))
    J = np.zeros((errors.size, len(std)))
    for k, size in enumerate(std):
        if size > 0:
            step = directions[:, k] * size
            moved = retract(layout, new, step, new.deviations)
            J[:, k] = (_errors(problem, old, moved) - errors).ravel() / size
    variances = np.einsum("ij,jk,ik->i", J, change.covariance, J).reshape(-1, 3).sum(axis=1)
    lengths = np.linalg.norm(errors, axis=1)
    return Effect(
        float(np.sqrt((lengths**2).mean())) * 1e3,
        float(np.sqrt(variances.mean())) * 1e3,
        float(lengths.max()) * 1e3,
    )


def _errors(problem: Problem, old: Estimate, new: Estimate) -> Array:
    """Where the old estimate places each sight's target less where it is (sights, 3), m."""
    (eye,) = problem.eyes
    X_old, X_new = old.T_mount_eye[eye.name], new.T_mount_eye[eye.name]
    errors = []
    for view in problem.views:
        A = view.T_base_flange
        for sight in view.sights:
            fixture = problem.fixture(sight.fixture)
            Y, on_flange = new.T_mount_fixture[fixture.name], fixture.mount == "flange"
            E = A * X_new if eye.mount == "flange" else X_new
            seen = E.actInv(A * Y if on_flange else Y)
            middle = fixture.points.mean(axis=0)
            located = seen
            if isinstance(sight, Sight):
                points = _sized(problem, new, fixture.name)[sight.ids]
                uv = new.cameras[eye.name].project(points, seen)
                believed = _sized(problem, old, fixture.name)[sight.ids]
                located, _ = refine_pose(believed, uv, old.cameras[eye.name], seen)
            turned = A.rotation if eye.mount == "flange" else np.eye(3)
            errors.append(turned @ (X_old.act(located.act(middle)) - X_new.act(seen.act(middle))))
    return np.array(errors)


def _sized(problem: Problem, estimate: Estimate, fixture: str) -> Array:
    return estimate.scales[fixture] * shaped_points(problem, estimate, fixture)


def hidden_error(problem: Problem, poses: SightPoses, knock: ChangeTest) -> float:
    """One standard deviation (m) at the targets of a camera's knock that views hardly show.

    Infinite where they do not tell all six directions of it.
    """
    if not knock.complete:
        return np.inf
    variances = []
    for (v, s), T in poses.items():
        sight = problem.views[v].sights[s]
        fixture = problem.fixture(sight.fixture)
        x = T.act(fixture.points.mean(axis=0))
        J = SE3(np.eye(3), -x).toActionMatrix()[:3]  # v + w x x
        variances.append(float(np.trace(J @ knock.covariance @ J.T)))
    return float(np.sqrt(np.mean(variances)))
