"""How prints really turn out: their scale, the bow and twist of their plates, dust on them.

The scene is built from the functions below and so is the truth of the printed points.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from aoicell.observation import Image
from aoicell.sim.as_built import PrintScale
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.marker import Marker
from aoicell.transforms import Array

Size = tuple[float, float]

SPECK = (0.1e-3, 0.6e-3)  # diameters of specks of dust (m)
GREYS = (40, 150)  # of specks, seen on white and on black


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

    A larger share has the specks of a smaller one and more.
    """
    if share == 0:
        return image
    dirty, clean = image.astype(float), np.ones(image.shape)
    texels = image.shape[1] / size[0]  # in a metre
    covered, wanted = 0.0, share * image.size
    while covered < wanted:
        where, alpha = _speck(rng, image.shape, texels)
        dirty[where] += alpha * (rng.uniform(*GREYS) - dirty[where])
        covered += float((alpha * clean[where]).sum())
        clean[where] *= 1 - alpha
    return np.asarray(np.rint(dirty), dtype=np.uint8)


def _speck(
    rng: np.random.Generator, shape: tuple[int, ...], texels: float
) -> tuple[tuple[slice, slice], Array]:
    """Where in the picture a speck lies, and how much of each texel there it covers."""
    row, column = rng.uniform(-0.5, np.array(shape) - 0.5)
    radius = rng.uniform(*SPECK) / 2 * texels
    (bulge_2, bulge_3), (turn_2, turn_3) = rng.uniform(0, 0.3, 2), rng.uniform(0, 2 * np.pi, 2)
    reach = 1.6 * radius + 0.5
    rows, columns = (
        slice(max(math.ceil(middle - reach), 0), min(math.floor(middle + reach) + 1, end))
        for middle, end in zip((row, column), shape, strict=True)
    )
    y = np.arange(rows.start, rows.stop)[:, None] - row
    x = np.arange(columns.start, columns.stop) - column
    angle = np.arctan2(y, x)
    rim = 1 + bulge_2 * np.cos(2 * angle + turn_2) + bulge_3 * np.cos(3 * angle + turn_3)
    return (rows, columns), np.clip(radius * rim - np.hypot(x, y) + 0.5, 0, 1)
