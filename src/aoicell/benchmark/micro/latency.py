"""From a picture to corrected joint targets: the time the arm waits for."""

import statistics
from typing import Any

import cv2

from aoicell.benchmark.displacement import draw_displacement
from aoicell.benchmark.micro.inspection import inspection_rows
from aoicell.benchmark.micro.timing import milliseconds, one_opencv_thread
from aoicell.benchmark.trial import Session, prepare
from aoicell.nominal import load_nominal
from aoicell.online import Looked, Online, look, relocate
from aoicell.resources import data_root
from aoicell.scenario import Scenario
from aoicell.targets.detector import IN_PICTURES

TRIALS, QUICK_TRIALS = 10, 3


def bench_latency(quick: bool = False) -> dict[str, Any]:
    """CPU time on one thread of a `typical` world's localisations, 2 MP pictures of a moved board.

    `correction_ms`: from the look-out picture to corrected joint targets with their bounds, all
    detection included; the reference picture, which can be looked at on the way, is on top, as
    `reference_ms`. `detection_ms` is the markers' part of it, `over_aruco` that part over
    OpenCV's ArUco detection in the same picture. `inspection_ms`: registration, comparison and
    verdicts of one of the taught views. Medians.
    """
    nominal = load_nominal(data_root() / "cell")
    trials = QUICK_TRIALS if quick else TRIALS
    scenario = Scenario(name="latency", trials_per_world=trials, methods=["aoicell_one_look"])
    session = prepare(scenario, nominal, 0)
    try:
        with one_opencv_thread():
            rows = [_row(session, trial) for trial in range(trials)]
            views = inspection_rows(session, 1)
    finally:
        session.world.close()
    names = ("correction_ms", "reference_ms", "detection_ms", "over_aruco")
    medians = {name: round(statistics.median(row[name] for row in rows), 3) for name in names}
    medians["inspection_ms"] = statistics.median(view["inspection_ms"] for view in views)
    return {"name": "latency", "rows": rows, "ratios": medians}


def _row(session: Session, trial: int) -> dict[str, Any]:
    world, nominal = session.world, session.nominal
    T_taught = session.T_base_board_taught
    world.place_board(draw_displacement(session.scenario, world, T_taught, trial) * T_taught)
    world.begin(trial)
    online = session.online("aoicell_one_look")
    online = Online(nominal, online.calibration, online.template, online.method, IN_PICTURES)
    looked = look(session.cell, online)
    world.place_board(T_taught)
    without = Looked(looked.board)
    aruco = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    grey = looked.board.grey
    correction = milliseconds(lambda: relocate(without, online))
    both = milliseconds(lambda: relocate(looked, online))
    detection = milliseconds(lambda: online.markers(looked.board))
    theirs = milliseconds(lambda: aruco.detectMarkers(grey))
    return {
        "trial": trial,
        "correction_ms": round(correction, 2),
        "reference_ms": round(both - correction, 2),
        "detection_ms": round(detection, 2),
        "aruco_ms": round(theirs, 2),
        "over_aruco": round(detection / theirs, 3),
    }
