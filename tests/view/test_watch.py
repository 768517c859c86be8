"""A watched trial is a trial: same results, and the window shows what they rest on."""

import sys
from collections.abc import Callable
from dataclasses import replace

import pytest

from aoicell.benchmark.trial import prepare, run_trial
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.scenario import Scenario
from aoicell.transforms import SE3, distance_deg, distance_mm
from aoicell.view import watch
from aoicell.view.shown import Shown

FAST = 1e9
SCENARIO = Scenario(name="quick", profile="ideal", pictures=False, trials_per_world=3, worlds=2)


def ignore(_: str) -> None:
    pass


@pytest.mark.parametrize("only", [-1, 6])
def test_a_trial_that_is_not_there_is_refused(only: int) -> None:
    pytest.importorskip("viser")
    with pytest.raises(InputError, match=f"--only {only}.*0 to 5"):
        watch(SCENARIO, ignore, only=only)


def test_no_speed_is_refused() -> None:
    with pytest.raises(InputError, match="--speed 0"):
        watch(SCENARIO, ignore, speed=0)


def test_without_the_extra_the_command_for_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    monkeypatch.delitem(sys.modules, "aoicell.view.window", raising=False)
    with pytest.raises(InputError, match=r'viser is not installed.*pip install "aoicell\[view\]"'):
        watch(SCENARIO, ignore)


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[Shown]:
    """All that windows are given to show."""
    window = pytest.importorskip("aoicell.view.window", reason="the extra 'view' is not installed")
    seen: list[Shown] = []
    show: Callable[..., None] = window.Window.show

    def note(self: object, what: Shown) -> None:
        seen.append(what)
        show(self, what)

    monkeypatch.setattr(window.Window, "show", note)
    return seen


def test_watching_changes_no_result(nominal: Nominal, shown: list[Shown]) -> None:
    scenario = SCENARIO.model_copy(update={"profile": "paper"})
    records = watch(scenario, ignore, only=4, speed=FAST, once=True)
    session = prepare(scenario, nominal, world_index=1)
    expected = [result.record for result in run_trial(session, 1)]
    session.world.close()
    assert [record.method for record in records] == scenario.methods
    for watched, alone in zip(records, expected, strict=True):
        assert replace(watched, correction_seconds=alone.correction_seconds) == alone


Places = dict[tuple[str, bool], SE3]


def places(shown: Shown) -> Places:
    """T_world_frame by name, true (False) and estimated (True)."""
    return {(a.name, a.estimate): shown.Ts_world_body[a.body] * a.T_body_frame for a in shown.axes}


def test_in_an_ideal_cell_estimates_stand_on_the_truth(shown: list[Shown]) -> None:
    said: list[str] = []
    records = watch(SCENARIO, said.append, speed=FAST, once=True)
    assert [record.trial for record in records] == [0, 0, 0], "one trial, by all methods"
    assert said[0].startswith("http://127.0.0.1:")
    checked: set[str] = set()
    for placed in map(places, shown):
        for name in {name for name, estimate in placed if estimate}:
            assert distance_mm(placed[name, True], placed[name, False]) < 3.0, name
            assert distance_deg(placed[name, True], placed[name, False]) < 1.0, name
            checked.add(name)
    assert checked == {"flange", "camera", "tabletarget", "board", "M1", "M2", "M3", "M4"}
    moved = {tuple(placed["board", False].translation) for placed in map(places, shown)}
    assert len(moved) == 2, "the board is shown where it was taught and where it is now"
    rows = dict(shown[-1].rows)
    assert rows["phase"] == "finished"
    assert "mm" in rows["0 paper"]
    assert "mm" in rows["0 aoicell"]


def test_ctrl_c_ends_it_cleanly(monkeypatch: pytest.MonkeyPatch, shown: list[Shown]) -> None:
    from aoicell.view.window import Window

    def interrupted(_: Window) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Window, "wait_for_browser", interrupted)
    said: list[str] = []
    assert watch(SCENARIO, said.append, speed=FAST) == []
    assert said[-1] == "stopped"
