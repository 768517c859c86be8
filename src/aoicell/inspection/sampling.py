"""Grey values between the pixels, of just where they are asked for."""

import cv2
import numpy as np

from aoicell.inspection.planes import Plane

_STRIP = 1 << 15  # places at a time: what stays in the cache


def sampled(plane: Plane, columns: Plane, rows: Plane, beyond: float = 0.0) -> Plane:
    """Of a plane (H, W) at those places (px, of one shape), by a cubic kernel; `beyond` its edge
    that value.
    """
    at = (_asked(columns), _asked(rows))
    values = cv2.remap(
        plane, *at, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT, borderValue=(beyond,)
    )
    return np.asarray(values, np.float32).reshape(columns.shape)


def _asked(places: Plane) -> Plane:
    """What to ask OpenCV's kernel for in order to read these places.

    Its cubic kernel (Keys 1981 with a = -3/4 in place of -1/2) reads, at a fraction 1/2 + s of a
    pixel, a ramp at 1/2 + 3/4 s + s^3: up to 0.05 px off, and small motions half as large again.
    The real root of that cubic is sinh(asinh(4 s) / 3); here by a polynomial, to 0.002 px.
    """
    flat = np.ascontiguousarray(places, np.float32).reshape(-1)
    asked = np.empty_like(flat)
    for start in range(0, flat.size, _STRIP):
        strip = flat[start : start + _STRIP]
        s = strip - np.floor(strip)
        s -= _HALF
        square = s * s
        s *= (_LINEAR + _CUBIC * square) * (1 - 4 * square)
        np.add(strip, s, out=asked[start : start + _STRIP])
    return asked.reshape(places.shape if places.ndim > 1 else (-1, 1))


_HALF, _LINEAR, _CUBIC = np.float32(0.5), np.float32(0.30694), np.float32(-0.71601)
