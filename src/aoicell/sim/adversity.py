"""What goes wrong after a board was taught, one cause at a time, drawn and put into a world.

The ranges reach from what hardly matters to what nobody can miss: between them lie the cases in
which an estimate is wrong without looking it.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np

from aoicell.camera import Camera
from aoicell.sim.spoiling import Blur, Reflection, Spoil
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, from_rvec, from_xyz_rpy, translation

Cause = Literal[
    "none", "occlusion", "glare", "blur", "wrong_marker", "second_board", "moved_camera",
    "stale_calibration", "out_of_range",
]  # fmt: skip
CAUSES: tuple[Cause, ...] = get_args(Cause)
Rng = np.random.Generator
BOARD, REFERENCES = 0, (1, 2)  # the pictures that locate, in their order


@dataclass(frozen=True)
class Adversity:
    """One drawn cause: props by name at T_base_prop, what spoils which picture, the camera in
    its old place (T_camera_moved), its focal length as a factor and its principal point (px).
    """

    cause: Cause
    props: Mapping[str, SE3] = field(default_factory=dict)
    spoils: tuple[tuple[int, Spoil], ...] = ()
    T_camera_moved: SE3 = field(default_factory=SE3.Identity)
    focal: float = 1.0
    principal_px: tuple[float, float] = (0.0, 0.0)


def draw_adversity(cause: Cause, world: World, rng: Rng) -> Adversity:
    """One instance of a cause, for the board where it lies now.

    `none` and `out_of_range` are nothing but their displacement of the board.
    """
    return _DRAWN[cause](world, rng) if cause in _DRAWN else Adversity(cause)


@contextmanager
def injected(world: World, adversity: Adversity) -> Iterator[None]:
    """The world with that wrong; as before when it is left."""
    geometry = world.geometry
    try:
        for name, T_base_prop in adversity.props.items():
            world.place(name, T_base_prop)
        world.change_camera(
            geometry.T_flange_camera * adversity.T_camera_moved,
            _drifted(geometry.cameras["hand"], adversity),
        )
        world.spoils = adversity.spoils
        yield
    finally:
        world.spoils = ()
        world.put_away()
        world.change_camera(geometry.T_flange_camera, geometry.cameras["hand"])


def _drifted(camera: Camera, adversity: Adversity) -> Camera:
    if adversity.focal == 1 and not any(adversity.principal_px):
        return camera
    K = np.array(camera.K)
    K[:2, :2] *= adversity.focal
    K[:2, 2] += adversity.principal_px
    return Camera(K, camera.width, camera.height, camera.distortion)


# -- What is drawn ----------------------------------------------------------------------------


def _log_uniform(rng: Rng, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _direction(rng: Rng) -> Array:
    v = rng.standard_normal(3)
    return np.asarray(v / np.linalg.norm(v))


def _marker(world: World, rng: Rng) -> SE3:
    """T_base_marker of any marker of the board."""
    ids = list(world.geometry.Ts_board_marker)
    return world.T_base_board * world.geometry.Ts_board_marker[ids[rng.integers(len(ids))]]


def _spot(world: World, rng: Rng, picture: int, spread: float) -> SE3:
    """A place in base near a marker of the board, or on the reference; any turn about z."""
    T = _marker(world, rng) if picture == BOARD else world.geometry.T_base_tabletarget
    x, y = rng.uniform(-spread, spread, 2)
    return T * from_xyz_rpy([x, y, 0], [0, 0, rng.uniform(-np.pi, np.pi)])


def _picture(rng: Rng) -> int:
    """The board's picture is the one that suffers, five times of six."""
    return BOARD if rng.uniform() < 5 / 6 else int(rng.choice(REFERENCES))


def _occlusion(world: World, rng: Rng) -> Adversity:
    """A hand, a sleeve or a cable, or several of them, over a marker or the reference."""
    picture, props = _picture(rng), ("glove", "sleeve", "cable")
    chosen = rng.choice(len(props), int(rng.integers(1, 4)), replace=False)
    heights = {"glove": 0.03, "sleeve": 0.08, "cable": 0.012}
    placed = {
        props[k]: _spot(world, rng, picture, 0.045) * translation(z=heights[props[k]])
        for k in chosen
    }
    return Adversity("occlusion", props=placed)


def _glare(world: World, rng: Rng) -> Adversity:
    """One to three reflections of lamps, from a glint to a flood."""
    picture = _picture(rng)
    spots = [
        Reflection(
            _spot(world, rng, picture, 0.035).translation,
            _log_uniform(rng, 0.002, 0.06), _log_uniform(rng, 60, 3000),
        )
        for _ in range(rng.integers(1, 4))
    ]  # fmt: skip
    return Adversity("glare", spoils=tuple((picture, spot) for spot in spots))


def _blur(world: World, rng: Rng) -> Adversity:
    """A picture that was taken too early, or a lens out of focus."""
    angle = rng.uniform(0, np.pi)
    length, sigma = _log_uniform(rng, 1, 40), _log_uniform(rng, 0.5, 12)
    moved = (float(length * np.cos(angle)), float(length * np.sin(angle)))
    spoil = Blur(motion_px=moved) if rng.uniform() < 0.5 else Blur(sigma_px=sigma)
    pictures = (BOARD, *REFERENCES) if rng.uniform() < 0.3 else (_picture(rng),)
    return Adversity("blur", spoils=tuple((picture, spoil) for picture in pictures))


def _wrong_marker(world: World, rng: Rng) -> Adversity:
    """A marker stuck on anew, elsewhere on the board, or one more of the same print."""
    if rng.uniform() < 0.4:
        x, y = rng.uniform(-0.26, 0.26), rng.uniform(-0.20, 0.20)
        turn = rng.uniform(-np.pi, np.pi)
        return Adversity(
            "wrong_marker", props={"sticker": _over(world.T_base_board, x, y, turn, 0.025)}
        )
    T, far = _marker(world, rng), _log_uniform(rng, 0.0003, 0.15)
    angle, turn = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(-10, 10))
    moved = _over(T, far * np.cos(angle), far * np.sin(angle), turn, 0.001)
    return Adversity("wrong_marker", props={"patch": T * translation(z=0.0005), "sticker": moved})


def _over(T: SE3, x: float, y: float, turn: float, z: float) -> SE3:
    return T * from_xyz_rpy([x, y, z], [0, 0, turn])


def _second_board(world: World, rng: Rng) -> Adversity:
    """A board of the same kind beside this one, on any of its four sides, or half on top of it."""
    size, side = world.nominal.board.size, int(rng.integers(4))
    axis, sign = side % 2, 1 - 2 * (side // 2)
    place = np.array([0.0, 0.0, 0.0])
    on_top = rng.uniform() < 0.3
    gap = -rng.uniform(0.1, 0.9) * size[axis] if on_top else _log_uniform(rng, 0.002, 0.1)
    place[axis] = sign * (size[axis] + gap)
    place[1 - axis] = rng.uniform(-0.08, 0.08)
    turn = np.radians(rng.uniform(-8, 8)) + (np.pi if rng.uniform() < 0.5 else 0.0)
    beside = world.T_base_board * translation(*place) * from_xyz_rpy([0, 0, 0], [0, 0, turn])
    return Adversity("second_board", props={"other_board": beside * translation(z=0.05 * on_top)})


def _knock(rng: Rng, mm: tuple[float, float], deg: tuple[float, float]) -> SE3:
    """A shift, a turn, or both, about the camera."""
    kind = rng.integers(3)
    shift = 0.0 if kind == 0 else _log_uniform(rng, *mm) / 1e3
    turn = 0.0 if kind == 1 else np.radians(_log_uniform(rng, *deg))
    return from_rvec(turn * _direction(rng), shift * _direction(rng))


def _moved_camera(world: World, rng: Rng) -> Adversity:
    """A mount that was knocked."""
    return Adversity("moved_camera", T_camera_moved=_knock(rng, (0.2, 2.0), (0.05, 0.5)))


def _stale_calibration(world: World, rng: Rng) -> Adversity:
    """A lens that drifted by up to a half per cent or 10 px, or a mount that crept."""
    kind, sign = rng.integers(3), rng.choice([-1.0, 1.0])
    if kind == 0:
        return Adversity("stale_calibration", focal=1 + sign * _log_uniform(rng, 1e-4, 5e-3))
    if kind == 1:
        angle, far = rng.uniform(0, 2 * np.pi), _log_uniform(rng, 0.2, 10)
        shift = (float(far * np.cos(angle)), float(far * np.sin(angle)))
        return Adversity("stale_calibration", principal_px=shift)
    crept = _knock(rng, (0.02, 0.5), (0.002, 0.1))
    return Adversity("stale_calibration", T_camera_moved=crept)


_DRAWN: Mapping[Cause, Callable[[World, Rng], Adversity]] = MappingProxyType(
    {
        "occlusion": _occlusion,
        "glare": _glare,
        "blur": _blur,
        "wrong_marker": _wrong_marker,
        "second_board": _second_board,
        "moved_camera": _moved_camera,
        "stale_calibration": _stale_calibration,
    }
)
