"""Where is the board now, without its markers: by its own texture, against the taught picture.

Features find it, whatever way it lies: matches between the two pictures, lifted onto the board's
relief, vote for a pose (RANSAC). Dense alignment finishes. The markers may be missing, dirty or
covered; where they are known to be, nothing of the taught picture is used.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from aoicell.alignment import Alignment, AlignmentConfig, align
from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import Implausible, InputError, Refused, TargetNotFound
from aoicell.observation import Image, Observation
from aoicell.registration import Template
from aoicell.relief import Relief, relief_of
from aoicell.targets.layout import LocatedLayout
from aoicell.targets.pose import TargetPose, refine_pose
from aoicell.transforms import SE3, Array, from_rvec


@dataclass(frozen=True)
class MarkerlessConfig:
    """When to refuse.

    `min_matches` features have to agree within `max_gap_px`; another pose that as much as
    `rival` of their number agree on is an ambiguity. A board that lies on something tilts by
    `max_tilt_deg` and changes its distance by a share `max_scale` at most. Alignment moves the
    features' pose by `max_drift_px` at most; in the end `min_share` of the patches have to look
    as taught: a correlation of `min_correlation`.
    """

    min_matches: int = 40
    max_gap_px: float = 3.0
    rival: float = 0.5
    max_tilt_deg: float = 10.0
    max_scale: float = 0.1
    max_drift_px: float = 5.0
    min_share: float = 0.3
    min_correlation: float = 0.8
    min_blocks: int = 10
    alignment: AlignmentConfig = field(default_factory=AlignmentConfig)


@dataclass(frozen=True)
class LocatedTexture(LocatedLayout):
    """The same result without markers: `points` (N, 3) of the board that it rests on."""

    points: Array = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True)
class Markerless:
    """A `Localizer` for templates in the board's own frame, with all markers in their layout."""

    board: BoardDesign
    config: MarkerlessConfig = field(default_factory=MarkerlessConfig)

    def __call__(
        self,
        observation: Observation,
        detections: Sequence[Array],
        template: Template,
        camera: Camera,
    ) -> LocatedTexture:
        """The board in a picture from (about) the look-out pose; detections are not looked at.

        Raises TargetNotFound, Implausible or Refused when it cannot be told.
        """
        taught, new, config = template.look.grey, observation.grey, self.config
        T_taught = template.taught.T_camera_target
        relief = relief_of(self.board, camera, T_taught)
        points, uv = match_features(taught, new, relief)
        T_start = vote(points, uv, camera, config)
        _check_pose(T_start, T_taught, config)
        found = align(taught, new, relief, camera, T_start, config.alignment)
        if found is None:
            raise TargetNotFound(
                "board: its texture is in the picture in too few places to tell a pose; "
                "uncover it or bring it back into view"
            )
        _check_alignment(found, T_start, camera, config)
        _check_pose(found.T_camera_board, T_taught, config)
        pose = TargetPose(
            found.T_camera_board, found.rms_px, found.covariance, found.rms_px / np.sqrt(2)
        )
        return LocatedTexture(pose, {}, points=found.middles[found.weights > 0.5])


def locate_by_texture(
    observation: Observation, detections: Sequence[Array], template: Template, camera: Camera
) -> LocatedTexture:
    """`Markerless` on the board that the template was taught on."""
    if template.board is None:
        raise InputError("template: it holds no board design; teach it with one to go markerless")
    return Markerless(template.board)(observation, detections, template, camera)


def match_features(taught: Image, new: Image, relief: Relief) -> tuple[Array, Array]:
    """Points on the board (N, 3) and where (N, 2) in the new picture their like was found.

    AKAZE (Alcantarilla 2013) at half resolution, each the other's best match. Many are wrong.
    """
    on_board = np.isfinite(relief.heights[::2, ::2]).astype(np.uint8) * 255
    detector = cv2.AKAZE_create(threshold=3e-4)  # type: ignore[attr-defined]
    seen_before, before = detector.detectAndCompute(cv2.pyrDown(taught), on_board)
    seen_now, now = detector.detectAndCompute(cv2.pyrDown(new), None)
    if before is None or now is None:
        return np.zeros((0, 3)), np.zeros((0, 2))
    matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(before, now)
    uv_taught = np.array([seen_before[m.queryIdx].pt for m in matches]).reshape(-1, 2) * 2
    uv_now = np.array([seen_now[m.trainIdx].pt for m in matches]).reshape(-1, 2) * 2
    points = relief.points(uv_taught)
    known = np.isfinite(points).all(axis=1)
    return points[known], uv_now[known]


def vote(points: Array, uv_px: Array, camera: Camera, config: MarkerlessConfig) -> SE3:
    """The pose on which most matches, points (N, 3) and pixels (N, 2), agree.

    Raises TargetNotFound when they are too few, Refused when another pose has as many.
    """
    T, agree = _consensus(points, uv_px, camera, config)
    count = int(agree.sum())
    if T is None or count < config.min_matches:
        raise TargetNotFound(
            f"board: {count} of {len(points)} features agree on where it is, "
            f"{config.min_matches} are needed; bring the taught board into view, uncovered, in "
            "light as when it was taught"
        )
    _, others = _consensus(points[~agree], uv_px[~agree], camera, config)
    if others.sum() >= max(config.rival * count, config.min_matches):
        raise Refused(
            f"board: {count} features say it is in one place and {int(others.sum())} in another, "
            "hardly more; leave one board of its kind in view",
            "ambiguous",
        )
    T, _ = refine_pose(points[agree], uv_px[agree], camera, T)
    return T


def _consensus(
    points: Array, uv_px: Array, camera: Camera, config: MarkerlessConfig
) -> tuple[SE3 | None, np.ndarray]:
    nobody = np.zeros(len(points), dtype=bool)
    if len(points) < 6:
        return None, nobody
    ok, rvec, tvec, inliers = cv2.solvePnPRansac(
        points, camera.unproject(uv_px), np.eye(3), None, iterationsCount=1000,
        reprojectionError=config.max_gap_px / camera.focal_px, confidence=0.9999,
        flags=cv2.SOLVEPNP_AP3P,
    )  # fmt: skip
    if not ok or inliers is None or not np.isfinite([rvec, tvec]).all():
        return None, nobody
    nobody[inliers[:, 0]] = True
    return from_rvec(rvec, tvec), nobody


def _check_pose(T: SE3, T_taught: SE3, config: MarkerlessConfig) -> None:
    """Raises Implausible for a board that nothing could have carried there."""
    tilt = np.degrees(np.arccos(np.clip(T.rotation[:, 2] @ T_taught.rotation[:, 2], -1, 1)))
    scale = T_taught.translation[2] / T.translation[2]
    if tilt > config.max_tilt_deg or abs(scale - 1) > config.max_scale:
        raise Implausible(
            f"board: its texture would be tilted by {tilt:.0f} deg and {scale:.2f} times as large "
            f"as taught, at most {config.max_tilt_deg:g} deg and a change by "
            f"{config.max_scale:.0%} are accepted; bring the board back or teach it there",
            "too_far",
        )


def _check_alignment(
    found: Alignment, T_start: SE3, camera: Camera, config: MarkerlessConfig
) -> None:
    """Raises for an alignment that does not look as taught, or that left its start."""
    alike = (found.correlation > config.min_correlation) & (found.weights > 0.1)
    if alike.mean() < config.min_share or found.blocks < config.min_blocks:
        raise TargetNotFound(
            f"board: {alike.mean():.0%} of its texture look as taught, in {found.blocks} places, "
            f"at least {config.min_share:.0%} and {config.min_blocks} are needed; uncover the "
            "board, light it as when it was taught, or teach it anew"
        )
    now = camera.project(found.middles, found.T_camera_board)
    drift = np.linalg.norm(now - camera.project(found.middles, T_start), axis=1)
    if np.median(drift) > config.max_drift_px:
        raise Refused(
            f"board: aligning it by its texture led {np.median(drift):.0f} px away from where its "
            f"features are, at most {config.max_drift_px:.0f} px are accepted; uncover the board, "
            "or teach it anew",
            "inconsistent",
        )
