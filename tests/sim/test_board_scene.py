"""The prints on a rendered board are the right way round."""

from aoicell.sim.backend import make_renderer  # isort: skip  (chooses the rendering back end)

import math

import cv2
import mujoco
import numpy as np
import pytest

from aoicell.board import BoardDesign, Component
from aoicell.sim.board_labels import label_image
from aoicell.sim.board_scene import add_board
from aoicell.sim.board_silkscreen import silkscreen_image

WIDTH, HEIGHT = 400, 300  # a pixel is 1/4 mm at the board's surface
SIZE = (0.100, 0.075, 0.002)


def from_above(board: BoardDesign) -> np.ndarray:
    """A grey picture that shows exactly the board, x to the right and y up."""
    spec = mujoco.MjSpec()
    add_board(spec, spec.worldbody.add_body(), board, {})
    spec.visual.headlight.ambient = (0.6, 0.6, 0.6)
    fovy = 2 * math.degrees(math.atan(SIZE[1] / 2))
    spec.worldbody.add_camera(name="eye", pos=(0, 0, 1), fovy=fovy)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = make_renderer(model, WIDTH, HEIGHT)
    option = mujoco.MjvOption()
    option.geomgroup[0] = 0
    renderer.update_scene(data, "eye", option)
    image = cv2.cvtColor(renderer.render(), cv2.COLOR_RGB2GRAY)
    renderer.close()
    return image


def likeness(picture: np.ndarray, printed: np.ndarray) -> float:
    grey = cv2.cvtColor(printed, cv2.COLOR_RGB2GRAY)
    small = cv2.resize(grey, picture.shape[::-1], interpolation=cv2.INTER_AREA)
    return float(np.corrcoef(picture.ravel(), small.ravel())[0, 1])


@pytest.mark.parametrize("turn", [0, 90, 180, 270])
@pytest.mark.parametrize("kind", ["label", "chip"])
def test_a_printed_component_reads_from_its_own_side(kind: str, turn: int) -> None:
    part = Component("U1", kind, 0, 0, 0, math.radians(turn), 0.04, 0.04, 0.001, "LEFT 7")
    picture = from_above(BoardDesign("test", SIZE, (0, 0.2, 0.1), (part,), ()))
    half = 80 if kind == "label" else 64  # a chip's print covers 0.8 of its footprint
    cut = picture[150 - half : 150 + half, 200 - half : 200 + half]
    upright = np.ascontiguousarray(np.rot90(cut, -turn // 90))  # back from its turn
    printed = label_image(part)
    ways = [likeness(upright, way) for way in (printed, printed[:, ::-1], printed[::-1])]
    assert ways[0] > 0.85
    assert ways[0] > max(ways[1:]) + 0.1


def test_the_silkscreen_lies_as_drawn() -> None:
    parts = tuple(
        Component(id, "chip", x, 0.02, 0, 0, 0.005, 0.005, 0.0005, "")
        for id, x in (("U1", -0.03), ("U222", 0.01))
    )
    board = BoardDesign("scene test", SIZE, (0, 0.2, 0.1), parts, ())
    picture, printed = from_above(board), silkscreen_image(board, 4.0)
    ways = [likeness(picture, way) for way in (printed, printed[:, ::-1], printed[::-1])]
    assert ways[0] > 0.8
    assert ways[0] > max(ways[1:]) + 0.2
