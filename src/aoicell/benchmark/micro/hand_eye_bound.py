"""How well a hand-eye can be known at all: the Bayesian bound of a drawn cell.

All that the tolerance profile draws is a parameter with its own prior, in units of its standard
deviation; pictures add what they tell, linearised at the truth. No estimator that knows less
has a smaller mean square error (Van Trees 1968). The arm's arrivals (repeatability, and the play
of its gears, of either sign) are six joint angles more for each picture.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.camera import Camera
from aoicell.sim.prints import true_corners
from aoicell.sim.projection import measured_noise
from aoicell.sim.scene import ARM
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, apply

_STEP = 1e-3  # of a parameter, in standard deviations


@dataclass(frozen=True)
class Bound:
    """Root mean squares: T_flange_camera in mm and deg; board points from unused poses in px and
    across the line of sight in mm.
    """

    hand_eye_mm: float
    hand_eye_deg: float
    px: float
    mm: float


def bayesian_bound(
    world: World, tolerances: Tolerances, seen: Sequence[Array], unused: Sequence[Array]
) -> Bound:
    """Of pictures of chessboard 2 at joint angles `seen` (rad); the world's arm has no scatter."""
    cell = _DrawnCell(world, tolerances)
    sigma = measured_noise(tolerances).corner_px
    looks = [cell.look(q) for q in seen]
    fixed, moving = looks[0].by_cell.shape[1], looks[0].by_arrival.shape[1]
    size = fixed + moving * len(looks)
    information = np.eye(size)
    for k, look in enumerate(looks):
        J = np.zeros((len(look.by_cell), size))
        J[:, :fixed] = look.by_cell
        J[:, fixed + moving * k : fixed + moving * (k + 1)] = look.by_arrival
        information += J.T @ J / sigma**2
    covariance = np.linalg.inv(information)[:fixed, :fixed]
    mount = np.sqrt(np.diag(covariance)[:6]) * cell.mount_sigma
    ahead = [cell.look(q) for q in unused]
    J = np.vstack([look.by_corners for look in ahead])
    px2 = 2 * np.einsum("ij,ij->i", J @ covariance, J)  # u and v summed, in the mean
    metres = np.concatenate([look.metres_per_px for look in ahead])
    return Bound(
        hand_eye_mm=float(np.linalg.norm(mount[:3])) * 1e3,
        hand_eye_deg=float(np.degrees(np.linalg.norm(mount[3:]))),
        px=float(np.sqrt(px2.mean())),
        mm=float(np.sqrt((px2 * metres**2).mean())) * 1e3,
    )


@dataclass(frozen=True)
class _Look:
    """Derivatives of the detected corners (2N, ...) by the cell's parameters and the arrival's.

    `by_corners` leaves out what only moves a corner's detection: dust. `metres_per_px` (2N,).
    """

    by_cell: Array
    by_corners: Array
    by_arrival: Array
    metres_per_px: Array


class _DrawnCell:
    """A drawn cell and its parameters: mount, arm, board, lens, print and dust."""

    def __init__(self, world: World, tolerances: Tolerances) -> None:
        self._world, self._t = world, tolerances
        self._camera = world.camera("hand")
        self._corners = world.board_points("tabletarget")
        self.mount_sigma = _twist(tolerances.mount_mm, tolerances.mount_deg)

    def look(self, q: Array) -> _Look:
        """The view from joint angles q (rad)."""
        world, t = self._world, self._t
        world.arrive(q)
        T_base_camera = world.T_base_body("hand")
        T = T_base_camera.actInv(world.geometry.T_base_tabletarget)
        points = apply(T, self._corners)
        by_point = _numerical(lambda x: self._camera.project(points + x * 1e-3), 3) * 1e3
        D = by_point.reshape(-1, 2, 3)
        lever = np.cross(points[:, None, :], np.eye(3)[None])  # (N, 3 axes, 3): x cross e_k
        # the camera's twist moves a point by -(v + w x x) = -v + x x w
        by_camera = np.concatenate([-D, np.einsum("nij,nkj->nik", D, lever)], axis=2).reshape(-1, 6)
        by_base = by_camera @ T_base_camera.toActionMatrixInverse()  # twists in base axes
        arm = self._arm(q, by_base)
        board = -by_camera @ T.toActionMatrix() @ self._placement()
        lens = _numerical(lambda x: self._lens(x).project(points), 8)
        form = _numerical(lambda x: self._camera.project(self._printed(x), T), 4)
        dust = np.zeros((len(points), 2, len(points), 2))
        turned = np.einsum("nij,jk->nik", D, T.rotation[:, :2])
        dust[np.arange(len(points)), :, np.arange(len(points))] = turned
        dust = dust.reshape(2 * len(points), -1) * measured_noise(t).corner_dust
        known = np.hstack([by_camera * self.mount_sigma, arm, board, lens, form])
        return _Look(
            np.hstack([known, dust]),
            np.hstack([known, np.zeros_like(dust)]),
            self._arrival(q, by_base),
            np.repeat(points[:, 2] / self._camera.focal_px, 2),
        )

    def _arm(self, q: Array, by_base: Array) -> Array:
        """By what is wrong with each link and joint zero (2N, 6 (dof + 1) + dof)."""
        world, t = self._world, self._t
        parts, before = [], np.eye(3)
        link = _twist(t.link_mm, t.axis_deg)
        for name in world.nominal.arm.joint_names:
            joint = world.T_base_body(_body_of(world, name))
            # a link's error acts where its joint stands, before the joint turns
            parts.append(by_base @ SE3(before, joint.translation).toActionMatrix() * link)
            before = joint.rotation
        flange = world.T_base_body(ARM + "flange").toActionMatrix()
        zeros = flange @ world.nominal.arm.jacobian(q) * np.radians(t.joint_zero_deg)
        return np.hstack([*parts, by_base @ flange * link, by_base @ zeros])

    def _arrival(self, q: Array, by_base: Array) -> Array:
        """By the scatter of each joint's arrival (2N, dof)."""
        arm, t = self._world.nominal.arm, self._t
        J = arm.jacobian(q)
        spread = t.repeatability_mm / 1e3 / 3.6 / float(np.sqrt((J[:3] ** 2).sum() / 3))
        sigma = np.hypot(spread, np.radians(t.backlash_deg) / 2)
        flange = self._world.T_base_body(ARM + "flange").toActionMatrix()
        return np.asarray(by_base @ flange @ J * sigma)

    def _placement(self) -> Array:
        """Twists (6, 3) of the board on the table: along x and y, and about its normal."""
        columns = np.zeros((6, 3))
        columns[0, 0] = columns[1, 1] = self._t.placement_mm / 1e3
        columns[5, 2] = np.radians(self._t.placement_deg)
        return columns

    def _lens(self, x: Array) -> Camera:
        """Another lens, x (8,) standard deviations away."""
        t, camera = self._t, self._camera
        K, distortion = np.array(camera.K), np.array(camera.distortion)
        K[[0, 1], [0, 1]] *= 1 + x[0] * t.focal_percent / 100
        K[:2, 2] += x[1:3] * t.principal_px
        K[0, 1] += x[3] * t.skew_px
        tangential = [t.tangential_sigma] * 2
        distortion[:4] += x[4:] * np.array([t.k1_sigma, t.k2_sigma, *tangential])
        return replace(camera, K=K, distortion=distortion)

    def _printed(self, x: Array) -> Array:
        """Another print, x (4,) standard deviations away: width, height, bow and twist."""
        t, geometry, board = self._t, self._world.geometry, self._world.nominal.tabletarget
        scale, bent = geometry.print_scales["tabletarget"], geometry.bows["tabletarget"]
        width, height = (
            s + e * t.print_um / 1e6 / side
            for s, e, side in zip(scale, x, board.size, strict=False)
        )
        bow, twist = bent[0] + x[2] * t.bow_mm / 1e3, bent[1] + x[3] * t.twist_mm / 1e3
        return true_corners(board, (width, height), (bow, twist))


def _twist(mm: float, deg: float) -> Array:
    """Standard deviations (6,) of a twist: along and about each axis."""
    return np.array([mm / 1e3] * 3 + [float(np.radians(deg))] * 3)


def _body_of(world: World, joint: str) -> str:
    return str(world.model.body(world.model.joint(ARM + joint).bodyid[0]).name)


def _numerical(project: Callable[[Array], Array], count: int) -> Array:
    """Derivatives (2N, count) of pixels (N, 2) at zero, by central differences."""
    columns = []
    for step in _STEP * np.eye(count):
        columns.append((project(step) - project(-step)).ravel() / (2 * _STEP))
    return np.column_stack(columns)
