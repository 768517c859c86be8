"""Write the meshes of the RA620-1621 to meshes/*.stl.

Every mesh is binary STL in metres, in the frame of its URDF link. A link's visual is up to four
meshes, one for each material (body, cover, accent, metal); its collision shape is one to three
convex meshes. Only the joint origins are the maker's; the castings are drawn freely around them.

    python build.py              write the meshes
    python build.py --inertias   print the <inertial> elements that the URDF carries
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh
from trimesh import Trimesh

sys.path.insert(0, str(Path(__file__).parents[1]))
import shapes
from shapes import hull

MESHES = Path(__file__).parent / "meshes"
ARM_MASS = 240.0  # kg, assumed, shared out by volume
FINE, COARSE = 48, 20  # sections of a circle: what is seen, what collides
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Link:
    """One link: visual parts by material, and groups of parts whose hulls collide."""

    body: list[Trimesh] = field(default_factory=list)
    cover: list[Trimesh] = field(default_factory=list)
    accent: list[Trimesh] = field(default_factory=list)
    metal: list[Trimesh] = field(default_factory=list)
    collision: list[list[Trimesh]] = field(default_factory=list)


def disc(
    axis: str,
    centre: Point,
    start: float,
    stop: float,
    radius: float,
    end_radius: float | None = None,
    fillet: float = 0.006,
    sections: int = FINE,
) -> Trimesh:
    """Return a disc with the rims of a casting."""
    return shapes.disc(
        axis, centre, start, stop, radius, end_radius, fillet=fillet, sections=sections
    )


def block(low: Point, high: Point, corner: float) -> Trimesh:
    """Return a box between two corners with every edge rounded by `corner`."""
    return shapes.block(low, high, corner, fillet=corner * 0.8, sections=24)


def solid(axis: str, centre: Point, start: float, stop: float, radius: float) -> Trimesh:
    """Return a coarse cylinder that encloses the fine one: for collision."""
    wide = radius / np.cos(np.pi / COARSE)
    return disc(axis, centre, start, stop, wide, fillet=1e-4, sections=COARSE)


def screws(
    axis: str, centre: Point, at: float, circle: float, count: int, head: float = 0.006
) -> list[Trimesh]:
    """Return screw heads on a circle about `axis`, standing 3 mm proud of `at`."""
    parts = []
    low, high = (at - 0.002, at + 0.003) if at > 0 else (at - 0.003, at + 0.002)
    for angle in np.arange(count) * 2 * np.pi / count + np.pi / count:
        offset = np.roll([circle * np.cos(angle), circle * np.sin(angle), 0.0], "zxy".index(axis))
        place = tuple(np.asarray(centre) + offset)
        parts.append(disc(axis, place, low, high, head, fillet=0.001, sections=8))
    return parts


def base() -> Link:
    """Foot plate, pedestal casting and, behind, the connector box."""
    o = (0.0, 0.0, 0.0)
    foot = block((-0.185, -0.195, 0.0), (0.185, 0.185, 0.032), 0.03)
    casting = hull(disc("z", o, 0.02, 0.08, 0.172), disc("z", o, 0.19, 0.228, 0.158))
    box = block((-0.095, -0.262, 0.055), (0.095, -0.10, 0.185), 0.014)
    plugs = [
        disc("y", (x, -0.26, 0.12), -0.022, 0.0, r, fillet=0.004, sections=32)
        for x, r in ((-0.05, 0.027), (0.012, 0.022), (0.06, 0.018))
    ]
    bolts = [
        disc("z", (x, y, 0.03), 0.0, 0.012, 0.013, fillet=0.002, sections=6)
        for x in (-0.155, 0.155)
        for y in (-0.16, 0.155)
    ]
    return Link(
        body=[foot, casting],
        cover=[box, disc("z", o, 0.222, 0.244, 0.146, fillet=0.002)],
        metal=bolts + plugs,
        collision=[
            [block((-0.185, -0.195, 0.0), (0.185, 0.185, 0.044), 0.02)],
            [solid("z", o, 0.0, 0.08, 0.173), solid("z", o, 0.19, 0.243, 0.158)],
            [block((-0.095, -0.284, 0.055), (0.095, -0.10, 0.185), 0.014)],
        ],
    )


def link_1() -> Link:
    """Turntable and shoulder: carries the motor of joint 1 upright and that of joint 2 aside."""
    o, j2 = (0.0, 0.0, 0.0), (0.0, 0.150, 0.280)
    turntable = disc("z", o, 0.004, 0.07, 0.168, 0.165, fillet=0.01)
    neck = hull(
        disc("z", (0.0, 0.01, 0.0), 0.03, 0.085, 0.148, 0.135, fillet=0.012),
        disc("x", (0.0, 0.128, 0.262), -0.078, 0.078, 0.098, fillet=0.02),
    )
    motor_1 = disc("z", (-0.045, -0.098, 0.0), 0.06, 0.30, 0.062, 0.058, fillet=0.016)
    saddle = hull(
        disc("z", (-0.045, -0.098, 0.0), 0.05, 0.13, 0.07, fillet=0.012),
        disc("z", (-0.01, 0.05, 0.0), 0.05, 0.17, 0.085, fillet=0.012),
    )
    return Link(
        body=[turntable, neck, saddle, disc("x", j2, -0.098, 0.094, 0.132, fillet=0.016)],
        cover=[
            motor_1,
            disc("x", j2, -0.205, -0.09, 0.082, 0.09, fillet=0.016),
            disc("x", j2, 0.08, 0.1045, 0.118, fillet=0.002),
        ],
        accent=[
            disc("z", o, 0.026, 0.04, 0.1695, fillet=0.001),
            disc("x", j2, -0.112, -0.094, 0.104, 0.108, fillet=0.004),
        ],
        metal=screws("x", j2, -0.203, 0.062, 6, 0.005),
        collision=[
            [solid("z", o, 0.004, 0.08, 0.17), solid("x", j2, -0.098, 0.1045, 0.132)],
            [solid("x", j2, -0.207, -0.09, 0.105)],
            [solid("z", (-0.045, -0.098, 0.0), 0.0, 0.30, 0.07)],
        ],
    )


def link_2() -> Link:
    """Upper arm: one-sided, tapered, from joint 2 (origin) to joint 3 at z = 0.770."""
    o, j3 = (0.0, 0.0, 0.0), (0.0, 0.0, 0.770)
    beam = hull(
        disc("x", (0.0, 0.0, 0.10), 0.014, 0.088, 0.082, fillet=0.024),
        disc("x", (0.0, 0.0, 0.67), 0.044, 0.108, 0.062, fillet=0.024),
    )
    lower = hull(
        disc("x", o, 0.003, 0.09, 0.126, fillet=0.018),
        disc("x", (0.0, 0.0, 0.17), 0.014, 0.086, 0.07, fillet=0.022),
    )
    upper = hull(
        disc("x", j3, 0.041, 0.112, 0.103, fillet=0.016),
        disc("x", (0.0, 0.0, 0.62), 0.044, 0.106, 0.058, fillet=0.02),
    )
    return Link(
        body=[beam, lower, upper],
        cover=[
            disc("x", o, 0.085, 0.104, 0.094, fillet=0.007),
            disc("x", j3, 0.108, 0.126, 0.078, fillet=0.007),
        ],
        accent=[
            disc("x", o, 0.085, 0.0945, 0.104, fillet=0.002),
            disc("x", j3, 0.108, 0.1165, 0.087, fillet=0.002),
            block((0.094, -0.016, 0.30), (0.1035, 0.016, 0.56), 0.004),
        ],
        metal=screws("x", o, 0.103, 0.076, 8) + screws("x", j3, 0.125, 0.062, 8, 0.005),
        collision=[
            [solid("x", o, 0.003, 0.107, 0.127)],
            [
                solid("x", (0.0, 0.0, 0.10), 0.010, 0.095, 0.092),
                solid("x", (0.0, 0.0, 0.68), 0.041, 0.110, 0.075),
            ],
            [solid("x", j3, 0.041, 0.129, 0.104)],
        ],
    )


def link_3() -> Link:
    """Elbow: the housing of joint 3 (origin, about x) below that of joint 4 (about y)."""
    elbow, j4 = (-0.1445, 0.0, 0.0), (-0.1445, 0.0, 0.150)
    joint_3 = disc("x", elbow, -0.088, 0.134, 0.104, fillet=0.016)
    joint_4 = disc("y", j4, -0.115, 0.205, 0.095, 0.09, fillet=0.016)
    web = hull(
        disc("x", elbow, -0.08, 0.085, 0.096, fillet=0.024),
        disc("y", j4, -0.105, 0.10, 0.084, fillet=0.024),
    )
    motors = [
        disc("y", (-0.1445 + x, 0.0, 0.150 + z), -0.245, -0.11, 0.037, fillet=0.012, sections=40)
        for x, z in ((0.042, -0.03), (-0.042, -0.03), (0.0, 0.044))
    ]
    return Link(
        body=[joint_3, joint_4, web],
        cover=[
            disc("x", elbow, 0.12, 0.143, 0.092, fillet=0.002),
            disc("x", elbow, -0.178, -0.08, 0.07, 0.077, fillet=0.014),
            disc("y", j4, -0.135, -0.105, 0.09, fillet=0.008),
            disc("y", j4, 0.195, 0.229, 0.078, fillet=0.002),
            *motors,
        ],
        accent=[
            disc("y", j4, -0.1215, -0.111, 0.0935, fillet=0.002),
            disc("x", elbow, -0.1, -0.083, 0.087, 0.091, fillet=0.004),
        ],
        metal=screws("x", elbow, -0.176, 0.052, 6, 0.005),
        collision=[
            [solid("x", elbow, -0.1, 0.143, 0.104), solid("y", j4, -0.115, 0.10, 0.0935)],
            [solid("y", j4, -0.247, 0.229, 0.0935)],
            [solid("x", elbow, -0.181, -0.08, 0.08)],
        ],
    )


def link_4() -> Link:
    """Forearm tube from joint 4 (origin) to the fork that holds joint 5 at y = 0.454."""
    o, j5 = (0.0, 0.0, 0.0), (0.0, 0.454, 0.0)
    tube = hull(
        disc("y", o, 0.045, 0.10, 0.083, 0.079, fillet=0.012),
        disc("y", o, 0.30, 0.352, 0.056, 0.052, fillet=0.014),
    )
    cheeks, caps, pins = [], [], []
    for side in (-1.0, 1.0):
        cheeks.append(
            hull(
                disc("x", j5, 0.0415 * side - 0.0085, 0.0415 * side + 0.0085, 0.047, fillet=0.006),
                disc("y", (0.0, 0.32, 0.0), 0.0, 0.01, 0.05).slice_plane(
                    (0.022 * side, 0.0, 0.0), (side, 0.0, 0.0), cap=True
                ),
            )
        )
        caps.append(
            disc("x", j5, 0.05025 * side - 0.00425, 0.05025 * side + 0.00425, 0.036, fillet=0.003)
        )
        pins += screws("x", j5, 0.0525 * side, 0.027, 6, 0.0035)
    return Link(
        body=[disc("y", o, 0.003, 0.066, 0.09, 0.087, fillet=0.012), tube, *cheeks],
        cover=caps,
        accent=[disc("y", o, 0.019, 0.032, 0.0915, 0.091, fillet=0.001)],
        metal=pins,
        collision=[
            [solid("y", o, 0.003, 0.10, 0.089), solid("y", o, 0.30, 0.352, 0.055)],
            [
                solid("x", j5, -0.055, -0.033, 0.047),
                block((-0.053, 0.31, -0.045), (-0.025, 0.35, 0.045), 0.01),
            ],
            [
                solid("x", j5, 0.033, 0.055, 0.047),
                block((0.025, 0.31, -0.045), (0.053, 0.35, 0.045), 0.01),
            ],
        ],
    )


def link_5() -> Link:
    """Wrist: a slim knuckle about joint 5 (origin, x) and the nose of joint 6 (y)."""
    o = (0.0, 0.0, 0.0)
    knuckle = hull(
        disc("x", o, -0.0315, 0.0315, 0.046, fillet=0.008),
        disc("y", o, 0.03, 0.060, 0.031, fillet=0.006),
    )
    return Link(
        body=[knuckle, disc("y", o, 0.045, 0.079, 0.041, fillet=0.006)],
        cover=[disc("y", o, 0.074, 0.0875, 0.038, fillet=0.002)],
        accent=[disc("y", o, 0.063, 0.069, 0.0418, fillet=0.0008)],
        collision=[
            [solid("x", o, -0.0315, 0.0315, 0.046), solid("y", o, 0.03, 0.060, 0.031)],
            [solid("y", o, 0.045, 0.0875, 0.0418)],
        ],
    )


def link_6() -> Link:
    """Tool flange, 80 mm across, its face at y = 0.0215 (pattern as ISO 9409-1-63-4-M6)."""
    o = (0.0, 0.0, 0.0)
    return Link(
        metal=[disc("y", o, 0.0, 0.0215, 0.040, fillet=0.0015)],
        cover=[disc("y", o, 0.010, 0.0217, 0.020, fillet=0.0002, sections=48)]
        + [
            disc("y", (r * 0.0315, 0.0, s * 0.0315), 0.010, 0.0217, 0.004, fillet=0.0002)
            for r, s in ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0))
        ],
        collision=[[solid("y", o, 0.0, 0.0215, 0.040)]],
    )


LINKS = {f.__name__: f for f in (base, link_1, link_2, link_3, link_4, link_5, link_6)}


def write_meshes() -> None:
    """Write the meshes of every link."""
    MESHES.mkdir(exist_ok=True)
    for name, make in LINKS.items():
        link = make()
        for material in ("body", "cover", "accent", "metal"):
            if parts := getattr(link, material):
                trimesh.util.concatenate(parts).export(MESHES / f"{name}_{material}.stl")
        for number, group in enumerate(link.collision, start=1):
            hull(*group).export(MESHES / f"{name}_hull_{number}.stl")


def print_inertias() -> None:
    """Print each link's <inertial>: its hulls united, of one density, ARM_MASS in all."""
    solids = {
        name: trimesh.boolean.union([hull(*group) for group in make().collision])
        for name, make in LINKS.items()
    }
    density = ARM_MASS / sum(mesh.volume for mesh in solids.values())
    for name, mesh in solids.items():
        mesh.density = density
        x, y, z = np.round(mesh.center_mass, 4) + 0.0
        inertia = np.round(mesh.moment_inertia, 5) + 0.0  # no minus zero
        (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = inertia
        print(f"<!-- {name} -->")
        print(f'<inertial>\n  <origin xyz="{x:.4f} {y:.4f} {z:.4f}"/>')
        print(f'  <mass value="{mesh.mass:.2f}"/>')
        print(
            f'  <inertia ixx="{ixx:.5f}" ixy="{ixy:.5f}" ixz="{ixz:.5f}"'
            f' iyy="{iyy:.5f}" iyz="{iyz:.5f}" izz="{izz:.5f}"/>\n</inertial>'
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inertias", action="store_true", help="print the URDF's inertials")
    print_inertias() if parser.parse_args().inertias else write_meshes()
