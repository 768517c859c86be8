"""The look of the components: solids inside their bounds, turned with their component."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.board import KINDS, BoardDesign, Component, load_board
from aoicell.sim.board_geometry import board_parts, component_parts
from aoicell.sim.board_solids import Part

FOLDER = Path(__file__).parents[2] / "models" / "server_board"


@pytest.fixture(scope="module")
def board() -> BoardDesign:
    return load_board(FOLDER)


def part_corners(part: Part) -> np.ndarray:
    """The eight corners of the part's bounding box in the board's frame, (8, 3)."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    x, y, z = (signs * part.half_size).T
    c, s = math.cos(part.yaw), math.sin(part.yaw)
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1) + part.centre


def in_component(component: Component, points: np.ndarray) -> np.ndarray:
    """Board points (N, 3) in the component's own frame, its footprint's centre at 0."""
    x, y, z = (points - [component.x, component.y, component.z]).T
    c, s = math.cos(component.rotation), math.sin(component.rotation)
    return np.stack([c * x + s * y, -s * x + c * y, z], axis=1)


def test_every_component_has_parts_within_its_bounds(board: BoardDesign) -> None:
    assert {c.kind for c in board.components} == set(KINDS)
    for component in board.components:
        parts = component_parts(component)
        assert parts
        for part in parts:
            local = in_component(component, part_corners(part))
            bound = np.array([component.width / 2, component.depth / 2]) + 1e-6
            assert np.all(np.abs(local[:, :2]) <= bound), (component.id, part)
            assert local[:, 2].min() >= -1e-9
            assert local[:, 2].max() <= component.height + 1e-9, (component.id, part)
            assert part.shape in ("box", "cylinder", "ellipsoid")
            assert part.finish in ("matte", "metal", "plastic")
            assert min(part.half_size) > 0
            assert part.shape != "cylinder" or part.half_size[0] == part.half_size[1]


def test_the_whole_board_stays_cheap_to_render(board: BoardDesign) -> None:
    assert sum(map(len, board_parts(board).values())) <= 910


@given(st.floats(-math.pi, math.pi), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_parts_turn_and_move_with_their_component(turn: float, x: float, y: float) -> None:
    at_rest = Component("C1", "capacitor", 0, 0, 0, 0, 0.008, 0.008, 0.0115, "820")
    moved = replace(at_rest, x=x, y=y, z=0.01, rotation=turn)
    for a, b in zip(component_parts(at_rest), component_parts(moved), strict=True):
        assert in_component(moved, part_corners(b)) == pytest.approx(part_corners(a), abs=1e-12)


def test_a_turned_can_shows_its_polarity_elsewhere() -> None:
    can = Component("C1", "capacitor", 0, 0, 0, 0, 0.008, 0.008, 0.0115, "820")
    mark = component_parts(can)[-1]
    turned = component_parts(replace(can, rotation=math.pi))[-1]
    assert mark.centre[0] < -0.001
    assert turned.centre[0] == pytest.approx(-mark.centre[0])


def test_printed_parts_are_on_top(board: BoardDesign) -> None:
    printed = [c for c in board.components if any(p.printed for p in component_parts(c))]
    assert {c.kind for c in printed} == {"label", "chip"}
    assert all(c.kind != "label" or component_parts(c)[0].printed for c in board.components)
