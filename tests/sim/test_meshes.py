"""Meshes show what MuJoCo shows, where MuJoCo has it."""

import mujoco
import numpy as np
import pytest

from aoicell.errors import ModelError
from aoicell.observation import Image
from aoicell.sim.backend import make_renderer
from aoicell.sim.meshes import BodyShape, Posture, Print, Puppet, body_shapes
from aoicell.sim.solids import MATT, Face, add_printed_plate
from aoicell.sim.world import World
from aoicell.transforms import apply

SOLIDS = """
<mujoco>
  <asset>
    <material name="blue" rgba="0 0 1 1"/>
    <mesh name="wedge" vertex="0 0 0  3 0 0  0 2 0  0 0 1" inertia="shell"/>
  </asset>
  <worldbody>
    <body name="part" pos="5 5 5">
      <geom type="{type}" {shape} pos="1 2 3" quat="0.7071068 0 0 0.7071068" group="1"
            {look}/>
    </body>
  </worldbody>
</mujoco>
"""


def shape_of(xml: str, name: str = "part") -> BodyShape:
    shapes = body_shapes(mujoco.MjModel.from_xml_string(xml))
    return next(shape for shape in shapes if shape.name == name)


@pytest.mark.parametrize(
    ("type", "shape", "half"),
    [
        # half extents in the body's frame: the geom is turned by 90 degrees about z
        ("box", 'size="0.1 0.2 0.3"', (0.2, 0.1, 0.3)),
        ("cylinder", 'size="0.1 0.4"', (0.1, 0.1, 0.4)),
        ("capsule", 'size="0.1 0.4"', (0.1, 0.1, 0.5)),
        ("sphere", 'size="0.2"', (0.2, 0.2, 0.2)),
        ("ellipsoid", 'size="0.1 0.2 0.3"', (0.2, 0.1, 0.3)),
        ("plane", 'size="0.4 0.5 1"', (0.5, 0.4, 0.0)),
    ],
)
def test_a_primitive_has_its_size_and_place(
    type: str, shape: str, half: tuple[float, float, float]
) -> None:
    [solid] = shape_of(SOLIDS.format(type=type, shape=shape, look="")).solids
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    np.testing.assert_allclose(low, np.subtract((1, 2, 3), half), atol=2e-3)
    np.testing.assert_allclose(high, np.add((1, 2, 3), half), atol=2e-3)


def test_a_mesh_stands_where_its_vertices_say() -> None:
    xml = SOLIDS.format(type="mesh", shape='mesh="wedge"', look="")
    [solid] = shape_of(xml).solids
    vertices = {tuple(v) for v in np.round(solid.vertices, 6).tolist()}
    assert vertices == {(1, 2, 3), (1, 5, 3), (-1, 2, 3), (1, 2, 4)}


@pytest.mark.parametrize(
    ("look", "rgb"),
    [
        ('rgba="1 0 0 1"', (255, 0, 0)),
        ('material="blue"', (0, 0, 255)),
        ('material="blue" rgba="1 0 0 1"', (255, 0, 0)),  # as MuJoCo has it
        ("", (128, 128, 128)),
    ],
)
def test_colours_are_those_of_mujoco(look: str, rgb: tuple[int, int, int]) -> None:
    [solid] = shape_of(SOLIDS.format(type="sphere", shape='size="0.2"', look=look)).solids
    assert solid.rgb == rgb


def test_solids_of_one_colour_become_one_mesh() -> None:
    xml = """<mujoco><worldbody><body name="part">
      <geom type="box" size="1 1 1" pos="-5 0 0" rgba="1 0 0 1" group="1"/>
      <geom type="sphere" size="1" rgba="0 1 0 1" group="1"/>
      <geom type="box" size="1 1 1" pos="5 0 0" rgba="1 0 0 1" group="1"/>
    </body></worldbody></mujoco>"""
    red = next(s for s in shape_of(xml).solids if s.rgb == (255, 0, 0))
    corners = red.vertices[red.faces]  # (M, 3, 3)
    assert len(corners) == 24
    assert (np.ptp(corners, axis=1) <= 2).all(), "no triangle spans both boxes"


def test_hulls_are_not_shown() -> None:
    xml = """<mujoco><worldbody><body name="part">
      <geom type="box" size="1 1 1" group="0"/>
    </body></worldbody></mujoco>"""
    assert shape_of(xml).solids == ()


def test_a_geom_that_cannot_be_drawn_is_named() -> None:
    xml = """<mujoco><asset><hfield name="hills" nrow="2" ncol="2" size="1 1 1 1"/></asset>
      <worldbody><geom type="hfield" hfield="hills" group="1"/></worldbody></mujoco>"""
    with pytest.raises(ModelError, match=r"'world'.*HFIELD"):
        body_shapes(mujoco.MjModel.from_xml_string(xml))


QUARTERS = np.kron(
    np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]], np.uint8),
    np.ones((8, 8, 1), np.uint8),
)


def on_print(printed: Print, uv: np.ndarray) -> tuple[np.ndarray, Image]:
    """A point of the print that is at (u, v) of its picture, and the picture's colour there."""
    fit = np.column_stack([printed.uv, np.ones(len(printed.uv))])
    affine = np.linalg.lstsq(fit, printed.vertices, rcond=None)[0]
    height, width = printed.image.shape[:2]
    pixel = printed.image[int((1 - uv[1]) * height), int(uv[0] * width)]
    return np.array([*uv, 1.0]) @ affine, pixel


@pytest.mark.parametrize("face", [MATT, Face(bow=1e-4)], ids=["box", "mesh"])
def test_a_print_lies_as_mujoco_draws_it(face: Face) -> None:
    spec = mujoco.MjSpec()
    spec.visual.headlight.ambient[:] = 1.0
    plate = spec.worldbody.add_body(name="plate", quat=[0.9689124, 0, 0, 0.247404])
    add_printed_plate(spec, plate, "quarters", QUARTERS, (0.4, 0.2, 0.01), face=face)
    spec.worldbody.add_camera(name="above", pos=[0, 0, 1], fovy=40)  # looks down, y up
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = make_renderer(model, 200, 200)
    renderer.update_scene(data, "above")
    image = renderer.render()
    renderer.close()
    [printed] = next(s for s in body_shapes(model) if s.name == "plate").prints
    T = Puppet(model).Ts_world_body(Posture.of(data))["plate"]
    focal = 100 / np.tan(np.radians(20))
    for uv in np.array([[0.2, 0.2], [0.8, 0.2], [0.2, 0.8], [0.8, 0.8]]):
        place, colour = on_print(printed, uv)
        x, y, z = apply(T, place)
        seen = image[round(99.5 - focal * y / (1 - z)), round(99.5 + focal * x / (1 - z))]
        assert ((seen > 100) == (colour > 100)).all(), f"at {uv}: {seen}, not {colour}"


def test_the_shipped_cell_shows_its_parts(ideal_world: World) -> None:
    shapes = {shape.name: shape for shape in body_shapes(ideal_world.model)}
    assert {"board", "hand", "tripod", "armtarget", "tabletarget", "table"} <= set(shapes)
    assert len(shapes["board"].prints) >= 5  # the circuit board and four markers
    [printed] = shapes["tabletarget"].prints
    expected = ideal_world.nominal.tabletarget.print_image()
    np.testing.assert_array_equal(printed.image[:, :, 0], expected)


def test_a_puppet_takes_any_posture_and_leaves_the_world_alone(paper_world: World) -> None:
    world, puppet = paper_world, Puppet(paper_world.model)
    home = Posture.of(world.data)
    flange_at_home = world.T_base_body("arm/flange")
    world.arrive(world.nominal.q_home + 0.2)
    away = world.T_base_body("arm/flange")
    for posture, expected in ((home, flange_at_home), (Posture.of(world.data), away)):
        T = world.nominal.T_world_base.actInv(puppet.Ts_world_body(posture)["arm/flange"])
        assert T.isApprox(expected, 1e-12)
    assert world.T_base_body("arm/flange").isApprox(away, 0)


def test_a_posture_at_other_joints_keeps_the_board(paper_world: World) -> None:
    posture = Posture.of(paper_world.data)
    moved = posture.at_joints(posture.qpos + 0.1)
    before, after = (Puppet(paper_world.model).Ts_world_body(p) for p in (posture, moved))
    assert before["board"] == after["board"]
    assert not before["arm/flange"].isApprox(after["arm/flange"], 1e-3)
