"""What a view shows of each feature, and whether that is enough."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.nominal import View
from aoicell.planning.heights import Flags, HeightField
from aoicell.planning.targets import Feature
from aoicell.transforms import SE3, Array, apply

SEEN = 1000.0  # one more feature that is seen outweighs however much better all others are seen


@dataclass(frozen=True)
class Limits:
    """When a feature counts as seen. The same for all features, so that figures compare.

    `px_per_mm`: the smallest part, 0.8 mm across, spans four pixels. `margin_px` keeps what a view
    must show off the picture's edge: mount (0.5 deg, 1 mm) and focal length (1 %) move the
    picture by 25 px (one sigma, at 0.5 m) when it is taught, a corrected pose by one at most.
    `angle_deg`: off the surface's normal; lower text and pins become unreadable beyond. Focus: the
    blur circle of a lens with this `aperture` (m) that is focused at `focus` (m), f/8 at 12 mm
    set between the views and the overview. Glare: no lamp may be mirrored into the lens by a
    surface that is tilted by up to `glare_deg`.
    """

    px_per_mm: float = 5.0
    margin_px: float = 75.0
    angle_deg: float = 30.0
    blur_px: float = 3.0
    aperture: float = 1.5e-3
    focus: float = 0.7
    glare_deg: float = 4.0


@dataclass(frozen=True)
class Scene:
    """All that decides what a view shows; `lamps` (L, 3) in the frame `board`, may be empty."""

    features: Sequence[Feature]
    field: HeightField
    camera: Camera
    lamps: Array
    limits: Limits


@dataclass(frozen=True)
class Sight:
    """What one view shows of one feature.

    `share` of its points that nothing hides and no lamp outshines, `px_per_mm` the least,
    `angle_deg` the largest off the normal, `margin_px` from its corners to the picture's edge
    (negative outside), `blur_px` the blur circle.
    """

    share: float
    px_per_mm: float
    angle_deg: float
    margin_px: float
    blur_px: float


class Inspector:
    """Answers what views show of the features of a scene; arrays over all features at once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        features = scene.features
        self._points = np.vstack([f.points for f in features])
        self._corners = np.vstack([f.corners for f in features])
        self._of_point = np.repeat(np.arange(len(features)), [len(f.points) for f in features])
        self._first_point = np.cumsum([0] + [len(f.points) for f in features])[:-1]
        self._first_corner = np.cumsum([0] + [len(f.corners) for f in features])[:-1]
        self._normals = np.array([f.normal for f in features])
        self._needed = np.array([f.share for f in features])
        self._counts = np.array([len(f.points) for f in features])

    def values(self, view: View) -> Array:
        """How well a view shows each feature, (F,): 0 where it does not count, else `SEEN` and up
        to 1 more: the visible share, from straight above, finely resolved.
        """
        columns, good = self._judge(view)
        share, scale, angle = columns[:3]
        limits = self.scene.limits
        finer = np.clip(scale / (1.3 * limits.px_per_mm), 0, 1)
        return np.where(good, SEEN + share * np.cos(np.radians(angle)) * finer, 0.0)

    def seen(self, view: View) -> Flags:
        """Which features a view shows well enough, (F,) bool."""
        return self._judge(view)[1]

    def sights(self, view: View) -> list[Sight]:
        """What a view shows of each feature."""
        columns, _ = self._judge(view, everything=True)
        return [Sight(*map(float, row)) for row in columns.T]

    def _judge(self, view: View, everything: bool = False) -> tuple[Array, Flags]:
        """Sights (5, F) and whether they are good enough (F,).

        Where the rest fails already, the share is left at 0 unless `everything` is asked for.
        """
        limits, T_board_camera = self.scene.limits, view.T_target_camera
        margin, scale, depth = self._in_picture(T_board_camera.inverse())
        lens = self.scene.camera
        blur = lens.focal_px * limits.aperture * np.abs(1 / depth - 1 / limits.focus)
        angle = self._angles(T_board_camera.translation)
        good = (
            (margin >= limits.margin_px)
            & (scale >= limits.px_per_mm)
            & (angle <= limits.angle_deg)
            & (blur <= limits.blur_px)
        )
        asked = margin > 0 if everything else good
        share = self._shares(T_board_camera.translation, asked)
        columns = np.array([share, scale, angle, margin, blur])
        return columns, good & (share >= self._needed - 1e-9)

    def _in_picture(self, T_camera_board: SE3) -> tuple[Array, Array, Array]:
        """Of each feature: least distance to the edge (px), least px/mm, nearest depth (m)."""
        camera = self.scene.camera
        ps = apply(T_camera_board, self._corners)
        behind = ps[:, 2] <= 1e-3
        ps[behind] = [0, 0, 1e-3]
        uv = ps[:, :2] / ps[:, 2:] * np.diag(camera.K)[:2] + camera.K[:2, 2]
        edge = np.minimum(uv, [camera.width - 1, camera.height - 1] - uv).min(axis=1)
        edge[behind] = -np.inf
        margin = np.minimum.reduceat(edge, self._first_corner)
        depth = np.maximum.reduceat(ps[:, 2], self._first_corner)
        scale = np.minimum.reduceat(_scale(camera, T_camera_board, ps), self._first_corner)
        return margin, scale / 1e3, depth

    def _angles(self, centre: Array) -> Array:
        """Largest angle (deg) of each feature's rays off its normal."""
        rays = centre - self._points
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        cosine = np.einsum("ij,ij->i", rays, self._normals[self._of_point])
        least = np.minimum.reduceat(cosine, self._first_point)
        return np.asarray(np.degrees(np.arccos(np.clip(least, -1, 1))))

    def _shares(self, centre: Array, asked: Flags) -> Array:
        """Visible share of each feature that is asked for; 0 for the others."""
        index = np.flatnonzero(asked[self._of_point])
        points = self._points[index]
        clear = self.scene.field.clear(points, centre)
        clear &= ~self._glare(points, self._normals[self._of_point[index]], centre)
        counts = np.bincount(self._of_point[index], weights=clear, minlength=len(asked))
        return np.asarray(counts / self._counts)

    def _glare(self, points: Array, normals: Array, centre: Array) -> Flags:
        """Where a lamp is mirrored into the lens: the normal halves the angle between them."""
        to_lens = _unit(centre - points)
        dazzled = np.zeros(len(points), dtype=bool)
        for lamp in self.scene.lamps:
            halfway = _unit(_unit(lamp - points) + to_lens)
            cosine = np.einsum("ij,ij->i", halfway, normals)
            dazzled |= cosine > np.cos(np.radians(self.scene.limits.glare_deg))
        return dazzled


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _scale(camera: Camera, T_camera_board: SE3, ps_camera: Array) -> Array:
    """Pixels for each metre on the board's plane at points (N, 3), in the worst direction.

    The smaller singular value of d(u, v) / d(x, y), by the formula for 2 x 2 matrices.
    """
    x, y, z = ps_camera.T
    A = T_camera_board.rotation[:, :2]
    fx, fy = np.diag(camera.K)[:2]
    J = np.stack([
        fx / z[:, None] * (A[0] - (x / z)[:, None] * A[2]),
        fy / z[:, None] * (A[1] - (y / z)[:, None] * A[2]),
    ], axis=1)  # fmt: skip
    total, product = (J**2).sum(axis=(1, 2)), np.linalg.det(J)
    return np.asarray(np.sqrt((total - np.sqrt(np.maximum(total**2 - 4 * product**2, 0))) / 2))
