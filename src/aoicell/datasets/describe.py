"""A solved recording in the words of the result file."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from aoicell.calibration.bundle import Solution
from aoicell.calibration.problem import Eye, Fixture, Problem, moves, pairs_seen
from aoicell.calibration.verdict import CalibrationReport, ViewFinding
from aoicell.datasets.results import HandEyeResult, TargetResult, ViewResult, to_json
from aoicell.datasets.solve import Solved, scatter_mm
from aoicell.transforms import Array

_CAMERA_KEYS = ("T_flange_camera", "T_base_camera")
_TARGET_KEYS = {"base": "T_base_target", "flange": "T_flange_target"}


def describe(solved: Solved) -> dict[str, Any]:
    """The result as JSON knows it: DESIGN's keys, with held-out mm, motion and sizes beside them.

    A refused calibration has no poses: null stands in their place.
    """
    values: dict[str, Any] = json.loads(to_json(hand_eye_result(solved)))  # NaN is null there
    report = solved.report
    values["holdout_mm"] = _known(report.held_out_mm)
    for view, described in zip(_findings(solved), values["views"], strict=True):
        described["holdout_px"] = _known(view.held_out_px)
        described["holdout_mm"] = _known(view.held_out_mm)
    values["motion"] = [
        {"camera": m.eye, "target": m.fixture, "views": m.views,
         "turn_deg": m.turn_deg.tolist(), "tilt_deg": m.tilt_deg,
         "depth_ratio": _known(m.depth_ratio)}
        for m in report.motion
    ]  # fmt: skip
    usable = report.solution is not None and report.verdict != "refused"
    if not usable:
        for key in (*_CAMERA_KEYS, *_TARGET_KEYS.values()):
            if key in values:
                values[key] = None
        values["targets"] = []
    if usable and report.solution is not None:
        values["targets"] = _targets(report, report.solution)
        if len(report.solution.problem.eyes) > 1:
            values["cameras"] = _cameras(report, report.solution)
    return values


def hand_eye_result(solved: Solved) -> HandEyeResult:
    """The first camera with the targets that the arm moves in its picture, and the verdict."""
    report, recording = solved.report, solved.recording
    warnings = (*solved.detected.warnings, *report.warnings)
    views = tuple(ViewResult(v.id, v.used, v.reason, _known(v.rms_px)) for v in _findings(solved))
    solution = report.solution
    if solution is None:
        return HandEyeResult(
            recording.mount, None, (), "refused", report.reasons, warnings, views=views
        )
    eye, estimate = solution.problem.eyes[0], solution.estimate
    std = _std(report, eye.name)
    return HandEyeResult(
        mount="eye_in_hand" if eye.mount == "flange" else "eye_to_hand",
        T_mount_camera=estimate.T_mount_eye[eye.name],
        targets=tuple(_target(report, solution, f) for f in _moved(solution.problem, eye)),
        verdict=report.verdict,
        reasons=report.reasons,
        warnings=warnings,
        camera=estimate.cameras.get(eye.name),
        rms_px=None if solution.problem.of_poses else _rms_px(solution),
        holdout_px=_known(report.held_out_px),
        scatter_mm=scatter_mm(report),
        std_mm=std[:3] * 1e3,
        std_deg=np.degrees(std[3:]),
        views=views,
    )


def _findings(solved: Solved) -> list[ViewFinding]:
    """Each view of the recording in its order, also those that show nothing."""
    found = {view.id: view for view in solved.report.views}
    reasons = solved.detected.reasons
    result = []
    for view in solved.recording.views:
        finding = found.get(view.id)
        if finding is None:
            finding = ViewFinding(view.id, False, reasons.get(view.id, "shows no target"))
        elif finding.used and view.id in reasons:  # one target of several is missing
            finding = replace(finding, reason=reasons[view.id])
        result.append(finding)
    return result


def _moved(problem: Problem, eye: Eye) -> list[Fixture]:
    """The fixtures that the arm moves before an eye."""
    return [f for e, f in pairs_seen(problem) if e is eye and moves(e, f)]


def _target(report: CalibrationReport, solution: Solution, fixture: Fixture) -> TargetResult:
    size = next((s for s in report.sizes if s.fixture == fixture.name), None)
    T = solution.estimate.T_mount_fixture[fixture.name]
    if size is None:
        return TargetResult(fixture.name, T)
    return TargetResult(fixture.name, T, size.factor, size.std)


def _targets(report: CalibrationReport, solution: Solution) -> list[Mapping[str, Any]]:
    """Every target in the frame that it stands in, whatever the others do."""
    described: list[Mapping[str, Any]] = []
    problem = solution.problem
    first = {f.name for f in _moved(problem, problem.eyes[0])}
    for fixture in sorted(problem.fixtures, key=lambda f: f.name not in first):
        target = _target(report, solution, fixture)
        described.append(
            {
                "name": target.name,
                _TARGET_KEYS[fixture.mount]: {"matrix": target.T_mount_target.homogeneous.tolist()},
                "target_scale": target.scale,
                "target_scale_std": target.scale_std,
            }
        )
    return described


def _cameras(report: CalibrationReport, solution: Solution) -> list[Mapping[str, Any]]:
    described: list[Mapping[str, Any]] = []
    for eye in solution.problem.eyes:
        T, std = solution.estimate.T_mount_eye[eye.name], _std(report, eye.name)
        camera = solution.estimate.cameras.get(eye.name)
        described.append(
            {
                "name": eye.name,
                f"T_{eye.mount}_camera": {"matrix": T.homogeneous.tolist()},
                "K": None if camera is None else camera.K.tolist(),
                "distortion": None if camera is None else camera.distortion.tolist(),
                "std_mm": [_known(v * 1e3) for v in std[:3]],
                "std_deg": [_known(v) for v in np.degrees(std[3:])],
            }
        )
    return described


def _std(report: CalibrationReport, eye: str) -> Array:
    """Standard deviations (6,) of an eye's place (m) and rotation (rad), in its own axes."""
    assert report.solution is not None
    assert report.uncertainty is not None
    return np.asarray(report.uncertainty.std[report.solution.layout.blocks["eye", eye]])


def _rms_px(solution: Solution) -> float:
    """What the fit leaves, root mean square length over all points."""
    return float(np.sqrt(2 * (solution.lin.residuals**2).mean()))


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
