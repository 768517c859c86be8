"""Overlays of a calibration: what is drawn is what was detected and predicted."""

from pathlib import Path

import numpy as np
import pytest
from helpers.recordings import ODD, blank, record
from PIL import Image as Pillow

from aoicell.datasets.recording import read_recording
from aoicell.datasets.solve import Solved, solve_recording
from aoicell.errors import InputError
from aoicell.report.calibration import overlay_figure, overlays, write_overlays

PAIR = [0, 1, 2, 7, 4, 5, 6, 3, 8, 9]  # the arm poses of views 3 and 7 are exchanged


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    folder = tmp_path_factory.mktemp("recordings") / "arm"
    return solve_recording(read_recording(record(folder, order=PAIR, change=blank([5]))))


def test_good_views_have_small_residuals_and_exchanged_ones_large(solved: Solved) -> None:
    by_view = {overlay.view: overlay for overlay in overlays(solved)}
    assert len(by_view) == 10
    for view, overlay in by_view.items():
        if view == "05":
            assert len(overlay.detected_px) == 0
            assert "blank" in overlay.title
            continue
        assert len(overlay.detected_px) == len(ODD.points)
        worst = np.linalg.norm(overlay.residuals_px, axis=1).max()
        if view in ("03", "07"):
            assert worst > 20
            assert "not used" in overlay.title
        else:
            assert worst < 1
            assert "px rms" in overlay.title


def test_figures_are_pictures_one_a_view(solved: Solved, tmp_path: Path) -> None:
    written = write_overlays(solved, tmp_path / "figures")
    names = {path.name for path in written}
    assert names >= {f"{k:02d}_camera.png" for k in range(10)}
    assert "residuals_camera.svg" in names
    drawn = np.asarray(Pillow.open(tmp_path / "figures" / "00_camera.png").convert("RGB"))
    coloured = (np.ptp(drawn.astype(int), axis=2) > 80).sum()
    assert coloured > 500  # rings and crosses over a grey picture


def test_the_predicted_points_are_the_detected_less_the_residuals(solved: Solved) -> None:
    overlay = overlays(solved)[3]
    (ax,) = overlay_figure(overlay).axes
    lines = {line.get_label(): np.column_stack(line.get_data()) for line in ax.lines}
    np.testing.assert_allclose(lines["detected"], overlay.detected_px)
    predicted = lines["predicted from the arm's pose"]
    np.testing.assert_allclose(predicted + overlay.residuals_px, overlay.detected_px)


def test_a_folder_that_cannot_be_made_is_named(solved: Solved, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--report"):
        write_overlays(solved, tmp_path / "file" / "figures")
