"""What the localisation of several markers takes and yields, whether they bear codes or not."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.targets.pose import TargetPose
from aoicell.transforms import SE3, Array, apply

Layout = Mapping[str, Array]  # cross centres (4, 3) by marker id, in the frame to be located


@dataclass(frozen=True)
class LayoutConfig:
    """How far a marker may lie from where the others predict it, and what displacement to expect.

    The plain marker looks the same after a quarter turn: `max_turn_deg` has to stay below 45.
    `max_shift` and `max_lift` (m) are of the markers' middle, in the board's plane and out of it.
    Markers that tell themselves by a code know neither of the first two bounds.
    `max_rms_px` is for markers of unknown noise; a known one may be exceeded `max_noise` times,
    and up to `harmless_px` in any case.
    """

    max_gap: float = 0.008
    max_turn_deg: float = 40.0
    max_shift: float = 0.15
    max_lift: float = 0.03
    max_tilt_deg: float = 15.0
    max_rms_px: float = 2.0
    max_noise: float = 5.0
    harmless_px: float = 0.1


USUAL = LayoutConfig()


@dataclass(frozen=True)
class LocatedLayout:
    """A pose of the layout's frame in the camera, and the detections (4, 2) px by marker id.

    `left_out`: markers that were seen, but not where the others say that they belong.
    """

    pose: TargetPose
    uvs_px: Mapping[str, Array]
    left_out: tuple[str, ...] = ()

    @property
    def T_camera_target(self) -> SE3:
        """The located frame in the camera."""
        return self.pose.T_camera_target

    @property
    def noise_px(self) -> float:
        """How far a coordinate is off its place by what the pose leaves (one sigma)."""
        count = 4 * len(self.uvs_px)
        return self.pose.rms_px * float(np.sqrt(count / (2 * count - 6)))


@dataclass(frozen=True)
class Reading:
    """Detections by marker id, as their points in the right turn and by their index.

    `moved`: how far (m) the layout's origin lies from where it is expected.
    """

    uvs: Mapping[str, Array]
    indices: Mapping[str, int]
    moved: float


def ranked(readings: list[Reading]) -> list[Reading]:
    """The best first: the most markers, then the least moved."""
    return sorted(readings, key=lambda reading: (-len(reading.uvs), reading.moved))


def nearest_readings(
    readings: Array,
    layout: Layout,
    camera: Camera,
    T: SE3,
    max_gap: float,
    possible: np.ndarray | None = None,
) -> dict[str, int]:
    """The index of the reading (R, 4, 2) px next to where the layout at pose T has each marker.

    By marker id; those without one within `max_gap` (m) are left out. `possible` (R, M): which
    reading may be which marker at all.
    """
    points = np.stack(list(layout.values()))  # (M, 4, 3)
    depths = apply(T, points.reshape(-1, 3))[:, 2].reshape(-1, 4)
    predicted = camera.project(points.reshape(-1, 3), T).reshape(-1, 4, 2)
    gaps = np.linalg.norm(readings[:, None] - predicted[None], axis=3).max(axis=2)  # (R, M)
    if possible is not None:
        gaps = np.where(possible, gaps, np.inf)
    found = {}
    for m, id in enumerate(layout):
        nearest = int(gaps[:, m].argmin())
        # one marker predicts a far one only as well as it tells its own tilt
        allowed = max_gap * camera.focal_px / depths[m].mean()
        if (depths[m] > 0).all() and gaps[nearest, m] < allowed:
            found[id] = nearest
    return found
