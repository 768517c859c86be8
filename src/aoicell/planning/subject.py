"""What views are planned for: a board's folder, or a mesh; its targets, or the user's own."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from aoicell.board import BoardDesign
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.planning.coverage import Limits, Scene
from aoicell.planning.list_check import load_checked
from aoicell.planning.meshes import BoardMesh, cell_with, grid_features, heights_of_mesh, read_mesh
from aoicell.planning.pick_and_place import placement_features, read_placements
from aoicell.planning.scene import board_scene, lamps_of
from aoicell.planning.targets import Hidden


@dataclass(frozen=True)
class Subject:
    """A cell with the board that is planned for, and what must be seen of it.

    `hidden` is built over; `kinds` names the kind of each target; `mesh`, if the board is one.
    """

    nominal: Nominal
    scene: Scene
    hidden: tuple[Hidden, ...]
    kinds: dict[str, str]
    mesh: BoardMesh | None = None


@dataclass(frozen=True)
class Wishes:
    """What the user says beside the board.

    `unit` of a mesh's numbers, or with a board's folder of those in the list whose columns name
    none; `targets`: a pick-and-place list; `spacing` (m) of the point grid on a mesh.
    """

    unit: str | None = None
    targets: Path | None = None
    spacing: float = 0.01
    limits: Limits = field(default_factory=Limits)


def subject_of(nominal: Nominal, source: Path, wishes: Wishes) -> Subject:
    """Read a board's folder or a mesh into a cell. Raises InputError naming what is wrong."""
    if not 1e-3 <= wishes.spacing <= 1.0:
        raise InputError(f"--spacing {wishes.spacing * 1e3:g}: give 1 to 1000 mm")
    if source.is_dir():
        board = _board(nominal, load_checked(source), wishes)
        return _own_targets(board, wishes.targets, wishes.unit)
    part = _mesh(nominal, read_mesh(source, wishes.unit or "m"), wishes)
    return _own_targets(part, wishes.targets, None)


def _board(nominal: Nominal, board: BoardDesign, wishes: Wishes) -> Subject:
    nominal = replace(nominal, board=board)
    scene, hidden = board_scene(nominal, wishes.limits)
    return Subject(nominal, scene, tuple(hidden), {c.id: c.kind for c in board.components})


def _mesh(nominal: Nominal, mesh: BoardMesh, wishes: Wishes) -> Subject:
    nominal = cell_with(nominal, mesh)
    heights = heights_of_mesh(mesh)
    features = [] if wishes.targets else grid_features(mesh, heights, wishes.spacing)
    camera, lamps = nominal.cameras["hand"], lamps_of(nominal)
    scene = Scene(features, heights, camera, lamps, wishes.limits)
    return Subject(nominal, scene, (), {f.target: f.kind for f in features}, mesh)


def _own_targets(subject: Subject, targets: Path | None, unit: str | None) -> Subject:
    """The user's list instead of the targets that the board's own data give."""
    if targets is None:
        return subject
    features = placement_features(targets, read_placements(targets, unit), subject.scene.field)
    scene = replace(subject.scene, features=features)
    return replace(subject, scene=scene, hidden=(), kinds={f.target: f.kind for f in features})
