"""The page of a run: what it says, that it escapes, repeats itself and stays small."""

import re
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmark.records_by_hand import refused, stored, trial, view, world
from helpers.running import run_cli

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.store import RunStore
from aoicell.benchmark.summary import summarise
from aoicell.errors import InputError
from aoicell.report.page import write_page
from aoicell.scenario import Scenario
from report.page_runs import (
    METHODS,
    Page,
    finished,
    last_refused,
    page_without_figures,
    pictured,
    records,
    whole_page,
)

# -- The whole page ---------------------------------------------------------------------


def _write(folder: Path) -> tuple[Page, list[Path]]:
    page, written = write_page(pictured(folder, last_refused(), title="Six displacements"))
    return Page(page.read_text(encoding="utf-8")), written


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Page, list[Path]]:
    return _write(tmp_path_factory.mktemp("whole"))


def test_the_page_says_what_is_left(whole: tuple[Page, list[Path]]) -> None:
    text = whole[0].text
    assert "Six displacements" in text
    assert "aoicell leaves 0.450 mm on average" in text  # 0.15 x (1 + .. + 5) / 5
    assert "paper leaves 5.25 mm on average" in text  # 1.5 x (1 + .. + 6) / 6
    assert "All 5 corrected trials lie within the tolerance of 5 mm" in text
    assert "4 of 6 corrected trials lie beyond the tolerance of 5 mm" in text  # in a view
    assert "Of 6 trials 1 was refused." in text
    assert "3.97 (5.15 and 3.80)" in text  # the paper's figures as printed
    assert "marker M1 is missing" in text
    assert "aoicell run scenario.toml --only 5 --images" in text
    assert "No method of this run states an error of its own" in text
    assert "not finished" not in text


def test_figures_are_written_for_a_paper_and_stand_in_the_page(
    whole: tuple[Page, list[Path]],
) -> None:
    page, written = whole
    names = {path.stem for path in written}
    assert names == {
        "residual_distribution", "picture_distribution", "residual_against_displacement",
        "residual_against_rotation", "directions_paper", "directions_aoicell",
    }  # fmt: skip
    assert {path.suffix for path in written} == {".png", ".svg", ".pdf"}
    assert len(written) == 3 * len(names)
    assert all(path.stat().st_size > 3000 for path in written)
    assert page.values("class").count("drawing") == len(names)


def test_ids_are_unique_and_every_reference_has_its_target(
    whole: tuple[Page, list[Path]],
) -> None:
    ids = whole[0].values("id")
    assert len(ids) == len(set(ids))
    references = re.findall(r'(?:href="#|url\(#)([^")]+)', whole[0].raw)
    assert len(references) > 20
    assert set(references) <= set(ids)


def test_nothing_in_the_page_points_outside(whole: tuple[Page, list[Path]]) -> None:
    page = whole[0]
    assert {tag for tag, _ in page.elements} & {"link", "iframe", "object", "base"} == set()
    assert all(value.startswith("data:image/") for value in page.values("src"))
    links = [*page.values("href"), *page.values("xlink:href")]
    assert links
    assert all(value.startswith(("#", "data:image/")) for value in links)
    assert "@import" not in page.raw
    policy = next(attrs["content"] for _, attrs in page.elements if attrs.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'")


def test_the_same_run_gives_the_same_bytes(whole: tuple[Page, list[Path]], tmp_path: Path) -> None:
    page, written = _write(tmp_path)
    assert page.raw == whole[0].raw
    assert [(p.name, p.read_bytes()) for p in written] == [
        (p.name, p.read_bytes()) for p in whole[1]
    ]


def test_worst_trials_come_first_with_their_pictures(whole: tuple[Page, list[Path]]) -> None:
    page = whole[0]
    titles = re.findall(r"aoicell, trial (\d) \(world \d, test \d\): ([\d.]+) mm left", page.text)
    assert titles == [("4", "0.750"), ("3", "0.600"), ("2", "0.450")]
    labels = [label for label in page.values("aria-label") if "aoicell, trial 4" in label]
    assert [re.findall(r"view (V\d)", label) for label in labels] == [["V2"], ["V1"]]
    assert page.count("img") == 2 * 2 * 3 * 2  # images, views, trials, methods


# -- Escaping ---------------------------------------------------------------------------


def test_strings_of_scenario_and_records_are_escaped(tmp_path: Path) -> None:
    evil = "\"'</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;"
    plain = page_without_figures(pictured(tmp_path / "plain", last_refused(), title="T"))
    store = pictured(tmp_path / "evil", last_refused(evil), title=f"<script>{evil}")
    store.write_json("environment.json", {"python": "<b onclick=x>3", "platform": evil})
    nasty = page_without_figures(store)
    assert nasty.text.count(evil) >= 4  # title, heading, reason, platform
    for tag in ("script", "img", "b"):
        assert nasty.count(tag) == plain.count(tag), tag
    assert not any(name.startswith("on") for _, attrs in nasty.elements for name in attrs)


def test_names_of_views_and_cases_are_escaped_in_figures_too(tmp_path: Path) -> None:
    trials = [trial(k, m, views=[view("<i>$V_1$</i>")]) for k in range(3) for m in METHODS]
    cases = {"<script>alert(1)</script> $x$": {"tolerance_mm": 2.0}}
    store = finished(tmp_path, trials, worlds=1, cases=cases)
    page = whole_page(store)
    assert page.count("i") == 0
    assert page.count("script") == 1
    assert page.raw.count("&lt;i&gt;$V_1$&lt;/i&gt;</text>") == 2  # two methods
    assert "&lt;script&gt;alert(1)&lt;/script&gt; $x$</text>" in page.raw


# -- Runs of other kinds ----------------------------------------------------------------


def test_an_unfinished_run_says_so(tmp_path: Path) -> None:
    store = finished(tmp_path, records(4))
    (tmp_path / "summary.json").unlink()
    text = page_without_figures(store).text
    assert "This run is not finished: 4 of 6 trials are stored" in text
    assert "aoicell run --resume" in text


def test_a_single_repeated_trial_is_no_unfinished_run(tmp_path: Path) -> None:
    text = page_without_figures(finished(tmp_path, [r for r in records() if r.number == 4])).text
    assert "not finished" not in text
    assert "holds 1 of the scenario's 6 trials" in text


def test_a_run_in_which_all_was_refused(tmp_path: Path) -> None:
    trials = [refused(k, m) for k in range(3) for m in METHODS]
    page = whole_page(finished(tmp_path, trials, worlds=1))
    text = page.text
    assert page.values("class").count("drawing") == 2  # refusals against the motion
    assert "aoicell corrected none of 3 trials: 3 refused, 0 failed." in text
    assert "No trial was corrected" in text


def test_a_run_that_leaves_nothing(tmp_path: Path) -> None:
    exact = [trial(k, m, views=[view(mm=0.0, px=(0.0,))]) for k in range(3) for m in METHODS]
    page = whole_page(finished(tmp_path, exact, worlds=1))
    assert "aoicell leaves 0.00 mm on average" in page.text
    assert page.values("class").count("drawing") == 7  # with the single tests


def test_a_run_that_is_not_there(tmp_path: Path) -> None:
    done = run_cli("report", tmp_path / "nowhere")
    assert done.code == 2
    assert done.stderr.count("\n") == 1
    assert "nowhere: not a run directory" in done.stderr
    with pytest.raises(InputError, match="no trial is finished yet"):
        write_page(stored(tmp_path / "empty", []))


def test_a_run_of_another_version(tmp_path: Path) -> None:
    store = finished(tmp_path, records())
    with sqlite3.connect(tmp_path / "trials.sqlite") as connection:
        connection.execute("ALTER TABLE trials DROP COLUMN residual_mm")
    connection.close()
    with pytest.raises(InputError, match="'trials' differs in residual_mm, so another version"):
        write_page(store)


def test_a_run_is_read_by_columns_and_by_its_worst_records_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten thousand records are too many to be parsed for a page."""
    parsed: list[TrialRecord] = []
    trials = RunStore.trials

    def counted(store: RunStore, *where: Any) -> Iterator[TrialRecord]:
        for record in trials(store, *where):
            parsed.append(record)
            yield record

    monkeypatch.setattr(RunStore, "trials", counted)
    monkeypatch.setattr("aoicell.report.page.WORST_EACH", 2)
    store = finished(tmp_path, records(), worlds=2)
    whole = page_without_figures(store)
    assert whole.text.count("--only") >= 2 * len(METHODS)
    assert len(parsed) == 2 * len(METHODS)


def test_the_command_names_the_page_and_its_figures(tmp_path: Path) -> None:
    store = finished(tmp_path, [refused(k, m) for k in range(3) for m in METHODS])
    (tmp_path / "summary.json").unlink()  # then the figures of a finished run are not drawn
    done = run_cli("report", store.folder, "--json")
    assert done.code == 0, done.stderr
    assert done.summary["report"] == str(tmp_path / "report.html")
    assert done.summary["finished"] is False
    assert done.summary["bytes"] == (tmp_path / "report.html").stat().st_size
    assert all(Path(path).is_file() for path in done.summary["figures"])


@pytest.mark.parametrize("count", [600, pytest.param(10_000, marks=pytest.mark.slow)])
def test_many_trials_stay_a_small_page(tmp_path: Path, count: int) -> None:
    rng = np.random.default_rng(0)

    def some(number: int, method: str, mm: float) -> TrialRecord:
        moved = {"displacement_mm": rng.uniform(20, 60), "turn_deg": rng.uniform(0, 15)}
        return trial(number, method, views=[view(mm=mm * rng.gamma(4))], **moved)

    sizes = zip(METHODS, (1.0, 0.05), strict=True)
    trials = [some(k, method, mm) for method, mm in sizes for k in range(count)]
    store = finished(tmp_path, trials, worlds=1, trials_per_world=count)
    assert len(whole_page(store).raw) < 1_500_000


def test_pictures_are_left_out_where_they_would_make_the_page_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = pictured(tmp_path, records())
    everything = page_without_figures(store)
    one = max(len(value) for value in everything.values("src"))
    monkeypatch.setattr("aoicell.report.page_pictures.MOST_BYTES", 5 * one)
    assert page_without_figures(store).count("img") == 4  # one trial of two views


def test_resumed_runs_name_both_environments(tmp_path: Path) -> None:
    scenario = Scenario(name="s", methods=["paper", "aoicell"], worlds=2, trials_per_world=3)
    store = stored(tmp_path, records(), [world()], scenario)
    store.write_json("summary.json", summarise(scenario, store, 1.0, 0.0))
    git = {"commit": "abc123", "clean": False}
    first = {"python": "3.11.7", "packages": {"mujoco": "4.0.0"}, "git": git}
    other = {"python": "3.12.1", "git": None}
    store.write_json("environment.json", {**first, "resumed_in": [other]})
    text = page_without_figures(store).text
    assert "abc123, with changes that are not committed" in text
    assert "python 3.12.1; git not a checkout" in text


def _failed(record: TrialRecord) -> TrialRecord:
    changed = {"outcome": "failed", "reason": "ValueError: x", "views": []}
    return TrialRecord(**{**vars(record), **changed})


def test_a_failed_trial_is_the_worst(tmp_path: Path) -> None:
    trials = [_failed(r) if (r.number, r.method) == (1, "aoicell") else r for r in records()]
    page = page_without_figures(finished(tmp_path, trials))
    rows = re.findall(r"<tr><td>aoicell</td><td[^>]*>(\d)</td>", page.raw.split('id="worst"')[1])
    assert rows == ["1", "5", "4", "3", "2", "0"]
    assert "failed: ValueError: x" in page.text
    assert "1 failed, which is a defect" in page.text
