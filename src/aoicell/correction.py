"""From a located displacement to corrected robot poses.

Two forms of the same motion: the paper's equations (2)-(6), literally, and one product of
rigid transforms. A test holds them equal.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.cell_model import CellModel
from aoicell.errors import Unreachable
from aoicell.leftover import Bound, Leftover, bound_of
from aoicell.registration import Template
from aoicell.robot import Arm
from aoicell.targets.layout import LocatedLayout
from aoicell.transforms import SE3, Array, angle_of, from_twist


@dataclass(frozen=True)
class CorrectedView:
    """Where the arm has to go for one taught view: flange pose and joint angles (rad).

    `bound`: what the residual there stays below, where that is known.
    """

    id: str
    T_base_flange: SE3
    q: Array
    bound: Bound | None = None


@dataclass(frozen=True)
class Unreached:
    """A view that the arm cannot take: why, and the nearest that it can, where there is one."""

    id: str
    reason: str
    q_nearest: Array | None = None


@dataclass(frozen=True)
class Correction:
    """The board's motion in base axes, as measured, and the corrected views.

    `shift_mm` is how far the located frame's origin moved, `turn_deg` by how much it turned.
    `leftover`: the belief about what is left at the views, where the calibration has one.
    """

    T_base_motion: SE3
    located: LocatedLayout
    shift_mm: float
    turn_deg: float
    views: tuple[CorrectedView, ...]
    leftover: Leftover | None = None
    unreached: tuple[Unreached, ...] = ()

    def without(self, unreached: Sequence[Unreached]) -> "Correction":
        """The correction for the other views; raises Unreachable when none is left."""
        if not unreached:
            return self
        out = {view.id for view in unreached}
        kept = [k for k, view in enumerate(self.views) if view.id not in out]
        if not kept:
            raise Unreachable("; ".join(view.reason for view in unreached))
        return replace(
            self,
            views=tuple(self.views[k] for k in kept),
            leftover=self.leftover and self.leftover.only(kept),
            unreached=(*self.unreached, *unreached),
        )


def motion_by_poses(T_base_target_taught: SE3, T_base_target_now: SE3) -> SE3:
    """T_base_motion, with p_now = T_base_motion p_taught for points fixed to the target."""
    return T_base_target_now * T_base_target_taught.inverse()


def motion_by_equations(T_S: SE3, T_N: SE3, T_base_camera: SE3) -> SE3:
    """The paper's equations (2)-(6): the same motion from T_S and T_N at the check pose.

    T_S and T_N are T_camera_marker as taught and now, T_base_camera the camera at the check
    pose. T_D (2) is expressed in the marker's axes, while R and t of (3)-(6) act in the
    base's: it is carried over (conjugated) by the taught marker pose.
    """
    T_D = T_N.inverse() * T_S  # (2): maps marker-1 coordinates to marker-2 coordinates
    T_base_marker = T_base_camera * T_S
    S = T_base_marker.translation
    # the marker's own motion is the inverse of T_D, seen from the taught marker
    moved = T_base_marker * T_D.inverse()
    R = moved.rotation @ T_base_marker.rotation.T
    t = moved.translation - S
    to_origin = SE3(np.eye(3), -S)  # (3)
    rotate = SE3(R, np.zeros(3))  # (4)
    back = SE3(np.eye(3), S)  # (5)
    translate = SE3(np.eye(3), t)  # (6)
    return translate * back * rotate * to_origin


def correct(
    template: Template,
    located: LocatedLayout,
    T_base_camera_taught: SE3,
    T_base_camera_now: SE3,
    arm: Arm,
    by_equations: bool = False,
) -> Correction:
    """Corrected poses for all taught views, on the taught joint branch.

    The camera poses are those of the two looks, taught and now. `by_equations` takes the
    paper's form. A view that leaves the arm's reach is told of, and the others go on; raises
    Unreachable when that is the last.
    """
    T_S, T_N = template.taught.T_camera_target, located.T_camera_target
    T_base_taught = T_base_camera_taught * T_S
    if by_equations:
        motion = motion_by_equations(T_S, T_N, T_base_camera_now)
    else:
        motion = motion_by_poses(T_base_taught, T_base_camera_now * T_N)
    centre = T_base_taught.translation
    views, unreached = corrected_views(template, motion, arm)
    if not views:
        raise Unreachable("; ".join(view.reason for view in unreached))
    return Correction(
        T_base_motion=motion,
        located=located,
        shift_mm=float(np.linalg.norm(motion.act(centre) - centre)) * 1e3,
        turn_deg=float(np.degrees(angle_of(motion))),
        views=views,
        unreached=unreached,
    )


def corrected_views(
    template: Template, motion: SE3, arm: Arm, min_singularity_margin: float = 0.03
) -> tuple[tuple[CorrectedView, ...], tuple[Unreached, ...]]:
    """The taught views carried along with the board, and those of them that are out of reach.

    Near a singularity a small step on the board takes a large one of a joint: such a view counts
    as out of reach.
    """
    views: list[CorrectedView] = []
    unreached: list[Unreached] = []
    for view in template.views:
        q_taught, name = view.standard.state.q, f"corrected view {view.id}"
        T = motion * arm.fk(q_taught)
        try:
            q = arm.ik(T, q_taught, name)
        except Unreachable as error:
            unreached.append(Unreached(view.id, str(error), error.q_nearest))
            continue
        margin = arm.singularity_margin(q)
        if margin < min_singularity_margin:
            reason = (
                f"{name}: the arm is nearly singular there (smallest singular value {margin:.3f}, "
                f"at least {min_singularity_margin} is wanted); put the board elsewhere"
            )
            unreached.append(Unreached(view.id, reason, q))
            continue
        views.append(CorrectedView(view.id, T, q))
    return tuple(views), tuple(unreached)


def shifted_views(
    views: Sequence[CorrectedView], leftover: Leftover, model: CellModel
) -> tuple[tuple[CorrectedView, ...], tuple[Unreached, ...]]:
    """The views moved so that what is expected to be left vanishes, and those that cannot be."""
    shifted, unreached = [], []
    for k, view in enumerate(views):
        if not leftover.mean_of(k).any():
            shifted.append(view)
            continue
        T_base_camera = model.T_base_camera(view.q) * from_twist(leftover.mean_of(k))
        T = T_base_camera * model.T_flange_camera.inverse()
        try:
            q = model.arm.ik(T, view.q, f"corrected view {view.id}")
        except Unreachable as error:
            unreached.append(Unreached(view.id, str(error), error.q_nearest))
            q = view.q
        shifted.append(replace(view, T_base_flange=T, q=q))
    return tuple(shifted), tuple(unreached)


def with_bounds(
    correction: Correction, model: CellModel, targets: Mapping[str, Array]
) -> Correction:
    """The correction with the bound of each view at its targets (N, 3), given in the camera."""
    leftover = correction.leftover
    if leftover is None:
        return correction
    views = tuple(
        replace(view, bound=bound_of(model, leftover.of(k), targets[view.id]))
        for k, view in enumerate(correction.views)
    )
    return replace(correction, views=views)
