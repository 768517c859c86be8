"""A code is read from any side, and no two readings are alike."""

import numpy as np
import pytest
from helpers.marked import aside, shown, true_px
from helpers.printed import BENT

from aoicell.errors import InputError
from aoicell.targets.coded_marker import CODES, CodedMarker, read_code
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.pose import rms


def test_every_pattern_has_one_reading_or_none() -> None:
    readings: dict[tuple[str, int], tuple[bool, ...]] = {}
    unread = []
    for number in range(16):
        a, b, c, d = ((number >> k) & 1 == 1 for k in range(4))
        read = read_code((a, b, c, d))
        if read is None:
            unread.append(sorted([a, b, c, d]) if a != c or b != d else [a, b, c, d])
        else:
            assert read not in readings
            readings[read] = (a, b, c, d)
    assert len(readings) == 4 * len(CODES) == 12
    assert len(unread) == 4  # the plain one, all diagonal, and the two that a half turn repeats


def test_the_print_differs_from_the_plain_one_in_its_diagonal_crosses_only() -> None:
    plain, coded = CrossMarker().print_image(240), CodedMarker(code="1").print_image(240)
    differs = plain != coded
    assert differs[:120, :120].any()  # top left
    differs[:120, :120] = False
    assert not differs.any()
    dark = (255.0 - coded).sum() / (255.0 - plain).sum()
    assert dark == pytest.approx(1, abs=2e-3)  # a turned cross covers as much


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("roll_deg", [10, 100, 190, 280])
def test_code_and_orientation_are_read(code: str, roll_deg: float) -> None:
    marker = CodedMarker(code=code)
    T = aside(0.01, 0.02, roll=np.radians(roll_deg), tilt=(0.3, -0.2))
    (seen,) = CodedMarker(code="2").sight(shown((marker, T)), BENT)  # finds any code
    assert seen.code == code
    assert rms(seen.uv_px - true_px(marker, T)) < 0.03


def test_plain_and_coded_markers_are_not_taken_for_each_other() -> None:
    plain, coded = CrossMarker(), CodedMarker(code="3")
    left, right = aside(-0.06, 0), aside(0.06, 0)
    grey = shown((plain, left), (coded, right))
    (seen,) = plain.sight(grey)
    assert abs(seen.uv_px.mean(axis=0) - true_px(plain, left).mean(axis=0)).max() < 0.1
    assert seen.code is None
    (seen,) = coded.sight(grey)
    assert seen.code == "3"
    assert rms(seen.uv_px - true_px(coded, right)) < 0.05


def test_an_unknown_code_is_refused() -> None:
    with pytest.raises(InputError, match="code '4' is none; known: 1, 2, 3"):
        CodedMarker(code="4")
