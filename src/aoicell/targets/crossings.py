"""Corners as the crossings of straight edges, in windows that go with the size of a square."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aoicell.observation import Image
from aoicell.targets.edges import Strips, fit_lines, intersections, step_offsets
from aoicell.transforms import Array

MIN_STEP = 5.0  # grey values from one side of an edge to the other
_MOST, _STILL_PX = 8, 0.01


@dataclass(frozen=True)
class EdgeWindow:
    """Where the two edges of a corner are sampled, in shares of the steps x and y.

    `arms`: stretches along an edge, clear of the corner itself. Profiles across it reach
    `half_px` to each side, and at least `low`, at most `high` of a step: short ones, because
    uneven light shifts an area-based edge by the square of their length, and something else
    may be printed next to it. `profiles` of them are taken on each arm; at least
    the share `whole` has to show the edge, or something covers it.
    """

    arms: tuple[tuple[float, float], ...] = ((-0.42, -0.12), (0.12, 0.42))
    half_px: float = 5.0
    low: float = 0.12
    high: float = 0.25
    profiles: int = 24
    whole: float = 0.0


def refine_crossings(
    grey: Image, uv_px: Array, x_px: Array, y_px: Array, window: EdgeWindow
) -> Array:
    """Corners (N, 2) px near `uv_px`, each where the edge along x meets the edge along y.

    `x_px`, `y_px` (N, 2) run along the edges, a square long. NaN where there is no contrast, or
    where the crossing lies more than 0.3 of a square from where it was looked for.
    """
    along_x, sharp_x = _edge_lines(grey, uv_px, x_px, y_px, window)
    along_y, sharp_y = _edge_lines(grey, uv_px, y_px, x_px, window)
    moved = intersections(uv_px, x_px, y_px, along_x, along_y)
    reach = 0.3 * np.minimum(np.linalg.norm(x_px, axis=1), np.linalg.norm(y_px, axis=1))
    near = np.linalg.norm(moved - uv_px, axis=1) < reach
    return np.where((near & sharp_x & sharp_y)[:, None], moved, np.nan)


def settle_crossings(
    grey: Image, uv_px: Array, x_px: Array, y_px: Array, window: EdgeWindow
) -> Array:
    """As `refine_crossings`, repeated until nothing moves any more.

    A window hardly wider than the blur goes only a part of the way each time.
    """
    uv, moving = np.array(uv_px), np.arange(len(uv_px))
    for _ in range(_MOST):
        moved = refine_crossings(grey, uv[moving], x_px[moving], y_px[moving], window)
        far = np.linalg.norm(moved - uv[moving], axis=1) >= _STILL_PX  # false where lost
        uv[moving] = moved
        moving = moving[far]
        if not len(moving):
            break
    return uv


def _edge_lines(
    grey: Image, uv_px: Array, along: Array, across: Array, window: EdgeWindow
) -> tuple[tuple[Array, Array], NDArray[Any]]:
    """Lines through the edges along `along`, at each corner, and whether there is an edge."""
    width = float(np.linalg.norm(across, axis=1).min())
    half = float(np.clip(window.half_px / width, window.low, window.high))
    u = np.linspace(-half, half, 33)
    arms = [np.linspace(*arm, window.profiles) for arm in window.arms]
    profiles = [Strips(uv_px, along, across, t, u).sample(grey) for t in arms]
    # arm by arm: at a corner of squares the step changes its sign
    offsets = np.concatenate([step_offsets(values, u) for values in profiles], axis=1)
    values = np.concatenate(profiles, axis=1)
    steps = np.abs(values[..., -4:].mean(axis=-1) - values[..., :4].mean(axis=-1))
    lines = fit_lines(np.concatenate(arms), offsets, 0.02 * half)
    shown = steps > 0.5 * np.quantile(steps, 0.9, axis=1)[:, None]
    return lines, (np.median(steps, axis=1) > MIN_STEP) & (shown.mean(axis=1) >= window.whole)


def checker_contrast(
    grey: Image, uv_px: Array, x_px: Array, y_px: Array, at: float = 0.25
) -> Array:
    """How a corner's four quadrants alternate (N,): positive where that between +x and +y is dark.

    Grey values from the darker to the lighter pair, `at` that share of a square from both edges;
    zero where a pair is not alike: no corner of a checker pattern.
    """
    steps = at * np.array([-1.2, -1.0, -0.8, 0.8, 1.0, 1.2])
    values = Strips(uv_px, x_px, y_px, steps, steps).sample(grey)
    plus, minus = slice(3, 6), slice(0, 3)
    like = [values[:, s, s].mean(axis=(1, 2)) for s in (plus, minus)]
    other = [values[:, s, t].mean(axis=(1, 2)) for s, t in ((plus, minus), (minus, plus))]
    contrast = np.mean(other, axis=0) - np.mean(like, axis=0)
    unlike = np.maximum(np.abs(np.subtract(*like)), np.abs(np.subtract(*other)))
    return np.asarray(np.where(unlike < 0.6 * np.abs(contrast), contrast, 0.0))


def has_checkers(contrasts: Array, columns: NDArray[Any], rows: NDArray[Any]) -> NDArray[Any]:
    """Which corners (N,) fit a checker pattern whose colours the majority settles."""
    signed = np.where((columns + rows) % 2 == 0, 1, -1) * contrasts
    sign = 1 if np.sum(signed > 0) >= np.sum(signed < 0) else -1
    return np.asarray(sign * signed > MIN_STEP)
