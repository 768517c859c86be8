"""Several markers on one board: told apart in a picture, and solved for one pose."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import TargetNotFound
from aoicell.targets.cross_marker import turned
from aoicell.targets.pose import TargetPose, planar_candidates, solve_pose
from aoicell.transforms import SE3, Array, apply

Layout = Mapping[str, Array]  # cross centres (4, 3) by marker id, in the frame to be located


@dataclass(frozen=True)
class LayoutConfig:
    """How far a marker may lie from where the others predict it, and what displacement to expect.

    The plain marker looks the same after a quarter turn: `max_turn_deg` has to stay below 45.
    """

    max_gap: float = 0.008
    max_turn_deg: float = 40.0
    max_rms_px: float = 2.0


@dataclass(frozen=True)
class LocatedLayout:
    """A pose of the layout's frame in the camera, and the detections (4, 2) px by marker id."""

    pose: TargetPose
    uvs_px: Mapping[str, Array]

    @property
    def T_camera_target(self) -> SE3:
        """The located frame in the camera."""
        return self.pose.T_camera_target


def locate_layout(
    detections: Sequence[Array],
    layout: Layout,
    camera: Camera,
    T_camera_expected: SE3,
    needed: int | None = None,
    config: LayoutConfig = LayoutConfig(),
) -> LocatedLayout:
    """Pose of a layout of markers from the marker-like detections (4, 2) of one picture.

    `T_camera_expected` is where it would be without a displacement: it settles the quarter
    turn. `needed` markers (default: all) have to be found. Raises TargetNotFound.
    """
    needed = len(layout) if needed is None else needed
    uvs = identify(detections, layout, camera, T_camera_expected, config)
    if len(uvs) < needed:
        missing = sorted(set(layout) - set(uvs))
        raise TargetNotFound(
            f"board: {len(uvs)} of {len(layout)} markers found, {needed} needed "
            f"(missing: {', '.join(missing)}; {len(detections)} marker-like squares in the "
            "picture); bring the board back into view or teach a higher look-out pose"
        )
    ids = [id for id in layout if id in uvs]
    points = np.concatenate([layout[id] for id in ids])
    pose = solve_pose(points, np.concatenate([uvs[id] for id in ids]), camera, name="board")
    if pose.rms_px > config.max_rms_px:
        raise TargetNotFound(
            f"board: the markers {', '.join(ids)} fit their layout only to "
            f"{pose.rms_px:.1f} px, at most {config.max_rms_px:.1f} px is accepted; "
            "check for moved or false markers, or teach the board anew"
        )
    return LocatedLayout(pose, uvs)


def identify(
    detections: Sequence[Array],
    layout: Layout,
    camera: Camera,
    T_camera_expected: SE3,
    config: LayoutConfig = LayoutConfig(),
) -> dict[str, Array]:
    """Which detection (4, 2) is which marker, read in its right turn, by id.

    Each detection in turn is taken for each marker; the reading under which most other
    markers lie where the layout says wins, then the one that moves the board least.
    """
    best: tuple[int, float, dict[str, Array]] = (0, np.inf, {})
    for uv in detections:
        for id in layout:
            for T in _hypotheses(uv, layout[id], camera, T_camera_expected, config):
                matched = _matches(detections, layout, camera, T, config.max_gap)
                moved = float(np.linalg.norm(T.translation - T_camera_expected.translation))
                if (-len(matched), moved) < (-best[0], best[1]):
                    best = (len(matched), moved, matched)
    return best[2]


def _hypotheses(
    uv: Array, points: Array, camera: Camera, T_expected: SE3, config: LayoutConfig
) -> list[SE3]:
    """Poses of the layout if this detection were this marker, near the expected orientation."""
    poses = []
    for turn in range(4):
        for T in _planar_poses(points, turned(uv, turn), camera):
            # a 60 mm square tells its tilt badly: only the turn about the view counts
            if _turn_about_normal(T_expected.actInv(T)) < np.radians(config.max_turn_deg):
                poses.append(T)
                break  # the better of the two planar solutions
    return poses


def _planar_poses(points: Array, uv: Array, camera: Camera) -> list[SE3]:
    """Planar solutions for a marker that lies parallel to x and y of the layout's frame."""
    centre = points.mean(axis=0)
    shift = SE3(np.eye(3), -centre)
    return [T * shift for T in planar_candidates(points - centre, uv, camera)]


def _turn_about_normal(T: SE3) -> float:
    """Turn about z that is left when the tilt is taken away (rad)."""
    R = T.rotation
    return float(abs(np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])))


def _matches(
    detections: Sequence[Array], layout: Layout, camera: Camera, T: SE3, max_gap: float
) -> dict[str, Array]:
    """Detections that lie where the layout at pose T predicts them, by marker id."""
    matched = {}
    for id, points in layout.items():
        if (apply(T, points)[:, 2] <= 0).any():
            continue
        predicted = camera.project(points, T)
        scale = camera.focal_px / apply(T, points)[:, 2].mean()
        # one marker predicts a far one only as well as it tells its own tilt
        for uv in detections:
            readings = [turned(uv, turn) for turn in range(4)]
            gaps = [np.linalg.norm(r - predicted, axis=1).max() for r in readings]
            if min(gaps) < max_gap * scale:
                matched[id] = readings[int(np.argmin(gaps))]
    return matched
