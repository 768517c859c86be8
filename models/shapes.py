"""The solids that the models' meshes are made of: discs, rods, blocks and their convex hulls.

All lengths are in metres. The scripts of the models share them, so that a mesh is written with
the same bytes each time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh import Trimesh

Point = Sequence[float] | NDArray[np.float64]
ROUND_FROM = 0.004  # a smaller rim is a chamfer: nobody sees the difference


def disc(
    axis: str,
    centre: Point,
    start: float,
    stop: float,
    radius: float,
    end_radius: float | None = None,
    *,
    fillet: float = 0.001,
    bore: float = 0.0,
    rounded: bool | None = None,
    sections: int = 40,
) -> Trimesh:
    """Return a cylinder or cone (a tube, with a `bore`) about `axis` through `centre`.

    It runs from `start` to `stop`, both relative to `centre`; its rims are broken by `fillet`:
    `rounded`, or with a chamfer, which is the rule for small ones.
    """
    end_radius = radius if end_radius is None else end_radius
    lower = np.array([[radius - fillet, start], [radius, start + fillet]])
    upper = np.array([[end_radius, stop - fillet], [end_radius - fillet, stop]])
    if fillet >= ROUND_FROM if rounded is None else rounded:
        arc = np.linspace(0.0, np.pi / 2, 4)
        s, c = fillet * np.sin(arc), fillet * np.cos(arc)
        lower = np.c_[radius - fillet + s, start + fillet - c]
        upper = np.c_[end_radius - fillet + c, stop - fillet + s]
    profile = np.vstack([[bore, start], lower, upper, [bore, stop]])
    if bore:
        profile = np.vstack([profile, profile[:1]])
    mesh = trimesh.creation.revolve(profile, sections=sections)
    mesh.vertices = np.roll(mesh.vertices, "zxy".index(axis), axis=1) + np.asarray(centre)
    return mesh


def rod(
    start: Point,
    stop: Point,
    radius: float,
    end_radius: float | None = None,
    *,
    fillet: float = 0.001,
    sections: int = 32,
) -> Trimesh:
    """Return a round bar between two points, its rims chamfered by `fillet`."""
    a, b = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    length = float(np.linalg.norm(b - a))
    mesh = disc(
        "z", (0, 0, 0), 0.0, length, radius, end_radius,
        fillet=fillet, rounded=False, sections=sections,
    )  # fmt: skip
    z = (b - a) / length
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    mesh.vertices = mesh.vertices @ np.array([x, np.cross(z, x), z]) + a
    return mesh


def hull(*parts: Trimesh) -> Trimesh:
    """Return the convex hull of all `parts`."""
    mesh: Trimesh = trimesh.convex.convex_hull(np.vstack([part.vertices for part in parts]))
    return mesh


def block(
    low: Point,
    high: Point,
    corner: float = 0.003,
    *,
    fillet: float | None = None,
    sections: int = 20,
) -> Trimesh:
    """Return a box between two corners, its upright edges rounded by `corner`, the rest broken."""
    rim = min(0.001, corner / 2) if fillet is None else fillet
    return hull(
        *(
            disc("z", (x, y, 0.0), low[2], high[2], corner, fillet=rim, sections=sections)
            for x in (low[0] + corner, high[0] - corner)
            for y in (low[1] + corner, high[1] - corner)
        )
    )
