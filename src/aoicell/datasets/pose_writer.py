"""Writes poses in each format that is read."""

import re
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.poses import COLUMNS, ID, encode
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array


def write_poses(path: Path, poses: Mapping[str, SE3], pose_format: PoseFormat) -> None:
    """Poses by id: into one table, or one file each where the name of `path` holds a `*`.

    A table has the column `id`, so that it serves either pairing. Lengths are written as given.
    """
    if "*" in path.name:
        for id, T in poses.items():
            _write_single(path.with_name(path.name.replace("*", id)), T, pose_format)
    elif pose_format == "opencv_yaml":
        _write_storage(path, poses)
    else:
        rows = [",".join([ID, *COLUMNS[pose_format]])]
        rows += [",".join([id, *_figures(encode(T, pose_format))]) for id, T in poses.items()]
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def _write_single(path: Path, T: SE3, pose_format: PoseFormat) -> None:
    figures = _figures(encode(T, pose_format))
    if pose_format == "opencv_yaml":
        _write_storage(path, {"pose": T})
    elif pose_format == "named_quat":
        named = zip(COLUMNS[pose_format], figures, strict=True)
        path.write_text("".join(f"{name}: {figure}\n" for name, figure in named), encoding="utf-8")
    elif pose_format == "visp_vector":
        rows = "".join(f"  - [{figure}]\n" for figure in figures)
        path.write_text(f"rows: 6\ncols: 1\ndata:\n{rows}", encoding="utf-8")
    elif pose_format == "matrix4x4_row_major":
        rows = "".join(" ".join(figures[k : k + 4]) + "\n" for k in range(0, 16, 4))
        path.write_text(rows, encoding="utf-8")
    else:
        path.write_text(" ".join(figures) + "\n", encoding="utf-8")


def _write_storage(path: Path, poses: Mapping[str, SE3]) -> None:
    for id in poses:
        if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", id):
            raise InputError(f"{path}: {id!r} cannot name a matrix there; begin it with a letter")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for id, T in poses.items():
        storage.write(id, np.array(T.homogeneous))
    storage.release()


def _figures(values: Array) -> list[str]:
    return [repr(float(value)) for value in values]
