"""The picture of the board alone, oblique, for its README."""

from __future__ import annotations

import math
from pathlib import Path

# First of all: it chooses the rendering back end, which mujoco reads when it is imported.
from aoicell.sim.backend import make_renderer  # isort: skip

import cv2
import mujoco
import numpy as np

from aoicell.board import BoardDesign
from aoicell.observation import Image
from aoicell.sim.board_scene import add_board
from aoicell.transforms import from_xyz_rpy

LIGHTS = (((-0.5, 0.45, 0.9), 0.42, True), ((0.6, -0.3, 0.9), 0.22, False))


def render_oblique(board: BoardDesign, path: Path) -> None:
    """Write the picture of the README: 1400 x 1100, 35 degrees off the vertical."""
    tilt, far = math.radians(35), 0.66
    eye = (0.0, -far * math.sin(tilt) - 0.018, far * math.cos(tilt))
    image = render(board, eye, tilt, 1400, 1100, fovy_deg=34)
    cv2.imwrite(str(path), image[:, :, ::-1])


def render(
    board: BoardDesign, eye: tuple[float, float, float], tilt: float, width: int, height: int,
    fovy_deg: float,
) -> Image:  # fmt: skip
    """An RGB picture with shadows; the eye in frame `board`, leaning by `tilt` (rad)."""
    spec = bench(width, height)
    body = spec.worldbody.add_body(name="board")
    markers = {m.id: from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation]) for m in board.markers}
    add_board(spec, body, board, markers)
    quat = [math.cos(tilt / 2), math.sin(tilt / 2), 0, 0]
    spec.worldbody.add_camera(name="eye", pos=eye, quat=quat, fovy=fovy_deg)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    hidden_hulls = mujoco.MjvOption()
    hidden_hulls.geomgroup[0] = 0
    renderer = make_renderer(model, width, height, shadows=True)
    try:
        renderer.update_scene(data, "eye", hidden_hulls)
        return np.asarray(renderer.render(), dtype=np.uint8)
    finally:
        renderer.close()


def bench(width: int, height: int) -> mujoco.MjSpec:
    """A grey bench under two lights; width and height of the pictures to come (px)."""
    spec = mujoco.MjSpec()
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = width, height
    visual.quality.offsamples, visual.quality.shadowsize = 4, 4096
    visual.map.znear, visual.map.zfar = 0.05, 10.0
    spec.stat.extent, spec.stat.center = 1.0, (0, 0, 0)
    visual.headlight.ambient = (0.36, 0.36, 0.36)
    visual.headlight.diffuse = (0.08, 0.08, 0.08)
    visual.headlight.specular = (0, 0, 0)
    for pos, level, casts in LIGHTS:
        spec.worldbody.add_light(
            pos=pos, dir=[-p for p in pos], diffuse=[level] * 3, specular=[0.35] * 3,
            ambient=[0, 0, 0], castshadow=casts, cutoff=70,
            type=mujoco.mjtLightType.mjLIGHT_SPOT,
        )  # fmt: skip
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[2, 2, 0.01], pos=[0, 0, -0.016],
        rgba=[0.80, 0.81, 0.83, 1], group=1, contype=0, conaffinity=0,
    )  # fmt: skip
    return spec
