"""Figures and pictures as text that stands inside the page."""

import re
from base64 import b64encode
from io import BytesIO
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from aoicell.errors import InputError
from aoicell.report.style import RASTER_DPI, REPEATABLE

_INLINE: Any = {**REPEATABLE, "svg.fonttype": "none"}
WIDTH_PX, QUALITY = 800, 80  # of a picture: as wide as it is shown


def inline_svg(figure: Figure, name: str) -> Markup:
    """The figure as an SVG element whose ids no other figure of the page has.

    Text stays text: the page's font, selectable and small. Matplotlib has escaped it.
    """
    target = BytesIO()
    with rc_context(_INLINE):
        figure.savefig(
            target, format="svg", metadata={"Date": None}, dpi=RASTER_DPI, transparent=True
        )
    svg = target.getvalue().decode()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<style .*?</style>", "", svg, flags=re.DOTALL)  # it would hold for the page
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", svg)
    return Markup(re.sub(r'(<svg [^>]*?)width="[^"]*"|height="[^"]*pt"', r"\1", svg, count=2))


def embedded_picture(path: Path) -> tuple[str, int, int]:
    """A picture, made smaller, as a data URI (WebP); its own width and height in px.

    Raises InputError for a file that is no picture.
    """
    image = cv2.imread(str(path))
    if image is None:
        raise InputError(f"{path}: not a readable picture; run the scenario again")
    height, width = image.shape[:2]
    scale = min(1.0, WIDTH_PX / width)
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return data_uri(np.asarray(small, np.uint8)), width, height


def data_uri(image: NDArray[np.uint8], quality: int = QUALITY) -> str:
    """A picture (grey, or in OpenCV's order of colours) as a data URI (WebP)."""
    _, data = cv2.imencode(".webp", image, [cv2.IMWRITE_WEBP_QUALITY, quality])
    return f"data:image/webp;base64,{b64encode(data.tobytes()).decode()}"
