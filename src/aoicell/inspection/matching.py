"""Where a component is against the reference, to a fraction of a pixel, and how well it matches.

Gauss-Newton on the grey values of its template (inverse compositional, Baker and Matthews 2004),
its edges over the board that is behind them: five numbers at once, the shift and the turn in the
board's plane, and a gain and an offset of its own, held near 1 and 0 by what light and lots do.
What is left over is weighed by the noise.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aoicell.board import Tolerance
from aoicell.inspection.layers import Layer
from aoicell.inspection.planes import Plane
from aoicell.inspection.sampling import sampled
from aoicell.inspection.templates import Template
from aoicell.transforms import Array

_FREEDOM = 2.0  # times its tolerance a part may be off, one sigma
_STILL_PX = 0.2  # after a step so small, another is not worth its time
_TURN_LIMIT = 0.1  # rad a step
_DISBELIEF = 4.0  # Cauchy: pixels off by two sigma count half,
_CREDIT = 400.0  # at first by twenty: an edge that is still off has to pull
_RIM_SHARE = 0.15  # of the slopes about a part, where it is not known what stays and what moves
_PRINT = 60.0  # grey values a pixel: print is no steeper
_PATIENCE, _HOPELESS = 1, 3.0  # after so many steps, half of all pixels off by so many sigma
APART_PX = 1.5  # farther from its place, a part has other surroundings
_WORST, _FEWEST_WORST = 0.05, 4  # share and number of the pixels that make a mark on a part
_GROSS = 5.0  # sigma: no pixel surprises more
_WHITE = 250.0  # grey values: from here on a sensor tells no more
_DARK = 5.0  # grey values: below that noise falls no more


@dataclass(frozen=True)
class NoiseConfig:
    """What makes good pictures of good parts differ, one sigma each.

    Grey noise is measured in each pair of pictures, and grows with the light as shot noise does.
    Beside that: an edge may lie `edge_px` off (resampling, outlines of parts of another lot), and a
    surface differ by `texture` of its brightness from the rest of its component, side walls by
    `wall`. What a part
    has laid bare that moved by a pixel is known to `bared` grey values; farther off, the board that
    blurs into edges of which nothing is drawn, to `background`. Of what is seen through a hollow
    part, a share `seen_through` stays behind. Between lots and lights, a component's brightness
    differs by `gain`, and by `offset` grey values and `gloss` of its brightest (its reflections).
    """

    edge_px: float = 0.12
    texture: float = 0.03
    wall: float = 0.3
    bared: float = 10.0
    background: float = 4.0
    seen_through: float = 0.4
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
class Play:
    """How far a component may be off where a match begins, one sigma: `shift` (m), `turn` (rad)."""

    shift: float
    turn: float


@dataclass(frozen=True)
class Match:
    """A component at a place, with the covariance (3, 3) of that (m, m, rad), and what is left over
    in each pixel of its template, in sigma (n,), by the `weights` (n,) of one over its variance,
    0 where none was asked.

    Of these, `rms` is over all that were asked, and `worst` the mean of the worst twentieth.
    `moved_px` is how far it is from its place in the picture, turn included; `settled` whether the
    search came to rest; `strain` how unusual gain and offset of its grey values are, in sigma;
    `seen` and `values` these (n,) there, over the ground of the reference, and in the reference.
    """

    place: Place
    covariance: Array
    z: Array
    weights: Array
    moved_px: float
    settled: bool
    strain: float
    rms: float
    worst: float
    seen: Array
    values: Array

    @property
    def asked(self) -> NDArray[np.bool_]:
        """The pixels (n,) that count."""
        return self.weights > 0

    @property
    def surprise(self) -> float:
        """Minus twice the logarithm of how likely what its pixels show is, a pixel."""
        squares = np.minimum(self.z[self.asked] ** 2, _GROSS**2)
        return float((squares - np.log(self.weights[self.asked])).mean())

    @property
    def correlation(self) -> float:
        """Of the grey values with the reference's."""
        a, b = self.seen - self.seen.mean(), self.values - self.values.mean()
        return float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b) + 1e-9))


class Matcher:
    """A template ready to be matched; made once for a reference."""

    def __init__(
        self, template: Template, layer: Layer, tolerance: Tolerance, config: NoiseConfig
    ) -> None:
        self.template, self._layer, self._config = template, layer, config
        t, edge = template, layer.edge
        self._turning = np.column_stack([-t.arms[:, 1], t.arms[:, 0]]) @ t.D.T
        static = ~t.inside & ~edge
        slopes = t.slopes * np.where(static, _RIM_SHARE, 1.0)[:, None]
        slopes[edge] = layer.slopes(layer.behind(t.uv[edge]))
        self._A = np.column_stack([*self._motion(slopes), t.values, np.ones(len(t.uv))])
        self._reach_px = float(np.sqrt((self._turning**2).sum(axis=1).mean()))
        steep = (t.slopes**2).sum(axis=1)
        self._edges = steep * config.edge_px**2
        self._white = np.flatnonzero(t.values > _WHITE)
        texture = np.where(t.wall, config.wall, config.texture)
        self._surface = (texture * t.values) ** 2 + t.spread**2
        self._unknown = np.where(t.core | edge, 0.0, config.background) ** 2
        self._unknown[static] = np.inf
        lag = np.where(static, 1.0, config.seen_through * t.hollow)
        self._lag = lag**2 * np.where(static, np.minimum(steep, _PRINT**2), steep)
        self._lag[edge] = (config.bared * (1 - layer.alphas)) ** 2
        # what the pixels do not tell, as the shift of a bar along itself, stays near the place
        offset = config.offset + config.gloss * float(np.percentile(t.values, 90))
        self._sigmas = np.array(
            [*(_FREEDOM * np.array([tolerance.shift, tolerance.shift, tolerance.rotation])),
             config.gain, offset]
        )  # fmt: skip

    def at(
        self, picture: Plane, place: Place, noise: float, steps: int = 5,
        ignored: NDArray[np.bool_] | None = None, moved: bool = False, play: Play | None = None,
    ) -> Match:  # fmt: skip
        """The match near a place, after so many `steps` at most; `noise`: variance a grey value.

        Template pixels that are `ignored` (n,) do not count, their z is 0. One that has `moved`
        from its place may be covered in part: what disagrees counts little in where it is.
        """
        t = self.template
        grey = self._surface + noise * (t.values + _DARK)
        if ignored is not None:
            grey[ignored] = np.inf
        sigmas = self._sigmas
        if play is not None:
            sigmas = np.array([play.shift, play.shift, play.turn, *sigmas[3:]])
        shift, turn = np.array(place.shift), place.rotation
        limit = 2 / t.px_per_m  # two pixels a step
        belief: Array | None = None
        for step in range(steps + 1):
            gone = self._gone(shift, turn)
            here = Place((float(shift[0]), float(shift[1])), turn)
            A, seen, values = self._expected(picture, here, gone > APART_PX)
            r = seen - values
            edges = self._edges
            if gone > APART_PX:  # resampled twice, and with other surroundings
                edges = 4 * edges + self._unknown
            plain = 1 / (grey + edges + self._lag * min(gone, APART_PX) ** 2)
            plain[self._white[seen[self._white] > _WHITE]] = 0
            weights = plain if belief is None else plain * belief
            inverse = np.linalg.inv((A * weights[:, None]).T @ A + np.diag(sigmas**-2))
            gone_by = shift - place.shift, turn - place.rotation
            back = np.array([*(_turned(turn).T @ gone_by[0]), gone_by[1], 0, 0]) / sigmas**2
            x = inverse @ (A.T @ (weights * r) - back)
            settled = self._gone(x[:2], x[2]) < _STILL_PX
            move = x[:2] * min(1.0, limit / (np.hypot(*x[:2]) + 1e-12))
            shift = shift + _turned(turn) @ move
            turn += float(np.clip(x[2], -_TURN_LIMIT, _TURN_LIMIT))
            if settled or step == steps:
                break
            if moved:  # what lies about it is not what lay about its place
                squares = (r - A @ x) ** 2 * plain
                if step >= _PATIENCE and float(np.median(squares)) > _HOPELESS**2:
                    break
                belief = 1 / (1 + squares / max(_DISBELIEF, _CREDIT / 4**step))
        z = (r - A @ x) * np.sqrt(plain)
        asked = plain > 0
        count = max(int(asked.sum()), 1)
        scale = max(float((z**2).sum() / count), 1.0)
        moved_px = self._gone(shift, turn)
        turn = float((turn + np.pi) % (2 * np.pi) - np.pi)
        strain = float(np.hypot(*(x[3:] / sigmas[3:])))
        return Match(
            Place((float(shift[0]), float(shift[1])), turn), inverse[:3, :3] * scale,
            z, plain, moved_px, settled, strain, *leftover(z[asked]), r + t.values, t.values,
        )  # fmt: skip

    @property
    def jacobian(self) -> Array:
        """How the grey values (n, 5) in its place change with shift, turn, gain and offset."""
        return self._A

    def apart_px(self, one: Place, other: Place) -> float:
        """How far (px) the component's pixels move from one place to the other."""
        return self._gone(np.subtract(one.shift, other.shift), one.rotation - other.rotation)

    def _gone(self, shift: Array, turn: float) -> float:
        """How far (px) the component's pixels move."""
        return float(np.hypot(*(self.template.D @ shift)) + abs(turn) * self._reach_px)

    def _expected(self, picture: Plane, place: Place, apart: bool) -> tuple[Array, Array, Array]:
        """The Jacobian (n, 5), what is seen of the component at a place, and what should be."""
        t, layer = self.template, self._layer
        if place == Place():
            at = t.uv.astype(int)
            return self._A, np.asarray(picture[at[:, 1], at[:, 0]], float), t.values
        uv = self._carried(place)
        seen = np.asarray(sampled(picture, uv[:, 0], uv[:, 1]), float)
        A, values, behind = self._A, t.values.copy(), layer.behind(uv[layer.edge])
        values[layer.edge] = layer.values(behind)
        if apart and len(behind):
            slopes = t.slopes.copy()
            slopes[layer.edge] = layer.slopes(behind)
            A = np.column_stack([*self._motion(slopes), values, np.ones(len(values))])
        return A, seen, values

    def _motion(self, slopes: Array) -> tuple[Array, Array]:
        """How grey values of such slopes (n, 2) change with shift (n, 2) and turn (n,)."""
        return -(slopes @ self.template.D), -(slopes * self._turning).sum(axis=1)

    def _carried(self, place: Place) -> NDArray[np.float32]:
        """Where (n, 2) the template's pixels go with it."""
        t = self.template
        arms = t.arms @ _turned(place.rotation).T + place.shift
        return np.asarray(t.uv + (arms - t.arms) @ t.D.T, np.float32)


def leftover(z: Array) -> tuple[float, float]:
    """What is left over in some pixels, in sigma: rms, and the mean of the worst; inf of none."""
    if not len(z):
        return np.inf, np.inf
    squares = z**2
    count = min(max(int(_WORST * len(z)), _FEWEST_WORST), len(z))
    worst = np.sqrt(np.partition(squares, -count)[-count:]).mean()
    return float(np.sqrt(squares.mean())), float(worst)


def _turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
