"""What a calibration hands out: the project's JSON, and files for easy_handeye2 and MoveIt."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal
from xml.sax.saxutils import quoteattr

from aoicell.camera import Camera
from aoicell.datasets.target_descriptions import Mount
from aoicell.errors import InputError
from aoicell.transforms import SE3, Array, is_rigid, to_quat_wxyz

Verdict = Literal["ok", "suspect", "refused"]


@dataclass(frozen=True)
class ViewResult:
    """One view in a calibration: whether it served, and if not why."""

    id: str
    used: bool
    reason: str = ""
    rms_px: float | None = None


@dataclass(frozen=True)
class TargetResult:
    """A target's pose in the base (eye in hand) or on the flange (eye to hand).

    `scale` is how much larger it is than declared, with its standard deviation.
    """

    name: str
    T_mount_target: SE3
    scale: float | None = None
    scale_std: float | None = None


@dataclass(frozen=True)
class HandEyeResult:
    """A calibration as it is written down.

    `T_mount_camera` is T_flange_camera (eye in hand) or T_base_camera (eye to hand), None where
    nothing came out;
    `std_mm` and `std_deg` (3,) are its standard deviations along and about the camera's axes.
    A number that is unknown is None.
    """

    mount: Mount
    T_mount_camera: SE3 | None
    targets: tuple[TargetResult, ...]
    verdict: Verdict
    reasons: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    camera: Camera | None = None
    camera_model: str = "pinhole"
    rms_px: float | None = None
    holdout_px: float | None = None
    scatter_mm: float | None = None
    std_mm: Array | None = None
    std_deg: Array | None = None
    views: tuple[ViewResult, ...] = field(default=())


def to_dict(result: HandEyeResult) -> dict[str, Any]:
    """The result as the project's JSON has it: lengths in metres, other units in the names."""
    first = result.targets[0] if result.targets else None
    camera_frame, target_frame = _frames(result.mount)
    values: dict[str, Any] = {
        "schema": 1,
        "mount": result.mount,
        camera_frame: _posed(result.T_mount_camera),
        target_frame: _posed(first.T_mount_target if first else None),
        "camera": _camera(result.camera, result.camera_model),
        "rms_px": result.rms_px,
        "holdout_px": result.holdout_px,
        "scatter_mm": result.scatter_mm,
        "std_mm": _listed(result.std_mm),
        "std_deg": _listed(result.std_deg),
        "target_scale": first.scale if first else None,
        "target_scale_std": first.scale_std if first else None,
        "views": [
            {"id": v.id, "used": v.used, "reason": v.reason, "rms_px": v.rms_px}
            for v in result.views
        ],
        "warnings": list(result.warnings),
        "verdict": result.verdict,
        "reasons": list(result.reasons),
    }
    if len(result.targets) > 1:
        values["targets"] = [
            {
                "name": target.name,
                target_frame: {"matrix": _matrix(target.T_mount_target)},
                "target_scale": target.scale,
                "target_scale_std": target.scale_std,
            }
            for target in result.targets
        ]
    return values


def to_json(result: HandEyeResult) -> str:
    """The project's JSON; a number that is not finite is null, for JSON knows no NaN."""
    return json.dumps(_finite(to_dict(result)), indent=2, allow_nan=False) + "\n"


def _frames(mount: Mount) -> tuple[str, str]:
    if mount == "eye_in_hand":
        return "T_flange_camera", "T_base_target"
    return "T_base_camera", "T_flange_target"


def _posed(T: SE3 | None) -> dict[str, Any] | None:
    return None if T is None else {"matrix": _matrix(T)}


def _matrix(T: SE3) -> list[list[float]]:
    rows: list[list[float]] = T.homogeneous.tolist()
    return rows


def _listed(values: Array | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]


def _camera(camera: Camera | None, model: str) -> dict[str, Any] | None:
    if camera is None:
        return None
    return {
        "model": model,
        "K": camera.K.tolist(),
        "distortion": camera.distortion.tolist(),
        "size_px": [camera.width, camera.height],
    }


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# -- Other tools -------------------------------------------------------------------------


@dataclass(frozen=True)
class FrameNames:
    """The names of the frames in a robot's tf tree; the camera's is the optical one, z forward."""

    base: str
    flange: str
    camera: str
    target: str = "target"


def to_easy_handeye2(result: HandEyeResult, frames: FrameNames, name: str) -> str:
    """A calibration file NAME.calib of easy_handeye2 (YAML). Raises InputError when refused."""
    T = _usable(result)
    parameters = {
        "name": name,
        "calibration_type": "eye_in_hand" if result.mount == "eye_in_hand" else "eye_on_base",
        "robot_base_frame": frames.base,
        "robot_effector_frame": frames.flange,
        "tracking_base_frame": frames.camera,
        "tracking_marker_frame": frames.target,
    }
    w, x, y, z = (float(part) for part in to_quat_wxyz(T.rotation))
    blocks: Mapping[str, Sequence[tuple[str, float]]] = {
        "translation": list(zip("xyz", map(float, T.translation), strict=True)),
        "rotation": [("x", x), ("y", y), ("z", z), ("w", w)],
    }
    lines = ["parameters:"]
    lines += [f"  {key}: {json.dumps(text)}" for key, text in parameters.items()]
    lines += ["  freehand_robot_movement: true"]
    lines += ['  move_group_namespace: "/"', '  move_group: "manipulator"', "transform:"]
    for block, numbers in blocks.items():
        lines += [f"  {block}:", *(f"    {key}: {number!r}" for key, number in numbers)]
    return "\n".join(lines) + "\n"


def to_moveit_launch(result: HandEyeResult, frames: FrameNames) -> str:
    """A launch file with a static transform, as MoveIt Calibration saves it.

    With a quaternion (x y z w) instead of its three angles, which the publisher takes in another
    order than they are written. Raises InputError when the calibration is refused.
    """
    T = _usable(result)
    w, x, y, z = to_quat_wxyz(T.rotation)
    parent = frames.flange if result.mount == "eye_in_hand" else frames.base
    figures = " ".join(repr(float(v)) for v in (*T.translation, x, y, z, w))
    arguments = quoteattr(f"{figures} {parent} {frames.camera}")
    return (
        "<launch>\n"
        '  <node pkg="tf2_ros" type="static_transform_publisher" name="camera_link_broadcaster"\n'
        f"        args={arguments} />\n"
        "</launch>\n"
    )


def _usable(result: HandEyeResult) -> SE3:
    """A robot would act on these files: nothing refused goes into one."""
    T = result.T_mount_camera
    if result.verdict == "refused" or T is None or not is_rigid(T, 1e-6):
        reasons = "; ".join(result.reasons) or "no rigid transform"
        raise InputError(f"the calibration is refused ({reasons}); no file for a robot is written")
    return T
