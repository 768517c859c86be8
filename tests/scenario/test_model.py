"""What a scenario says, and what it refuses to say."""

import tomllib
from pathlib import Path

import pytest

from aoicell.resources import data_root
from aoicell.scenario import Scenario, ShiftRange, TurnRange, scenario_schema
from aoicell.sim.profiles import PROFILES
from aoicell.sim.sources import SOURCES
from aoicell.sim.tolerances import Tolerances
from scenario.written import NAME, RICH, complaint, load


def test_a_name_is_enough(tmp_path: Path) -> None:
    scenario = load(tmp_path, NAME)
    assert scenario.displacement.shift_mm == ShiftRange(min=20, max=60)
    assert scenario.displacement.turn_deg == TurnRange(min=-15, max=15)
    assert scenario.cell_folder == data_root() / "cell"
    assert scenario.profile == "typical"


def test_the_rich_file_uses_every_key_but_one() -> None:
    assert {*tomllib.loads(RICH), "sweep"} == set(Scenario.model_fields)


def test_knobs_change_the_profile_and_nothing_else(tmp_path: Path) -> None:
    scenario = load(tmp_path, NAME + 'profile = "paper"\n[knobs]\nmarker_mm = 0.25\nk1 = -0.2')
    changes = {"marker_mm": 0.25, "k1": -0.2}
    assert scenario.tolerances == PROFILES["paper"].model_copy(update=changes)


def test_trials_are_those_of_one_case(folder: Path) -> None:
    assert load(folder, RICH).trials == 3 * 2


def test_a_scenario_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Scenario(name="x").seed = 3  # type: ignore[misc]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('methods = ["paper", "paper"]', "'methods' = ['paper', 'paper']: 'paper' stands there"),
        ('ablate = ["gravity", "gravity"]', "'gravity' stands there twice; name each once"),
        ("[displacement]\nshift_mm = { min = -5, max = 3 }", "'displacement.shift_mm.min' = -5: "),
        ("[displacement]\nshift_mm = { min = 0, max = 1e9 }", "give a number from 0 to 300"),
        ("[displacement]\nlift_mm = { min = -1e308, max = 1e308 }", "from -50 to 50"),
        ("[displacement]\nturn_deg = { min = 0, max = 1e5 }", "from -180 to 180"),
        ("[displacement]\ntilt_deg = { min = 0, max = 46 }", "from -45 to 45"),
        (
            "[displacement]\nlift_mm = { min = 30, max = 40 }",
            "lift_mm exceeds the smallest shift_mm (20.0), which contains it",
        ),
        (
            "[displacement]\nshift_mm = [30, 10]\nlift_mm = { min = -15, max = 0 }",
            "lift_mm exceeds the smallest shift_mm (10.0), which contains it",
        ),
        (
            "[displacement]\nturn_deg = { min = 3, max = 1 }",
            "'displacement.turn_deg' = {'min': 3, 'max': 1}: max (1.0) is below min (3.0)",
        ),
        (
            "[displacement]\nshift_mm = [1, 2, 3]",
            "'displacement.shift_mm' lists 3 distances for trials_per_world = 2; give one a trial, "
            "or a range",
        ),
        ("[knobs]\nadc_bits = 9.5", "'knobs.adc_bits' = 9.5: a converter has 8 to 12 whole bits"),
        ('[cases."\\n"]', "the name '\\n' of a case cannot be printed"),
        ('[cases.""]', "the name '' of a case cannot be printed"),
        ("[sweep]\n" + "a." * 500 + "a = [1]", "no key of a scenario lies that deep"),
        ("[cases.x]\n" + "a." * 500 + "a = 1", "no key of a scenario lies that deep"),
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    assert expected in complaint(tmp_path, NAME + text)


def test_the_schema_offers_what_is_legal() -> None:
    schema = scenario_schema()
    keys = schema["properties"]
    assert set(keys) == set(Scenario.model_fields)
    assert keys["profile"]["enum"] == list(PROFILES)
    assert set(keys["knobs"]["properties"]) == set(Tolerances.model_fields)
    listed, every = keys["ablate"]["oneOf"]
    assert {*SOURCES, *Tolerances.model_fields} == set(listed["items"]["enum"])
    assert every["const"] == "each source"
    assert (keys["seed"]["minimum"], keys["seed"]["maximum"]) == (0, 2**32 - 1)


@pytest.mark.parametrize("also", ["", "visit = false\npictures = false\n"])
def test_what_goes_wrong_needs_pictures_and_no_visit(tmp_path: Path, also: str) -> None:
    message = complaint(tmp_path, NAME + also + 'inject = ["glare"]')
    assert message == "'inject' goes with visit = false and pictures = true"
