"""The cell as designed: the only prior knowledge of the estimating code.

Read from a cell folder's `nominal.toml` and the model folders that it names.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from aoicell.board import BoardDesign, MarkerDesign, load_board, with_markers
from aoicell.camera import Camera
from aoicell.errors import ModelError
from aoicell.observation import CameraName
from aoicell.robot import Arm
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.marker import Marker, make_marker
from aoicell.toml_table import TomlTable
from aoicell.transforms import SE3, Array, from_xyz_rpy, looking_at

POSES = (
    "T_world_base",
    "T_flange_camera",
    "T_flange_armtarget",
    "T_base_tabletarget",
    "T_base_board",
    "T_base_tripod",
)


@dataclass(frozen=True)
class View:
    """A camera pose relative to a target: aim (x, y, z) in its frame, m and rad."""

    id: str
    distance: float
    tilt: tuple[float, float] = (0.0, 0.0)
    roll: float = 0.0
    aim: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shows: str = ""

    @property
    def T_target_camera(self) -> SE3:
        """The camera's pose in the target's frame."""
        return looking_at(self.aim, self.distance, self.tilt, self.roll)


@dataclass(frozen=True)
class Nominal:
    """A cell's design: models, design poses, and the views that the procedure takes."""

    name: str
    folder: Path
    models: Mapping[str, Path]
    arm: Arm
    q_home: Array
    cameras: Mapping[CameraName, Camera]
    board: BoardDesign
    armtarget: Chessboard
    tabletarget: Chessboard
    T_world_base: SE3
    T_flange_camera: SE3
    T_flange_armtarget: SE3
    T_base_tabletarget: SE3
    T_base_board: SE3
    T_base_tripod: SE3
    T_base_flange_setup: SE3
    hand_eye_start: View
    check: View
    overview: View
    inspection_views: tuple[View, ...]

    @property
    def positioning(self) -> MarkerDesign:
        """The marker that serves to locate the board; the others measure."""
        return next(m for m in self.board.markers if m.role == "positioning")

    @property
    def marker(self) -> Marker:
        """The positioning marker as printed; those of a board are alike but for their codes."""
        m = self.positioning
        return make_marker(m.kind, m.size, m.pitch, m.code)

    @property
    def marker_codes(self) -> Mapping[str, str | None]:
        """What each marker says of itself when it is sighted, by id; None for the plain one.

        None also for a marker of another kind than the positioning one: nobody looks for it.
        """
        kind = self.positioning.kind
        return {m.id: (m.code or None) if m.kind == kind else None for m in self.board.markers}

    @property
    def T_board_positioning(self) -> SE3:
        """Its design pose on the board."""
        m = self.positioning
        return from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation])

    def with_markers(
        self, kind: str = "", size: float = 0.0, pitch: float = 0.0, make_room: bool = False
    ) -> "Nominal":
        """The cell whose board has other markers (m); see `aoicell.board.with_markers`."""
        return replace(self, board=with_markers(self.board, kind, size, pitch, make_room))


def load_nominal(folder: Path) -> Nominal:
    """Read a cell folder. Raises ModelError naming the file and key that is missing or wrong."""
    source = folder / "nominal.toml"
    table = TomlTable.read(source)
    paths = {name: (folder / table.text("models", name)).resolve() for name in _MODELS}
    cameras: dict[CameraName, Camera] = {
        "hand": load_camera(paths["hand"]),
        "tripod": load_camera(paths["tripod"]),
    }
    arm = Arm(_only_urdf(paths["arm"]))
    q_home = np.radians(table.numbers("arm", "home_deg", count=arm.dof))
    for joint, angle, low, high in zip(arm.joint_names, q_home, arm.lower, arm.upper, strict=True):
        if not low <= angle <= high:
            raise ModelError(
                f"{source}: 'arm.home_deg' puts {joint} at {np.degrees(angle):.0f} deg; its limits "
                f"are {np.degrees(low):.0f} to {np.degrees(high):.0f} deg"
            )
    return Nominal(
        name=table.text("name"),
        folder=folder,
        models=paths,
        arm=arm,
        q_home=q_home,
        cameras=cameras,
        board=load_board(paths["board"]),
        armtarget=load_chessboard(paths["armtarget"]),
        tabletarget=load_chessboard(paths["tabletarget"]),
        **{name: table.pose("poses", name) for name in POSES},
        T_base_flange_setup=table.pose("setup", "T_base_flange"),
        hand_eye_start=_view(table.sub("hand_eye", "start"), "start"),
        check=_view(table.sub("check"), "P_check"),
        overview=_view(table.sub("overview"), "overview"),
        inspection_views=load_views(paths["board"] / "targets.toml"),
    )


def load_views(path: Path) -> tuple[View, ...]:
    """The views of a board that a TOML file lists. Raises ModelError naming what is wrong."""
    views = tuple(_view(view, view.text("id")) for view in TomlTable.read(path).each("view"))
    ids = [view.id for view in views]
    for index, id in enumerate(ids):
        if id in ids[:index]:
            raise ModelError(f"{path}: 'view[{index}].id' = '{id}' is taken; give it its own")
    return views


_MODELS = ("arm", "hand", "tripod", "board", "armtarget", "tabletarget")


def _view(table: TomlTable, name: str) -> View:
    x, y = table.numbers("aim_mm", count=2) / 1e3 if "aim_mm" in table.values else (0.0, 0.0)
    distance = table.number("distance_mm") / 1e3
    if distance <= 0:
        raise table.complaint("distance_mm", wanted="above 0")
    tilt_x, tilt_y = np.radians(table.numbers("tilt_deg", count=2))
    return View(
        id=name,
        distance=distance,
        tilt=(float(tilt_x), float(tilt_y)),
        roll=float(np.radians(table.number("roll_deg"))),
        aim=(float(x), float(y), 0.0),
        shows=str(table.values.get("shows", "")),
    )


def load_camera(folder: Path) -> Camera:
    """Design intrinsics from a camera folder's `camera.toml`."""
    source = folder / "camera.toml"
    sensor = TomlTable.read(source).sub("sensor")
    width, height = int(sensor.number("width_px")), int(sensor.number("height_px"))
    return Camera.pinhole(sensor.number("focal_px"), width, height)


def load_chessboard(path: Path) -> Chessboard:
    """A chessboard from its TOML file."""
    table = TomlTable.read(path)
    return Chessboard(
        columns=int(table.number("columns")),
        rows=int(table.number("rows")),
        square=table.number("square_mm") / 1e3,
        margin=table.number("margin_mm") / 1e3,
    )


def _only_urdf(folder: Path) -> Path:
    found = sorted(folder.glob("*.urdf"))
    if len(found) != 1:
        raise ModelError(f"{folder}: holds {len(found)} URDF files; an arm's folder holds one")
    return found[0]
