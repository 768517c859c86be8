"""Depth images of boxes on a table, computed ray by ray: a scan whose truth is known."""

from collections.abc import Sequence

import numpy as np

from aoicell.camera import Camera
from aoicell.observation import RobotState
from aoicell.planning.depth import DepthImage
from aoicell.transforms import SE3, Array, looking_at

CAMERA = Camera.pinhole(400.0, 280, 220)
Box = tuple[Sequence[float], Sequence[float], tuple[int, int, int]]  # low, high corner (m); RGB


def depth_image(boxes: Sequence[Box], T_area_camera: SE3, T_base_area: SE3) -> DepthImage:
    """What a camera sees of boxes in the frame `area`; its robot carries it on the flange."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    K = CAMERA.K
    rays = np.dstack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(u.shape)])
    rays, origin = rays @ T_area_camera.rotation.T, T_area_camera.translation
    depth = np.full(u.shape, np.inf)
    colour = np.zeros((*u.shape, 3), np.uint8)
    for low, high, rgb in boxes:
        with np.errstate(divide="ignore"):
            ends = np.stack([(np.array(c) - origin) / rays for c in (low, high)])
        enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
        nearer = (enter <= leave) & (enter > 0) & (enter < depth)
        depth[nearer], colour[nearer] = enter[nearer], rgb
    depth[np.isinf(depth)] = np.nan
    state = RobotState(np.zeros(6), T_base_area * T_area_camera)
    return DepthImage(depth.astype(np.float32), colour, CAMERA, state)


def scan_of(boxes: Sequence[Box], T_base_area: SE3, distance: float = 0.3) -> list[DepthImage]:
    """Images from straight above and from four sides."""
    leans = [(0.0, 0.0), (0.3, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.0, -0.3)]
    aims: Array = np.array([[-0.02, 0.0, 0.0], [0.02, 0.01, 0.0]])
    return [
        depth_image(boxes, looking_at(aim, distance, lean, 0.05), T_base_area)
        for lean in leans
        for aim in aims
    ]
