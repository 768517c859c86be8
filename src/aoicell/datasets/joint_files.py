"""The arm of a recording: its URDF, and a table of joint angles with a row a view."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from aoicell.datasets.manifest import JointUnit
from aoicell.datasets.poses import ID
from aoicell.datasets.yaml_tree import read_text
from aoicell.errors import InputError, ModelError
from aoicell.robot import Arm
from aoicell.transforms import Array

_RADIANS: Mapping[JointUnit, float] = {"rad": 1.0, "deg": np.pi / 180}


def read_arm(path: Path, named_by: str) -> Arm:
    """The arm of a URDF file. Raises InputError that says which manifest names it."""
    try:
        return Arm(path)
    except ModelError as error:
        raise InputError(f"{named_by}: {error}") from None


def read_joints(path: Path, names: tuple[str, ...], unit: JointUnit) -> dict[str, Array]:
    """Joint angles (dof,) in rad by view id, from a table with a header: id and each joint's name.

    Raises InputError that names the file, the line and what is wrong.
    """
    lines = [line for line in read_text(path).splitlines() if line.strip() and line[0] != "#"]
    rows = [[cell.strip() for cell in re.split(r"[,;\t]", line)] for line in lines]
    header = rows[0] if rows else []
    missing = [name for name in (ID, *names) if name not in header]
    if missing:
        raise InputError(
            f"{path}, line 1: column '{missing[0]}' is missing; the header would be "
            f"{','.join([ID, *names])}"
        )
    found: dict[str, Array] = {}
    for number, row in enumerate(rows[1:], 2):
        where = f"{path}, row {number}"
        if len(row) != len(header):
            raise InputError(f"{where}: {len(row)} cells; the header names {len(header)}")
        named = dict(zip(header, row, strict=True))
        if named[ID] in found:
            raise InputError(f"{where}: view '{named[ID]}' stands twice")
        try:
            q = np.array([float(named[name]) for name in names]) * _RADIANS[unit]
        except ValueError:
            raise InputError(f"{where}: the angles of '{named[ID]}' are not all numbers") from None
        if not np.isfinite(q).all() or np.abs(q).max() > 4 * np.pi:
            raise InputError(
                f"{where}: an angle of '{named[ID]}' is not finite or beyond two turns; "
                "check 'joint_unit'"
            )
        found[named[ID]] = q
    return found


def write_joints(path: Path, names: tuple[str, ...], joints: Mapping[str, Array]) -> None:
    """Joint angles (rad) by view id as a table that `read_joints` reads."""
    rows = [",".join([ID, *names])]
    rows += [",".join([id, *(repr(float(v)) for v in q)]) for id, q in joints.items()]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
