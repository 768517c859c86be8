"""From a located displacement to corrected robot poses.

Two forms of the same motion: the paper's equations (2)-(6), literally, and one product of
rigid transforms. A test holds them equal.
"""

from dataclasses import dataclass

import numpy as np

from aoicell.registration import Template
from aoicell.robot import Arm
from aoicell.targets.layout import LocatedLayout
from aoicell.transforms import SE3, Array, angle_of


@dataclass(frozen=True)
class CorrectedView:
    """Where the arm has to go for one taught view: flange pose and joint angles (rad)."""

    id: str
    T_base_flange: SE3
    q: Array


@dataclass(frozen=True)
class Correction:
    """The board's motion in base axes, as measured, and the corrected views.

    `shift_mm` is how far the located frame's origin moved, `turn_deg` by how much it turned.
    """

    T_base_motion: SE3
    located: LocatedLayout
    shift_mm: float
    turn_deg: float
    views: tuple[CorrectedView, ...]


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
    paper's form. Raises Unreachable naming the view that leaves the arm's reach.
    """
    T_S, T_N = template.taught.T_camera_target, located.T_camera_target
    T_base_taught = T_base_camera_taught * T_S
    if by_equations:
        motion = motion_by_equations(T_S, T_N, T_base_camera_now)
    else:
        motion = motion_by_poses(T_base_taught, T_base_camera_now * T_N)
    centre = T_base_taught.translation
    return Correction(
        T_base_motion=motion,
        located=located,
        shift_mm=float(np.linalg.norm(motion.act(centre) - centre)) * 1e3,
        turn_deg=float(np.degrees(angle_of(motion))),
        views=corrected_views(template, motion, arm),
    )


def corrected_views(template: Template, motion: SE3, arm: Arm) -> tuple[CorrectedView, ...]:
    """The taught views carried along with the board."""
    views: list[CorrectedView] = []
    for view in template.views:
        q_taught = view.standard.state.q
        T = motion * arm.fk(q_taught)
        views.append(CorrectedView(view.id, T, arm.ik(T, q_taught, f"corrected view {view.id}")))
    return tuple(views)
