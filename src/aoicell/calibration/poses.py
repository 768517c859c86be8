"""Where the arm goes to calibrate: fixed sets of poses relative to the targets.

Distances in metres, angles in radians, all by design; nothing here is measured.
"""

import numpy as np

from aoicell.nominal import View
from aoicell.transforms import SE3, from_xyz_rpy


def _motion(x_cm: float, y_cm: float, z_cm: float, rx: float, ry: float, rz: float) -> SE3:
    return from_xyz_rpy(np.array([x_cm, y_cm, z_cm]) / 100, np.radians([rx, ry, rz]))


# The paper's Table 2. The offsets are motions in flange axes, T_start * dT: in base axes
# the camera would look away from the board.
TABLE_2 = {
    "A": _motion(0, 0, 0, 0, 0, 0),
    "B": _motion(0, 30, 10, 30, 0, 0),
    "C": _motion(0, -30, -10, -30, 0, 0),
    "D": _motion(-30, 0, 0, 0, 30, 0),
    "E": _motion(30, 0, 0, 0, -30, 0),
    "F": _motion(0, 0, 0, 0, 0, 30),
}


def _view(
    id: str, aim: tuple[float, float], mm: float, tilt: tuple[float, float], roll: float
) -> View:
    return View(
        id=id,
        aim=(aim[0] / 1e3, aim[1] / 1e3, 0.0),
        distance=mm / 1e3,
        tilt=(float(np.radians(tilt[0])), float(np.radians(tilt[1]))),
        roll=float(np.radians(roll)),
    )


# Views of chessboard 2 for the intrinsics: tilted both ways, so that focal length and distance
# separate, and shifted towards the corners of the picture, where the lens distorts.
INTRINSIC_VIEWS = (
    _view("I1", (0, 0), 480, (3, 2), 8),
    _view("I2", (38, 22), 450, (22, 0), -10),
    _view("I3", (-38, 22), 450, (0, 22), 12),
    _view("I4", (38, -22), 450, (0, -22), -6),
    _view("I5", (-38, -22), 450, (-22, 0), 6),
    _view("I6", (20, 0), 420, (18, 18), 30),
    _view("I7", (-20, 0), 420, (-18, 18), -30),
    _view("I8", (0, 15), 520, (18, -18), 20),
    _view("I9", (0, -15), 520, (-18, -18), -20),
    _view("I10", (55, 30), 560, (12, 20), 15),
    _view("I11", (-55, -30), 560, (-12, -20), -15),
    _view("I12", (0, 0), 600, (25, 8), 45),
)

# How chessboard 1 is shown to the tripod: motions from the set-up pose in flange axes. The
# first is the paper's single picture; the others turn and carry the board about, for the
# tripod's intrinsics and for the bracket.
SETUP_MOTIONS = (
    _motion(0, 0, 0, 0, 0, 0),
    _motion(0, 0, -5, 10, 0, 0),
    _motion(0, 0, -5, -28, 0, 0),
    _motion(10, -3, -8, 0, 25, 0),
    _motion(-10, -3, -8, 0, -25, 0),
    _motion(8, -4, -4, 5, 0, 22),
    _motion(-8, -4, -4, -15, 0, -22),
    _motion(6, -7, -12, -15, 20, 0),
    _motion(-6, -7, -12, -25, -20, 12),
    _motion(0, -5, -10, -20, 15, -12),
)
