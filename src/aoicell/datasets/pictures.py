"""Recorded pictures: whether a file is one, and reading it."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import UnidentifiedImageError

from aoicell.errors import TargetNotFound
from aoicell.observation import Image, to_grey

MIN_CONTRAST = 12  # grey values between the darkest and the brightest half percent

_BROKEN = (UnidentifiedImageError, OSError, ValueError, SyntaxError, Pillow.DecompressionBombError)


def picture_size(path: Path) -> tuple[int, int] | None:
    """Width and height (px) from the head of a picture's file; None where it is no picture."""
    try:
        with warnings.catch_warnings(), Pillow.open(path) as picture:
            warnings.simplefilter("ignore")
            return picture.size
    except _BROKEN:
        return None


def read_picture(path: Path) -> Image:
    """A picture, (H, W) grey or (H, W, 3) RGB.

    Raises TargetNotFound with the reason where it cannot be read or shows nothing: one view less,
    no reason to stop.
    """
    try:
        with warnings.catch_warnings(), Pillow.open(path) as picture:
            warnings.simplefilter("ignore")
            if picture.mode.startswith(("I", "F")):  # 16 bit and more
                image = _eight_bit(np.asarray(picture))
            else:
                image = np.array(picture.convert("L" if picture.mode in "1L" else "RGB"))
    except _BROKEN as error:
        reason = " ".join(str(error).split())
        raise TargetNotFound(f"{path}: the picture cannot be read ({reason})") from None
    grey = (image if image.ndim == 2 else to_grey(image))[::2, ::2]
    dark, bright = np.percentile(grey, [0.5, 99.5])
    if bright - dark < MIN_CONTRAST:
        raise TargetNotFound(
            f"{path}: the picture is blank (grey values {dark:.0f} to {bright:.0f}); nothing to see"
        )
    return image


def _eight_bit(values: NDArray[Any]) -> Image:
    """The upper eight of sixteen bits."""
    return np.clip(values / 256, 0, 255).astype(np.uint8)
