"""The small benchmarks run and report what they promise."""

import json

import cv2
import pytest

from aoicell.benchmark.micro import optics
from aoicell.nominal import Nominal
from aoicell.transforms import Array


@pytest.fixture
def few_views(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of the taught views: what a test has time for."""
    taught = optics._taught

    def first_two(nominal: Nominal) -> dict[str, Array]:
        return dict(list(taught(nominal).items())[:2])

    monkeypatch.setattr(optics, "_taught", first_two)
    monkeypatch.setattr(optics, "QUICK_ROUNDS", 2)


@pytest.mark.usefixtures("few_views")
def test_optics_are_measured_against_the_render_of_the_same_picture() -> None:
    threads = cv2.getNumThreads()
    result = optics.bench_optics(quick=True)
    assert cv2.getNumThreads() == threads
    assert json.loads(json.dumps(result)) == result
    assert result["name"] == "optics"
    assert [row["view"] for row in result["rows"]] == ["P_check", "overview"]
    for row in result["rows"]:
        assert row["pictures"] == 2
        assert row["render_ms"] > 0
        assert row["optics_ms"] > 0
    ratios = [row["optics_over_render"] for row in result["rows"]]
    assert min(ratios) <= result["ratios"]["optics_over_render"] <= max(ratios)
