"""Detections of markers without a picture."""

from collections.abc import Iterable, Mapping

import numpy as np

from aoicell.camera import Camera
from aoicell.transforms import SE3, Array


def detections(
    layout: Mapping[str, Array],
    camera: Camera,
    T_camera_board: SE3,
    rng: np.random.Generator,
    without: Iterable[str] = (),
) -> list[Array]:
    """The markers of a layout as a detector gives them: any order, any quarter turn."""
    uvs = [
        np.roll(camera.project(points, T_camera_board), rng.integers(4), axis=0)
        for id, points in layout.items()
        if id not in without
    ]
    return [uvs[k] for k in rng.permutation(len(uvs))]
