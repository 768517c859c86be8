"""Whether the arm can take up a view of the board: asked of the design, answered with a reason.

Joint angles on the branch of the home posture, away from limits and singular postures; arm,
camera, cables and what stands around do not touch; nothing hides what the view looks at.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from aoicell.errors import Unreachable
from aoicell.nominal import Nominal, View
from aoicell.robot.collision import Solid
from aoicell.surroundings import BOARD, collision_model, keep_out
from aoicell.transforms import SE3, Array, apply

_BRANCH_STEP = float(np.radians(3))  # of the fastest joint, between two looks at the Jacobian
_STEPS = 10  # from near home to a view, where one leap ends on another branch
_LENS = 0.005  # the line of sight starts this far before the entrance pupil (m)
_TARGET = 0.002  # and ends this far above what is looked at (m)


@dataclass(frozen=True)
class ReachConfig:
    """What a posture has to keep away from.

    `singularity` is the smallest singular value of the flange's Jacobian (m and rad mixed). What
    a view must show stays `margin_px` inside the picture: the mount and lens of a real camera
    move it by so much. Bodies closer than `clearance_mm` by design count as touching.
    """

    limit_deg: float = 10.0
    singularity: float = 0.08
    clearance_mm: float = 20.0
    margin_px: float = 30.0


@dataclass(frozen=True)
class Reached:
    """A view that the arm can take up: joint angles q (rad), and how far off trouble it is.

    `limit_margin` (rad) is to the nearest joint limit; `singularity_margin` as in the config.
    """

    view: View
    q: Array
    limit_margin: float
    singularity_margin: float


class Reach:
    """The arm over a board that lies at `T_base_board` (by default where the design has it)."""

    def __init__(
        self,
        nominal: Nominal,
        T_base_board: SE3 | None = None,
        config: ReachConfig | None = None,
        obstacles: Iterable[Solid] = (),
    ) -> None:
        """`obstacles` are what stands around beside what the design of the cell names."""
        T = nominal.T_base_board if T_base_board is None else T_base_board
        self.nominal = replace(nominal, T_base_board=T)
        self.config = config = config or ReachConfig()
        others = [*keep_out(nominal), *obstacles]
        self.cell = collision_model(self.nominal, config.clearance_mm / 1e3, others)

    def of(self, view: View, points: ArrayLike | None = None) -> Reached:
        """The posture for a view that shows `points` (N, 3) of the board, by default its aim.

        Raises Unreachable, with the reason, when there is none.
        """
        shown = np.atleast_2d(view.aim if points is None else np.asarray(points, dtype=float))
        T_base_camera = self.nominal.T_base_board * view.T_target_camera
        self._see(view, shown)
        reached = self.posture(T_base_camera * self.nominal.T_flange_camera.inverse(), view)
        self._look(reached, T_base_camera, apply(self.nominal.T_base_board, shown))
        return reached

    def reaches(self, view: View) -> bool:
        """Whether there is a posture for a view."""
        try:
            self.of(view)
        except Unreachable:
            return False
        return True

    def posture(self, T_base_flange: SE3, view: View) -> Reached:
        """The posture for a flange pose. Raises Unreachable when there is none to be used."""
        arm, config = self.nominal.arm, self.config
        q = self._ik(T_base_flange, view)
        margins = np.minimum(q - arm.lower, arm.upper - q)
        nearest = int(margins.argmin())
        if margins[nearest] < np.radians(config.limit_deg):
            raise _refused(
                view,
                f"{arm.joint_names[nearest]} would stand at {np.degrees(q[nearest]):.1f} deg, "
                f"{np.degrees(margins[nearest]):.1f} deg from its limit, and "
                f"{config.limit_deg:g} deg are kept free; turn or shift the view",
            )
        singularity = arm.singularity_margin(q)
        if singularity < config.singularity:
            raise _refused(
                view,
                f"the arm would be nearly singular ({singularity:.3f}, at least "
                f"{config.singularity:g} is wanted); tilt or shift the view",
            )
        self.refuse_contact(q, view.id)
        return Reached(view, q, float(margins[nearest]), singularity)

    def refuse_contact(self, q: Array, name: str) -> None:
        """Raise Unreachable when bodies touch at joint angles q (rad)."""
        pair = self.cell.touching(q)
        if pair is not None:
            raise Unreachable(
                f"{name}: {pair[0]} would come closer than {self.config.clearance_mm:g} mm to "
                f"{pair[1]}; choose another distance, tilt or roll, or move {pair[1]} away"
            )

    def _see(self, view: View, points: Array) -> None:
        camera, margin = self.nominal.cameras["hand"], self.config.margin_px
        if not camera.sees(points, view.T_target_camera.inverse(), margin):
            raise _refused(
                view, f"not all that it must show stays {margin:g} px inside the picture; aim at "
                "the middle of it, or look from farther off"
            )  # fmt: skip

    def _look(self, reached: Reached, T_base_camera: SE3, ps_base: Array) -> None:
        """Refuse when something stands between the lens and the points (N, 3) of the base.

        The board itself does not count: what its components hide of each other is no matter of
        the arm.
        """
        eye = T_base_camera.act(np.array([0, 0, _LENS]))
        for p in ps_base:
            above = p + _TARGET * (eye - p) / np.linalg.norm(eye - p)
            body = self.cell.between(reached.q, eye, above, ignored={BOARD})
            if body is not None:
                raise _refused(
                    reached.view, f"{body} would stand between the camera and what it looks at; "
                    "look from another side"
                )  # fmt: skip

    def _ik(self, T_base_flange: SE3, view: View) -> Array:
        """Joint angles on the branch of home, in one leap or in small steps from near home."""
        arm, refused = self.nominal.arm, None
        for near, steps in product(self._rolled(T_base_flange), (1, _STEPS)):
            q = near
            try:
                for share in np.arange(1, steps + 1) / steps:
                    q = arm.ik(SE3.Interpolate(arm.fk(near), T_base_flange, share), q, view.id)
            except Unreachable as error:
                # a leap's complaint is about the pose itself
                refused = error if refused is None and steps == 1 else refused
                continue
            if self._on_branch(q):
                return q
        raise refused or _refused(
            view, "only another branch of the arm than that of home reaches it; tilt the view"
        )

    def _rolled(self, T_base_flange: SE3) -> list[Array]:
        """Home with the last joint turned as far about the flange's axis as the pose is.

        The solution is near one of them: where one way round ends at the joint's limit, the other
        way round does not. That with the most room comes first.
        """
        arm, q_home = self.nominal.arm, self.nominal.q_home
        R = arm.fk(q_home).rotation.T @ T_base_flange.rotation
        roll = np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])
        ahead = q_home[-1] + roll * np.sign(arm.jacobian(q_home)[5, -1])
        turns = ahead + 2 * np.pi * np.array([0, -1, 1])
        beyond = np.maximum(turns - arm.upper[-1], arm.lower[-1] - turns)
        ends = np.clip(turns, arm.lower[-1], arm.upper[-1])
        order = [
            k
            for k in np.argsort(beyond, kind="stable")
            if beyond[k] <= max(beyond.min(), np.pi / 2)
        ]
        return [np.append(q_home[:-1], ends[k]) for k in order]

    def _on_branch(self, q: Array) -> bool:
        """Whether no singular posture lies on the straight way from home.

        Where there is none, the determinant of the Jacobian keeps its sign; another branch (elbow
        or wrist the other way) lies behind one.
        """
        arm, q_home = self.nominal.arm, self.nominal.q_home
        count = int(np.ceil(np.abs(q - q_home).max() / _BRANCH_STEP)) + 1
        way = q_home + np.linspace(0, 1, count)[:, None] * (q - q_home)
        signs = {np.sign(np.linalg.det(arm.jacobian(posture))) for posture in way}
        return len(signs) == 1


def _refused(view: View, reason: str) -> Unreachable:
    return Unreachable(f"{view.id}: {reason}")
