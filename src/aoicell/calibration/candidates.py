"""Arm poses from which chessboard 2 can be photographed, in the cell as designed.

Reachable on the taught joint branch, away from limits and singular postures, free of contact,
with the whole board in the picture whatever the tolerances do.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from aoicell.calibration.problem import Mount
from aoicell.errors import Unreachable
from aoicell.nominal import Nominal, View
from aoicell.observation import CameraName
from aoicell.robot.collision import CollisionModel, Solid
from aoicell.targets.chessboard import Chessboard
from aoicell.toml_table import TomlTable
from aoicell.transforms import SE3, Array, translation

_PATH_STEP = float(np.radians(3))  # of the fastest joint, between two checks for contact


@dataclass(frozen=True)
class CandidateConfig:
    """Where cameras are drawn about the board, and what an arm pose has to keep away from.

    The camera looks at a point up to `aim_share` of the board's sides off its centre. All of
    the board stays `margin_px` inside the picture: a mount, a lens and a board that are three
    standard deviations off design move it by about as much. `branch_deg` is the furthest that
    a joint may be from where it is at the start of the hand-eye poses; the last one, which only
    rolls the camera, is free. Rolls of more than a quarter turn either way matter: what is wrong
    with the print turns over in the picture, and what it feigns of the camera cancels.
    """

    distance_mm: tuple[float, float] = (350.0, 650.0)
    tilt_deg: float = 35.0
    roll_deg: float = 150.0
    aim_share: float = 0.5
    margin_px: float = 120.0
    limit_deg: float = 10.0
    singularity: float = 0.08
    branch_deg: float = 120.0
    clearance_mm: float = 20.0


def hand_eye_start(nominal: Nominal) -> Array:
    """Joint angles (rad) of the taught start above chessboard 2: the branch of all poses."""
    T_base_camera = nominal.T_base_tabletarget * nominal.hand_eye_start.T_target_camera
    return nominal.arm.ik(_flange(nominal, T_base_camera), nominal.q_home, "hand-eye start")


def candidates(
    nominal: Nominal, count: int, rng: np.random.Generator, config: CandidateConfig
) -> list[Array]:
    """Joint angles (rad) of `count` usable poses, drawn evenly over what the config allows.

    Raises Unreachable when only one in a hundred draws, or fewer, can be used.
    """
    cell, q_start = collision_model(nominal, config.clearance_mm / 1e3), hand_eye_start(nominal)
    found: list[Array] = []
    for _, view in zip(range(100 * count), _draws(nominal.tabletarget, rng, config), strict=False):
        q = _posture(nominal, view, q_start, config)
        if q is not None and cell.touching(q) is None:
            found.append(q)
        if len(found) == count:
            return found
    raise Unreachable(
        f"calibration poses: {len(found)} of {100 * count} draws can be used, {count} are wanted; "
        "allow other distances and tilts, or move chessboard 2 closer to the arm"
    )


def free_path(cell: CollisionModel, q_from: Array, q_to: Array) -> bool:
    """Whether nothing touches on the straight joint path between two postures (rad)."""
    steps = max(1, int(np.ceil(np.abs(q_to - q_from).max() / _PATH_STEP)))
    shares = np.linspace(0, 1, steps + 1)[1:, None]
    return cell.first_touch(q_from + shares * (q_to - q_from)) is None


def _draws(board: Chessboard, rng: np.random.Generator, config: CandidateConfig) -> Iterator[View]:
    reach = config.aim_share * np.array(board.size) / 2
    while True:
        x, y = rng.uniform(-reach, reach)
        a, b = np.radians(rng.uniform(-config.tilt_deg, config.tilt_deg, 2))
        roll = float(np.radians(rng.uniform(-config.roll_deg, config.roll_deg)))
        distance = rng.uniform(*config.distance_mm) / 1e3
        yield View("candidate", distance, (a, b), roll, (x, y, 0.0))


def _posture(nominal: Nominal, view: View, q_start: Array, config: CandidateConfig) -> Array | None:
    """Joint angles (rad) for a view of the board; None where it is not to be used."""
    T_target_camera = view.T_target_camera
    camera, corners = nominal.cameras["hand"], nominal.tabletarget.corners
    if not camera.sees(corners, T_target_camera.inverse(), config.margin_px):
        return None
    T_base_flange = _flange(nominal, nominal.T_base_tabletarget * T_target_camera)
    try:
        q = nominal.arm.ik(T_base_flange, q_start)
    except Unreachable:
        return None
    good = (
        np.abs(q - q_start)[:-1].max() <= np.radians(config.branch_deg)
        and nominal.arm.limit_margin(q) >= np.radians(config.limit_deg)
        and nominal.arm.singularity_margin(q) >= config.singularity
    )
    return q if good else None


def _flange(nominal: Nominal, T_base_camera: SE3) -> SE3:
    return T_base_camera * nominal.T_flange_camera.inverse()


# -- The cell as designed, for contacts ----------------------------------------------------


_PLATE = 0.005  # a printed board with what it is glued on (m)
_TABLE = (0.1, 0.3)  # how far it surely reaches around what lies on it, how deep it is taken (m)


_TRIPOD = 0.1  # how far off design it may stand, set up by eye (m)


def collision_model(nominal: Nominal, clearance: float) -> CollisionModel:
    """Arm, cameras, table and boards from the design; bodies closer than `clearance` (m) touch.

    The table is a block under both boards, as high as the lower one and a little wider.
    """
    return CollisionModel(nominal.arm, [*_carried(nominal), *_standing(nominal)], clearance)


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
    yield Solid("server board", (x, y, top + thickness), middle)
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
