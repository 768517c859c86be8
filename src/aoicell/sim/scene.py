"""Composes the MuJoCo model of a cell from its folder, for a given geometry.

The same function builds the as-built cell (from a drawn geometry) and the nominal twin
(from the designed one).
"""

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from aoicell.errors import ModelError
from aoicell.nominal import Nominal
from aoicell.observation import CameraName
from aoicell.planning.meshes import BoardMesh
from aoicell.sim.as_built import Geometry, Light, Surfaces
from aoicell.sim.board_mesh import add_board_mesh
from aoicell.sim.board_scene import add_board
from aoicell.sim.drawing import stream
from aoicell.sim.lamps import set_lamps
from aoicell.sim.population import Population
from aoicell.sim.prints import dusty, printed_size
from aoicell.sim.props import GROUP as PROPS_GROUP
from aoicell.sim.props import add_props
from aoicell.sim.solids import Face, add_printed_plate, set_pose
from aoicell.targets.chessboard import Chessboard
from aoicell.toml_table import TomlTable
from aoicell.transforms import SE3, rotation, translation

HULLS = 0  # geometry group of what collides but is not drawn
PLATE = 0.003  # thickness of a printed chessboard's plate (m)
ARM = "arm/"  # prefix of all names that come from the URDF

Sizes = Mapping[CameraName, tuple[int, int, float]]


def optical_to_mujoco(T_parent_camera: SE3) -> SE3:
    """Pose of MuJoCo's camera, which looks along -z with y up, from OpenCV's optical frame.

    The one place where the half turn between the two conventions stands.
    """
    return T_parent_camera * rotation("x", np.pi)


def visible(props: bool = False) -> mujoco.MjvOption:
    """What is drawn: everything but the collision hulls, and the props where there is one out."""
    option = mujoco.MjvOption()
    option.geomgroup[HULLS] = 0
    option.geomgroup[PROPS_GROUP] = props
    return option


def mocap_bodies(model: mujoco.MjModel) -> dict[str, int]:
    """The places in `mocap_pos` of the bodies that are put where one wants, by name."""
    bodies = (model.body(index) for index in range(model.nbody))
    return {body.name: int(body.mocapid[0]) for body in bodies if body.mocapid[0] >= 0}


def build_model(
    nominal: Nominal, geometry: Geometry, pinholes: Sizes, light: Light, surfaces: Surfaces,
    props: bool = False, population: Population | None = None, part: BoardMesh | None = None,
) -> mujoco.MjModel:  # fmt: skip
    """Compile the cell. `pinholes` gives width, height (px) and focal length (px) by camera.

    A population is on the board instead of what was designed; a part lies instead of the board.

    Raises ModelError naming the file that is missing or broken.
    """
    room = nominal.folder / "cell.xml"
    spec = _load(room)
    spec.visual.global_.offwidth = max(width for width, _, _ in pinholes.values())
    spec.visual.global_.offheight = max(height for _, height, _ in pinholes.values())
    set_lamps(spec, light)
    _attach_arm(spec, nominal, geometry)
    flange = spec.body(ARM + "flange")
    hand = flange.add_body(name="hand")
    set_pose(hand, geometry.T_flange_camera)
    _add_camera_model(spec, hand, nominal.models["hand"], "hand")
    _add_lens(hand, "hand", *pinholes["hand"])
    _add_armtarget(spec, flange, nominal.armtarget, geometry, surfaces)
    T_world_base = nominal.T_world_base
    table = spec.worldbody.add_body(name="tabletarget")
    set_pose(table, T_world_base * geometry.T_base_tabletarget)
    _add_chessboard(spec, table, "tabletarget", nominal.tabletarget, geometry, surfaces)
    _add_tripod(spec, nominal, T_world_base * geometry.T_base_tripod)
    _add_lens(spec.body("tripod"), "tripod", *pinholes["tripod"])
    board = spec.worldbody.add_body(name="board", mocap=True)
    set_pose(board, T_world_base * geometry.T_base_board)
    if part is not None:
        add_board_mesh(spec, board, part)
    else:
        add_board(
            spec, board, nominal.board, geometry.Ts_board_marker, geometry.print_scales, surfaces,
            population,
        )  # fmt: skip
    if props:
        add_props(spec, nominal)
    try:
        model = spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise ModelError(f"{room}: the cell does not compile: {reason}") from None
    return model


def _load(path: Path) -> mujoco.MjSpec:
    if not path.is_file():
        raise ModelError(f"{path}: no such file; the cell needs it")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise ModelError(f"{path}: not readable: {' '.join(str(error).split())}") from None


def _attach_arm(spec: mujoco.MjSpec, nominal: Nominal, geometry: Geometry) -> None:
    urdf = nominal.arm.urdf
    arm = _load(urdf)
    for mesh in arm.meshes:
        mesh.file = str(_existing(urdf.parent / mesh.file, urdf))
    bodies = [arm.joint(name).parent for name in nominal.arm.joint_names] + [arm.body("flange")]
    for body, correction in zip(bodies, geometry.joint_corrections, strict=True):
        origin = SE3(_matrix(body.quat), np.array(body.pos))
        set_pose(body, origin * correction)
    mount = spec.worldbody.add_frame()
    set_pose(mount, nominal.T_world_base)
    spec.attach(arm, prefix=ARM, frame=mount)


def _existing(path: Path, named_in: Path) -> Path:
    if not path.is_file():
        raise ModelError(f"{path}: no such mesh; {named_in} names it")
    return path


def _matrix(quat: np.ndarray) -> np.ndarray:
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, np.asarray(quat, dtype=float))
    return R.reshape(3, 3)


def _add_camera_model(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    folder: Path,
    name: str,
    frame: str = "camera",
    scale_z: float = 1.0,
) -> None:
    """The meshes and hulls of a camera folder that are given in `frame`."""
    table = TomlTable.read(folder / "camera.toml")
    for key, prefix in (("mesh", "mesh"), ("collision", "hull")):
        entries = table.each(key) if key in table.values else []
        for index, entry in enumerate(entries):
            if entry.text("frame") != frame:
                continue
            file = _existing(folder / entry.text("file"), table.source)
            mesh = f"{name}_{prefix}_{index}"
            spec.add_mesh(name=mesh, file=str(file), scale=[1, 1, scale_z])
            collides = key == "collision"
            rgba = [0.5, 0.5, 0.5, 1] if collides else entry.numbers("rgba", count=4)
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, rgba=rgba, mass=0,
                group=HULLS if collides else 1, contype=int(collides), conaffinity=int(collides),
            )  # fmt: skip


def _add_lens(body: mujoco.MjsBody, name: str, width: int, height: int, focal_px: float) -> None:
    """A centred pinhole in the body's optical frame; the lens model is applied to its picture."""
    lens = body.add_camera(name=name, fovy=float(2 * np.degrees(np.arctan(height / 2 / focal_px))))
    set_pose(lens, optical_to_mujoco(SE3.Identity()))


def _add_chessboard(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, target: Chessboard, geometry: Geometry,
    surfaces: Surfaces,
) -> None:  # fmt: skip
    """A board as printed, bent and dusty as it is."""
    rng = stream(*surfaces.seed, -1, f"dust_{name}")
    image = dusty(target.print_image(), target.size, surfaces.dust, rng)
    size = (*printed_size(target.size, geometry.print_scales[name]), PLATE)
    bow, twist = geometry.bows[name]
    face = Face(bow=bow, twist=twist, glare=surfaces.glare)
    add_printed_plate(spec, body, name, image, size, face=face)


def _add_armtarget(
    spec: mujoco.MjSpec, flange: mujoco.MjsBody, target: Chessboard, geometry: Geometry,
    surfaces: Surfaces,
) -> None:  # fmt: skip
    """Chessboard 1 and the bar that carries it from the flange's side."""
    T_flange_armtarget = geometry.T_flange_armtarget
    body = flange.add_body(name="armtarget")
    set_pose(body, T_flange_armtarget)
    _add_chessboard(spec, body, "armtarget", target, geometry, surfaces)
    reach = float(np.linalg.norm(T_flange_armtarget.translation))
    inner, outer = 0.030, reach + 0.25 * target.size[1]
    bar = flange.add_body(name="bracket")
    along = T_flange_armtarget.translation / reach
    R = np.column_stack([np.cross(along, [0, 0, 1]), along, [0, 0, 1]])
    set_pose(bar, SE3(R, np.zeros(3)) * translation(0, (inner + outer) / 2, PLATE + 0.004))
    bar.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.015, (outer - inner) / 2, 0.004],
        rgba=[0.93, 0.45, 0.10, 1], group=1, mass=0,
    )  # fmt: skip


def _add_tripod(spec: mujoco.MjSpec, nominal: Nominal, T_world_tripod: SE3) -> None:
    """The camera on its head, and upright legs that reach the floor below the ball joint."""
    folder = nominal.models["tripod"]
    body = spec.worldbody.add_body(name="tripod")
    set_pose(body, T_world_tripod)
    _add_camera_model(spec, body, folder, "tripod")
    table = TomlTable.read(folder / "camera.toml")
    if "mount" not in table.values or "ball_m" not in table.sub("mount").values:
        return  # a camera without legs, fixed to the room
    ball = T_world_tripod.act(table.numbers("mount", "ball_m", count=3))
    legs = spec.worldbody.add_body(name="tripod_legs", pos=ball)
    scale = float(ball[2]) / table.number("mount", "legs_height_m")
    _add_camera_model(spec, legs, folder, "legs", frame="legs", scale_z=scale)
