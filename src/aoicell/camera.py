"""The camera model: a pinhole with Brown's lens distortion, in OpenCV's conventions.

The camera looks along +z, x to the right, y down. The centre of the top-left
pixel is (0, 0), so a centred principal point is ((W-1)/2, (H-1)/2).
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import ArrayLike

from aoicell.transforms import SE3, Array, apply


def _frozen(values: ArrayLike) -> Array:
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Camera:
    """Intrinsics: K (3, 3) in pixels, distortion (k1, k2, p1, p2, k3), image size in pixels."""

    K: Array
    width: int
    height: int
    distortion: Array = field(default_factory=lambda: np.zeros(5))

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", _frozen(self.K))
        object.__setattr__(self, "distortion", _frozen(self.distortion))

    @classmethod
    def pinhole(cls, focal_px: float, width: int, height: int) -> "Camera":
        """A centred camera without distortion."""
        cx, cy = (width - 1) / 2, (height - 1) / 2
        return cls(np.array([[focal_px, 0, cx], [0, focal_px, cy], [0, 0, 1.0]]), width, height)

    @property
    def focal_px(self) -> float:
        """Mean focal length (px)."""
        return float((self.K[0, 0] + self.K[1, 1]) / 2)

    def project(self, points: ArrayLike, T_camera_frame: SE3 | None = None) -> Array:
        """Pixels (N, 2) of points (N, 3) in the camera frame, or in `frame` given its pose."""
        ps = np.asarray(points, dtype=float).reshape(-1, 3)
        if T_camera_frame is not None:
            ps = apply(T_camera_frame, ps)
        projected, _ = cv2.projectPoints(
            ps[:, None], np.zeros(3), np.zeros(3), self.K, self.distortion
        )
        uv = np.asarray(projected, dtype=float)[:, 0]
        uv[:, 0] += self._skew_px(uv)
        return uv

    def unproject(self, uv_px: ArrayLike) -> Array:
        """Normalised image points (N, 2), z = 1, of raw pixels (N, 2)."""
        uv = np.array(uv_px, dtype=float).reshape(-1, 1, 2)
        uv[:, 0, 0] -= self._skew_px(uv[:, 0])
        # OpenCV's default of five fixed-point steps leaves 0.01 px at the corners
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-8)
        xy = cv2.undistortPointsIter(uv, self.K, self.distortion, np.eye(3), np.eye(3), criteria)
        return np.asarray(xy, dtype=float)[:, 0]

    def _skew_px(self, uv_px: Array) -> Array:
        """What skew adds to u (N,) of pixels (N, 2): OpenCV's functions take no notice of it."""
        skew: Array = self.K[0, 1] / self.K[1, 1] * (uv_px[:, 1] - self.K[1, 2])
        return skew

    def undistort(self, uv_px: ArrayLike) -> Array:
        """Pixels (N, 2) that an ideal pinhole with the same K would show."""
        xy = self.unproject(uv_px)
        uv: Array = xy * np.diag(self.K)[:2] + self.K[:2, 2] + xy[:, 1:] * [self.K[0, 1], 0]
        return uv

    def sees(self, points: ArrayLike, T_camera_frame: SE3, margin_px: float = 0.0) -> bool:
        """Whether all points (N, 3) of `frame` lie in front of the camera and in the picture."""
        ps = apply(T_camera_frame, np.asarray(points, dtype=float).reshape(-1, 3))
        if (ps[:, 2] <= 0).any():
            return False
        uv = self.project(ps)
        high = np.array([self.width, self.height]) - 1 - margin_px
        return bool((uv >= margin_px).all() and (uv <= high).all())
