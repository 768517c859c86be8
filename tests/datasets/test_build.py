"""Described targets become targets of the right size, found on their own print."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from aoicell.datasets.build import build_target
from aoicell.datasets.target_descriptions import KINDS
from aoicell.errors import InputError

CHARUCO = {
    "kind": "charuco", "columns": 5, "rows": 7, "square_mm": 36.0, "marker_mm": 18.0,
    "dictionary": "DICT_6X6_250",
}  # fmt: skip
GRID = {
    "kind": "aruco_grid", "columns": 3, "rows": 4, "marker_mm": 30.0, "gap_mm": 10.0,
    "dictionary": "DICT_5X5_100", "first_id": 7,
}  # fmt: skip
TAGS = {
    "kind": "apriltag", "tag_mm": 40.0, "family": "tag36h11", "columns": 2, "rows": 3,
    "gap_mm": 12.0, "from_bottom": True,
}  # fmt: skip


@pytest.mark.parametrize(
    ("values", "count", "extent_mm"),
    [
        ({"kind": "chessboard", "columns": 9, "rows": 6, "square_mm": 25.0}, 54, (200, 125)),
        (CHARUCO, 24, (108, 180)),
        (
            {
                "kind": "circle_grid",
                "columns": 10,
                "rows": 8,
                "spacing_mm": 25.4,
                "origin_dot": True,
            },
            80,
            (228.6, 177.8),
        ),
        (GRID, 48, (110, 150)),
        (TAGS, 24, (92, 144)),
        ({"kind": "apriltag", "tag_mm": 40.0, "family": "tag25h9"}, 4, (40, 40)),
    ],
)
def test_sizes_are_in_millimetres(
    values: Mapping[str, Any], count: int, extent_mm: tuple[float, float]
) -> None:
    target = build_target(KINDS[values["kind"]].model_validate(values))  # type: ignore[arg-type]
    assert target.points.shape == (count, 3)
    np.testing.assert_allclose(np.ptp(target.points, axis=0)[:2] * 1e3, extent_mm, atol=1e-9)


def test_an_old_print_is_another_board() -> None:
    even = {**CHARUCO, "rows": 6}
    prints = []
    for legacy in (False, True):
        described = KINDS["charuco"].model_validate({**even, "legacy": legacy})
        prints.append(build_target(described).print_image(2000.0))  # type: ignore
    assert (prints[0] != prints[1]).any()


def test_a_board_that_cannot_be_is_refused() -> None:
    described = KINDS["aruco_grid"].model_validate({**GRID, "first_id": 95})
    with pytest.raises(InputError, match=r"not all in DICT_5X5_100, which has 0 to 99"):
        build_target(described)  # type: ignore[arg-type]
