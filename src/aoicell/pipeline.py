"""Setting up, on one page: calibrate the cell, teach the board. What follows is in `online`.

Knows the `Cell` protocol and the nominal cell only. The methods share the pictures: `paper`
does what the paper says, `aoicell` the same chain with whatever is better.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeVar

from aoicell.calibration.cell_model import CellModel, refine_cell
from aoicell.calibration.hand_eye import HandEye, HandEyeSolver, solve_hand_eye
from aoicell.calibration.intrinsics import Intrinsics, calibrate_intrinsics
from aoicell.calibration.poses import INTRINSIC_VIEWS, SETUP_MOTIONS, TABLE_2
from aoicell.calibration.world import TripodView, WorldSetup, set_up_world
from aoicell.errors import TargetNotFound
from aoicell.localization import Localizer, localize, stay
from aoicell.markerless import locate_by_texture
from aoicell.nominal import Nominal, View
from aoicell.observation import Cell, Observation, RobotState, capture_at
from aoicell.registration import (
    TaughtView,
    Template,
    designed_layout,
    measured_layout,
    register,
)
from aoicell.robot import Arm
from aoicell.targets.chessboard import Chessboard, half_turn
from aoicell.targets.detector import IN_PICTURES, Detector
from aoicell.targets.layout import Layout
from aoicell.targets.marker_sighting import Detection
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array, angle_of

Found = TypeVar("Found")


@dataclass(frozen=True)
class Method:
    """What distinguishes two ways through the same procedure.

    `all_views`: world set-up from all tripod pictures and hand-eye from all hand pictures,
    refined on the reprojection error; else one tripod picture and the closed form over the
    six poses of Table 2. `all_markers`: one overview of all markers with their measured
    layout; else the positioning marker alone, from P_check. `by_equations`: (2)-(6).

    The other three are open to other packages: how the hand-eye equation is solved, how the
    board is located in a picture, how targets are found in it (None: as everybody else does).
    """

    name: str
    all_views: bool
    all_markers: bool
    by_equations: bool
    looks: int = 1
    solve_hand_eye: HandEyeSolver = solve_hand_eye
    localize: Localizer = localize
    detector: Detector | None = None


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "uncorrected": Method("uncorrected", False, False, by_equations=False, localize=stay),
        "paper": Method("paper", all_views=False, all_markers=False, by_equations=True),
        "aoicell_one_look": Method("aoicell_one_look", True, True, by_equations=False),
        "aoicell": Method("aoicell", True, True, by_equations=False, looks=3),
        "markerless": Method(
            "markerless", True, True, by_equations=False, localize=locate_by_texture
        ),
    }
)


def same_setup(method: Method, methods: Sequence[Method]) -> Method:
    """The first of the methods that differs from this one in nothing but name and looks."""

    def setup(m: Method) -> Method:
        return replace(m, name="", looks=1)

    return next((m for m in methods if setup(m) == setup(method)), method)


@dataclass(frozen=True)
class CalibrationPictures:
    """Everything that is photographed to calibrate: tripod views, intrinsic views, Table 2."""

    tripod: tuple[Observation, ...]
    intrinsic: tuple[Observation, ...]
    table_2: tuple[Observation, ...]


@dataclass(frozen=True)
class Calibration:
    """The calibrated cell as one method has it; `unused` says why a picture was not used.

    `model` is what a joint refinement knows of its own uncertainty.
    """

    hand: Intrinsics
    tripod: Intrinsics
    world: WorldSetup
    hand_eye: HandEye
    arm: Arm
    unused: tuple[str, ...]
    model: CellModel | None = None

    def T_base_camera(self, state: RobotState) -> SE3:
        """The hand camera at a robot state, by the arm and the hand-eye of this calibration."""
        return self.arm.fk(state.q) * self.hand_eye.T_flange_camera


@dataclass(frozen=True)
class TaughtPictures:
    """Pictures of the taught board: from P_check, from above, and the standard images.

    `references` show chessboard 2, which stays where it is, from two distances.
    """

    check: Observation
    overview: Observation
    views: tuple[TaughtView, ...]
    references: tuple[Observation, ...]


# -- Moving and taking pictures -------------------------------------------------------------


def photograph_targets(cell: Cell, nominal: Nominal) -> CalibrationPictures:
    """Visit all calibration poses, planned on the nominal cell."""
    arm, q_home = nominal.arm, nominal.q_home
    start = nominal.T_base_tabletarget * nominal.hand_eye_start.T_target_camera
    T_start = start * nominal.T_flange_camera.inverse()
    q_start = arm.ik(T_start, q_home, "hand-eye start")
    q_setup = arm.ik(nominal.T_base_flange_setup, q_home, "world set-up")
    setup = [
        arm.ik(nominal.T_base_flange_setup * dT, q_setup, f"world set-up {i + 1}")
        for i, dT in enumerate(SETUP_MOTIONS)
    ]
    views = [
        flange_target(nominal, nominal.T_base_tabletarget, view, q_start)
        for view in INTRINSIC_VIEWS
    ]
    table_2 = [arm.ik(T_start * dT, q_start, f"Table 2 {id}") for id, dT in TABLE_2.items()]
    return CalibrationPictures(
        tripod=tuple(capture_at(cell, setup, "tripod")),
        intrinsic=tuple(capture_at(cell, views)),
        table_2=tuple(capture_at(cell, table_2)),
    )


def flange_target(nominal: Nominal, T_base_target: SE3, view: View, q_near: Array) -> Array:
    """Joint angles (rad) from which the camera, mounted as designed, has the view of a target."""
    T_base_flange = T_base_target * view.T_target_camera * nominal.T_flange_camera.inverse()
    return nominal.arm.ik(T_base_flange, q_near, view.id)


def photograph_board(cell: Cell, nominal: Nominal) -> TaughtPictures:
    """Template login: look at the board from P_check, from above, and from the taught views."""
    T_base_board, q_home = nominal.T_base_board, nominal.q_home
    T_base_marker = T_base_board * nominal.T_board_positioning
    q_check = flange_target(nominal, T_base_marker, nominal.check, q_home)
    q_overview = flange_target(nominal, T_base_board, nominal.overview, q_check)
    q_views = [
        flange_target(nominal, T_base_board, view, q_check) for view in nominal.inspection_views
    ]
    # from as far off as the board is looked at, and nearer: a lens that drifted changes both
    # pictures alike, a camera that was moved does not
    distances = (nominal.overview.distance, nominal.hand_eye_start.distance)
    starts = [replace(nominal.hand_eye_start, distance=distance) for distance in distances]
    q_references = [
        flange_target(nominal, nominal.T_base_tabletarget, start, q_home) for start in starts
    ]
    qs = [q_check, q_overview, *q_references, *q_views]
    check, overview, far, near, *standards = capture_at(cell, qs)
    views = [
        TaughtView(view.id, standard)
        for view, standard in zip(nominal.inspection_views, standards, strict=True)
    ]
    return TaughtPictures(check, overview, tuple(views), (far, near))


# -- Estimating -------------------------------------------------------------------------------


def calibrate(
    pictures: CalibrationPictures,
    nominal: Nominal,
    methods: Sequence[Method],
    detector: Detector = IN_PICTURES,
) -> dict[str, Calibration]:
    """Intrinsics, world set-up and hand-eye for each method, from the same pictures."""
    arm_board, table_board = nominal.armtarget, nominal.tabletarget
    pairs, unused = _sightings(
        pictures.tripod, arm_board, detector.chessboard_pair, "tripod picture"
    )
    uvs, unused_hand = _sightings(
        _hand_pictures(pictures), table_board, detector.chessboard, "hand picture"
    )
    uvs_arm = [uv_arm for uv_arm, _ in pairs.values()]
    tripod = calibrate_intrinsics(arm_board, uvs_arm, nominal.cameras["tripod"])
    hand = calibrate_intrinsics(table_board, list(uvs.values()), nominal.cameras["hand"])
    tripod_views = [
        TripodView(uv_arm, uv_table, picture.state.T_base_flange)
        for picture, (uv_arm, uv_table) in pairs.items()
    ]
    calibrations = {}
    for method in methods:
        world = set_up_world(
            tripod_views if method.all_views else tripod_views[:1],
            tripod.camera, arm_board, table_board,
            nominal.T_flange_armtarget, nominal.T_base_tabletarget,
        )  # fmt: skip
        shown = _hand_pictures(pictures) if method.all_views else pictures.table_2
        used = [picture for picture in shown if picture in uvs]
        hand_eye, model = _hand_eye(used, uvs, hand, world, nominal, method)
        calibrations[method.name] = Calibration(
            hand if model is None else replace(hand, camera=model.camera),
            tripod, world, hand_eye, nominal.arm if model is None else model.arm,
            (*unused, *unused_hand), model,
        )  # fmt: skip
    return calibrations


def _sightings(
    pictures: Sequence[Observation],
    board: Chessboard,
    detect: Callable[[Observation, Chessboard, str], Found],
    name: str,
) -> tuple[dict[Observation, Found], list[str]]:
    """What was detected, by picture, and the reason for each picture that is not used."""
    found, reasons = {}, []
    for index, picture in enumerate(pictures, start=1):
        try:
            found[picture] = detect(picture, board, f"{name} {index}")
        except TargetNotFound as error:
            reasons.append(str(error))
    return found, reasons


def _hand_pictures(pictures: CalibrationPictures) -> tuple[Observation, ...]:
    return pictures.intrinsic + pictures.table_2


def _hand_eye(
    pictures: Sequence[Observation],
    uvs_px: Mapping[Observation, Array],
    hand: Intrinsics,
    world: WorldSetup,
    nominal: Nominal,
    method: Method,
) -> tuple[HandEye, CellModel | None]:
    """A X = Z B, with the half turn of the board settled by where the set-up puts it."""
    target, camera = nominal.tabletarget, hand.camera
    uvs, Ts_camera_target = [], []
    for picture in pictures:
        T_base_camera = picture.state.T_base_flange * nominal.T_flange_camera
        expected = T_base_camera.actInv(world.T_base_tabletarget)
        readings = [uvs_px[picture], half_turn(uvs_px[picture])]
        poses = [solve_pose(target.corners, uv, camera).T_camera_target for uv in readings]
        turns = [angle_of(expected.actInv(T)) for T in poses]
        nearer = turns.index(min(turns))
        uvs.append(readings[nearer])
        Ts_camera_target.append(poses[nearer])
    Ts_base_flange = [picture.state.T_base_flange for picture in pictures]
    result = method.solve_hand_eye(Ts_base_flange, Ts_camera_target)
    if not method.all_views:
        return result, None
    states = [picture.state for picture in pictures]
    return refine_cell(result, nominal.arm, target, camera, uvs, states, Ts_camera_target)


def teach(
    pictures: TaughtPictures,
    calibration: Calibration,
    nominal: Nominal,
    method: Method,
    detector: Detector = IN_PICTURES,
) -> Template:
    """The template of one method: the positioning marker alone, or all markers as measured.

    Markers that bear codes are found by these.
    """
    camera, marker, positioning = calibration.hand.camera, nominal.marker, nominal.positioning
    codes = nominal.marker_codes if positioning.code else None
    senses = method.detector or detector

    def expected(observation: Observation, T_base_target: SE3) -> SE3:
        return calibration.T_base_camera(observation.state).actInv(T_base_target)

    def found(observation: Observation) -> Sequence[Detection]:
        if codes is None:
            return senses.markers(observation, marker)
        return senses.sightings(observation, marker)

    check, overview = pictures.check, pictures.overview
    if not method.all_markers:
        layout: Layout = {positioning.id: marker.crosses}
        T_camera_marker = expected(check, nominal.T_base_board * nominal.T_board_positioning)
        return register(
            check, found(check), pictures.views, layout, camera, T_camera_marker, codes=codes
        )
    shown = [check, overview, *(view.standard for view in pictures.views)]
    detections = [found(observation) for observation in shown]
    Ts_camera_board = [expected(observation, nominal.T_base_board) for observation in shown]
    design = designed_layout(nominal.board, marker)
    layout, sigma_px = measured_layout(
        detections, Ts_camera_board, design, camera, fixed=positioning.id, codes=codes
    )
    return register(
        overview, detections[1], pictures.views, layout, camera, Ts_camera_board[1], sigma_px,
        pictures.references, nominal.board, codes,
    )  # fmt: skip
