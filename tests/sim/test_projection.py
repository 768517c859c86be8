"""Projected points: exact without errors, noise by picture, dust by print, behind the wall."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.errors import TargetNotFound
from aoicell.nominal import Nominal
from aoicell.pipeline import flange_target
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import IDEAL, TYPICAL
from aoicell.sim.projection import (
    DUST_NOISE,
    SENSOR_NOISE,
    DetectionNoise,
    PicturelessCell,
    ProjectingDetector,
    measured_noise,
)
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.targets.chessboard import half_turn
from aoicell.targets.cross_marker import turned
from aoicell.transforms import SE3, Array, from_xyz_rpy

NONE = DetectionNoise()
DUST = DetectionNoise(corner_dust=50e-6, cross_dust=30e-6)
Build = Callable[..., World]


def test_without_noise_the_points_are_those_of_the_picture(
    ideal_world: World, nominal: Nominal
) -> None:
    cell, detector = SimCell(ideal_world), ProjectingDetector(ideal_world, NONE)
    ideal_world.begin()
    view = nominal.hand_eye_start
    cell.move(flange_target(nominal, nominal.T_base_tabletarget, view, nominal.q_home))
    picture, board = cell.capture(), nominal.tabletarget
    expected, seen = detector.chessboard(picture, board, "board"), board.detect(picture.grey)
    assert min(np.abs(uv - expected).max() for uv in (seen, half_turn(seen))) < 0.05
    cell.move(flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home))
    picture = cell.capture()
    expected_markers = detector.markers(picture, nominal.marker)
    assert len(expected_markers) == 4
    found = nominal.marker.detect(picture.grey)
    for uv in expected_markers:
        gaps = [np.abs(turned(f, turn) - uv).max() for f in found for turn in range(4)]
        assert min(gaps) < 0.05


def test_noise_belongs_to_the_picture(ideal_world: World, nominal: Nominal) -> None:
    ideal_world.begin()
    cell = PicturelessCell(ideal_world)
    detector = ProjectingDetector(ideal_world, DetectionNoise(cross_px=0.5))
    exact = ProjectingDetector(ideal_world, NONE)
    cell.move(flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home))
    pictures = [cell.capture() for _ in range(150)]
    marker = nominal.marker
    once = np.array([detector.markers(picture, marker) for picture in pictures])
    again = np.array([detector.markers(picture, marker) for picture in pictures])
    np.testing.assert_array_equal(once, again)
    errors = once - np.array([exact.markers(picture, marker) for picture in pictures])
    assert errors.std() == pytest.approx(0.5, rel=0.05)
    assert abs(errors.mean()) < 0.03


def test_what_is_out_of_view_is_not_found(ideal_world: World, nominal: Nominal) -> None:
    ideal_world.begin()
    cell, detector = PicturelessCell(ideal_world), ProjectingDetector(ideal_world, NONE)
    cell.move(flange_target(nominal, nominal.T_base_board, nominal.overview, nominal.q_home))
    picture = cell.capture()
    assert picture.image.size == 0
    with pytest.raises(TargetNotFound, match="view 1: tabletarget is not completely"):
        detector.chessboard(picture, nominal.tabletarget, "view 1")


@pytest.fixture(scope="module")
def _built() -> dict[str, World]:
    return {}


@pytest.fixture
def build(nominal: Nominal, _built: dict[str, World]) -> Build:
    """Worlds from knobs that are not ideal, each built once and given rewound."""

    def built(seed: int = 0, world: int = 0, **knobs: float) -> World:
        name = f"{seed} {world} {knobs}"
        if name not in _built:
            as_built = draw(nominal, Tolerances(**knobs), seed, world)
            _built[name] = World(nominal, as_built, pictures=False)
        _built[name].begin()
        _built[name].place_board(_built[name].geometry.T_base_board)
        return _built[name]

    return built


def on_plane(uv: Array, camera: Camera, T_print_camera: SE3) -> Array:
    """Where the sight lines of pixels meet a print, x and y (N, 2) in its frame (m)."""
    rays = np.column_stack([camera.unproject(uv), np.ones(len(uv))])
    directions, origin = rays @ T_print_camera.rotation.T, T_print_camera.translation
    met: Array = origin[:2] - directions[:, :2] * (origin[2] / directions[:, 2:])
    return met


def marker_dust(world: World, at: str = "overview", noise: DetectionNoise = DUST) -> Array:
    """Apparent minus designed place of the crosses, (markers, 4, 2) in the markers' frames (m)."""
    cell, nominal = PicturelessCell(world), world.nominal
    view = {"overview": nominal.overview, "close": replace(nominal.overview, distance=1.0)}[at]
    cell.move(flange_target(nominal, nominal.T_base_board, view, nominal.q_home))
    picture = cell.capture()
    truth = world.truth_of(picture)
    T_board_camera = truth.T_camera_board.inverse()
    markers = ProjectingDetector(world, noise).markers(picture, nominal.marker)
    Ts = world.geometry.Ts_board_marker.values()
    found = [on_plane(uv, truth.camera, T.actInv(T_board_camera))
             for uv, T in zip(markers, Ts, strict=True)]  # fmt: skip
    return np.array(found) - nominal.marker.crosses[:, :2]


def board_dust(world: World) -> Array:
    """The same of chessboard 2 in the hand camera, (N, 2) in its frame (m)."""
    cell, nominal = PicturelessCell(world), world.nominal
    T_base_board = nominal.T_base_tabletarget
    cell.move(flange_target(nominal, T_base_board, nominal.hand_eye_start, nominal.q_home))
    picture, board = cell.capture(), nominal.tabletarget
    uv = ProjectingDetector(world, DUST).chessboard(picture, board, "board")
    T_board_camera = T_base_board.actInv(world.truth_of(picture).T_base_camera)
    return on_plane(uv, world.camera("hand"), T_board_camera) - board.corners[:, :2]


def tripod_dust(world: World) -> tuple[Array, Array]:
    """The same of chessboard 1 and 2 in the tripod camera."""
    cell, nominal = PicturelessCell(world), world.nominal
    cell.move(nominal.arm.ik(nominal.T_base_flange_setup, nominal.q_home, "setup"))
    picture, T_base_tripod = cell.capture("tripod"), world.geometry.T_base_tripod
    pair = ProjectingDetector(world, DUST).chessboard_pair(picture, nominal.armtarget, "pair")
    boards = (nominal.armtarget, nominal.tabletarget)
    Ts = (world.truth_of(picture).T_base_armtarget, world.geometry.T_base_tabletarget)
    first, second = (
        on_plane(uv, world.camera("tripod"), T.actInv(T_base_tripod)) - board.corners[:, :2]
        for uv, board, T in zip(pair, boards, Ts, strict=True)
    )
    return first, second


def test_without_dust_no_point_moves(build: Build) -> None:
    assert np.abs(marker_dust(build(), noise=NONE)).max() < 1e-12
    assert np.abs(marker_dust(build())).max() > 1e-5


def test_dust_stays_where_it_is_on_the_print(build: Build) -> None:
    world = build()
    seen = marker_dust(world)
    np.testing.assert_allclose(marker_dust(world, "close"), seen, atol=1e-12)
    world.begin(trial=3)
    world.place_board(world.T_base_board * from_xyz_rpy([0.01, -0.01, 0.005], [0.02, 0.01, 0.4]))
    np.testing.assert_allclose(marker_dust(world), seen, atol=1e-12)


def test_no_other_knob_moves_the_dust(build: Build) -> None:
    turned_markers = build(marker_deg=10, marker_mm=2)  # also: it belongs to the marker's own axes
    np.testing.assert_allclose(marker_dust(turned_markers), marker_dust(build()), atol=1e-12)


def test_each_print_world_and_camera_has_its_own_dust(build: Build) -> None:
    world = build()
    prints = [board_dust(world), *tripod_dust(world), board_dust(build(world=1)),
              board_dust(build(seed=1))]  # fmt: skip
    alike = np.corrcoef([dust.ravel() for dust in prints])
    assert np.abs(alike[np.triu_indices(5, 1)]).max() < 0.35  # 96 numbers each: 3.4 sigma
    markers = marker_dust(world)
    assert len(np.unique(np.round(markers, 12))) == markers.size


def test_dust_has_the_stated_spread(build: Build) -> None:
    worlds = [build(), build(world=1), build(seed=1)]
    corners = np.array([board_dust(world) for world in worlds])
    assert corners.std() == pytest.approx(DUST.corner_dust, rel=0.13)  # 288 numbers: 3.1 sigma
    assert abs(corners.mean()) < 3.5 * DUST.corner_dust / np.sqrt(corners.size)
    crosses = np.array([marker_dust(world) for world in worlds])
    assert crosses.std() == pytest.approx(DUST.cross_dust, rel=0.22)  # 96 numbers


def test_the_noise_follows_sensor_and_dust() -> None:
    assert measured_noise(IDEAL) == NONE
    clean = measured_noise(TYPICAL.model_copy(update={"dust_percent": 0.0}))
    assert clean == SENSOR_NOISE
    assert measured_noise(Tolerances(dust_percent=1.0)) == DUST_NOISE
    assert measured_noise(Tolerances(dust_percent=4.0)).cross_dust == 2 * DUST_NOISE.cross_dust
    louder = measured_noise(Tolerances(noise_grey=2 * float(np.hypot(0.3, np.sqrt(128 / 40)))))
    assert louder.corner_px == pytest.approx(2 * SENSOR_NOISE.corner_px)
    assert louder.corner_dust == 0


def test_the_pictureless_cell_shows_the_protocol_only(ideal_world: World) -> None:
    public = [name for name in dir(PicturelessCell(ideal_world)) if not name.startswith("_")]
    assert sorted(public) == ["capture", "move", "state"]
