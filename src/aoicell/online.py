"""The online phase on one page: find the board, correct the taught views, go there, look again.

Knows the `Cell` protocol only. Whoever calibrated with a joint refinement also knows what the
correction leaves, and refuses where that is too much or where the camera has changed.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aoicell.correction import Correction, Unreached, correct, shifted_views, with_bounds
from aoicell.errors import Refused, TargetNotFound, Unreachable
from aoicell.first_look import (
    Look,
    Reference,
    Sliding,
    expected_leftover,
    rigidity,
)
from aoicell.leftover import Drift, Leftover, motion_of, rms_of
from aoicell.localization import localize
from aoicell.markerless import LocatedTexture
from aoicell.nominal import Nominal
from aoicell.observation import Cell, Observation, capture_at
from aoicell.pipeline import Calibration, Method
from aoicell.registration import Template, component_points
from aoicell.second_look import compare_markers, look_again
from aoicell.targets.chessboard import half_turn
from aoicell.targets.detector import IN_PICTURES, Detector
from aoicell.targets.layout import Layout, LocatedLayout
from aoicell.targets.pose import solve_pose
from aoicell.transforms import SE3, Array, apply


@dataclass(frozen=True)
class OnlineConfig:
    """When to refuse and when to look again.

    A correction whose 99.9 % bound exceeds `tolerance_mm` is refused, and so is one that rests
    on pictures which contradict the calibration: as far from it as `contradiction` says in the
    mean of so many runs, and `unmoved` for where the reference stands. `drift` is what the camera
    may do unseen since the board was taught, `sliding` how flat a board may be taken to have slid
    (None: never).
    """

    tolerance_mm: float = np.inf
    contradiction: float = 1e-6
    unmoved: float = 1e-2
    drift: Drift = field(default_factory=Drift)
    sliding: Sliding | None = field(default_factory=Sliding)


@dataclass(frozen=True)
class Online:
    """Everything that stays the same from board to board."""

    nominal: Nominal
    calibration: Calibration
    template: Template
    method: Method
    detector: Detector = IN_PICTURES
    config: OnlineConfig = OnlineConfig()

    def markers(self, observation: Observation) -> list[Array]:
        """The marker-like squares in a picture."""
        return self._detector.markers(observation, self.nominal.marker)

    def locate(self, observation: Observation) -> LocatedLayout:
        """The board in a picture from the look-out pose, by codes where its markers bear them.

        A localiser of another package is given the points alone. Raises Refused.
        """
        template, camera = self.template, self.calibration.hand.camera
        if self.method.localize is not localize or not self.nominal.positioning.code:
            return self.method.localize(observation, self.markers(observation), template, camera)
        sightings = self._detector.sightings(observation, self.nominal.marker)
        return localize(observation, sightings, template, camera, codes=self.nominal.marker_codes)

    @property
    def _detector(self) -> Detector:
        return self.method.detector or self.detector


@dataclass(frozen=True)
class Looked:
    """The pictures that locate: the board from its look-out pose, and what never moves."""

    board: Observation
    references: tuple[Observation, ...] = ()


@dataclass(frozen=True)
class Visited:
    """New images by view, and the correction that led there."""

    correction: Correction
    images: Mapping[str, Observation]


def look(cell: Cell, online: Online) -> Looked:
    """The board from the pose where it was taught, then the fixed reference, if there is one."""
    template = online.template
    poses = [template.look, *template.references]
    board, *references = capture_at(cell, [observation.state.q for observation in poses])
    return Looked(board, tuple(references))


def relocate(looked: Looked, online: Online) -> Correction:
    """From those pictures: where the board is, and the corrected taught views."""
    template, calibration = online.template, online.calibration
    located = online.locate(looked.board)
    correction = correct(
        template, located, calibration.T_base_camera(template.look.state),
        calibration.T_base_camera(looked.board.state), calibration.arm,
        online.method.by_equations,
    )  # fmt: skip
    return _assessed(correction, looked, online)


def visits(cell: Cell, correction: Correction, online: Online) -> Iterator[Visited]:
    """Drive to the corrected views, then look again and improve them as often as it pays."""
    visited = _visited(cell, correction)
    yield visited
    for _ in range(1, online.method.looks):
        better = improve(visited, online)
        if better is None:
            return
        visited = _visited(cell, better)
        yield visited


def visit(cell: Cell, correction: Correction, online: Online) -> Visited:
    """Where `visits` ends."""
    *_, last = visits(cell, correction, online)
    return last


def _visited(cell: Cell, correction: Correction) -> Visited:
    """Pictures of the views; one that the arm does not get to is told of, and the others go on."""
    images, unreached = {}, []
    for view in correction.views:
        try:
            [images[view.id]] = capture_at(cell, [view.q])
        except Unreachable as error:
            unreached.append(Unreached(view.id, f"{view.id}: {error}"))
    return Visited(correction.without(unreached), images)


# -- How sure --------------------------------------------------------------------------------


def _assessed(correction: Correction, looked: Looked, online: Online) -> Correction:
    """With what is believed to be left; Raises Refused where that is too much to go on."""
    model, template, config = online.calibration.model, online.template, online.config
    if model is None:
        return correction
    views = {view.id: view for view in template.views}
    leftover, probability = expected_leftover(
        model,
        *_looks(looked, correction.located, template),
        [views[view.id].standard.state.q for view in correction.views],
        [view.q for view in correction.views],
        config.drift,
        references_seen(looked.references, online),
        config.sliding,
    )
    if probability < config.unmoved:
        raise Refused(
            "calibration: the fixed chessboard no longer stands where the camera saw it when the "
            f"board was taught (probability {probability:.0e}); camera, mount or chessboard have "
            "moved: calibrate and teach again",
            "contradicted",
        )
    return _settled(correction, leftover, online)


def _looks(looked: Looked, located: LocatedLayout, template: Template) -> tuple[Look, Look]:
    """The board as taught and now, by the same kind of points."""
    if not isinstance(located, LocatedTexture):
        taught = _look(template.look, template.taught, template)
        return taught, _look(looked.board, located, template)
    # the texture's points are as the taught picture has them: its own error is in them
    T_taught, points = template.taught.T_camera_target, located.points
    return (
        Look(template.look.state.q, points, T_taught, 0.0),
        Look(
            looked.board.state.q, points, located.T_camera_target, 0.0, located.pose.covariance
        ),
    )  # fmt: skip


def _look(observation: Observation, located: LocatedLayout, template: Template) -> Look:
    points = np.concatenate([template.layout[id] for id in located.uvs_px])
    sigma_px = max(template.sigma_px, located.noise_px)  # a poor picture says so itself
    return Look(observation.state.q, points, located.T_camera_target, sigma_px)


def references_seen(pictures: Sequence[Observation], online: Online) -> list[Reference]:
    """The fixed chessboard as taught and now, from each pose; Raises Refused."""
    pairs = zip(online.template.references, pictures, strict=False)
    return [_reference(taught, now, online) for taught, now in pairs]


def _reference(taught: Observation, now: Observation, online: Online) -> Reference:
    board, model = online.nominal.tabletarget, online.calibration.model
    assert model is not None  # without one nobody asks
    before = online.detector.chessboard(taught, board, "reference as taught")
    try:
        after = online.detector.chessboard(now, board, "reference")
    except TargetNotFound as error:
        raise TargetNotFound(str(error), "reference_not_found") from None
    readings = (after, half_turn(after))
    moved = min((uv - before for uv in readings), key=lambda d: float(np.abs(d).max()))
    pose = solve_pose(board.corners, before, model.camera, name="reference")
    # a half turn of the board or not: its points as a set lie the same
    points = apply(pose.T_camera_target, board.corners)
    reference = Reference(taught.state.q, points, moved, model.sigma_px)
    probability = rigidity(model, reference)
    if probability < online.config.contradiction:
        raise Refused(
            "reference: the corners of the fixed chessboard are not where they belong on it "
            f"(probability {probability:.0e}); clear it of what lies on it or shines on it, let "
            "the arm come to rest, and look again",
            "reference_unclear",
        )
    return reference


def _settled(correction: Correction, leftover: Leftover, online: Online) -> Correction:
    """The views shifted by what is expected to be left, with bounds on the rest; or Refused."""
    model, tolerance = online.calibration.model, online.config.tolerance_mm
    assert model is not None
    views, unreached = shifted_views(correction.views, leftover, model)
    settled = replace(correction, views=views, leftover=leftover.corrected()).without(unreached)
    settled = with_bounds(settled, model, _targets(online))
    worst = max(settled.views, key=lambda view: view.bound.mm_999 if view.bound else 0.0)
    if worst.bound and not worst.bound.mm_999 <= tolerance:  # also when it is NaN
        raise Refused(
            f"correction: {worst.bound.mm_999:.2f} mm may be left at {worst.id} (99.9 %), at most "
            f"{tolerance:.2f} mm is accepted; look again with more markers in view, or calibrate "
            "with more poses",
            "bound_above_tolerance",
        )
    return settled


def _targets(online: Online) -> dict[str, Array]:
    """Component tops (N, 3) in the camera of each taught view, by its id."""
    board, camera = online.nominal.board, online.calibration.hand.camera
    return {
        id: apply(T, component_points(board, camera, T))
        for id, T in Ts_camera_board(online).items()
    }


def Ts_camera_board(online: Online) -> dict[str, SE3]:
    """The taught board in the camera of each taught view, by its id, as the calibration has it."""
    template, T_base_camera = online.template, online.calibration.T_base_camera
    T_base_board = T_base_camera(template.look.state) * template.taught.T_camera_target
    if not online.method.all_markers:  # what was located is the positioning marker
        T_base_board = T_base_board * online.nominal.T_board_positioning.inverse()
    return {
        view.id: T_base_camera(view.standard.state).actInv(T_base_board) for view in template.views
    }


# -- Once more --------------------------------------------------------------------------------


def improve(visited: Visited, online: Online) -> Correction | None:
    """The correction after one more look at its own views; None where that gains nothing.

    A gain below the arm's repeatability is none. Raises Refused when the pictures contradict
    what was believed.
    """
    correction, images = visited.correction, visited.images
    model, leftover = online.calibration.model, correction.leftover
    if model is None or leftover is None:
        return None
    layout: Layout = online.template.layout
    Ts, shown = Ts_camera_board(online), {}
    standards = {view.id: view.standard for view in online.template.views}
    for k, view in enumerate(correction.views):
        found = online.markers(standards[view.id]), online.markers(images[view.id])
        shown[k] = compare_markers(*found, layout, model, Ts[view.id])
    believed, probability = look_again(
        leftover, model, shown, online.template.sigma_px, online.config.drift
    )
    if probability < online.config.contradiction:
        raise Refused(
            "second look: the markers are not where the first look and the calibration put them "
            f"(probability {probability:.0e}); camera, mount or board have moved, or a marker was "
            "mistaken: look again, then calibrate and teach again",
            "contradicted",
        )
    targets = _targets(online)
    seen = [targets[view.id] for view in correction.views]
    gains = [rms_of(believed.mean_of(k), points) for k, points in enumerate(seen)]
    if max(gains) < _repeatability(leftover, seen):
        return None
    return _settled(correction, believed, online)


def _repeatability(leftover: Leftover, targets: Sequence[Array]) -> float:
    """What one arrival leaves at the targets of a view (m), root mean square over the views."""
    squares = []
    for points, arrival in zip(targets, leftover.arrival, strict=True):
        J = motion_of(points)
        squares.append(float(((J @ arrival) * J).sum()) / len(points))
    return float(np.sqrt(np.mean(squares)))
