"""A robot program as a file: JSON that explains itself, checked when it is read."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.errors import InputError, did_you_mean, shown
from aoicell.nominal import Nominal
from aoicell.planning.program import PLAIN, Capture, Move, Program, is_plain
from aoicell.robot import Arm
from aoicell.toml_table import TomlTable

SCHEMA = 1
_ABOUT = (
    "A robot program. 'move': straight in the joints, from rest to rest, to joints_deg (degrees, "
    "in the order of arm.joints), in duration_s at the drives' limits. 'capture': a picture by "
    "the camera in the hand, named after its view. The arm must stand at start_deg."
)
_KEYS = ("schema", "about", "name", "arm", "start_deg", "steps")
_ARM_KEYS = ("name", "joints")
_STEP_KEYS = {"move": ("step", "to", "joints_deg", "duration_s"), "capture": ("step", "view")}
_SLACK = 1e-6  # share by which a rounded duration may be too short


def write_program(program: Program, path: Path) -> None:
    """Write a program, one step a line. Raises InputError when the file cannot be written."""
    head = {
        "schema": SCHEMA, "about": _ABOUT, "name": program.name,
        "arm": {"name": program.arm, "joints": program.joints}, "start_deg": program.start_deg,
    }  # fmt: skip
    lines = [f"  {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    steps = ",\n".join(f"    {json.dumps(_as_json(step))}" for step in program.steps)
    text = "\n".join(["{", *lines, '  "steps": [', *([steps] if steps else []), "  ]", "}", ""])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


def _as_json(step: Move | Capture) -> dict[str, Any]:
    if isinstance(step, Capture):
        return {"step": "capture", "view": step.view}
    return {
        "step": "move", "to": step.to, "joints_deg": step.joints_deg, "duration_s": step.duration,
    }  # fmt: skip


def load_program(path: Path, nominal: Nominal) -> Program:
    """Read a program for the arm of a cell.

    Raises InputError, with the file and the key, when anything in it is unknown, missing, of the
    wrong kind, for another arm, outside the joints' limits or faster than the drives.
    """
    table = TomlTable(path, _read(path))
    _refuse_unknown(table, _KEYS)
    if table.get("schema") != SCHEMA:
        raise table.complaint("schema", wanted=f"{SCHEMA}, which this version reads")
    arm = _sub(table, "arm")
    _refuse_unknown(arm, _ARM_KEYS)
    name = nominal.arm.urdf.stem
    if arm.text("name") != name:
        raise arm.complaint("name", wanted=f"'{name}', the arm of the cell '{nominal.name}'")
    if arm.get("joints") != list(nominal.arm.joint_names):
        raise arm.complaint("joints", wanted=f"those of the arm, {list(nominal.arm.joint_names)}")
    start_deg = _angles_deg(table, "start_deg", nominal.arm)
    steps = _steps(table, start_deg, nominal.arm)
    return Program(table.text("name"), name, nominal.arm.joint_names, start_deg, steps)


def _read(path: Path) -> dict[str, Any]:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:  # broken, no UTF-8, nested too deep
        raise InputError(f"{path}: not valid JSON ({' '.join(str(error).split())})") from None
    if not isinstance(values, dict):
        raise InputError(f"{path}: holds {shown(values)}; a program is a JSON object")
    return values


def _steps(table: TomlTable, start_deg: tuple[float, ...], arm: Arm) -> tuple[Move | Capture, ...]:
    if not isinstance(table.get("steps"), list):
        raise table.complaint("steps", wanted="a list of steps")
    steps: list[Move | Capture] = []
    at, seen = start_deg, set[str]()
    for entry in table.each("steps"):
        if not isinstance(entry.values, dict):
            raise InputError(f"{entry.source}: '{entry.where}' is {shown(entry.values)}; it must "
                             f"be an object with the key 'step'")  # fmt: skip
        kind = entry.get("step")
        if not isinstance(kind, str) or kind not in _STEP_KEYS:
            raise entry.complaint("step", wanted=f"'move' or 'capture'; {_guess(kind)}")
        _refuse_unknown(entry, _STEP_KEYS[kind])
        if kind == "move":
            move = _move(entry, at, arm)
            at = move.joints_deg
            steps.append(move)
        else:
            picture = _capture(entry, seen)
            seen.add(picture.view)
            steps.append(picture)
    return tuple(steps)


def _guess(kind: Any) -> str:
    return did_you_mean(shown(kind).strip("'"), _STEP_KEYS)


def _move(entry: TomlTable, at_deg: tuple[float, ...], arm: Arm) -> Move:
    joints_deg = _angles_deg(entry, "joints_deg", arm)
    duration = entry.number("duration_s")
    speeds = np.radians(np.abs(np.subtract(joints_deg, at_deg))) / arm.velocity_limits
    least, slowest = float(speeds.max()), arm.joint_names[int(speeds.argmax())]
    if duration < 0 or duration < least * (1 - _SLACK):
        raise entry.complaint(
            "duration_s", wanted=f"at least {least:.3f}, which {slowest} needs at its rated speed"
        )
    return Move(entry.text("to"), joints_deg, duration)


def _capture(entry: TomlTable, seen: Collection[str]) -> Capture:
    view = entry.text("view")
    if not is_plain(view):
        raise entry.complaint("view", wanted=PLAIN)
    if view in seen:
        raise entry.complaint("view", wanted="another name: an earlier picture has this one")
    return Capture(view)


def _angles_deg(table: TomlTable, key: str, arm: Arm) -> tuple[float, ...]:
    angles = table.numbers(key, count=arm.dof)
    for name, angle, low, high in zip(
        arm.joint_names, np.radians(angles), arm.lower, arm.upper, strict=True
    ):
        if not low <= angle <= high:
            raise table.complaint(
                key, wanted=f"within the limits: {name} at {np.degrees(angle):g} deg is not from "
                f"{np.degrees(low):.0f} to {np.degrees(high):.0f} deg"
            )  # fmt: skip
    return tuple(float(angle) for angle in angles)


def _sub(table: TomlTable, key: str) -> TomlTable:
    if not isinstance(table.get(key), dict):
        raise table.complaint(key, wanted="an object")
    return table.sub(key)


def _refuse_unknown(table: TomlTable, known: Collection[str]) -> None:
    unknown = next((key for key in table.values if key not in known), None)
    if unknown is not None:
        place = f"{table.where}.{unknown}".lstrip(".")
        raise InputError(
            f"{table.source}: unknown key {shown(place)}; {did_you_mean(unknown, known)}"
        )
