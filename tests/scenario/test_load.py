"""Reading files: the shipped ones, what overrides do, any file at all, and what is written back."""

import random
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from aoicell.errors import ScenarioError
from aoicell.nominal import Nominal, load_nominal
from aoicell.resources import available, data_root, find
from aoicell.scenario import Scenario, cases_of, load_scenario
from aoicell.sim.profiles import PROFILES
from aoicell.sim.sources import SOURCES
from scenario.mutations import mutated
from scenario.written import NAME, RICH, SWEPT, complaint, load

SHIPPED = available("scenarios")


# -- What is read -------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_scenario_loads(name: str) -> None:
    scenario = load_scenario(find("scenarios", name))
    assert scenario.name == name
    for case in cases_of(scenario):
        assert case.scenario.cell_folder == (data_root() / "cell").resolve()


def test_the_papers_two_tests() -> None:
    scenario = load_scenario(find("scenarios", "two_tests"))
    assert scenario.displacement.shift_mm == [49.1, 50.6]
    assert scenario.profile == "paper"
    assert scenario.methods == ["paper", "aoicell_one_look", "aoicell"]
    assert scenario.trials == 2
    assert scenario.tolerances == PROFILES["paper"]


def test_the_cell_is_relative_to_the_file(tmp_path: Path, second_cell: Nominal) -> None:
    (tmp_path / "cells").symlink_to(second_cell.folder.parent)
    scenario = load(tmp_path, NAME + f'cell = "cells/{second_cell.folder.name}"')
    assert scenario.cell_folder == second_cell.folder.resolve()
    assert load_nominal(scenario.cell_folder).board.markers


def test_overrides_replace_keys_unless_they_are_none(tmp_path: Path) -> None:
    scenario = load(tmp_path, NAME + "seed = 3\nworlds = 2", seed=7, profile="ideal", worlds=None)
    assert (scenario.seed, scenario.profile, scenario.worlds) == (7, "ideal", 2)


def test_a_bad_override_names_the_key(tmp_path: Path) -> None:
    message = complaint(tmp_path, NAME, trials_per_world=0)
    assert message.startswith("'trials_per_world' = 0: give an integer from 1")


def test_an_override_that_a_sweep_would_undo_is_refused(tmp_path: Path) -> None:
    message = complaint(tmp_path, NAME + "sweep.seed = [1, 2]", seed=7)
    assert message.startswith("'seed' = 7: it would replace nothing, for 'sweep.seed' gives the")


# -- What is refused ----------------------------------------------------------------------


@pytest.mark.parametrize("cell", ["nowhere", "\x00", "a\nb", "x" * 5000, "loop"])
def test_a_folder_without_a_cell_is_named(tmp_path: Path, cell: str) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    message = complaint(tmp_path, tomli_w.dumps({"name": "x", "cell": cell}))
    assert message.startswith(f"'cell' = {repr(cell)[:40]}")
    assert (
        f"there is no nominal.toml in it; name a cell's folder, relative to {tmp_path}" in message
    )


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.toml", tmp_path):
        with pytest.raises(ScenarioError, match=f"^{path}: no such scenario file$"):
            load_scenario(path)


@pytest.mark.parametrize(
    "data",
    [b'name = "\xff"', b"seed =", b"seed = " + b"9" * 5000, b"x = " + b"[" * 9999, b"\x00"],
)
def test_what_is_no_toml_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "s.toml"
    path.write_bytes(data)
    with pytest.raises(ScenarioError, match=f"^{path}: not valid TOML"):
        load_scenario(path)


# -- Any file at all ----------------------------------------------------------------------


def check(path: Path, data: bytes) -> str:
    """What became of a file: 'loads', or what it is complained of. All else escapes."""
    path.unlink(missing_ok=True)  # several times as fast as to overwrite
    path.write_bytes(data)
    try:
        scenario = load_scenario(path)
    except ScenarioError as error:
        message = str(error)
        assert message.startswith(f"{path}: ")
        assert len(message.splitlines()) == 1
        assert message.isprintable()
        assert "list[" not in message  # pydantic's names are not the file's
        return "no TOML" if ": not valid TOML" in message else "complaint"
    cases = cases_of(scenario)
    assert [case.index for case in cases] == list(range(len(cases)))
    assert len({(case.kind, case.label) for case in cases}) == len(cases) > 0
    assert all(case.scenario.name == scenario.name for case in cases)
    assert all(case.label.isprintable() for case in cases)
    if len(cases) < 30:
        assert all(case.scenario.tolerances for case in cases)
    return "loads"


def test_no_damaged_file_brings_the_loader_down(folder: Path) -> None:
    sources = [find("scenarios", name).read_text(encoding="utf-8") for name in SHIPPED]
    sources += [RICH, RICH, SWEPT]
    rng = random.Random(4071)
    seen = Counter(
        check(folder / "s.toml", mutated(rng, sources[index % len(sources)]))
        for index in range(2400)
    )
    assert seen.total() == 2400
    assert min(seen[kind] for kind in ("loads", "complaint", "no TOML")) > 200, seen


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=40))
def test_any_bytes_are_a_scenario_or_one_sentence(folder: Path, data: bytes) -> None:
    check(folder / "s.toml", NAME.encode() + data)


# -- What is written back -----------------------------------------------------------------

texts = st.text(st.characters(blacklist_categories=("Cs",)), max_size=12)
ranges = st.tuples(st.floats(0, 10), st.floats(0, 10)).map(
    lambda ends: {"min": min(ends), "max": max(ends)}
)
knobs = st.dictionaries(
    st.sampled_from(["k1", "marker_mm", "mount_bias_x_mm"]), st.floats(0, 0.5), max_size=2
)
changes = st.fixed_dictionaries(
    {},
    optional={
        "title": texts,
        "seed": st.integers(0, 2**32 - 1),
        "cell": st.sampled_from(["../cell", ""]),
        "profile": st.sampled_from(list(PROFILES)),
        "tolerance_mm": st.floats(1e-3, 1e3),
        "displacement": st.fixed_dictionaries({}, optional={"turn_deg": ranges}),
        "knobs": knobs,
    },
)
sources = st.just("each source") | st.lists(st.sampled_from([*SOURCES, "k1"]), unique=True)


def swept(changes: dict[str, Any]) -> dict[str, Any]:
    """A sweep over the keys of `changes`."""
    return {
        key: swept(value) if isinstance(value, dict) and "min" not in value else [value]
        for key, value in changes.items()
        if value != {}
    }


several = st.one_of(
    changes.map(lambda table: {"sweep": swept(table)}),
    st.fixed_dictionaries(
        {},
        optional={
            "cases": st.dictionaries(
                texts.filter(lambda t: t.strip() and t.isprintable()), changes
            ),
            "ablate": sources,
            "isolate": sources,
        },
    ),
)
scenarios = st.builds(
    lambda top, change, several: {**top, **change, **several},
    st.fixed_dictionaries(
        {"name": st.from_regex(r"[A-Za-z0-9_\-]+", fullmatch=True)},
        optional={
            "worlds": st.integers(1, 10_000),
            "methods": st.permutations(["paper", "aoicell"]),
            "store": st.fixed_dictionaries({}, optional={"images": st.booleans()}),
            "displacement": st.fixed_dictionaries(
                {"shift_mm": st.lists(st.floats(0, 300), min_size=2, max_size=2) | ranges}
            ),
        },
    ),
    changes,
    several,
)


@settings(max_examples=60, suppress_health_check=list(HealthCheck))
@given(content=scenarios)
def test_what_is_written_reads_back_the_same(folder: Path, content: dict[str, Any]) -> None:
    try:
        scenario = load(folder, tomli_w.dumps(content))
    except ScenarioError as error:
        assume("is off in profile" not in str(error))
        raise
    text = scenario.to_toml()
    again = load(folder, text)
    assert again == scenario
    assert cases_of(again) == cases_of(scenario)
    assert set(tomllib.loads(text)) == set(Scenario.model_fields)
