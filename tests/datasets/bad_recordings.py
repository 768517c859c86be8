"""Recordings on disk with one thing wrong, drawn from a seed."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
from helpers.printed import BENT, Paper, picture
from helpers.recordings import ODD, T_BASE_TARGET, T_FLANGE_CAMERA, looks
from PIL import Image

from aoicell.datasets.camera_files import write_camera
from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.pose_writer import write_poses
from aoicell.observation import Image as Pixels
from aoicell.transforms import SE3, looking_at

TABLES: tuple[PoseFormat, ...] = (
    "matrix4x4_row_major", "xyz_quat_xyzw", "xyz_quat_wxyz", "named_quat", "xyz_rotvec",
)  # fmt: skip


def _rolled() -> list[SE3]:
    return [looking_at([0, 0, 0], 0.4, (0.2, 0.1), roll) for roll in np.linspace(-1, 1, 8)]


def _shifted() -> list[SE3]:
    return [looking_at([0.008 * k - 0.03, 0, 0], 0.36 + 0.01 * k, (0.2, 0.1), 0.3)
            for k in range(8)]  # fmt: skip


_LOOKS: dict[str, Callable[[], list[SE3]]] = {
    "usual": looks, "one axis": _rolled, "translation only": _shifted,
}  # fmt: skip


@cache
def _taken(which: str) -> tuple[Pixels, ...]:
    return tuple(picture((Paper(ODD), T.inverse()), seed=k) for k, T in enumerate(_LOOKS[which]()))


@dataclass
class Files:
    """A recording about to be written: pictures and poses by id, and what the manifest says."""

    pictures: dict[str, Pixels]
    poses: dict[str, SE3]
    says: dict[str, object] = field(default_factory=dict)
    format: PoseFormat = "matrix4x4_row_major"
    edit: Callable[[str], str] = str


def good(rng: np.random.Generator, which: str = "usual") -> Files:
    """A recording with nothing wrong: 8 to 10 views, an arm that repeats to 0.02 mm."""
    hand = rng.random() < 0.5
    Ts = _LOOKS[which]()
    chosen = sorted(rng.permutation(len(Ts))[: int(rng.integers(8, 11))].tolist())
    poses = {}
    for k in chosen:
        arm = T_BASE_TARGET * Ts[k] * T_FLANGE_CAMERA.inverse()
        noise = pin.exp6(np.array([2e-5] * 3 + [5e-5] * 3) * rng.standard_normal(6))
        poses[f"{k:02d}"] = (arm if hand else arm.inverse()) * noise
    says: dict[str, object] = {
        "mount": "eye_in_hand" if hand else "eye_to_hand", "columns": ODD.columns,
        "rows": ODD.rows, "square_mm": 1e3 * ODD.square, "length_unit": "m", "pairing": "name",
    }  # fmt: skip
    pictures = {f"{k:02d}": _taken(which)[k] for k in chosen}
    return Files(pictures, poses, says, TABLES[int(rng.integers(len(TABLES)))])


def write(files: Files, folder: Path) -> Path:
    """The recording on disk; the path of its manifest."""
    (folder / "images").mkdir(parents=True)
    for id, image in files.pictures.items():
        Image.fromarray(image).save(folder / "images" / f"{id}.png", compress_level=1)
    write_poses(folder / "poses.csv", files.poses, files.format)
    table = folder / "poses.csv"
    table.write_text(files.edit(table.read_text()))
    write_camera(BENT, folder / "camera.yaml", "opencv")
    says = {k: json.dumps(v) for k, v in {"pose_format": files.format, **files.says}.items()}
    manifest = folder / "manifest.toml"
    manifest.write_text(
        f"mount = {says['mount']}\n[[target]]\nkind = 'chessboard'\ncolumns = {says['columns']}\n"
        f"rows = {says['rows']}\nsquare_mm = {says['square_mm']}\n"
        "[views]\nimages = 'images/*.png'\n"
        f"poses = 'poses.csv'\npose_format = {says['pose_format']}\n"
        f"pose_meaning = 'T_base_flange'\nlength_unit = {says['length_unit']}\n"
        f"pairing = {says['pairing']}\n[camera]\nintrinsics = 'camera.yaml'\nrefine = true\n"
    )
    return manifest


def _each(files: Files, change: Callable[[SE3], SE3]) -> None:
    files.poses = {id: change(T) for id, T in files.poses.items()}


def _reordered(files: Files, order: list[int]) -> None:
    Ts = list(files.poses.values())
    files.poses = {id: Ts[k] for id, k in zip(files.poses, order, strict=True)}


def _without_fixed_point(count: int, rng: np.random.Generator) -> list[int]:
    while True:
        order = rng.permutation(count)
        if (order != np.arange(count)).all():
            return [int(k) for k in order]


def _missing_pose(files: Files, rng: np.random.Generator) -> None:
    gone = sorted(files.poses)[int(rng.integers(len(files.poses)))]
    del files.poses[gone]
    files.says["pairing"] = rng.choice(["name", "order"]).item()


def _moved_up(files: Files, rng: np.random.Generator) -> None:
    """A pose and another's picture are gone, and pairing by order does not see it."""
    ids = sorted(files.poses)
    del files.poses[ids[int(rng.integers(0, 3))]]
    del files.pictures[ids[-1 - int(rng.integers(0, 3))]]
    files.says["pairing"] = "order"


def _few(files: Files, rng: np.random.Generator) -> None:
    kept = list(rng.permutation(sorted(files.poses))[:3])
    files.poses = {id: files.poses[id] for id in kept}
    files.pictures = {id: files.pictures[id] for id in kept}


def _blank(files: Files, rng: np.random.Generator) -> None:
    ids = list(rng.permutation(sorted(files.pictures)))[int(rng.integers(0, 4)) :]
    files.pictures.update({id: np.full((480, 640), 128, np.uint8) for id in ids})


def _transposed(files: Files, rng: np.random.Generator) -> None:
    _each(files, lambda T: SE3(T.rotation.T.copy(), T.translation))


def _swapped(files: Files, rng: np.random.Generator) -> None:
    order = list(range(len(files.poses)))
    i, j = rng.choice(len(order), 2, replace=False)
    order[i], order[j] = order[j], order[i]
    _reordered(files, order)


def _duplicated(files: Files, rng: np.random.Generator) -> None:
    i, j = (sorted(files.pictures)[k] for k in rng.choice(len(files.pictures), 2, replace=False))
    files.pictures[i] = files.pictures[j]


def _quaternion_order(files: Files, rng: np.random.Generator) -> None:
    written, read = rng.permutation(["xyz_quat_xyzw", "xyz_quat_wxyz"]).tolist()
    files.format, files.says["pose_format"] = written, read
    files.says["pairing"] = "order"
    files.edit = lambda text: "\n".join(
        row.split(",", 1)[1] for row in text.splitlines()[1:]
    )  # neither header nor ids


def _not_a_number(files: Files, rng: np.random.Generator) -> None:
    bad = rng.choice(["nan", "inf", "-", "1e999", ""]).item()
    row = 1 + int(rng.integers(len(files.poses)))

    def edit(text: str) -> str:
        lines = text.splitlines()
        cells = lines[row].split(",")
        cells[1 + int(rng.integers(len(cells) - 1))] = bad
        return "\n".join([*lines[:row], ",".join(cells), *lines[row + 1 :]])

    files.edit = edit


def _size(files: Files, rng: np.random.Generator) -> None:
    factor = rng.choice([0.1, 0.63, 0.95, 1.05, 1.6, 10.0])
    files.says["square_mm"] = float(factor) * 1e3 * ODD.square


def _counts(files: Files, rng: np.random.Generator) -> None:
    # (6, 7) is the same board, turned: a right answer comes of it
    columns, rows = [(5, 6), (9, 7), (7, 5), (8, 6), (6, 6)][int(rng.integers(5))]
    files.says["columns"], files.says["rows"] = columns, rows


def _mount(files: Files, rng: np.random.Generator) -> None:
    other = {"eye_in_hand": "eye_to_hand", "eye_to_hand": "eye_in_hand"}
    files.says["mount"] = other[str(files.says["mount"])]


def _unit(files: Files, rng: np.random.Generator) -> None:
    factor, says = ((1.0, "mm"), (1e3, "m"), (1e-3, "m"))[int(rng.integers(3))]
    _each(files, lambda T: SE3(T.rotation, factor * T.translation))
    files.says["length_unit"] = says


SPOILS: dict[str, Callable[[Files, np.random.Generator], None]] = {
    "missing pose": _missing_pose,
    "moved up": _moved_up,
    "three views": _few,
    "one axis": lambda files, rng: None,
    "translation only": lambda files, rng: None,
    "shuffled": lambda files, rng: _reordered(files, _without_fixed_point(len(files.poses), rng)),
    "two swapped": _swapped,
    "unit": _unit,
    "transposed": _transposed,
    "inverse": lambda files, rng: _each(files, lambda T: T.inverse()),
    "blank": _blank,
    "not a number": _not_a_number,
    "quaternion order": _quaternion_order,
    "duplicated picture": _duplicated,
    "board size": _size,
    "board counts": _counts,
    "mount": _mount,
}


def spoiled(kind: str, seed: int, folder: Path) -> Path:
    """A recording with one thing wrong, in a new folder; the path of its manifest."""
    rng = np.random.default_rng([seed, list(SPOILS).index(kind)])
    files = good(rng, kind if kind in _LOOKS else "usual")
    SPOILS[kind](files, rng)
    return write(files, folder)
