"""A scan of an unknown board: camera poses all over the area in which it lies, and their pictures.

Known is the area alone: where on the table, how large, and what nothing in it is taller than. The
camera goes over it in rows, once looking straight down and once leaning to each of four sides, so
that walls are seen and what lies in the shadow of tall parts from one side is lit from another.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.errors import InputError, Unreachable
from aoicell.nominal import Nominal, View
from aoicell.planning.depth import DepthCell, DepthImage
from aoicell.robot.collision import CollisionModel
from aoicell.surroundings import collision_model
from aoicell.transforms import SE3, Array, translation

_PATH_STEP = float(np.radians(3))  # of the fastest joint, between two checks for contact


@dataclass(frozen=True)
class ScanArea:
    """A box on the table in which the board lies; z = 0 of its frame is the table (m)."""

    T_base_area: SE3
    width: float
    depth: float
    height: float = 0.06

    def __post_init__(self) -> None:
        for name in ("width", "depth", "height"):
            if not 0 < getattr(self, name) <= 2:
                raise InputError(
                    f"scan area: its {name} is {getattr(self, name):g} m; it must be from 0 to 2 m"
                )


@dataclass(frozen=True)
class ScanConfig:
    """How the area is gone over.

    `overlap` of neighbouring pictures, looking down and leaning by `tilt` (rad); `roll` (rad) of
    the camera about the normal. Postures keep `limit_margin` (rad) from joint limits,
    `singularity` as the smallest singular value and `clearance` (m) from everything.
    """

    overlap: float = 0.45
    leaning_overlap: float = 0.2
    tilt: float = float(np.radians(22))
    roll: float = float(np.radians(4))
    limit_margin: float = float(np.radians(8))
    singularity: float = 0.05
    clearance: float = 0.02


@dataclass(frozen=True)
class ScanPlan:
    """Joint angles (rad) of the pictures in their order, and why other poses were left out."""

    qs: tuple[Array, ...]
    views: tuple[View, ...]
    left_out: tuple[str, ...]


def area_about(nominal: Nominal, width: float, depth: float, height: float = 0.06) -> ScanArea:
    """An area (m) on the table about the place where boards are put, along their sides."""
    T, table = nominal.T_base_board, float(nominal.T_base_tabletarget.translation[2])
    x, y, _ = T.translation
    return ScanArea(SE3(T.rotation, np.array([x, y, table])), width, depth, height)


def plan_scan(
    nominal: Nominal, area: ScanArea, distance: float, config: ScanConfig | None = None
) -> ScanPlan:
    """Poses of the hand camera over an area, `distance` (m) above what may be the highest part.

    Every posture and every straight joint path between two is free of contact in the design.
    Raises Unreachable when too few poses are left to cover the area.
    """
    config = config or ScanConfig()
    surroundings = collision_model(_with_area(nominal, area), config.clearance)
    qs, views, left_out = [nominal.q_home], [], []
    for view in _views(area, nominal.cameras["hand"], distance, config):
        q = _posture(nominal, area, view, qs[-1], surroundings, config)
        if isinstance(q, str):
            left_out.append(f"{view.id}: {q}")
        else:
            qs.append(q)
            views.append(view)
    plan = ScanPlan(tuple(qs[1:]), tuple(views), tuple(left_out))
    _check_coverage(plan, area, nominal.cameras["hand"])
    return plan


def take_scan(
    cell: DepthCell, plan: ScanPlan, tell: Callable[[int], None] = lambda done: None
) -> Iterator[DepthImage]:
    """Visit the poses and take a depth image at each; `tell` hears how many are done."""
    for index, q in enumerate(plan.qs, start=1):
        cell.move(q)
        yield cell.capture_depth()
        tell(index)


def _views(area: ScanArea, camera: Camera, distance: float, config: ScanConfig) -> Iterator[View]:
    """Rows over the area, there and back, for each lean of the camera."""
    a = config.tilt
    for lean in ((0.0, 0.0), (a, 0.0), (0.0, a), (-a, 0.0), (0.0, -a)):
        overlap = config.leaning_overlap if any(lean) else config.overlap
        footprint = np.array([camera.width, camera.height]) / camera.focal_px * distance
        xs, ys = (
            _places(side, seen, overlap)
            for side, seen in zip((area.width, area.depth), footprint, strict=True)
        )
        for row, y in enumerate(ys):
            for x in xs if row % 2 == 0 else xs[::-1]:
                name = f"x {x * 1e3:.0f}, y {y * 1e3:.0f} mm, lean {np.degrees(lean).round()}"
                aim = (float(x), float(y), area.height)
                yield View(name, distance, lean, config.roll, aim)


def _places(side: float, seen: float, overlap: float) -> Array:
    """Middles of pictures that see `seen` (m) each, so that they cover a side (m)."""
    count = max(1, int(np.ceil((side - seen) / (seen * (1 - overlap)))) + 1)
    reach = max(side - seen, 0.0) / 2
    return np.linspace(-reach, reach, count) if count > 1 else np.zeros(1)


def _posture(
    nominal: Nominal, area: ScanArea, view: View, q_before: Array, surroundings: CollisionModel,
    config: ScanConfig,
) -> Array | str:  # fmt: skip
    """Joint angles (rad) for a view of the area, or why it is not to be had."""
    T_base_camera = area.T_base_area * view.T_target_camera
    try:
        q = nominal.arm.ik(T_base_camera * nominal.T_flange_camera.inverse(), q_before, "scan")
    except Unreachable as error:
        return str(error)
    if nominal.arm.limit_margin(q) < config.limit_margin:
        return "a joint would be too near its limit"
    if nominal.arm.singularity_margin(q) < config.singularity:
        return "the arm would be near a singular posture"
    steps = max(1, int(np.ceil(np.abs(q - q_before).max() / _PATH_STEP)))
    way = q_before + np.linspace(0, 1, steps + 1)[1:, None] * (q - q_before)
    touch = surroundings.first_touch(way)
    return f"{touch[1][0]} would touch {touch[1][1]} on the way" if touch else q


def _with_area(nominal: Nominal, area: ScanArea) -> Nominal:
    """The design with a block that fills the area in place of the board that is not known."""
    size = (area.width, area.depth, area.height)
    block = BoardDesign("scan area", size, (0.5, 0.5, 0.5), (), ())
    return replace(nominal, board=block, T_base_board=area.T_base_area * translation(z=area.height))


def _check_coverage(plan: ScanPlan, area: ScanArea, camera: Camera) -> None:
    """Raise Unreachable unless all of the area's floor is in two pictures at least."""
    seen = times_seen(plan.views, area, camera)
    if seen.min() >= 2:
        return
    share = float((seen < 2).mean())
    raise Unreachable(
        f"scan: {share:.0%} of the area would be in fewer than two pictures; "
        f"{len(plan.left_out)} poses are left out, the first at "
        f"{plan.left_out[0] if plan.left_out else 'none'}; move the area closer to the arm or make "
        "it smaller"
    )


def times_seen(views: Sequence[View], area: ScanArea, camera: Camera, step: float = 0.01) -> Array:
    """In how many pictures each point of a raster over the area's floor is, (N,)."""
    x, y = (np.arange(-side / 2, side / 2 + step, step) for side in (area.width, area.depth))
    points = np.stack(np.meshgrid(x, y, [0.0]), axis=-1).reshape(-1, 3)
    count = np.zeros(len(points))
    high = np.array([camera.width, camera.height]) - 1
    for view in views:
        uv = camera.project(points, view.T_target_camera.inverse())
        count += ((uv >= 0) & (uv <= high)).all(axis=1)
    return count
