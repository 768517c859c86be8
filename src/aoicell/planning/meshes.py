"""Any mesh that trimesh reads, as the board: its frame, its relief, targets on a point grid.

Frame `board` of a mesh: origin at the centre of the upper side of its bounding box, axes as in the
file, z up. It lies where the cell has the board, on the same supports.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.board import BoardDesign
from aoicell.errors import InputError, did_you_mean
from aoicell.nominal import Nominal
from aoicell.planning.heights import HeightField
from aoicell.planning.targets import Feature
from aoicell.transforms import Array, translation

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 25.4e-3}
LONGEST, SHORTEST = 2.0, 0.005  # sides of a part that an arm's camera inspects (m)
GREY = (0.75, 0.76, 0.78)
_CELLS = 500  # of the relief, along the longer side
_SLOPE = 1.0  # steeper than 45 degrees is a wall, no upward face
_FLAT = 1e-3  # around a target over which its slope is taken (m)


@dataclass(frozen=True, eq=False)
class BoardMesh:
    """Triangles of a part in the frame `board`: `vertices` (N, 3) in m, `faces` (M, 3)."""

    name: str
    vertices: Array
    faces: NDArray[np.int32]

    @property
    def size(self) -> tuple[float, float, float]:
        """Sides of its bounding box (m)."""
        x, y, z = map(float, np.ptp(self.vertices, axis=0))
        return x, y, z


def read_mesh(path: Path, unit: str = "m") -> BoardMesh:
    """Read a mesh file; `unit` is that of its numbers. Raises InputError."""
    if unit not in UNITS:
        raise InputError(f"--unit {unit}: {did_you_mean(unit, UNITS)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; give a mesh or a board's folder")
    import trimesh  # only where a mesh is read: it takes long to import

    try:
        mesh: Any = trimesh.load(path, force="mesh")
        vertices = np.asarray(mesh.vertices, dtype=float) * UNITS[unit]
        faces = np.asarray(mesh.faces, dtype=np.int32)
    except Exception as error:  # trimesh raises whatever its many readers raise
        reason = (" ".join(str(error).split()) or type(error).__name__)[:120]
        raise InputError(f"{path}: trimesh cannot read it as a mesh: {reason}") from None
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(f"{path}: holds no triangles with finite corners; export it as a mesh")
    _check_size(path, vertices, unit)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    origin = np.array([*(low + high)[:2] / 2, high[2]])
    return BoardMesh(path.stem, vertices - origin, faces)


def _check_size(path: Path, vertices: Array, unit: str) -> None:
    sides = np.ptp(vertices, axis=0)
    longest = float(sides.max())
    if SHORTEST <= longest <= LONGEST:
        return
    other = next(
        (u for u, f in UNITS.items() if SHORTEST <= longest * f / UNITS[unit] <= LONGEST), None
    )
    x, y, z = (f"{side:.4g}" for side in sides)
    hint = f"if its numbers are {other}, say --unit {other}" if other else "give another mesh"
    raise InputError(
        f"{path}: read in {unit} it is {x} x {y} x {z} m; a part is {SHORTEST * 1e3:g} mm to "
        f"{LONGEST:g} m long: {hint}"
    )


def cell_with(nominal: Nominal, mesh: BoardMesh) -> Nominal:
    """The cell in which a mesh lies instead of the board, on the same supports."""
    x, y, z = mesh.size
    board = BoardDesign(mesh.name, (x, y, z), GREY, (), ())
    lift = z - nominal.board.size[2]
    return replace(nominal, board=board, T_base_board=nominal.T_base_board * translation(z=lift))


def heights_of_mesh(mesh: BoardMesh) -> HeightField:
    """The relief of a mesh from above: its upward triangles, cut up until they are cells."""
    import trimesh

    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    upward = solid.face_normals[:, 2] > 1e-6
    cell = max(mesh.size[:2]) / _CELLS
    vertices, faces = trimesh.remesh.subdivide_to_size(
        mesh.vertices, mesh.faces[upward], cell, max_iter=40
    )
    points = np.vstack([vertices[np.unique(faces)], vertices[faces].mean(axis=1)])
    columns, rows = (int(np.ceil(side / cell)) + 3 for side in mesh.size[:2])
    origin = (-(columns - 1) / 2 * cell, -(rows - 1) / 2 * cell)
    column, row = np.rint((points[:, :2] - origin) / cell).astype(int).T
    heights = np.full((rows, columns), -np.inf, dtype=np.float32)
    np.maximum.at(heights, (row, column), points[:, 2].astype(np.float32))
    around = cv2.dilate(heights, np.ones((3, 3), np.uint8))  # a cell may have got no point
    heights = np.where(np.isinf(heights), around, heights)
    return HeightField(np.where(np.isinf(heights), np.nan, heights).astype(float), origin, cell)


def grid_features(mesh: BoardMesh, field: HeightField, spacing: float) -> list[Feature]:
    """Targets on a point grid (m) over the upward faces. Raises InputError when there is none."""
    xs, ys = (_grid(side, spacing) for side in mesh.size[:2])
    xy = np.array([(x, y) for y in ys for x in xs])
    step = max(_FLAT, 2 * field.cell)
    z, slope = field.at(xy), np.column_stack([
        (field.at(xy + d) - field.at(xy - d)) / (2 * step) for d in step * np.eye(2)
    ])  # fmt: skip
    usable = np.flatnonzero(np.isfinite(z) & (np.hypot(*slope.T) <= _SLOPE))
    if not len(usable):
        raise InputError(
            f"{mesh.name}: no point of a {spacing * 1e3:g} mm grid lies on an upward face; "
            "turn the mesh (z is up) or choose a smaller --spacing"
        )
    features = []
    for number, k in enumerate(usable, start=1):
        point = np.array([[*xy[k], z[k]]])
        normal = np.array([*-slope[k], 1.0])
        normal /= np.linalg.norm(normal)
        name = f"T{number:03d}"
        features.append(Feature(name, "point", "surface", point, point, 1.0, normal))
    return features


def _grid(length: float, spacing: float) -> Array:
    count = max(1, int(length / spacing))
    return np.asarray((np.arange(count) - (count - 1) / 2) * spacing)
