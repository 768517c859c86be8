"""A board's record: what the station made of it, beside the truth.

What lies as near to the limit of its tolerance as nobody can measure is right either way, as in
ISO 14253-1: neither verdict on it counts as wrong.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from aoicell.benchmark.inspection_trial import score_inspection
from aoicell.benchmark.line.conveyor import Conveyor, SetUp
from aoicell.benchmark.line.records import BoardRecord
from aoicell.benchmark.records import InspectionRecord, PartRecord
from aoicell.benchmark.scoring import residual_record
from aoicell.board import BoardDesign
from aoicell.inspection import BoardInspection
from aoicell.line.station import Inspected
from aoicell.observation import Observation
from aoicell.sim.board_turns import looks_alike
from aoicell.sim.population import Population
from aoicell.sim.world import World
from aoicell.transforms import angle_of

GUARD_MM, GUARD_DEG = 0.05, 0.5  # either side of a limit: what the inspection may be off by


def score_board(
    conveyor: Conveyor, set_up: SetUp, slot: int, number: int, population: Population,
    inspected: Inspected,
) -> BoardRecord:  # fmt: skip
    """Everything that is kept of a board."""
    world, session = conveyor.world, set_up.session
    standards = {view.id: view.standard for view in session.taught.views}
    correction, images = inspected.correction, inspected.images
    bounds = [view.bound for view in correction.views if view.bound] if correction else []
    inspection = None
    if inspected.inspection is not None:
        inspection = score_inspection(inspected.inspection, images, population, world, standards)
    parts = _shown_parts(inspection, inspected.inspection, population, world, images)
    wrong = [part for part in parts if part.planted and not part.tolerated]
    unclear = {part.component for part in parts if _is_unclear(part, population.design)}
    drift, taught = conveyor.drift, set_up.record.before_board
    moved = drift.T_camera_moved(taught).actInv(drift.T_camera_moved(number))
    return BoardRecord(
        number=number, slot=slot, set_up=set_up.record.slot,
        verdict=inspected.verdict, reason=inspected.reason, cause=inspected.cause,
        truth="" if inspection is None else _right_verdict(wrong, unclear),
        planted=len(population.defects),
        unseen=len(population.defects) - sum(bool(part.planted) for part in parts),
        escapes=sum(_escaped(p) for p in wrong if p.component not in unclear),
        false_calls=sum(
            p.called for p in parts if p not in wrong and p.component not in unclear
        ),
        residuals_mm={
            id: residual_record(
                world, id, world.truth_of(standards[id]), world.truth_of(image)
            ).residual_mm
            for id, image in images.items()
        },
        predicted_mm=max((bound.mm_95 for bound in bounds), default=None),
        bound_mm=max((bound.mm_999 for bound in bounds), default=None),
        reading=inspected.reading, status=set_up.station.monitor.status,
        alarms=list(inspected.alarms),
        drifted_mm=1e3 * float(np.linalg.norm(moved.translation)),
        drifted_deg=float(np.degrees(angle_of(moved))),
        drifted_light=drift.light(number).level / drift.light(taught).level - 1,
        arm_seconds=world.clock, compute_seconds=inspected.compute_seconds,
        inspection=inspection,
    )  # fmt: skip


def _shown_parts(
    record: InspectionRecord | None,
    inspection: BoardInspection | None,
    population: Population,
    world: World,
    images: Mapping[str, Observation],
) -> list[PartRecord]:
    """What was wrong or called so, but for parts and foreign objects that no picture shows."""
    if record is None or inspection is None:
        return []
    places = {d.component: d.shift for d in population.defects if d.kind == "foreign_object"}
    shown = {id for id, place in places.items() if _is_shown(place, world, images.values())}
    shown |= set(inspection.components)
    return [part for part in record.parts if part.component in shown or not part.planted]


def _is_shown(place: tuple[float, float], world: World, images: Iterable[Observation]) -> bool:
    point = np.array([[*place, 0.0]])
    truths = [world.truth_of(image) for image in images]
    return any(bool(truth.camera.sees(point, truth.T_camera_board)) for truth in truths)


def _escaped(part: PartRecord) -> bool:
    """Whether a wrong part was said to be in order; no verdict on it says no such thing."""
    return not part.called and part.state != "no_verdict"


def _is_unclear(part: PartRecord, board: BoardDesign) -> bool:
    """Whether a part was moved to where its tolerance ends, as nearly as can be measured."""
    if part.planted not in ("shifted", "rotated"):
        return False
    component = board.component(part.component)
    limit, alike = board.tolerance(component), 360 / looks_alike(component)
    turn = abs((part.rotation_deg + alike / 2) % alike - alike / 2)
    return (
        abs(part.shift_mm - 1e3 * limit.shift) < GUARD_MM
        or abs(turn - float(np.degrees(limit.rotation))) < GUARD_DEG
    )


def _right_verdict(wrong: Iterable[PartRecord], unclear: set[str]) -> str:
    """What the board deserves: "fail", "pass", or "either" where that cannot be measured."""
    if any(part.component not in unclear for part in wrong):
        return "fail"
    return "either" if unclear else "pass"
