"""Where a straight edge or bar runs, to a few thousandths of a pixel.

Grey values are sampled on a small grid laid across the edge (or bar) and the position
is taken from areas, not from gradients: the area under a profile does not depend on
the blur, as long as the blur is symmetric. A line through many such positions then
averages what rasterisation and noise do to each.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from aoicell.observation import Image
from aoicell.transforms import Array


@dataclass(frozen=True)
class Strips:
    """Sampling grids along N lines: centre + t * along + u * across, in pixels.

    `centre`, `along`, `across` are (N, 2); `t` (M,) and `u` (L,) are in units of the vectors.
    `bend` (N, M, 2) px is added along a line that the lens makes a curve.
    """

    centre: Array
    along: Array
    across: Array
    t: Array
    u: Array
    bend: Array | None = None

    def sample(self, grey: Image) -> Array:
        """Grey values (N, M, L), bilinear.

        Not with OpenCV's remap: it rounds positions to 1/32 px, which shifts an edge that
        runs along the pixel raster by up to 0.016 px.
        """
        points = (
            self.centre[:, None, None]
            + self.t[:, None, None] * self.along[:, None, None]
            + self.u[:, None] * self.across[:, None, None]
        )
        if self.bend is not None:
            points = points + self.bend[:, :, None]
        values = map_coordinates(
            grey, [points[..., 1], points[..., 0]], output=np.float64, order=1, mode="nearest"
        )
        return np.asarray(values)


def step_offsets(profiles: Array, u: Array) -> Array:
    """Position (..., ) along u of the step in each profile (..., L), by its area."""
    ends = max(2, len(u) // 8)
    low = profiles[..., :ends].mean(axis=(-1, -2), keepdims=True)
    high = profiles[..., -ends:].mean(axis=(-1, -2), keepdims=True)
    contrast = np.where(np.abs(high - low) < 1, np.nan, high - low)
    share = ((profiles - low) / contrast).mean(axis=-1)
    half = (u[-1] - u[0]) / 2 * len(u) / (len(u) - 1)
    offsets: Array = half * (1 - 2 * share)
    return offsets


@dataclass(frozen=True, eq=False)
class Bars:
    """Dark bars in profiles (..., L): their positions along u, how much darkness there is in each
    (grey value times u), and how much brighter it is to the right of it than to the left.
    """

    offsets: Array
    ink: Array
    rise: Array


def bar_offsets(profiles: Array, u: Array) -> Array:
    """Position (..., ) along u of the dark bar in each profile (..., L): its centroid."""
    return find_bars(profiles, u).offsets


def find_bars(profiles: Array, u: Array) -> Bars:
    """The dark bar in each profile (..., L); its position is that of its centroid."""
    ends = max(2, len(u) // 8)
    left = profiles[..., :ends].mean(axis=-1, keepdims=True)
    right = profiles[..., -ends:].mean(axis=-1, keepdims=True)
    start, stop = u[:ends].mean(), u[-ends:].mean()  # where `left` and `right` were taken
    background = left + (right - left) * (u - start) / (stop - start)
    dark = background - profiles
    weight = dark.sum(axis=-1)
    offsets: Array = (dark * u).sum(axis=-1) / np.where(np.abs(weight) < 1, np.nan, weight)
    return Bars(offsets, weight * (u[1] - u[0]), (right - left)[..., 0])


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines offset = a + b t: `a`, `b` (N,), the standard deviation `sigma` (N,) of a, and the
    share of the profiles that each rests on.
    """

    a: Array
    b: Array
    sigma: Array
    share: Array


def fit_lines(t: Array, offsets: Array, tolerance: float = 0.0) -> tuple[Array, Array]:
    """Robust lines offset = a + b t for offsets (N, M); a and b are (N,). See `judged_lines`."""
    lines = judged_lines(t, offsets, tolerance)
    return lines.a, lines.b


def judged_lines(
    t: Array, offsets: Array, tolerance: float = 0.0, independent: float = 1.0
) -> Lines:
    """Robust lines through offsets (N, M), each with what it is worth.

    Least squares, then once more without what lies off by more than 3.5 robust standard
    deviations and by more than `tolerance`: specks of dust, something that covers the print.
    `independent` is the share of neighbouring profiles whose errors are independent.
    """
    weights = np.isfinite(offsets).astype(float)
    values = np.nan_to_num(offsets)
    a, b = _weighted_lines(t, values, weights)
    residuals = np.abs(values - a[:, None] - b[:, None] * t)
    spread = 1.4826 * np.median(residuals, axis=-1, keepdims=True)
    weights = weights * (residuals <= 3.5 * spread + tolerance)
    a, b = _weighted_lines(t, values, weights)
    count = weights.sum(axis=-1)
    squares = (weights * (values - a[:, None] - b[:, None] * t) ** 2).sum(axis=-1)
    sigma = np.sqrt(squares / np.maximum(count - 2, 1) / np.maximum(independent * count, 1))
    return Lines(a, b, np.where(count > 2, sigma, np.inf), count / len(t))


def _weighted_lines(t: Array, offsets: Array, weights: Array) -> tuple[Array, Array]:
    total = np.maximum(weights.sum(axis=-1), 1e-12)
    t_mean, mean = (weights * t).sum(axis=-1) / total, (weights * offsets).sum(axis=-1) / total
    arm = weights * (t - t_mean[:, None])
    slope = (arm * (offsets - mean[:, None])).sum(axis=-1) / np.maximum(
        (arm * (t - t_mean[:, None])).sum(axis=-1), 1e-12
    )
    return mean - slope * t_mean, slope


def intersections(
    centre: Array, x: Array, y: Array, line_x: tuple[Array, Array], line_y: tuple[Array, Array]
) -> Array:
    """Where the line along x (offset along y) meets the line along y (offset along x), (N, 2).

    With v = a1 + b1 u on the first and u = a2 + b2 v on the second line.
    """
    (a1, b1), (a2, b2) = line_x, line_y
    u = (a2 + b2 * a1) / (1 - b1 * b2)
    v = a1 + b1 * u
    met: Array = centre + u[:, None] * x + v[:, None] * y
    return met
