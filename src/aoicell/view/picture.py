"""Camera pictures with what was detected in them."""

from collections.abc import Sequence

import cv2
import numpy as np

from aoicell.camera import Camera
from aoicell.errors import TargetNotFound
from aoicell.nominal import Nominal
from aoicell.observation import Image, Observation
from aoicell.targets.detector import Detector
from aoicell.transforms import Array

WIDTH = 512  # of a shown picture (px)
GREEN, ORANGE = (0, 200, 120), (255, 140, 0)
FRACTION_BITS = 4  # of OpenCV's subpixel drawing
NOTHING = 235  # grey of a picture that was never taken


def detect(
    observation: Observation, nominal: Nominal, detector: Detector, calibrating: bool
) -> tuple[list[Array], str]:
    """Points (N, 2) px of each target in a picture, and in words what was found."""
    try:
        if observation.camera == "tripod":
            pair = detector.chessboard_pair(observation, nominal.armtarget, "tripod picture")
            return list(pair), "both chessboards found"
        if calibrating:
            corners = detector.chessboard(observation, nominal.tabletarget, "hand picture")
            return [corners], f"chessboard found, {len(corners)} corners"
    except TargetNotFound as error:
        return [], str(error)
    markers = detector.markers(observation, nominal.marker)
    return markers, f"{len(markers)} marker{'s' * (len(markers) != 1)} found"


def draw_detections(observation: Observation, detections: Sequence[Array], camera: Camera) -> Image:
    """An RGB picture (H, W, 3) of 512 px across with the detections (N, 2) px drawn in.

    The crosses of a marker get an outline, the corners of a chessboard a dot each. Where no
    picture was taken, the detections stand on a blank of the camera's size.
    """
    image = observation.image
    if image.size == 0:
        image = np.full((camera.height, camera.width), NOTHING, np.uint8)
    scale = WIDTH / image.shape[1]
    size = (WIDTH, round(image.shape[0] * scale))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    drawn = np.array(cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small)
    for uv in detections:
        places = (np.asarray(uv) + 0.5) * scale - 0.5  # of the same points in the small picture
        fixed = np.round(places * 2**FRACTION_BITS).astype(np.int32)
        marker = len(uv) == 4
        if marker:
            outline = cv2.convexHull(fixed)
            cv2.polylines(drawn, [outline], True, ORANGE, 1, cv2.LINE_AA, FRACTION_BITS)
        for u, v in fixed.tolist():
            radius = (3 if marker else 2) * 2**FRACTION_BITS
            cv2.circle(drawn, (u, v), radius, GREEN, 1 if marker else -1, cv2.LINE_AA,
                       FRACTION_BITS)  # fmt: skip
    return np.asarray(drawn, dtype=np.uint8)
