"""From a component's match to what is said of it, and how sure that is."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from aoicell.board import Tolerance
from aoicell.inspection.findings import Finding, State
from aoicell.inspection.matching import Match, leftover
from aoicell.inspection.templates import Template
from aoicell.transforms import Array

_FORGIVEN_STRAIN = 2.0  # times, of what was found turned: light falls on other faces of it


@dataclass(frozen=True)
class VerdictConfig:
    """What a good part's misfit stays below, in sigma: over all its pixels (`rms`), over the worst
    twentieth of them (`worst`), and in its gain and offset (`strain`).

    `spread` is how much a part's misfit differs from picture to picture, relative (one sigma). A
    part that was found elsewhere correlates with the reference by `correlation`, its rim included;
    there, a share of its pixels is `forgiven`: it may be covered, and its corners show the board.
    A hollow part is `indulged` in its place. Where a place is told worse than to a share `vague` of
    the tolerance, what seems beyond that has to be so by `doubt` sigma: most parts are good.
    """

    rms: float = 1.57
    worst: float = 5.3
    strain: float = 3.3
    spread: float = 0.1
    correlation: float = 0.5
    forgiven: float = 0.15
    indulged: float = 0.015
    vague: float = 0.15
    doubt: float = 1.2


def misfit(match: Match, config: VerdictConfig, forgiven: float = 0.0) -> float:
    """How far a match is from what good parts show, relative to the limit: above 1, it is none.

    The worst pixels, a share `forgiven`, are left out.
    """
    rms, worst = match.rms, match.worst
    if forgiven and match.asked.any():
        asked = np.sort(np.abs(match.z[match.asked]))
        rms, worst = leftover(asked[: max(int((1 - forgiven) * len(asked)), 1)])
    strain = match.strain / (config.strain * (_FORGIVEN_STRAIN if forgiven else 1.0))
    return max(rms / config.rms, worst / config.worst, strain)


@dataclass(frozen=True)
class Located:
    """What a place means, how probable that is, and why; `elsewhere` where it is not allowed."""

    state: State
    probability: float
    reason: str

    @property
    def elsewhere(self) -> bool:
        """Whether it is beyond the tolerance."""
        return self.state != "present"


def located(
    shift: tuple[float, float], rotation: float, covariance: Array, tolerance: Tolerance,
    config: VerdictConfig,
) -> Located:  # fmt: skip
    """Whether a part that was measured there (m, rad), with this covariance (3, 3), is present,
    shifted or rotated.
    """
    moved = float(np.hypot(*shift))
    along = np.array(shift) / moved if moved > 0 else np.array([1.0, 0.0])
    sigma = float(np.sqrt(along @ covariance[:2, :2] @ along)) + 1e-9
    sigma_turn = float(np.sqrt(covariance[2, 2])) + 1e-9
    beyond = (moved - tolerance.shift) / sigma
    beyond_turn = (abs(rotation) - tolerance.rotation) / sigma_turn
    if tolerance.rotation >= np.pi:
        beyond_turn = -np.inf
    doubt = config.doubt * (sigma > config.vague * tolerance.shift)
    doubt_turn = config.doubt * (sigma_turn > config.vague * tolerance.rotation)
    within = float(ndtr(-beyond) * ndtr(-beyond_turn))
    off, turned = beyond > doubt, beyond_turn > doubt_turn
    if turned and not (off and moved / tolerance.shift >= abs(rotation) / tolerance.rotation):
        turn, most = np.degrees([rotation, tolerance.rotation])
        reason = f"turned by {turn:.1f} deg, {most:.1f} deg are accepted"
        return Located("rotated", 1 - within, reason)
    if off:
        reason = f"{moved * 1e3:.2f} mm off, {tolerance.shift * 1e3:.2f} mm are accepted"
        return Located("shifted", 1 - within, reason)
    return Located("present", within, "")


def placed(
    match: Match, template: Template, tolerance: Tolerance, view: str, config: VerdictConfig
) -> Finding:
    """A component that was found where `match` says: present, shifted or rotated.

    The confidence is the probability that it lies on this side of its tolerance, by the
    covariance of its place, and that it would fit again in another picture.
    """
    shift, rotation = match.place.shift, match.place.rotation
    verdict = located(shift, rotation, match.covariance, tolerance, config)
    times = max(misfit(match, config, config.forgiven if verdict.elsewhere else 0.0), 0.1)
    fit = float(ndtr((1 - times) / (config.spread * times)))
    return Finding(
        template.component.id, verdict.state, shift, rotation, fit * verdict.probability, view,
        template.box, template.visible, verdict.reason, match.covariance, fit,
    )  # fmt: skip


def reversed_part(match: Match, template: Template, view: str, confidence: float) -> Finding:
    """A component that lies in its place, but the other way round."""
    return Finding(
        template.component.id, "rotated", match.place.shift, np.pi, confidence, view,
        template.box, template.visible, "what tells its two ways round is on the other side",
    )  # fmt: skip


def lost(
    match: Match, template: Template, absent: bool, view: str, config: VerdictConfig
) -> Finding:
    """A component that was found nowhere: absent where its place is bare, else the wrong part."""
    times = misfit(match, config)
    state: State = "absent" if absent else "wrong_part"
    reason = "its place is bare" if absent else "what is in its place looks different"
    return Finding(
        template.component.id, state, confidence=float(ndtr((times - 1) / (config.spread * times))),
        view=view, area_px=template.box, visible=template.visible,
        reason=f"{reason}: {times:.1f} times the misfit that a good part may have",
    )  # fmt: skip
