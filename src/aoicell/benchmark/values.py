"""A trial's quantities as plain numbers: of a marker, of a view, and means over the views."""

from collections.abc import Iterable, Mapping

import numpy as np

from aoicell.benchmark.records import MarkerRecord, TrialRecord, ViewRecord

Values = Mapping[str, float | None]

OF_MARKERS = ("detected_px", "true_px", "image_mm")
QUANTITIES = (
    "residual_mm", "lateral_mm", "depth_mm", "deg", "predicted_mm", "bound_mm", "covered",
    "unwarned_mm", "x_mm", "y_mm", "z_mm", *OF_MARKERS,
)  # fmt: skip


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
