"""Pictures of a calibration: each view with its detected and predicted points, residuals enlarged.

Points are predicted by the calibration from the arm's pose as its controller has it, so that a
view that does not fit shows how it does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aoicell.calibration.bundle import Solution
from aoicell.calibration.problem import CalibrationView, Sight
from aoicell.calibration.selection import predicted_residuals
from aoicell.datasets.pictures import read_picture
from aoicell.datasets.recording import Picture
from aoicell.datasets.solve import Solved
from aoicell.errors import InputError, TargetNotFound
from aoicell.report.pictures import MAGNIFICATIONS
from aoicell.report.style import NEW, STANDARD, new_figure, save
from aoicell.transforms import Array

_WIDTH = 8.0  # inches
_LONGEST = 0.08  # of the picture's width: how long the longest residual is drawn


@dataclass(frozen=True)
class Overlay:
    """One picture: its points (N, 2) px as detected, detected minus predicted, and the title.

    `residuals_px` is empty where nothing could be predicted.
    """

    view: str
    picture: Picture
    detected_px: Array
    residuals_px: Array
    title: str


def write_overlays(solved: Solved, folder: Path) -> list[Path]:
    """One PNG a picture, and the residuals of all of a camera's views in one figure.

    Raises InputError where the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"--report {folder}: cannot be made ({error.strerror})") from None
    found = overlays(solved)
    written: list[Path] = []
    for overlay in found:
        name = f"{overlay.view}_{overlay.picture.camera}".replace("/", "_")
        written += save(overlay_figure(overlay), folder / f"{name}.png", vector=False)
    for camera in solved.recording.cameras:
        mine = [o for o in found if o.picture.camera == camera.name and len(o.residuals_px)]
        if mine:
            figure = residual_figure(camera.name, camera.size, mine)
            written += save(figure, folder / f"residuals_{camera.name}.png")
    return written


def overlays(solved: Solved) -> list[Overlay]:
    """Each picture of a recording with what was detected and what was expected in it."""
    detected = {view.id: view for view in solved.detected.problem.views}
    findings = {view.id: view for view in solved.report.views}
    solution = solved.report.solution
    settled = {v.id: v for v in solution.problem.views} if solution else {}
    found = []
    for view in solved.recording.views:
        seen = settled.get(view.id) or detected.get(view.id)
        finding = findings.get(view.id)
        used = finding is not None and finding.used
        reason = finding.reason if finding else solved.detected.reasons.get(view.id, "")
        for picture in view.pictures:
            uv, gaps = _points(solution, seen, picture.camera)
            size = f"{_rms(gaps):.2f} px rms" if len(gaps) else "nothing predicted"
            title = f"view {view.id}: {size}" if used else f"view {view.id}, not used: {reason}"
            found.append(Overlay(view.id, picture, uv, gaps, title))
    return found


def _points(
    solution: Solution | None, seen: CalibrationView | None, camera: str
) -> tuple[Array, Array]:
    """Detected points and residuals (N, 2) of one camera in a view."""
    none = np.zeros((0, 2))
    if seen is None:
        return none, none
    mine = [s for s in seen.sights if isinstance(s, Sight) and s.eye == camera]
    if not mine:
        return none, none
    uv = np.vstack([s.uv_px for s in mine])
    if solution is None:
        return uv, none
    parts = [_residuals(solution, seen, sight) for sight in mine]
    gaps = np.vstack(parts)
    return uv, gaps if np.isfinite(gaps).all() else none


def _residuals(solution: Solution, seen: CalibrationView, sight: Sight) -> Array:
    """The smaller residuals of a sight's readings: a view left out may be read either way."""
    fixture = solution.problem.fixture(sight.fixture)
    readings = [sight]
    if fixture.half_turns:
        readings.append(replace(sight, ids=len(fixture.points) - 1 - np.asarray(sight.ids)))
    tried = []
    for reading in readings:
        alone = replace(seen, sights=(reading,))
        tried.append(predicted_residuals(solution, solution.estimate, alone, alone))
    return min(tried, key=lambda r: float(np.median(np.abs(r)))).reshape(-1, 2)


def overlay_figure(overlay: Overlay) -> Figure:
    """A picture, paled, with detected (rings) and predicted points (crosses)."""
    figure = new_figure(_WIDTH, _WIDTH * 0.8)
    ax = figure.subplots()
    ax.set(xticks=[], yticks=[])
    ax.set_title(overlay.title, fontsize=9, wrap=True)
    try:
        image = read_picture(overlay.picture.path)
    except TargetNotFound as reason:
        ax.text(0.5, 0.5, str(reason), ha="center", va="center", wrap=True)
        return figure
    pale = (110 + 0.57 * image).astype(np.uint8)
    ax.imshow(pale, cmap="gray", vmin=0, vmax=255)
    ax.set(xlim=(-0.5, image.shape[1] - 0.5), ylim=(image.shape[0] - 0.5, -0.5))
    uv, gaps = overlay.detected_px, overlay.residuals_px
    if not len(uv):
        return figure
    ax.plot(*uv.T, linestyle="", marker="o", color=NEW, markersize=5, fillstyle="none",
            label="detected")  # fmt: skip
    if len(gaps):
        predicted = uv - gaps
        ax.plot(*predicted.T, linestyle="", marker="+", color=STANDARD, markersize=6,
                label="predicted from the arm's pose")  # fmt: skip
        _draw_vectors(ax, predicted, gaps, image.shape[1])
    ax.legend(loc="upper right", fontsize=7)
    return figure


def residual_figure(camera: str, size: tuple[int, int], found: Sequence[Overlay]) -> Figure:
    """Residuals of all views over the picture, each view's mean shift taken away.

    What is left is the lens and the print; the shift is the arm's.
    """
    figure = new_figure(_WIDTH, _WIDTH * size[1] / size[0] + 0.8)
    ax = figure.subplots()
    uv = np.vstack([o.detected_px for o in found])
    gaps = np.vstack([o.residuals_px - o.residuals_px.mean(axis=0) for o in found])
    _draw_vectors(ax, uv, gaps, size[0])
    ax.set(xlim=(0, size[0]), ylim=(size[1], 0), aspect="equal", xlabel="u, px", ylabel="v, px")
    ax.set_title(f"{camera}: residuals of {len(found)} views without their mean, {_rms(gaps):.2f} "
                 "px rms", fontsize=9)  # fmt: skip
    ax.legend(loc="upper right", fontsize=7)
    return figure


def _draw_vectors(ax: Axes, start: Array, gaps: Array, width: int) -> None:
    longest = float(np.quantile(np.linalg.norm(gaps, axis=1), 0.95))
    most = _LONGEST * width / max(longest, 1e-9)
    by = max((m for m in MAGNIFICATIONS if m <= most), default=1)
    ax.quiver(
        *start.T, *(by * gaps).T, angles="xy", scale_units="xy", scale=1, width=0.002,
        color=NEW, label=f"detected minus predicted, {by} times its length",
    )  # fmt: skip


def _rms(gaps: Array) -> float:
    return float(np.sqrt((gaps**2).sum(axis=1).mean()))
