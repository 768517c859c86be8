"""A part put in the other way round, of which hardly anything shows it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from aoicell.inspection import Reference, ViewInspection, inspect_view
from aoicell.inspection.half_turn import HalfTurnConfig
from aoicell.inspection.inspect import STANDARD
from aoicell.inspection.matching import Place
from aoicell.inspection.standard import Tools, grey_noise, standard_of
from aoicell.observation import Image
from inspection.flat_boards import (
    T_CAMERA_BOARD,
    Flat,
    Pose,
    flat_drawing,
    flat_reference,
    painted,
    photograph,
)
from inspection.scenes import called

ALL = tuple(f"U{n}" for n in range(20))
HALF: Pose = (0.0, 0.0, np.pi)
_DIM = 0.1  # of a dot's brightness: the misfit of a whole part hardly notices it


def looks(
    flat: Flat, turned: Sequence[str], seed: int, moved: dict[str, Pose] | None = None
) -> Image:
    """A picture of chips that look alike after a half turn, but for a faint dot."""
    poses = {**dict.fromkeys(turned, HALF), **(moved or {})}
    plain = painted(flat.board, poses, alike=ALL)
    dotted = painted(flat.board, poses, alike=ALL, dotted=ALL)
    return photograph(plain + _DIM * (dotted - plain), seed=seed)


def drawn(flat: Flat, image: Image) -> Reference:
    """The reference, with both ways round as the design draws them, in another light."""
    bare = photograph(painted(flat.board, missing=ALL), seed=9)
    designed, turned = (
        np.rint(0.8 * looks(flat, which, seed)).astype(np.uint8)
        for which, seed in (((), 10), (ALL, 11))
    )
    drawing = flat_drawing(flat.board, bare, ways=(designed, turned))
    return Reference("flat", (image,), T_CAMERA_BOARD, flat.reference.camera, drawing=drawing)


@pytest.fixture(scope="module")
def reference(flat: Flat) -> Reference:
    return drawn(flat, looks(flat, (), 0))


def inspected(flat: Flat, reference: Reference, image: Image) -> ViewInspection:
    return inspect_view(image, reference, flat.board)


def test_only_the_drawing_tells_it(flat: Flat, reference: Reference) -> None:
    """Too little for the misfit of a whole part; the filter is certain of it."""
    new = looks(flat, ("U3", "U8"), 1)
    found = inspected(flat, reference, new)
    assert called(found) == ["U3", "U8"]
    for id in ("U3", "U8"):
        finding = found.findings[id]
        assert finding.state == "rotated"
        assert finding.rotation == pytest.approx(np.pi)
        assert finding.confidence > 0.99
        assert "other side" in finding.reason
    assert called(inspected(flat, replace(reference, drawing=None), new)) == []


def test_good_parts_are_not_called(flat: Flat, reference: Reference) -> None:
    """Nor those that lie a little off, in another light."""
    moved: dict[str, Pose] = {"U5": (1e-4, -5e-5, 0.01), "U9": (-1e-4, 0.0, -0.01)}
    image = np.rint(0.9 * looks(flat, (), 2, moved)).astype(np.uint8)
    assert called(inspected(flat, reference, image)) == []


def test_a_drawing_that_shows_no_difference_tells_nothing(flat: Flat) -> None:
    reference = flat_reference(painted(flat.board, alike=ALL))
    bare = photograph(painted(flat.board, missing=ALL), seed=9)
    known = replace(reference, drawing=flat_drawing(flat.board, bare))
    tools = standard_of(known, flat.board, STANDARD).tools["U3"]
    match = tools.matcher.at(reference.images[0].astype(np.float32), Place(), 1e-3)
    assert tools.half_turn is not None
    assert tools.half_turn.share(match) == (0.0, 0.0)
    assert tools.half_turn.confidence(match) < 1e-3


@pytest.mark.parametrize(("turned", "share"), [((), 0.0), (ALL, 1.0)])
def test_the_share_is_that_of_the_drawn_change(
    flat: Flat, reference: Reference, turned: tuple[str, ...], share: float
) -> None:
    """Nought of what is right, one of what was turned, whatever the light of the drawing."""
    standard = standard_of(reference, flat.board, STANDARD)
    picture = looks(flat, turned, 3).astype(np.float32)
    noise = grey_noise(picture, standard)

    def measured(tools: Tools) -> float:
        assert tools.half_turn is not None
        return tools.half_turn.share(tools.matcher.at(picture, Place(), noise))[0]

    found = [measured(tools) for tools in standard.tools.values()]
    assert np.median(found) == pytest.approx(share, abs=0.15)
    assert np.ptp(found) < 0.5


def test_what_is_covered_is_not_asked(flat: Flat, reference: Reference) -> None:
    """With the corners left out that the dot may lie in, much less tells that U3 was turned."""
    standard = standard_of(reference, flat.board, STANDARD)
    picture = looks(flat, ("U3",), 6).astype(np.float32)
    tools = standard.tools["U3"]
    assert tools.half_turn is not None
    part, reach = tools.template.component, np.hypot(*tools.template.arms.T)
    corners = reach > 0.4 * np.hypot(part.width, part.depth) / 2
    assert 0.1 < corners.mean() < 0.8
    seen, hidden = (
        tools.half_turn.share(tools.matcher.at(picture, Place(), 1e-3, ignored=ignored))[1]
        for ignored in (None, corners)
    )
    assert hidden < 0.6 * seen


def test_a_share_below_the_limit_is_none(flat: Flat, reference: Reference) -> None:
    config = replace(STANDARD, half_turn=HalfTurnConfig(share=1.5))
    new = looks(flat, ("U3",), 5)
    assert called(inspect_view(new, reference, flat.board, config)) == []
