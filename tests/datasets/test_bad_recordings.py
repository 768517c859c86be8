"""Recordings on disk with one thing wrong: never a wrong answer with verdict 'ok'."""

from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest

from aoicell.datasets.recording import read_recording
from aoicell.datasets.solve import solve_recording
from aoicell.errors import InputError

from .bad_recordings import SPOILS, good, spoiled, write

# Long to solve, and tried every day by test_solve (on disk) or calibration/test_calibrate.
ELSEWHERE = ("moved up", "shuffled", "transposed", "two swapped")


def outcome(manifest: Path) -> str:
    """The verdict, or 'input' where the files themselves are refused; always with a reason."""
    try:
        report = solve_recording(read_recording(manifest)).report
    except InputError as complaint:
        return "input" if str(complaint) else "nothing said"
    assert report.reasons or report.verdict == "ok"
    return report.verdict


def test_the_recording_that_is_spoiled_is_a_good_one(tmp_path: Path) -> None:
    assert outcome(write(good(np.random.default_rng(0)), tmp_path / "good")) == "ok"


@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=pytest.mark.slow) if k in ELSEWHERE else k for k in SPOILS]
)
def test_a_bad_recording_is_never_ok(kind: str, tmp_path: Path) -> None:
    assert outcome(spoiled(kind, 0, tmp_path / "bad")) in ("input", "suspect", "refused")


@pytest.mark.slow
def test_five_hundred_bad_recordings_are_never_ok(tmp_path: Path) -> None:
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for seed in range(1, 31):
        for kind in SPOILS:
            counts[kind][outcome(spoiled(kind, seed, tmp_path / f"{seed} {kind}"))] += 1
    print({kind: dict(count) for kind, count in counts.items()})
    assert sum(count.total() for count in counts.values()) >= 500
    assert {kind: count["ok"] for kind, count in counts.items() if count["ok"]} == {}
