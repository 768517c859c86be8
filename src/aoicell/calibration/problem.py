"""What a calibration starts from: eyes, fixtures, and what was seen at which arm pose.

An eye is a camera on the flange or on the base; a fixture is a target on the base or on the
flange. Eye in hand is an eye on the flange that sees a fixture on the base, eye to hand the
reverse. Several of both go into one problem, and an eye and a fixture that stand on the same
side are welcome: they tie two eyes, or two fixtures, together.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera
from aoicell.errors import InputError, did_you_mean
from aoicell.robot import Arm
from aoicell.transforms import SE3, Array, distance_deg, distance_mm, is_rigid

Mount = Literal["base", "flange"]
Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Eye:
    """A camera and where it is mounted.

    `camera` holds the intrinsics to start from, or to keep where `refine` is off; an eye that
    reports poses instead of pixels has none.
    """

    name: str
    camera: Camera | None
    mount: Mount
    refine: bool = True


# Where a fixture's points do not matter (poses instead of pixels): a square of 100 mm.
_SQUARE = np.array([[-0.05, 0.05, 0], [0.05, 0.05, 0], [0.05, -0.05, 0], [-0.05, -0.05, 0]])


@dataclass(frozen=True)
class Fixture:
    """A target: its points (M, 3) in its own frame (m), z out of the print.

    `half_turns`: it looks the same after a half turn, point i and M - 1 - i change places.
    `scale`: whether the size of the print is believed, as far as it can be, or one factor for it
    is estimated. `size_std` and `flatness_std` (m) say how far: standard deviations of the size,
    as a share of it, and of the heights by which the plate is bent. The default is a sheet from
    a laser printer (0.1 %), glued on a plate (0.2 % of half its width).
    """

    name: str
    points: Array = field(default_factory=_SQUARE.copy)
    mount: Mount = "base"
    half_turns: bool = False
    scale: Literal["known", "free"] = "known"
    size_std: float = 1e-3
    flatness_std: float | None = None


@dataclass(frozen=True)
class Sight:
    """Points of one fixture in one eye's picture: `ids` (N,) into its points, `uv_px` (N, 2)."""

    eye: str
    fixture: str
    ids: NDArray[Any]
    uv_px: Array


@dataclass(frozen=True)
class PoseSight:
    """A fixture's pose as an eye reports it, where its pixels are not at hand."""

    eye: str
    fixture: str
    T_camera_fixture: SE3


@dataclass(frozen=True)
class CalibrationView:
    """One arm pose, as the controller has it, and what was seen there.

    `q` (dof,): joint angles (rad), where they are known.
    """

    id: str
    T_base_flange: SE3
    sights: tuple[Sight | PoseSight, ...]
    q: Array | None = None


@dataclass(frozen=True)
class Problem:
    """A whole calibration problem; `arm`, the nominal model, allows for joint terms.

    Raises InputError, naming the view, on anything that is not finite, rigid or of one piece.
    """

    eyes: tuple[Eye, ...]
    fixtures: tuple[Fixture, ...]
    views: tuple[CalibrationView, ...]
    arm: Arm | None = None

    def __post_init__(self) -> None:
        for what, items in (
            ("eye", [e.name for e in self.eyes]),
            ("fixture", [f.name for f in self.fixtures]),
            ("view", [v.id for v in self.views]),
        ):
            twice = [name for name, count in Counter(items).items() if count > 1]
            if twice:
                raise InputError(f"{what} '{twice[0]}' is there twice; give each a name of its own")
        if len({e.camera is None for e in self.eyes}) > 1:
            raise InputError("eyes: either all see pixels and have a camera, or all report poses")
        for view in self.views:
            _check_view(self, view)

    def eye(self, name: str) -> Eye:
        """The eye of that name."""
        return next(e for e in self.eyes if e.name == name)

    def fixture(self, name: str) -> Fixture:
        """The fixture of that name."""
        return next(f for f in self.fixtures if f.name == name)

    @property
    def of_poses(self) -> bool:
        """Whether the eyes report poses instead of pixels."""
        return any(e.camera is None for e in self.eyes)

    @property
    def has_joints(self) -> bool:
        """Whether the arm and the joint angles of all views are known."""
        return self.arm is not None and all(v.q is not None for v in self.views)

    def with_views(self, views: Sequence[CalibrationView]) -> "Problem":
        """The same eyes and fixtures with other views."""
        return Problem(self.eyes, self.fixtures, tuple(views), self.arm)


def moves(eye: Eye, fixture: Fixture) -> bool:
    """Whether the arm's motion moves the fixture in the eye's picture."""
    return eye.mount != fixture.mount


def pairs_seen(problem: Problem) -> list[tuple[Eye, Fixture]]:
    """Each eye with each fixture that it sees in any view, in a settled order."""
    seen = {(s.eye, s.fixture) for view in problem.views for s in view.sights}
    return [(e, f) for e in problem.eyes for f in problem.fixtures if (e.name, f.name) in seen]


def sights_of(problem: Problem, eye: Eye, fixture: Fixture) -> Iterator[tuple[int, int]]:
    """(view index, sight index) of each sight of a fixture by an eye."""
    for v, view in enumerate(problem.views):
        for s, sight in enumerate(view.sights):
            if (sight.eye, sight.fixture) == (eye.name, fixture.name):
                yield v, s


def _check_view(problem: Problem, view: CalibrationView) -> None:
    if not is_rigid(view.T_base_flange, 1e-4):
        raise InputError(
            f"view '{view.id}': T_base_flange is no rigid transform (not finite, not orthonormal "
            "or left-handed); check the file and the pose format"
        )
    eyes, fixtures = [e.name for e in problem.eyes], [f.name for f in problem.fixtures]
    for sight in view.sights:
        for name, known in ((sight.eye, eyes), (sight.fixture, fixtures)):
            if name not in known:
                raise InputError(f"view '{view.id}': unknown '{name}'; {did_you_mean(name, known)}")
        if isinstance(sight, PoseSight):
            _check_pose_sight(problem.eye(sight.eye), view.id, sight)
        else:
            _check_sight(problem.eye(sight.eye), problem.fixture(sight.fixture), view.id, sight)
    if view.q is not None and problem.arm is not None:
        _check_joints(problem.arm, view, view.q)


def _check_pose_sight(eye: Eye, view: str, sight: PoseSight) -> None:
    if eye.camera is not None:
        raise InputError(
            f"view '{view}': eye '{eye.name}' has intrinsics and reports a pose; give its pixels, "
            "or no intrinsics"
        )
    if not is_rigid(sight.T_camera_fixture, 1e-4):
        raise InputError(
            f"view '{view}': the pose of '{sight.fixture}' in '{eye.name}' is no rigid transform; "
            "check the file and the pose format"
        )


def _check_sight(eye: Eye, fixture: Fixture, view: str, sight: Sight) -> None:
    where = f"view '{view}': '{fixture.name}' in '{eye.name}'"
    ids, uv = np.asarray(sight.ids), np.asarray(sight.uv_px)
    if eye.camera is None:
        raise InputError(f"{where}: pixels need intrinsics to start from; give the eye a camera")
    if uv.shape != (len(ids), 2) or not np.isfinite(uv).all():
        raise InputError(f"{where}: uv_px has to hold {len(ids)} finite pixel pairs, one for an id")
    if len(ids) < 4 or len(np.unique(ids)) < len(ids):
        raise InputError(f"{where}: {len(np.unique(ids))} different points are seen; 4 are needed")
    if ids.min() < 0 or ids.max() >= len(fixture.points):
        raise InputError(
            f"{where}: point {int(ids.max())} is not among its {len(fixture.points)} points"
        )


def _check_joints(arm: Arm, view: CalibrationView, q: Array) -> None:
    if np.shape(q) != (arm.dof,) or not np.isfinite(q).all():
        raise InputError(f"view '{view.id}': q has to hold {arm.dof} finite joint angles (rad)")
    T = arm.fk(q)
    mm, deg = distance_mm(T, view.T_base_flange), distance_deg(T, view.T_base_flange)
    if mm > 0.5 or deg > 0.05:
        raise InputError(
            f"view '{view.id}': the joint angles give a flange pose {mm:.1f} mm and {deg:.2f} deg "
            "off T_base_flange; both have to belong to the same model and frame"
        )
