"""Crosses where they are found: each centre as the crossing of the middle lines of its two bars.

The bars are sampled in the raw picture. A lens bends them: with the camera given they are followed
along the curve, without it a straight line is fitted.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.targets.cross_pattern import CrossPattern, Turned, appearance
from aoicell.targets.edges import Bars, Lines, Strips, find_bars, intersections, judged_lines
from aoicell.transforms import Array

_MOST_STEPS, _STILL_PX = 8, 0.01  # where blur reaches the ends of the profiles it takes several
_ALIKE_PX, _ALIKE = 2.0, 0.6e-3  # how far along a bar errors are alike: blur (px), dust (m)
_FARTHEST = 1.3  # from the rough centres to the refined ones, in strokes' widths
_LEAST_SHARE = 0.4  # of the profiles of a bar; less: something covers it
_UNLIKE = 0.35  # a bar with that much more or less ink than the others is covered, or no bar
_RING = np.linspace(0.4, 0.85, 6)  # of an arm: where upright and diagonal crosses differ
_ANGLES = np.arange(16) * np.pi / 8
_FOURFOLD = 0.5  # correlation of the grey values around a cross with its four arms; ideal 0.8
_LEAST_CONTRAST = 12.0  # grey values between the print's black and white


def fit_crosses(
    grey: Image,
    pattern: CrossPattern,
    diagonal: NDArray[np.bool_],
    uv_px: Array,
    camera: Camera | None,
) -> tuple[Array, Array]:
    """Centres (K, 4, 2) px near `uv_px`, and their standard deviations (K, 4) px a coordinate.

    `diagonal` (K, 4) tells which crosses are. NaN for markers whose bars are not all to be seen.
    """
    uv, worth = uv_px, np.full(uv_px.shape[:2], np.nan)
    lost = seen = np.zeros(len(uv_px), dtype=bool)
    for step in range(_MOST_STEPS):
        x, y = _bar_axes(pattern, diagonal, uv)
        lines = _bar_lines(grey, pattern, uv, x, y, camera, rough=step == 0)
        met, scale = _centres(uv, x, y, lines), _scales(x, y)
        off = np.linalg.norm(met - uv_px, axis=2) / (pattern.stroke * scale)
        seen = np.all(lines.share.reshape(2, *off.shape) >= _LEAST_SHARE, axis=(0, 2))
        lost = lost | ~np.all(off < _FARTHEST, axis=1)
        met = np.where(lost[:, None, None], uv, met)
        moved, uv = float(np.abs(met - uv).max()), met
        worth = scale * np.sqrt((lines.sigma**2).reshape(2, *off.shape).mean(axis=0))
        if step and moved < _STILL_PX:
            break
    return np.asarray(np.where((seen & ~lost)[:, None, None], uv, np.nan)), worth


def read_diagonals(
    grey: Image, pattern: CrossPattern, uv_px: Array
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which crosses at `uv_px` (K, 4, 2) px are diagonal (K, 4), and which K may be markers (K,).

    Around a cross the grey values go up and down four times, at three crosses at least.
    """
    x, y = (axis[:, :, None] for axis in _axes(pattern, uv_px))
    spokes = np.cos(_ANGLES)[:, None] * x + np.sin(_ANGLES)[:, None] * y
    places = uv_px[:, :, None, None] + pattern.arm * _RING[:, None] * spokes[:, :, :, None]
    around = _grey_at(grey, places).mean(axis=3)
    fourfold = (around * np.cos(4 * _ANGLES)).mean(axis=2)  # positive: dark on the diagonals
    spread = around.std(axis=2)
    like_a_cross = np.abs(fourfold) * np.sqrt(2) > _FOURFOLD * np.maximum(spread, 1.0)
    return np.asarray(fourfold > 0), like_a_cross.sum(axis=1) >= 3


def looks_right(grey: Image, pattern: CrossPattern, turned: Turned, uv_px: Array) -> bool:
    """Whether the picture is dark where the print is, and white where that is white.

    Each cross and the frame must be dark for the greater part, however small a share of the
    marker they are: something may cover the rest.
    """
    expected = appearance(pattern, turned)
    H = _homographies(pattern, uv_px[None])[0]
    seen = _grey_at(grey, _transformed(H, expected.places))
    parts, white = [seen[part] for part in expected.parts], seen[expected.white]
    bright, ink = float(np.median(white)), float(np.median(np.concatenate(parts[:4])))
    middle = (bright + ink) / 2
    dark = [float((part < middle).mean()) for part in parts]
    good = min(dark[:4]) > 0.6 and dark[4] > 0.5 and float((white > middle).mean()) > 0.8
    return good and bright - ink > _LEAST_CONTRAST


def _homographies(pattern: CrossPattern, uv_px: Array) -> Array:
    """From the marker's plane to the picture (K, 3, 3), for crosses (K, 4, 2) px."""
    plane = pattern.crosses[:, :2].astype(np.float32)
    Hs = [cv2.getPerspectiveTransform(plane, uv) for uv in uv_px.astype(np.float32)]
    return np.asarray(Hs, dtype=float).reshape(-1, 3, 3)


def _transformed(H: Array, points: Array) -> Array:
    uvw = points @ H[:, :2].T + H[:, 2]
    uv: Array = uvw[:, :2] / uvw[:, 2:]
    return uv


def _axes(pattern: CrossPattern, uv_px: Array) -> tuple[Array, Array]:
    """Image vectors (K, 4, 2) of one metre along the marker's x and y, at each cross (px/m)."""
    H = _homographies(pattern, uv_px)
    w = pattern.crosses[:, :2] @ H[:, 2, :2, None] + H[:, 2, 2, None, None]
    x, y = ((H[:, None, :2, i] - uv_px * H[:, 2, i, None, None]) / w for i in (0, 1))
    return np.asarray(x), np.asarray(y)


def _bar_axes(
    pattern: CrossPattern, diagonal: NDArray[np.bool_], uv_px: Array
) -> tuple[Array, Array]:
    """Image vectors (K, 4, 2) of one metre along the two bars of each cross (px/m)."""
    x, y = _axes(pattern, uv_px)
    angle = np.where(diagonal, np.pi / 4, 0.0)[..., None]
    c, s = np.cos(angle), np.sin(angle)
    return c * x + s * y, c * y - s * x


def _scales(x: Array, y: Array) -> Array:
    """Pixels a metre (K, 4) of axes (K, 4, 2)."""
    return np.asarray(np.sqrt(np.linalg.norm(x, axis=2) * np.linalg.norm(y, axis=2)))


def _centres(uv_px: Array, x: Array, y: Array, lines: Lines) -> Array:
    """Where the lines along x, the first half of them, meet those along y: (K, 4, 2) px."""
    half = len(lines.a) // 2
    along_x, along_y = (lines.a[:half], lines.b[:half]), (lines.a[half:], lines.b[half:])
    centre, x, y = (v.reshape(-1, 2) for v in (uv_px, x, y))
    return intersections(centre, x, y, along_x, along_y).reshape(uv_px.shape)


def _bar_lines(
    grey: Image, pattern: CrossPattern, uv_px: Array, x: Array, y: Array, camera: Camera | None,
    rough: bool,
) -> Lines:  # fmt: skip
    """Middle lines of all bars along x, then of those along y; sampled about every pixel.

    Clear of the hub and of the ends. A `rough` place will do for lines, not to judge by them.
    """
    centre = np.concatenate([uv_px, uv_px]).reshape(-1, 2)
    along, across = (np.concatenate(pair).reshape(-1, 2) for pair in ((x, y), (y, x)))
    scale = float(np.linalg.norm(along, axis=1).mean())
    inner, outer = 0.8 * pattern.stroke, pattern.arm - 0.3 * pattern.stroke
    half = 1.3 * pattern.stroke
    count = int(np.clip((outer - inner) * scale, 6, 60))
    u = np.linspace(-half, half, int(np.clip(4 * half * scale, 17, 65)))
    t = np.concatenate([np.linspace(-outer, -inner, count), np.linspace(inner, outer, count)])
    bend = None if camera is None or rough else _bend(camera, centre, along, t)
    profiles = Strips(centre, along, across, t, u, bend).sample(grey)
    bars = find_bars(profiles, u)
    clear = rough | _uncovered(bars, pattern.stroke, len(uv_px))
    offsets = np.where(clear, bars.offsets, np.nan)
    spacing_px = scale * (outer - inner) / (count - 1)
    independent = min(1.0, spacing_px / max(_ALIKE_PX, _ALIKE * scale))
    return judged_lines(t, offsets, 0.1 * pattern.stroke, independent)


def _uncovered(bars: Bars, stroke: float, markers: int) -> NDArray[np.bool_]:
    """Profiles that show a bar like the marker's others, with white on both sides of it."""
    shape = bars.ink.shape
    usual = np.median(bars.ink.reshape(2, markers, -1), axis=(0, 2))
    usual = np.tile(np.repeat(usual, shape[0] // (2 * markers)), 2)[:, None]
    alike = np.abs(bars.ink - usual) < _UNLIKE * usual
    return np.asarray(alike & (np.abs(bars.rise) < _UNLIKE * usual / stroke))


def _bend(camera: Camera, uv_px: Array, along: Array, t: Array) -> Array:
    """How far (N, M, 2) px straight lines through `uv_px` are bent, the middle left in place."""
    step = along * t[-1]
    ends = camera.undistort(np.concatenate([uv_px - step, uv_px + step])).reshape(2, -1, 2)
    middle = camera.undistort(uv_px)
    slope = (ends[1] - ends[0]) / 2
    ideal = middle[:, None] + (t / t[-1])[:, None] * slope[:, None]
    raw = camera.project(_rays(camera, ideal.reshape(-1, 2))).reshape(ideal.shape)
    straight: Array = uv_px[:, None] + t[:, None] * along[:, None]
    return np.asarray(raw - straight)


def _rays(camera: Camera, ideal_px: Array) -> Array:
    homogeneous = np.column_stack([ideal_px, np.ones(len(ideal_px))])
    return np.asarray(np.linalg.solve(camera.K, homogeneous.T).T)


def _grey_at(grey: Image, places: Array) -> Array:
    """Grey values at places (..., 2) px, for judging: to a 32nd of a pixel."""
    flat = places.reshape(-1, 1, 2).astype(np.float32)
    values = np.concatenate(
        [
            cv2.remap(
                grey, part[..., 0], part[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            )
            for part in np.array_split(flat, len(flat) // 30_000 + 1)
        ]
    )
    return np.asarray(values, dtype=float).reshape(places.shape[:-1])
