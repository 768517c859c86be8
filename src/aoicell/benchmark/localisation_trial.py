"""A trial that ends where the corrected views are known: two pictures, and scores from truth.

The arm goes to the corrected views to be scored, but nothing is photographed there. It is cheap
enough for thousands of trials in which something goes wrong.
"""

import time
from dataclasses import replace

from aoicell.benchmark.displacement import draw_displacement, motion_about
from aoicell.benchmark.records import Outcome, ViewRecord
from aoicell.benchmark.scoring import residual_record
from aoicell.benchmark.trial import Session, TrialResult, blank_record
from aoicell.correction import Correction
from aoicell.errors import Refused
from aoicell.online import look, relocate
from aoicell.scenario import Displacement, ShiftRange, TurnRange
from aoicell.sim.adversity import CAUSES, Cause, draw_adversity, injected
from aoicell.sim.drawing import stream
from aoicell.transforms import SE3

OUT_OF_RANGE = Displacement(
    shift_mm=ShiftRange(min=60, max=200), turn_deg=TurnRange(min=-180, max=180)
)


def injected_cause(session: Session, trial: int) -> Cause:
    """What goes wrong in a trial: the causes take turns, from a drawn one on in each world."""
    causes = [cause for cause in CAUSES if cause in session.scenario.inject] or ["none"]
    scenario, world = session.scenario, session.world.as_built.world
    first = int(stream(scenario.seed, world, -1, "first_cause").integers(len(causes)))
    return causes[(first + trial) % len(causes)]


def run_localisation_trial(session: Session, trial: int) -> list[TrialResult]:
    """Move the board, make something go wrong, let each method correct; score from truth.

    `trial` counts within the world; its draws do not depend on any other.
    """
    world, scenario, cause = session.world, session.scenario, injected_cause(session, trial)
    T_taught = session.T_base_board_taught
    if cause == "out_of_range":  # about the middle: about a corner it would swing into the arm
        own = stream(scenario.seed, world.as_built.world, trial, "displacement")
        motion = motion_about(T_taught.translation, OUT_OF_RANGE, own, trial)
    else:
        motion = draw_displacement(scenario, world, T_taught, trial)
    world.place_board(motion * T_taught)
    rng = stream(scenario.seed, world.as_built.world, trial, "adversity")
    try:
        with injected(world, draw_adversity(cause, world, rng)):
            return [_attempt(session, trial, name, motion, cause) for name in session.methods]
    finally:
        world.place_board(T_taught)


def _attempt(session: Session, trial: int, name: str, motion: SE3, cause: Cause) -> TrialResult:
    world, online = session.world, session.online(name)
    world.begin(trial)
    outcome: Outcome = "corrected"
    reason, why, views = "", "", []
    correction, seconds = None, None
    try:
        looked = look(session.cell, online)
        start = time.perf_counter()
        correction = relocate(looked, online)
        seconds = time.perf_counter() - start
        views = _scores(session, name, correction)
    except Refused as refusal:
        outcome, reason, why = "refused", str(refusal), refusal.cause
    except Exception as defect:  # a defect costs its own trial, not the run
        outcome, reason = "failed", f"{type(defect).__name__}: {defect}"
    record = replace(
        blank_record(session, trial, name, motion), outcome=outcome, reason=reason, cause=why,
        measured_shift_mm=None if correction is None else correction.shift_mm,
        correction_seconds=seconds, views=views, injected=cause,
    )  # fmt: skip
    return TrialResult(record, {})


def _scores(session: Session, name: str, correction: Correction) -> list[ViewRecord]:
    """The corrected views as the arm reaches them."""
    world, scores = session.world, []
    standards = {view.id: view.standard for view in session.templates[name].views}
    for view in correction.views:
        world.arrive(view.q)
        before = world.truth_of(standards[view.id])
        scores.append(residual_record(world, view.id, before, world.truth(), view.bound))
    return scores
