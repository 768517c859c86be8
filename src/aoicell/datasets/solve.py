"""From a recording to a judged calibration: find the targets, state the problem, solve, describe.

Several cameras and targets go into one solve: a target that two cameras see ties them together.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.calibrate import CalibrationConfig, calibrate
from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    PoseSight,
    Problem,
    Sight,
    moves,
    pairs_seen,
    sights_of,
)
from aoicell.calibration.problem import Mount as Side
from aoicell.calibration.verdict import CalibrationReport
from aoicell.camera import Camera
from aoicell.datasets.recording import Recording, View
from aoicell.datasets.sightings import Found, NamedTarget, find_targets, guess_camera, named_targets
from aoicell.datasets.target_descriptions import Mount, TargetDescription
from aoicell.errors import Implausible
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array

_EYE_ON: Mapping[Mount, Side] = {"eye_in_hand": "flange", "eye_to_hand": "base"}
_TARGET_ON: Mapping[Mount, Side] = {"eye_in_hand": "base", "eye_to_hand": "flange"}
_POSE_EYE, _POSE_TARGET = "camera", "target"  # of a recording of pose pairs
DEFAULT_CONFIG = CalibrationConfig()
_FEW = 0.7  # of the views: with fewer found, something may be wrong with the target


@dataclass(frozen=True)
class Detected:
    """A recording as a problem; `reasons` say by view id why it, or a target in it, is unused.

    `warnings` are sentences about what was assumed or looks odd.
    """

    problem: Problem
    reasons: Mapping[str, str]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Solved:
    """A recording with its calibration."""

    recording: Recording
    detected: Detected
    report: CalibrationReport


def solve_recording(recording: Recording, config: CalibrationConfig = DEFAULT_CONFIG) -> Solved:
    """Finds the targets, calibrates and judges. Raises InputError on what cannot be tried."""
    detected = detect(recording)
    report = calibrate(detected.problem, config)
    gone = len(recording.views) - len(detected.problem.views)
    if not detected.problem.views:
        first = next(iter(detected.reasons.values()), "")
        reason = f"none of the {gone} views shows a target; the first: {first}"
        report = replace(report, verdict="refused", reasons=(reason,))
    return Solved(recording, detected, report)


def detect(recording: Recording) -> Detected:
    """The calibration problem that a recording's pictures, or its pose pairs, state."""
    if not recording.targets:
        return _of_pairs(recording)
    targets = named_targets(recording)
    found = find_targets(recording, targets)
    eyes, warnings = [], list(recording.warnings)
    for start in recording.cameras:
        camera = start.intrinsics
        if camera is None:
            camera = guess_camera(start, targets, list(found.values()))
            warnings.append(
                f"'{start.name}': no intrinsics are given; they are estimated from the pictures, "
                f"beginning at a focal length of {camera.focal_px:.0f} px"
            )
        eyes.append(Eye(start.name, camera, _EYE_ON[start.mount], start.refine))
    fixtures = [
        _fixture(t, d, _TARGET_ON[d.mount or recording.mount])
        for t, d in zip(targets, recording.targets, strict=True)
    ]  # fmt: skip
    views = [_view(view, found[view.id], targets) for view in recording.views]
    reasons = {
        id: "; ".join(dict.fromkeys(f.problems.values()))  # a picture hides all targets alike
        for id, f in found.items()
        if f.problems
    }
    seen = tuple(v for v in views if v.sights)
    problem = Problem(tuple(eyes), tuple(fixtures), seen, recording.arm)
    warnings += _rarely_found(recording, targets, found)
    return Detected(problem, reasons, tuple(warnings))


def _fixture(named: NamedTarget, described: TargetDescription, side: Side) -> Fixture:
    """A target with how exact its print is, as far as the manifest says so."""
    fixture = Fixture(named.name, named.target.points, side, named.target.half_turns)
    if described.size_percent is not None:
        fixture = replace(fixture, size_std=described.size_percent / 100)
    if described.flatness_mm is not None:
        fixture = replace(fixture, flatness_std=described.flatness_mm / 1e3)
    return fixture


def _view(view: View, found: Found, targets: Sequence[NamedTarget]) -> CalibrationView:
    seen = [(c, t.name) for t in targets for c in t.cameras if (c, t.name) in found.sightings]
    sights = tuple(
        Sight(
            camera, name, np.asarray(found.sightings[camera, name].ids),
            np.asarray(found.sightings[camera, name].uv_px, dtype=float),
        )
        for camera, name in seen
    )  # fmt: skip
    return CalibrationView(view.id, view.T_base_flange, sights, view.q)


def _rarely_found(
    recording: Recording, targets: Sequence[NamedTarget], found: Mapping[str, Found]
) -> list[str]:
    """A target that many of a camera's pictures lack may be described wrongly."""
    counts = Counter(seen for f in found.values() for seen in f.sightings)
    taken = Counter(picture.camera for view in recording.views for picture in view.pictures)
    return [
        f"'{t.name}' was found in {counts[camera, t.name]} of {taken[camera]} views"
        + (f" of '{camera}'" if len(recording.cameras) > 1 else "")
        + "; check its kind and counts"
        for t in targets
        for camera in t.cameras
        if any(name == t.name for _, name in counts)
        and counts[camera, t.name] < _FEW * taken[camera]
    ]


def _of_pairs(recording: Recording) -> Detected:
    """Pose pairs: an eye that reports poses, and one target."""
    eye = Eye(_POSE_EYE, None, _EYE_ON[recording.mount], refine=False)
    fixture = Fixture(_POSE_TARGET, mount=_TARGET_ON[recording.mount])
    views = [
        CalibrationView(
            view.id, view.T_base_flange, (PoseSight(eye.name, fixture.name, view.T_camera_target),)
        )
        for view in recording.views
        if view.T_camera_target is not None
    ]
    return Detected(Problem((eye,), (fixture,), tuple(views)), {}, recording.warnings)


def scatter_mm(report: CalibrationReport) -> float | None:
    """How far a target strays over the views (rms, mm) when each is posed by itself.

    Placed through the estimated camera from the arm as its controller has it; the largest of
    the targets that the arm moves in a picture. None without a solution.
    """
    if report.solution is None:
        return None
    problem, estimate = report.solution.problem, report.solution.estimate
    strays = []
    for eye, fixture in pairs_seen(problem):
        if not moves(eye, fixture):
            continue
        X, places = estimate.T_mount_eye[eye.name], []
        for v, s in sights_of(problem, eye, fixture):
            view = problem.views[v]
            sight, A = view.sights[s], view.T_base_flange
            camera, scale = estimate.cameras.get(eye.name), estimate.scales[fixture.name]
            T = own_pose(problem, sight, camera, scale)
            if T is not None:
                on_arm = eye.mount == "flange"
                places.append(((A * X * T) if on_arm else A.actInv(X * T)).translation)
        if places:
            strays.append(_rms_distance(np.array(places)))
    return max(strays, default=None)


def own_pose(
    problem: Problem, sight: Sight | PoseSight, camera: Camera | None, scale: float
) -> SE3 | None:
    """T_camera_fixture of one sight by itself, the print `scale` times as large as declared.

    None where no pose fits.
    """
    if isinstance(sight, PoseSight):
        T = sight.T_camera_fixture
        return SE3(T.rotation, scale * T.translation)
    assert camera is not None  # pixels come with intrinsics
    points = scale * problem.fixture(sight.fixture).points[sight.ids]
    try:
        return solve_pose(points, sight.uv_px, camera).T_camera_target
    except Implausible:
        return None


def _rms_distance(places: Array) -> float:
    return float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean())) * 1e3
