"""Two chessboards in one picture, told apart and in a settled order."""

from aoicell.errors import InputError, TargetNotFound
from aoicell.observation import Image
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.sighting import Sighting, complete

MIN_RATIO = 1.05  # boards of one layout: square of the larger image over the other's


def sight_pair(
    grey: Image, boards: tuple[Chessboard, Chessboard], name: str = "chessboards"
) -> tuple[Sighting, Sighting]:
    """Both boards of a picture (H, W), in the order in which they are given.

    Boards of different layout are told apart by it. Of one layout, the board with the larger
    squares has to have the larger image, by at least 5 %. Raises TargetNotFound, also when the
    images are too much alike; InputError when nothing tells the boards apart.
    """
    first, second = boards
    if (first.columns, first.rows) != (second.columns, second.rows):
        return _by_layout(grey, first, second, name)
    if first.square == second.square:
        raise InputError(
            f"{name}: two boards of {first.columns}x{first.rows} corners and equal squares cannot "
            "be told apart; use another layout or size for one of them"
        )
    larger, smaller = first.detect_pair(grey, name)
    sides = first.square_px(larger), first.square_px(smaller)
    if sides[0] < MIN_RATIO * sides[1]:
        raise TargetNotFound(
            f"{name}: the two boards cannot be told apart, their squares measure {sides[0]:.1f} "
            f"and {sides[1]:.1f} px; bring the one with the larger squares nearer to the camera"
        )
    uvs = (larger, smaller) if first.square > second.square else (smaller, larger)
    return complete(uvs[0]), complete(uvs[1])


def _by_layout(
    grey: Image, first: Chessboard, second: Chessboard, name: str
) -> tuple[Sighting, Sighting]:
    """The board with more corners first, then the other one without it: a part of a board
    could pass for a smaller one.
    """
    if len(first.corners) < len(second.corners):
        seen_second, seen_first = _by_layout(grey, second, first, name)
        return seen_first, seen_second
    seen = first.sight(grey, name)
    return seen, second.sight(first.hidden(grey, seen.uv_px), name)
