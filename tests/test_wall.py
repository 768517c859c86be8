"""Nothing that estimates may see the truth: all went through a fence, and holds no world."""

import gc
from collections.abc import Iterable
from types import FunctionType, ModuleType
from typing import Any

import pytest
from helpers.fence import PROTOCOL, fenced
from helpers.running import Rehearsal

from aoicell.online import look, relocate, visit
from aoicell.pipeline import METHODS
from aoicell.sim.as_built import AsBuilt
from aoicell.sim.cell import SimCell
from aoicell.sim.world import Truth, World

pytest_plugins = ["helpers.sessions"]


CODE = (type, ModuleType, FunctionType)


def reachable(roots: Iterable[Any]) -> list[Any]:
    """Everything that can be got at from some objects, code and modules apart."""
    seen: dict[int, Any] = {}
    pending = list(roots)
    while pending:
        thing = pending.pop()
        if id(thing) in seen or issubclass(type(thing), CODE):
            continue
        seen[id(thing)] = thing
        pending += gc.get_referents(thing)
    return list(seen.values())


@pytest.mark.parametrize("name", ["_world", "__dict__", "__class__", "world", "data", "truth"])
def test_the_fence_lets_nothing_through(ideal_world: World, name: str) -> None:
    cell = fenced(SimCell(ideal_world))
    with pytest.raises(AssertionError, match="not in the protocol"):
        getattr(cell, name)


def test_what_the_fence_hands_out_is_no_way_in(ideal_world: World) -> None:
    cell = fenced(SimCell(ideal_world))
    for name in PROTOCOL:
        assert not hasattr(getattr(cell, name), "__self__")


@pytest.mark.parametrize("method", [name for name in METHODS if name != "uncorrected"])
def test_the_whole_procedure_runs_on_the_protocol_alone(
    ideal_rehearsal: Rehearsal, method: str
) -> None:
    """Calibration and teaching ran behind the fence in the fixture; here is the rest."""
    session = ideal_rehearsal.session
    online = session.online(method)
    correction = relocate(look(session.cell, online), online)
    assert correction.shift_mm < 0.2  # the board was not moved
    visited = visit(session.cell, correction, online)
    assert set(visited.images) == {view.id for view in online.template.views}


def test_no_estimate_holds_the_truth(ideal_rehearsal: Rehearsal) -> None:
    session = ideal_rehearsal.session
    estimates = (
        session.calibrations, session.templates, session.taught, ideal_rehearsal.pictures,
        session.nominal,
    )  # fmt: skip
    found = reachable(estimates)
    assert len(found) > 100
    assert not [x for x in found if issubclass(type(x), (World, Truth, AsBuilt, SimCell))]


def test_the_search_would_find_it(ideal_rehearsal: Rehearsal) -> None:
    assert any(issubclass(type(x), World) for x in reachable([[{"a": ideal_rehearsal.session}]]))
