"""What a camera that has moved on its mount would leave at the targets."""

from collections.abc import Sequence

import numpy as np

from aoicell.leftover import rms_of
from aoicell.online import Online, Ts_camera_board
from aoicell.registration import component_points
from aoicell.transforms import Array, apply, rotation


def left_at_targets(online: Online, motion: Array, turns: Sequence[float] = (0.0,)) -> Array:
    """How far off (m, rms over the components of a view) the board would be seen, (turns, views).

    `motion` (7,): twist of the camera in its own axes (m, rad) and relative change of its focal
    length since the board was taught, which nothing has taken out. The board lies where it was
    taught, turned about its normal by `turns` (rad).
    """
    template, model = online.template, online.calibration.model
    assert model is not None  # without one nobody knows of a motion
    points = np.concatenate([template.layout[id] for id in template.taught.uvs_px])
    J, K = model.pixel_derivatives(apply(template.taught.T_camera_target, points))
    # the board seems to have moved by so much, in the axes of the camera that looked
    seen = motion[:6] - np.linalg.pinv(J) @ model.by_focal(K) * motion[6]
    C_look, Ts = model.T_base_camera(template.look.state.q), Ts_camera_board(online)
    T_base_board = C_look * template.taught.T_camera_target
    left = np.empty((len(turns), len(template.views)))
    for k, view in enumerate(template.views):
        T = Ts[view.id]
        points = apply(T, component_points(online.nominal.board, model.camera, T))
        for t, turn in enumerate(turns):
            # where the camera has to be to see the turned board as it saw the taught one
            C = T_base_board * rotation("z", turn) * T.inverse()
            twist = C.actInv(C_look).toActionMatrix() @ seen - motion[:6]
            left[t, k] = rms_of(twist, points)
    return left
