import pytest

from aoicell.benchmark.sources import SOURCES, all_but, only
from aoicell.sim.profiles import PAPER
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
