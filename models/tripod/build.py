"""Write the meshes of the tripod and its camera to meshes/*.stl.

Binary STL in metres, in two frames. The camera meshes are in the camera's optical frame (origin
at the entrance pupil, +z forward, +y down; everything at z <= -0.002). The legs meshes have their
origin at the centre of the ball head, z up, the feet at z = -1.0. The ball lets the camera take
any direction over upright legs, and the legs may be scaled along z to the height that is wanted.

    python build.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from trimesh import Trimesh

sys.path.insert(0, str(Path(__file__).parents[1]))
from shapes import block, hull, rod

MESHES = Path(__file__).parent / "meshes"
BALL = np.array([0.0, 0.080, -0.070])  # centre of the ball head in the optical frame
FEET_Z, FEET_RADIUS = -1.0, 0.42
HIP_Z, HIP_RADIUS = -0.120, 0.048  # where the legs join the crown
Vector = np.ndarray


def around(count: int, radius: float, z: float, phase: float = 0.0) -> list[Vector]:
    """Return `count` points on a circle about z."""
    angles = np.arange(count) * 2 * np.pi / count + phase
    return [np.array([radius * np.cos(t), radius * np.sin(t), z]) for t in angles]


def camera_body() -> list[Trimesh]:
    """Camera housing, 44 x 44 x 60 mm, with fins; the lens of 6.75 mm."""
    parts = [
        block([-0.020, -0.020, -0.108], [0.020, 0.020, -0.050]),
        block([-0.022, -0.022, -0.058], [0.022, 0.022, -0.048]),
        block([-0.022, -0.022, -0.110], [0.022, 0.022, -0.100]),
        *(
            block([-0.022, -0.022, z], [0.022, 0.022, z + 0.002])
            for z in np.arange(7) * 0.0055 - 0.0975
        ),
    ]
    for start, stop, radius in (
        (-0.049, -0.040, 0.0155), (-0.040, -0.030, 0.0145), (-0.031, -0.021, 0.0165),
        (-0.022, -0.016, 0.0145), (-0.017, -0.006, 0.0165),
    ):  # fmt: skip
        parts.append(rod([0, 0, start], [0, 0, stop], radius, sections=40))
    for low, high in ((-0.0295, -0.0225), (-0.0155, -0.0075)):
        parts += [rod([*p[:2], low], [*p[:2], high], 0.0007, fillet=0.0002, sections=6)
                  for p in around(36, 0.0165, 0.0)]  # fmt: skip
    return parts


def camera_metal() -> list[Trimesh]:
    """C-mount ring, front rim, connectors."""
    return [
        rod([0, 0, -0.0490], [0, 0, -0.0465], 0.0165, fillet=0.0003),
        rod([0, 0, -0.0070], [0, 0, -0.0050], 0.0172, fillet=0.0004),
        rod([-0.008, 0.003, -0.118], [-0.008, 0.003, -0.109], 0.0060),
        rod([0.010, 0.003, -0.115], [0.010, 0.003, -0.109], 0.0045),
    ]


def camera_glass() -> list[Trimesh]:
    """Front element."""
    return [rod([0, 0, -0.0055], [0, 0, -0.0030], 0.0125, 0.0105, fillet=0.0008)]


def camera_mount() -> list[Trimesh]:
    """Quick-release plate under the camera, and the ball's stem: they turn with the camera."""
    x, _, z = BALL
    ball = trimesh.creation.uv_sphere(radius=0.021, count=(24, 32)).apply_translation(BALL)
    return [
        block([-0.019, 0.0215, z - 0.028], [0.019, 0.0290, z + 0.028]),
        block([-0.026, 0.0280, z - 0.022], [0.026, 0.0400, z + 0.022]),
        rod([0.024, 0.034, z], [0.042, 0.034, z], 0.0075, 0.0090),
        rod([x, 0.039, z], [x, 0.064, z], 0.016, 0.0095),
        ball,
    ]


def hip_foot_inward() -> list[tuple[Vector, Vector, Vector]]:
    """Return hip, foot and inward direction of the three legs."""
    hips = around(3, HIP_RADIUS, HIP_Z, np.pi / 2)
    feet = around(3, FEET_RADIUS, FEET_Z + 0.012, np.pi / 2)
    return [(h, f, -h / np.linalg.norm(h)) for h, f in zip(hips, feet, strict=True)]


def legs_tubes() -> list[Trimesh]:
    """Leg sections, centre column and its struts: bare aluminium."""
    parts = [rod([0, 0, -0.52], [0, 0, -0.10], 0.0135)]
    for hip, foot, _ in hip_foot_inward():
        for start, stop, radius in (
            (0.0, 0.40, 0.0150),
            (0.38, 0.72, 0.0122),
            (0.70, 0.985, 0.0096),
        ):
            parts.append(rod(hip + start * (foot - hip), hip + stop * (foot - hip), radius))
        knee = hip + 0.36 * (foot - hip)
        parts.append(rod([0.02 * foot[0], 0.02 * foot[1], -0.49], knee, 0.0048, sections=16))
    return parts


def legs_joints() -> list[Trimesh]:
    """Head, crown, clamps and rubber feet: dark."""
    parts = [
        rod([0, 0, -0.062], [0, 0, -0.004], 0.0280, 0.0245, fillet=0.003, sections=48),
        rod([0, 0, -0.076], [0, 0, -0.058], 0.0330, fillet=0.002, sections=48),
        rod([0, 0, -0.106], [0, 0, -0.072], 0.0240, 0.0290, fillet=0.002, sections=48),
        rod([0, 0, -0.53], [0, 0, -0.515], 0.0160, fillet=0.003),
        rod([0, 0, -0.505], [0, 0, -0.470], 0.0185, fillet=0.002),
    ]
    up = np.array([0.0, 0.0, 0.014])
    for hip, foot, inward in hip_foot_inward():
        parts.append(hull(
            rod(hip + up, hip - up, 0.019, fillet=0.004),
            rod([0, 0, HIP_Z + 0.022], [0, 0, HIP_Z - 0.014], 0.030, fillet=0.004),
        ))  # fmt: skip
        for at, radius in ((0.39, 0.0185), (0.71, 0.0155)):
            centre, along = hip + at * (foot - hip), 0.016 * (foot - hip)
            parts.append(rod(centre - along, centre + along, radius, fillet=0.002))
            lever = centre - 0.016 * inward
            parts.append(rod(lever - along, lever + along, 0.006, fillet=0.002, sections=16))
        sole = np.array([foot[0], foot[1], FEET_Z])
        parts.append(rod(sole, hip + 0.965 * (foot - hip), 0.0165, 0.0115, fillet=0.002))
    return parts


def legs_accent() -> list[Trimesh]:
    """Knobs of the head and the rings of the clamps."""
    parts = [
        rod([0.020, 0, -0.030], [0.052, 0, -0.030], 0.0080, 0.0130, fillet=0.002),
        rod([0, -0.050, -0.067], [0, -0.025, -0.067], 0.0095, 0.0060, fillet=0.001),
        rod([0, 0, -0.0585], [0, 0, -0.0555], 0.0290, fillet=0.0005, sections=48),
    ]
    for hip, foot, _ in hip_foot_inward():
        for at, radius in ((0.408, 0.0188), (0.728, 0.0158)):
            ring = hip + at * (foot - hip)
            parts.append(rod(ring, ring + 0.004 * (foot - hip), radius, fillet=0.0004))
    return parts


def hulls() -> dict[str, Trimesh]:
    """Return the convex meshes that collide, by file name."""
    camera = hull(*camera_body(), *camera_metal(), *camera_glass())
    shapes = {"camera_hull_1": camera, "camera_hull_2": hull(*camera_mount())}
    shapes["legs_hull_1"] = rod([0, 0, -0.53], [0, 0, -0.004], 0.056, 0.034, sections=16)
    for number, (hip, foot, _) in enumerate(hip_foot_inward(), start=2):
        sole = np.array([foot[0], foot[1], FEET_Z])
        shapes[f"legs_hull_{number}"] = rod(hip, sole, 0.022, 0.017, sections=12)
    return shapes


def main() -> None:
    """Write every mesh."""
    MESHES.mkdir(exist_ok=True)
    seen = (
        camera_body,
        camera_metal,
        camera_glass,
        camera_mount,
        legs_tubes,
        legs_joints,
        legs_accent,
    )
    for part in seen:
        trimesh.util.concatenate(part()).export(MESHES / f"tripod_{part.__name__}.stl")
    for name, mesh in hulls().items():
        mesh.export(MESHES / f"tripod_{name}.stl")


if __name__ == "__main__":
    main()
