"""The same board with other markers: another kind, another size, another pitch."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from aoicell.board.design import BoardDesign, Component, MarkerDesign
from aoicell.board.layout import MARKER_CLEARANCE, rectangles_overlap
from aoicell.errors import InputError
from aoicell.targets.marker import find_kind, make_marker

_STEP = 0.001  # sizes that are proposed differ by so much (m)


def with_markers(
    board: BoardDesign, kind: str = "", size: float = 0.0, pitch: float = 0.0,
    make_room: bool = False,
) -> BoardDesign:  # fmt: skip
    """The board with markers of another `kind`, `size` and `pitch` (m) in the places of its own.

    "" and 0 leave what the board has; where that does not go together, a kind takes its usual
    pitch, and a size that is not given is what the pitch needs. Codes go round the markers in
    order. A marker that would leave the outline moves inwards. Components in its way are left
    out with `make_room`; without it they raise InputError, as does what is no marker.
    """
    markers = tuple(
        _changed(board, marker, index, kind, size, pitch)
        for index, marker in enumerate(board.markers)
    )
    for marker in markers:
        make_marker(marker.kind, marker.size, marker.pitch, marker.code)
    in_the_way = {marker.id: _under(board.components, marker) for marker in markers}
    if any(in_the_way.values()) and not make_room:
        raise InputError(_complaint(board, markers, in_the_way))
    gone = {component.id for parts in in_the_way.values() for component in parts}
    return replace(board, components=_without(board.components, gone), markers=markers)


def _changed(
    board: BoardDesign, marker: MarkerDesign, index: int, kind: str, size: float, pitch: float
) -> MarkerDesign:
    known = find_kind(kind or marker.kind)
    same = kind in ("", marker.kind)
    pitch = pitch or (marker.pitch if same else known.share * (size or marker.size))
    size = size or max(marker.size, known.least_size(pitch))
    code = marker.code if same else known.codes[index % len(known.codes)]
    changed = replace(marker, kind=kind or marker.kind, size=size, pitch=pitch, code=code)
    return _moved_inside(board, changed)


def _moved_inside(board: BoardDesign, marker: MarkerDesign) -> MarkerDesign:
    half = np.abs(marker.plate() - [marker.x, marker.y]).max(axis=0)
    room = np.array(board.size[:2]) / 2 - half
    if (room < 0).any():
        raise InputError(
            f"marker {marker.id}: a plate of {marker.size * 1e3:g} mm is larger than board "
            f"{board.name}, {board.size[0] * 1e3:g} x {board.size[1] * 1e3:g} mm"
        )
    x, y = np.clip([marker.x, marker.y], -room, room)
    return replace(marker, x=float(x), y=float(y))


def _under(components: Sequence[Component], marker: MarkerDesign) -> list[Component]:
    """Components that lie under the marker's plate or nearer than the clearance to it."""
    plate = marker.plate(MARKER_CLEARANCE)
    return [part for part in components if rectangles_overlap(part.footprint, plate)]


def _without(components: Sequence[Component], gone: set[str]) -> tuple[Component, ...]:
    """The components but those, and but what stands on them."""
    gone, count = set(gone), -1
    while count != len(gone):
        count = len(gone)
        gone |= {part.id for part in components if part.on in gone}
    return tuple(part for part in components if part.id not in gone)


def _complaint(
    board: BoardDesign,
    markers: Sequence[MarkerDesign],
    in_the_way: Mapping[str, Sequence[Component]],
) -> str:
    worst = next(marker for marker in markers if in_the_way[marker.id])
    ids = ", ".join(part.id for part in in_the_way[worst.id])
    largest = _largest(board, worst.size)
    return (
        f"marker {worst.id} of {worst.size * 1e3:g} mm on board {board.name} lies "
        f"on {ids}; markers of up to {largest * 1e3:g} mm fit, and make_room = true leaves out the "
        "components in the way"
    )


def _largest(board: BoardDesign, size: float) -> float:
    """The largest side (m) below `size` with which no marker lies on a component."""
    for side in np.arange(np.floor(size / _STEP) * _STEP, 0, -_STEP):
        plates = [_moved_inside(board, replace(marker, size=side)) for marker in board.markers]
        if not any(_under(board.components, plate) for plate in plates):
            return float(np.round(side, 6))
    return 0.0
