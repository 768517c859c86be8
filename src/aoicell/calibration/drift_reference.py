"""An old calibration as a drift check takes it: values, covariance, noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from aoicell.calibration.bundle import Noise, Solution
from aoicell.calibration.parameters import Layout, Lens
from aoicell.calibration.problem import Eye, Mount, Problem, sights_of
from aoicell.calibration.starts import SightPoses
from aoicell.calibration.uncertainty import Uncertainty
from aoicell.camera import Camera
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array, mean_pose


@dataclass(frozen=True)
class Reference:
    """An old calibration of one eye, as far as a drift check needs it.

    `covariance` (P, P) goes with `names` as a layout names its parameters; `noise` is that of
    the views, widened where they scattered; `views` is how many it was learnt from.
    """

    eye: str
    mount: Mount
    T_mount_eye: SE3
    camera: Camera | None
    lens: Lens
    T_mount_fixture: Mapping[str, SE3]
    scales: Mapping[str, float]
    forms: Mapping[str, Array]
    noise: Noise
    names: tuple[str, ...]
    covariance: Array
    views: int


def reference_of(solution: Solution, uncertainty: Uncertainty) -> Reference:
    """What a later check needs of a calibration of one eye.

    Raises InputError for several eyes and where joint terms of the arm were estimated.
    """
    problem, layout, estimate = solution.problem, solution.layout, solution.estimate
    if len(problem.eyes) != 1:
        raise InputError(
            f"drift check: it compares one camera, the calibration has {len(problem.eyes)}; "
            "calibrate each by itself"
        )
    if layout.model.robot == "joint_terms":
        raise InputError(
            "drift check: the calibration has joint terms of the arm; it compares flange poses as "
            "the controller gives them: calibrate without joint angles"
        )
    (eye,) = problem.eyes
    # views that scatter more than the model says: the arm's doing, or the points' of each view
    exact = layout.model.robot == "exact"
    arm, points = (0.0, uncertainty.inflation) if exact else (uncertainty.inflation, 1.0)
    noise = solution.noise
    return Reference(
        eye.name, eye.mount, estimate.T_mount_eye[eye.name], estimate.cameras.get(eye.name),
        layout.model.lens, estimate.T_mount_fixture, estimate.scales, estimate.forms,
        Noise(noise.sigma * points, noise.deviation_m * arm, noise.deviation_rad * arm),
        uncertainty.names, uncertainty.covariance, len(problem.views),
    )  # fmt: skip


def under_reference(problem: Problem, reference: Reference) -> Problem:
    """The same views with the old camera, under the old name."""
    if len(problem.eyes) != 1:
        raise InputError(
            f"drift check: the recording has {len(problem.eyes)} cameras, the check compares one"
        )
    (eye,) = problem.eyes
    if eye.mount != reference.mount:
        raise InputError(
            f"drift check: '{eye.name}' stands on the {eye.mount}, in the calibration on the "
            f"{reference.mount}; check the mount of the recording"
        )
    if (eye.camera is None) != (reference.camera is None):
        raise InputError(
            "drift check: calibration and recording have to be both of pictures or both of poses"
        )
    views = tuple(
        replace(v, sights=tuple(replace(s, eye=reference.eye) for s in v.sights), q=None)
        for v in problem.views
    )
    seen = {s.fixture for v in views for s in v.sights}
    fixtures = tuple(f for f in problem.fixtures if f.name in seen)
    return Problem((Eye(reference.eye, reference.camera, eye.mount, True),), fixtures, views)


def covariance_in(layout: Layout, reference: Reference) -> Array:
    """The old covariance in a layout's order.

    A print that is new is known as well as a printer is good for; the rest that the calibration
    does not name was taken as given.
    """
    at = {name: i for i, name in enumerate(reference.names)}
    known = [(i, at[name]) for i, name in enumerate(layout.names) if name in at]
    covariance = np.zeros((layout.size, layout.size))
    for (kind, name), where in layout.blocks.items():
        if kind in ("scale", "form") and name not in reference.T_mount_fixture:
            covariance[where, where] = np.diag(layout.prior[where] ** 2)
    here, there = [i for i, _ in known], [j for _, j in known]
    covariance[np.ix_(here, here)] = reference.covariance[np.ix_(there, there)]
    return covariance


def placed_by(problem: Problem, poses: SightPoses, reference: Reference, name: str) -> SE3:
    """Where the old calibration puts a fixture, in the mean over the views."""
    (eye,), fixture = problem.eyes, problem.fixture(name)
    places = []
    for v, s in sights_of(problem, eye, fixture):
        A = problem.views[v].T_base_flange
        E = A * reference.T_mount_eye if eye.mount == "flange" else reference.T_mount_eye
        F = E * poses[v, s]
        places.append(A.actInv(F) if fixture.mount == "flange" else F)
    return mean_pose(places)


def nearer_reading(then: SE3, now: SE3, half_turn: SE3) -> tuple[SE3, SE3]:
    """An even board's old pose, read the way that lies nearer to the new one, and the turn."""
    turns = [SE3.Identity(), half_turn]
    turn = min(
        turns, key=lambda F: float(np.linalg.norm(pin.log3((then * F).actInv(now).rotation)))
    )
    return then * turn, turn
