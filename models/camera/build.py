"""Write the meshes of the hand camera and its holder to meshes/*.stl.

Binary STL in metres, in the camera's optical frame: the origin is the entrance pupil, +z looks
forward, +x right, +y down. The flange face is the plane z = -0.050 and all geometry lies between
it and z = -0.002, so that the camera never sees itself.

    python build.py
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from trimesh import Trimesh

sys.path.insert(0, str(Path(__file__).parents[1]))
from shapes import block, disc, hull

MESHES = Path(__file__).parent / "meshes"
FLANGE_Z, FRONT_Z = -0.050, -0.002  # the flange face, the rim of the lens
BOLT_CIRCLE = 0.0315  # four M6 screws, ISO 9409-1-63-4-M6


def hose(points: list[tuple[float, float, float]], radius: float) -> list[Trimesh]:
    """Return a cable through `points`."""
    beads: list[Trimesh] = []
    for point in points:
        bead = trimesh.creation.uv_sphere(radius=radius, count=(10, 16))
        beads.append(bead.apply_translation(point))
    return [hull(a, b) for a, b in pairwise(beads)]


def holder() -> list[Trimesh]:
    """Printed bracket: a plate on the flange with a tab for the cable, two jaws with ribs."""
    parts = [disc("z", (0.0, 0.0, 0.0), FLANGE_Z, -0.0435, 0.040, sections=72)]
    parts.append(block((-0.015, 0.020, FLANGE_Z), (0.003, 0.062, -0.0445), 0.006))  # cable tab
    for side in (-1.0, 1.0):
        jaw = sorted((0.0198 * side, 0.0258 * side))
        parts.append(block((jaw[0], -0.0165, -0.045), (jaw[1], 0.0165, -0.0215)))
        for y in (-0.012, 0.012):
            foot = disc("z", (0.034 * side, y * 0.8, 0.0), -0.045, -0.0425, 0.002, sections=16)
            top = disc("z", (0.0245 * side, y, 0.0), -0.045, -0.0245, 0.002, sections=16)
            parts.append(hull(foot, top))
    return parts


def body() -> list[Trimesh]:
    """Camera housing, 40 x 40 x 20 mm, with cooling fins on its upper side, and the cable."""
    parts = [
        block((-0.020, -0.020, -0.0430), (0.020, 0.020, -0.0355)),
        block((-0.0190, -0.0190, -0.0360), (0.0190, 0.0190, -0.0275)),
        block((-0.020, -0.020, -0.0280), (0.020, 0.020, -0.0228)),
    ]
    for z in (-0.0342, -0.0317, -0.0292):
        parts.append(block((-0.020, -0.020, z - 0.0006), (0.020, 0.020, z + 0.0006), 0.003))
    parts.append(disc("y", (-0.006, 0.0, -0.0335), 0.027, 0.044, 0.0058))
    bend = [
        (-0.006, 0.044 + 0.0105 * np.sin(a), -0.0440 + 0.0105 * np.cos(a))
        for a in np.linspace(0.0, np.pi / 2, 9)
    ]
    parts += hose([(-0.006, 0.040, -0.0335), *bend, (-0.006, 0.0545, -0.0465)], 0.0033)
    return parts


def lens() -> list[Trimesh]:
    """C-mount lens of 12 mm, its two rings knurled, its front open to the glass."""
    o = (0.0, 0.0, 0.0)
    parts = [
        disc("z", o, -0.0235, -0.0195, 0.0142),
        disc("z", o, -0.0200, -0.0070, 0.0138, bore=0.0095),
        disc("z", o, -0.0075, FRONT_Z, 0.0150, fillet=0.0006, bore=0.0105),
    ]
    for low, high in ((-0.0185, -0.0145), (-0.0125, -0.0085)):
        parts.append(disc("z", o, low, high, 0.0146, fillet=0.0003, bore=0.0095))
        for angle in np.arange(36) * 2 * np.pi / 36:
            place = (0.0146 * np.cos(angle), 0.0146 * np.sin(angle), 0.0)
            parts.append(disc("z", place, low, high, 0.0006, fillet=0.0002, sections=6))
    return parts


def metal() -> list[Trimesh]:
    """Screws of the flange and of the jaws, the connectors, the C-mount ring."""
    parts = [disc("z", (0.0, 0.0, 0.0), -0.0232, -0.0222, 0.0155, fillet=0.0003)]
    for angle in np.arange(4) * np.pi / 2 + np.pi / 2:
        place = (BOLT_CIRCLE * np.cos(angle), BOLT_CIRCLE * np.sin(angle), 0.0)
        parts.append(disc("z", place, -0.0440, -0.0385, 0.005, sections=24))
    for side in (-1.0, 1.0):
        for y in (-0.008, 0.008):
            low, high = sorted((0.0250 * side, 0.0278 * side))
            parts.append(disc("x", (0.0, y, -0.033), low, high, 0.0026, fillet=0.0004, sections=16))
    parts.append(disc("y", (-0.006, 0.0, -0.0335), 0.018, 0.029, 0.0050, fillet=0.0005))
    parts.append(disc("y", (0.009, 0.0, -0.0335), 0.018, 0.025, 0.0042, fillet=0.0005))
    for x in (-0.0160, 0.0160):
        for y in (-0.0160, 0.0160):
            parts.append(
                disc("z", (x, y, 0.0), -0.0235, -0.0222, 0.0016, fillet=0.0003, sections=12)
            )
    return parts


def glass() -> list[Trimesh]:
    """Front element, set back behind the rim."""
    return [disc("z", (0.0, 0.0, 0.0), -0.0090, -0.0048, 0.0106, fillet=0.0012)]


def main() -> None:
    """Write the visual meshes and the two convex ones that collide."""
    MESHES.mkdir(exist_ok=True)
    for part in (holder, body, lens, metal, glass):
        trimesh.util.concatenate(part()).export(MESHES / f"camera_{part.__name__}.stl")
    plate = disc("z", (0.0, 0.0, 0.0), FLANGE_Z, -0.0385, 0.041, fillet=0.0001, sections=20)
    jaws = block((-0.028, -0.021, -0.0435), (0.028, 0.021, -0.0215))
    cable = block((-0.015, 0.018, -0.050), (0.014, 0.0620, -0.0275))
    front = disc("z", (0.0, 0.0, 0.0), -0.0235, FRONT_Z, 0.0158, fillet=0.0001, sections=20)
    for number, mesh in enumerate((hull(plate, jaws), hull(front, jaws), cable), start=1):
        mesh.export(MESHES / f"camera_hull_{number}.stl")


if __name__ == "__main__":
    main()
