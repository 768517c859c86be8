"""An arm's poses around a target, known exactly, and files about them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image as Pillow

from aoicell.transforms import SE3, from_xyz_rpy, looking_at

# No two axes alike: an inverse, a swap or a transposition cannot go unnoticed.
X = from_xyz_rpy([0.012, -0.034, 0.071], [0.10, -0.25, 0.60])
Z = from_xyz_rpy([-0.350, 0.850, 0.402], [0.02, -0.01, 1.50])
LOOKS = (
    (0.0, 0.0, 0.0), (0.4, 0.0, 0.2), (-0.4, 0.1, -0.3), (0.0, 0.45, 0.1), (0.1, -0.4, 0.8),
    (0.3, 0.3, -0.6), (-0.2, -0.35, 0.5), (0.25, -0.1, 1.2), (-0.3, 0.2, -1.0), (0.15, 0.4, 0.3),
)  # fmt: skip


def arm_and_target_poses(mount: str = "eye_in_hand") -> tuple[list[SE3], list[SE3]]:
    """T_base_flange and T_camera_target of ten views; X is the camera, Z the target."""
    looks = [
        Z * looking_at([0.02 * k, -0.03 * k, 0], 0.4 + 0.03 * k, (a, b), roll)
        for k, (a, b, roll) in enumerate(LOOKS)
    ]
    arms = [T * X.inverse() for T in looks]
    seen = [T.actInv(Z) for T in looks]
    return (arms if mount == "eye_in_hand" else [T.inverse() for T in arms]), seen


def write_pictures(folder: Path, ids: Sequence[str], size: tuple[int, int] = (64, 48)) -> None:
    """Small pictures with something on them, ID.png."""
    folder.mkdir(parents=True, exist_ok=True)
    grey = np.add.outer(np.arange(size[1]), np.arange(size[0])).astype(np.uint8) * 2
    for id in ids:
        Pillow.fromarray(grey).save(folder / f"{id}.png")


MANIFEST = """mount = "eye_in_hand"
[[target]]
kind = "chessboard"
columns = 9
rows = 6
square_mm = 25.0
[views]
images = "images/*.png"
poses = "poses.csv"
pose_format = "matrix4x4_row_major"
pose_meaning = "T_base_flange"
length_unit = "m"
pairing = "order"
"""


def write_manifest(folder: Path, text: str = MANIFEST, **changed: str) -> Path:
    """A manifest with the values of some keys replaced."""
    lines = []
    for line in text.splitlines():
        key = line.split(" = ")[0]
        lines.append(f'{key} = "{changed[key]}"' if key in changed else line)
    path = folder / "manifest.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
