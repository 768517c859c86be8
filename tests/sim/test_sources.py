"""Error sources: every knob has its place, and a profile is taken apart without a rest."""

import pytest

from aoicell.sim.profiles import IDEAL, PAPER
from aoicell.sim.sources import SOURCES, all_but, is_on, knobs_of, only
from aoicell.sim.tolerances import Tolerances


def test_every_knob_belongs_to_exactly_one_source() -> None:
    knobs = [knob for group in SOURCES.values() for knob in group]
    assert sorted(knobs) == sorted(Tolerances.model_fields)


@pytest.mark.parametrize("source", SOURCES)
def test_alone_and_without_share_the_profile_between_them(source: str) -> None:
    alone, without = only(PAPER, source), all_but(PAPER, source)
    for knob in Tolerances.model_fields:
        own = knob in SOURCES[source]
        assert getattr(alone, knob) == (getattr(PAPER, knob) if own else 0)
        assert getattr(without, knob) == (0 if own else getattr(PAPER, knob))


def test_a_knob_is_a_source_of_its_own() -> None:
    assert knobs_of("print_um") == ("print_um",)
    assert only(PAPER, "print_um") == Tolerances(print_um=PAPER.print_um)
    assert all_but(PAPER, "print_um").print_um == 0


@pytest.mark.parametrize("source", [*SOURCES, "k1"])
def test_a_source_is_on_where_any_of_its_knobs_is(source: str) -> None:
    assert is_on(PAPER, source)  # k1 is negative there
    assert not is_on(IDEAL, source)
    for knob in knobs_of(source):
        assert is_on(only(PAPER, knob), source) == (getattr(PAPER, knob) != 0)
