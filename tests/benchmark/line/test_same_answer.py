"""What an inspection says of a picture does not hang on the pictures before it."""

import cv2
import numpy as np

from aoicell.inspection.inspect import register_2d
from aoicell.inspection.references import Reference
from aoicell.inspection.standard import InspectionConfig, standard_of
from aoicell.nominal import Nominal
from aoicell.sim.twin import NominalTwin


def test_a_picture_is_registered_the_same_however_often(nominal: Nominal) -> None:
    """A line that goes on would otherwise differ from one that was never stopped."""
    view, twin = nominal.inspection_views[1], NominalTwin(nominal)
    T_base_camera = nominal.T_base_board * view.T_target_camera
    picture = cv2.cvtColor(twin.render(T_base_camera, nominal.T_base_board), cv2.COLOR_RGB2GRAY)
    twin.close()
    T_camera_board = view.T_target_camera.inverse()
    grey = np.asarray(picture, np.uint8)
    reference = Reference(view.id, (grey,), T_camera_board, nominal.cameras["hand"])
    moved = np.roll(grey, 5, axis=1)
    first, again = (register_2d(moved, reference, nominal.board) for _ in range(2))
    assert first.moved_px > 3
    assert first.T_camera_board == again.T_camera_board
    assert (first.rms_px, first.error_px) == (again.rms_px, again.error_px)
    pattern = standard_of(reference, nominal.board, InspectionConfig()).pattern
    assert np.abs(pattern.thumb[0]).max() > 0  # no window has been left in it
