"""Recordings of a calibration without pictures: drawn cells, what their eyes see, and the truth.

The arm is the nominal cell's; the views look at the table's board as a person would take them:
leaning both ways, rolled, from different distances.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pinocchio as pin

from aoicell.calibration.problem import CalibrationView, Eye, Fixture, Problem, Sight
from aoicell.camera import Camera
from aoicell.errors import Unreachable
from aoicell.nominal import Nominal, load_nominal
from aoicell.resources import data_root
from aoicell.robot import Arm
from aoicell.transforms import SE3, Array, looking_at


@cache
def cell() -> Nominal:
    """The shipped cell as designed."""
    return load_nominal(data_root() / "cell")


@dataclass(frozen=True)
class Conditions:
    """How a recording is made; standard deviations of what is drawn, lengths in mm."""

    views: int = 15
    sigma_px: float = 0.05
    repeat_mm: float = 0.0
    repeat_deg: float = 0.0
    joint_deg: float = 0.0
    origin_mm: float = 0.0
    axis_deg: float = 0.0
    focal_error: float = 0.01
    centre_px: float = 8.0
    distortion: tuple[float, ...] = (-0.08, 0.02, 3e-4, -2e-4, 0.0)
    scale: float = 1.0
    tilt_deg: float = 25.0
    roll_deg: float = 45.0
    distances_mm: tuple[float, float] = (430.0, 620.0)
    refine: bool = True
    joints_known: bool = True
    boards: tuple[str, ...] = ("hand",)  # hand, tripod
    half_turns: bool = False


@dataclass(frozen=True)
class Truth:
    """What a recording was made with."""

    arm: Arm
    T_mount_eye: dict[str, SE3]
    T_mount_fixture: dict[str, SE3]
    cameras: dict[str, Camera]
    scales: dict[str, float]
    flanges: list[SE3] = field(default_factory=list)

    def sees(self, problem: Problem, eye: str, fixture: str, flange: SE3) -> Array:
        """Pixels (M, 2) of all points of a fixture, with the flange really at `flange`."""
        E, F = self.T_mount_eye[eye], self.T_mount_fixture[fixture]
        E = flange * E if problem.eye(eye).mount == "flange" else E
        F = flange * F if problem.fixture(fixture).mount == "flange" else F
        points = self.scales[fixture] * problem.fixture(fixture).points
        return self.cameras[eye].project(points, E.actInv(F))


@dataclass(frozen=True)
class Recording:
    """A problem, its truth, and arm poses of the same kind that it does not contain."""

    problem: Problem
    truth: Truth
    unused_q: list[Array]


@cache
def pool(tilt_deg: float, roll_deg: float, distances_mm: tuple[float, float]) -> list[Array]:
    """Joint angles of views at the table's board, by the nominal kinematics: drawn once."""
    rng, nominal, qs = np.random.default_rng(7), cell(), []
    while len(qs) < _POOL:
        tilt = np.radians(rng.uniform(-tilt_deg, tilt_deg, 2))
        roll = np.radians(rng.uniform(-roll_deg, roll_deg))
        distance = rng.uniform(*distances_mm) / 1e3
        aim = [*rng.uniform(-0.03, 0.03, 2), 0.0]
        T_camera = nominal.T_base_tabletarget * looking_at(aim, distance, (tilt[0], tilt[1]), roll)
        with suppress(Unreachable):
            qs.append(nominal.arm.ik(T_camera * nominal.T_flange_camera.inverse(), nominal.q_home))
    return qs


_POOL = 60


def draw_recording(seed: int, conditions: Conditions = Conditions()) -> Recording:
    """A cell drawn from a seed and what its eyes see at random arm poses."""
    rng = np.random.default_rng([seed, 4711])
    nominal, c = cell(), conditions
    qs = [pool(c.tilt_deg, c.roll_deg, c.distances_mm)[i] for i in rng.permutation(_POOL)]
    qs, unused = qs[: c.views], qs[c.views : c.views + 10]
    tilts = np.random.default_rng([seed, 4712]).standard_normal((6, 2))
    arm = nominal.arm.corrected(
        np.radians(c.joint_deg) * rng.standard_normal(6),
        np.hstack(
            [c.origin_mm / 1e3 * rng.standard_normal((6, 3)), np.radians(c.axis_deg) * tilts]
        ),
    )
    truth = Truth(arm, {}, {}, {}, {})
    eyes, fixtures = [], []

    def moved(T: SE3, mm: float, deg: float) -> SE3:
        twist = np.concatenate([mm / 1e3 * rng.standard_normal(3),
                                np.radians(deg) * rng.standard_normal(3)])  # fmt: skip
        return T * pin.exp6(twist)

    def board(name: str, mount: str, T: SE3, points: Array) -> None:
        truth.T_mount_fixture[name] = moved(T, 3, 0.5)
        truth.scales[name] = c.scale
        fixtures.append(Fixture(name, points, mount, half_turns=c.half_turns))  # type: ignore[arg-type]

    def eye(name: str, mount: str, T: SE3, camera: Camera) -> None:
        truth.T_mount_eye[name] = moved(T, 2, 0.7)
        truth.cameras[name] = as_built(rng, camera, c)
        start = camera if c.refine else truth.cameras[name]
        eyes.append(Eye(name, start, mount, refine=c.refine))  # type: ignore[arg-type]

    board("tabletarget", "base", nominal.T_base_tabletarget, nominal.tabletarget.corners)
    if "hand" in c.boards:
        eye("hand", "flange", nominal.T_flange_camera, nominal.cameras["hand"])
    if "tripod" in c.boards:
        board("armtarget", "flange", nominal.T_flange_armtarget, nominal.armtarget.corners)
        eye("tripod", "base", nominal.T_base_tripod, nominal.cameras["tripod"])
    views = []
    empty = Problem(tuple(eyes), tuple(fixtures), (), nominal.arm)
    for k, q in enumerate(qs):
        deviation = np.concatenate([c.repeat_mm / 1e3 * rng.standard_normal(3),
                                    np.radians(c.repeat_deg) * rng.standard_normal(3)])  # fmt: skip
        flange = arm.fk(q) * pin.exp6(deviation)
        truth.flanges.append(flange)
        sights = [
            Sight(e, f, np.arange(len(uv)), uv + c.sigma_px * rng.standard_normal(uv.shape))
            for e, f in _looks(c)
            for uv in [truth.sees(empty, e, f, flange)]
            if _visible(truth.cameras[e], uv) or e == "hand"
        ]
        known_q = q if c.joints_known else None
        views.append(CalibrationView(f"v{k:02d}", nominal.arm.fk(q), tuple(sights), known_q))
    problem = Problem(
        tuple(eyes), tuple(fixtures), tuple(views), nominal.arm if c.joints_known else None
    )
    return Recording(problem, truth, unused)


def as_built(rng: np.random.Generator, camera: Camera, c: Conditions) -> Camera:
    """The real camera behind a nominal one."""
    K = np.array(camera.K)
    K[[0, 1], [0, 1]] *= 1 + c.focal_error * rng.standard_normal()
    K[:2, 2] += c.centre_px * rng.standard_normal(2)
    return replace(camera, K=K, distortion=np.array(c.distortion))


def prediction_gaps(
    recording: Recording, uv_predicted: Sequence[Array], eye: str, fixture: str
) -> Array:
    """Predicted minus true pixels (poses, N, 2) at the unused poses, the arm arriving exactly."""
    truth = recording.truth
    return np.array(
        [
            uv - truth.sees(recording.problem, eye, fixture, truth.arm.fk(q))
            for uv, q in zip(uv_predicted, recording.unused_q, strict=True)
        ]
    )


def _looks(c: Conditions) -> list[tuple[str, str]]:
    looks = [("hand", "tabletarget")] if "hand" in c.boards else []
    if "tripod" in c.boards:
        looks += [("tripod", "armtarget"), ("tripod", "tabletarget")]
    return looks


def _visible(camera: Camera, uv: Array) -> bool:
    high = np.array([camera.width, camera.height])
    return bool((uv > 0).all() and (uv < high).all())


BAD = (
    "missing pose",
    "three views",
    "one axis",
    "translation only",
    "shuffled",
    "two swapped",
    "mm as m",
    "m as mm",
    "board in mm",
    "transposed",
    "inverted",
    "nan pose",
    "nan pixel",
    "left-handed",
)


def spoil(recording: Recording, kind: str, rng: np.random.Generator) -> Callable[[], Problem]:
    """A recording with one thing wrong, to be built when called: some are refused right there."""
    problem = recording.problem
    views = list(problem.views)
    poses = [v.T_base_flange for v in views]

    def with_poses(changed: Sequence[SE3]) -> Callable[[], Problem]:
        moved = [replace(v, T_base_flange=T, q=None) for v, T in zip(views, changed, strict=False)]
        return lambda: replace(problem, views=tuple(moved), arm=None)

    match kind:
        case "missing pose":  # one line of the file is gone, so the rest moves up
            gone = int(rng.integers(1, len(poses) - 1))
            return with_poses(poses[:gone] + poses[gone + 1 :])
        case "three views":
            return lambda: problem.with_views(views[:3])
        case "one axis" | "translation only":
            return _degenerate(recording, kind, rng)
        case "shuffled":
            return with_poses([poses[i] for i in _no_fixed_point(len(poses), rng)])
        case "two swapped":
            i, j = rng.choice(len(poses), 2, replace=False)
            poses[i], poses[j] = poses[j], poses[i]
            return with_poses(poses)
        case "mm as m" | "m as mm":
            factor = 1e3 if kind == "mm as m" else 1e-3
            return with_poses([SE3(T.rotation, factor * T.translation) for T in poses])
        case "board in mm":
            fixtures = tuple(replace(f, points=1e3 * f.points) for f in problem.fixtures)
            return lambda: replace(problem, fixtures=fixtures)
        case "transposed":
            return with_poses([SE3(T.rotation.T.copy(), T.translation) for T in poses])
        case "inverted":
            return with_poses([T.inverse() for T in poses])
        case "nan pose":
            k = int(rng.integers(len(poses)))
            poses[k] = SE3(poses[k].rotation, np.array([np.nan, 0, 0]))
            return with_poses(poses)
        case "left-handed":
            poses = [SE3(T.rotation * [1, 1, -1], T.translation) for T in poses]
            return with_poses(poses)
        case "nan pixel":
            k = int(rng.integers(len(views)))
            sight = views[k].sights[0]
            assert isinstance(sight, Sight)
            uv = sight.uv_px.copy()
            uv[int(rng.integers(len(uv)))] = np.nan
            views[k] = replace(views[k], sights=(replace(sight, uv_px=uv),))
            return lambda: problem.with_views(views)
    raise ValueError(kind)


def _no_fixed_point(count: int, rng: np.random.Generator) -> list[int]:
    order = rng.permutation(count)
    while (order == np.arange(count)).any():
        order = rng.permutation(count)
    return [int(i) for i in order]


def _degenerate(recording: Recording, kind: str, rng: np.random.Generator) -> Callable[[], Problem]:
    """The same cell seen while the flange turns about one axis only, or not at all."""
    problem, truth = recording.problem, recording.truth
    first = problem.views[0]
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    views = []
    for k in range(len(problem.views)):
        turn = np.radians(rng.uniform(-20, 20)) if kind == "one axis" else 0.0
        shift = rng.uniform(-0.03, 0.03, 3)
        T = first.T_base_flange * SE3(pin.exp3(turn * axis), shift)
        uv = truth.sees(problem, "hand", "tabletarget", T)
        uv = uv + 0.05 * rng.standard_normal(uv.shape)
        sight = Sight("hand", "tabletarget", np.arange(len(uv)), uv)
        views.append(CalibrationView(f"d{k:02d}", T, (sight,)))
    return lambda: replace(problem, views=tuple(views), arm=None)
