"""What is plugged into another part moves with it, and each tells of the other where it is."""

import numpy as np
import pytest
from helpers.small_boards import board, component

from aoicell.inspection import ViewInspection, inspect_view
from inspection.flat_boards import SIZE_MM, Pose, flat_reference, painted, photograph

MM = 1e-3
# the slot's ribs are alike; the module's marks are not
RIBS = np.tile([35.0, 150.0], (6, 40))
MARKS = np.random.default_rng(3).choice([35.0, 150.0], (3, 30))
MARKED = {"SLOT": RIBS, "MODULE": MARKS}
PAIR = board(
    component("SLOT", "connector", 0, 0, (60, 10, 0.1)),
    component("MODULE", "connector", 0, 0, (66, 5, 0.1), z_mm=0.1, on="SLOT"),
    component("CLIP1", "connector", -31, 0, (8, 14, 0.1), z_mm=0.2),
    component("CLIP2", "connector", 31, 0, (8, 14, 0.1), z_mm=0.2),
    size_mm=SIZE_MM,
)


def inspected(slot: Pose, module: Pose) -> ViewInspection:
    reference = flat_reference(painted(PAIR, marked=MARKED))
    moved = {"SLOT": slot, "MODULE": module}
    return inspect_view(photograph(painted(PAIR, moved, marked=MARKED), seed=7), reference, PAIR)


@pytest.mark.parametrize("along", [0.9, -0.8])
def test_a_slot_that_looks_alike_along_itself_lies_where_its_module_does(along: float) -> None:
    pose = (along * MM, 0.4 * MM, 0.0)
    findings = inspected(pose, pose).findings
    for id in ("SLOT", "MODULE"):
        assert findings[id].state == "shifted"
        assert findings[id].shift == pytest.approx(pose[:2], abs=0.05 * MM), id


def test_a_module_that_is_off_alone_leaves_its_slot_where_it_is() -> None:
    findings = inspected((0, 0, 0), (1.3 * MM, 0.0, 0.0)).findings
    assert findings["SLOT"].state == "present"
    assert findings["MODULE"].state == "shifted"
