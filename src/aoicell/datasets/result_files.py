"""A written calibration read again: what a drift check needs of it, written beside the result."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aoicell.calibration.bundle import Noise
from aoicell.calibration.drift_reference import Reference, reference_of
from aoicell.calibration.parameters import LENSES
from aoicell.camera import Camera
from aoicell.datasets.solve import Solved
from aoicell.errors import InputError, shown
from aoicell.transforms import SE3, Array, from_matrix, is_rigid

KEY = "drift_reference"


def with_reference(result: Mapping[str, Any], solved: Solved) -> dict[str, Any]:
    """The result as it is written to a file: with noise and covariance for a later check.

    The covariance goes with `parameters`, in m, rad, px and, for sizes, 1. Null where a check
    is not possible: a refused calibration, several cameras.
    """
    report = solved.report
    if report.verdict == "refused" or report.solution is None or report.uncertainty is None:
        return {**result, KEY: None}
    try:
        reference = reference_of(report.solution, report.uncertainty)
    except InputError:
        return {**result, KEY: None}
    noise = reference.noise
    described = {
        "camera": reference.eye,
        "lens": reference.lens,
        "noise_px": noise.sigma if reference.camera is not None else None,
        "noise_of_poses": None if reference.camera is not None else noise.sigma,
        "repeatability_mm": noise.deviation_m * 1e3,
        "repeatability_deg": float(np.degrees(noise.deviation_rad)),
        "views": reference.views,
        "prints": {
            name: {"scale": scale, "form": _listed(reference.forms.get(name))}
            for name, scale in reference.scales.items()
        },
        "parameters": list(reference.names),
        "covariance": reference.covariance.tolist(),
    }
    return {**result, KEY: described}


def read_reference(path: Path) -> Reference:
    """The calibration in a file that `aoicell calibrate --out` wrote, for a drift check.

    Raises InputError, naming the file and the key, on anything else.
    """
    values = _read(path)
    if values.get("verdict") == "refused":
        raise InputError(f"{path}: this calibration was refused; there is nothing to check against")
    drift = values.get(KEY)
    if not isinstance(drift, dict):
        raise InputError(
            f"{path}: '{KEY}' is missing, which a drift check needs; calibrate one camera again "
            "with --out FILE, in the format json"
        )
    try:
        return _reference(values, drift)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"{path}: not as 'aoicell calibrate --out' writes it ({type(error).__name__}: "
            f"{shown(str(error))})"
        ) from None


def _read(path: Path) -> dict[str, Any]:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"--check {path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"--check {path}: no JSON ({error})") from None
    if not isinstance(values, dict):
        raise InputError(f"--check {path}: no result of 'aoicell calibrate --out'")
    return values


def _reference(values: Mapping[str, Any], drift: Mapping[str, Any]) -> Reference:
    on_flange = values["mount"] == "eye_in_hand"
    if not on_flange and values["mount"] != "eye_to_hand":
        raise ValueError(f"mount {values['mount']}")
    names = tuple(str(name) for name in drift["parameters"])
    covariance = _array(drift["covariance"], (len(names), len(names)))
    if (
        not np.allclose(covariance, covariance.T, rtol=1e-6, atol=0)
        or (np.diag(covariance) < 0).any()
    ):
        raise ValueError("covariance is not symmetric")
    camera = None if values["camera"] is None else _camera(values["camera"])
    sigma = drift["noise_of_poses" if camera is None else "noise_px"]
    if drift["lens"] not in LENSES:
        raise ValueError(f"lens {drift['lens']}")
    prints: Mapping[str, Any] = drift["prints"]
    noise = Noise(
        _positive(sigma),
        _positive(drift["repeatability_mm"], least=0.0) / 1e3,
        float(np.radians(_positive(drift["repeatability_deg"], least=0.0))),
    )
    return Reference(
        eye=str(drift["camera"]),
        mount="flange" if on_flange else "base",
        T_mount_eye=_pose(values["T_flange_camera" if on_flange else "T_base_camera"]),
        camera=camera,
        lens=drift["lens"],
        T_mount_fixture={str(t["name"]): _target_pose(t) for t in values["targets"]},
        scales={name: _positive(p["scale"]) for name, p in prints.items()},
        forms={n: _array(p["form"], (4,)) for n, p in prints.items() if p["form"] is not None},
        noise=noise,
        names=names,
        covariance=covariance,
        views=int(_positive(drift["views"])),
    )


def _target_pose(target: Mapping[str, Any]) -> SE3:
    return _pose(
        target["T_base_target"] if "T_base_target" in target else target["T_flange_target"]
    )


def _pose(described: Mapping[str, Any]) -> SE3:
    T = from_matrix(_array(described["matrix"], (4, 4)))
    if not is_rigid(T, 1e-6):
        raise ValueError("a pose is no rigid transform")
    return T


def _camera(described: Mapping[str, Any]) -> Camera:
    width, height = (int(v) for v in described["size_px"])
    distortion = _array(described["distortion"], (5,))
    return Camera(_array(described["K"], (3, 3)), width, height, distortion)


def _array(values: Any, shape: tuple[int, ...]) -> Array:
    array = np.array(values, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{shape} finite numbers are wanted")
    return array


def _positive(value: Any, least: float = np.finfo(float).tiny) -> float:
    number = float(value)
    if not least <= number < np.inf:
        raise ValueError(f"{shown(value)} is not above 0")
    return number


def _listed(values: Array | None) -> list[float] | None:
    return None if values is None else [float(value) for value in values]
