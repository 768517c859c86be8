"""Scenario files: what is read, and that every complaint is one clear sentence."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.errors import ScenarioError
from aoicell.nominal import load_nominal
from aoicell.resources import available, data_root, find
from aoicell.scenario import Scenario, ShiftRange, TurnRange, load_scenario
from aoicell.sim.profiles import PROFILES
from aoicell.sim.tolerances import Tolerances

NAME = 'name = "x"\n'


def load(folder: Path, text: str, **overrides: Any) -> Scenario:
    path = folder / "s.toml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path, **overrides)


def complaint(folder: Path, text: str) -> str:
    with pytest.raises(ScenarioError) as caught:
        load(folder, text)
    message = str(caught.value)
    assert message.startswith(f"{folder / 's.toml'}: ")
    assert "\n" not in message
    return message.removeprefix(f"{folder / 's.toml'}: ")


# -- What is read ----------------------------------------------------------


@pytest.mark.parametrize("name", available("scenarios"))
def test_every_shipped_scenario_loads(name: str) -> None:
    scenario = load_scenario(find("scenarios", name))
    assert scenario.name == name
    assert load_nominal(scenario.cell_folder).board.markers


def test_the_papers_two_tests() -> None:
    scenario = load_scenario(find("scenarios", "two_tests"))
    assert scenario.displacement.shift_mm == [49.1, 50.6]
    assert scenario.profile == "paper"
    assert scenario.methods == ["paper", "aoicell"]
    assert scenario.trials == 2
    assert scenario.tolerances == PROFILES["paper"]


def test_a_name_is_enough(tmp_path: Path) -> None:
    scenario = load(tmp_path, NAME)
    assert scenario.displacement.shift_mm == ShiftRange(min=20, max=60)
    assert scenario.displacement.turn_deg == TurnRange(min=-15, max=15)
    assert scenario.cell_folder == data_root() / "cell"
    assert scenario.profile == "typical"


def test_knobs_change_the_profile_and_nothing_else(tmp_path: Path) -> None:
    scenario = load(tmp_path, NAME + 'profile = "paper"\n[knobs]\nmarker_mm = 0.25\nk1 = -0.2')
    changes = {"marker_mm": 0.25, "k1": -0.2}
    assert scenario.tolerances == PROFILES["paper"].model_copy(update=changes)


def test_overrides_replace_keys_unless_they_are_none(tmp_path: Path) -> None:
    scenario = load(tmp_path, NAME + "seed = 3\nworlds = 2", seed=7, profile="ideal", worlds=None)
    assert (scenario.seed, scenario.profile, scenario.worlds) == (7, "ideal", 2)


def test_the_cell_is_relative_to_the_file(tmp_path: Path, second_cell: Any) -> None:
    (tmp_path / "cells").symlink_to(second_cell.folder.parent)
    scenario = load(tmp_path, NAME + f'cell = "cells/{second_cell.folder.name}"')
    assert scenario.cell_folder == second_cell.folder.resolve()


def test_a_scenario_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Scenario(name="x").seed = 3  # type: ignore[misc]


# -- What is refused ----------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # misspelt
        (NAME + "sede = 1", "unknown key 'sede'; did you mean 'seed'?"),
        (NAME + "[store]\nimage = true", "unknown key 'store.image'; did you mean 'images'?"),
        (
            NAME + "[displacement]\nturn_dg = { min = 0, max = 1 }",
            "unknown key 'displacement.turn_dg'; did you mean 'turn_deg'?",
        ),
        (NAME + 'profile = "idael"', "profile 'idael': did you mean 'ideal'?"),
        (NAME + 'profile = "zzz"', "profile 'zzz': known: ideal, paper, typical"),
        (NAME + "[knobs]\nmarker_m = 1", "knobs.marker_m: did you mean 'marker_mm'?"),
        (NAME + 'methods = ["papr"]', "'methods.0' = 'papr': input should be 'paper' or 'aoicell'"),
        # wrong type
        (NAME + "profile = 3", "'profile' = 3: input should be a valid string"),
        (NAME + "cell = 3", "'cell' = 3: input should be a valid string"),
        (NAME + "seed = 1.5", "'seed' = 1.5: input should be a valid integer"),
        (NAME + 'seed = "many"', "'seed' = 'many': input should be a valid integer"),
        (NAME + "store = 3", "'store' = 3: input should be a valid"),
        (NAME + "[displacement]\nturn_deg = 3", "'displacement.turn_deg' = 3: input should be"),
        (NAME + '[knobs]\nk1 = "big"', "'knobs.k1' = 'big': input should be a valid number"),
        ("name = 3", "'name' = 3: input should be a valid string"),
        ('name = "a b"', "'name' = 'a b': "),
        # out of range
        (NAME + "seed = -1", "'seed' = -1: input should be greater than or equal to 0"),
        (NAME + "worlds = 0", "'worlds' = 0: input should be greater than or equal to 1"),
        (NAME + "trials_per_world = 0", "'trials_per_world' = 0: input should be greater than or"),
        (NAME + "methods = []", "'methods' = []: list should have at least 1 item"),
        (NAME + "tolerance_mm = nan", "'tolerance_mm' = nan: input should be "),
        (NAME + "tolerance_mm = -2", "'tolerance_mm' = -2: input should be greater than or equal"),
        (NAME + "[knobs]\njoint_zero_deg = nan", "joint_zero_deg' = nan: input should be a finite"),
        (NAME + "[knobs]\njoint_zero_deg = -1", "joint_zero_deg' = -1.0: input should be greater"),
        (NAME + "[knobs]\nk1 = 7", "k1' = 7.0: input should be less than or equal to 0.5"),
        (
            NAME + "[displacement]\nturn_deg = { min = 3, max = 1 }",
            "'displacement.turn_deg' = {'min': 3, 'max': 1}: max (1.0) is below min (3.0)",
        ),
        (
            NAME + "[displacement]\nturn_deg = { min = nan, max = 1 }",
            "'displacement.turn_deg.min' = nan: input should be a finite number",
        ),
        (
            NAME + "[displacement]\nshift_mm = [1, 2, 3]",
            "displacement.shift_mm lists 3 distances for trials_per_world = 2; give one a trial",
        ),
        # no such thing
        (NAME + 'cell = "nowhere"', "'cell' = 'nowhere': there is no nominal.toml in"),
        (NAME + "seed =", "not valid TOML ("),
    ],
)
def test_bad_input_is_named_with_what_would_be_right(
    tmp_path: Path, text: str, expected: str
) -> None:
    assert expected in complaint(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (NAME + "[displacement]\nshift_mm = [-1, 3]", "'displacement.shift_mm.0' = -1"),
        (NAME + "[displacement]\nshift_mm = [nan, 3]", "'displacement.shift_mm.0' = nan"),
        (
            NAME + "[displacement]\nshift_mm = { min = nan, max = 3 }",
            "'displacement.shift_mm.min' = nan",
        ),
        (
            NAME + "[displacement]\nshift_mm = { mn = 1, max = 3 }",
            "'displacement.shift_mm.mn'; did you mean 'min'?",
        ),
        (NAME + "[displacement]\nshift_mm = 3", "'displacement.shift_mm' = 3"),
        (NAME + "[knobs]\njoint_zero_deg = -1", "'knobs.joint_zero_deg' = -1"),
        ('nam = "x"', "did you mean 'name'?"),
        (
            NAME + "[displacement]\nturn_deg = { min = 0, mx = 1 }",
            "'displacement.turn_deg.mx'; did you mean 'max'?",
        ),
    ],
)
def test_the_path_of_the_key_is_that_of_the_file(tmp_path: Path, text: str, expected: str) -> None:
    message = complaint(tmp_path, text)
    assert expected in message
    assert "constrained" not in message


@pytest.mark.parametrize(
    "text",
    [
        NAME + 'seed = "3"',
        NAME + "seed = true",
        NAME + "[knobs]\nmarker_mm = true",
        NAME + 'methods = ["paper", "paper"]',
        NAME + "[displacement]\nshift_mm = { min = -5, max = 3 }",
        NAME + "[displacement]\nshift_mm = { min = 0, max = 1e9 }",
        NAME + "[displacement]\nlift_mm = { min = -1e308, max = 1e308 }",
        NAME + "[displacement]\nturn_deg = { min = 0, max = 1e5 }",
        NAME + "[displacement]\nlift_mm = { min = 100, max = 200 }",  # more than the shift
    ],
)
def test_what_makes_no_sense_is_refused(tmp_path: Path, text: str) -> None:
    complaint(tmp_path, text)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(ScenarioError, match=f"^{path}: no such scenario file$"):
            load_scenario(path)


def test_a_file_in_another_encoding_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(b'name = "\xff"')
    with pytest.raises(ScenarioError, match="not valid TOML"):
        load_scenario(path)


def test_a_bad_override_names_the_key(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="'trials_per_world' = 0"):
        load(tmp_path, NAME, trials_per_world=0)


# -- Anything at all ----------------------------------------------------------

scalars = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(),
    st.text(st.characters(blacklist_categories=("Cs",)), max_size=8),
    st.sampled_from(["paper", "aoicell", "ideal", "typical"]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(st.sampled_from(["min", "max", "x"]), inner, max_size=3),
    ),
    max_leaves=5,
)
keys = st.sampled_from([*Scenario.model_fields, "sede", "", "a.b", "ü"])
inner_keys = st.sampled_from(
    ["shift_mm", "turn_deg", "lift_mm", "tilt_deg", "images", "colour", *Tolerances.model_fields]
)
files = st.builds(
    lambda top, tables: {"name": "x", **top, **tables},
    st.dictionaries(keys, values, max_size=3),
    st.dictionaries(
        st.sampled_from(["displacement", "store", "knobs"]),
        st.dictionaries(inner_keys, values, max_size=3),
        max_size=2,
    ),
)


def scenario_or_complaint(path: Path, content: bytes) -> Scenario | str:
    """Anything but a ScenarioError escapes."""
    path.write_bytes(content)
    try:
        return load_scenario(path)
    except ScenarioError as error:
        return str(error)


@settings(max_examples=250, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=files)
def test_any_table_is_a_scenario_or_one_sentence(tmp_path: Path, content: dict[str, Any]) -> None:
    text = tomli_w.dumps(content)
    result = scenario_or_complaint(tmp_path / "s.toml", text.encode())
    assert isinstance(result, Scenario) or result.startswith(str(tmp_path))


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=40))
def test_any_file_is_a_scenario_or_one_sentence(tmp_path: Path, data: bytes) -> None:
    result = scenario_or_complaint(tmp_path / "s.toml", NAME.encode() + data)
    assert isinstance(result, Scenario) or result.startswith(str(tmp_path))


ranges = st.tuples(st.floats(0, 10), st.floats(0, 10)).map(
    lambda ends: {"min": min(ends), "max": max(ends)}
)
scenarios = st.fixed_dictionaries(
    {"name": st.from_regex(r"[A-Za-z0-9_\-]+", fullmatch=True)},
    optional={
        "title": st.text(st.characters(blacklist_categories=("Cs",)), max_size=12),
        "profile": st.sampled_from(list(PROFILES)),
        "seed": st.integers(0, 2**32 - 1),
        "worlds": st.integers(1, 10_000),
        "tolerance_mm": st.floats(1e-3, 1e3),
        "methods": st.permutations(["paper", "aoicell"]),
        "displacement": st.fixed_dictionaries(
            {},
            optional={
                "shift_mm": st.one_of(
                    st.tuples(st.floats(0, 300)).map(lambda s: [*s, 1.5]), ranges
                ),
                "turn_deg": ranges,
            },
        ),
        "knobs": st.dictionaries(
            st.sampled_from(["k1", "marker_mm", "mount_bias_x_mm"]), st.floats(0, 0.5), max_size=2
        ),
        "store": st.fixed_dictionaries({}, optional={"images": st.booleans()}),
    },
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=scenarios)
def test_what_is_written_reads_back_the_same(tmp_path: Path, content: dict[str, Any]) -> None:
    scenario = load(tmp_path, tomli_w.dumps(content))
    text = scenario.to_toml()
    assert load(tmp_path, text) == scenario
    assert set(tomllib.loads(text)) == set(Scenario.model_fields)
