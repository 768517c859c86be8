"""One component in several views: its place by all that agree, and what that means."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aoicell.board import Tolerance
from aoicell.inspection import Finding
from aoicell.inspection.fusion import fused
from aoicell.inspection.verdicts import VerdictConfig, located

MM, DEG = 1e-3, np.pi / 180
CONFIG = VerdictConfig()
TOLERANCE = Tolerance(0.2 * MM, 5 * DEG)
SIGMAS = (0.02 * MM, 0.02 * MM, 2 * DEG)


def seen(
    x: float = 0.0, y: float = 0.0, turn: float = 0.0, view: str = "A", visible: float = 1.0,
    sigmas: tuple[float, float, float] = SIGMAS,
) -> Finding:  # fmt: skip
    """What a view says that measures a part there."""
    covariance = np.diag(np.square(sigmas))
    verdict = located((x, y), turn, covariance, TOLERANCE, CONFIG)
    return Finding(
        "R1", verdict.state, (x, y), turn, verdict.probability, view, visible=visible,
        reason=verdict.reason, covariance=covariance,
    )  # fmt: skip


def both(*findings: Finding) -> Finding:
    return fused(findings, TOLERANCE, CONFIG)


def test_one_view_speaks_for_itself() -> None:
    alone = seen(0.3 * MM)
    assert both(alone) is alone
    assert alone.state == "shifted"


def test_the_surer_view_counts_more() -> None:
    """The mean, weighed by information, is surer than either."""
    a = seen(0.00 * MM, turn=1 * DEG, sigmas=(30e-6, 30e-6, 1 * DEG))
    b = seen(0.09 * MM, turn=3 * DEG, sigmas=(60e-6, 60e-6, 2 * DEG), view="B", visible=0.9)
    found = both(a, b)
    assert found.view == "A"
    assert found.shift[0] == pytest.approx(0.09 * MM * 1000 / (1000 + 3700), rel=1e-6)
    assert found.rotation == pytest.approx((1 + 2 * 1.01 / 5.02) * DEG, rel=1e-6)
    assert found.covariance is not None
    assert found.covariance[0, 0] == pytest.approx(1 / (1 / 1000e-12 + 1 / 3700e-12))


def test_two_doubtful_views_are_sure_together() -> None:
    """Each is turned by more than is allowed, and too unsure to be called."""
    a, b = seen(turn=7.34 * DEG), seen(turn=7.38 * DEG, view="B")
    assert {a.state, b.state} == {"present"}
    found = both(a, b)
    assert found.state == "rotated"
    assert found.reason == "turned by 7.4 deg, 5.0 deg are accepted"
    assert found.confidence > 0.95


def test_a_false_turn_is_taken_back() -> None:
    a, b = seen(turn=8.5 * DEG), seen(turn=1 * DEG, view="B")
    assert a.state == "rotated"
    assert both(a, b).state == "present"


def test_a_view_that_disagrees_is_not_asked() -> None:
    """As where it matched something else; nor is one that hardly shows the part."""
    best = seen(0.05 * MM)
    assert both(best, seen(0.4 * MM, view="B", visible=0.9)) is best
    assert both(best, seen(0.06 * MM, view="B", visible=0.4)) is best
    wrong = Finding("R1", "wrong_part", view="B", visible=0.9)
    assert both(best, wrong) is best
    assert both(replace(wrong, visible=1.1), best).state == "wrong_part"


def test_two_faults_do_not_make_a_good_part() -> None:
    """A little too far in one view, turned a little too far in another: the mean would be allowed,
    but what was found elsewhere was fitted with indulgence.
    """
    sigmas = (20e-6, 20e-6, 0.5 * DEG)
    a = seen(0.203 * MM, turn=4.9 * DEG, sigmas=sigmas)
    b = seen(0.196 * MM, turn=5.05 * DEG, sigmas=sigmas, view="B")
    assert (a.state, b.state) == ("shifted", "rotated")
    assert both(a, b) is a
    assert both(a, replace(b, state="present")).state == "present"


def test_turns_are_taken_the_shorter_way() -> None:
    a, b = seen(turn=179 * DEG), seen(turn=-179 * DEG, view="B")
    found = both(a, b)
    assert abs(found.rotation) == pytest.approx(np.pi, abs=1e-6)
    assert found.covariance is not None
    assert a.covariance is not None
    assert found.covariance[2, 2] < 0.6 * a.covariance[2, 2]


def test_a_view_that_shows_the_other_way_round_is_believed() -> None:
    turned = Finding("J1", "rotated", rotation=np.pi, confidence=0.99, view="B", visible=0.7)
    assert both(seen(), turned) is turned
    assert both(seen(), replace(turned, visible=0.3)).state == "present"
    assert both(replace(seen(0.5 * MM)), turned).state == "shifted"


@given(
    st.lists(st.tuples(*[st.floats(-0.1, 0.1)] * 2, st.floats(-4, 4)), min_size=2, max_size=4),
    st.permutations(range(4)),
)
def test_it_lies_between_and_does_not_depend_on_the_order(
    places: list[tuple[float, float, float]], order: list[int]
) -> None:
    views = [
        seen(x * MM, y * MM, turn * DEG, f"V{n}", visible=1 - 0.1 * n)
        for n, (x, y, turn) in enumerate(places)
    ]
    found = both(*views)
    assert min(p[0] for p in places) * MM - 1e-9 <= found.shift[0]
    assert found.shift[0] <= max(p[0] for p in places) * MM + 1e-9
    again = both(*[views[k] for k in order if k < len(views)])
    assert again.shift == pytest.approx(found.shift, abs=1e-12)
    assert again.state == found.state


# ---- what a place means -------------------------------------------------------------------------


def test_of_two_faults_the_larger_is_named() -> None:
    sure = np.diag([1e-12, 1e-12, 1e-8])
    assert located((0.3 * MM, 0), 20 * DEG, sure, TOLERANCE, CONFIG).state == "rotated"
    assert located((0.9 * MM, 0), 6 * DEG, sure, TOLERANCE, CONFIG).state == "shifted"


def test_a_sure_turn_is_named_beside_an_unsure_shift() -> None:
    covariance = np.diag([(0.1 * MM) ** 2, (0.1 * MM) ** 2, (0.1 * DEG) ** 2])
    found = located((0.25 * MM, 0), 5.5 * DEG, covariance, TOLERANCE, CONFIG)
    assert found.state == "rotated"
    assert found.elsewhere
