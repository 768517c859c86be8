"""How near the localisation comes to the Cramer-Rao bound of its own detections."""

from dataclasses import replace
from typing import Any

import numpy as np

from aoicell.benchmark.displacement import draw_displacement
from aoicell.benchmark.trial import Session, prepare
from aoicell.leftover import motion_of
from aoicell.nominal import load_nominal
from aoicell.online import look
from aoicell.registration import component_points
from aoicell.resources import data_root
from aoicell.scenario import Scenario
from aoicell.scenario.displacement import Displacement, LiftRange, TiltRange
from aoicell.sim.profiles import TYPICAL
from aoicell.targets.pose import motion_jacobian
from aoicell.transforms import Array, apply, from_twist

WORLDS, TRIALS = 10, 10
QUICK_WORLDS, QUICK_TRIALS = 1, 6
# The exact cell with the pictures of a `typical` one: what its sensor and lens blur add.
SENSOR = ("psf_px", "aperture_mm", "focus_mm", "electrons_per_grey", "noise_grey", "adc_bits")


def bench_localisation(quick: bool = False) -> dict[str, Any]:
    """Located against true poses in pictures from the overview; arm, intrinsics, layout exact.

    The bound is that of the 16 cross centres with the covariance of their detected errors, as
    measured over all pictures of a world: no unbiased estimator from these centres is better.
    Both errors are root mean squares over the tops of the components, mm; `over_bound` is their
    ratio, `cross_px` the rms error of a centre.
    """
    worlds, trials = (QUICK_WORLDS, QUICK_TRIALS) if quick else (WORLDS, TRIALS)
    nominal = load_nominal(data_root() / "cell")
    knobs = {name: getattr(TYPICAL, name) for name in SENSOR}
    scenario = Scenario(
        name="localisation", profile="ideal", worlds=worlds, trials_per_world=trials,
        methods=["aoicell_one_look"], knobs=knobs,
        displacement=Displacement(
            lift_mm=LiftRange(min=-2, max=2), tilt_deg=TiltRange(min=0, max=1)
        ),
    )  # fmt: skip
    rows = []
    for world in range(worlds):
        session = prepare(scenario, nominal, world)
        try:
            rows.append({"world": world, **_row(session, trials)})
        finally:
            session.world.close()
    mean = {
        name: float(np.sqrt(np.mean([row[name] ** 2 for row in rows])))
        for name in ("error_mm", "bound_mm", "cross_px")
    }
    return {
        "name": "localisation",
        "rows": rows,
        "ratios": {
            "over_bound": round(mean["error_mm"] / mean["bound_mm"], 3),
            **{name: round(value, 4) for name, value in mean.items()},
        },
    }


def _row(session: Session, trials: int) -> dict[str, float]:
    world, online = session.world, session.online("aoicell_one_look")
    camera = world.camera("hand")
    layout = {id: world.marker_crosses(id) for id in online.template.layout}
    template = replace(online.template, layout=layout)
    T_taught, errors, centres, geometry = session.T_base_board_taught, [], [], []
    for trial in range(trials):
        motion = draw_displacement(session.scenario, world, T_taught, trial)
        world.place_board(motion * T_taught)
        world.begin(trial)
        picture = look(session.cell, online).board
        truth = world.truth_of(picture)
        world.place_board(T_taught)
        located = online.method.localize(picture, online.markers(picture), template, camera)
        points = apply(truth.T_camera_board, component_points(session.nominal.board, camera,
                                                              truth.T_camera_board))  # fmt: skip
        off = located.T_camera_target * truth.T_camera_board.inverse()
        errors.append(apply(off, points) - points)
        ids = [id for id in template.layout if id in located.uvs_px]
        crosses = np.concatenate([world.marker_crosses(id) for id in ids])
        found = np.concatenate([located.uvs_px[id] for id in ids])
        centres.append(found - world.camera("hand").project(crosses, truth.T_camera_board))
        geometry.append((motion_jacobian(crosses, camera, truth.T_camera_board), points, truth))
    off_px = np.concatenate(centres)
    covariance = off_px.T @ off_px / len(off_px)
    bounds = [_bound(J, points, T.T_camera_board, covariance) for J, points, T in geometry]
    squares = np.concatenate([(e**2).sum(axis=1) for e in errors])
    return {
        "error_mm": float(1e3 * np.sqrt(squares.mean())),
        "bound_mm": float(1e3 * np.sqrt(np.mean(bounds))),
        "cross_px": float(np.sqrt(np.trace(covariance))),
    }


def _bound(J: Array, points: Array, T_camera_board: Any, covariance: Array) -> float:
    """Mean squared error (m^2) over points that the centres' covariance (2, 2) px allows."""
    information = J.T @ np.kron(np.eye(len(J) // 2), np.linalg.inv(covariance)) @ J
    # the Jacobian turns about the board's origin, the points' motion about the camera
    to_origin = from_twist([*T_camera_board.translation, 0, 0, 0]).toActionMatrix()
    order = [3, 4, 5, 0, 1, 2]
    M = motion_of(points) @ to_origin[:, order]
    return float(np.trace(M @ np.linalg.solve(information, M.T)) / len(points))
