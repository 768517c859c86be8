"""A trial's board, with defects on it, and what the inspection of its pictures is worth.

The taught board is the golden sample: every part of it is at its place. The boards of the trials
carry planted defects and vary as good boards do; all methods get the same board.
"""

from collections.abc import Iterator, Mapping
from contextlib import closing

import numpy as np

from aoicell.benchmark.records import InspectionRecord, PartRecord, RegistrationRecord
from aoicell.board import BoardDesign, Component
from aoicell.inspection import (
    BoardInspection,
    Finding,
    FineRegistration,
    Reference,
    inspect_board,
)
from aoicell.inspection.virtual_picture import drawing, virtual_picture
from aoicell.observation import Cell, Image, Observation, capture_at
from aoicell.online import Online, Ts_camera_board
from aoicell.pipeline import TaughtPictures
from aoicell.registration import component_points
from aoicell.relief import Relief
from aoicell.scenario import Scenario
from aoicell.sim.board_room import hidden_share
from aoicell.sim.board_turns import looks_alike
from aoicell.sim.defects import DEFECT_KINDS, MOST_HIDDEN, Defect, draw_defects, moved
from aoicell.sim.drawing import stream
from aoicell.sim.population import Population, draw_scatter, populated
from aoicell.sim.twin import NominalTwin
from aoicell.sim.world import World

NEAR = 2e-3  # m; what is reported so near to a planted defect is reported because of it
GOLDEN = 1_000_000  # trial numbers of further golden samples: none that a trial can have


def draw_population(scenario: Scenario, world: World, trial: int) -> Population:
    """The board of a trial: its defects and its benign variation."""
    chosen, board, index = scenario.inspection, world.nominal.board, world.as_built.world
    rng = stream(scenario.seed, index, trial, "defects")
    kinds = [kind for kind in DEFECT_KINDS if kind in chosen.kinds]
    defects = draw_defects(board, rng, chosen.defects, kinds)
    return populated(board, defects, draw_scatter(board, scenario.seed, index, trial))


def golden_pictures(
    scenario: Scenario, world: World, cell: Cell, taught: TaughtPictures
) -> dict[str, tuple[Image, ...]]:
    """Pictures of further golden samples from the taught views, by view.

    They are good boards beside the taught one, laid where that lay.
    """
    board, index = world.nominal.board, world.as_built.world
    pictures: dict[str, tuple[Image, ...]] = {}
    for number in range(1, scenario.inspection.golden_samples):
        scatter = draw_scatter(board, scenario.seed, index, GOLDEN - number)
        world.populate(populated(board, (), scatter))
        for view in taught.views:
            [picture] = capture_at(cell, [view.standard.state.q])
            pictures[view.id] = (*pictures.get(view.id, ()), picture.grey)
    world.populate(None)
    return pictures


def make_references(
    online: Online, samples: Mapping[str, tuple[Image, ...]], virtual: bool = False
) -> dict[str, Reference]:
    """What each taught view should look like: its golden samples, or a virtual image.

    `samples` are pictures of further golden samples by view. In either case the design is drawn
    beside: the shapes of the components, and the bare board that a missing one uncovers.
    """
    nominal, camera, references = online.nominal, online.calibration.hand.camera, {}
    Ts = Ts_camera_board(online)
    with closing(NominalTwin(nominal)) as twin:
        for view in online.template.views:
            id, T_camera_board = view.id, Ts[view.id]
            T_base_camera = online.calibration.T_base_camera(view.standard.state)
            seen = twin, nominal.cameras["hand"], camera, T_base_camera, T_camera_board
            taken = (view.standard.grey, *samples.get(id, ()))
            images = (virtual_picture(*seen),) if virtual else taken
            references[id] = Reference(id, images, T_camera_board, camera, virtual, drawing(*seen))
    return references


def inspect_trial(
    images: Mapping[str, Observation],
    references: Mapping[str, Reference],
    population: Population,
    world: World,
    standards: Mapping[str, Observation],
) -> InspectionRecord:
    """Inspect the pictures of a trial, and compare with what is true of its board."""
    board = population.design
    inspection = inspect_board({id: o.grey for id, o in images.items()}, references, board)
    return score_inspection(inspection, images, population, world, standards)


def score_inspection(
    inspection: BoardInspection,
    images: Mapping[str, Observation],
    population: Population,
    world: World,
    standards: Mapping[str, Observation],
) -> InspectionRecord:
    """Compare an inspection with what is true of the board.

    About all components but those that others lie on: no view can show them. Where the views
    show nothing of another, there is no verdict on it, and a defect of it is not found.
    """
    board = population.design
    seen = [c for c in board.components if hidden_share(board, c) <= MOST_HIDDEN]
    findings = {c.id: inspection.components.get(c.id, Finding(c.id, "no_verdict")) for c in seen}
    return InspectionRecord(
        verdict=inspection.verdict,
        good_components=sum(_is_good(c, population) for c in seen),
        no_verdict=sum(finding.state == "no_verdict" for finding in findings.values()),
        unseen=len(board.components) - len(seen),
        parts=list(_parts(findings, inspection, population)),
        registrations=[
            RegistrationRecord(
                view, r.state, r.rms_px if np.isfinite(r.rms_px) else None,
                _registration_error(r, world, standards[view], images[view]),
            )
            for view, r in inspection.registrations.items()
        ],
    )  # fmt: skip


def _parts(
    findings: Mapping[str, Finding], inspection: BoardInspection, population: Population
) -> Iterator[PartRecord]:
    """Every planted defect of a part that the views show, and every false call."""
    board, planted = population.design, {d.component: d for d in population.defects}
    for id, finding in findings.items():
        if id in planted or finding.is_defect:
            yield _part(board.component(id), planted.get(id), finding, board)
    for defect in population.defects:
        if defect.part is not None and defect.kind == "foreign_object":
            yield _foreign(defect, inspection)
    for index, found in enumerate(inspection.foreign):
        if not _explained(found.place, population):
            yield PartRecord(
                component=f"foreign {index + 1}", kind="foreign_object", planted="",
                tolerated=False, width_mm=found.size * 1e3, depth_mm=found.size * 1e3,
                shift_mm=0.0, rotation_deg=0.0, state="foreign_object", called=True,
                confidence=found.confidence, shift_error_mm=None, view=found.view,
                box_px=[float(v) for v in found.area_px],
            )  # fmt: skip


def _part(
    component: Component, defect: Defect | None, finding: Finding, board: BoardDesign
) -> PartRecord:
    measured = finding.state in ("present", "shifted", "rotated")
    error = None
    if defect is not None and defect.kind == "shifted" and measured:
        error = float(np.hypot(*np.subtract(finding.shift, defect.shift))) * 1e3
    return PartRecord(
        component=component.id, kind=component.kind,
        planted="" if defect is None else defect.kind,
        tolerated=defect is not None and is_tolerated(defect, component, board),
        width_mm=component.width * 1e3, depth_mm=component.depth * 1e3,
        shift_mm=0.0 if defect is None else float(np.hypot(*defect.shift)) * 1e3,
        rotation_deg=0.0 if defect is None else float(np.degrees(defect.rotation)),
        state=finding.state, called=finding.is_defect, confidence=finding.confidence,
        shift_error_mm=error, view=finding.view, box_px=[float(v) for v in finding.area_px],
        reason=finding.reason,
    )  # fmt: skip


def is_tolerated(defect: Defect, component: Component, board: BoardDesign) -> bool:
    """Whether the component's tolerance class allows what was planted."""
    if defect.kind not in ("shifted", "rotated"):
        return False
    allowed = board.tolerance(component)
    ways = looks_alike(component)
    turn = (defect.rotation + np.pi / ways) % (2 * np.pi / ways) - np.pi / ways
    return bool(np.hypot(*defect.shift) <= allowed.shift and abs(turn) <= allowed.rotation)


def _foreign(defect: Defect, inspection: BoardInspection) -> PartRecord:
    """A planted foreign object, and whether something was reported at its place."""
    part = defect.part
    assert part is not None
    lying = moved(part, defect.shift, defect.rotation)
    found = next((f for f in inspection.foreign if _near(f.place, lying)), None)
    return PartRecord(
        component=defect.component, kind="foreign_object", planted=defect.kind, tolerated=False,
        width_mm=part.width * 1e3, depth_mm=part.depth * 1e3,
        shift_mm=float(np.hypot(*defect.shift)) * 1e3,
        rotation_deg=float(np.degrees(defect.rotation)),
        state="foreign_object" if found else "", called=found is not None,
        confidence=found.confidence if found else None, shift_error_mm=None,
        view=found.view if found else "",
        box_px=[float(v) for v in found.area_px] if found else None, reason=defect.detail,
    )  # fmt: skip


def _explained(place: tuple[float, float], population: Population) -> bool:
    """Whether a planted defect left something, or a bare place, there."""
    wrong = {defect.component for defect in population.defects}
    boards = (population.board, population.design)
    return any(_near(place, c) for board in boards for c in board.components if c.id in wrong)


def _near(place: tuple[float, float], component: Component) -> bool:
    """Whether a point of the board lies on a component, or as near as its shadow does."""
    dx, dy = place[0] - component.x, place[1] - component.y
    c, s = np.cos(component.rotation), np.sin(component.rotation)
    reach = NEAR + component.height
    return bool(
        abs(c * dx + s * dy) <= component.width / 2 + reach
        and abs(c * dy - s * dx) <= component.depth / 2 + reach
    )


def _is_good(component: Component, population: Population) -> bool:
    defect = next((d for d in population.defects if d.component == component.id), None)
    return defect is None or is_tolerated(defect, component, population.design)


def _registration_error(
    registration: FineRegistration, world: World, standard: Observation, new: Observation
) -> float | None:
    """How far (px, rms) a point of the reference is off where the registration has it in the new
    picture, over the components' tops in view.
    """
    before, after = world.truth_of(standard).T_camera_board, world.truth_of(new).T_camera_board
    camera = world.camera("hand")
    points = component_points(world.nominal.board, camera, before)
    # what the reference's pixels show, by its own account
    relief = Relief(np.zeros((0, 0)), registration.camera, registration.T_camera_reference)
    eye, rays = relief.rays(camera.project(points, before))
    places = eye + ((points[:, 2] - eye[2]) / rays[:, 2])[:, None] * rays
    off = registration.project(places) - camera.project(points, after)
    return float(np.sqrt((off**2).sum(axis=1).mean())) if np.isfinite(off).all() else None
