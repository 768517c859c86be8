"""Printed plates: the picture lies the same way on a box and on a mesh."""

from aoicell.sim.backend import make_renderer  # isort: skip  (chooses the rendering back end)

import math

import mujoco
import numpy as np
import pytest

from aoicell.sim.solids import Face, add_printed_plate

WIDTH, HEIGHT = 400, 300
SIZE = (0.100, 0.075, 0.003)


def lettered() -> np.ndarray:
    """A picture that no turn or reflection maps to itself."""
    image = np.full((150, 200), 200, np.uint8)
    image[20:130, 30:60] = 20
    image[100:130, 30:140] = 90
    image[20:40, 150:180] = 0
    return image


def from_above(face: Face) -> np.ndarray:
    """RGB picture that shows exactly the plate, x to the right and y up."""
    spec = mujoco.MjSpec()
    add_printed_plate(spec, spec.worldbody.add_body(), "plate", lettered(), SIZE, face=face)
    spec.visual.headlight.ambient = (0.6, 0.6, 0.6)
    spec.visual.headlight.diffuse = (0, 0, 0)
    spec.worldbody.add_light(
        pos=[0, 0, 1], dir=[0, 0, -1], diffuse=[0] * 3, specular=[0.2] * 3, ambient=[0] * 3,
        cutoff=60, exponent=0, type=mujoco.mjtLightType.mjLIGHT_SPOT, castshadow=False,
    )  # fmt: skip
    fovy = 2 * math.degrees(math.atan(SIZE[1] / 2))
    spec.worldbody.add_camera(name="eye", pos=(0, 0, 1), fovy=fovy)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = make_renderer(model, WIDTH, HEIGHT)
    renderer.update_scene(data, "eye")
    image = renderer.render().astype(float)
    renderer.close()
    return image


@pytest.mark.parametrize("face", [Face(bow=1e-6), Face(twist=1e-6), Face(bow=-3e-4, twist=2e-4)])
def test_a_bent_face_shows_the_picture_as_a_flat_one(face: Face) -> None:
    flat, bent = from_above(Face()), from_above(face)
    assert np.abs(flat - bent).mean() < 1
    for other in (flat[::-1], flat[:, ::-1], flat[::-1, ::-1]):
        assert np.abs(other - bent).mean() > 10


def test_a_plain_face_is_the_side_of_a_box() -> None:
    spec = mujoco.MjSpec()
    add_printed_plate(spec, spec.worldbody.add_body(), "plate", lettered(), SIZE)
    assert len(spec.geoms) == 1
    assert len(spec.meshes) == 0
    assert spec.geoms[0].material == "plate"
    np.testing.assert_allclose(spec.geoms[0].pos, [0, 0, -0.0015])
    assert (spec.materials[0].specular, spec.materials[0].shininess) == pytest.approx((0, 0.3))


def test_a_bent_plate_stays_behind_its_face_and_collides() -> None:
    spec = mujoco.MjSpec()
    face = Face(bow=-4e-4)
    add_printed_plate(spec, spec.worldbody.add_body(), "plate", lettered(), SIZE, face=face)
    drawn, plate = spec.geoms
    assert (drawn.contype, plate.contype) == (0, 1)
    top = plate.pos[2] + plate.size[2]
    assert -5e-4 < top < -4e-4


def test_glare_lights_up_white_and_veils_black() -> None:
    matt, some, full = (from_above(Face(glare=g)) for g in (0.0, 0.1, 1.0))
    black, white = (slice(50, 70), slice(310, 350)), (slice(130, 170), slice(180, 220))
    assert matt[black].max() == 0
    assert 3 < some[black].mean() < 15
    assert 40 < full[black].mean() < 120
    assert matt[white].mean() + 5 < some[white].mean() < full[white].mean()
    assert full[white].mean() > 1.7 * matt[white].mean()


def test_glare_leaves_the_picture_where_it_is() -> None:
    flat, glossy = from_above(Face()), from_above(Face(glare=0.3))
    ways = [flat, flat[::-1], flat[:, ::-1]]
    likeness = [np.corrcoef(way.ravel(), glossy.ravel())[0, 1] for way in ways]
    assert likeness[0] > 0.97
    assert max(likeness[1:]) < 0.8
