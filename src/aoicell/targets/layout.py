"""Several markers on one board: told apart in a picture, and solved for one pose.

Markers that bear a code say themselves which one they are and which way up: see `coded_layout`.
Here the plain ones are told apart by where they lie, near to where they are expected.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import Refused, TargetNotFound
from aoicell.targets.coded_layout import Codes, coded_readings, locate_coded
from aoicell.targets.cross_marker import turned
from aoicell.targets.layout_gates import consistent, refuse_far, rival_of, solved
from aoicell.targets.located_layout import (
    USUAL,
    Layout,
    LayoutConfig,
    LocatedLayout,
    Reading,
    nearest_readings,
    ranked,
)
from aoicell.targets.marker_sighting import Detection, points_of, sightings_of
from aoicell.targets.pose import planar_candidates
from aoicell.transforms import SE3, Array, rotation

__all__ = [
    "Codes",
    "Layout",
    "LayoutConfig",
    "LocatedLayout",
    "identify",
    "locate_layout",
    "match_layout",
]


def locate_layout(
    detections: Sequence[Detection],
    layout: Layout,
    camera: Camera,
    T_camera_expected: SE3,
    needed: int | None = None,
    config: LayoutConfig = USUAL,
    sigma_px: float | None = None,
    codes: Codes | None = None,
) -> LocatedLayout:
    """Pose of a layout of markers from the marker-like detections of one picture.

    `T_camera_expected` is where it would be without a displacement: it settles the quarter
    turn. `needed` markers (default: all) have to be found. With the noise `sigma_px` of a
    coordinate known, one marker that disagrees with all others is left out.

    With `codes` (by id, of all markers of the board) the markers are found by what they say of
    themselves, wherever they lie: the detections have to be sightings then. Without, points
    (4, 2) px do, and what a sighting says of itself is not asked.

    Raises TargetNotFound, and Refused where the markers contradict each other, could be those of
    two boards, or lie farther from where they are expected than a board is displaced.
    """
    needed = len(layout) if needed is None else needed
    if codes is not None:
        return locate_coded(
            sightings_of(detections), layout, codes, camera, T_camera_expected, needed, config,
            sigma_px,
        )  # fmt: skip
    uvs_px = points_of(detections)
    found = _readings(uvs_px, layout, camera, T_camera_expected, config)
    uvs = dict(found[0].uvs) if found else {}
    if len(uvs) < needed:
        _refuse_turned(uvs_px, layout, camera, T_camera_expected, needed, config)
        missing = sorted(set(layout) - set(uvs))
        raise TargetNotFound(
            f"board: {len(uvs)} of {len(layout)} markers found, {needed} needed "
            f"(missing: {', '.join(missing)}; {len(uvs_px)} marker-like squares in the "
            "picture); bring the board back into view or teach a higher look-out pose",
            "marker_not_found",
        )
    located = consistent(uvs, layout, camera, needed, config, sigma_px)
    refuse_far(located.T_camera_target, layout, T_camera_expected, config)
    rival = rival_of(found, located, layout, camera, T_camera_expected, config)
    if rival is not None:
        raise Refused(
            f"board: {', '.join(rival.uvs)} are in the picture twice, so there may be "
            "two boards; take away the one that is not to be inspected",
            "ambiguous",
        )
    return located


def identify(
    detections: Sequence[Detection],
    layout: Layout,
    camera: Camera,
    T_camera_expected: SE3,
    config: LayoutConfig = USUAL,
    codes: Codes | None = None,
) -> dict[str, Array]:
    """Which detection is which marker: its points (4, 2) px, read in its right turn, by id.

    Each detection in turn is taken for each marker that it could be; the reading under which most
    other markers lie where the layout says wins, then the one that moves the board least.
    """
    if codes is None:
        found = _readings(points_of(detections), layout, camera, T_camera_expected, config)
    else:
        found = coded_readings(
            sightings_of(detections), layout, codes, camera, T_camera_expected, config
        )
    return dict(found[0].uvs) if found else {}


# -- Which is which ---------------------------------------------------------------------------


def _readings(
    detections: Sequence[Array], layout: Layout, camera: Camera, T_expected: SE3,
    config: LayoutConfig,
) -> list[Reading]:  # fmt: skip
    """All ways to read the detections, the best first."""
    readings = []
    first = next(iter(layout.values()))
    for uv in detections:
        upright = planar_candidates(first - first.mean(axis=0), uv, camera)
        for points in layout.values():
            for T in _hypotheses(upright, first, points, T_expected, config):
                indices, uvs = _assigned(detections, layout, camera, T, config.max_gap)
                moved = float(np.linalg.norm(T.translation - T_expected.translation))
                if uvs:
                    readings.append(Reading(uvs, indices, moved))
    return ranked(readings)


def _hypotheses(
    upright: Sequence[SE3], first: Array, points: Array, T_expected: SE3, config: LayoutConfig
) -> list[SE3]:
    """Poses of the layout if a detection were this marker, near the expected orientation.

    `upright`: the planar poses of the detection if it were the layout's first marker, `first`,
    about its centre; all markers are alike and lie parallel to x and y of the layout's frame.
    """
    shift = SE3(np.eye(3), -points.mean(axis=0))
    lies = _direction(first) - _direction(points)
    poses = []
    for turn in range(4):
        # read from its next point on, the square lies a quarter turn further
        quarter = rotation("z", turn * np.pi / 2 + lies)
        for T in (T * quarter * shift for T in upright):
            # a 60 mm square tells its tilt badly: only the turn about the view counts
            if _turn_about_normal(T_expected.actInv(T)) < np.radians(config.max_turn_deg):
                poses.append(T)
                break  # the better of the two planar solutions
    return poses


def _direction(points: Array) -> float:
    """Angle (rad) of a marker's upper side in the layout's plane."""
    side = points[1] - points[0]
    return float(np.arctan2(side[1], side[0]))


def _turn_about_normal(T: SE3) -> float:
    """Turn about z that is left when the tilt is taken away (rad)."""
    R = T.rotation
    return float(abs(np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])))


def match_layout(
    detections: Sequence[Array], layout: Layout, camera: Camera, T: SE3, max_gap: float
) -> dict[str, Array]:
    """Detections that lie where the layout at pose T predicts them, by marker id."""
    return _assigned(detections, layout, camera, T, max_gap)[1]


def _assigned(
    detections: Sequence[Array], layout: Layout, camera: Camera, T: SE3, max_gap: float
) -> tuple[dict[str, int], dict[str, Array]]:
    """The detection nearest to where each marker is predicted: its index, and its reading."""
    if not len(detections):
        return {}, {}
    readings = np.stack([turned(uv, turn) for uv in detections for turn in range(4)])  # (4D, 4, 2)
    nearest = nearest_readings(readings, layout, camera, T, max_gap)
    indices = {id: reading // 4 for id, reading in nearest.items()}
    return indices, {id: readings[reading] for id, reading in nearest.items()}


def _refuse_turned(
    detections: Sequence[Array], layout: Layout, camera: Camera, T_expected: SE3, needed: int,
    config: LayoutConfig,
) -> None:  # fmt: skip
    """Raise where enough markers are found if any turn of the board is allowed."""
    if len(layout) < 2 or needed < 2:
        return  # a single plain marker has four readings
    found = _readings(detections, layout, camera, T_expected, replace(config, max_turn_deg=181.0))
    if found and len(found[0].uvs) >= needed:
        T = solved(found[0].uvs, layout, camera).T_camera_target
        turn = np.degrees(_turn_about_normal(T_expected.actInv(T)))
        raise Refused(
            f"board: turned by {turn:.0f} deg from where it was taught, at most "
            f"{config.max_turn_deg:.0f} deg is accepted; turn it back or teach it there",
            "too_far",
        )
