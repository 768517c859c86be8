"""The cell as designed, for contacts: what the arm carries and what stands around it."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from aoicell.nominal import Nominal
from aoicell.observation import CameraName
from aoicell.robot.collision import CollisionModel, Mount, Solid
from aoicell.targets.chessboard import Chessboard
from aoicell.toml_table import TomlTable
from aoicell.transforms import SE3, translation

BOARD = "server board"  # the solid that stands for the board with all its components

_PLATE = 0.005  # a printed board with what it is glued on (m)
_TABLE = (0.1, 0.3)  # how far it surely reaches around what lies on it, how deep it is taken (m)
_TRIPOD = 0.1  # how far off design it may stand, set up by eye (m)


def collision_model(
    nominal: Nominal, clearance: float, others: Iterable[Solid] = ()
) -> CollisionModel:
    """Arm, cameras, table and boards from the design; bodies closer than `clearance` (m) touch.

    The table is a block under both boards, as high as the lower one and a little wider. `others`
    are whatever else must not be touched.
    """
    solids = [*_carried(nominal), *_standing(nominal), *others]
    return CollisionModel(nominal.arm, solids, clearance)


def keep_out(nominal: Nominal) -> Iterator[Solid]:
    """The room that the hand camera's cables need: boxes from its folder, on the flange."""
    table = TomlTable.read(nominal.models["hand"] / "camera.toml")
    for entry in table.each("keep_out") if "keep_out" in table.values else []:
        x, y, z = (float(side) for side in entry.numbers("size_m", count=3))
        middle = SE3(np.eye(3), entry.numbers("centre_m", count=3))
        T_flange_solid = nominal.T_flange_camera * middle
        yield Solid(entry.text("name"), (x, y, z), T_flange_solid, "flange")


def _carried(nominal: Nominal) -> Iterator[Solid]:
    yield from _hulls(nominal, "hand", nominal.T_flange_camera, "flange")
    yield _plate("chessboard 1", nominal.armtarget, nominal.T_flange_armtarget, "flange")


def _standing(nominal: Nominal) -> Iterator[Solid]:
    for solid in (*_hulls(nominal, "tripod", nominal.T_base_tripod, "base"), *_legs(nominal)):
        yield replace(solid, slack=_TRIPOD)
    yield _plate("chessboard 2", nominal.tabletarget, nominal.T_base_tabletarget, "base")
    x, y, thickness = nominal.board.size
    top = max((c.top for c in nominal.board.components), default=0.0)
    middle = nominal.T_base_board * translation(z=(top - thickness) / 2)
    yield Solid(BOARD, (x, y, top + thickness), middle)
    sizes = [(nominal.T_base_board, (x, y)), (nominal.T_base_tabletarget, nominal.tabletarget.size)]
    corners = np.vstack([
        T.translation + 0.5 * np.array([[sx * w, sy * h, 0] for sx in (-1, 1) for sy in (-1, 1)])
        @ T.rotation.T for T, (w, h) in sizes
    ])  # fmt: skip
    around, depth = _TABLE
    low, high = corners[:, :2].min(axis=0) - around, corners[:, :2].max(axis=0) + around
    x, y = (low + high) / 2
    height = float(corners[:, 2].min())
    block = (float(high[0] - low[0]), float(high[1] - low[1]), depth)
    yield Solid("table", block, translation(x, y, height - depth / 2))


def _plate(name: str, board: Chessboard, T: SE3, mount: Mount) -> Solid:
    middle = T * translation(z=-_PLATE / 2)
    return Solid(name, (*board.size, _PLATE), middle, mount)


def _hulls(
    nominal: Nominal, name: CameraName, T: SE3, mount: Mount, frame: str = "camera",
    stretch: float = 1.0,
) -> Iterator[Solid]:  # fmt: skip
    """The convex meshes of a camera folder that are given in a frame, stretched along its z."""
    folder = nominal.models[name]
    table = TomlTable.read(folder / "camera.toml")
    entries = table.each("collision") if "collision" in table.values else []
    for index, entry in enumerate(entries, start=1):
        if entry.text("frame") == frame:
            file = folder / entry.text("file")
            yield Solid(f"{name} {index}", file, T, mount, (1.0, 1.0, stretch))


def _legs(nominal: Nominal) -> Iterator[Solid]:
    """The tripod's legs, upright from the ball joint down to the floor."""
    mount = TomlTable.read(nominal.models["tripod"] / "camera.toml").values.get("mount", {})
    if "ball_m" in mount:
        ball = nominal.T_world_base * nominal.T_base_tripod.act(np.array(mount["ball_m"]))
        upright = nominal.T_world_base.actInv(SE3(np.eye(3), ball))
        stretch = float(ball[2]) / float(mount["legs_height_m"])
        yield from _hulls(nominal, "tripod", upright, "base", "legs", stretch)
