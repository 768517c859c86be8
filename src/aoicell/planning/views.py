"""A view plan: few views that show everything, against the area bound."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aoicell.board import BoardDesign
from aoicell.camera import Camera
from aoicell.nominal import View
from aoicell.planning.coverage import Inspector
from aoicell.planning.heights import Flags
from aoicell.planning.targets import Feature, Hidden
from aoicell.planning.view_search import Reachable, SearchConfig, ViewSearch, markers_in


@dataclass(frozen=True)
class ViewPlan:
    """The chosen views and what they leave out.

    `bound`: the area bound, `area_bound`. `markers`: ids in each view's picture. `hidden`: what
    no candidate shows, reached or not; `uncovered`: what some candidate shows, but no view here.
    """

    views: tuple[View, ...]
    bound: int
    markers: tuple[tuple[str, ...], ...]
    hidden: tuple[Hidden, ...]
    uncovered: tuple[Hidden, ...]


def area_bound(board: BoardDesign, camera: Camera, px_per_mm: float) -> int:
    """Board area over the area that a picture covers at the required resolution, rounded up.

    ceil(W D r^2 / (w h)): board W x D (mm), resolution r (px/mm), picture w x h (px). It takes
    the pictures for tiles without overlap, margin or anything that hides something else.
    """
    width_mm, depth_mm = board.size[0] * 1e3, board.size[1] * 1e3
    covered = camera.width * camera.height / px_per_mm**2
    return math.ceil(width_mm * depth_mm / covered - 1e-9)


def plan_views(
    inspector: Inspector,
    board: BoardDesign,
    reachable: Reachable,
    config: SearchConfig | None = None,
) -> ViewPlan:
    """The fewest views found that show all features that any candidate shows.

    Raises InputError when no candidate shows anything, or when the arm reaches none of those that
    show a feature: the board is too large, or lies too far away.
    """
    search = ViewSearch(inspector, board, reachable, config or SearchConfig())
    scene = inspector.scene
    bound = area_bound(board, scene.camera, scene.limits.px_per_mm)
    views = _numbered(search.cover(bound))
    missing = ~np.any([inspector.seen(view) for view in views], axis=0)
    return ViewPlan(
        views=tuple(views),
        bound=bound,
        markers=tuple(markers_in(board, scene.camera, view) for view in views),
        hidden=_named(scene.features, missing & ~search.known, "no view of the search shows it"),
        uncovered=_named(scene.features, missing & search.known, "no view of the plan shows it"),
    )


def _named(features: Sequence[Feature], chosen: Flags, reason: str) -> tuple[Hidden, ...]:
    found = [features[int(k)] for k in np.flatnonzero(chosen)]
    return tuple(Hidden(feature.target, feature.what, reason) for feature in found)


def _numbered(views: Sequence[View]) -> list[View]:
    """In rows from the rear left to the front right; in which order to go is settled elsewhere."""
    rows = sorted(views, key=lambda view: (-round(view.aim[1] / 0.08), view.aim[0]))
    return [replace(view, id=f"P{number}") for number, view in enumerate(rows, start=1)]
