"""The lamps of a room as they really shine."""

from pathlib import Path

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


def relight(model: mujoco.MjModel, room: Path, light: Light) -> None:
    """Let the lamps of a compiled room shine as if it had been compiled with that light.

    Always from the lamps of the file `room`: no trace is left of any light before.
    """
    spec = mujoco.MjSpec.from_file(str(room))
    set_lamps(spec, light)
    for lamp in spec.lights:
        there = model.light(lamp.name)
        for part in ("ambient", "diffuse", "specular"):
            getattr(there, part)[:] = getattr(lamp, part)
        there.dir[:] = lamp.dir / np.linalg.norm(lamp.dir)
    headlight, there = spec.visual.headlight, model.vis.headlight
    for part in ("ambient", "diffuse", "specular"):
        getattr(there, part)[:] = getattr(headlight, part)
