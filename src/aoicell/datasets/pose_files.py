"""Files of poses as others write them: one table with a row a view, or one file a view."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.datasets.globs import is_glob, matching, starred
from aoicell.datasets.manifest import PoseFormat
from aoicell.datasets.poses import COLUMNS, ID, FilePose, decode
from aoicell.datasets.yaml_tree import item, numbers, read_text, read_tree
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array


def read_poses(
    folder: Path, pattern: str, pose_format: PoseFormat, named_by: str, by_name: bool
) -> list[FilePose]:
    """All poses of a table or a glob, in the file's unit and direction.

    With `by_name` their ids are the column `id` or what the `*` stands for, else they are only
    labels. Raises InputError that names the file, the line and what is wrong.
    """
    files = matching(folder, pattern, named_by)
    if not is_glob(pattern):
        table = _table(files[0], pose_format, by_name)
        if not table:
            raise InputError(f"{files[0]}: no poses in it; give one for each view")
        return table
    poses: list[FilePose] = []
    for path in files:
        label = starred(path, pattern, named_by) if by_name else path.stem
        poses.append(FilePose(label, str(path), _single(path, pose_format)))
    return poses


def _single(path: Path, pose_format: PoseFormat) -> SE3:
    """The one pose of a file."""
    if pose_format == "named_quat":
        tree = read_tree(path)
        named = [numbers([item(tree, path, k)], path, k, 1)[0] for k in COLUMNS[pose_format]]
        return decode(np.array(named), pose_format, str(path))
    if pose_format == "opencv_yaml":
        matrices = _matrices(path)
        if len(matrices) != 1:
            raise InputError(
                f"{path}: {len(matrices)} 4x4 matrices ({', '.join(matrices) or 'none'}); "
                "a file of one view holds one"
            )
        return decode(next(iter(matrices.values())), pose_format, str(path))
    text = read_text(path)
    if pose_format == "visp_vector" and re.search(r"^\s*data\s*:", text, re.MULTILINE):
        values = numbers(item(read_tree(path), path, "data"), path, "data")
        return decode(values, pose_format, str(path))
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    cells = [cell for line in lines for cell in re.split(r"[\s,;]+", line.strip()) if cell]
    return decode(_numbers(cells, str(path)), pose_format, str(path))


def _matrices(path: Path) -> dict[str, Array]:
    """The 4x4 matrices of an OpenCV storage file by name, flat."""
    return {
        name: numbers(value, path, name)
        for name, value in read_tree(path).items()
        if isinstance(value, dict) and (value.get("rows"), value.get("cols")) == (4, 4)
    }


def _table(path: Path, pose_format: PoseFormat, by_name: bool) -> list[FilePose]:
    if pose_format == "opencv_yaml":
        return [
            FilePose(name, f"{path}, '{name}'", decode(values, pose_format, f"{path}, '{name}'"))
            for name, values in _matrices(path).items()
        ]
    rows = _rows(path)
    header = rows.pop(0)[1] if rows and not _is_number(rows[0][1][-1]) else []
    columns, id_column = _columns(path, header, pose_format)
    if by_name and id_column is None:
        raise InputError(
            f"{path}, line 1: no column '{ID}', which pairing by name needs; the header would be "
            f"{','.join([ID, *COLUMNS[pose_format]])}"
        )
    poses: list[FilePose] = []
    for line, cells in rows:
        where = f"{path}, line {line}"
        if header and len(cells) != len(header):
            raise InputError(f"{where}: {len(cells)} cells; the header names {len(header)}")
        label = cells[id_column] if id_column is not None else str(len(poses) + 1)
        chosen = [cells[k] for k in columns] if columns else cells
        poses.append(FilePose(label, where, decode(_numbers(chosen, where), pose_format, where)))
    return poses


def _columns(
    path: Path, header: Sequence[str], pose_format: PoseFormat
) -> tuple[list[int], int | None]:
    """The columns of the numbers (none: all), and that of the id."""
    id_column = header.index(ID) if ID in header else None
    names = [name for name in header if name != ID]
    wanted = COLUMNS[pose_format]
    if len(set(header)) < len(header):
        raise InputError(f"{path}, line 1: a column stands twice in {','.join(header)}")
    if pose_format == "named_quat":
        missing = [name for name in wanted if name not in names]
        if missing:
            raise InputError(
                f"{path}, line 1: column '{missing[0]}' is missing; named_quat needs a header "
                f"with {' '.join(wanted)} in any order"
            )
        return [header.index(name) for name in wanted], id_column
    known = {name for columns in COLUMNS.values() for name in columns}
    if names and set(names) <= known and tuple(names) != wanted:
        raise InputError(
            f"{path}, line 1: the header {' '.join(names)} contradicts pose_format = "
            f"'{pose_format}' ({' '.join(wanted)})"
        )
    return [k for k in range(len(header)) if k != id_column], id_column


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of each row; separated by comma, semicolon, tab or spaces."""
    lines = [
        (number, line.strip())
        for number, line in enumerate(read_text(path).splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    first = lines[0][1] if lines else ""
    separator = next((sign for sign in ",;\t" if sign in first), None)
    split = [(number, line.split(separator)) for number, line in lines]
    return [(number, [cell.strip(' "') for cell in cells]) for number, cells in split]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(cells: Sequence[str], where: str) -> Array:
    for cell in cells:
        if not _is_number(cell) or "_" in cell:
            raise InputError(f"{where}: {cell!r} is no number")
    return np.array([float(cell) for cell in cells])


def read_pairs(path: Path) -> list[tuple[FilePose, FilePose]]:
    """Pose pairs [[effector 4x4], [object 4x4]], ...] as MoveIt Calibration saves them (JSON)."""
    try:
        samples = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON ({error})") from None
    if not isinstance(samples, list) or not samples:
        raise InputError(f"{path}: no list of samples [[effector 4x4], [object 4x4]]")
    pairs = []
    for number, sample in enumerate(samples, 1):
        where = f"{path}, sample {number}"
        if not isinstance(sample, list) or len(sample) != 2:
            raise InputError(f"{where}: not a pair [[effector 4x4], [object 4x4]]")
        both = [
            FilePose(str(number), where, _json_matrix(matrix, f"{where}, {what}"))
            for what, matrix in zip(("effector", "object"), sample, strict=True)
        ]
        pairs.append((both[0], both[1]))
    return pairs


def _json_matrix(matrix: Any, where: str) -> SE3:
    try:
        values = np.array(matrix, dtype=float)
    except (TypeError, ValueError, OverflowError):
        values = np.zeros(0)
    if values.shape != (4, 4):
        raise InputError(f"{where}: no 4x4 matrix of numbers, written row by row")
    return decode(values.ravel(), "matrix4x4_row_major", where)
