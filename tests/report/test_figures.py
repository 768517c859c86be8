"""Figures of a small run directory: written, not empty, and only what the run holds."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from benchmark.records_by_hand import refused, stored, trial, view, world
from helpers.figures import png_alone

from aoicell.benchmark.records import MarkerRecord, TrialRecord, ViewRecord
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.summary import summarise
from aoicell.nominal import Nominal
from aoicell.report.figures import write_figures
from aoicell.scenario import Scenario, Store
from aoicell.transforms import SE3, from_xyz_rpy

METHODS = ("paper", "aoicell")
MOTION = from_xyz_rpy([0.03, 0.04, 0], [0, 0, 0.1])
CROSSES = np.array([[200.0, 100], [290, 110], [280, 200], [190, 190]])
FORMATS = ("png", "svg", "pdf")
IN_PNG = {"schematic.png", "distance_errors.png"}
DRAWN = {f"{name}.{ending}" for name in ("schematic", "distance_errors") for ending in FORMATS}
PICTURED = {"standard_images.png", "view_V1.png", "view_V2.png"}


def view_at(nominal: Nominal, index: int, px: float) -> ViewRecord:
    """One of the cell's views, corrected exactly, its crosses seen `px` to the right."""
    design = nominal.inspection_views[index]
    taught: SE3 = nominal.T_base_board * design.T_target_camera
    seen = MarkerRecord(
        "M2", px, px, 0.19 * px, CROSSES.tolist(), np.add(CROSSES, [px, 0]).tolist()
    )
    poses = [taught.homogeneous.tolist(), (MOTION * taught).homogeneous.tolist()]
    vector = [0.19 * px, 0.0, 0.05 * px]
    return ViewRecord(
        design.id, 20, 0.2 * px, vector, None, 0.19 * px, 0.05 * px, 0.1, [seen], *poses
    )


def trials_of(nominal: Nominal, count: int = 2) -> list[TrialRecord]:
    boards = {
        "T_base_board_taught": nominal.T_base_board.homogeneous.tolist(),
        "T_base_board_now": (MOTION * nominal.T_base_board).homogeneous.tolist(),
    }
    return [
        trial(k, method, views=[view_at(nominal, v, px + 0.1 * k) for v in range(2)], **boards)
        for k in range(count)
        for method, px in zip(METHODS, (2.0, 0.4), strict=True)
    ]


def run_directory(folder: Path, trials: list[TrialRecord], worlds: int = 1) -> RunStore:
    each = len({t.trial for t in trials})
    shown = Scenario(
        name="s",
        methods=["paper", "aoicell"],
        worlds=worlds,
        trials_per_world=each,
        store=Store(images=True),
    )
    store = stored(folder, trials, [world(index) for index in range(worlds)], shown)
    store.write_json("summary.json", summarise(shown, store, 1.0, 0.5))
    return store


def add_pictures(store: RunStore, trials: list[TrialRecord]) -> None:
    store.images.mkdir()
    rng = np.random.default_rng(0)
    image = rng.integers(90, 110, (240, 320, 3), dtype=np.uint8)
    cv2.rectangle(image, (170, 80), (310, 220), (250, 250, 250), -1)
    for record in trials:
        for seen in record.views:
            for path in (
                store.image_path(0, seen.id),
                store.image_path(0, seen.id, record.trial, record.method),
            ):
                cv2.imwrite(str(path), image)


def names(paths: list[Path]) -> set[str]:
    return {path.name for path in paths}


def check_drawn(paths: list[Path]) -> None:
    """Each file is there, and a picture shows more than a blank page."""
    for path in paths:
        assert path.stat().st_size > 5_000, path.name
        if path.suffix == ".png":
            image = cv2.imread(str(path))
            assert image is not None
            assert image.std() > 5, path.name


@pytest.fixture
def as_png_alone() -> Iterator[None]:
    with png_alone():
        yield


def test_the_figures_of_the_two_tests(tmp_path: Path, nominal: Nominal) -> None:
    trials = trials_of(nominal)
    store = run_directory(tmp_path, trials)
    add_pictures(store, trials)
    written = write_figures(store, nominal)
    assert names(written) == DRAWN | PICTURED
    assert all(path.parent == store.figures for path in written)
    check_drawn(written)


@pytest.mark.usefixtures("as_png_alone")
def test_without_pictures_the_rest_is_drawn(tmp_path: Path, nominal: Nominal) -> None:
    written = write_figures(run_directory(tmp_path, trials_of(nominal)), nominal)
    assert names(written) == IN_PNG
    check_drawn(written)


@pytest.mark.usefixtures("as_png_alone")
def test_a_refused_test_leaves_the_others(tmp_path: Path, nominal: Nominal) -> None:
    trials = [t for t in trials_of(nominal) if (t.trial, t.method) != (1, "aoicell")]
    trials.append(refused(1, "aoicell"))
    store = run_directory(tmp_path, trials)
    add_pictures(store, trials)
    assert names(write_figures(store, nominal)) == IN_PNG | PICTURED


@pytest.mark.usefixtures("as_png_alone")
def test_a_marker_that_was_not_detected(tmp_path: Path, nominal: Nominal) -> None:
    trials = trials_of(nominal)
    poses = trials[0].views[0]
    unseen = ViewRecord(
        "V1", 20, 1.0, [0.6, 0, 0.8], None, 0.6, 0.8, 0.1, view(px=(None,)).markers,
        poses.T_base_camera_taught, poses.T_base_camera_new,
    )  # fmt: skip
    trials[0] = trial(0, "paper", views=[unseen, trials[0].views[1]])
    store = run_directory(tmp_path, trials)
    add_pictures(store, trials)
    assert names(write_figures(store, nominal)) == IN_PNG | PICTURED


def test_many_trials_are_drawn_as_a_distribution(tmp_path: Path, nominal: Nominal) -> None:
    written = write_figures(run_directory(tmp_path, trials_of(nominal, 6)), nominal)
    assert names(written) == DRAWN | {f"distribution.{ending}" for ending in FORMATS}
    check_drawn(written)


@pytest.mark.parametrize("count", [1, 6])
def test_nothing_is_drawn_where_all_was_refused(
    tmp_path: Path, nominal: Nominal, count: int
) -> None:
    trials = [refused(k, method) for k in range(count) for method in METHODS]
    written = write_figures(run_directory(tmp_path, trials), nominal)
    assert not names(written) & DRAWN
