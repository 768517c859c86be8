"""Draw cell.png: the cell as designed, the arm looking at the server board.

python cell/picture.py
"""

from __future__ import annotations

from pathlib import Path

# First of all: it chooses the rendering back end, which mujoco reads when it is imported.
from aoicell.sim.backend import make_renderer

from aoicell.sim.world import World  # isort: skip

import cv2
import mujoco
import numpy as np

from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Image
from aoicell.sim.drawing import draw
from aoicell.sim.profiles import PROFILES
from aoicell.sim.scene import HULLS
from aoicell.transforms import Array

HERE = Path(__file__).parent
WIDTH, HEIGHT = 1600, 1000
FINER = 2  # rendered so many times larger each way, then averaged
LIGHTS = 48  # pictures with the lights in different places: their mean has soft shadows
AIM = np.array([0.0, 0.6, 0.8])  # what the lights look at, in world
LAMP, LAMP_RADIUS = np.array([1.6, 2.2, 4.2]), 0.45  # the key light, a round window
SHADOWED_DEG = 32  # half the cone within which a light casts shadows
SKY_RADIUS = 4.5  # the fill light stands anywhere on a dome: that shades corners and contacts


def main() -> None:
    """Write the picture."""
    nominal = load_nominal(HERE)
    world = World(nominal, draw(nominal, PROFILES["ideal"], seed=0))
    world.arrive(over_the_board(nominal))
    cv2.imwrite(str(HERE / "cell.png"), softly_lit(world)[:, :, ::-1])


def over_the_board(nominal: Nominal) -> Array:
    """Joint angles (rad) at which the hand camera looks at the board's middle from P_check."""
    T_base_camera = nominal.T_base_board * nominal.check.T_target_camera
    T_base_flange = T_base_camera * nominal.T_flange_camera.inverse()
    return nominal.arm.ik(T_base_flange, nominal.q_home, "the picture's pose")


def softly_lit(world: World) -> Image:
    """The mean of pictures from the camera `overview`, each with the lights elsewhere."""
    model, data = world.model, world.data
    width, height = FINER * WIDTH, FINER * HEIGHT
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    model.vis.quality.shadowsize = 4096
    model.vis.headlight.ambient[:] = 0.30
    model.vis.headlight.diffuse[:] = 0.04
    key, fill = model.light("key").id, model.light("fill").id
    model.light_castshadow[:] = 1
    model.light_cutoff[:], model.light_exponent[:] = 80, 0
    model.vis.map.shadowscale = SHADOWED_DEG / 80
    model.light_diffuse[key], model.light_diffuse[fill] = 0.52, 0.40
    model.light_specular[key], model.light_specular[fill] = 0.3, 0.05
    visible = mujoco.MjvOption()
    visible.geomgroup[HULLS] = 0
    renderer = make_renderer(model, width, height, shadows=True)
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = True  # the floor fades into the sky
    total = np.zeros((HEIGHT, WIDTH, 3))
    for lamp, sky in zip(*light_places(LIGHTS), strict=True):
        for light, place in ((key, lamp), (fill, sky)):
            model.light_pos[light] = place
            model.light_dir[light] = (AIM - place) / np.linalg.norm(AIM - place)
        mujoco.mj_camlight(model, data)
        renderer.update_scene(data, "overview", visible)
        total += cv2.resize(renderer.render(), (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    renderer.close()
    return np.rint(total / LIGHTS).astype(np.uint8)


def light_places(count: int) -> tuple[Array, Array]:
    """Evenly spread places (count, 3) of the lamp, over its disc, and of the sky, over its dome."""
    n = np.arange(count)
    turn = n * np.pi * (3 - np.sqrt(5))  # the golden angle
    share = (n + 0.5) / count
    spiral = np.column_stack([np.cos(turn), np.sin(turn)])
    lamp = LAMP + np.column_stack([LAMP_RADIUS * np.sqrt(share)[:, None] * spiral, np.zeros(count)])
    radius = np.sqrt(share)[:, None]  # as seen from above: the weight of a matt ground
    sky = AIM + SKY_RADIUS * np.column_stack([radius * spiral, np.sqrt(1 - share)])
    return lamp, sky


if __name__ == "__main__":
    main()
