"""One component in several views: where it is, by all that measure it, and what that means."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aoicell.board import Tolerance
from aoicell.inspection.findings import Finding
from aoicell.inspection.verdicts import VerdictConfig, located
from aoicell.transforms import Array

_AS_WELL = 0.5  # times what the best view shows of it, another one is asked as well
_AGREE = 16.0  # squared Mahalanobis distance of two measurements of one place
_FLOOR = np.diag([10e-6, 10e-6, np.radians(0.1)]) ** 2  # of lens and drawing: alike in no two views


def fused(findings: Sequence[Finding], tolerance: Tolerance, config: VerdictConfig) -> Finding:
    """The finding of the view that shows a component best, its place measured by all views that
    show it well and agree with that.

    A view that tells that the part was put in the other way round is believed before one that
    shows nothing of it.
    """
    best = max(findings, key=_worth)
    good = [f for f in findings if f.visible >= _AS_WELL * best.visible]
    turned = [f for f in good if f.state == "rotated" and abs(f.rotation) > np.pi / 2]
    if turned and best.state == "present":
        return max(turned, key=_worth)
    if best.covariance is None:
        return best
    near = [
        f for f in good if f is best or (f.covariance is not None and _distance(f, best) < _AGREE)
    ]
    if len(near) < 2:
        return best
    weights = [np.linalg.inv(_uncertainty(f)) for f in near]
    covariance = np.linalg.inv(np.sum(weights, axis=0))
    gaps = [w @ _gap(f, best) for w, f in zip(weights, near, strict=True)]
    x, y, rotation = map(float, _place(best) + covariance @ np.sum(gaps, axis=0))
    verdict = located((x, y), rotation, covariance, tolerance, config)
    if verdict.state == "present" and all(f.is_defect for f in near):
        return best  # what was found elsewhere, with indulgence, is no proof of a good part
    return replace(
        best, state=verdict.state, shift=(x, y), rotation=rotation, covariance=covariance,
        confidence=best.fit * verdict.probability, reason=verdict.reason,
    )  # fmt: skip


def _worth(finding: Finding) -> tuple[bool, float]:
    """A verdict comes before none, then what is seen most of."""
    return finding.state != "no_verdict", finding.visible


def _place(finding: Finding) -> Array:
    return np.array([*finding.shift, finding.rotation])


def _gap(finding: Finding, other: Finding) -> Array:
    """From one place to another, turns by the shorter way."""
    x, y, turn = _place(finding) - _place(other)
    return np.array([x, y, (turn + np.pi) % (2 * np.pi) - np.pi])


def _uncertainty(finding: Finding) -> Array:
    return np.asarray(finding.covariance + _FLOOR)


def _distance(a: Finding, b: Finding) -> float:
    """Squared, by their common uncertainty."""
    gap = _gap(a, b)
    return float(gap @ np.linalg.solve(_uncertainty(a) + _uncertainty(b), gap))
