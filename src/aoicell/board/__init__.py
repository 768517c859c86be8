"""The designed board: what it is, the folder that it is read from, the checks on its layout."""

from aoicell.board.design import (
    KINDS,
    MARKER_ROLES,
    BoardDesign,
    Component,
    MarkerDesign,
)
from aoicell.board.files import COLUMNS, load_board
from aoicell.board.layout import rectangles_overlap
from aoicell.board.markers import with_markers

__all__ = [
    "COLUMNS",
    "KINDS",
    "MARKER_ROLES",
    "BoardDesign",
    "Component",
    "MarkerDesign",
    "load_board",
    "rectangles_overlap",
    "with_markers",
]
