"""One registered picture on the way to its findings.

Whatever was found elsewhere, or not at all, may cover its neighbours: those that do not fit are
asked once more without what is explained by others.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aoicell.inspection.disturbance import MARGIN_PX, Area, disturbed
from aoicell.inspection.findings import Finding, ViewInspection
from aoicell.inspection.foreign import Spot, foreign_objects
from aoicell.inspection.matching import Match, Place
from aoicell.inspection.registration import FineRegistration
from aoicell.inspection.seeking import LEAST_USED, MOVED_PX, Outcome, Seeker
from aoicell.inspection.standard import Standard, Tools, grey_noise
from aoicell.inspection.templates import Template
from aoicell.inspection.verdicts import lost, placed, reversed_part
from aoicell.observation import Image

_LEAST_OF_SMALL, _SMALL = 0.9, 200  # share of a template of so few pixels that has to be asked
_LIKELY = 0.5  # from this confidence on a part was put in the other way round


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
        self._seeker = Seeker(picture, self._outside, self._noise, standard)

    def inspection(self) -> ViewInspection:
        """The findings of the view."""
        standard = self._standard
        outcomes = self._seeker.outcomes()
        moved = {
            id: self._area(id, outcome)
            for id, outcome in outcomes.items()
            if not outcome.fits or outcome.match.moved_px > MOVED_PX
        }
        spots = self._spots([area for id, area in moved.items() if outcomes[id].fits])
        covered = standard.foreign.mask(spots, 2 * MARGIN_PX)
        for area in moved.values():
            covered[area.window] += area.mask
        doubtful = [id for id in moved if not self._seeker.good(id, outcomes[id])]
        for id in doubtful:
            area = moved[id]
            covered[area.window] -= area.mask  # by others
            outcomes[id] = self._reconsidered(id, outcomes[id], covered)
            covered[area.window] += area.mask
        theirs = np.zeros_like(covered)
        for id in doubtful:
            if outcomes[id].match.moved_px > MOVED_PX or not self._seeker.good(id, outcomes[id]):
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

    def _reconsidered(self, id: str, outcome: Outcome, covered: NDArray[np.uint8]) -> Outcome:
        """The component once more, without what others explain, if that covers part of it."""
        tools = self._standard.tools[id]
        ignored = tools.template.within(covered)
        ignored |= tools.template.within(self._outside)
        left = (~ignored).mean()
        if left == 1 or left < (LEAST_USED if ignored.size > _SMALL else _LEAST_OF_SMALL):
            return outcome
        match = tools.matcher.at(self._picture, Place(), self._noise, ignored=ignored)
        fits = self._seeker.fits(tools.template, match)
        better = self._seeker.allowed(tools.template, match) or not outcome.fits
        return Outcome(match, True) if fits and better else outcome

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
            ignored = tools.template.within(by_others)
            ignored |= tools.template.within(self._outside)
            match = tools.matcher.at(self._picture, Place(), self._noise, ignored=ignored)
            confidence = tools.half_turn.confidence(match)
        return confidence

    def _area(self, id: str, outcome: Outcome, thrown: bool = False) -> Area:
        """Where the picture differs because of a component."""
        place = outcome.match.place if outcome.fits else None
        return disturbed(self._standard.tools[id].template, place, self._standard, thrown)

    def _finding(
        self, tools: Tools, outcome: Outcome | None, covered: NDArray[np.uint8], own: Area | None
    ) -> Finding:
        standard, template = self._standard, tools.template
        if outcome is None:
            return unjudged(template, standard.view, "beyond the picture's edge")
        if self._seeker.good(template.component.id, outcome):
            confidence = self._turned(tools, outcome.match, covered, own)
            if confidence > _LIKELY:
                return reversed_part(outcome.match, template, standard.view, confidence)
        if outcome.fits:
            tolerance = standard.board.tolerance(template.component)
            finding = placed(
                outcome.match, template, tolerance, standard.view, standard.config.verdict
            )
            if finding.is_defect or self._seeker.fits(template, outcome.match):
                return finding
        absent = tools.absence(self._picture, standard.mean)
        return lost(outcome.match, template, absent, standard.view, standard.config.verdict)


def unjudged(template: Template, view: str, reason: str) -> Finding:
    """A component of which a picture tells nothing."""
    return Finding(
        template.component.id, "no_verdict", view=view, area_px=template.box,
        visible=template.visible, reason=reason,
    )  # fmt: skip
