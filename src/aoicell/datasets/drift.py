"""A drift check of a recording against a written calibration, in words for people and machines."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.calibration.drift import DriftReport, check_drift
from aoicell.calibration.drift_groups import BOTH, CAMERA, CENTRE, FOCAL
from aoicell.calibration.drift_statistics import ChangeTest
from aoicell.datasets.recording import Recording, read_recording
from aoicell.datasets.result_files import read_reference
from aoicell.datasets.solve import detect
from aoicell.errors import AoicellError, Refused
from aoicell.transforms import Array

_LOUD = 1.5  # times the old pixel noise: worth a word


@dataclass(frozen=True)
class CheckedRecording:
    """A recording with its drift report; `reasons` say why views were not used."""

    recording: Recording
    report: DriftReport
    warnings: tuple[str, ...]


def check_recording(manifest: Path, result: Path, fixed: bool = False) -> CheckedRecording:
    """Compares a few new pictures with a calibration; `fixed`: the target has not been moved.

    Raises InputError on what cannot be compared.
    """
    reference = read_reference(result)
    recording = read_recording(manifest)
    detected = detect(recording)
    report = check_drift(detected.problem, reference, fixed)
    left_out = {**detected.reasons, **report.unused}
    warnings = [f"view '{view}': {reason}" for view, reason in left_out.items()]
    if report.noise_ratio > _LOUD:
        warnings.append(
            f"the points are {report.noise_ratio:.1f} times as noisy as in the calibration's "
            "pictures; check focus, light and the print"
        )
    return CheckedRecording(recording, report, tuple(warnings))


def describe_check(checked: CheckedRecording) -> dict[str, Any]:
    """The check as JSON has it; what is unknown is null."""
    report = checked.report
    effect = report.effect
    return {
        "schema": 1,
        "verdict": report.verdict,
        "reasons": list(report.reasons),
        "views": report.views,
        "tests": [
            {"group": t.name, "chi_square": _known(t.chi_square), "freedoms": t.freedoms,
             "p": _known(t.p)}
            for t in report.tests if t.freedoms > 0
        ],
        "changed": None if report.changed is None else _change(report.changed),
        "or": list(report.instead),
        "target_moved": {
            name: {
                "mm": _listed(twist[:3] * 1e3), "std_mm": _listed(std[:3] * 1e3),
                "deg": _listed(np.degrees(twist[3:])), "std_deg": _listed(np.degrees(std[3:])),
            }
            for name, (twist, std) in report.moved.items()
        },
        "error_mm": None if effect is None else
            {"rms": effect.rms_mm, "std": effect.std_mm, "max": effect.max_mm},
        "hidden_std_mm": _known(report.hidden_mm),
        "noise_ratio": _known(report.noise_ratio),
        "warnings": list(checked.warnings),
    }  # fmt: skip


def lines_of(checked: CheckedRecording) -> list[str]:
    """The check for people."""
    report = checked.report
    lines = [f"{'group':24} {'chi-square':>10} {'freedoms':>8} {'by chance':>10}"]
    lines += [
        f"{t.name:24} {t.chi_square:10.1f} {t.freedoms:8d} {t.p:10.2g}"
        for t in report.tests if t.freedoms > 0
    ] if report.tests else []  # fmt: skip
    for name, (twist, std) in report.moved.items():
        (mm, deg), (std_mm, std_deg) = _lengths(twist), _lengths(std)
        lines.append(
            f"'{name}' lies {mm:.2f} mm and {deg:.3f} deg from where it was "
            f"(+/- {std_mm:.2f} mm, {std_deg:.3f} deg)"
        )
    if report.effect is not None:
        e = report.effect
        lines.append(
            f"used anyway, the old calibration places the target {e.rms_mm:.2f} +/- {e.std_mm:.2f} "
            f"mm off (at most {e.max_mm:.2f} mm)"
        )
    elif math.isfinite(report.hidden_mm):
        lines.append(
            f"an unseen knock of the camera would place the target {report.hidden_mm:.2f} mm off "
            "(one standard deviation)"
        )
    lines += [f"or: {name} explains it as well" for name in report.instead]
    return [*lines, f"Verdict: {report.verdict}"]


def raise_unless_ok(checked: CheckedRecording, manifest: Path) -> None:
    """Exit code 1 for a drifted calibration, 3 where the views cannot tell."""
    report = checked.report
    if report.verdict == "drifted":
        raise AoicellError(f"{manifest}: the calibration has drifted: {'; '.join(report.reasons)}")
    if report.verdict == "cannot tell":
        raise Refused(f"{manifest}: cannot tell: {'; '.join(report.reasons)}")


def _lengths(twist: Array) -> tuple[float, float]:
    """Of a twist (6,): mm and deg."""
    mm, rad = np.linalg.norm(twist[:3]) * 1e3, np.linalg.norm(twist[3:])
    return float(mm), float(np.degrees(rad))


def _change(test: ChangeTest) -> dict[str, Any]:
    """What changed, with one standard deviation, in the group's own units."""
    values, std = test.values, np.sqrt(np.diag(test.covariance))
    change: dict[str, Any] = {"group": test.name, "complete": test.complete}
    pairs: list[tuple[str, slice, float]] = []
    if test.name not in (FOCAL, CENTRE) and len(values) >= 6:
        pairs += [("mm", slice(0, 3), 1e3), ("deg", slice(3, 6), float(np.degrees(1)))]
    if test.name in (FOCAL, BOTH):
        at = 6 if test.name == BOTH else 0
        pairs += [("focal_percent", slice(at, at + 1), 100.0)]
    if test.name in (CENTRE, BOTH):
        pairs += [("principal_point_px", slice(len(values) - 2, len(values)), 1.0)]
    for key, where, unit in pairs:
        change[key], change[f"std_{key}"] = (
            _listed(values[where] * unit),
            _listed(std[where] * unit),
        )
    if test.name in (CAMERA, BOTH):
        change["axes"] = "camera"
    return change


def _listed(values: Any) -> list[float]:
    return [float(value) for value in values]


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
