"""Our solver of pose pairs among KinHEC's, on its smoke tier, by its own protocol.

KinHEC (Aiersilan 2026, MIT) is a neutral referee: synthetic pose streams with known truth, from
noise and degenerate motion to poses from noisy pixels, and eleven reference solvers. It hands
out pose pairs only, without the mount: both readings are solved and the likelier one is kept.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.calibration.clock_offset import estimate_clock_offset
from aoicell.calibration.pose_pairs import PosePairs, PosePairsConfig, solve_pose_pairs
from aoicell.errors import Implausible, InputError
from aoicell.transforms import SE3, Array, from_matrix

NAME = "aoicell"
QUICK_TRACKS = ("pnp",)
_DOC = "aoicell: most likely X, Y and noise, both mounts tried"
Keyframes = tuple[Array, Array, Array, Array]  # A and B (N, 4, 4), and their relative motions


def bench_kinhec(quick: bool = False) -> dict[str, Any]:
    """Median errors of X by track and solver, and our rank in each: 1 is the best.

    Ranked by the median translation error as KinHEC's own leaderboard is, with the true clock
    offset; `rank_by_track_rotation` by the median rotation error. `clock_error_ms`: median error
    of the clock offset, ours and KinHEC's. `quick`: the track `pnp` only, which has none.
    Raises InputError without KinHEC.
    """
    referee, pipeline = _imported("kinhec.benchmark"), _imported("kinhec.pipeline")
    tracks = list(QUICK_TRACKS) if quick else None
    with tempfile.TemporaryDirectory(prefix="kinhec_") as folder, redirect_stdout(sys.stderr):
        data = Path(folder) / "data"
        pipeline.generate_dataset(
            "smoke", data, workers=1, tracks=tracks, work_dir=Path(folder) / "work",
            write_card=False,
        )  # fmt: skip
        with registered(referee):
            results = referee.run_benchmark(data, progress=False)
        clocks = clock_errors_ms(data)
    rows = leaderboard(results)
    return {
        "name": "kinhec",
        "rows": rows,
        "ratios": {
            "rank_by_track": ranks(rows, "trans_mm"),
            "rank_by_track_rotation": ranks(rows, "rot_deg"),
            "clock_error_ms": clocks,
        },
    }


def _imported(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(
            f"bench kinhec: {error.name} is not installed; pip install 'aoicell[bench]'"
        ) from None


@contextmanager
def registered(referee: Any) -> Iterator[None]:
    """Our solver among the referee's, and gone again afterwards."""
    referee.SOLVERS[NAME], referee.SOLVER_DOCS[NAME] = solve, _DOC
    try:
        yield
    finally:
        del referee.SOLVERS[NAME], referee.SOLVER_DOCS[NAME]


def solve(data: Keyframes, rng: np.random.Generator) -> dict[str, Array]:
    """X and Y (4, 4) of A X = Y B, as KinHEC asks its solvers; raises Implausible.

    Camera on the flange: B is T_target_camera, X = T_flange_camera, Y = T_base_target. Camera in
    the base: B is T_camera_target, X = T_flange_target, Y = T_base_camera.
    """
    A, B = ([from_matrix(T) for T in Ts] for Ts in data[:2])
    config = PosePairsConfig(scale="free")
    readings: list[Callable[[], tuple[PosePairs, SE3, SE3]]] = [
        lambda: _as_x_y(solve_pose_pairs(A, [T.inverse() for T in B], "eye_in_hand", config), True),
        lambda: _as_x_y(solve_pose_pairs(A, B, "eye_to_hand", config), False),
    ]
    found, failed = [], []
    for reading in readings:
        try:
            found.append(reading())
        except Implausible as reason:
            failed.append(reason)
    if not found:
        raise failed[0]
    _, X, Y = min(found, key=lambda f: f[0].minus_twice_log)
    return {"X": X.homogeneous, "Y": Y.homogeneous}


def _as_x_y(pairs: PosePairs, in_hand: bool) -> tuple[PosePairs, SE3, SE3]:
    return (pairs, pairs.X, pairs.Z) if in_hand else (pairs, pairs.Z, pairs.X)


def clock_errors_ms(data: Path) -> dict[str, float]:
    """Median error of the clock offset over the sequences of two clocks, by whose estimate."""
    io, temporal = _imported("kinhec.io"), _imported("kinhec.solvers")
    manifest = io.load_manifest(data)
    errors: dict[str, list[float]] = {NAME: [], "kinhec": []}
    for id in manifest["sequence_id"]:
        sequence = io.load_sequence(data, id, manifest)
        if sequence.synchronous:
            continue
        robot, camera = sequence.robot, sequence.camera
        A, B = robot.T_base_ee_meas, camera.T_cam_target_meas
        known = np.isfinite(B).all(axis=(1, 2))
        poses = [from_matrix(T) for T in A], [from_matrix(T) for T in B[known]]
        ours = estimate_clock_offset(robot.t, poses[0], camera.t[known], poses[1])
        theirs, _ = temporal.estimate_time_offset(robot.t, A, camera.t, B)
        for name, offset in ((NAME, ours.offset), ("kinhec", theirs)):
            errors[name].append(1e3 * abs(offset - sequence.time_offset))
    return {name: round(float(np.median(ms)), 3) for name, ms in errors.items() if ms}


def leaderboard(results: Any) -> list[dict[str, Any]]:
    """Rows by track, clock offset and solver, the smallest median translation error first.

    `results`: the table that the referee returns, one row for a sequence and a solver.
    """
    rows = []
    for (track, sync, solver), mine in results.groupby(["track", "eval_sync", "solver"]):
        solved = mine[mine["ok"]]
        rows.append(
            {
                "track": track,
                "clock": sync,
                "solver": solver,
                "sequences": len(mine),
                "solved": len(solved),
                "trans_mm": _median(solved["X_trans_err_mm"]),
                "rot_deg": _median(solved["X_rot_err_deg"]),
                "ms": _median(solved["runtime_ms"]),
            }
        )
    return sorted(rows, key=lambda r: (r["track"], r["clock"], _or_last(r["trans_mm"])))


def ranks(rows: list[dict[str, Any]], quantity: str) -> dict[str, int]:
    """Our rank by a quantity in each track, with the true clock offset: 1 is the smallest."""
    found = {}
    for track in dict.fromkeys(row["track"] for row in rows):
        field = [r for r in rows if r["track"] == track and r["clock"] == "oracle"]
        ours = next(r for r in field if r["solver"] == NAME)
        found[track] = 1 + sum(_or_last(r[quantity]) < _or_last(ours[quantity]) for r in field)
    return found


def _median(values: Any) -> float | None:
    known = np.asarray(values, dtype=float)
    return round(float(np.median(known)), 4) if len(known) else None


def _or_last(value: float | None) -> float:
    return np.inf if value is None else value
