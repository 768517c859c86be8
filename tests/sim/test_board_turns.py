"""Turns of a component's solids: upright, and into what looks the same."""

import math
from dataclasses import replace

import numpy as np
import pytest

from aoicell.board import Component
from aoicell.errors import InputError
from aoicell.sim.board_turns import looks_alike, upright, upright_parts


def component(kind: str, w: float, d: float, h: float, label: str = "") -> Component:
    return Component("X", kind, 0.01, -0.02, 0.0, 0.0, w * 1e-3, d * 1e-3, h * 1e-3, label)


RESISTOR = component("resistor", 1.6, 0.8, 0.5)


@pytest.mark.parametrize("turn", [0.0, 1.0])
@pytest.mark.parametrize("end", [-1, 1])
def test_a_part_stands_upright_on_the_pad_of_its_end(end: int, turn: float) -> None:
    lying = replace(RESISTOR, rotation=turn)
    room, parts = upright(lying, end), upright_parts(lying, end)
    pad = np.array([0.01, -0.02]) + end * 0.8e-3 * np.array([math.cos(turn), math.sin(turn)])
    np.testing.assert_allclose([room.x, room.y], pad, atol=1e-12)
    caps, body = parts  # the tin caps run through the body
    low, top = caps.centre[2] - caps.half_size[2], caps.centre[2] + caps.half_size[2]
    assert (low, top) == pytest.approx((0.0, 1.6e-3))
    np.testing.assert_allclose(body.centre[:2], pad, atol=1e-12)
    np.testing.assert_allclose(body.half_size, [0.25e-3, 0.4e-3, 0.28 * 1.6e-3])
    assert body.yaw == turn
    assert room.height == pytest.approx(1.6e-3)


def test_the_upper_end_is_the_other_one() -> None:
    led = component("led", 1.6, 0.8, 0.7, "green")
    bar = [upright_parts(led, end)[1].centre[2] for end in (1, -1)]  # the cathode is at -x
    assert bar[0] == pytest.approx((0.5 + 0.41) * 1.6e-3)
    assert bar[1] == pytest.approx((0.5 - 0.41) * 1.6e-3)


def test_the_underside_faces_the_part_that_it_left() -> None:
    led = component("led", 1.6, 0.8, 0.7, "green")
    base = upright_parts(led, 1)[0]  # the white lower half
    assert base.centre[0] == pytest.approx(led.x + (1.6 / 2 - 0.7 / 4) * 1e-3)


def test_only_what_consists_of_blocks_stands_upright() -> None:
    with pytest.raises(InputError, match="component X: a capacitor of this size"):
        upright_parts(component("capacitor", 8, 8, 11.5), 1)


@pytest.mark.parametrize(
    ("kind", "size", "label", "ways"),
    [
        ("resistor", (1.6, 0.8, 0.5), "", 2),
        ("capacitor", (2, 1.25, 1.2), "", 2),
        ("capacitor", (8, 8, 11.5), "", 1),
        ("led", (1.6, 0.8, 0.7), "red", 1),
        ("chip", (5, 6, 1), "", 1),
        ("chip", (14, 14, 1.6), "PRINTED", 1),
        ("inductor", (10, 10, 5), "", 2),
        ("heatsink", (40, 40, 12), "", 2),
        ("connector", (20, 6, 8), "HDR", 2),
        ("connector", (10, 5.8, 8), "FAN", 1),
        ("battery", (22, 21, 5.5), "", 1),
        ("label", (16, 7, 0.2), "PASS", 1),
        ("foreign", (4, 4, 0.3), "plastic scrap", 4),
        ("foreign", (4, 2, 0.3), "plastic scrap", 2),
    ],
)
def test_what_looks_alike(kind: str, size: tuple[float, ...], label: str, ways: int) -> None:
    assert looks_alike(replace(component(kind, *size, label=label), rotation=0.7)) == ways
