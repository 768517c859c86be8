"""The board as it is rendered: prints the right way round, parts and markers as they really are."""

from aoicell.sim.backend import make_renderer  # isort: skip  (chooses the rendering back end)

import math
from dataclasses import replace

import cv2
import mujoco
import numpy as np
import pytest

from aoicell.board import BoardDesign, Component, MarkerDesign
from aoicell.sim.as_built import Surfaces, plain_surfaces
from aoicell.sim.board_geometry import component_parts
from aoicell.sim.board_labels import label_image
from aoicell.sim.board_scene import add_board, mounted
from aoicell.sim.board_silkscreen import silkscreen_image
from aoicell.transforms import from_xyz_rpy, translation

WIDTH, HEIGHT = 400, 300  # a pixel is 1/4 mm at the board's surface
SIZE = (0.100, 0.075, 0.002)
CLEAN = plain_surfaces()


def scene(board: BoardDesign, surfaces: Surfaces = CLEAN) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    Ts = {m.id: from_xyz_rpy([m.x, m.y, m.z], [0, 0, m.rotation]) for m in board.markers}
    add_board(spec, spec.worldbody.add_body(), board, Ts, surfaces=surfaces)
    return spec


def from_above(board: BoardDesign, surfaces: Surfaces = CLEAN) -> np.ndarray:
    """A grey picture that shows exactly the board, x to the right and y up."""
    spec = scene(board, surfaces)
    spec.visual.headlight.ambient = (0.6, 0.6, 0.6)
    spec.visual.headlight.specular = (0, 0, 0)
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


# ---- components and markers as they really are -------------------------------------------------

MARKER = MarkerDesign("M1", "cross", 0.0, 0.0, 5e-4, 0.0, 0.060, 0.036, "positioning")


def stack() -> tuple[BoardDesign, dict[str, Component]]:
    """A label on a cooler on a socket, each as high as its letters say."""
    parts = (
        Component("S", "socket", 0, 0, 0, 0, 0.04, 0.04, 0.005, ""),
        Component("H", "heatsink", 0, 0, 0.005, 0, 0.03, 0.03, 0.020, "", "S"),
        Component("L", "label", 0, 0, 0.025, 0, 0.01, 0.01, 0.0002, "X", "H"),
    )
    return BoardDesign("test", SIZE, (0, 0.2, 0.1), parts, ()), {p.id: p for p in parts}


def span(board: BoardDesign, component: Component, heights: dict[str, float]) -> tuple[float, ...]:
    """Underside and top of a component (m)."""
    parts = list(mounted(board, component, component_parts(component), heights))
    low = min(p.centre[2] - p.half_size[2] for p in parts)
    return low, max(p.centre[2] + p.half_size[2] for p in parts)


def test_a_component_is_stretched_from_its_underside() -> None:
    board, part = stack()
    assert span(board, part["S"], {"S": 1e-3}) == pytest.approx((0, 0.006))
    assert span(board, part["S"], {"S": -1e-3}) == pytest.approx((0, 0.004))
    assert span(board, part["S"], {"H": 1e-3}) == pytest.approx((0, 0.005))


def test_a_component_lifts_what_stands_on_it() -> None:
    board, part = stack()
    heights = {"S": 1e-3, "H": -2e-3}
    assert span(board, part["H"], heights) == pytest.approx((0.006, 0.024))
    assert span(board, part["L"], heights) == pytest.approx((0.024, 0.0242))


def test_a_component_is_never_flat() -> None:
    board, part = stack()
    low, top = span(board, part["L"], {"L": -1e-3})
    assert top - low == pytest.approx(0.2 * part["L"].height)


def test_parts_stay_as_designed_without_offsets() -> None:
    board, part = stack()
    parts = component_parts(part["H"])
    assert tuple(mounted(board, part["H"], parts, {"S": 0.0, "H": 0.0})) == parts


def test_the_heights_are_in_the_scene() -> None:
    board, part = stack()
    heights = {"S": 1e-3, "H": 2e-3, "L": 1e-4}
    spec = scene(board, replace(CLEAN, heights=heights))
    tops = [g.pos[2] + g.size[2] for g in spec.geoms if g.group]
    assert max(tops) == pytest.approx(part["L"].top + sum(heights.values()))


def test_the_brightness_of_a_component_is_in_the_picture() -> None:
    parts = (
        Component("A", "label", -0.025, 0, 0, 0, 0.03, 0.03, 0.001, "I"),
        Component("B", "heatsink", 0.025, 0, 0, 0, 0.03, 0.03, 0.001, ""),
    )
    board = BoardDesign("test", SIZE, (0, 0.2, 0.1), parts, ())
    plain = from_above(board).astype(float)
    left, right = plain[:, :180], plain[:, 220:]
    for id in ("A", "B"):
        tones = replace(CLEAN, brightness={id: 0.7})
        toned = from_above(board, tones).astype(float)
        inner = (slice(110, 190), slice(60, 140) if id == "A" else slice(260, 340))
        assert toned[inner].mean() / plain[inner].mean() == pytest.approx(0.7, abs=0.03)
        rest, before = (toned[:, 220:], right) if id == "A" else (toned[:, :180], left)
        np.testing.assert_array_equal(rest, before)


def test_bright_parts_saturate() -> None:
    board, _ = stack()
    spec = scene(board, replace(CLEAN, brightness={"S": 2.0, "H": 2.0, "L": 2.0}))
    colours = np.array([g.rgba for g in spec.geoms])
    assert colours.max() == 1


def outline_seen(board: BoardDesign, share: float, seed: tuple[int, int]) -> np.ndarray:
    """Share of each of the four sides of the marker that is covered: left, right, top, bottom."""
    covered = replace(CLEAN, occlusion=share, seed=seed)
    plain, image = from_above(board), from_above(board, covered)
    changed = np.abs(plain.astype(int) - image) > 60
    inset = 12  # px (3 mm) inside, on the white: the frame is as dark as the ribbon
    x, y = (200 - 120 + inset, 200 + 120 - inset), (150 - 120 + inset, 150 + 120 - inset)
    rows, columns = slice(y[0], y[1]), slice(x[0], x[1])
    sides = [changed[rows, x[0]], changed[rows, x[1] - 1], changed[y[0], columns],
             changed[y[1] - 1, columns]]  # fmt: skip
    return np.array([side.mean() for side in sides])


def test_a_cover_takes_the_stated_share_of_the_outline() -> None:
    board = BoardDesign("test", SIZE, (0, 0.2, 0.1), (), (MARKER,))
    corners = set()
    for world in range(6):
        sides = outline_seen(board, 0.1, (0, world))
        assert (sides > 0).sum() == 2
        # 12 of 60 mm of each side; 3 mm inside the square, 6 of 54 are left of it
        np.testing.assert_allclose(sides[sides > 0], 6 / 54, atol=0.02)
        corners.add(tuple(sides > 0))
    assert len(corners) > 1
    assert (outline_seen(board, 0.0, (0, 0)) == 0).all()


def test_the_board_gives_way_to_a_sunken_marker() -> None:
    board = BoardDesign("test", SIZE, (0, 0.2, 0.1), (), (MARKER,))
    spec = mujoco.MjSpec()
    add_board(spec, spec.worldbody.add_body(), board, {"M1": translation(z=-2e-3)})
    pcb, marker = spec.geoms[:2]
    assert marker.pos[2] + marker.size[2] == pytest.approx(-2e-3)
    assert pcb.pos[2] + pcb.size[2] == pytest.approx(-2.1e-3)
    flush = scene(board).geoms[0]
    assert flush.pos[2] + flush.size[2] == pytest.approx(0, abs=1e-12)
