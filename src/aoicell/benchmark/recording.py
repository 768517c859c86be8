"""Writes what the cell's cameras see as recordings for any tool, with the truth in a file apart.

DIR/scenario.toml  environment.json  truth.json
DIR/world0/hand_eye/   chessboard 2 by the hand camera: images/, poses.csv, joints.csv, arm.urdf,
                       manifest.toml
DIR/world0/tripod/     chessboard 1 on the flange and 2 on the table by the tripod's camera
DIR/world0/board/      the board as taught and after each displacement: images/, poses.csv
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from PIL import Image as Pillow

from aoicell.benchmark.displacement import draw_displacement
from aoicell.benchmark.environment import describe_environment
from aoicell.calibration.poses import TABLE_2
from aoicell.camera import Camera
from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.target_descriptions import ChessboardDescription, Mount
from aoicell.datasets.writer import write_recording
from aoicell.errors import InputError
from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import CameraName, Observation
from aoicell.pipeline import TaughtPictures, photograph_board, photograph_targets
from aoicell.scenario import Case, Scenario, cases_of
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.world import World
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import SE3

Pictures = dict[str, Observation]


def record_scenario(
    scenario: Scenario, folder: Path, report: Callable[[str], None] = lambda what: None
) -> int:
    """Record every world and displacement of a scenario; returns the number of pictures.

    Nothing is calibrated or corrected: the pictures are those that a localiser starts from.
    Raises InputError for a folder that holds something, or a scenario without pictures.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: not empty; name a new folder with --out")
    if not scenario.pictures:
        raise InputError(f"scenario '{scenario.name}' has pictures = false; nothing to record")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scenario.toml").write_text(scenario.to_toml())
    environment = {**describe_environment(), "seed": scenario.seed}
    (folder / "environment.json").write_text(json.dumps(environment, indent=2) + "\n")
    cases, truths, count = cases_of(scenario), [], 0
    for case in cases:
        for index in range(case.scenario.worlds):
            name = f"world{index}" if len(cases) == 1 else f"case{case.index}_world{index}"
            report(name)
            truth = _record_world(case, index, folder / name)
            truths.append({"folder": name, "case": case.label, **truth})
            count += len(truth["pictures"])
    truth_file = {"schema": 1, "unit": "m", "worlds": truths}
    (folder / "truth.json").write_text(json.dumps(truth_file, indent=1) + "\n")
    return count


def _record_world(case: Case, index: int, folder: Path) -> dict[str, Any]:
    scenario = case.scenario
    nominal = scenario.fitted(load_nominal(scenario.cell_folder))
    world = World(nominal, draw(nominal, scenario.tolerances, scenario.seed, index))
    cell = SimCell(world, colour=scenario.colour)
    try:
        targets = photograph_targets(cell, nominal)
        taught = photograph_board(cell, nominal)
        hand = _named("view", targets.intrinsic) | _named("table_2", targets.table_2, TABLE_2)
        tripod = _named("view", targets.tripod)
        board = _taught(taught) | _displaced(world, cell, scenario, taught)
        table = _described(nominal.tabletarget, "tabletarget")
        standing = table.model_copy(
            update={"mount": "eye_in_hand"}
        )  # on the table, as for the hand
        both = [_described(nominal.armtarget, "armtarget"), standing]
        _write(folder / "hand_eye", "eye_in_hand", [table], hand, nominal, "hand")
        _write(folder / "tripod", "eye_to_hand", both, tripod, nominal, "tripod")
        _write_board(folder / "board", board, nominal)
        return _truth(world, {"hand_eye": hand, "tripod": tripod, "board": board})
    finally:
        world.close()


def _named(prefix: str, pictures: Iterable[Observation], ids: Iterable[str] = ()) -> Pictures:
    names = [f"{prefix}_{id}" for id in ids]
    listed = list(pictures)
    names += [f"{prefix}_{number:02d}" for number in range(len(names) + 1, len(listed) + 1)]
    return dict(zip(names, listed, strict=True))


def _taught(taught: TaughtPictures) -> Pictures:
    views = {f"taught_{view.id}": view.standard for view in taught.views}
    return {"taught_check": taught.check, "taught_overview": taught.overview, **views}


def _displaced(world: World, cell: SimCell, scenario: Scenario, taught: TaughtPictures) -> Pictures:
    """The board after each displacement, from the two poses where it is looked for."""
    T_base_board, pictures = world.T_base_board, {}
    for trial in range(scenario.trials_per_world):
        motion = draw_displacement(scenario, world, T_base_board, trial)
        world.place_board(motion * T_base_board)
        for look, picture in (("check", taught.check), ("overview", taught.overview)):
            world.begin(trial)  # as a method that looks from there alone sees it
            cell.move(picture.state.q)
            pictures[f"trial_{trial}_{look}"] = cell.capture()
    return pictures


def _described(board: Chessboard, name: str) -> ChessboardDescription:
    return ChessboardDescription(
        kind="chessboard", name=name, columns=board.columns, rows=board.rows,
        square_mm=board.square * 1e3,
    )  # fmt: skip


def _write(
    folder: Path, mount: Mount, targets: Sequence[ChessboardDescription], pictures: Pictures,
    nominal: Nominal, camera: CameraName,
) -> None:  # fmt: skip
    views = ((id, o.image, o.state.T_base_flange) for id, o in pictures.items())
    write_recording(
        folder, mount, targets, views, nominal.cameras[camera],
        urdf=nominal.arm.urdf, joints={id: o.state.q for id, o in pictures.items()},
    )  # fmt: skip


def _write_board(folder: Path, pictures: Pictures, nominal: Nominal) -> None:
    """Pictures of the board with their poses, and its markers as designed."""
    (folder / "images").mkdir(parents=True)
    for id, observation in pictures.items():
        Pillow.fromarray(observation.image).save(folder / "images" / f"{id}.png")
    poses = {id: o.state.T_base_flange for id, o in pictures.items()}
    write_poses(folder / "poses.csv", poses, "matrix4x4_row_major")
    marker = nominal.marker
    design = {
        "marker": {"size_mm": marker.size * 1e3, "points_mm": (marker.crosses * 1e3).tolist()},
        "markers": [
            {"id": m.id, "role": m.role, "kind": m.kind, "x_mm": m.x * 1e3, "y_mm": m.y * 1e3,
             "z_mm": m.z * 1e3}
            for m in nominal.board.markers
        ],
    }  # fmt: skip
    (folder / "board.json").write_text(json.dumps(design, indent=1) + "\n")


def _truth(world: World, recordings: Mapping[str, Pictures]) -> dict[str, Any]:
    """What nothing that estimates may read: cameras, mounts and poses as they really were."""
    geometry = world.geometry
    poses = {
        "T_flange_camera": geometry.T_flange_camera,
        "T_base_tripod": geometry.T_base_tripod,
        "T_flange_armtarget": geometry.T_flange_armtarget,
        "T_base_tabletarget": geometry.T_base_tabletarget,
    }
    return {
        **{name: _matrix(T) for name, T in poses.items()},
        "Ts_board_marker": {id: _matrix(T) for id, T in geometry.Ts_board_marker.items()},
        "cameras": {name: _camera(camera) for name, camera in geometry.cameras.items()},
        "pictures": {
            f"{recording}/{id}": {
                "T_base_camera": _matrix(truth.T_base_camera),
                "T_base_board": _matrix(truth.T_base_board),
            }
            for recording, pictures in recordings.items()
            for id, observation in pictures.items()
            for truth in [world.truth_of(observation)]
        },
    }


def _matrix(T: SE3) -> list[list[float]]:
    matrix: list[list[float]] = T.homogeneous.tolist()
    return matrix


def _camera(camera: Camera) -> dict[str, Any]:
    return {"K": camera.K.tolist(), "distortion_k1_k2_p1_p2_k3": camera.distortion.tolist(),
            "width": camera.width, "height": camera.height}  # fmt: skip
