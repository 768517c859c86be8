"""A trial's quantities as plain numbers: those of a view, and their means over the views."""

from collections.abc import Iterable, Mapping

import numpy as np

from aoicell.benchmark.records import TrialRecord, ViewRecord

Values = Mapping[str, float | None]


def view_values(view: ViewRecord) -> Values:
    """Every quantity of a view by name; those of markers are the mean over its markers."""
    x, y, z = view.vector_mm
    return {
        "residual_mm": view.residual_mm,
        "lateral_mm": view.lateral_mm,
        "depth_mm": view.depth_mm,
        "deg": view.deg,
        "predicted_mm": view.predicted_mm,
        "x_mm": x,
        "y_mm": y,
        "z_mm": z,
        "detected_px": mean(marker.detected_px for marker in view.markers),
        "true_px": mean(marker.true_px for marker in view.markers),
        "image_mm": mean(marker.image_mm for marker in view.markers),
    }


QUANTITIES = (
    "residual_mm", "lateral_mm", "depth_mm", "deg", "predicted_mm", "x_mm", "y_mm", "z_mm",
    "detected_px", "true_px", "image_mm",
)  # fmt: skip


def trial_values(record: TrialRecord) -> Values:
    """A trial's value of each quantity: the mean over its views; null when there is none."""
    views = [view_values(view) for view in record.views]
    return {name: mean(view[name] for view in views) for name in QUANTITIES}


def mean(values: Iterable[float | None]) -> float | None:
    """The mean of the known values."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
