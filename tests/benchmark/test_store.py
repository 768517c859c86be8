"""The run directory: what is written reads back the same."""

import sqlite3
from pathlib import Path

import cv2
import numpy as np
import pytest

from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.observation import Observation, RobotState
from aoicell.scenario import Scenario

from .records_by_hand import refused, trial, view, world

SCENARIO = Scenario(name="x", title="Ünïcode", seed=3, knobs={"k1": -0.1})


@pytest.fixture
def store(tmp_path: Path) -> RunStore:
    store = RunStore(tmp_path / "deep" / "run")
    store.create(SCENARIO, {"python": "3"})
    return store


def test_records_read_back_the_same(store: RunStore) -> None:
    trials = [
        trial(0, "aoicell", views=[view("V1", 1 / 3, (0.1, None)), view("V2", 2.0)]),
        refused(0),
        trial(1, "aoicell", T_base_board_now=np.random.default_rng(0).random((4, 4)).tolist()),
    ]
    for record in reversed(trials):
        store.add_trial(record)
    for record in (world(1), world(0)):
        store.add_world(record)
    again = RunStore(store.folder)
    assert again.trials() == trials  # by world, trial and method, whatever the order of arrival
    assert again.worlds() == [world(0), world(1)]
    assert again.scenario() == SCENARIO
    assert again.read_json("environment.json") == {"python": "3"}


def test_the_columns_are_for_people_with_sql(store: RunStore) -> None:
    store.add_trial(trial(views=[view("V1", 1.0, (1.0, 3.0)), view("V2", 2.0, (None,))]))
    store.add_trial(refused(1))
    connection = sqlite3.connect(store.folder / "trials.sqlite")
    rows = connection.execute("SELECT trial, outcome, reason, displacement_mm FROM trials")
    assert list(rows) == [(0, "corrected", "", 50.0), (1, "refused", "marker M1 is missing", 250.0)]
    rows = connection.execute("SELECT view, residual_mm, detected_px, true_px FROM views")
    assert list(rows) == [("V1", 1.0, 2.0, pytest.approx(1.9)), ("V2", 2.0, None, 1.9)]
    connection.close()


def test_a_new_run_replaces_the_old_one(store: RunStore) -> None:
    store.add_trial(trial())
    store.create(SCENARIO, {})
    assert store.trials() == []
    store.add_trial(trial())


def test_a_trial_is_kept_once(store: RunStore) -> None:
    store.add_trial(trial())
    with pytest.raises(sqlite3.IntegrityError):
        store.add_trial(trial())
    assert store.trials() == [trial()]


@pytest.mark.parametrize("read", [RunStore.trials, RunStore.worlds, RunStore.scenario])
def test_a_folder_that_is_no_run_is_refused(tmp_path: Path, read: object) -> None:
    for folder in (tmp_path, tmp_path / "none"):
        with pytest.raises(InputError, match=str(folder)):
            read(RunStore(folder))  # type: ignore[operator]
    assert list(tmp_path.iterdir()) == []  # and reading leaves nothing behind


@pytest.mark.parametrize("case", ["no summary", "no database", "a file in the way"])
def test_a_damaged_run_is_refused(store: RunStore, tmp_path: Path, case: str) -> None:
    if case == "no database":
        (store.folder / "trials.sqlite").write_bytes(b"not a database" * 100)
    (tmp_path / "file").touch()
    use = {
        "no summary": lambda: store.read_json("summary.json"),
        "no database": store.trials,
        "a file in the way": lambda: RunStore(tmp_path / "file").create(SCENARIO, {}),
    }
    with pytest.raises(InputError):
        use[case]()


@pytest.mark.parametrize("colour", [False, True])
def test_pictures_are_kept_as_they_are(store: RunStore, nominal: Nominal, colour: bool) -> None:
    shape = (6, 8, 3) if colour else (6, 8)
    image = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    state = RobotState(nominal.q_home, nominal.arm.fk(nominal.q_home))
    standard = store.image_path(0, "V1")
    new = store.image_path(0, "V1", trial=1, method="paper")
    assert standard != new
    store.add_image(new, Observation(image, state))
    read = cv2.imread(str(new), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(read[:, :, ::-1] if colour else read, image)  # BGR in OpenCV
    assert new.parent == store.images
