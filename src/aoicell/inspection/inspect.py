"""A board's pictures against their references: registered, compared, judged, part by part."""

from collections.abc import Mapping, Sequence

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import InputError, did_you_mean
from aoicell.inspection.comparison import Comparison, unjudged
from aoicell.inspection.findings import (
    BoardInspection,
    Finding,
    ForeignObject,
    Verdict,
    ViewInspection,
)
from aoicell.inspection.fusion import fused
from aoicell.inspection.references import Reference
from aoicell.inspection.registration import FineRegistration, register
from aoicell.inspection.standard import InspectionConfig, standard_of
from aoicell.observation import Image

STANDARD = InspectionConfig()
_SAME_PLACE = 2e-3  # m: spots of two views so near are one object


def inspect_board(
    views: Mapping[str, Image],
    references: Mapping[str, Reference],
    board: BoardDesign,
    config: InspectionConfig = STANDARD,
) -> BoardInspection:
    """The pictures (H, W) of a board by view, each against the reference of that name.

    Raises InputError for a picture without a reference.
    """
    inspections = []
    for view, image in views.items():
        if view not in references:
            hint = did_you_mean(view, references)
            raise InputError(f"view {view}: there is no reference of it; {hint}")
        inspections.append(inspect_view(image, references[view], board, config))
    return together(inspections, board, config)


def inspect_view(
    new: Image,
    reference: Reference,
    board: BoardDesign,
    config: InspectionConfig = STANDARD,
    camera: Camera | None = None,
) -> ViewInspection:
    """One picture (H, W) against its reference; `camera` took it, if not the reference's own.

    The reference is made ready at its first use.
    """
    standard = standard_of(reference, board, config)
    registration = register(new, standard.pattern, camera or reference.camera)
    if registration.state == "no_verdict":
        findings = {
            id: unjudged(tools.template, reference.view, registration.reason)
            for id, tools in standard.tools.items()
        }
        return ViewInspection(reference.view, registration, findings)
    return Comparison(new, standard, registration).inspection()


def register_2d(
    new: Image,
    reference: Reference,
    board: BoardDesign,
    config: InspectionConfig = STANDARD,
    camera: Camera | None = None,
) -> FineRegistration:
    """How the new picture (H, W) lies to the reference, and nothing more."""
    standard = standard_of(reference, board, config)
    return register(new, standard.pattern, camera or reference.camera)


def together(
    inspections: Sequence[ViewInspection], board: BoardDesign, config: InspectionConfig = STANDARD
) -> BoardInspection:
    """The views of one board as one: each component as the view has it that shows it best, where
    it is by all views.
    """
    components: dict[str, Finding] = {}
    for component in board.components:
        found = [i.findings[component.id] for i in inspections if component.id in i.findings]
        if found:
            components[component.id] = fused(found, board.tolerance(component), config.verdict)
    foreign = _distinct([spot for inspection in inspections for spot in inspection.foreign])
    states = {finding.state for finding in components.values()}
    verdict: Verdict = "pass"
    if foreign or states - {"present", "no_verdict"}:
        verdict = "fail"
    elif "no_verdict" in states or not components:
        verdict = "no_verdict"
    registrations = {i.view: i.registration for i in inspections}
    hidden = tuple(c.id for c in board.components if c.id not in components)
    return BoardInspection(verdict, components, foreign, registrations, hidden)


def _distinct(spots: Sequence[ForeignObject]) -> tuple[ForeignObject, ...]:
    """Each object once, as the view has it that is surest of it."""
    kept: list[ForeignObject] = []
    for spot in sorted(spots, key=lambda spot: -spot.confidence):
        x, y = spot.place
        near = (abs(x - k.place[0]) + abs(y - k.place[1]) < max(_SAME_PLACE, k.size) for k in kept)
        if not any(near):
            kept.append(spot)
    return tuple(kept)
