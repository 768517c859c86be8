"""From a picture to the verdicts on its components: the time that a view costs."""

import statistics
from typing import Any

import cv2
import numpy as np

from aoicell.benchmark.inspection_trial import draw_population, make_references
from aoicell.benchmark.micro.timing import milliseconds, one_opencv_thread
from aoicell.benchmark.trial import Session, prepare
from aoicell.inspection import Reference, inspect_view, register_2d
from aoicell.nominal import load_nominal
from aoicell.observation import Image, capture_at
from aoicell.resources import data_root
from aoicell.scenario import Scenario

BOARDS, QUICK_BOARDS = 5, 1
ECC_STEPS = 30


def bench_inspection(quick: bool = False) -> dict[str, Any]:
    """CPU time on one thread of 2 MP pictures of boards with ten defects, profile `typical`.

    `inspection_ms`: registration, comparison and verdicts of a picture; `registration_ms` its
    first part; `over_ecc` that part over OpenCV's ECC (a homography, 30 steps) from the same
    picture, which is given the answer of no motion to start from. Medians. What is computed once
    from a reference is not in it.
    """
    folder = data_root()
    scenario = Scenario(
        name="inspection", cell=str(folder / "cell"), methods=["aoicell_one_look"], inspect=True,
        views=str(folder / "models" / "server_board" / "planned.toml"),
    )  # fmt: skip
    session = prepare(scenario, scenario.fitted(load_nominal(scenario.cell_folder)), 0)
    try:
        with one_opencv_thread():
            rows = inspection_rows(session, QUICK_BOARDS if quick else BOARDS)
    finally:
        session.world.close()
    names = ("inspection_ms", "registration_ms", "over_ecc")
    medians = {name: round(statistics.median(row[name] for row in rows), 3) for name in names}
    return {"name": "inspection", "rows": rows, "ratios": medians}


def inspection_rows(session: Session, boards: int) -> list[dict[str, Any]]:
    """One row a picture, of boards that lie where the board was taught."""
    references = make_references(session.online("aoicell_one_look"), {})
    rows = []
    for trial in range(boards):
        session.world.populate(draw_population(session.scenario, session.world, trial))
        session.world.begin(trial)
        for view in session.taught.views:
            [picture] = capture_at(session.cell, [view.standard.state.q])
            row = _row(picture.grey, references[view.id], session)
            rows.append({"board": trial, "view": view.id, **row})
    return rows


def _row(picture: Image, reference: Reference, session: Session) -> dict[str, Any]:
    board = session.nominal.board
    inspect_view(picture, reference, board)  # makes the reference ready
    inspection = milliseconds(lambda: inspect_view(picture, reference, board))
    registration = milliseconds(lambda: register_2d(picture, reference, board))
    ecc = milliseconds(lambda: _ecc(picture, reference.images[0]), rounds=1)
    return {
        "inspection_ms": round(inspection, 1),
        "registration_ms": round(registration, 1),
        "ecc_ms": round(ecc, 1),
        "over_ecc": round(registration / ecc, 3),
    }


def _ecc(picture: Image, standard: Image) -> None:
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, ECC_STEPS, 1e-6)
    start = np.eye(3, dtype=np.float32)
    cv2.findTransformECC(standard, picture, start, cv2.MOTION_HOMOGRAPHY, criteria)
