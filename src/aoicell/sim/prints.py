"""How prints really turn out: their scale, the bow and twist of their plates, dust on them.

The scene is built from the functions below and so is the truth of the printed points.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aoicell.observation import Image
from aoicell.sim.as_built import PrintScale
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.marker import Marker
from aoicell.transforms import Array

Size = tuple[float, float]

SPECK = (0.1e-3, 0.6e-3)  # diameters of specks of dust (m)
GREYS = (40, 150)  # of specks, seen on white and on black
_BULGES = 0.3  # of a speck's rim at most, twice and three times around, of its radius
_BATCH = 64  # specks that are shaped at a time


def plate_height(x: ArrayLike, y: ArrayLike, size: Size, bow: float, twist: float) -> Array:
    """Height z (m) of a bent plate at x, y (m) from its centre; `size` is its width and height.

    With u = 2 x / width and v = 2 y / height, both from -1 to 1 on the plate,

        z = bow (1 - u^2) (1 - v^2) + twist / 2 u v

    The bow is the height of the centre over the edges; the twist that of the corners at the
    top right and bottom left over the other two. The middles of the edges stay at zero; x and y
    of a point stay as they are: the shortening is of second order, 0.1 um where the bow is 0.1 mm.
    """
    u, v = 2 * np.asarray(x, dtype=float) / size[0], 2 * np.asarray(y, dtype=float) / size[1]
    return np.asarray(bow * (1 - u**2) * (1 - v**2) + twist / 2 * u * v)


def printed_size(size: Size, scale: PrintScale) -> Size:
    """Width and height (m) of a plate that is stretched together with its print."""
    return size[0] * scale[0], size[1] * scale[1]


def true_corners(board: Chessboard, scale: PrintScale, bow_twist: tuple[float, float]) -> Array:
    """Inner corners (N, 3) of a board as printed and bent, in the board's frame (m)."""
    points = board.corners * [*scale, 1.0]
    size = printed_size(board.size, scale)
    points[:, 2] = plate_height(points[:, 0], points[:, 1], size, *bow_twist)
    return points


def true_crosses(marker: Marker, scale: PrintScale) -> Array:
    """Centres of the crosses (4, 3) of a marker as printed, in the marker's frame (m)."""
    crosses: Array = marker.crosses * [*scale, 1.0]
    return crosses


def dusty(image: Image, size: Size, share: float, rng: np.random.Generator) -> Image:
    """The grey print (H, W) with specks of dust on `share` of its area; `size` in m.

    A larger share has the specks of a smaller one and more. More is drawn from `rng` than is used.
    """
    if share == 0:
        return image
    dirty, clean = image.astype(float), np.ones(image.shape)
    specks = _specks(rng, image.shape, image.shape[1] / size[0])
    covered, wanted = 0.0, share * image.size
    while covered < wanted:
        where, alpha, grey = next(specks)
        dirty[where] += alpha * (grey - dirty[where])
        fresh = alpha * clean[where]
        clean[where] -= fresh
        covered += float(fresh.sum())
    return np.asarray(np.rint(dirty), dtype=np.uint8)


def _specks(
    rng: np.random.Generator, shape: tuple[int, ...], texels: float
) -> Iterator[tuple[tuple[slice, slice], Array, float]]:
    """Where in the picture specks lie, how much of each texel there they cover, and their greys.

    Without end; `texels` in a metre. They are shaped many at a time, in windows of one size.
    """
    window = np.arange(int(2 * _reach(SPECK[1] / 2 * texels)) + 1)
    while True:
        draws = rng.random((_BATCH, 8))
        middles, radii = draws[:, :2] * shape - 0.5, _between(SPECK, draws[:, 2]) / 2 * texels
        bulges = _BULGES * draws[:, 3:5] * np.exp(2j * np.pi * draws[:, 5:7])
        greys = _between(GREYS, draws[:, 7])
        firsts = np.ceil(middles - _reach(radii)[:, None]).astype(int)
        ends = np.floor(middles + _reach(radii)[:, None]).astype(int) + 1
        y, x = np.moveaxis(firsts[:, :, None] + window - middles[:, :, None], 1, 0)
        alphas = _coverage(x[:, None, :] + 1j * y[:, :, None], radii, bulges)
        starts, stops = np.maximum(firsts, 0), np.minimum(ends, shape)
        boxes = np.stack([starts, stops, starts - firsts, stops - firsts], axis=1).tolist()
        for (start, stop, low, high), alpha, grey in zip(boxes, alphas, greys, strict=True):
            where = slice(start[0], stop[0]), slice(start[1], stop[1])
            yield where, alpha[low[0] : high[0], low[1] : high[1]], float(grey)


def _between(limits: tuple[float, float], share: Array) -> Array:
    return limits[0] + (limits[1] - limits[0]) * share


def _reach(radius: ArrayLike) -> Array:
    """How far from its middle a speck may cover texels at all."""
    return np.asarray((1 + 2 * _BULGES) * np.asarray(radius) + 0.5)


def _coverage(z: NDArray[np.complex128], radii: Array, bulges: NDArray[np.complex128]) -> Array:
    """Shares (N, H, W) of texels at z = x + iy from the middles of specks with radii (N,).

    The rim is the radius times 1 + a cos(2 angle + t) + b cos(3 angle + s); `bulges` (N, 2) are
    a exp(it) and b exp(is). All in texels.
    """
    distance = np.maximum(np.abs(z), 1e-12)
    turn = z / distance
    twice, thrice = bulges.T[:, :, None, None]
    rim = 1 + (turn**2 * (twice + thrice * turn)).real
    return np.asarray(np.clip(radii[:, None, None] * rim - distance + 0.5, 0, 1))
