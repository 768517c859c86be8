"""A hand camera and a tripod in one recording: both see the table's board, the tripod sees one
on the arm as well. Rendered at known poses.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from helpers.printed import BENT, Paper, picture
from helpers.recordings import ODD, T_BASE_TARGET, T_FLANGE_CAMERA, flange_poses
from PIL import Image

from aoicell.camera import Camera
from aoicell.datasets.camera_files import write_camera
from aoicell.datasets.pose_writer import write_poses
from aoicell.datasets.recording import Recording
from aoicell.datasets.sightings import Found, NamedTarget
from aoicell.observation import Image as Pixels
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.sighting import Sighting
from aoicell.transforms import from_xyz_rpy, looking_at

ARM_BOARD = Chessboard(9, 6, 0.016, 0.012)
TRIPOD = Camera(
    np.array([[1210.0, 0, 485.0], [0, 1206.0, 352.0], [0, 0, 1]]), 960, 720,
    np.array([-0.08, 0.03, -5e-4, 1e-3, 0]),
)  # fmt: skip
# From above, and the arm's board on the back of the flange: the tripod sees both in eight views.
T_BASE_TRIPOD = T_BASE_TARGET * looking_at([-0.14, -0.28, 0], 1.28, (-0.68, -0.42), -1.63)
T_FLANGE_ARMTARGET = T_FLANGE_CAMERA * from_xyz_rpy(
    [0.031, 0.072, -0.061], [np.pi + 0.30, 0.10, -2.52]
)
BOTH = 8

MANIFEST = """mount = "eye_in_hand"
[[target]]
kind = "chessboard"
name = "table"
camera = ["hand", "tripod"]
columns = 7
rows = 6
square_mm = 16.0
[[target]]
kind = "chessboard"
name = "arm"
camera = "tripod"
mount = "eye_to_hand"
columns = 9
rows = 6
square_mm = 16.0
[views]
poses = "poses.csv"
pose_format = "matrix4x4_row_major"
pose_meaning = "T_base_flange"
length_unit = "m"
pairing = "name"
[[camera]]
name = "hand"
mount = "eye_in_hand"
images = "hand/*.png"
intrinsics = "hand.yaml"
refine = true
[[camera]]
name = "tripod"
mount = "eye_to_hand"
images = "tripod/*.png"
intrinsics = "tripod.yaml"
refine = true
"""
ARM_TARGET = MANIFEST[MANIFEST.index('[[target]]\nkind = "chessboard"\nname = "arm"') :]
ARM_TARGET = ARM_TARGET[: ARM_TARGET.index("[views]")]


@cache
def pictures() -> dict[str, tuple[Pixels, ...]]:
    """Of both cameras at each of the ten arm poses."""
    hand, tripod = [], []
    T_table = T_BASE_TRIPOD.actInv(T_BASE_TARGET)
    for k, arm in enumerate(flange_poses()):
        seen = (arm * T_FLANGE_CAMERA).actInv(T_BASE_TARGET)
        hand.append(picture((Paper(ODD), seen), camera=BENT, seed=k))
        on_arm = T_BASE_TRIPOD.actInv(arm * T_FLANGE_ARMTARGET)
        prints = [(Paper(ODD), T_table)]
        if TRIPOD.sees(ARM_BOARD.corners, on_arm):
            prints.append((Paper(ARM_BOARD), on_arm))
        tripod.append(picture(*prints, camera=TRIPOD, seed=100 + k))
    return {"hand": tuple(hand), "tripod": tuple(tripod)}


def write(folder: Path, manifest: str = MANIFEST, rendered: bool = True) -> Path:
    """The recording on disk under a manifest, and the manifest's path; or with empty pictures."""
    for name, camera in (("hand", BENT), ("tripod", TRIPOD)):
        (folder / name).mkdir(parents=True)
        empty = np.full((camera.height, camera.width), 90, np.uint8)
        for k in range(len(flange_poses())):
            image = pictures()[name][k] if rendered else empty
            Image.fromarray(image).save(folder / name / f"{k:02d}.png", compress_level=1)
        write_camera(camera, folder / f"{name}.yaml", "opencv")
    poses = {f"{k:02d}": T for k, T in enumerate(flange_poses())}
    write_poses(folder / "poses.csv", poses, "matrix4x4_row_major")
    path = folder / "manifest.toml"
    path.write_text(manifest)
    return path


def projected(recording: Recording, targets: Sequence[NamedTarget]) -> dict[str, Found]:
    """What detection would find in the pictures, without looking: a stand-in for `find_targets`."""
    rng, found = np.random.default_rng(0), {}
    for view, arm in zip(recording.views, flange_poses(), strict=True):
        eyes = {"hand": (BENT, arm * T_FLANGE_CAMERA), "tripod": (TRIPOD, T_BASE_TRIPOD)}
        boards = {"table": T_BASE_TARGET, "arm": arm * T_FLANGE_ARMTARGET}
        seen: dict[tuple[str, str], Sighting] = {}
        for target in targets:
            for name in target.cameras:
                camera, T = eyes[name]
                points, T = target.target.points, T.actInv(boards[target.name])
                if camera.sees(points, T) and T.rotation[2, 2] < 0:
                    noise = 0.03 * rng.standard_normal((len(points), 2))
                    uv = camera.project(points, T) + noise
                    seen[name, target.name] = Sighting(np.arange(len(points)), uv)
        found[view.id] = Found(seen, {})
    return found
