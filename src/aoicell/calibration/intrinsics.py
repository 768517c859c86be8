"""Camera intrinsics from views of a chessboard (Zhang 2000, as in OpenCV)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.errors import Implausible
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import SE3, Array, from_rvec


@dataclass(frozen=True)
class IntrinsicsConfig:
    """At least `min_views` views; accepted up to `max_rms_px` of reprojection error."""

    min_views: int = 6
    max_rms_px: float = 2.0


@dataclass(frozen=True)
class Intrinsics:
    """A camera with its quality.

    `std` holds one standard deviation of fx, fy, cx, cy (px), k1, k2, p1, p2;
    `view_rms_px` (views,) and `Ts_camera_target` go by view.
    """

    camera: Camera
    rms_px: float
    view_rms_px: Array
    std: Array
    Ts_camera_target: tuple[SE3, ...]


def calibrate_intrinsics(
    target: Chessboard,
    uvs_px: Sequence[Array],
    start: Camera,
    config: IntrinsicsConfig = IntrinsicsConfig(),
) -> Intrinsics:
    """Focal lengths, principal point, k1, k2, p1, p2 from detected corners (N, 2) a view.

    A half turn of a board does not matter here. Raises Implausible when there are too few
    views or the result is not a camera.
    """
    if len(uvs_px) < config.min_views:
        raise Implausible(
            f"intrinsics: {len(uvs_px)} views show the chessboard; "
            f"take at least {config.min_views}, tilted both ways"
        )
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)  # with more, sums are formed in another order from run to run
    rms, K, distortion, rvecs, tvecs, std, _, view_rms = cv2.calibrateCameraExtended(
        [target.corners.astype(np.float32)] * len(uvs_px),
        [uv.astype(np.float32) for uv in uvs_px],
        (start.width, start.height),
        np.array(start.K),
        np.zeros(5),
        flags=flags,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12),
    )
    cv2.setNumThreads(threads)
    camera = Camera(
        np.asarray(K, dtype=float), start.width, start.height,
        np.ravel(distortion)[:5].astype(float),
    )  # fmt: skip
    if not np.isfinite(K).all() or camera.focal_px <= 0 or rms > config.max_rms_px:
        raise Implausible(
            f"intrinsics: reprojection error {rms:.2f} px over {len(uvs_px)} views, at most "
            f"{config.max_rms_px:.1f} px is accepted; check the board's size and the pictures"
        )
    return Intrinsics(
        camera=camera,
        rms_px=float(rms),
        view_rms_px=np.ravel(view_rms).astype(float),
        std=np.ravel(std)[:8].astype(float),
        Ts_camera_target=tuple(from_rvec(r, t) for r, t in zip(rvecs, tvecs, strict=True)),
    )
