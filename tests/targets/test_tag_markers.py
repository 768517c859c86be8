"""AprilTags and ChArUco boards on a marker's square: four points, a code, a stated deviation."""

from collections.abc import Callable

import numpy as np
import pytest
from helpers.marked import aside, shown, true_px
from helpers.printed import BENT

from aoicell.errors import InputError
from aoicell.targets.pose import rms
from aoicell.targets.tag_markers import CharucoMarker, TagMarker

Kind = Callable[[str], TagMarker | CharucoMarker]
KINDS: list[Kind] = [
    lambda code: TagMarker(0.060, 0.048, code),
    lambda code: CharucoMarker(0.060, 0.036, code),
]


@pytest.mark.parametrize("make", KINDS)
@pytest.mark.parametrize("roll_deg", [10, 100, 190, 280])
def test_code_and_orientation_are_read(make: Kind, roll_deg: float) -> None:
    marker = make("3")
    T = aside(0.01, 0.02, roll=np.radians(roll_deg), tilt=(0.3, -0.2))
    (seen,) = make("0").sight(shown((marker, T), noise=0.5), BENT)
    assert seen.code == "3"
    assert rms(seen.uv_px - true_px(marker, T)) < 0.1


@pytest.mark.parametrize("make", KINDS)
def test_several_in_one_picture(make: Kind) -> None:
    places = {"0": aside(-0.06, 0), "7": aside(0.06, 0.01, roll=-2)}
    markers = {code: make(code) for code in places}
    seen = make("0").sight(shown(*((markers[c], T) for c, T in places.items())), BENT)
    assert sorted(s.code or "" for s in seen) == ["0", "7"]
    for s in seen:
        assert rms(s.uv_px - true_px(markers[s.code or ""], places[s.code or ""])) < 0.1


@pytest.mark.parametrize("make", KINDS)
def test_the_stated_deviation_grows_with_the_noise(make: Kind) -> None:
    T, errors, stated = aside(0, 0), {}, {}
    for noise in (1.0, 8.0):
        found = []
        for seed in range(6):
            (seen,) = make("1").sight(shown((make("1"), T), noise=noise, seed=seed), BENT)
            found.append((seen.uv_px - true_px(make("1"), T), seen.sigma_px))
        errors[noise] = np.sqrt(np.mean([e**2 for e, _ in found]))
        stated[noise] = np.sqrt(np.mean([s**2 for _, s in found]))
        assert 0.3 < errors[noise] / stated[noise] < 2.0
    assert stated[8.0] > 1.5 * stated[1.0]


def test_nothing_is_found_on_an_even_ground() -> None:
    for make in KINDS:
        assert make("0").detect(np.full((300, 400), 128, dtype=np.uint8)) == []


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: TagMarker(0.05, 0.048), "48 mm do not fit into 50 mm; .* 60 mm at least"),
        (lambda: CharucoMarker(0.06, 0.048), "48 mm do not fit into 60 mm; .* 80 mm at least"),
        (lambda: TagMarker(0.06, 0.048, "x"), "code 'x' is none; give a number from 0 to 49"),
        (lambda: CharucoMarker(0.06, 0.036, "20"), "code '20' is none; give a number from 0 to 19"),
    ],
)
def test_what_cannot_be_printed_is_refused(make: Callable[[], object], expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        make()
