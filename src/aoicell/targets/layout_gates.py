"""When the markers of a board are not believed: they disagree, lie too far, or are two boards'."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from aoicell.camera import Camera
from aoicell.errors import Refused
from aoicell.targets.located_layout import Layout, LayoutConfig, LocatedLayout, Reading
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array

_CLEARLY = 3.0  # times the noise, by which it shows which of several markers disagrees


def solved(uvs: Mapping[str, Array], layout: Layout, camera: Camera) -> LocatedLayout:
    """The pose of these markers."""
    points = np.concatenate([layout[id] for id in uvs])
    pose = solve_pose(points, np.concatenate(list(uvs.values())), camera, name="board")
    return LocatedLayout(pose, uvs)


def consistent(
    uvs: Mapping[str, Array], layout: Layout, camera: Camera, needed: int, config: LayoutConfig,
    sigma_px: float | None,
) -> LocatedLayout:  # fmt: skip
    """The pose that all markers agree on, or all but one; Refused where there is none."""
    uvs = {id: uvs[id] for id in layout if id in uvs}
    located = solved(uvs, layout, camera)
    most = np.inf if sigma_px is None else max(config.max_noise * sigma_px, config.harmless_px)
    if located.pose.rms_px <= config.max_rms_px and located.noise_px <= most:
        return located
    agreed = []
    for out in uvs if sigma_px is not None and len(uvs) > needed else ():
        others = solved({id: uv for id, uv in uvs.items() if id != out}, layout, camera)
        if others.noise_px <= most:
            agreed.append(replace(others, left_out=(out,)))
    agreed.sort(key=lambda others: others.noise_px)
    if len(agreed) == 1 or (agreed and agreed[1].noise_px > _CLEARLY * agreed[0].noise_px):
        return agreed[0]
    accepted = min(config.max_rms_px, most)
    raise Refused(
        f"board: the markers {', '.join(uvs)} fit their layout only to "
        f"{located.pose.rms_px:.2f} px, at most {accepted:.2f} px is accepted; check for moved or "
        "false markers, light and focus, or teach the board anew",
        "inconsistent",
    )


def refuse_far(T: SE3, layout: Layout, T_expected: SE3, config: LayoutConfig) -> None:
    """Raise where the layout lies farther from where it is expected than a board is displaced."""
    shift, lift, tilt = _displacement(T, layout, T_expected)
    allowed = (config.max_shift, config.max_lift, np.radians(config.max_tilt_deg))
    if shift > allowed[0] or lift > allowed[1] or tilt > allowed[2]:
        lift_mm, tilt_deg = config.max_lift * 1e3, config.max_tilt_deg
        if np.isfinite(config.max_shift):
            most = f"{config.max_shift * 1e3:.0f} mm, {lift_mm:.0f} mm and {tilt_deg:.0f} deg are"
        else:
            most = f"{lift_mm:.0f} mm out of its plane and {tilt_deg:.0f} deg are"
        raise Refused(
            f"board: {shift * 1e3:.0f} mm aside, {lift * 1e3:.0f} mm out of its plane and "
            f"{np.degrees(tilt):.0f} deg tilted from where it was taught, at most {most} accepted; "
            "bring it back or teach it there",
            "too_far",
        )


def _displacement(T: SE3, layout: Layout, T_expected: SE3) -> tuple[float, float, float]:
    """Of the markers' middle in the expected plane and out of it (m), and the tilt (rad)."""
    middle = np.concatenate(list(layout.values())).mean(axis=0)
    D = T_expected.actInv(T)
    step = D.act(middle) - middle
    tilt = np.arccos(np.clip(D.rotation[2, 2], -1, 1))
    return float(np.hypot(*step[:2])), float(abs(step[2])), float(tilt)


def rival_of(
    found: Sequence[Reading], located: LocatedLayout, layout: Layout, camera: Camera,
    T_expected: SE3, config: LayoutConfig,
) -> Reading | None:  # fmt: skip
    """Two markers or more, none of them used, that could be another board within range."""
    used = {index for id, index in found[0].indices.items() if id in located.uvs_px}
    for reading in found[1:]:
        if len(reading.uvs) < 2 or used & set(reading.indices.values()):
            continue
        other = solved(reading.uvs, layout, camera)
        if other.pose.rms_px > config.max_rms_px:
            continue
        shift, lift, _ = _displacement(other.T_camera_target, layout, T_expected)
        if shift <= config.max_shift and lift <= config.max_lift:
            return reading
    return None
