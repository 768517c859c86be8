"""From what a manifest says about a target to the target that can be found in pictures."""

from aoicell.datasets.target_descriptions import (
    ArucoGridDescription,
    CharucoDescription,
    ChessboardDescription,
    CircleGridDescription,
    TargetDescription,
)
from aoicell.targets.apriltag import AprilTag
from aoicell.targets.aruco_grid import ArucoGrid
from aoicell.targets.charuco import Charuco
from aoicell.targets.chessboard import Chessboard
from aoicell.targets.circle_grid import CircleGrid
from aoicell.targets.sighting import CalibrationTarget


def build_target(described: TargetDescription) -> CalibrationTarget:
    """The target of a description, in metres. Raises InputError for one that cannot be."""
    d = described
    if isinstance(d, ChessboardDescription):
        return Chessboard(d.columns, d.rows, d.square_mm / 1e3)
    if isinstance(d, CharucoDescription):
        square, marker = d.square_mm / 1e3, d.marker_mm / 1e3
        return Charuco(d.columns, d.rows, square, marker, d.dictionary, bool(d.legacy))
    if isinstance(d, ArucoGridDescription):
        marker, gap = d.marker_mm / 1e3, d.gap_mm / 1e3
        return ArucoGrid(d.columns, d.rows, marker, gap, d.dictionary, d.first_id)
    if isinstance(d, CircleGridDescription):
        return CircleGrid(d.columns, d.rows, d.spacing_mm / 1e3, d.origin_dot, d.asymmetric)
    return AprilTag(
        tag=d.tag_mm / 1e3,
        first_id=d.first_id,
        family=d.family,
        columns=d.columns,
        rows=d.rows,
        gap=(d.gap_mm or 0.0) / 1e3,
        from_bottom=bool(d.from_bottom),
    )
