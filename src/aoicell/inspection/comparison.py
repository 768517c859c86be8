"""One registered picture on the way to its findings.

Each component is first matched at its place. What does not fit is looked for, near and turned.
Whatever was found elsewhere, or not at all, may cover its neighbours: those that do not fit are
asked once more without what is explained by others.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.disturbance import MARGIN_PX, Area, disturbed
from aoicell.inspection.findings import Finding, ViewInspection
from aoicell.inspection.foreign import Spot, foreign_objects
from aoicell.inspection.matching import APART_PX, Match, Place, Play
from aoicell.inspection.planes import Plane
from aoicell.inspection.registration import FineRegistration
from aoicell.inspection.standard import Standard, Tools, gain_of, grey_noise
from aoicell.inspection.templates import Template
from aoicell.inspection.verdicts import lost, misfit, placed, reversed_part
from aoicell.observation import Image

_LEAST_USED = 0.5  # share of a template that has to be asked,
_LEAST_OF_SMALL, _SMALL = 0.9, 200  # and of one of so few pixels
_MOVED_PX = 0.7  # less changes nothing about a part
_FAR_STEPS = 15
_EXCHANGES = 2  # of places between a part and what it is plugged into,
_PLAY = Play(0.15e-3, np.radians(0.1))  # in which it has so much play, one sigma:
_UNLIKELY = 0.3  # so much less of surprise a pixel is no proof of more
_LIKELY = 0.5  # from this confidence on a part was put in the other way round
_STIRRED_PX, _BESIDE_PX = 0.5, 2.3  # what has moved is looked for so far beside its place as well
_BETTER = 0.92  # times the misfit
_GOOD = 0.6  # a misfit, relative to its limit, that needs no rival
_ELSEWHERE = 1.4  # of a part that lies elsewhere, a misfit with all pixels stays below this
_ALIKE = 1.2  # times the misfit of the other way round
_NEAR_PX, _NEAR_TURN = 2.5, np.radians(15)  # the first match finds what is no farther off


@dataclass(frozen=True)
class _Outcome:
    """What became of a component: its best match, and whether that fits."""

    match: Match
    fits: bool


class Comparison:
    """The new picture of a view, in the reference's pixels, against the reference."""

    def __init__(self, new: Image, standard: Standard, registration: FineRegistration) -> None:
        self._standard, self._registration = standard, registration
        picture = standard.warp(new, registration)
        self._noise = grey_noise(picture, standard)
        self._outside = np.isnan(picture)
        if self._outside.any():
            picture[self._outside] = standard.mean[self._outside]
        self._picture = picture

    @cached_property
    def _evened(self) -> Plane:
        """The picture in the reference's light, as far as that differs all over."""
        return self._picture / np.float32(gain_of(self._picture, self._standard))

    def inspection(self) -> ViewInspection:
        """The findings of the view."""
        standard = self._standard
        outcomes = self._first()
        moved = {
            id: self._area(id, outcome)
            for id, outcome in outcomes.items()
            if not outcome.fits or outcome.match.moved_px > _MOVED_PX
        }
        spots = self._spots([area for id, area in moved.items() if outcomes[id].fits])
        covered = standard.foreign.mask(spots, 2 * MARGIN_PX)
        for area in moved.values():
            covered[area.window] += area.mask
        doubtful = [id for id in moved if not self._good(id, outcomes[id])]
        for id in doubtful:
            area = moved[id]
            covered[area.window] -= area.mask  # by others
            outcomes[id] = self._reconsidered(id, outcomes[id], covered)
            covered[area.window] += area.mask
        theirs = np.zeros_like(covered)
        for id in doubtful:
            if outcomes[id].match.moved_px > _MOVED_PX or not self._good(id, outcomes[id]):
                area = self._area(id, outcomes[id], thrown=True)
                theirs[area.window] |= area.mask
        spots = [spot for spot in spots if not spot.mostly_in(theirs)]
        findings = {
            id: self._finding(tools, outcomes.get(id), covered, moved.get(id))
            for id, tools in standard.tools.items()
        }
        foreign = foreign_objects(
            spots, standard.pattern.camera, standard.T_camera_board, standard.view
        )
        return ViewInspection(standard.view, self._registration, findings, foreign)

    def _spots(self, areas: Sequence[Area]) -> list[Spot]:
        """What lies on the bare board, but for what parts that moved explain."""
        explained = self._outside.copy()
        for area in areas:
            explained[area.window] |= area.mask > 0
        return self._standard.foreign.spots(self._picture, self._noise, explained)

    def _first(self) -> dict[str, _Outcome]:
        """Each component that the picture shows: matched at its place, else looked for."""
        outcomes = {}
        for id, tools in self._standard.tools.items():
            if self._ignored(tools.template, self._outside).mean() > 1 - _LEAST_USED:
                continue
            match = tools.matcher.at(self._picture, Place(), self._noise)
            if not self._fits(tools.template, match):
                outcomes[id] = self._sought(tools, match)
            elif match.moved_px > APART_PX:
                outcomes[id] = self._best(tools, match, [match.place], 0.0, fits=True)
            else:
                outcomes[id] = _Outcome(self._beside(tools, match), True)
        for id in list(outcomes):
            socket = self._standard.tools[id].template.component.on
            if socket in outcomes and not all(
                self._good(part, outcomes[part]) for part in (id, socket)
            ):
                for one, other in ((socket, id), (id, socket)) * _EXCHANGES:
                    outcomes[one] = self._likewise(one, outcomes[one], outcomes[other])
        return outcomes

    def _likewise(self, id: str, outcome: _Outcome, other: _Outcome) -> _Outcome:
        """A part as it was found, or where what it is plugged into, or holds, was found: they move
        together but for some play, and each tells what the other does not.
        """
        tools, there = self._standard.tools[id], other.match.place
        apart_px = tools.matcher.apart_px(there, outcome.match.place)
        if not other.fits or (outcome.fits and apart_px < _MOVED_PX):
            return outcome
        match = tools.matcher.at(
            self._picture, there, self._noise, _FAR_STEPS, moved=True, play=_PLAY
        )
        limits = self._standard.config.verdict
        forgiven = 0.0 if self._allowed(tools.template, match) else limits.forgiven
        if not match.settled or misfit(match, limits, forgiven) > 1:
            return outcome
        likely = match.surprise < outcome.match.surprise + _UNLIKELY
        return _Outcome(match, True) if likely or not outcome.fits else outcome

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
                if better and self._fits(tools.template, other):
                    best = other
        return best

    def _sought(self, tools: Tools, home: Match) -> _Outcome:
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
    ) -> _Outcome:  # fmt: skip
        config, best, least = self._standard.config.verdict, _Outcome(home, fits), np.inf
        for place in places:
            if self._taken(tools.template, place):
                continue
            match = tools.matcher.at(self._picture, place, self._noise, _FAR_STEPS, moved=True)
            if not match.settled:
                continue
            if forgiven and self._allowed(tools.template, match):
                continue  # what may be good has to fit without indulgence
            # far off, it has to look more like it than what is in its place
            likely = fits or match.correlation > max(
                config.correlation, home.correlation if forgiven else 0.0
            )
            times = misfit(match, config)
            if forgiven and self._away(tools.template, match) and times > _ELSEWHERE:
                continue
            if likely and times < least and misfit(match, config, forgiven) < 1:
                best, least = _Outcome(match, True), times
                if times < _GOOD:
                    break
        return self._unturned(tools, best, least)

    def _unturned(self, tools: Tools, found: _Outcome, times: float) -> _Outcome:
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
        good = self._allowed(tools.template, match)
        return _Outcome(match, True) if alike and not good else found

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

    def _reconsidered(self, id: str, outcome: _Outcome, covered: NDArray[np.uint8]) -> _Outcome:
        """The component once more, without what others explain, if that covers part of it."""
        tools = self._standard.tools[id]
        ignored = self._ignored(tools.template, covered)
        ignored |= self._ignored(tools.template, self._outside)
        left = (~ignored).mean()
        if left == 1 or left < (_LEAST_USED if ignored.size > _SMALL else _LEAST_OF_SMALL):
            return outcome
        match = tools.matcher.at(self._picture, Place(), self._noise, ignored=ignored)
        better = self._allowed(tools.template, match) or not outcome.fits
        return _Outcome(match, True) if better and self._fits(tools.template, match) else outcome

    def _turned(
        self, tools: Tools, match: Match, covered: NDArray[np.uint8], own: Area | None
    ) -> float:
        """How probable it is that what seems good was put in the other way round; what covers it
        in part is not asked.
        """
        if tools.half_turn is None:
            return 0.0
        confidence = tools.half_turn.confidence(match)
        if confidence > _LIKELY:
            by_others = covered.copy()
            if own is not None:
                by_others[own.window] -= own.mask
            ignored = self._ignored(tools.template, by_others)
            ignored |= self._ignored(tools.template, self._outside)
            match = tools.matcher.at(self._picture, Place(), self._noise, ignored=ignored)
            confidence = tools.half_turn.confidence(match)
        return confidence

    def _fits(self, template: Template, match: Match) -> bool:
        """Whether a match near its place is one, with indulgence for what shows its background."""
        config = self._standard.config.verdict
        return misfit(match, config, config.indulged if template.hollow else 0.0) < 1

    def _ignored(self, template: Template, mask: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of a template's pixels lie in a mask (H, W)."""
        at = template.uv.astype(int)
        return np.asarray(mask[at[:, 1], at[:, 0]] > 0)

    def _good(self, id: str, outcome: _Outcome) -> bool:
        return outcome.fits and self._allowed(self._standard.tools[id].template, outcome.match)

    def _allowed(self, template: Template, match: Match) -> bool:
        """Whether a component may be where it matches."""
        tolerance, place = self._standard.board.tolerance(template.component), match.place
        turned = abs(place.rotation) > tolerance.rotation
        return not turned and not self._away(template, match)

    def _away(self, template: Template, match: Match) -> bool:
        """Whether it lies farther off than it may."""
        tolerance = self._standard.board.tolerance(template.component)
        return bool(np.hypot(*match.place.shift) > tolerance.shift)

    def _area(self, id: str, outcome: _Outcome, thrown: bool = False) -> Area:
        """Where the picture differs because of a component."""
        place = outcome.match.place if outcome.fits else None
        return disturbed(self._standard.tools[id].template, place, self._standard, thrown)

    def _finding(
        self, tools: Tools, outcome: _Outcome | None, covered: NDArray[np.uint8], own: Area | None
    ) -> Finding:
        standard, template = self._standard, tools.template
        if outcome is None:
            return unjudged(template, standard.view, "beyond the picture's edge")
        if self._good(template.component.id, outcome):
            confidence = self._turned(tools, outcome.match, covered, own)
            if confidence > _LIKELY:
                return reversed_part(outcome.match, template, standard.view, confidence)
        if outcome.fits:
            tolerance = standard.board.tolerance(template.component)
            finding = placed(
                outcome.match, template, tolerance, standard.view, standard.config.verdict
            )
            if finding.is_defect or self._fits(template, outcome.match):
                return finding
        absent = tools.absence(self._picture, standard.mean)
        return lost(outcome.match, template, absent, standard.view, standard.config.verdict)


def unjudged(template: Template, view: str, reason: str) -> Finding:
    """A component of which a picture tells nothing."""
    return Finding(
        template.component.id, "no_verdict", view=view, area_px=template.box,
        visible=template.visible, reason=reason,
    )  # fmt: skip
