"""The lamps of a room: level, colour and direction."""

import mujoco
import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.sim.as_built import Light
from aoicell.sim.lamps import set_lamps


def room(light: Light, count: int = 2) -> mujoco.MjSpec:
    """Lamps that shine down, the first at x = 0, the second at x = 1."""
    spec = mujoco.MjSpec()
    for x in range(count):
        spec.worldbody.add_light(
            pos=[x, 0, 3], dir=[0, 0, -1], ambient=[0.1] * 3, diffuse=[0.4] * 3, specular=[0.2] * 3
        )
    set_lamps(spec, light)
    return spec


def test_the_level_scales_every_lamp_and_the_headlight() -> None:
    plain, bright = room(Light()), room(Light(level=1.2))
    for before, after in zip(
        [*plain.lights, plain.visual.headlight], [*bright.lights, bright.visual.headlight],
        strict=True,
    ):  # fmt: skip
        for part in ("ambient", "diffuse", "specular"):
            np.testing.assert_allclose(getattr(after, part), 1.2 * getattr(before, part), rtol=1e-6)
    assert plain.lights[0].diffuse[0] == pytest.approx(0.4)
    assert plain.visual.headlight.diffuse[0] > 0


def test_the_colour_scales_red_green_and_blue() -> None:
    spec = room(Light(colour=(1.1, 1.0, 0.9)))
    for lamp in spec.lights:
        np.testing.assert_allclose(lamp.diffuse, [0.44, 0.40, 0.36], rtol=1e-6)
    headlight = spec.visual.headlight.diffuse
    assert headlight[0] / headlight[2] == pytest.approx(1.1 / 0.9)


def test_each_lamp_turns_by_its_own_vector_about_its_own_place() -> None:
    angle = 0.1
    spec = room(Light(turns=((angle, 0, 0), (0, angle, 0))))
    first, second = spec.lights
    # a right-handed turn of -z: about x it goes to +y, about y to -x
    np.testing.assert_allclose(first.dir, [0, np.sin(angle), -np.cos(angle)], atol=1e-12)
    np.testing.assert_allclose(second.dir, [-np.sin(angle), 0, -np.cos(angle)], atol=1e-12)
    np.testing.assert_array_equal(second.pos, [1, 0, 3])


def test_lamps_and_turns_may_differ_in_number() -> None:
    down = [0, 0, -1]
    three = room(Light(turns=((0.1, 0, 0), (0.1, 0, 0))), count=3)
    np.testing.assert_array_equal(three.lights[2].dir, down)
    assert three.lights[1].dir[1] > 0.09
    one = room(Light(turns=((0, 0, 0), (0.1, 0, 0))), count=1)
    np.testing.assert_array_equal(one.lights[0].dir, down)


def test_the_first_turn_belongs_to_the_first_lamp_of_the_room(nominal: Nominal) -> None:
    spec = mujoco.MjSpec.from_file(str(nominal.folder / "cell.xml"))
    before = [np.array(lamp.dir) for lamp in spec.lights]
    set_lamps(spec, Light(turns=((0.1, 0, 0), (0, 0, 0))))
    assert [lamp.name for lamp in spec.lights] == ["key", "fill"]
    assert np.abs(spec.lights[0].dir - before[0]).max() > 0.01
    np.testing.assert_array_equal(spec.lights[1].dir, before[1])
