"""A calibration for the terminal: what was found, how good it is, view by view, what is missing."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from rich import box
from rich.table import Table
from scipy.spatial.transform import Rotation

from aoicell.datasets.suggest import Reading

_POSES = ("T_flange_camera", "T_base_camera", "T_base_target", "T_flange_target")
_MOST_READINGS = 8


def calibration_tables(result: dict[str, Any]) -> list[Table]:
    """The tables of a described result (the JSON's keys); no poses where it is refused."""
    tables = [_poses_table(result)] if result["verdict"] != "refused" else []
    return [*tables, _quality_table(result), _views_table(result["views"])]


def readings_table(readings: Sequence[Reading]) -> Table:
    """The most consistent readings of a recording's poses."""
    table = _table("Readings of the poses, the most consistent first")
    for name in ("scatter\nmm", "scatter\ndeg", "views", "part on the\nflange at mm"):
        table.add_column(name, justify="right")
    table.add_column("what would change")
    for reading in readings[:_MOST_READINGS]:
        change = "\n".join(reading.changes) or "nothing: as the manifest stands"
        numbers = (reading.scatter_mm, reading.scatter_deg, reading.mounted_mm)
        scatter, turn, mounted = (f"{v:.2f}" if np.isfinite(v) else "-" for v in numbers)
        note = f"{change} ({reading.reason})" if reading.reason else change
        table.add_row(scatter, turn, str(reading.views), mounted, note)
    if len(readings) > _MOST_READINGS:
        table.caption = f"the first {_MOST_READINGS} of {len(readings)}"
    return table


def _poses_table(result: dict[str, Any]) -> Table:
    """Where cameras and targets are, with the cameras' standard deviations."""
    table = _table("Found")
    table.add_column("")
    for name in ("x\nmm", "y\nmm", "z\nmm", "rx\ndeg", "ry\ndeg", "rz\ndeg"):
        table.add_column(name, justify="right")
    cameras = result.get("cameras") or [{"name": "", **result}]
    for part in [*cameras, *result["targets"]]:
        key = next(k for k in _POSES if part.get(k))
        T = np.array(part[key]["matrix"])
        turn = np.degrees(Rotation.from_matrix(T[:3, :3]).as_rotvec())
        name = f"{key} {part['name']}".strip()
        table.add_row(
            name, *(f"{v:.2f}" for v in T[:3, 3] * 1e3), *(f"{v:.3f}" for v in turn)
        )  # fmt: skip
        if part.get("std_mm"):
            stds = (*map(_two, part["std_mm"]), *(_number(v, 3) for v in part["std_deg"]))
            table.add_row("  +/-, along and about the camera's axes", *stds, style="dim")
    camera = result["camera"]
    if camera:
        K, lens = camera["K"], ", ".join(f"{v:.4g}" for v in camera["distortion"])
        table.caption = (
            f"fx {K[0][0]:.2f}, fy {K[1][1]:.2f}, cx {K[0][2]:.2f}, cy {K[1][2]:.2f} px; "
            f"k1, k2, p1, p2, k3: {lens}\nrotations as vectors (axis times angle)"
        )
    return table


def _quality_table(result: dict[str, Any]) -> Table:
    table = _table(f"Verdict: {result['verdict']}")
    table.add_column("")
    table.add_column("", justify="right")
    rows = [
        ("views that the fit has not seen, px", _two(result["holdout_px"])),
        ("the same on the target, mm", _two(result["holdout_mm"])),
        ("what the fit leaves, px", _number(result["rms_px"], 3)),
        ("scatter of the target, each view by itself, mm", _two(result["scatter_mm"])),
    ]
    for target in result["targets"]:
        if target["target_scale"] is not None:
            size = f"{target['target_scale']:.4f} +/- {target['target_scale_std']:.4f}"
            rows.append((f"size of '{target['name']}' over the declared one", size))
    for m in result["motion"]:
        turns = ", ".join(f"{v:.1f}" for v in m["turn_deg"])
        rows += [
            (f"turns of the flange, '{m['target']}', rms deg about three axes", turns),
            ("tilt of the target, rms deg", f"{m['tilt_deg']:.1f}"),
            ("farthest over nearest", _two(m["depth_ratio"])),
        ]
    for name, value in rows:
        table.add_row(name, value)
    return table


def _views_table(views: Sequence[dict[str, Any]]) -> Table:
    """Each view: fit, prediction by the others, or why it is not used."""
    used = sum(view["used"] for view in views)
    table = _table(f"{used} of {len(views)} views used")
    table.add_column("view")
    for name in ("fit\npx", "held out\npx", "held out\nmm"):
        table.add_column(name, justify="right")
    table.add_column("", overflow="fold")
    for view in views:
        numbers = (view["rms_px"], view["holdout_px"], view["holdout_mm"])
        note = view["reason"] if view["used"] else f"not used: {view['reason']}"
        table.add_row(view["id"], *map(_two, numbers), note)
    return table


def _table(title: str) -> Table:
    return Table(
        title=title, title_justify="left", caption_justify="left",
        box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True,
    )  # fmt: skip


def _two(value: float | None) -> str:
    return _number(value, 2)


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
