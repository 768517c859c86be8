"""Where each component of a registered picture is: at its place, elsewhere, or nowhere.

Each is first matched at its place. What does not fit is looked for, near and turned. What is
plugged into another part moves with it: each is tried where the other was found.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.matching import APART_PX, Match, Place, Play
from aoicell.inspection.planes import Plane
from aoicell.inspection.standard import Standard, Tools, gain_of
from aoicell.inspection.templates import Template
from aoicell.inspection.verdicts import misfit

MOVED_PX = 0.7  # less changes nothing about a part
LEAST_USED = 0.5  # share of a template that has to be asked
_FAR_STEPS = 15
_STIRRED_PX, _BESIDE_PX = 0.5, 2.3  # what has moved is looked for so far beside its place as well
_BETTER = 0.92  # times the misfit
_GOOD = 0.6  # a misfit, relative to its limit, that needs no rival
_ELSEWHERE = 1.4  # of a part that lies elsewhere, a misfit with all pixels stays below this
_ALIKE = 1.2  # times the misfit of the other way round
_NEAR_PX, _NEAR_TURN = 2.5, np.radians(15)  # the first match finds what is no farther off
_EXCHANGES = 2  # of places between a part and what it is plugged into,
_PLAY = Play(0.15e-3, np.radians(0.1))  # in which it has so much play, one sigma:
_UNLIKELY = 0.3  # so much less of surprise a pixel is no proof of more


@dataclass(frozen=True)
class Outcome:
    """What became of a component: its best match, and whether that fits."""

    match: Match
    fits: bool


class Seeker:
    """Looks for components in a picture (H, W) in the reference's pixels; it shows nothing of them
    `outside` (H, W). `noise`: variance a grey value.
    """

    def __init__(
        self, picture: Plane, outside: NDArray[np.bool_], noise: float, standard: Standard
    ) -> None:
        self._picture, self._outside = picture, outside
        self._noise, self._standard = noise, standard

    def outcomes(self) -> dict[str, Outcome]:
        """What became of each component that the picture shows."""
        outcomes = {}
        for id, tools in self._standard.tools.items():
            if tools.template.within(self._outside).mean() > 1 - LEAST_USED:
                continue
            match = tools.matcher.at(self._picture, Place(), self._noise)
            if not self.fits(tools.template, match):
                outcomes[id] = self._sought(tools, match)
            elif match.moved_px > APART_PX:
                outcomes[id] = self._best(tools, match, [match.place], 0.0, fits=True)
            else:
                outcomes[id] = Outcome(self._beside(tools, match), True)
        for id in list(outcomes):
            socket = self._standard.tools[id].template.component.on
            if socket in outcomes:
                self._compare_notes(outcomes, id, socket)
        return outcomes

    def _compare_notes(self, outcomes: dict[str, Outcome], part: str, socket: str) -> None:
        """Tries a part and what it is plugged into at each other's place, if one is in doubt."""
        if all(self.good(id, outcomes[id]) for id in (part, socket)):
            return
        for one, other in ((socket, part), (part, socket)) * _EXCHANGES:
            outcomes[one] = self._likewise(one, outcomes[one], outcomes[other])

    def _likewise(self, id: str, outcome: Outcome, other: Outcome) -> Outcome:
        """A part as it was found, or where what it is plugged into, or holds, was found: they move
        together but for some play, and each tells what the other does not.
        """
        tools, there = self._standard.tools[id], other.match.place
        apart_px = tools.matcher.apart_px(there, outcome.match.place)
        if not other.fits or (outcome.fits and apart_px < MOVED_PX):
            return outcome
        match = tools.matcher.at(
            self._picture, there, self._noise, _FAR_STEPS, moved=True, play=_PLAY
        )
        limits = self._standard.config.verdict
        forgiven = 0.0 if self.allowed(tools.template, match) else limits.forgiven
        if not match.settled or misfit(match, limits, forgiven) > 1:
            return outcome
        likely = match.surprise < outcome.match.surprise + _UNLIKELY
        return Outcome(match, True) if likely or not outcome.fits else outcome

    def _beside(self, tools: Tools, match: Match) -> Match:
        """The match, or a clearly better one some pixels beside it: where only the outline tells,
        and print lies along it, places near the best one look good as well.
        """
        if match.moved_px < _STIRRED_PX or not tools.template.plain:
            return match
        px = 1 / tools.template.px_per_m
        best = match
        for x, y in _BESIDE_PX * px * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]):
            shift = (match.place.shift[0] + x, match.place.shift[1] + y)
            place = Place(shift, match.place.rotation)
            if tools.matcher.at(self._picture, place, self._noise, 0).rms < _BETTER * best.rms:
                other = tools.matcher.at(self._picture, place, self._noise)
                better = other.settled and other.rms < _BETTER * best.rms
                if better and self.fits(tools.template, other):
                    best = other
        return best

    def _sought(self, tools: Tools, home: Match) -> Outcome:
        """A component that does not fit in its place: the best match elsewhere, or turned.

        First where it may be, then as far as a search reaches; where its place is bare, it does not
        lie there.
        """
        config, picture = self._standard.config, self._evened
        tolerance = self._standard.board.tolerance(tools.template.component)
        scale = tools.template.px_per_m
        if tolerance.shift * scale > _NEAR_PX or tolerance.rotation > _NEAR_TURN:
            allowed = tools.search.places(picture, tolerance.shift, tolerance.rotation)
            best = self._best(tools, home, allowed, 0.0)
            if best.fits:
                return best
        part = tools.template.component
        bare = tools.absence(self._picture, self._standard.mean)
        least = min(part.width, part.depth) / 2 if bare else 0.0
        anywhere = tools.search.places(picture, config.search.reach, least=least)
        return self._best(tools, home, anywhere, config.verdict.forgiven)

    def _best(
        self, tools: Tools, home: Match, places: Sequence[Place], forgiven: float,
        fits: bool = False,
    ) -> Outcome:  # fmt: skip
        config, best, least = self._standard.config.verdict, Outcome(home, fits), np.inf
        for place in places:
            if self._taken(tools.template, place):
                continue
            match = tools.matcher.at(self._picture, place, self._noise, _FAR_STEPS, moved=True)
            if not match.settled:
                continue
            if forgiven and self.allowed(tools.template, match):
                continue  # what may be good has to fit without indulgence
            # far off, it has to look more like it than what is in its place
            likely = fits or match.correlation > max(
                config.correlation, home.correlation if forgiven else 0.0
            )
            times = misfit(match, config)
            if forgiven and self._away(tools.template, match) and times > _ELSEWHERE:
                continue
            if likely and times < least and misfit(match, config, forgiven) < 1:
                best, least = Outcome(match, True), times
                if times < _GOOD:
                    break
        return self._unturned(tools, best, least)

    def _unturned(self, tools: Tools, found: Outcome, times: float) -> Outcome:
        """What looks alike after a half turn is taken for what has not made it.

        But never for good: its own place was tried first, and did not fit.
        """
        place = found.match.place
        if abs(place.rotation) < np.pi / 2 or not np.isfinite(times):
            return found
        back = Place(place.shift, place.rotation - float(np.copysign(np.pi, place.rotation)))
        match = tools.matcher.at(self._picture, back, self._noise, _FAR_STEPS, moved=True)
        limit = min(_ALIKE * times, 1.0)
        alike = match.settled and misfit(match, self._standard.config.verdict) < limit
        good = self.allowed(tools.template, match)
        return Outcome(match, True) if alike and not good else found

    def _taken(self, template: Template, place: Place) -> bool:
        """Whether another component belongs where this one would lie."""
        u, v = np.rint(template.centre_px + template.D @ place.shift).astype(int)
        numbers = self._standard.shown.numbers
        if not (0 <= v < numbers.shape[0] and 0 <= u < numbers.shape[1]):
            return True
        number = int(numbers[v, u])
        if number < 0:
            return False
        other = self._standard.board.components[number]
        return other.id not in (template.component.id, template.component.on) and (
            other.on != template.component.id
        )

    @cached_property
    def _evened(self) -> Plane:
        """The picture in the reference's light, as far as that differs all over."""
        return self._picture / np.float32(gain_of(self._picture, self._standard))

    def fits(self, template: Template, match: Match) -> bool:
        """Whether a match near its place is one, with indulgence for what shows its background."""
        config = self._standard.config.verdict
        return misfit(match, config, config.indulged if template.hollow else 0.0) < 1

    def good(self, id: str, outcome: Outcome) -> bool:
        """Whether it was found where it may be."""
        return outcome.fits and self.allowed(self._standard.tools[id].template, outcome.match)

    def allowed(self, template: Template, match: Match) -> bool:
        """Whether a component may be where it matches."""
        tolerance, place = self._standard.board.tolerance(template.component), match.place
        turned = abs(place.rotation) > tolerance.rotation
        return not turned and not self._away(template, match)

    def _away(self, template: Template, match: Match) -> bool:
        """Whether it lies farther off than it may."""
        tolerance = self._standard.board.tolerance(template.component)
        return bool(np.hypot(*match.place.shift) > tolerance.shift)
