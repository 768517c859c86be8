"""What two looks at the board, as taught and now, say about the corrected views.

To first order a left-over e (see `leftover`) is linear in everything that is not known exactly:
lens, hand-eye and joint terms (shared by all pictures, so that most of it cancels), the noise of
the two pictures that located the board, the arm's arrivals, and a drift of the camera between
them. With C the camera's error twist, S for the taught and N for the present pictures, L for the
look-out pose and t for what a picture has wrong by its pixels:

    e = c_S - c_N + Ad(C_N^-1 C_LN) (c_LN + t_N) - Ad(C_S^-1 C_LS) (c_LS + t_S)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.special import chdtrc

from aoicell.calibration.cell_model import CellModel
from aoicell.leftover import Drift, Leftover, conditioned
from aoicell.transforms import SE3, Array, apply


@dataclass(frozen=True)
class Look:
    """A picture that located the board: the joint angles q (rad), the points (N, 3) that it shows
    in the board's frame, where it found the board, and the pixel noise of the points.

    `covariance` (6, 6) of the pose, as `TargetPose` has it, stands in for that noise.
    """

    q: Array
    points: Array
    T_camera_board: SE3
    sigma_px: float
    covariance: Array | None = None

    def of_pixels(self, by_twist: Array) -> Array:
        """Covariance (6, 6) of the board's twist in the camera's axes, by the pixels alone.

        `by_twist` (2N, 6): how the pixels move with it.
        """
        if self.covariance is None:
            return np.asarray(np.linalg.pinv(by_twist.T @ by_twist) * self.sigma_px**2)
        # from a turn about the board's origin and a shift to a twist about the camera's
        x, y, z = self.T_camera_board.translation
        M = np.zeros((6, 6))
        M[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        M[:3, 3:] = M[3:, :3] = np.eye(3)
        return np.asarray(M @ self.covariance @ M.T)


@dataclass(frozen=True)
class Reference:
    """A fixed target seen twice from joint angles q (rad), as the board was taught and now: its
    points (N, 3) in the camera, how far they moved in the picture (N, 2), and their pixel noise.
    """

    q: Array
    points: Array
    moved_px: Array
    sigma_px: float


@dataclass(frozen=True)
class Sliding:
    """How flat the table is on which a board slides, and how far it leaves the plane where it
    does not; one sigma each. The evidence has to favour sliding by `odds` to be believed.
    """

    flat_mm: float = 0.05
    flat_deg: float = 0.01
    lift_mm: float = 2.0
    tilt_deg: float = 1.0
    odds: float = 20.0


def expected_leftover(
    model: CellModel,
    taught: Look,
    now: Look,
    taught_qs: Sequence[Array],
    corrected_qs: Sequence[Array],
    drift: Drift,
    references: Sequence[Reference] = (),
    sliding: Sliding | None = None,
) -> tuple[Leftover, float]:
    """The belief about the views that a correction by two looks leads to.

    Comes with the probability that the references move as far as they did (1 without): what
    they show of the camera's drift is part of the belief, and so is that the board has slid on
    its table, where the looks say so themselves.
    """
    unknown = _Unknown(model, taught, now, drift)
    probability = unknown.see(references) if references else 1.0
    C_LS, C_LN = model.T_base_camera(taught.q), model.T_base_camera(now.q)
    by_taught, by_now = unknown.of_look(taught, 0), unknown.of_look(now, 1)
    if sliding is not None:
        Y_S, Y_N = C_LS * taught.T_camera_board, C_LN * now.T_camera_board
        y_S, y_N = C_LS.toActionMatrix() @ by_taught, C_LN.toActionMatrix() @ by_now
        _take_for_sliding(unknown, Y_S, Y_N, y_S, y_N, sliding)
    rows = []
    for q_S, q_N in zip(taught_qs, corrected_qs, strict=True):
        C_S, C_N = model.T_base_camera(q_S), model.T_base_camera(q_N)
        row = C_N.actInv(C_LN).toActionMatrix() @ by_now
        row = row - C_S.actInv(C_LS).toActionMatrix() @ by_taught
        row[:, unknown.parameters] += model.camera_twists(q_S) - model.camera_twists(q_N)
        row[:, unknown.mount] -= np.eye(6)
        rows.append(row)
    F = np.vstack(rows)
    P = F @ unknown.covariance @ F.T
    P += block_diag(*(model.arrival_covariance(q) for q in taught_qs))
    arrivals = np.array([model.arrival_covariance(q) for q in corrected_qs])
    return Leftover(F @ unknown.mean, (P + P.T) / 2, arrivals), probability


class _Unknown:
    """Everything that is not known exactly, side by side: the parameters, what the two looks
    have wrong by arrival and pixels (a twist each), the drift of mount and focal length.
    """

    def __init__(self, model: CellModel, taught: Look, now: Look, drift: Drift) -> None:
        self._model, size = model, model.size
        self.parameters = slice(0, size)
        self.looks = (slice(size, size + 6), slice(size + 6, size + 12))
        self.mount, self.focal = slice(size + 12, size + 18), size + 18
        self.mean = np.zeros(size + 19)
        self.covariance = np.zeros((size + 19, size + 19))
        self.covariance[:size, :size] = model.covariance
        self.covariance[size + 12 :, size + 12 :] = drift.covariance
        for where, look in zip(self.looks, (taught, now), strict=True):
            J, _ = model.pixel_derivatives(apply(look.T_camera_board, look.points))
            self.covariance[where, where] = model.arrival_covariance(look.q) + look.of_pixels(J)

    def of_look(self, look: Look, which: int) -> Array:
        """The twist of the board in the camera's axes that a look has wrong, (6, unknowns)."""
        J, K = self._model.pixel_derivatives(apply(look.T_camera_board, look.points))
        inverse = np.linalg.pinv(J)
        row = np.zeros((6, len(self.mean)))
        row[:, self.parameters] = self._model.camera_twists(look.q) - inverse @ K
        row[:, self.looks[which]] = np.eye(6)
        if which == 1:
            row[:, self.mount] = np.eye(6)
            row[:, self.focal] = -inverse @ self._model.by_focal(K)
        return row

    def see(self, references: Sequence[Reference]) -> float:
        """Take in what a fixed target shows from one or more poses; the probability that it
        moves that far as a whole, or grows.

        What its points do one by one would only hide a small motion of all.
        """
        A, z, noise = camera_equations(self._model, references)
        H = np.zeros((len(A), len(self.mean)))
        H[:, self.mount], H[:, self.focal] = A[:, :6], A[:, 6]
        S = H @ self.covariance @ H.T + noise
        whole = A.T @ np.linalg.solve(S, np.column_stack([z, A]))
        distance = float(whole[:, 0] @ np.linalg.solve(whole[:, 1:], whole[:, 0]))
        self.observe(H, z, noise)
        return float(chdtrc(A.shape[1], distance))

    def observe(self, H: Array, z: Array, R: Array) -> None:
        """Take in z = H u + noise of covariance R."""
        self.mean, self.covariance, _ = conditioned(self.mean, self.covariance, H, z, R)


def camera_equations(
    model: CellModel, references: Sequence[Reference]
) -> tuple[Array, Array, Array]:
    """What a fixed target says about the camera: A (N, 7), z (N,) and the noise's covariance
    (N, N) of z = A u + noise, u the twist of the camera in its own axes (m, rad) on its mount
    and the relative change of its focal length since the target was seen first.
    """
    parts = [model.pixel_derivatives(reference.points) for reference in references]
    A = np.vstack([np.column_stack([-J, model.by_focal(K)]) for J, K in parts])
    z = np.concatenate([reference.moved_px.ravel() for reference in references])
    noise = block_diag(
        *(
            2 * r.sigma_px**2 * np.eye(len(J)) + 2 * J @ model.arrival_covariance(r.q) @ J.T
            for r, (J, _) in zip(references, parts, strict=True)
        )
    )
    return A, z, noise


def rigidity(model: CellModel, reference: Reference) -> float:
    """The probability that points move by so much beside a common motion and a change of scale.

    Next to none: something lies over the target, or shines on it.
    """
    J, K = model.pixel_derivatives(reference.points)
    A, z = np.column_stack([J, model.by_focal(K)]), reference.moved_px.ravel()
    alone = z - A @ np.linalg.lstsq(A, z, rcond=None)[0]
    return float(chdtrc(len(z) - A.shape[1], alone @ alone / (2 * reference.sigma_px**2)))


def _take_for_sliding(
    unknown: _Unknown, Y_S: SE3, Y_N: SE3, y_S: Array, y_N: Array, sliding: Sliding
) -> None:
    """Hold the board in its plane if the looks themselves favour that it never left it.

    `y_S`, `y_N` (6, unknowns): what the board's poses in the base have wrong. Both readings,
    slid or lifted, are weighed by how probable they make what was measured.
    """
    M = Y_N * Y_S.inverse()
    sides, normal = Y_S.rotation[:, :2], Y_S.rotation[:, 2]
    turned, centre = M.rotation @ normal, Y_N.translation
    measured = np.array([*(sides.T @ turned), normal @ (centre - Y_S.translation)])
    # by a twist (v, w) of the base's axes: w x turned, and v + w x centre along the normal
    D = np.zeros((3, 6))
    D[:2, 3:] = np.cross(turned, sides.T)
    D[2, :3], D[2, 3:] = normal, np.cross(centre, normal)
    H = D @ (y_N - M.toActionMatrix() @ y_S)
    flat = np.diag(np.square([*[np.radians(sliding.flat_deg)] * 2, sliding.flat_mm / 1e3]))
    free = np.diag(np.square([*[np.radians(sliding.tilt_deg)] * 2, sliding.lift_mm / 1e3]))
    z, S = -measured - H @ unknown.mean, H @ unknown.covariance @ H.T + flat
    slid = _log_density(z, S)
    lifted = _log_density(z, S + free)
    if slid - lifted > np.log(sliding.odds):
        unknown.observe(H, -measured, flat)


def _log_density(z: Array, covariance: Array) -> float:
    """Of a normal distribution about zero, up to a constant that hangs on the length of z."""
    L = np.linalg.cholesky(covariance)
    y = solve_triangular(L, z, lower=True)
    return float(-y @ y / 2 - np.log(np.diag(L)).sum())
