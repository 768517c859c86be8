"""The paper's figures stand as printed, and what is said of them follows from them."""

import pytest

from aoicell.report import paper


def test_the_figures_as_printed() -> None:
    printed = [(t.moved_mm, t.left_mm, t.compensated_percent) for t in paper.TESTS]
    assert printed == [(49.1, 5.15, 91.5), (50.6, 3.80, 92.5)]
    assert (paper.MEAN_MM, paper.MEAN_PX) == (3.97, 21.09)
    assert (paper.HAND_EYE_X_MM, paper.HAND_EYE_Z_MM) == (9, 2)


def test_the_contradictions_are_named() -> None:
    note = paper.contradictions()
    for figure in ("5.15 mm of 49.1 mm", "89.5 %", "not 91.5 %", "is 4.47", "3.97 mm"):
        assert figure in note
    assert "92.5" not in note  # that one follows


def test_they_are_computed(monkeypatch: pytest.MonkeyPatch) -> None:
    tests = (paper.PrintedTest(40.0, 4.0, 95.0), paper.PrintedTest(50.0, 2.0, 96.0))
    monkeypatch.setattr(paper, "TESTS", tests)
    note = paper.contradictions()
    assert "90.0 %" in note
    assert "is 3.00" in note
