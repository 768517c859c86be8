"""Scores from truth: how differently the camera sees the board after the correction."""

from collections.abc import Sequence

import numpy as np

from aoicell.benchmark.records import MarkerRecord, ViewRecord
from aoicell.leftover import Bound
from aoicell.observation import Observation
from aoicell.registration import component_points
from aoicell.sim.world import Truth, World
from aoicell.targets.cross_marker import turned
from aoicell.targets.detector import Detector
from aoicell.transforms import SE3, Array, apply, distance_deg


def residual_vectors(taught: SE3, corrected: SE3, points: Array) -> Array:
    """Where points of the board (N, 3) moved in the camera's frame (N, 3), m.

    The arguments are T_camera_board when the view was taught and after the correction.
    """
    return apply(corrected, points) - apply(taught, points)


def visible_points(world: World, taught: Truth) -> Array:
    """Tops of the components (N, 3) that lie in the taught view, in the board's frame."""
    return component_points(world.nominal.board, world.camera("hand"), taught.T_camera_board)


def score_view(
    world: World,
    id: str,
    standard: Observation,
    new: Observation,
    detector: Detector,
    bound: Bound | None = None,
) -> ViewRecord:
    """One view, at component points and at the markers that it shows."""
    before, after = world.truth_of(standard), world.truth_of(new)
    markers = _score_markers(world, standard, new, detector)
    return residual_record(world, id, before, after, bound, markers)


def residual_record(
    world: World,
    id: str,
    before: Truth,
    after: Truth,
    bound: Bound | None = None,
    markers: Sequence[MarkerRecord] = (),
) -> ViewRecord:
    """One view at component points, from what was true when it was taught and now."""
    points = visible_points(world, before)
    vectors = residual_vectors(before.T_camera_board, after.T_camera_board, points) * 1e3
    return ViewRecord(
        id=id,
        points=len(points),
        residual_mm=float(np.linalg.norm(vectors, axis=1).mean()),
        vector_mm=vectors.mean(axis=0).tolist(),
        predicted_mm=None if bound is None else bound.mm_95,
        bound_mm=None if bound is None else bound.mm_999,
        lateral_mm=float(np.linalg.norm(vectors[:, :2], axis=1).mean()),
        depth_mm=float(np.abs(vectors[:, 2]).mean()),
        deg=distance_deg(before.T_camera_board, after.T_camera_board),
        markers=list(markers),
        T_base_camera_taught=before.T_base_camera.homogeneous.tolist(),
        T_base_camera_new=after.T_base_camera.homogeneous.tolist(),
    )


def _score_markers(
    world: World, standard: Observation, new: Observation, detector: Detector
) -> list[MarkerRecord]:
    """Every marker that lies in the standard image as a whole."""
    marker = world.nominal.marker
    camera = world.camera("hand")
    before, after = world.truth_of(standard).T_camera_board, world.truth_of(new).T_camera_board
    found_before = detector.markers(standard, marker)
    found_after = detector.markers(new, marker)
    records = []
    for id in world.geometry.Ts_board_marker:
        if not camera.sees(world.marker_points(id, marker.outline), before):
            continue
        crosses = world.marker_crosses(id)
        uv_before, uv_after = camera.project(crosses, before), camera.project(crosses, after)
        seen_before, seen_after = _reading(found_before, uv_before), _reading(found_after, uv_after)
        depth = float(apply(before, crosses)[:, 2].mean())
        detected = None
        if seen_before is not None and seen_after is not None:
            detected = float(np.linalg.norm(seen_after - seen_before, axis=1).mean())
        records.append(
            MarkerRecord(
                id=id,
                detected_px=detected,
                true_px=float(np.linalg.norm(uv_after - uv_before, axis=1).mean()),
                image_mm=None if detected is None else detected * depth / camera.focal_px * 1e3,
                standard_uv_px=None if seen_before is None else seen_before.tolist(),
                new_uv_px=None if seen_after is None else seen_after.tolist(),
            )
        )
    return records


def _reading(detections: Sequence[Array], uv_true: Array, within_px: float = 20.0) -> Array | None:
    """The detection (4, 2) of the marker that truly is at `uv_true`, in the same order."""
    for uv in detections:
        for turn in range(4):
            reading = turned(uv, turn)
            if np.linalg.norm(reading - uv_true, axis=1).max() < within_px:
                return reading
    return None


def arm_floor_mm(world: World, standards: Sequence[Observation], repeats: int = 25) -> float:
    """What is left when the board does not move at all: the mean over pairs of arrivals.

    No pictures: the same residual, between two arrivals at each taught joint target.
    """
    world.begin()
    residuals = []
    for standard in standards:
        points = visible_points(world, world.truth_of(standard))
        for _ in range(repeats):
            poses = []
            for _ in range(2):
                world.arrive(standard.state.q)
                poses.append(world.truth().T_camera_board)
            vectors = residual_vectors(poses[0], poses[1], points)
            residuals.append(np.linalg.norm(vectors, axis=1).mean() * 1e3)
    return float(np.mean(residuals))
