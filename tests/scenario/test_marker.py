"""A scenario may choose the board's markers."""

from pathlib import Path

import pytest

from aoicell.errors import ScenarioError
from aoicell.nominal import Nominal
from aoicell.scenario import cases_of, load_scenario
from aoicell.scenario.model import Scenario


def written(folder: Path, text: str) -> Path:
    path = folder / "s.toml"
    path.write_text('name = "markers"\n' + text)
    return path


def test_none_is_chosen(nominal: Nominal) -> None:
    assert Scenario(name="x").fitted(nominal) is nominal


def test_kind_size_and_pitch(tmp_path: Path, nominal: Nominal) -> None:
    text = '[marker]\nkind = "apriltag"\nsize_mm = 61\npitch_mm = 40\n'
    scenario = load_scenario(written(tmp_path, text))
    changed = scenario.fitted(nominal)
    assert {(m.kind, m.size, m.pitch) for m in changed.board.markers} == {
        ("apriltag", 0.061, 0.040)
    }
    assert load_scenario(written(tmp_path, scenario.to_toml().split("\n", 1)[1])) == scenario


def test_a_sweep_over_kinds_and_pitches(tmp_path: Path, nominal: Nominal) -> None:
    text = 'sweep.marker.kind = ["cross", "coded"]\nsweep.marker.pitch_mm = [24, 36, 60]\n'
    scenario = load_scenario(written(tmp_path, text + "marker.make_room = true\n"))
    markers = [case.scenario.fitted(nominal).marker for case in cases_of(scenario)]
    assert [round(2e3 * m.crosses.max()) for m in markers] == [24, 36, 60] * 2
    assert [round(1e3 * m.size) for m in markers] == [60, 60, 84] * 2


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('[marker]\nkind = "apritag"\n', "did you mean 'apriltag'"),
        ("[marker]\npitch_mm = -1\n", "marker.pitch_mm"),
        ("[marker]\nsize = 60\n", "marker.size"),
        ("[marker]\nsize_mm = inf\n", "marker.size_mm"),
    ],
)
def test_a_bad_choice_is_named(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(ScenarioError, match=expected):
        load_scenario(written(tmp_path, text))


def test_what_does_not_fit_the_board_is_a_bad_scenario(nominal: Nominal) -> None:
    scenario = Scenario(name="x", marker={"pitch_mm": 60.0})  # type: ignore[arg-type]
    with pytest.raises(ScenarioError, match=r"'marker': .*M1.* make_room = true"):
        scenario.fitted(nominal)
