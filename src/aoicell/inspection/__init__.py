"""The comparison of a new picture with its standard image: what is missing, misplaced or foreign.

`inspect_board` does it all; a `Reference` of each view is made ready at its first use.
"""

from aoicell.inspection.findings import (
    BoardInspection,
    Finding,
    ForeignObject,
    ViewInspection,
)
from aoicell.inspection.inspect import inspect_board, inspect_view, register_2d
from aoicell.inspection.references import Reference
from aoicell.inspection.registration import FineRegistration
from aoicell.inspection.standard import InspectionConfig

__all__ = [
    "BoardInspection",
    "Finding",
    "FineRegistration",
    "ForeignObject",
    "InspectionConfig",
    "Reference",
    "ViewInspection",
    "inspect_board",
    "inspect_view",
    "register_2d",
]
