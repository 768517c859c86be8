"""A trial's numbers from its views and markers."""

import pytest

from aoicell.benchmark.values import QUANTITIES, marker_values, mean, trial_values, view_values

from .records_by_hand import marker, refused, trial, view


def test_a_trials_value_is_the_mean_of_its_views() -> None:
    values = trial_values(trial(views=[view("V1", 1.0), view("V2", 3.0)]))
    assert values["residual_mm"] == 2
    assert values["depth_mm"] == pytest.approx(1.6)
    assert [values[name] for name in ("x_mm", "y_mm", "z_mm")] == pytest.approx([0.72, -0.96, 1.6])


def test_without_views_there_is_no_value() -> None:
    assert trial_values(refused()) == dict.fromkeys(QUANTITIES)
    assert mean([None, None]) is None


def test_a_views_pixels_are_the_mean_of_its_markers_that_were_found() -> None:
    assert view_values(view(px=(1.0, None, 3.0)))["detected_px"] == 2
    assert view_values(view(px=(None,)))["detected_px"] is None
    assert view_values(view(px=()))["true_px"] is None


def test_a_markers_values_are_what_a_view_takes_the_mean_of() -> None:
    assert marker_values(marker(2.0)) == {"detected_px": 2.0, "true_px": 1.9, "image_mm": 0.38}
    assert marker_values(marker(None)) == {"detected_px": None, "true_px": 1.9, "image_mm": None}


def test_views_count_alike_however_many_markers_they_show() -> None:
    record = trial(views=[view(px=(1.0, 3.0)), view(px=(5.0,))])
    assert trial_values(record)["detected_px"] == 3.5


def test_every_quantity_is_a_views() -> None:
    assert set(view_values(view())) == set(QUANTITIES)
