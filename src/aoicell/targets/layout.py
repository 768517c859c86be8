"""Several markers on one board: told apart in a picture, and solved for one pose."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import Refused, TargetNotFound
from aoicell.targets.cross_marker import turned
from aoicell.targets.pose import TargetPose, planar_candidates, solve_pose
from aoicell.transforms import SE3, Array, apply, rotation

Layout = Mapping[str, Array]  # cross centres (4, 3) by marker id, in the frame to be located


@dataclass(frozen=True)
class LayoutConfig:
    """How far a marker may lie from where the others predict it, and what displacement to expect.

    The plain marker looks the same after a quarter turn: `max_turn_deg` has to stay below 45.
    `max_shift` and `max_lift` (m) are of the markers' middle, in the board's plane and out of it.
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


def locate_layout(
    detections: Sequence[Array],
    layout: Layout,
    camera: Camera,
    T_camera_expected: SE3,
    needed: int | None = None,
    config: LayoutConfig = LayoutConfig(),
    sigma_px: float | None = None,
) -> LocatedLayout:
    """Pose of a layout of markers from the marker-like detections (4, 2) of one picture.

    `T_camera_expected` is where it would be without a displacement: it settles the quarter
    turn. `needed` markers (default: all) have to be found. With the noise `sigma_px` of a
    coordinate known, one marker that disagrees with all others is left out.

    Raises TargetNotFound, and Refused where the markers contradict each other, could be those of
    two boards, or lie farther from where they are expected than a board is displaced.
    """
    needed = len(layout) if needed is None else needed
    found = _readings(detections, layout, camera, T_camera_expected, config)
    uvs = dict(found[0].uvs) if found else {}
    if len(uvs) < needed:
        _refuse_turned(detections, layout, camera, T_camera_expected, needed, config)
        missing = sorted(set(layout) - set(uvs))
        raise TargetNotFound(
            f"board: {len(uvs)} of {len(layout)} markers found, {needed} needed "
            f"(missing: {', '.join(missing)}; {len(detections)} marker-like squares in the "
            "picture); bring the board back into view or teach a higher look-out pose",
            "marker_not_found",
        )
    located = _consistent(uvs, layout, camera, needed, config, sigma_px)
    _refuse_far(located.T_camera_target, layout, T_camera_expected, config)
    _refuse_rival(found, located, layout, camera, T_camera_expected, config)
    return located


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
    found = _readings(detections, layout, camera, T_camera_expected, config)
    return dict(found[0].uvs) if found else {}


# -- Which is which ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _Reading:
    """Detections by marker id, as their points in the right turn and by their index."""

    uvs: Mapping[str, Array]
    indices: Mapping[str, int]
    moved: float


def _readings(
    detections: Sequence[Array], layout: Layout, camera: Camera, T_expected: SE3,
    config: LayoutConfig,
) -> list[_Reading]:  # fmt: skip
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
                    readings.append(_Reading(uvs, indices, moved))
    return sorted(readings, key=lambda reading: (-len(reading.uvs), reading.moved))


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
    points = np.stack(list(layout.values()))  # (M, 4, 3)
    depths = apply(T, points.reshape(-1, 3))[:, 2].reshape(-1, 4)
    predicted = camera.project(points.reshape(-1, 3), T).reshape(-1, 4, 2)
    readings = np.stack([turned(uv, turn) for uv in detections for turn in range(4)])  # (4D, 4, 2)
    gaps = np.linalg.norm(readings[:, None] - predicted[None], axis=3).max(axis=2)  # (4D, M)
    indices, uvs = {}, {}
    for m, id in enumerate(layout):
        nearest = int(gaps[:, m].argmin())
        # one marker predicts a far one only as well as it tells its own tilt
        allowed = max_gap * camera.focal_px / depths[m].mean()
        if (depths[m] > 0).all() and gaps[nearest, m] < allowed:
            indices[id], uvs[id] = nearest // 4, readings[nearest]
    return indices, uvs


# -- Gates ------------------------------------------------------------------------------------


def _solved(uvs: Mapping[str, Array], layout: Layout, camera: Camera) -> LocatedLayout:
    """The pose of these markers."""
    points = np.concatenate([layout[id] for id in uvs])
    pose = solve_pose(points, np.concatenate(list(uvs.values())), camera, name="board")
    return LocatedLayout(pose, uvs)


def _consistent(
    uvs: Mapping[str, Array], layout: Layout, camera: Camera, needed: int, config: LayoutConfig,
    sigma_px: float | None,
) -> LocatedLayout:  # fmt: skip
    """The pose that all markers agree on, or all but one; Refused where there is none."""
    uvs = {id: uvs[id] for id in layout if id in uvs}
    located = _solved(uvs, layout, camera)
    most = np.inf if sigma_px is None else max(config.max_noise * sigma_px, config.harmless_px)
    if located.pose.rms_px <= config.max_rms_px and located.noise_px <= most:
        return located
    agreed = []
    for out in uvs if sigma_px is not None and len(uvs) > needed else ():
        others = _solved({id: uv for id, uv in uvs.items() if id != out}, layout, camera)
        if others.noise_px <= most:
            agreed.append(replace(others, left_out=(out,)))
    if len(agreed) == 1:
        return agreed[0]
    accepted = min(config.max_rms_px, most)
    raise Refused(
        f"board: the markers {', '.join(uvs)} fit their layout only to "
        f"{located.pose.rms_px:.2f} px, at most {accepted:.2f} px is accepted; check for moved or "
        "false markers, light and focus, or teach the board anew",
        "inconsistent",
    )


def _refuse_turned(
    detections: Sequence[Array], layout: Layout, camera: Camera, T_expected: SE3, needed: int,
    config: LayoutConfig,
) -> None:  # fmt: skip
    """Raise where enough markers are found if any turn of the board is allowed."""
    if len(layout) < 2 or needed < 2:
        return  # a single plain marker has four readings
    found = _readings(detections, layout, camera, T_expected, replace(config, max_turn_deg=181.0))
    if found and len(found[0].uvs) >= needed:
        T = _solved(found[0].uvs, layout, camera).T_camera_target
        turn = np.degrees(_turn_about_normal(T_expected.actInv(T)))
        raise Refused(
            f"board: turned by {turn:.0f} deg from where it was taught, at most "
            f"{config.max_turn_deg:.0f} deg is accepted; turn it back or teach it there",
            "too_far",
        )


def _refuse_far(T: SE3, layout: Layout, T_expected: SE3, config: LayoutConfig) -> None:
    shift, lift, tilt = _displacement(T, layout, T_expected)
    allowed = (config.max_shift, config.max_lift, np.radians(config.max_tilt_deg))
    if shift > allowed[0] or lift > allowed[1] or tilt > allowed[2]:
        raise Refused(
            f"board: {shift * 1e3:.0f} mm aside, {lift * 1e3:.0f} mm out of its plane and "
            f"{np.degrees(tilt):.0f} deg tilted from where it was taught, at most "
            f"{config.max_shift * 1e3:.0f} mm, {config.max_lift * 1e3:.0f} mm and "
            f"{config.max_tilt_deg:.0f} deg are accepted; bring it back or teach it there",
            "too_far",
        )


def _displacement(T: SE3, layout: Layout, T_expected: SE3) -> tuple[float, float, float]:
    """Of the markers' middle in the expected plane and out of it (m), and the tilt (rad)."""
    middle = np.concatenate(list(layout.values())).mean(axis=0)
    D = T_expected.actInv(T)
    step = D.act(middle) - middle
    tilt = np.arccos(np.clip(D.rotation[2, 2], -1, 1))
    return float(np.hypot(*step[:2])), float(abs(step[2])), float(tilt)


def _refuse_rival(
    found: Sequence[_Reading], located: LocatedLayout, layout: Layout, camera: Camera,
    T_expected: SE3, config: LayoutConfig,
) -> None:  # fmt: skip
    """Raise where two markers or more, none of them used, could be another board within range."""
    used = {index for id, index in found[0].indices.items() if id in located.uvs_px}
    for reading in found[1:]:
        if len(reading.uvs) < 2 or used & set(reading.indices.values()):
            continue
        other = _solved(reading.uvs, layout, camera)
        if other.pose.rms_px > config.max_rms_px:
            continue
        shift, lift, _ = _displacement(other.T_camera_target, layout, T_expected)
        if shift <= config.max_shift and lift <= config.max_lift:
            raise Refused(
                f"board: {', '.join(reading.uvs)} are in the picture twice, so there may be "
                "two boards; take away the one that is not to be inspected",
                "ambiguous",
            )
