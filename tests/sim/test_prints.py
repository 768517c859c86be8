"""How prints turn out: the truth of their points, and the dust on them."""

import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.sim.prints import dusty, plate_height, printed_size, true_corners, true_crosses
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.cross_marker import CrossMarker

SIZE = (0.2, 0.1)
BOARD = Chessboard(columns=5, rows=4, square=0.02, margin=0.01)


def height(x: float, y: float, bow: float = 0.0, twist: float = 0.0) -> float:
    return float(plate_height(x, y, SIZE, bow, twist))


def test_a_bow_is_the_centre_over_the_edges() -> None:
    assert height(0, 0, bow=2e-3) == 2e-3
    for x, y in ((0.1, 0), (-0.1, 0.02), (0.03, 0.05), (0, -0.05), (0.1, 0.05)):
        assert height(x, y, bow=2e-3) == pytest.approx(0, abs=1e-15)
    assert height(0.05, 0, bow=2e-3) == pytest.approx(1.5e-3)


def test_a_twist_is_two_opposite_corners_over_the_others() -> None:
    corners = [height(x, y, twist=2e-3) for x, y in ((0.1, 0.05), (-0.1, 0.05))]
    assert corners == pytest.approx([1e-3, -1e-3])
    assert height(-0.1, -0.05, twist=2e-3) == pytest.approx(1e-3)
    for x, y in ((0, 0), (0.1, 0), (0, 0.05)):
        assert height(x, y, twist=2e-3) == 0


def test_the_pattern_is_stretched_about_the_plates_centre() -> None:
    points = true_corners(BOARD, (1.01, 0.98), (0.0, 0.0))
    np.testing.assert_allclose(points, BOARD.corners * [1.01, 0.98, 1], atol=1e-15)
    assert printed_size(BOARD.size, (1.01, 0.98)) == pytest.approx(
        (1.01 * BOARD.size[0], 0.98 * BOARD.size[1])
    )
    crosses = true_crosses(CrossMarker(size=0.07, pitch=0.04), (1.01, 0.98))
    np.testing.assert_allclose(crosses[0], [-0.0202, 0.0196, 0], atol=1e-15)


def test_corners_of_a_bent_board_lie_on_its_surface() -> None:
    bow, twist = 1e-3, -4e-4
    points = true_corners(BOARD, (1.0, 1.0), (bow, twist))
    first, (width, height_) = points[0], BOARD.size
    u, v = 2 * first[0] / width, 2 * first[1] / height_
    assert first[2] == pytest.approx(bow * (1 - u**2) * (1 - v**2) + twist / 2 * u * v, abs=1e-15)
    assert first[2] != pytest.approx(points[BOARD.columns - 1, 2], abs=1e-4)  # the twist


@pytest.mark.parametrize("share", [0.001, 0.005, 0.03])
@pytest.mark.parametrize("print_name", ["tabletarget", "marker"])
def test_dust_covers_the_stated_share(nominal: Nominal, print_name: str, share: float) -> None:
    white, size = blank(nominal, print_name)
    on_white, on_black = (
        dusty(image, size, share, np.random.default_rng(1)).astype(float)
        for image in (white, 0 * white)
    )
    covered = 1 - (on_white - on_black) / 255
    assert covered.mean() == pytest.approx(share, rel=0.05)


def blank(nominal: Nominal, print_name: str) -> tuple[np.ndarray, tuple[float, float]]:
    if print_name == "marker":
        side = nominal.marker.size
        return np.full_like(nominal.marker.print_image(), 255), (side, side)
    return np.full_like(nominal.tabletarget.print_image(), 255), nominal.tabletarget.size


def test_specks_are_small_grey_and_seen_on_black_and_white(nominal: Nominal) -> None:
    white, size = blank(nominal, "marker")
    dirty = dusty(white, size, 0.01, np.random.default_rng(2))
    assert 35 < dirty.min() < 80
    assert 120 < dusty(0 * white, size, 0.01, np.random.default_rng(2)).max() < 155
    specks = dirty < 250
    texel = size[0] / white.shape[1]
    run = longest_run(specks) * texel
    assert 0.4e-3 < run < 2.5e-3  # 0.6 mm, and two or three that touch


def longest_run(mask: np.ndarray) -> int:
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(int)
    edges = np.diff(padded, axis=1)
    starts, ends = np.nonzero(edges == 1)[1], np.nonzero(edges == -1)[1]
    return int((ends - starts).max())


def test_more_dust_leaves_the_specks_that_are_there(nominal: Nominal) -> None:
    white, size = blank(nominal, "marker")
    some, more = (dusty(white, size, s, np.random.default_rng(3)) for s in (0.002, 0.01))
    assert ((some == 255) >= (more == 255)).all()
    assert (more < 255).sum() > 3 * (some < 255).sum()


def test_a_clean_print_is_the_print(nominal: Nominal) -> None:
    image = nominal.marker.print_image()
    assert dusty(image, (0.06, 0.06), 0.0, np.random.default_rng(0)) is image
