"""The outcome of a calibration: what was found, and whether to trust it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from aoicell.calibration.bundle import Solution
from aoicell.calibration.diagnosis import Size
from aoicell.calibration.motion import Motion
from aoicell.calibration.parameters import Model
from aoicell.calibration.selection import Candidate, HeldOut
from aoicell.calibration.uncertainty import Uncertainty
from aoicell.transforms import Array, apply

Verdict = Literal["ok", "suspect", "refused"]


@dataclass(frozen=True)
class Limits:
    """Where a result turns suspect, and where it is refused.

    Held-out errors are measured against the distance of the target: a good arm reaches 0.05 %,
    an industrial one without calibration 0.3 %.
    """

    suspect_error: float = 3e-3
    refuse_error: float = 1e-2
    refuse_outliers: float = 0.34
    refuse_size: float = 0.2
    suspect_inflation: float = 3.0


DEFAULT_LIMITS = Limits()


@dataclass(frozen=True)
class ViewFinding:
    """One view: whether it was used, else why not.

    `rms_px` is what the fit leaves, `held_out_px` and `held_out_mm` what a fit to the other
    views predicts; NaN where there is none.
    """

    id: str
    used: bool
    reason: str = ""
    rms_px: float = np.nan
    held_out_px: float = np.nan
    held_out_mm: float = np.nan


@dataclass(frozen=True)
class ModelScore:
    """A model that was tried, and the median of its held-out errors over the views."""

    model: Model
    held_out_px: float
    held_out_mm: float


@dataclass(frozen=True)
class CalibrationReport:
    """What came out, with its own quality.

    `reasons` say why the verdict is not 'ok'; `warnings` what else a user should know. A
    refused recording may have no solution. `sizes` are the prints as the arm's motion measures
    them. The held-out errors are root mean squares over the used views.
    """

    verdict: Verdict
    reasons: tuple[str, ...]
    warnings: tuple[str, ...]
    views: tuple[ViewFinding, ...]
    motion: tuple[Motion, ...]
    sizes: tuple[Size, ...] = ()
    tried: tuple[ModelScore, ...] = ()
    solution: Solution | None = None
    uncertainty: Uncertainty | None = None
    held_out_px: float = np.nan
    held_out_mm: float = np.nan


def score(candidate: Candidate) -> ModelScore:
    """A candidate in the report's words."""
    px, mm = candidate.held_out.px, candidate.held_out.mm
    return ModelScore(candidate.model, float(np.median(px)), float(np.median(mm)))


def judge_fit(
    solution: Solution, held_out: HeldOut, uncertainty: Uncertainty, limits: Limits
) -> tuple[list[str], list[str]]:
    """(reasons to refuse, reasons to suspect) from the numbers of a fit."""
    refuse: list[str] = []
    suspect: list[str] = []
    distance = _distance(solution)
    mm = rms(held_out.mm)
    share = mm / 1e3 / distance
    if not share <= limits.refuse_error:
        refuse.append(
            f"held-out views are predicted {mm:.1f} mm off at {distance:.2f} m, more than "
            f"{limits.refuse_error:.1%}; check that pictures and poses belong together, their "
            "convention and units, and the size of the target"
        )
    elif share > limits.suspect_error:
        suspect.append(
            f"held-out views are predicted {mm:.1f} mm off at {distance:.2f} m, more than "
            f"{limits.suspect_error:.1%}: an inexact arm, a bent target or wrong conventions"
        )
    robot = solution.layout.model.robot  # 'exact' takes points for independent: they never are
    if uncertainty.inflation > limits.suspect_inflation and robot != "exact":
        suspect.append(
            f"the views differ {uncertainty.inflation:.1f} times more among themselves than the "
            "model explains; the stated errors are widened by that much"
        )
    lost = [name for name, std in zip(uncertainty.names, uncertainty.std, strict=True)
            if np.isnan(std)]  # fmt: skip
    if lost:
        refuse.append(f"nothing that was seen tells {', '.join(lost[:6])}; take other views")
    for eye in solution.problem.eyes:
        if eye.camera is not None and eye.refine:
            refuse += _judge_camera(solution, eye.name)
    return refuse, suspect


def _judge_camera(solution: Solution, eye: str) -> list[str]:
    camera, start = solution.estimate.cameras[eye], solution.problem.eye(eye).camera
    assert start is not None
    ratio = camera.focal_px / start.focal_px
    inside = 0 < camera.K[0, 2] < camera.width and 0 < camera.K[1, 2] < camera.height
    if camera.K[0, 0] > 0 and camera.K[1, 1] > 0 and 0.5 < ratio < 2 and inside:
        return []
    return [
        f"'{eye}': the refined camera (focal length {camera.focal_px:.0f} px, centre "
        f"{camera.K[0, 2]:.0f}, {camera.K[1, 2]:.0f}) cannot be near the one to start from; check "
        "the intrinsics and tilt the target both ways"
    ]


def judge_sizes(sizes: Sequence[Size], limits: Limits) -> tuple[list[str], list[str]]:
    """(reasons to refuse, reasons to suspect) from the prints' sizes."""
    refuse, suspect = [], []
    for size in sizes:
        if not size.wrong:
            continue
        told = f"'{size.fixture}': the arm's motion makes it {size.factor:.4g} times as large as"
        if abs(size.factor - 1) > limits.refuse_size:
            refuse.append(f"{told} declared; check its size and the length unit of the poses")
        else:
            suspect.append(f"{told} declared (+/- {size.std:.2g}); measure the print")
    return refuse, suspect


def _distance(solution: Solution) -> float:
    """Usual distance (m) from an eye to a fixture."""
    found = []
    problem, estimate = solution.problem, solution.estimate
    for view in problem.views:
        on = {"flange": view.T_base_flange}
        for sight in view.sights:
            eye, fixture = problem.eye(sight.eye), problem.fixture(sight.fixture)
            E, F = estimate.T_mount_eye[eye.name], estimate.T_mount_fixture[fixture.name]
            E = on[eye.mount] * E if eye.mount in on else E
            F = on[fixture.mount] * F if fixture.mount in on else F
            found.append(np.linalg.norm(apply(E.actInv(F), fixture.points.mean(axis=0))))
    return float(np.median(found))


def rms(errors: Array) -> float:
    """Root mean square; NaN when all are."""
    known = errors[~np.isnan(errors)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan
