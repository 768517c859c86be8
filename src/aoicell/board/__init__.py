"""The designed board: what it is, the folder that it is read from, the checks on its layout."""

from aoicell.board.design import (
    DEFAULT_TOLERANCE,
    KINDS,
    MARKER_ROLES,
    BoardDesign,
    Component,
    MarkerDesign,
    Tolerance,
)
from aoicell.board.files import COLUMNS, TOLERANCE, load_board
from aoicell.board.layout import rectangles_overlap
from aoicell.board.markers import with_markers

__all__ = [
    "COLUMNS",
    "DEFAULT_TOLERANCE",
    "KINDS",
    "MARKER_ROLES",
    "TOLERANCE",
    "BoardDesign",
    "Component",
    "MarkerDesign",
    "Tolerance",
    "load_board",
    "rectangles_overlap",
    "with_markers",
]
