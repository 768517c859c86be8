"""Methods and markers that other packages bring."""

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from aoicell import methods, plugins
from aoicell.errors import InputError, ScenarioError
from aoicell.methods import find_method, method_names
from aoicell.pipeline import METHODS
from aoicell.plugins import load_plugin
from aoicell.targets.cross_marker import CrossMarker
from aoicell.targets.marker import make_marker, marker_kinds

POINTS = {
    "aoicell.methods": {
        "mine": "helpers.brought:MINE",
        "wrong": "helpers.brought:BigMarker",
        "gone": "no_such_package:METHOD",
    },
    "aoicell.markers": {"big": "helpers.brought:BigMarker"},
}


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if a package with these entry points were installed."""

    def found(group: str) -> dict[str, EntryPoint]:
        points = POINTS.get(group, {})
        return {name: EntryPoint(name, value, group) for name, value in points.items()}

    monkeypatch.setattr(plugins, "_found", found)
    load_plugin.cache_clear()


def test_our_own_methods_come_first_and_cannot_be_replaced() -> None:
    assert method_names() == [*METHODS, "gone", "mine", "wrong"]
    assert find_method("paper") is METHODS["paper"]


def test_a_method_of_another_package() -> None:
    assert find_method("mine").name == "mine"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("mien", "method 'mien': did you mean 'mine'?"),
        ("wrong", "is no aoicell.Method of that name"),
        ("gone", "'gone' of aoicell.methods (no_such_package:METHOD): it cannot be loaded"),
    ],
)
def test_what_is_no_method_is_named(name: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        find_method(name)
    assert expected in str(caught.value)


def test_a_marker_of_another_package() -> None:
    assert marker_kinds() == ["cross", "coded", "apriltag", "charuco", "big"]
    assert isinstance(make_marker("cross", 0.06, 0.036), CrossMarker)
    assert make_marker("big", 0.06, 0.036).size == pytest.approx(0.12)
    with pytest.raises(InputError, match="marker kind 'bgi': did you mean 'big'"):
        make_marker("bgi", 0.06, 0.036)


def test_an_unknown_method_in_a_scenario_is_a_bad_key(tmp_path: Path) -> None:
    from aoicell.scenario import load_scenario

    path = tmp_path / "s.toml"
    path.write_text('name = "x"\nmethods = ["papre"]\n')
    with pytest.raises(ScenarioError, match="did you mean 'paper'"):
        load_scenario(path)
    assert methods.GROUP == "aoicell.methods"
