"""The lamps of a room as they really shine."""

import mujoco
import numpy as np

from aoicell.sim.as_built import Light
from aoicell.transforms import from_rvec


def set_lamps(spec: mujoco.MjSpec, light: Light) -> None:
    """Give the lamps of a room and its headlight their level and colour, and the lamps their turn.

    Turns are taken in the order of the lamps in the MJCF; a lamp turns about its own position.
    """
    factor = light.level * np.array(light.colour)
    for lamp in [*spec.lights, spec.visual.headlight]:
        lamp.ambient = lamp.ambient * factor
        lamp.diffuse = lamp.diffuse * factor
        lamp.specular = lamp.specular * factor
    for lamp, turn in zip(spec.lights, light.turns, strict=False):
        if any(turn):
            lamp.dir = from_rvec(turn, np.zeros(3)).rotation @ lamp.dir
