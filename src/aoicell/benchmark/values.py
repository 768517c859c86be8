"""A trial's quantities as plain numbers: of markers, views and boards, and means over views."""

from collections.abc import Iterable, Mapping

import numpy as np

from aoicell.benchmark.records import (
    InspectionRecord,
    MarkerRecord,
    PartRecord,
    TrialRecord,
    ViewRecord,
)

Values = Mapping[str, float | None]

OF_MARKERS = ("detected_px", "true_px", "image_mm")
QUANTITIES = (
    "residual_mm", "lateral_mm", "depth_mm", "deg", "predicted_mm", "bound_mm", "covered",
    "unwarned_mm", "x_mm", "y_mm", "z_mm", *OF_MARKERS,
)  # fmt: skip

OF_BOARDS = (
    "defects",
    "found",
    "escapes_missing",
    "good_components",
    "false_calls",
    "no_verdict",
    "unseen",
)
SMALL_MM = (1.0, 0.5)  # a missing part of at least this size must not escape


def board_values(board: InspectionRecord) -> Values:
    """An inspection in numbers. Whatever its tolerance class allows is no defect.

    `escapes_missing`: missing parts of at least `SMALL_MM` that were taken for present.
    """
    defects = [part for part in board.parts if part.planted and not part.tolerated]
    return {
        "defects": len(defects),
        "found": sum(part.called for part in defects),
        "escapes_missing": sum(escaped(part) for part in defects),
        "good_components": board.good_components,
        "false_calls": sum(is_false_call(part) for part in board.parts),
        "no_verdict": board.no_verdict,
        "unseen": board.unseen,
    }


def is_false_call(part: PartRecord) -> bool:
    """Whether a good part was called wrong."""
    return part.called and (not part.planted or part.tolerated)


def escaped(part: PartRecord) -> bool:
    """Whether a missing part that must not escape was said to be there."""
    sides = sorted((part.width_mm, part.depth_mm), reverse=True)
    large = sides[0] >= SMALL_MM[0] and sides[1] >= SMALL_MM[1]
    return part.planted == "missing" and large and part.state == "present"


def marker_values(marker: MarkerRecord) -> Values:
    """The quantities of a marker in a view by name."""
    return {name: getattr(marker, name) for name in OF_MARKERS}


def view_values(view: ViewRecord) -> Values:
    """Every quantity of a view by name; those of markers are the mean over its markers.

    `covered`: whether the residual lies below the stated 95 %; `unwarned_mm`: the residual where
    it lies beyond the stated 99.9 % or nothing is stated, else 0.
    """
    x, y, z = view.vector_mm
    return {
        "residual_mm": view.residual_mm,
        "lateral_mm": view.lateral_mm,
        "depth_mm": view.depth_mm,
        "deg": view.deg,
        "predicted_mm": view.predicted_mm,
        "bound_mm": view.bound_mm,
        "covered": _covered(view),
        "unwarned_mm": view.residual_mm if view.residual_mm > (view.bound_mm or 0.0) else 0.0,
        "x_mm": x,
        "y_mm": y,
        "z_mm": z,
        **{name: mean(getattr(marker, name) for marker in view.markers) for name in OF_MARKERS},
    }


def trial_values(record: TrialRecord) -> Values:
    """A trial's value of each quantity: the mean over its views; null when there is none.

    Of `unwarned_mm` it is the largest: one view that is silently wrong is enough.
    """
    views = [view_values(view) for view in record.views]
    values = {name: mean(view[name] for view in views) for name in QUANTITIES}
    if views:
        values["unwarned_mm"] = max(view["unwarned_mm"] or 0.0 for view in views)
    return values


def _covered(view: ViewRecord) -> float | None:
    return None if view.predicted_mm is None else float(view.residual_mm <= view.predicted_mm)


def mean(values: Iterable[float | None]) -> float | None:
    """The mean of the known values."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
