"""The next best calibration poses: those that shrink the predicted error at the work points most.

Before any picture is taken, the joint refinement can be linearised at the design: each candidate
pose brings the information of its view, with the pixel noise, the arm's deviation in it and the
priors of the arm's joint terms. With H the normal matrix and J how the work points' pixels
depend on the parameters, poses are chosen one after another to minimise trace(J H^-1 J'): the
A-optimal design for the predictions (Fedorov 1972), chosen greedily.

A work point stands firmly beside the calibration target: what a turn of the arm's first joint
or of the whole base does to both alike is no error in any picture.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from aoicell.calibration.bundle import Noise, normal_equations
from aoicell.calibration.candidates import (
    CandidateConfig,
    candidates,
    free_path,
    hand_eye_start,
)
from aoicell.calibration.measurement import chain, linearise
from aoicell.calibration.parameters import (
    DEFAULT_PRIOR,
    ArmPrior,
    Estimate,
    Layout,
    Model,
    conform,
    layout_of,
)
from aoicell.calibration.problem import (
    CalibrationView,
    Eye,
    Fixture,
    Indices,
    Problem,
    Sight,
)
from aoicell.errors import Unreachable
from aoicell.nominal import Nominal
from aoicell.surroundings import collision_model
from aoicell.transforms import Array, apply

_EYE, _TARGET, _WORK = "hand", "tabletarget", "work"
# What is known without any picture, where a layout has no prior of its own: a camera and a
# target within some centimetres and degrees of their design, a lens within some per cent,
# a print within some tenths of one.
_POSE = np.array([0.05] * 3 + [0.1] * 3)
_FOCAL, _CENTRE, _DISTORTION, _SIZE = 0.05, 0.02, 0.3, 1e-3


@dataclass(frozen=True)
class PlanningConfig:
    """How many poses, out of how many candidates, and what is assumed of pixels and arm."""

    count: int = 15
    candidates: int = 300
    seed: int = 0
    sigma_px: float = 0.03
    prior: ArmPrior = DEFAULT_PRIOR
    usable: CandidateConfig = field(default_factory=CandidateConfig)


@dataclass(frozen=True)
class WorkView:
    """Points (N, 3) in the base that matter at joint angles q (rad), by design."""

    q: Array
    points: Array


@dataclass(frozen=True)
class PlannedPose:
    """Joint angles (rad), and the error of the work points once its picture is used.

    Root mean squares over all work points of their distance in the picture (px), and the same
    across the line of sight (mm).
    """

    q: Array
    predicted_px: float
    predicted_mm: float


@dataclass(frozen=True)
class PosePlan:
    """Poses in the order in which they help most; each can be driven to from the one before.

    `candidates` is how many usable poses there were to choose from; `taken_px` and `taken_mm`
    are the predicted error after what was taken before, NaN without.
    """

    poses: tuple[PlannedPose, ...]
    candidates: int
    taken_px: float = np.nan
    taken_mm: float = np.nan

    @property
    def qs(self) -> list[Array]:
        """Joint angles (rad) of all poses."""
        return [pose.q for pose in self.poses]


def plan_poses(
    nominal: Nominal, config: PlanningConfig = PlanningConfig(),
    work: Sequence[WorkView] | None = None, taken: Sequence[Array] = (),
) -> PosePlan:  # fmt: skip
    """The next `count` poses over chessboard 2, given pictures taken before at joint angles (rad).

    Without `work` the points are what the inspection views show of the server board. The same
    arguments give the same plan. Raises Unreachable when there are too few usable poses.
    """
    drawn = candidates(
        nominal, config.candidates, np.random.default_rng(config.seed), config.usable
    )
    seen = _Predictor(nominal, config, inspection_work(nominal) if work is None else work)
    cell = collision_model(nominal, config.usable.clearance_mm / 1e3)
    H, told = seen.before + seen.information(taken).sum(axis=0), seen.information(drawn)
    before = seen.errors(H) if len(taken) else (np.nan, np.nan)
    left, poses = np.arange(len(drawn)), list[PlannedPose]()
    at = taken[-1] if len(taken) else hand_eye_start(nominal)
    while len(poses) < config.count:
        ranked = left[np.argsort(seen.merits(H + told[left]), kind="stable")]
        chosen = next((i for i in ranked if free_path(cell, at, drawn[i])), None)
        if chosen is None:
            raise Unreachable(
                f"calibration poses: after {len(poses)} of {config.count} no other candidate can "
                "be driven to without contact; draw more of them, or make room at chessboard 2"
            )
        H, at, left = H + told[chosen], drawn[chosen], left[left != chosen]
        poses.append(PlannedPose(at, *seen.errors(H)))
    return PosePlan(tuple(poses), len(drawn), *before)


def inspection_work(nominal: Nominal) -> list[WorkView]:
    """The tops of the components (N, 3) in each inspection view, in the base."""
    q_start, camera = nominal.q_home, nominal.cameras["hand"]
    tops = np.array([[c.x, c.y, c.top] for c in nominal.board.components])
    work = []
    for view in nominal.inspection_views:
        T_board_camera = view.T_target_camera
        flange = nominal.T_base_board * T_board_camera * nominal.T_flange_camera.inverse()
        shown = [camera.sees(top, T_board_camera.inverse()) for top in tops]
        q = nominal.arm.ik(flange, q_start, f"inspection view {view.id}")
        work.append(WorkView(q, apply(nominal.T_base_board, tops[shown])))
    return work


class _Predictor:
    """The joint refinement linearised at the design: what views tell, and errors at the work."""

    def __init__(self, nominal: Nominal, config: PlanningConfig, work: Sequence[WorkView]) -> None:
        self._nominal, self._model = nominal, Model(robot="joint_terms")
        prior, corners = config.prior, nominal.tabletarget.corners
        deviation = (prior.deviation_mm / 1e3, float(np.radians(prior.deviation_deg)))
        self._noise = Noise(config.sigma_px, *deviation)
        self._target = Fixture(_TARGET, corners)
        self._layout = layout_of(self._problem(self._target, []), self._model, prior)
        known = _known_before(self._layout, nominal)
        self.before, self._scale = np.diag(1 / known**2), 1 / known
        J, metres = self._work(work)
        J = J / self._scale * np.sqrt(2 / len(J))  # mean over the points, u and v summed
        self._px2, self._m2 = J.T @ J, (J.T * metres**2) @ J

    def information(self, qs: Sequence[Array]) -> Array:
        """What a view at each of the joint angles adds to the normal matrix, (N, P, P)."""
        if not len(qs):
            return np.zeros((0, *self.before.shape))
        every = np.arange(len(self._target.points))
        problem = self._problem(self._target, [(q, every) for q in qs])
        estimate = self._estimate(problem)
        lin = linearise(problem, self._layout, estimate)
        return normal_equations(self._layout, estimate, lin, self._noise).information

    def merits(self, H: Array) -> Array:
        """Predicted squared error (px^2) at the work under normal matrices (N, P, P)."""
        return np.asarray(np.einsum("nij,ji->n", self._covariance(H), self._px2))

    def errors(self, H: Array) -> tuple[float, float]:
        """Predicted error at the work under a normal matrix, in px and mm."""
        covariance = self._covariance(H)
        px, m = (float(np.sqrt(np.trace(covariance @ M))) for M in (self._px2, self._m2))
        return px, m * 1e3

    def _covariance(self, H: Array) -> Array:
        """In units of what is known before, so that nothing is badly scaled."""
        return np.asarray(np.linalg.inv(H / np.outer(self._scale, self._scale)))

    def _work(self, work: Sequence[WorkView]) -> tuple[Array, Array]:
        """J (R, P) of the pixels of all work points, and the metres (R,) across of a pixel."""
        T_target_base = self._nominal.T_base_tabletarget.inverse()
        points = [apply(T_target_base, view.points) for view in work]
        ends = np.cumsum([len(p) for p in points])
        fixture = Fixture(_WORK, np.vstack(points))
        ids = [np.arange(end - len(p), end) for p, end in zip(points, ends, strict=True)]
        looks = [(view.q, mine) for view, mine in zip(work, ids, strict=True)]
        problem = self._problem(fixture, looks)
        estimate, metres = self._estimate(problem), []
        lin = linearise(problem, self._layout, estimate)
        eye, target = (self._layout.blocks[key] for key in (("eye", _EYE), ("fixture", _TARGET)))
        for view, rows, mine in zip(problem.views, lin.rows, ids, strict=True):
            T = chain(problem, estimate, _EYE, _WORK, view.T_base_flange).T_camera_fixture
            # a work point moves with the target: as if the camera moved the other way
            lin.J[rows, target] = -lin.J[rows, eye] @ T.toActionMatrix()
            depths = apply(T, fixture.points[mine])[:, 2]
            metres.append(np.repeat(depths / self._nominal.cameras["hand"].focal_px, 2))
        return lin.J, np.concatenate(metres)

    def _problem(self, fixture: Fixture, looks: Sequence[tuple[Array, Indices]]) -> Problem:
        """Views from joint angles that show points of a fixture on the target, as designed."""
        nominal, camera = self._nominal, self._nominal.cameras["hand"]
        views = []
        for k, (q, ids) in enumerate(looks):
            T_base_flange = nominal.arm.fk(q)
            T = (T_base_flange * nominal.T_flange_camera).actInv(nominal.T_base_tabletarget)
            uv = camera.project(fixture.points[ids], T)
            sight = Sight(_EYE, fixture.name, ids, uv)
            views.append(CalibrationView(f"{k + 1}", T_base_flange, (sight,), q))
        return Problem((Eye(_EYE, camera, "flange"),), (fixture,), tuple(views), nominal.arm)

    def _estimate(self, problem: Problem) -> Estimate:
        """Everything as designed."""
        nominal = self._nominal
        names = (_TARGET, _WORK)
        design = Estimate(
            T_mount_eye={_EYE: nominal.T_flange_camera},
            T_mount_fixture=dict.fromkeys(names, nominal.T_base_tabletarget),
            cameras={_EYE: nominal.cameras["hand"]},
            scales=dict.fromkeys(names, 1.0),
            deviations=np.zeros((len(problem.views), 6)),
        )
        return conform(problem, self._model, design)


def _known_before(layout: Layout, nominal: Nominal) -> Array:
    """Standard deviations (P,) before any picture; the layout's own priors where it has any."""
    camera = nominal.cameras["hand"]
    focal, centre = _FOCAL * camera.focal_px, _CENTRE * camera.width
    vague = np.full(layout.size, _SIZE)
    for (kind, _), where in layout.blocks.items():
        if kind in ("eye", "fixture"):
            vague[where] = _POSE
        elif kind == "intrinsics":
            lens = [_DISTORTION] * (where.stop - where.start - 4)
            vague[where] = [focal, focal, centre, centre, *lens]
    return np.where(np.isfinite(layout.prior), layout.prior, vague)
