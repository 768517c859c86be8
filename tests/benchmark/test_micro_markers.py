"""The benchmark of markers scores as it says."""

import json

import numpy as np
import pytest

from aoicell.benchmark.micro import BENCHMARKS, markers
from aoicell.benchmark.micro.markers import Condition, Shown
from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.targets.marker import MARKERS
from aoicell.targets.marker_sighting import MarkerSighting
from aoicell.transforms import Array

CAMERA = Camera.pinhole(900.0, 320, 320)
SQUARE = np.array([[100.0, 100], [200, 100], [200, 200], [100, 200]])


class Sees:
    """A marker that is seen where a test says."""

    def __init__(self, *seen: MarkerSighting) -> None:
        self.seen = list(seen)
        self.size, self.crosses, self.outline = 0.06, np.zeros((4, 3)), np.zeros((4, 3))

    def print_image(self, pixels: int = 640) -> Image:
        return np.zeros((pixels, pixels), np.uint8)

    def detect(self, grey: Image) -> list[Array]:
        return [s.uv_px for s in self.seen]

    def sight(self, grey: Image, camera: Camera | None = None) -> list[MarkerSighting]:
        assert camera is CAMERA
        return self.seen


def at(uv: Array, code: str | None = None) -> MarkerSighting:
    return MarkerSighting(uv, np.full(4, 0.1), code)


def shown(*truth: tuple[str, Array]) -> Shown:
    return Shown("mine", "far", np.zeros((8, 8), np.uint8), CAMERA, truth)


def test_hits_misses_and_false_accepts() -> None:
    picture = shown(("", SQUARE), ("", SQUARE + 110))
    score = markers._score("mine", Sees(at(SQUARE + 0.1), at(SQUARE + 50)), picture)
    assert (score.found, score.shown, score.false) == (1, 2, 1)
    np.testing.assert_allclose(score.errors_px, 0.1)
    other = markers._score("another", Sees(at(SQUARE)), picture)
    assert (other.shown, other.false) == (0, 1)  # what looks like ours on another's print


def test_a_marker_counts_once() -> None:
    score = markers._score("mine", Sees(at(SQUARE), at(SQUARE)), shown(("", SQUARE)))
    assert (score.found, score.false) == (1, 1)


def test_a_plain_marker_may_be_read_from_any_side_a_coded_one_may_not() -> None:
    turned = np.roll(SQUARE, 1, axis=0)
    assert markers._score("mine", Sees(at(turned)), shown(("", SQUARE))).found == 1
    assert markers._score("mine", Sees(at(turned, "1")), shown(("1", SQUARE))).false == 1
    assert markers._score("mine", Sees(at(SQUARE, "1")), shown(("1", SQUARE))).found == 1
    assert markers._score("mine", Sees(at(SQUARE, "2")), shown(("1", SQUARE))).false == 1


def test_the_summary() -> None:
    scores = [
        markers._score(
            "mine", Sees(at(SQUARE + [0.3, 0.4])), shown(("", SQUARE), ("", SQUARE + 80))
        )
    ]
    summary = markers._summary("mine", scores)
    assert summary["rms_px"] == pytest.approx(0.5)
    assert summary["over_sigma"] == pytest.approx(0.5 / np.sqrt(2) / 0.1, abs=0.01)
    assert (summary["recall"], summary["false_accepts"]) == (0.5, 0)
    empty = markers._summary("mine", [markers._score("mine", Sees(), shown(("", SQUARE)))])
    assert (empty["rms_px"], empty["recall"]) == (None, 0.0)


def test_rendered_pictures_of_two_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(markers, "CONDITIONS", (Condition("far", views=("far",)),))
    kinds = {kind: MARKERS[kind] for kind in ("coded", "apriltag")}
    monkeypatch.setattr(markers, "MARKERS", kinds)
    result = BENCHMARKS["markers"](True)
    assert json.loads(json.dumps(result)) == result
    assert [row["kind"] for row in result["rows"]] == list(kinds)
    for kind in kinds:
        assert result["ratios"]["recall"][kind] == 1
        assert result["ratios"]["false_accepts"][kind] == 0
    assert 0 < result["ratios"]["rms_px"]["coded"] < 0.05
