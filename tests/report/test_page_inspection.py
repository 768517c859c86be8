"""The page of a run that inspects: its numbers, tables, figures and boards to be reviewed."""

import re
from base64 import b64decode
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from benchmark.records_by_hand import view

from aoicell.benchmark.records import RegistrationRecord
from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.report import page_inspection, page_review
from aoicell.report.page import write_page
from aoicell.report.page_data import read_run
from aoicell.report.page_inspection import InspectionSection, inspection_section
from aoicell.report.review_pictures import CROP_PX
from report import page_runs
from report.inspection_runs import (
    METHODS,
    board,
    escape,
    false_call,
    finished,
    given_up,
    inspected,
    part,
    pictured,
    records,
    shifted,
)
from report.page_runs import Page, page_without_figures, whole_page


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Page:
    page, _ = write_page(pictured(tmp_path_factory.mktemp("whole"), records()))
    return Page(page.read_text(encoding="utf-8"))


@pytest.fixture(autouse=True)
def _loaded_once(monkeypatch: pytest.MonkeyPatch, nominal: Nominal) -> None:
    monkeypatch.setattr(page_inspection, "load_nominal", lambda _: nominal)


def _rows(page: Page, table: str) -> list[list[str]]:
    """The texts of a table's cells; the table is the last thing that has its id."""
    html = re.split(rf'id="{table}"', page.raw)[1].split("</table>")[0].split("<tbody>")[1]
    return [
        [re.sub(r"<[^>]*>", "", cell) for cell in re.findall(r"<t[dh][^>]*>.*?</t[dh]>", row)]
        for row in re.findall(r"<tr>.*?</tr>", html)
    ]


def _review(page: Page) -> str:
    return page.raw.split('<section id="review">')[1].split("</section>")[0]


# -- Numbers and tables -----------------------------------------------------------------


def test_the_methods_stand_side_by_side(whole: Page) -> None:
    lines = {row[0]: row[1:] for row in _rows(whole, "inspection")}
    assert lines["planted defects"] == ["2", "4", "4", ""]
    assert lines["— found"] == ["0", "3", "4", ""]
    assert lines["detection rate, %"] == ["0.00", "75.00", "100.00", "≥ 99"]
    assert lines["— passed/failed/no verdict"] == ["0/0/2", "0/2/0", "0/2/0", ""]
    assert lines["false calls, %"] == ["0.000", "0.510", "0.000", "≤ 0.1"]


def test_the_tables_count_by_kind_and_method(whole: Page) -> None:
    by_defect = {tuple(row[:2]): row[2:] for row in _rows(whole, "by_defect")}
    assert by_defect["missing", "paper"] == ["2", "1", "50.00", "1.26", "1", "0", "0"]
    assert by_defect["missing", "uncorrected"][-2:] == ["2", "0"]  # no verdict, none tolerated
    assert by_defect["shifted", "aoicell"][:3] == ["2", "2", "100.00"]
    by_component = {tuple(row[:2]): row[2:] for row in _rows(whole, "by_component")}
    capacitors, resistors = 44, 22  # on the shipped board
    assert by_component["capacitor", "paper"][:2] == [str(2 * capacitors), "4"]
    share = f"{100 / (2 * resistors):.3f}"
    assert by_component["resistor", "paper"][-2:] == ["1", share]


def test_wrong_verdicts_are_listed_one_by_one_with_what_repeats_them(whole: Page) -> None:
    missed = _rows(whole, "missed")
    assert [row[:4] for row in missed] == [
        ["paper", "escaped", "1", "C1"],
        ["uncorrected", "no verdict", "0", "C1"], ["uncorrected", "no verdict", "1", "C1"],
    ]  # fmt: skip
    assert missed[0][-1] == "aoicell run scenario.toml --only 1 --images"
    [call] = _rows(whole, "false_calls")
    assert call[:5] == ["paper", "false call", "1", "R7", "resistor"]


def test_many_wrong_verdicts_are_cut_and_it_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_inspection, "MOST_ROWS", 2)
    lost = part("A9", planted="rotated", state="no_verdict", called=False)
    trials = [board(0, m, inspected(lost, escape("C1"), escape("C2"))) for m in METHODS]
    page = page_without_figures(finished(tmp_path, trials))
    assert [row[3] for row in _rows(page, "missed")] == ["C1", "C2"] * 3  # the escapes come first
    assert "3 more are in trials.sqlite" in page.text


def test_what_is_tolerated_is_neither_a_defect_nor_missed(tmp_path: Path) -> None:
    little = shifted("C9", 0.1, 0.01, tolerated=True, state="present", called=False)
    store = finished(tmp_path, [board(0, m, inspected(little)) for m in METHODS])
    page = page_without_figures(store)
    assert [row[2:] for row in _rows(page, "by_defect")] == [
        ["0", "0", "–", "–", "0", "0", "1"]
    ] * 3
    assert "Every planted defect was found." in page.text
    assert "No good part was called wrong." in page.text


# -- Figures ----------------------------------------------------------------------------


def test_the_figures_are_in_the_page(whole: Page) -> None:
    for title in ("Defects found, by kind", "Measured against true shift",
                  "Registration of the pictures"):  # fmt: skip
        assert any(label.startswith(title) for label in whole.values("aria-label"))
    ids = whole.values("id")
    assert len(ids) == len(set(ids))


def test_a_run_without_any_finding_has_a_page(tmp_path: Path) -> None:
    nothing, seen = inspected(registrations=[]), [view()]
    trials = [board(0, m, nothing, views=seen) for m in METHODS]
    page = whole_page(finished(tmp_path, trials))
    assert "Every planted defect was found." in page.text
    assert not any("Measured against" in label for label in page.values("aria-label"))


def test_a_run_that_does_not_inspect_says_nothing_of_it(tmp_path: Path) -> None:
    page = page_without_figures(page_runs.finished(tmp_path, page_runs.records()))
    assert {"inspection", "review"} & set(page.values("id")) == set()
    assert "#review" not in page.values("href")
    assert ".review" not in page.raw  # nor its styles and scripts


# -- Review -----------------------------------------------------------------------------


def test_boards_to_review_start_with_wrong_verdicts(whole: Page) -> None:
    titles = re.findall(r"<h3>(\w+), trial (\d) \(world 1, test \d\): ([^<]*)</h3>", _review(whole))
    assert titles == [
        ("aoicell", "0", "fail; 2 found"), ("aoicell", "1", "fail; 2 found"),
        ("paper", "1", "fail; 1 escaped, 1 false call, 1 found"), ("paper", "0", "fail; 2 found"),
        ("uncorrected", "0", "no verdict; 1 no verdict"),
        ("uncorrected", "1", "no verdict; 1 no verdict"),
    ]  # fmt: skip


def test_every_view_has_its_three_pictures_and_its_boxes(whole: Page) -> None:
    alts = [alt for alt in whole.values("alt") if alt.startswith("V1, ")]
    assert alts[:3] == ["V1, picture", "V1, reference", "V1, difference"]
    assert whole.values("data-layer")[:3] == ["picture", "reference", "difference"]
    boxes = [attrs for tag, attrs in whole.elements if tag == "rect" and "x" in attrs]
    box = {"x": "150.0", "y": "110.0", "width": "20.0", "height": "12.0"}
    assert box in boxes
    assert "C1, planted: missing; said: present, confidence 0.98; escaped" in whole.text


def _pixels(uri: str) -> np.ndarray:
    data = np.frombuffer(b64decode(uri.removeprefix("data:image/webp;base64,")), np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)


def test_the_difference_shows_the_part_where_its_box_is(tmp_path: Path) -> None:
    """The new picture lies 3 px off; laid over the reference it differs in the part alone."""
    store = pictured(tmp_path, records())
    run = read_run(store)
    shown = inspection_section(run, store).boards[0]
    apart = _pixels(shown.views[0].layers["difference"])
    left, top, right, bottom = (150, 110, 170, 122)
    inside = apart[top + 1 : bottom - 1, left + 1 : right - 1]
    around = apart[top - 40 : bottom + 40, left - 40 : right + 40].copy()
    around[38 : 42 + bottom - top, 38 : 42 + right - left] = 0
    assert inside.mean() > 8 * around.mean()
    strip = _pixels(shown.parts[0].strip)
    assert strip.shape[0] == CROP_PX
    middle = strip[CROP_PX // 2 - 8 : CROP_PX // 2 + 8]
    picture, reference, difference = np.array_split(middle, 3, axis=1)
    assert difference[:, 60:90].mean() > 100
    assert abs(picture[:, 60:90].mean() - reference[:, 60:90].mean()) > 20


def test_a_picture_of_something_else_is_shown_as_it_lies(tmp_path: Path) -> None:
    store = pictured(tmp_path, records())
    path = store.image_path(0, "V1", 0, "aoicell")
    cv2.imwrite(str(path), np.full((240, 320), 90, np.uint8))
    text = page_without_figures(store).text
    assert text.count("could not be laid over the reference and is shown as it lies") == 1


def test_a_finding_without_a_place_is_in_the_list_alone(tmp_path: Path) -> None:
    lost = part("FO1", kind="foreign_object", planted="foreign_object", state="", called=False,
                view="", box_px=None, confidence=None, reason="a screw")  # fmt: skip
    trials = [board(0, m, inspected(lost, part())) for m in METHODS]
    page = page_without_figures(pictured(tmp_path, trials))
    assert page.text.count("planted: foreign object, a screw") == 3
    assert "said: nothing" in page.text
    assert page.count("rect") == 3  # the other part's, for each method


def test_a_box_at_the_edge_is_cut_out_as_well(tmp_path: Path) -> None:
    corner = part(box_px=[-30.0, -20.0, 6.0, 8.0])
    beyond = part("C5", box_px=[400.0, 300.0, 420.0, 310.0])
    store = pictured(tmp_path, [board(0, m, inspected(corner, beyond)) for m in METHODS])
    strips = [p.strip for p in inspection_section(read_run(store), store).boards[0].parts]
    assert len({_pixels(strip).shape for strip in strips}) == 1


def test_without_pictures_it_says_how_to_get_them(tmp_path: Path) -> None:
    page = page_without_figures(finished(tmp_path, records()))
    assert "No pictures were kept." in page.text
    wanted = re.findall(r"aoicell run scenario.toml --only (\d) --images", _review(page))
    assert wanted[:2] == ["0", "1"]  # the worst of uncorrected and aoicell; the worst of paper


def test_pictures_have_a_bound(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = pictured(tmp_path, records())
    run = read_run(store)
    assert run.inspection is not None
    everything = page_review.reviewed_boards(run, store, run.inspection)
    assert len(everything) == 6
    room = everything[0].size + everything[2].size
    monkeypatch.setattr(page_review, "MOST_BYTES", room + 10)
    fewer = page_review.reviewed_boards(run, store, run.inspection)
    assert sum(board.size for board in fewer) <= room + 10
    assert [board.title.split(",")[0] for board in fewer] == ["aoicell", "paper"]


def test_few_boards_of_a_method_and_few_parts_of_a_board_are_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_review, "BOARDS_EACH", 1)
    monkeypatch.setattr(page_review, "PARTS_EACH", 2)
    page = page_without_figures(pictured(tmp_path, records()))
    assert page.values("class").count("board") == 3
    assert "1 more findings of this board" in page.text  # of paper's three


def test_a_picture_that_is_none_is_named(tmp_path: Path) -> None:
    store = pictured(tmp_path, records())
    store.image_path(0, "V1", 1, "paper").write_bytes(b"no picture")
    with pytest.raises(InputError, match=r"V1_test2_paper\.png: not a readable picture"):
        page_without_figures(store)


def test_strings_of_findings_are_escaped(tmp_path: Path) -> None:
    evil = "\"'</script><script>alert(1)</script><b>x</b>"

    def page(name: str, folder: Path) -> Page:
        wrong = part(name, kind=name, reason=name, view=name)
        seen = [RegistrationRecord(name, "registered", 0.1, 0.2)]
        trials = [
            board(
                0, m, inspected(wrong, false_call(name + "2"), registrations=seen), views=[view()]
            )
            for m in METHODS
        ]
        return page_without_figures(finished(folder, trials))

    plain, nasty = page("C1", tmp_path / "plain"), page(evil, tmp_path / "evil")
    for tag in ("script", "b", "img"):
        assert nasty.count(tag) == plain.count(tag), tag
    assert nasty.text.count(evil) > 3


def test_the_same_run_gives_the_same_section(tmp_path: Path) -> None:
    def section(name: str) -> InspectionSection:
        store = pictured(tmp_path / name, records()[:3])
        return inspection_section(read_run(store), store)

    assert section("one") == section("two")


def test_of_several_cases_the_one_that_stands_alone_is_described(tmp_path: Path) -> None:
    trials = [
        record
        for method in METHODS
        for record in (
            board(0, method, inspected(part())),
            replace(given_up(0, method), case=1, number=1),
        )
    ]
    run = read_run(finished(tmp_path, trials, ablate=["gravity"], trials_per_world=1))
    assert run.inspection is not None
    assert run.inspection.boards == dict.fromkeys(METHODS, 1)
    assert run.inspection.methods["aoicell"]["found"] == 1
