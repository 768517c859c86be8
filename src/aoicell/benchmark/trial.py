"""One world, prepared once, and the trials in it."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aoicell.benchmark.displacement import draw_displacement
from aoicell.benchmark.inspection_trial import (
    draw_population,
    golden_pictures,
    inspect_trial,
    make_references,
)
from aoicell.benchmark.records import HandEyeRecord, Outcome, TrialRecord, WorldRecord
from aoicell.benchmark.scoring import arm_floor_mm, score_view
from aoicell.errors import Refused
from aoicell.inspection import Reference
from aoicell.methods import find_method
from aoicell.nominal import Nominal
from aoicell.observation import Cell, Image, Observation
from aoicell.online import Online, OnlineConfig, Visited, look, relocate, visits
from aoicell.pipeline import (
    Calibration,
    Method,
    TaughtPictures,
    calibrate,
    photograph_board,
    photograph_targets,
    same_setup,
    teach,
)
from aoicell.registration import Template
from aoicell.scenario import Scenario
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.population import Population
from aoicell.sim.projection import PicturelessCell, ProjectingDetector, measured_noise
from aoicell.sim.world import World
from aoicell.targets.detector import IN_PICTURES, Detector, Remembering
from aoicell.transforms import (
    SE3,
    angle_of,
    distance_deg,
    distance_mm,
    to_rvec,
)

Tell = Callable[[str, Mapping[str, Calibration]], None]


@dataclass(frozen=True)
class Session:
    """A world with its calibrations and templates, shared by all its trials, as in life.

    `golden` are pictures of further golden samples by view, `references` what each view is
    compared with, made by a method's first inspection.
    """

    scenario: Scenario
    nominal: Nominal
    world: World
    cell: Cell
    detector: Detector
    methods: dict[str, Method]
    calibrations: dict[str, Calibration]
    taught: TaughtPictures
    templates: dict[str, Template]
    T_base_board_taught: SE3
    golden: Mapping[str, tuple[Image, ...]] = field(default_factory=dict)
    references: dict[str, dict[str, Reference]] = field(default_factory=dict)

    def online(self, method: str) -> Online:
        """What a method brings to the online phase."""
        tolerance = self.scenario.tolerance_mm
        return Online(
            self.nominal, self.calibrations[method], self.templates[method],
            self.methods[method], self.detector, OnlineConfig(tolerance_mm=tolerance),
        )  # fmt: skip


@dataclass(frozen=True)
class TrialResult:
    """The record of one method, and the new images by view."""

    record: TrialRecord
    images: dict[str, Observation]


def prepare(
    scenario: Scenario,
    nominal: Nominal,
    world_index: int,
    methods: Sequence[Method] | None = None,
) -> Session:
    """Build a world, calibrate it and teach the board, for all methods of the scenario.

    `methods` stand in for those that the scenario names.
    """
    as_built = draw(nominal, scenario.tolerances, scenario.seed, world_index)
    world = World(nominal, as_built, scenario.pictures, props=bool(scenario.inject))
    cell, detector = senses(scenario, world)
    return prepare_in(world, cell, detector, scenario, methods)


def prepare_in(
    world: World,
    cell: Cell,
    detector: Detector,
    scenario: Scenario,
    methods: Sequence[Method] | None = None,
    tell: Tell = lambda phase, calibrations: None,
) -> Session:
    """Calibrate a world and teach the board; `tell` hears what is being done."""
    if methods is None:
        methods = [find_method(name) for name in scenario.methods]
    nominal = world.nominal
    tell("calibrating: taking pictures", {})
    pictures = photograph_targets(cell, nominal)
    tell("calibrating: solving", {})
    first = {m.name: same_setup(m, methods) for m in methods}  # what is set up alike is so once
    set_up = [m for m in methods if first[m.name] is m]
    calibrations = calibrate(pictures, nominal, set_up, detector)
    tell("teaching: taking pictures", calibrations)
    taught = photograph_board(cell, nominal)
    tell("teaching: measuring the board", calibrations)
    templates = {m.name: teach(taught, calibrations[m.name], nominal, m, detector) for m in set_up}
    return Session(
        scenario, nominal, world, cell, detector, {m.name: m for m in methods},
        {m.name: calibrations[first[m.name].name] for m in methods}, taught,
        {m.name: templates[first[m.name].name] for m in methods}, world.T_base_board,
        golden_pictures(scenario, world, cell, taught) if scenario.inspect else {},
    )  # fmt: skip


def senses(scenario: Scenario, world: World) -> tuple[Cell, Detector]:
    """The cell and how targets are found in it: in pictures, or by projection."""
    if scenario.pictures:
        return SimCell(world, colour=scenario.colour), Remembering(IN_PICTURES)
    return PicturelessCell(world), ProjectingDetector(world, measured_noise(scenario.tolerances))


def unprepared(scenario: Scenario, world: int, trial: int, error: Exception) -> list[TrialRecord]:
    """A trial, by every method, in a world that could not be calibrated or taught."""
    refused = isinstance(error, Refused)
    nowhere = np.eye(4).tolist()
    return [
        TrialRecord(
            case=0, number=world * scenario.trials_per_world + trial, world=world, trial=trial,
            method=method, outcome="refused" if refused else "failed",
            reason=str(error) if refused else f"{type(error).__name__}: {error}",
            displacement_mm=0.0, turn_deg=0.0, measured_shift_mm=None, correction_seconds=None,
            T_base_board_taught=nowhere, T_base_board_now=nowhere, views=[],
            cause=error.cause if isinstance(error, Refused) else "",
        )
        for method in scenario.methods
    ]  # fmt: skip


def describe(session: Session) -> WorldRecord:
    """Hand-eye of each method against design and truth, and the arm's floor."""
    standards = [view.standard for view in session.taught.views]
    hand_eyes = [_hand_eye(session, name) for name in session.calibrations]
    unused = next(iter(session.calibrations.values())).unused
    world = session.world
    floor = arm_floor_mm(world, standards)
    return WorldRecord(0, world.as_built.world, floor, hand_eyes, list(unused))


def _hand_eye(session: Session, method: str) -> HandEyeRecord:
    calibration = session.calibrations[method]
    estimate = calibration.hand_eye.T_flange_camera
    truth, design = session.world.geometry.T_flange_camera, session.nominal.T_flange_camera
    turn, _ = to_rvec(design.actInv(estimate))
    return HandEyeRecord(
        method=method,
        T_flange_camera=estimate.homogeneous.tolist(),
        design_mm=((estimate.translation - design.translation) * 1e3).tolist(),
        design_deg=np.degrees(turn).tolist(),
        true_offset_mm=((truth.translation - design.translation) * 1e3).tolist(),
        error_mm=distance_mm(estimate, truth),
        error_deg=distance_deg(estimate, truth),
        scatter_mm=calibration.hand_eye.scatter_mm,
        intrinsics_rms_px=calibration.hand.rms_px,
        views=calibration.hand_eye.views,
    )


def run_trial(session: Session, trial: int) -> list[TrialResult]:
    """Move the board, then let each method find it, correct and visit; score from truth.

    `trial` counts within the world; its displacement and noise do not depend on any other.
    """
    world, scenario = session.world, session.scenario
    motion = draw_displacement(scenario, world, session.T_base_board_taught, trial)
    world.place_board(motion * session.T_base_board_taught)
    population = draw_population(scenario, world, trial) if scenario.inspect else None
    world.populate(population)
    attempts: dict[str, _Attempt] = {}
    results = []
    try:
        for name, method in session.methods.items():
            alike = [m for m in session.methods.values() if same_setup(m, [method]) is method]
            farthest = max(alike, key=lambda m: m.looks).name
            if farthest not in attempts:  # the first look of one is that of all that are alike
                attempts[farthest] = _attempt(session, trial, farthest)
            result = _result(session, trial, name, motion, attempts[farthest])
            results.append(_inspected(session, result, population) if population else result)
        return results
    finally:
        world.place_board(session.T_base_board_taught)


@dataclass(frozen=True)
class _Attempt:
    """One method's way through a trial: what it reached by each look, and how it ended."""

    stages: tuple[Visited, ...]
    outcome: Outcome
    reason: str
    shift_mm: float | None
    seconds: float | None
    cause: str = ""


def _attempt(session: Session, trial: int, name: str) -> _Attempt:
    session.world.begin(trial)
    online = session.online(name)
    stages: list[Visited] = []
    outcome: Outcome = "corrected"
    reason, shift, seconds = "", None, None
    cause: str = ""
    try:
        looked = look(session.cell, online)
        start = time.perf_counter()
        correction = relocate(looked, online)
        seconds = time.perf_counter() - start
        shift = correction.shift_mm
        for stage in visits(session.cell, correction, online):
            stages.append(stage)
    except Refused as refusal:
        outcome, reason, cause = "refused", str(refusal), refusal.cause
    except Exception as defect:  # a defect costs its own trial, not the run
        outcome, reason = "failed", f"{type(defect).__name__}: {defect}"
    return _Attempt(tuple(stages), outcome, reason, shift, seconds, cause)


def _result(session: Session, trial: int, name: str, motion: SE3, attempt: _Attempt) -> TrialResult:
    world, template, looks = session.world, session.templates[name], session.methods[name].looks
    outcome, reason, images, bounds = attempt.outcome, attempt.reason, {}, {}
    if len(attempt.stages) >= looks or (attempt.stages and outcome == "corrected"):
        stage = attempt.stages[min(looks, len(attempt.stages)) - 1]
        outcome, images = "corrected", dict(stage.images)
        reason = "; ".join(view.reason for view in stage.correction.unreached)
        bounds = {view.id: view.bound for view in stage.correction.views}
    views = [
        score_view(
            world, view.id, view.standard, images[view.id], session.detector, bounds[view.id]
        )
        for view in template.views
        if view.id in images
    ]
    record = blank_record(session, trial, name, motion)
    return TrialResult(
        replace(
            record, outcome=outcome, reason=reason, measured_shift_mm=attempt.shift_mm,
            correction_seconds=attempt.seconds, views=views,
            cause=attempt.cause if outcome == "refused" else "",
        ),
        images,
    )  # fmt: skip


def _inspected(session: Session, result: TrialResult, population: Population) -> TrialResult:
    """The same result with what an inspection makes of its pictures."""
    name = result.record.method
    if name not in session.references:
        virtual = session.scenario.inspection.reference == "virtual"
        session.references[name] = make_references(session.online(name), session.golden, virtual)
    standards = {view.id: view.standard for view in session.taught.views}
    inspection = inspect_trial(
        result.images, session.references[name], population, session.world, standards
    )
    return replace(result, record=replace(result.record, inspection=inspection))


def blank_record(session: Session, trial: int, name: str, motion: SE3) -> TrialRecord:
    """The record of a method's trial as it begins: how the board was moved, and no result."""
    world, T_taught = session.world, session.T_base_board_taught
    centre = (T_taught * world.geometry.Ts_board_marker[session.nominal.positioning.id]).translation
    index = world.as_built.world
    return TrialRecord(
        case=0, number=index * session.scenario.trials_per_world + trial, world=index,
        trial=trial, method=name, outcome="failed", reason="",
        displacement_mm=float(np.linalg.norm(motion.act(centre) - centre)) * 1e3,
        turn_deg=float(np.degrees(angle_of(motion))), measured_shift_mm=None,
        correction_seconds=None, T_base_board_taught=T_taught.homogeneous.tolist(),
        T_base_board_now=world.T_base_board.homogeneous.tolist(), views=[],
    )  # fmt: skip
