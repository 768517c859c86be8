"""Where a component is against the reference, to a fraction of a pixel, and how well it matches.

Gauss-Newton on the grey values of its template (inverse compositional, Baker and Matthews 2004):
five numbers at once, the shift and the turn in the board's plane, and a gain and an offset of its
own, held near 1 and 0 by what light and lots do. What is left over is weighed by the noise.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import Tolerance
from aoicell.inspection.templates import Template
from aoicell.transforms import Array

Plane = NDArray[np.float32]
_FREEDOM = 2.0  # times its tolerance a part may be off, one sigma
_STILL_PX = 0.06  # a step so small is exact enough without another
_TURN_LIMIT = 0.1  # rad a step
_DISBELIEF = 4.0  # Cauchy: pixels off by two sigma count half,
_CREDIT = 400.0  # at first by twenty: an edge that is still off has to pull
_PRINT = 60.0  # grey values a pixel: print is no steeper
_PATIENCE, _HOPELESS = 3, 3.0  # after so many steps, half of the pixels off by so many sigma
APART_PX = 1.5  # farther from its place, a part has other surroundings
_WHITE = 250.0  # grey values: from here on a sensor tells no more
_DARK = 5.0  # grey values: below that noise falls no more


@dataclass(frozen=True)
class NoiseConfig:
    """What makes good pictures of good parts differ, one sigma each.

    Grey noise is measured in each pair of pictures, and grows with the light as shot noise does.
    Beside that: an edge may lie `edge_px` off (resampling, outlines of parts of another lot), and a
    surface differ by `texture` of its brightness from the rest of its component. Where a part has
    moved, the print about it stays behind, and what is seen through a hollow part by the
    share `seen_through`; farther off, the board that blurs into its edges is unknown to
    `background` grey values. Of the slopes on the rim about a part, most belong to pads and print,
    which stay: `rim_share` moves along. Between lots and lights, a component's brightness differs
    by `gain`, and by `offset` grey values and `gloss` of its brightest (its reflections).
    """

    edge_px: float = 0.12
    texture: float = 0.03
    background: float = 4.0
    seen_through: float = 0.4
    rim_share: float = 0.15
    gain: float = 0.08
    offset: float = 3.0
    gloss: float = 0.04


@dataclass(frozen=True)
class Place:
    """Where a component is against its place: `shift` (x, y; m) and `rotation` (rad) in the
    board's plane, about the middle of its upper side.
    """

    shift: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0


@dataclass(frozen=True)
class Match:
    """A component at a place, with the covariance (3, 3) of that (m, m, rad), the gain and offset
    of its grey values, and what is left over in each pixel of its template, in sigma (n,), 0 where
    none was `asked`.

    `moved_px` is how far it is from its place in the picture, turn included; `settled` whether the
    search came to rest; `strain` how unusual gain and offset are, in sigma; `used` the share of
    its pixels that were asked; `correlation` that of the grey values with the reference's.
    """

    place: Place
    covariance: Array
    gain: float
    offset: float
    z: Array
    asked: NDArray[np.bool_]
    moved_px: float
    settled: bool
    strain: float
    used: float
    correlation: float


class Matcher:
    """A template ready to be matched; made once for a reference."""

    def __init__(self, template: Template, tolerance: Tolerance, config: NoiseConfig) -> None:
        self.template, self._config = template, config
        t = template
        self._arms = (t.uv - t.centre_px) @ np.linalg.inv(t.D).T  # in the board's plane (m)
        turning = np.column_stack([-self._arms[:, 1], self._arms[:, 0]]) @ t.D.T
        slopes = t.slopes * np.where(t.inside, 1.0, config.rim_share)[:, None]
        self._A = np.column_stack(
            [-(slopes @ t.D), -(slopes * turning).sum(axis=1), t.values, np.ones(len(t.uv))]
        )
        self._reach_px = float(np.sqrt((turning**2).sum(axis=1).mean()))
        self._steep = (t.slopes**2).sum(axis=1)
        self._surface = (config.texture * t.values) ** 2 + t.spread**2
        self._unknown = np.where(t.core, 0.0, config.background) ** 2
        self._through = config.seen_through if t.hollow else 0.0
        # what the pixels do not tell, as the shift of a bar along itself, stays near the place
        offset = config.offset + config.gloss * float(np.percentile(t.values, 90))
        self._sigmas = np.array(
            [*(_FREEDOM * np.array([tolerance.shift, tolerance.shift, tolerance.rotation])),
             config.gain, offset]
        )  # fmt: skip

    def at(
        self, picture: Plane, place: Place, noise: float, steps: int = 6,
        ignored: NDArray[np.bool_] | None = None, moved: bool = False,
    ) -> Match:  # fmt: skip
        """The match near a place, after so many `steps` at most; `noise`: variance a grey value.

        Template pixels that are `ignored` (n,) do not count, their z is 0. One that has `moved`
        from its place may be covered in part: what disagrees counts little in where it is, and
        what is around it has no say in whether it is the one.
        """
        t, A = self.template, self._A
        counted = np.ones(len(t.uv), bool) if ignored is None else ~ignored
        grey = self._surface + noise * (t.values + _DARK)
        shift, turn = np.array(place.shift), place.rotation
        limit = 2 / np.sqrt(abs(np.linalg.det(t.D)))  # two pixels a step
        belief = np.ones(len(t.uv))
        for step in range(steps + 1):
            gone = np.hypot(*(t.D @ shift)) + abs(turn) * self._reach_px
            apart = moved and gone > APART_PX
            lag = np.where(t.inside, self._through, 0.0 if apart else 1.0) * min(gone, APART_PX)
            steep = np.where(t.inside, self._steep, np.minimum(self._steep, _PRINT**2))
            edge_px = self._config.edge_px * (2 if apart else 1)  # resampled twice
            edges = self._steep * edge_px**2 + steep * lag**2
            plain = counted / (grey + edges + (self._unknown if apart else 0.0))
            if apart:
                plain[~t.inside] = 0
            seen = self.sampled(picture, Place((shift[0], shift[1]), turn))
            r = seen - t.values
            dazzled = np.minimum(seen, t.values) > _WHITE
            plain[dazzled] = 0
            weights = plain * belief
            inverse = np.linalg.inv((A * weights[:, None]).T @ A + np.diag(self._sigmas**-2))
            gone_by = shift - place.shift, turn - place.rotation
            back = np.array([*(_turned(turn).T @ gone_by[0]), gone_by[1], 0, 0]) / self._sigmas**2
            x = inverse @ (A.T @ (weights * r) - back)
            step_px = float(np.hypot(*(t.D @ x[:2])) + abs(x[2]) * self._reach_px)
            settled = step_px < _STILL_PX
            move = x[:2] * min(1.0, limit / (np.hypot(*x[:2]) + 1e-12))
            shift = shift + _turned(turn) @ move
            turn += float(np.clip(x[2], -_TURN_LIMIT, _TURN_LIMIT))
            z = (r - A @ x) * np.sqrt(plain)
            hopeless = moved and step >= _PATIENCE and float(np.median(np.abs(z))) > _HOPELESS
            if settled or hopeless or step == steps:
                break
            if moved:  # what lies about it is not what lay about its place
                belief = 1 / (1 + z**2 / max(_DISBELIEF, _CREDIT / 4**step))
        asked = plain > 0
        count = max(int(asked.sum()), 1)
        scale = max(float((z**2).sum() / count), 1.0)
        turn = float((turn + np.pi) % (2 * np.pi) - np.pi)
        strain = float(np.hypot(*(x[3:] / self._sigmas[3:])))
        moved_px = float(np.hypot(*(t.D @ shift)) + abs(turn) * self._reach_px)
        return Match(
            Place((float(shift[0]), float(shift[1])), turn), inverse[:3, :3] * scale,
            1 + float(x[3]), float(x[4]), z, asked, moved_px, settled, strain, count / len(z),
            _correlation(r + t.values, t.values),
        )  # fmt: skip

    def sampled(self, picture: Plane, place: Place) -> Array:
        """Grey values (n,) of a picture where the template's pixels are with it at a place."""
        t = self.template
        if place == Place():
            at = t.uv.astype(int)
            return np.asarray(picture[at[:, 1], at[:, 0]], float)
        uv = self._arms @ _turned(place.rotation).T + place.shift
        at = (uv @ t.D.T + t.centre_px).astype(np.float32)
        return np.asarray(cv2.remap(picture, at[:, :1], at[:, 1:], cv2.INTER_CUBIC)[:, 0], float)


def _correlation(a: Array, b: Array) -> float:
    a, b = a - a.mean(), b - b.mean()
    return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b) + 1e-9))


def _turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
