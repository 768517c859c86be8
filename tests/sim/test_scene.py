"""The drawn geometry and light are in the picture, each with its sign and axis."""

from aoicell.sim.backend import make_renderer  # isort: skip  (chooses the rendering back end)

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.observation import Image, to_grey
from aoicell.sim.as_built import Geometry, Light, Surfaces, designed, plain_surfaces
from aoicell.sim.drawing import draw
from aoicell.sim.prints import true_corners, true_crosses
from aoicell.sim.profiles import IDEAL
from aoicell.sim.scene import ARM, build_model, visible
from aoicell.targets.chessboard import Chessboard, half_turn
from aoicell.targets.cross_marker import turned
from aoicell.targets.pose import rms
from aoicell.transforms import SE3, Array, apply, looking_at, translation

TaughtPoses = Callable[[Nominal], Mapping[str, Array]]

FLAT = (0.0, 0.0)
EVEN, CLEAN = Light(), plain_surfaces()


@dataclass(frozen=True)
class Shot:
    """A pinhole picture and what was where."""

    grey: Image
    T_camera_target: SE3


class Studio:
    """Takes pictures of scenes that differ from the design in one thing each."""

    def __init__(self, nominal: Nominal, poses: Mapping[str, Array]) -> None:
        self.nominal, self.poses = nominal, poses
        self.design = designed(nominal)
        self.camera = nominal.cameras["hand"]
        self._plain: dict[str, Shot] = {}

    def plain(self, pose: str) -> Shot:
        """The design as seen from a taught pose."""
        if pose not in self._plain:
            target = "tabletarget" if pose == "start" else "board"
            self._plain[pose] = self.shoot(self.poses[pose], target)
        return self._plain[pose]

    def shoot(
        self, q: Array, target: str, geometry: Geometry | None = None, camera: str = "hand",
        light: Light = EVEN, surfaces: Surfaces = CLEAN,
    ) -> Shot:  # fmt: skip
        pinholes = {n: (c.width, c.height, c.focal_px) for n, c in self.nominal.cameras.items()}
        geometry = geometry or self.design
        model = build_model(self.nominal, geometry, pinholes, light, surfaces)
        data = mujoco.MjData(model)
        data.qpos[[model.joint(ARM + n).qposadr[0] for n in self.nominal.arm.joint_names]] = q
        mujoco.mj_forward(model, data)
        renderer = make_renderer(model, self.camera.width, self.camera.height)
        renderer.update_scene(data, camera, visible())
        grey = to_grey(renderer.render())
        renderer.close()
        T_world_camera, T_world_target = (pose(data.body(name)) for name in (camera, target))
        return Shot(grey, T_world_camera.actInv(T_world_target))

    def over_tabletarget(self, tilt: tuple[float, float]) -> Array:
        """Joint angles that look at chessboard 2, leaning by `tilt` (rad)."""
        view = looking_at([0, 0, 0], 0.5, tilt, np.radians(20))
        T = self.nominal.T_base_tabletarget * view * self.nominal.T_flange_camera.inverse()
        return self.nominal.arm.ik(T, self.poses["start"])

    def printed(self, **scales: tuple[float, float]) -> Geometry:
        return replace(self.design, print_scales={**self.design.print_scales, **scales})

    def bent(self, **bows: tuple[float, float]) -> Geometry:
        return replace(self.design, bows={**self.design.bows, **bows})

    def corner_error(self, shot: Shot, board: Chessboard, points: Array) -> float:
        """Distance (px, rms) between detected corners and the projection of `points`."""
        uv, expected = board.detect(shot.grey), self.camera.project(points, shot.T_camera_target)
        return min(rms(uv - expected), rms(half_turn(uv) - expected))

    def marker_error(self, shot: Shot, id: str, scale: tuple[float, float]) -> float:
        """Distance (px, rms) between the crosses of the nearest marker and their projection."""
        T_camera_marker = shot.T_camera_target * self.design.Ts_board_marker[id]
        crosses = true_crosses(self.nominal.marker, scale)
        expected = self.camera.project(crosses, T_camera_marker)
        found = self.nominal.marker.detect(shot.grey)
        return min(rms(turned(uv, k) - expected) for uv in found for k in range(4))


def pose(body: object) -> SE3:
    return SE3(body.xmat.reshape(3, 3).copy(), body.xpos.copy())  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def studio(nominal: Nominal, taught_poses: TaughtPoses) -> Studio:
    return Studio(nominal, taught_poses(nominal))


# ---- nothing drawn, nothing changed ------------------------------------------------------------


def test_a_drawing_without_tolerances_gives_the_picture_of_the_design(studio: Studio) -> None:
    ideal = draw(studio.nominal, IDEAL, seed=5)
    for name, target in (("start", "tabletarget"), ("P_check", "board")):
        q = studio.poses[name]
        plain = studio.plain(name)
        drawn = studio.shoot(q, target, ideal.geometry, light=ideal.light, surfaces=ideal.surfaces)
        assert plain.grey.tobytes() == drawn.grey.tobytes()


# ---- prints ------------------------------------------------------------------------------------


def test_a_stretched_chessboard_is_seen_where_it_is(studio: Studio) -> None:
    scale, board = (1.002, 0.999), studio.nominal.tabletarget
    geometry = studio.printed(tabletarget=scale)
    shot = studio.shoot(studio.over_tabletarget((0, 0)), "tabletarget", geometry)

    def error(sx: float, sy: float) -> float:
        return studio.corner_error(shot, board, true_corners(board, (sx, sy), FLAT))

    assert error(*scale) < 0.02
    assert error(scale[1], scale[0]) > 0.2  # axes swapped
    assert error(2 - scale[0], 2 - scale[1]) > 0.2  # smaller for larger
    assert error(1, 1) > 0.1


@pytest.mark.parametrize("bow_twist", [(5e-4, 0.0), (-5e-4, 0.0), (0.0, 5e-4), (3e-4, -5e-4)])
def test_a_bent_chessboard_is_seen_where_it_is(
    studio: Studio, bow_twist: tuple[float, float]
) -> None:
    board, (bow, twist) = studio.nominal.tabletarget, bow_twist
    geometry = studio.bent(tabletarget=bow_twist)
    shot = studio.shoot(studio.over_tabletarget((0.30, 0.25)), "tabletarget", geometry)

    def error(bow: float, twist: float) -> float:
        return studio.corner_error(shot, board, true_corners(board, (1, 1), (bow, twist)))

    assert error(bow, twist) < 0.02
    if bow:
        assert error(-bow, twist) > 0.3
    if twist:
        assert error(bow, -twist) > 0.1
    assert error(twist, bow) > 0.3


def test_chessboard_1_has_its_own_scale_and_bow(studio: Studio) -> None:
    scale, bow_twist, board = (0.998, 1.001), (5e-4, 3e-4), studio.nominal.armtarget
    geometry = replace(
        studio.printed(armtarget=scale), bows=studio.bent(armtarget=bow_twist).bows
    )  # fmt: skip
    shot = studio.shoot(studio.poses["setup"], "armtarget", geometry, camera="tripod")
    camera = studio.nominal.cameras["tripod"]
    first, second = board.detect_pair(shot.grey)

    def error(points: Array) -> float:
        expected = camera.project(points, shot.T_camera_target)
        readings = [uv for found in (first, second) for uv in (found, half_turn(found))]
        return min(rms(uv - expected) for uv in readings)

    assert error(true_corners(board, scale, bow_twist)) < 0.03
    assert error(true_corners(board, scale[::-1], bow_twist)) > 0.1
    assert error(true_corners(board, scale, (-bow_twist[0], bow_twist[1]))) > 0.1
    assert error(board.corners) > 0.1


def test_each_marker_has_its_own_scale(studio: Studio) -> None:
    scale = (1.01, 0.995)
    geometry = studio.printed(M1=scale)
    shot = studio.shoot(studio.poses["overview"], "board", geometry)
    assert studio.marker_error(shot, "M1", scale) < 0.03
    assert studio.marker_error(shot, "M1", scale[::-1]) > 0.15
    assert studio.marker_error(shot, "M1", (1, 1)) > 0.1
    assert studio.marker_error(shot, "M2", (1, 1)) < 0.03


def test_a_lifted_marker_shows_parallax(studio: Studio) -> None:
    lift, q = 2e-3, studio.poses["V1"]  # a tilted view
    marker, T = studio.nominal.marker, studio.design.Ts_board_marker["M2"]
    lifted = {**studio.design.Ts_board_marker, "M2": T * translation(z=lift)}
    shot = studio.shoot(q, "board", replace(studio.design, Ts_board_marker=lifted))
    (found,) = marker.detect(shot.grey)

    def error(z: float) -> float:
        points = apply(T * translation(z=z), marker.crosses)
        expected = studio.camera.project(points, shot.T_camera_target)
        return min(rms(turned(found, k) - expected) for k in range(4))

    assert error(lift) < 0.03
    assert error(0) > 0.5
    assert error(-lift) > 1


def test_a_marker_is_never_buried_in_the_board(studio: Studio) -> None:
    sunk = {
        id: T * translation(z=-2e-3) for id, T in studio.design.Ts_board_marker.items()
    }  # fmt: skip
    shot = studio.shoot(
        studio.poses["P_check"], "board", replace(studio.design, Ts_board_marker=sunk)
    )
    assert len(studio.nominal.marker.detect(shot.grey)) == 1


def test_every_world_has_dust_of_its_own_on_its_prints(studio: Studio) -> None:
    q, dirt = studio.poses["start"], replace(CLEAN, dust=0.02)
    clean = studio.plain("start")
    pictures = [
        studio.shoot(q, "tabletarget", surfaces=replace(dirt, seed=seed)).grey
        for seed in ((0, 0), (0, 1))
    ]
    assert (pictures[0] != pictures[1]).mean() > 0.001
    board, camera = studio.nominal.tabletarget, studio.camera
    inside = inner_box(camera.project(board.outline, clean.T_camera_target), clean.grey.shape)
    darker = (clean.grey.astype(int) - pictures[0])[inside & (clean.grey > 150)]
    assert 0.01 < (darker > 40).mean() < 0.04


def inner_box(outline: Array, shape: tuple[int, ...]) -> np.ndarray:
    """Pixels (H, W) within the bounds of a plate's picture, a little inside."""
    (left, top), (right, bottom) = outline.min(axis=0), outline.max(axis=0)
    mask = np.zeros(shape, dtype=bool)
    mask[int(top) + 20 : int(bottom) - 20, int(left) + 20 : int(right) - 20] = True
    return mask


# ---- light -------------------------------------------------------------------------------------


def test_the_level_of_the_light_is_in_the_picture(studio: Studio) -> None:
    q = studio.poses["start"]
    plain = studio.plain("start").grey.astype(float)
    for level in (0.9, 1.1):
        other = studio.shoot(q, "tabletarget", light=Light(level=level)).grey
        assert other.mean() / plain.mean() == pytest.approx(level, abs=0.01)


@pytest.mark.parametrize("view", ["start", "P_check"])
def test_white_paper_keeps_clear_of_saturation(studio: Studio, view: str) -> None:
    """At +3 sigma of light (5 %) and of exposure (3 %) in `typical`."""
    shot = studio.shoot(studio.poses[view], "board", light=Light(level=1.15))
    assert np.percentile(shot.grey, 99.9) * 1.09 < 255
    assert np.percentile(studio.plain(view).grey, 99.9) > 180  # and yet uses the range
