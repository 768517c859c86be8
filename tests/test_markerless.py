"""The board by its own texture: rendered pictures with covered markers, known truth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from conftest import TaughtPoses

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import Implausible, Refused, TargetNotFound
from aoicell.markerless import LocatedTexture, Markerless, MarkerlessConfig, vote
from aoicell.nominal import Nominal
from aoicell.observation import Image, Observation
from aoicell.registration import Template, component_points, designed_layout
from aoicell.sim.cell import SimCell
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import PROFILES
from aoicell.sim.world import World
from aoicell.targets.layout import LocatedLayout
from aoicell.targets.pose import TargetPose
from aoicell.transforms import SE3, Array, apply, from_xyz_rpy

# on the board: within what a board is displaced by, and a turn that a plain marker cannot tell
MOVED = from_xyz_rpy([0.035, -0.025, 0.0015], np.radians([0.6, -0.5, 12.0]))
TURNED = from_xyz_rpy([0.0, 0.0, 0.0], np.radians([0.0, 0.0, 75.0]))


@dataclass(frozen=True)
class Scene:
    """A taught board, a new picture of it without its markers, and the truth behind them."""

    board: BoardDesign
    template: Template
    new: Observation
    camera: Camera
    T_true: SE3

    def locate(self, image: Image | None = None, **config: float) -> LocatedTexture:
        new = self.new if image is None else replace(self.new, image=image)
        localize = Markerless(self.board, MarkerlessConfig(**config))  # type: ignore[arg-type]
        return localize(new, [], self.template, self.camera)

    def errors_mm(self, T: SE3) -> Array:
        """How far the components (N,) are from where they are."""
        points = component_points(self.board, self.camera, self.T_true)
        gaps = apply(T, points) - apply(self.T_true, points)
        return np.asarray(np.linalg.norm(gaps, axis=1) * 1e3)


def covered(image: Image, board: BoardDesign, camera: Camera, T_camera_board: SE3) -> Image:
    """The picture with a plain grey plate over each marker."""
    image = image.copy()
    for marker in board.markers:
        plate = np.column_stack([marker.plate(0.002), np.full(4, marker.z)])
        uv = camera.project(plate, T_camera_board)
        cv2.fillConvexPoly(image, np.rint(uv).astype(np.int32), 70)
    return image


def scenes(
    nominal: Nominal, profile: str, motions: Sequence[SE3], taught_poses: TaughtPoses
) -> list[Scene]:
    world = World(nominal, draw(nominal, PROFILES[profile], seed=3))
    cell, T_base_board, board = SimCell(world), world.T_base_board, nominal.board
    world.arrive(taught_poses(nominal)["overview"])
    look, camera = cell.capture(), world.camera("hand")
    pose = TargetPose(world.truth_of(look).T_camera_board, 0.0, np.zeros((6, 6)), 0.05)
    layout = designed_layout(board, nominal.marker)
    template = Template(layout, look, LocatedLayout(pose, {}), ())
    made = []
    for motion in motions:
        world.place_board(T_base_board * motion)
        new = cell.capture()
        T_true = world.truth_of(new).T_camera_board
        shown = replace(new, image=covered(new.image, board, camera, T_true))
        made.append(Scene(board, template, shown, camera, T_true))
    world.close()
    return made


@pytest.fixture(scope="module")
def ideals(nominal: Nominal, taught_poses: TaughtPoses) -> list[Scene]:
    return scenes(nominal, "ideal", [MOVED, TURNED], taught_poses)


@pytest.fixture(scope="module")
def ideal(ideals: list[Scene]) -> Scene:
    return ideals[0]


@pytest.fixture(scope="module")
def typical(nominal: Nominal, taught_poses: TaughtPoses) -> Scene:
    return scenes(nominal, "typical", [MOVED], taught_poses)[0]


@pytest.fixture(scope="module")
def located(typical: Scene) -> LocatedTexture:
    return typical.locate()


def test_the_board_is_where_it_is(typical: Scene, located: LocatedTexture) -> None:
    assert typical.errors_mm(located.T_camera_target).mean() < 0.1
    assert located.pose.rms_px < 0.4
    assert located.uvs_px == {}


def test_any_turn_is_found(ideals: list[Scene]) -> None:
    """A plain marker looks the same after a quarter turn; the board does not."""
    for case in ideals:
        assert case.errors_mm(case.locate().T_camera_target).mean() < 0.06


def test_the_stated_error_is_of_the_size_of_the_true_one(
    typical: Scene, located: LocatedTexture
) -> None:
    points = component_points(typical.board, typical.camera, typical.T_true)
    arms = apply(located.T_camera_target, points) - located.T_camera_target.translation
    J = np.concatenate([np.cross(np.eye(3), arms[:, None]).transpose(0, 2, 1),
                        np.tile(np.eye(3), (len(arms), 1, 1))], axis=2)  # fmt: skip
    spread = np.trace(J @ located.pose.covariance @ J.transpose(0, 2, 1), axis1=1, axis2=2)
    stated_mm = np.sqrt(spread.mean()) * 1e3
    true_mm = np.sqrt((typical.errors_mm(located.T_camera_target) ** 2).mean())
    assert 0.01 < stated_mm < 0.1
    assert true_mm < 2.5 * stated_mm


def test_light_changes_nothing(ideal: Scene) -> None:
    slope = np.linspace(0.5, 0.9, ideal.new.image.shape[1])
    dimmed = (ideal.new.image * slope + 12).astype(np.uint8)
    located = ideal.locate(dimmed)
    assert ideal.errors_mm(located.T_camera_target).mean() < 0.1


def half_hidden(image: Image) -> Image:
    image = image.copy()
    image[:, image.shape[1] // 2 :] = 90
    return image


def test_half_of_the_board_is_less_sure(typical: Scene, located: LocatedTexture) -> None:
    half = typical.locate(half_hidden(typical.new.image))
    assert typical.errors_mm(half.T_camera_target).mean() < 0.3
    assert np.trace(half.pose.covariance) > 1.5 * np.trace(located.pose.covariance)
    assert typical.camera.project(half.points, typical.T_true)[:, 0].max() < 810


def mostly_hidden(image: Image) -> Image:
    image = image.copy()
    image[:, 500:] = 90
    return image


def blank(image: Image) -> Image:
    return np.full_like(image, 128)


def noise(image: Image) -> Image:
    return np.random.default_rng(0).integers(0, 255, image.shape).astype(np.uint8)


def mirrored(image: Image) -> Image:
    """A board with the same parts in other places, as the layout is no mirror image of itself."""
    return np.ascontiguousarray(image[:, ::-1])


def shuffled(image: Image) -> Image:
    """Another board of the same parts: tiles of the picture in another order."""
    tiles = [tile for row in np.split(image, 6) for tile in np.split(row, 8, axis=1)]
    order = np.random.default_rng(1).permutation(len(tiles))
    rows = [[tiles[k] for k in order[8 * r : 8 * r + 8]] for r in range(6)]
    return np.ascontiguousarray(np.block(rows))


@pytest.mark.parametrize("spoil", [blank, noise, mirrored, shuffled, mostly_hidden])
def test_what_is_not_the_board_is_refused(typical: Scene, spoil: Callable[[Image], Image]) -> None:
    with pytest.raises(TargetNotFound, match=r"^board: .*; (bring|uncover)"):
        typical.locate(spoil(typical.new.image))


def test_a_board_that_lies_too_askew_is_refused(typical: Scene) -> None:
    with pytest.raises(Implausible, match=r"tilted by 1 deg and 1\.00 times") as refusal:
        typical.locate(max_tilt_deg=0.2)
    assert refusal.value.cause == "too_far"


def test_an_alignment_that_leaves_the_features_is_refused(typical: Scene) -> None:
    with pytest.raises(Refused, match="px away from where its features are") as refusal:
        typical.locate(max_drift_px=1e-3)
    assert refusal.value.cause == "inconsistent"


def test_two_boards_are_ambiguous(ideal: Scene) -> None:
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.2, 0.2, (200, 2)), rng.uniform(0, 0.02, 200)])
    one = ideal.camera.project(points, ideal.T_true)
    other = ideal.camera.project(points, ideal.T_true * from_xyz_rpy([0.1, 0.1, 0], [0, 0, 0.3]))
    assert vote(points, one, ideal.camera, MarkerlessConfig()).isApprox(ideal.T_true, 1e-6)
    with pytest.raises(Refused, match="in one place and") as refusal:
        vote(
            np.concatenate([points, points]), np.concatenate([one, other]), ideal.camera,
            MarkerlessConfig(),
        )  # fmt: skip
    assert refusal.value.cause == "ambiguous"
