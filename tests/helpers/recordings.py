"""Recordings with rendered pictures of a board at exactly known poses, to calibrate from."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from aoicell.camera import Camera
from aoicell.datasets.target_descriptions import ChessboardDescription, Mount
from aoicell.datasets.writer import write_recording
from aoicell.observation import Image
from aoicell.targets.chessboard import Chessboard
from aoicell.transforms import SE3, from_xyz_rpy, looking_at
from helpers.printed import BENT, Paper, picture

# No two axes alike: an inverse, a swap or a transposition cannot go unnoticed.
T_FLANGE_CAMERA = from_xyz_rpy([0.012, -0.034, 0.071], [0.10, -0.25, 0.60])
T_BASE_TARGET = from_xyz_rpy([-0.350, 0.850, 0.402], [0.02, -0.01, 1.50])
LOOKS = (
    (0.0, 0.0, 0.0), (0.4, 0.0, 0.2), (-0.4, 0.1, -0.3), (0.0, 0.45, 0.1), (0.1, -0.4, 0.8),
    (0.3, 0.3, -0.6), (-0.2, -0.35, 0.5), (0.25, -0.1, 1.2), (-0.3, 0.2, -1.0), (0.15, 0.4, 0.3),
)  # fmt: skip
ODD, EVEN = Chessboard(7, 6, 0.016, 0.012), Chessboard(8, 6, 0.015, 0.012)

Change = Callable[[int, Image], Image]


def looks() -> list[SE3]:
    """T_target_camera of ten views, leaning both ways, rolled, from 0.35 to 0.5 m."""
    return [
        looking_at([0.006 * k - 0.03, -0.004 * k + 0.02, 0], 0.35 + 0.017 * k, (a, b), roll)
        for k, (a, b, roll) in enumerate(LOOKS)
    ]


def flange_poses(mount: Mount = "eye_in_hand") -> list[SE3]:
    """T_base_flange of the views: the camera on the flange, or the board on it.

    Eye to hand is the same scene with base and flange exchanged: T_base_camera is then
    T_FLANGE_CAMERA and T_flange_target is T_BASE_TARGET.
    """
    arms = [T_BASE_TARGET * T * T_FLANGE_CAMERA.inverse() for T in looks()]
    return arms if mount == "eye_in_hand" else [T.inverse() for T in arms]


def record(
    folder: Path,
    board: Chessboard = ODD,
    mount: Mount = "eye_in_hand",
    start: Camera | None = BENT,
    order: Sequence[int] | None = None,
    change: Change | None = None,
) -> Path:
    """Write a recording and return its manifest's path.

    `order` gives each picture another view's arm pose; `change` alters the pictures.
    """
    arms = flange_poses(mount)
    described = ChessboardDescription(
        kind="chessboard", columns=board.columns, rows=board.rows, square_mm=board.square * 1e3
    )

    def views() -> Sequence[tuple[str, Image, SE3]]:
        made = []
        for k, image in enumerate(_pictures(board)):
            arm = arms[order[k] if order else k]
            made.append((f"{k:02d}", change(k, image) if change else image, arm))
        return made

    return write_recording(folder, mount, [described], views(), start)


@cache
def _pictures(board: Chessboard) -> tuple[Image, ...]:
    return tuple(picture((Paper(board), T.inverse()), seed=k) for k, T in enumerate(looks()))


def blank(numbers: Sequence[int]) -> Change:
    """Pictures of these numbers show nothing."""
    return lambda k, image: np.full_like(image, 128) if k in numbers else image
