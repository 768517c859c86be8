"""Two pictures of a board laid over each other, to be looked at: nothing is measured on this.

One homography stands for the whole board. What stands up from it is seen from elsewhere in a new
picture that is a little off, and shows double edges in a difference.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

Grey = NDArray[np.uint8]  # (H, W)
Homography = NDArray[np.float64]

ALIKE = 0.75  # correlation from which two pictures count as laid over each other
_LEVELS, _STEPS = (3, 2, 1), 40  # halvings of the pictures, iterations at each
_LIKELY = 0.4  # correlation without which the coarsest pictures are not worth another look
_FEATURES, _ENOUGH = 2000, 25  # of a search from far, in halved pictures; matches that agree
_RATIO, _AGREE_PX = 0.75, 3.0  # of the two nearest features; distance within which matches agree
_GAIN = 3.0  # a difference is shown so many times as bright
_OUTSIDE = 90  # grey where one of the pictures ends


def align(new: Grey, reference: Grey) -> Homography | None:
    """H (3, 3) from pixels of the reference to those of the new picture; None where none is found.

    Correlation from where the pictures lie (Evangelidis and Psarakis, 2008); where that fails,
    from features that both show (Lowe, 2004).
    """
    found = _refine(new, reference, np.eye(3))
    if found is None:
        far = _from_features(new, reference)
        found = None if far is None else _refine(new, reference, far)
    return found


def warped(new: Grey, H: Homography) -> Grey:
    """The new picture as it lies over the reference; `_OUTSIDE` where it ends."""
    height, width = new.shape
    return np.asarray(
        cv2.warpPerspective(
            new, H, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderValue=_OUTSIDE,
        ), np.uint8,
    )  # fmt: skip


def difference(new: Grey, reference: Grey, H: Homography) -> Grey:
    """The absolute difference, amplified; `new` is as it lies over the reference already."""
    apart = cv2.convertScaleAbs(cv2.absdiff(new, reference), alpha=_GAIN)
    inside = warped(np.full_like(new, 255), H) == 255
    return np.where(inside, apart, _OUTSIDE).astype(np.uint8)


def _refine(new: Grey, reference: Grey, start: Homography) -> Homography | None:
    """From coarse to fine; None where the pictures are not alike in the end."""
    H, alike = start, 0.0
    for level in _LEVELS:
        scale = np.diag([0.5**level, 0.5**level, 1.0])
        before, after = (_reduced(image, 0.5**level) for image in (reference, new))
        guess = (scale @ H @ np.linalg.inv(scale)).astype(np.float32)
        stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, _STEPS, 1e-5)
        try:
            alike, better = cv2.findTransformECC(
                before, after, guess / guess[2, 2], cv2.MOTION_HOMOGRAPHY, stop
            )
        except cv2.error:  # it diverged
            return None
        if alike < _LIKELY:
            return None
        H = np.linalg.inv(scale) @ np.asarray(better, dtype=float) @ scale
    return H / H[2, 2] if alike >= ALIKE and np.isfinite(H).all() else None


def _reduced(image: Grey, scale: float) -> Grey:
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (5, 5), 0), np.uint8)


def _from_features(new: Grey, reference: Grey) -> Homography | None:
    finder = cv2.SIFT.create(_FEATURES)
    (points, described), (others, other) = (
        finder.detectAndCompute(_reduced(image, 0.5), None) for image in (reference, new)
    )
    if described is None or other is None or len(other) < 2:
        return None
    pairs = [
        near
        for near, *second in cv2.BFMatcher().knnMatch(described, other, k=2)
        if second and near.distance < _RATIO * second[0].distance
    ]
    if len(pairs) < _ENOUGH:
        return None
    start = 2 * np.array([points[pair.queryIdx].pt for pair in pairs])
    end = 2 * np.array([others[pair.trainIdx].pt for pair in pairs])
    H, agreeing = cv2.findHomography(start, end, cv2.RANSAC, _AGREE_PX)
    return None if H is None or agreeing.sum() < _ENOUGH else np.asarray(H, dtype=float)
