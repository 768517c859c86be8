"""What touches what, against solids whose place is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aoicell.errors import ModelError
from aoicell.nominal import Nominal
from aoicell.robot.collision import CollisionModel, Solid
from aoicell.transforms import SE3, rotation, translation

Q = np.zeros(6)  # the arm points along +y, the flange at (0, 0.945, 1.445), z out of it along +y


def box(y: float, side: float = 0.02) -> Solid:
    return Solid("box", (side, side, side), translation(0, y, 1.445))


def test_the_arm_alone_touches_nothing_where_it_is_taught(nominal: Nominal) -> None:
    assert CollisionModel(nominal.arm).touching(nominal.q_home) is None


@pytest.mark.parametrize(("gap", "touches"), [(0.009, True), (0.011, False)])
def test_clearance_is_the_gap_between_surfaces(nominal: Nominal, gap: float, touches: bool) -> None:
    tool = Solid("tool", (0.04, 0.04, 0.1), translation(z=0.05), "flange")
    wall = box(0.945 + 0.1 + gap + 0.01)
    pair = CollisionModel(nominal.arm, [tool, wall], clearance=0.010).touching(Q)
    assert (pair == ("tool", "box")) == touches


def test_slack_adds_to_the_clearance(nominal: Nominal) -> None:
    tool = Solid("tool", (0.04, 0.04, 0.1), translation(z=0.05), "flange")
    wall = box(0.945 + 0.1 + 0.03 + 0.01)
    for slack, touches in ((0.015, False), (0.025, True)):
        loose = replace(wall, slack=slack)
        assert (CollisionModel(nominal.arm, [tool, loose], 0.01).touching(Q) is not None) == touches


def test_what_is_carried_turns_with_the_last_joint(nominal: Nominal) -> None:
    arm_out = Solid("tool", (0.3, 0.01, 0.01), translation(0.15, 0, 0.15), "flange")
    beside = Solid("post", (0.02, 0.02, 0.02), translation(0.28, 0.945 + 0.15, 1.445))
    cell = CollisionModel(nominal.arm, [arm_out, beside], clearance=0.0)
    assert cell.touching(Q) == ("tool", "post")
    turned = Q.copy()
    turned[5] = np.pi / 2
    assert cell.touching(turned) is None
    assert cell.first_touch([turned, turned, Q]) == (2, ("tool", "post"))
    assert cell.first_touch([turned]) is None


def test_a_mesh_is_stretched_and_solid(nominal: Nominal) -> None:
    hull = nominal.models["hand"] / "meshes" / "camera_hull_1.stl"
    T = SE3(rotation("y", 0.0).rotation, np.array([0, 2.0, 1.445]))
    near = Solid("small", hull, T)
    far = Solid("large", hull, T, scale=(1.0, 30.0, 1.0))  # reaches back to the flange
    assert CollisionModel(nominal.arm, [near], 0.0).touching(Q) is None
    assert CollisionModel(nominal.arm, [far], 0.0).touching(Q) is not None


def test_a_missing_mesh_is_named(nominal: Nominal) -> None:
    lost = Solid("lamp", Path("no_such.stl"), SE3.Identity())
    with pytest.raises(ModelError, match="no such mesh; the solid 'lamp' needs it"):
        CollisionModel(nominal.arm, [lost])


def test_an_arm_of_plain_shapes(second_cell: Nominal) -> None:
    q = second_cell.q_home
    assert CollisionModel(second_cell.arm).touching(q) is None
    place = second_cell.arm.fk(q) * translation(z=0.02)
    stone = Solid("stone", (0.1, 0.1, 0.1), place)
    pair = CollisionModel(second_cell.arm, [stone]).touching(q)
    assert pair is not None
    assert pair[1] == "stone"


# -- Lines of sight, and how far anything moves ----------------------------------------------------


@pytest.mark.parametrize(("aside", "across"), [(0.0, True), (0.009, True), (0.011, False)])
def test_a_body_stands_between_two_points(nominal: Nominal, aside: float, across: bool) -> None:
    sign = Solid("sign", (0.02, 0.02, 0.002), translation(aside, 2.0, 1.445))
    cell = CollisionModel(nominal.arm, [sign])
    seen = cell.between(Q, [0, 2.0, 1.0], [0, 2.0, 1.6])
    assert seen == ("sign" if across else None)
    assert cell.between(Q, [0, 2.0, 1.5], [0, 2.0, 1.6]) is None, "it is not on this stretch"
    assert cell.between(Q, [0, 2.0, 1.0], [0, 2.0, 1.6], ignored=["sign"]) is None


def test_the_arm_stands_between_where_it_is(nominal: Nominal) -> None:
    cell = CollisionModel(nominal.arm)
    line = [-0.5, 0.7, 1.445], [0.5, 0.7, 1.445]  # through the forearm at Q
    hit = cell.between(Q, *line)
    assert hit is not None
    assert hit.startswith("link_4")
    up = Q.copy()
    up[1] = np.radians(-60)
    assert cell.between(up, *line) is None
