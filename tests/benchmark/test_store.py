"""The run directory: what is written reads back the same."""

import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError
from aoicell.scenario import Scenario

from .records_by_hand import refused, stored, trial, view, world

SCENARIO = Scenario(
    name="x", title="Ünïcode", seed=3, knobs={"k1": -0.1}, methods=["paper", "aoicell"]
)


@pytest.fixture
def store(tmp_path: Path) -> RunStore:
    return stored(tmp_path / "deep" / "run", [], scenario=SCENARIO)


def add(store: RunStore, *records: TrialRecord) -> None:
    with store.writing() as writer:
        writer.add_trial(SCENARIO.seed, records)


def test_records_read_back_the_same(store: RunStore) -> None:
    trials = [
        trial(0, "aoicell", views=[view("V1", 1 / 3, (0.1, None)), view("V2", 2.0)]),
        refused(0),
        trial(1, "aoicell", T_base_board_now=np.random.default_rng(0).random((4, 4)).tolist()),
        trial(0, "aoicell", case=1, number=2),
    ]
    for record in reversed(trials):
        add(store, record)
    with store.writing() as writer:
        for one in (world(1), world(0), world(0)):
            writer.add_world(one)  # the same again is passed over
    again = RunStore(store.folder)
    assert list(again.trials()) == trials  # in order, whatever the order of arrival
    assert list(again.trials("method = ? AND trial = ?", "aoicell", 1)) == [trials[2]]
    assert again.worlds() == [world(0), world(1)]
    assert again.scenario() == SCENARIO
    assert again.read_json("environment.json") == {"python": "3"}


def test_the_columns_are_for_people_with_sql(store: RunStore) -> None:
    add(store, trial(views=[view("V1", 1.0, (1.0, 3.0)), view("V2", 2.0, (None,))]))
    add(store, refused(1))
    connection = sqlite3.connect(store.folder / "trials.sqlite")
    rows = connection.execute(
        "SELECT number, seed, outcome, reason, displacement_mm, residual_mm FROM trials"
    )
    assert list(rows) == [
        (0, 3, "corrected", "", 50.0, 1.5),
        (1, 3, "refused", "marker M1 is missing", 250.0, None),
    ]
    rows = connection.execute("SELECT view, residual_mm, y_mm, detected_px, true_px FROM views")
    assert list(rows) == [
        ("V1", 1.0, -0.48, 2.0, pytest.approx(1.9)),
        ("V2", 2.0, -0.96, None, 1.9),
    ]
    rows = connection.execute("SELECT view, marker, detected_px, true_px, image_mm FROM markers")
    assert list(rows) == [
        ("V1", "M2", 1.0, 1.9, 0.19),
        ("V1", "M3", 3.0, 1.9, pytest.approx(0.57)),
        ("V2", "M2", None, 1.9, None),
    ]
    connection.close()


def test_columns_are_arrays_and_null_is_no_number(store: RunStore) -> None:
    add(store, trial(views=[view("V1", 1.0), view("V2", 2.0)]), refused(0, "aoicell"))
    trials = store.columns("trials")
    assert list(trials["method"]) == ["aoicell", "paper"]
    np.testing.assert_array_equal(trials["residual_mm"], [np.nan, 1.5])
    assert "record" not in trials
    views = store.columns("views", ["view", "x_mm"])
    assert list(views) == ["view", "x_mm"]
    np.testing.assert_allclose(views["x_mm"], [0.36, 0.72])
    add(store, trial(1, views=[view("V1", 1.0, (None, 3.0))]))
    markers = store.columns("markers")
    assert list(zip(markers["trial"], markers["view"], markers["marker"], strict=True)) == [
        (0, "V1", "M2"), (0, "V2", "M2"), (1, "V1", "M2"), (1, "V1", "M3"),
    ]  # fmt: skip
    np.testing.assert_array_equal(markers["detected_px"], [2.0, 2.0, np.nan, 3.0])


def test_what_is_done_is_known_world_by_world(store: RunStore) -> None:
    add(store, trial(0), trial(0, "aoicell"))
    add(store, trial(3, world=1))
    assert store.trials_done(0, 0) == {0}
    assert store.trials_done(0, 1) == {3}
    assert store.trials_done(1, 0) == set()
    assert store.count_trials() == 2


def test_a_new_run_replaces_the_old_one(store: RunStore) -> None:
    add(store, trial())
    store.create(SCENARIO, {})
    assert list(store.trials()) == []
    add(store, trial())


def test_a_trial_is_kept_once_and_whole(store: RunStore) -> None:
    add(store, trial())
    with pytest.raises(sqlite3.IntegrityError):  # nothing of what comes with it, either
        add(store, trial(method="aoicell"), trial())
    assert list(store.trials()) == [trial()]
    assert list(store.columns("views")["method"]) == ["paper"]
    assert list(store.columns("markers")["method"]) == ["paper"]


def test_another_versions_tables_are_refused_to_readers_and_writers(store: RunStore) -> None:
    add(store, trial())
    with sqlite3.connect(store.folder / "trials.sqlite") as connection:
        connection.execute("DROP TABLE markers")
    connection.close()
    for use in (lambda: store.columns("markers"), lambda: add(store, trial(1))):
        with pytest.raises(InputError, match=r"run: its store has no table 'markers', so another"):
            use()
    assert store.count_trials() == 1


def test_another_versions_columns_are_refused(store: RunStore) -> None:
    with sqlite3.connect(store.folder / "trials.sqlite") as connection:
        connection.execute("ALTER TABLE views DROP COLUMN deg")
    connection.close()
    for use in (store.refuse_other_versions, lambda: add(store, trial())):
        with pytest.raises(InputError, match=r"run: its table 'views' differs in deg, so another"):
            use()
    assert store.count_trials() == 0


@pytest.mark.parametrize("read", [RunStore.trials, RunStore.worlds, RunStore.scenario])
def test_a_folder_that_is_no_run_is_refused(tmp_path: Path, read: Any) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        assert not RunStore(folder).exists
        with pytest.raises(InputError, match=str(folder)):
            list(read(RunStore(folder)))
    assert list(tmp_path.iterdir()) == []  # and reading leaves nothing behind


@pytest.mark.parametrize("case", ["no summary", "no database", "a file in the way"])
def test_a_damaged_run_is_refused(store: RunStore, tmp_path: Path, case: str) -> None:
    if case == "no database":
        (store.folder / "trials.sqlite").write_bytes(b"not a database" * 100)
    (tmp_path / "file").touch()
    use = {
        "no summary": lambda: store.read_json("summary.json"),
        "no database": lambda: list(store.trials()),
        "a file in the way": lambda: RunStore(tmp_path / "file").create(SCENARIO, {}),
    }
    with pytest.raises(InputError):
        use[case]()


def test_pictures_are_kept_under_names_of_their_own(store: RunStore) -> None:
    paths = {
        store.image_path(world, view, trial, method, case)
        for case in (0, 1)
        for world in (0, 1)
        for view in ("V1", "V2")
        for trial, method in ((None, ""), (0, "paper"), (0, "aoicell"), (1, "paper"))
    }
    assert len(paths) == 32
    for path in paths:
        store.add_image(path, b"png")
        assert path.read_bytes() == b"png"
    assert {path.name for path in store.images.iterdir()} == {path.name for path in paths}
