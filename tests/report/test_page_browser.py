"""The page in a real browser: it opens, sorts, filters and slides, and asks nothing outside."""

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from report import inspection_runs
from report.page_runs import last_refused, page_without_figures, pictured, whole_page

playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")

NAMES = ("chromium", "chromium-browser", "google-chrome")
CHROMIUM = next((path for name in NAMES if (path := shutil.which(name))), None)

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=f"none of {', '.join(NAMES)} is here")


@dataclass
class Window:
    """An open page, and what it asked for and complained of."""

    page: "playwright.Page"
    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    def column(self, table: str, index: int) -> list[str]:
        cells = self.page.locator(f"#{table} tbody tr:visible td:nth-child({index + 1})")
        return [text.strip() for text in cells.all_inner_texts()]

    def heading(self, table: str, name: str) -> "playwright.Locator":
        return self.page.locator(f"#{table} thead th", has_text=name).first


@pytest.fixture(scope="module")
def browser() -> Iterator["playwright.Browser"]:
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    title = "<script>document.title = 'taken'</script>"
    page = whole_page(pictured(folder, last_refused('it\'s "M1"</script>'), title=title))
    path = folder / "report.html"
    path.write_text(page.raw, encoding="utf-8")
    return path


def opened(browser: "playwright.Browser", report: Path, width: int, height: int) -> Window:
    context = browser.new_context(viewport={"width": width, "height": height})
    window = Window(context.new_page())
    context.on("request", lambda request: window.requests.append(request.url))
    window.page.on("console", lambda message: window.complaints.append(message.text))
    window.page.on("pageerror", lambda error: window.complaints.append(str(error)))
    window.page.goto(report.as_uri())
    return window


@pytest.fixture
def window(browser: "playwright.Browser", report: Path) -> Iterator[Window]:
    """The page on a desk; whatever a test does, nothing may be asked for or complained of."""
    window = opened(browser, report, 1280, 900)
    yield window
    assert window.complaints == []
    outside = [url for url in window.requests if not url.startswith(("file://", "data:"))]
    assert outside == []
    assert sum(url.startswith("file://") for url in window.requests) == 1
    window.page.context.close()


def test_it_opens_and_every_picture_is_shown(window: Window) -> None:
    assert window.page.title().startswith("<script>document.title")
    assert window.page.locator("h1").inner_text().startswith("<script>")
    sizes = window.page.eval_on_selector_all("img", "images => images.map(i => i.naturalWidth)")
    assert len(sizes) > 8
    assert min(sizes) > 0
    assert window.page.locator(".drawing svg").count() == 6


def test_a_heading_sorts_up_and_down_by_click(window: Window) -> None:
    heading = window.heading("views", "left")
    assert heading.get_attribute("aria-sort") == "none"
    button = heading.locator("button")
    button.click()
    rising = [float(text) for text in window.column("views", 3)]
    assert heading.get_attribute("aria-sort") == "ascending"
    assert rising == sorted(rising)
    assert len(set(rising)) == 4
    button.click()
    assert heading.get_attribute("aria-sort") == "descending"
    assert [float(text) for text in window.column("views", 3)] == rising[::-1]


def test_a_heading_sorts_by_keyboard_and_only_one_is_marked(window: Window) -> None:
    window.heading("views", "left").locator("button").click()
    window.heading("views", "method").locator("button").focus()
    window.page.keyboard.press("Enter")
    assert window.column("views", 1) == ["aoicell", "aoicell", "paper", "paper"]
    window.page.keyboard.press("Space")
    assert window.column("views", 1) == ["paper", "paper", "aoicell", "aoicell"]
    marked = window.page.locator('#views th:not([aria-sort="none"])')
    assert marked.all_inner_texts() == ["method"]


def test_signed_numbers_sort_as_numbers_and_missing_ones_stay_last(window: Window) -> None:
    window.heading("views", "y").locator("button").click()
    y = [float(text.replace("−", "-")) for text in window.column("views", 12)]
    assert y == sorted(y)
    assert max(y) < 0
    marker = window.heading("markers", "marker").locator("button")
    marker.click()
    marker.click()
    assert window.column("markers", 5)[:2] == ["–", "–"]
    button = window.heading("markers", "detected").locator("button")
    for _ in range(2):
        button.click()
        shown = window.column("markers", 5)
        assert [text == "–" for text in shown] == [False] * 4 + [True] * 2


def test_the_filter_leaves_rows_with_all_its_words(window: Window) -> None:
    field = window.page.locator("#markers input[type=search]")
    field.fill("AOICELL m3")
    assert window.column("markers", 0) == ["V2"]
    assert window.page.locator("#markers output").inner_text() == "1 of 6 rows"
    field.fill("nothing like this")
    assert window.column("markers", 0) == []
    field.fill("")
    assert len(window.column("markers", 0)) == 6


def test_the_slider_moves_by_drag_and_by_keys(window: Window) -> None:
    pair = window.page.locator(".pair").first
    slider, new = pair.locator("input"), pair.locator("img.new")
    pair.scroll_into_view_if_needed()
    box = pair.bounding_box()
    assert box is not None

    def cut() -> str:
        return str(new.evaluate("image => getComputedStyle(image).clipPath"))

    assert cut() == "inset(0px 0px 0px 50%)"
    middle = box["y"] + box["height"] / 2
    window.page.mouse.move(box["x"] + box["width"] / 2, middle)
    window.page.mouse.down()
    window.page.mouse.move(box["x"] + 0.2 * box["width"], middle, steps=4)
    dragged = float(slider.input_value())
    assert dragged == pytest.approx(20, abs=2)
    assert cut() == f"inset(0px 0px 0px {dragged:g}%)"  # while the button is still down
    window.page.mouse.up()
    slider.focus()
    for _ in range(3):
        window.page.keyboard.press("ArrowRight")
    assert float(slider.input_value()) == dragged + 3
    window.page.keyboard.press("ArrowLeft")
    assert cut() == f"inset(0px 0px 0px {dragged + 2:g}%)"
    line = pair.locator(".line").bounding_box()
    assert line is not None
    at = box["x"] + (dragged + 2) / 100 * box["width"]
    assert line["x"] + line["width"] / 2 == pytest.approx(at, abs=1.5)


def test_all_that_moves_is_reached_by_tab_and_shows_its_focus(window: Window) -> None:
    focused = (
        "(e => [e.tagName, e.type || '', getComputedStyle(e).outlineStyle])(document.activeElement)"
    )
    reached = []
    for _ in range(200):
        window.page.keyboard.press("Tab")
        tag, kind, outline = window.page.evaluate(focused)
        if tag == "BODY":
            break
        assert outline == "solid", (tag, kind)
        reached.append((tag, kind))
    assert {("A", ""), ("BUTTON", "button"), ("INPUT", "search"), ("INPUT", "range"),
            ("SUMMARY", "")} <= set(reached)  # fmt: skip
    assert reached.count(("BUTTON", "button")) == window.page.locator("th button").count()


def test_a_phone_scrolls_down_only(browser: "playwright.Browser", report: Path) -> None:
    window = opened(browser, report, 390, 844)
    for element in ("documentElement", "body"):
        width = window.page.evaluate(f"document.{element}.scrollWidth")
        assert width <= 390, element
    too_wide = window.page.evaluate(
        "Array.from(document.querySelectorAll('p, h1, h2, h3, figure, dl, input'))"
        ".filter(e => e.getBoundingClientRect().right > 390).map(e => e.outerHTML.slice(0, 80))"
    )
    assert too_wide == []
    assert window.complaints == []
    window.page.context.close()


def test_on_paper_both_pictures_stand_side_by_side(
    browser: "playwright.Browser", report: Path
) -> None:
    window = opened(browser, report, 794, 1123)
    window.page.emulate_media(media="print")
    first, second = (window.page.locator(".pair img").nth(k).bounding_box() for k in range(2))
    assert first is not None
    assert second is not None
    assert first["y"] == pytest.approx(second["y"], abs=1)
    assert first["x"] + first["width"] <= second["x"]
    assert not window.page.locator("nav").is_visible()
    assert len(window.page.pdf(format="A4")) > 20_000
    window.page.context.close()


# -- The review of an inspection --------------------------------------------------------


@pytest.fixture(scope="module")
def inspecting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inspecting")
    page = page_without_figures(inspection_runs.pictured(folder, inspection_runs.records()))
    path = folder / "report.html"
    path.write_text(page.raw, encoding="utf-8")
    return path


@pytest.fixture
def reviewer(browser: "playwright.Browser", inspecting: Path) -> Iterator[Window]:
    window = opened(browser, inspecting, 1280, 900)
    yield window
    assert window.complaints == []
    assert [url for url in window.requests if not url.startswith(("file://", "data:"))] == []
    window.page.context.close()


def _shown(review: "playwright.Locator") -> list[str]:
    """Which of the three pictures can be seen."""
    return [
        name
        for name in ("picture", "reference", "difference")
        if review.locator(f"img.{name}").is_visible()
    ]


def test_the_pictures_of_a_review_are_switched_by_click_and_by_keys(reviewer: Window) -> None:
    first, second = (reviewer.page.locator(".review").nth(k) for k in range(2))
    assert _shown(first) == ["picture"]
    first.get_by_role("button", name="Difference").click()
    assert _shown(first) == ["difference"]
    assert _shown(second) == ["picture"]  # each on its own
    reviewer.page.keyboard.press("Shift+Tab")
    reviewer.page.keyboard.press("Enter")
    assert _shown(first) == ["reference"]
    pressed = first.locator('button[data-layer][aria-pressed="true"]')
    assert pressed.all_inner_texts() == ["Reference"]


def test_boxes_are_switched_off_and_stay_on_every_picture(reviewer: Window) -> None:
    first = reviewer.page.locator(".review").first
    box = first.locator("rect").first
    for layer in ("Reference", "Difference", "Picture"):
        first.get_by_role("button", name=layer).click()
        assert box.is_visible()
    switch = first.get_by_role("button", name="Boxes")
    switch.focus()
    reviewer.page.keyboard.press("Space")
    assert not box.is_visible()
    assert switch.get_attribute("aria-pressed") == "false"
    switch.click()
    assert box.is_visible()


def test_a_box_lies_where_its_part_is(reviewer: Window) -> None:
    """Pictures are 320 px wide, the box of C1 begins at 150 px."""
    first = reviewer.page.locator(".review").first
    picture = first.locator("img.picture").bounding_box()
    box = first.locator('[data-finding="1"] rect').bounding_box()
    assert picture is not None
    assert box is not None
    middle = (box["x"] + box["width"] / 2 - picture["x"]) / picture["width"]
    assert middle == pytest.approx(160 / 320, abs=0.005)


def test_a_finding_marks_its_box(reviewer: Window) -> None:
    worst = reviewer.page.locator(".board", has_text="1 escaped")
    worst.locator(".findings li").nth(1).hover()
    assert worst.locator("g.chosen").get_attribute("data-finding") == "2"
    reviewer.page.mouse.move(0, 0)
    assert worst.locator("g.chosen").count() == 0


def test_a_review_fits_a_phone(browser: "playwright.Browser", inspecting: Path) -> None:
    window = opened(browser, inspecting, 390, 844)
    assert window.page.evaluate("document.documentElement.scrollWidth") <= 390
    too_wide = window.page.evaluate(
        "Array.from(document.querySelectorAll('.review, .findings li, .findings img, .switches'))"
        ".filter(e => e.getBoundingClientRect().right > 390).map(e => e.outerHTML.slice(0, 80))"
    )
    assert too_wide == []
    window.page.context.close()


def test_on_paper_the_three_pictures_of_a_view_stand_side_by_side(
    browser: "playwright.Browser", inspecting: Path
) -> None:
    window = opened(browser, inspecting, 794, 1123)
    window.page.emulate_media(media="print")
    review = window.page.locator(".review").first
    assert _shown(review) == ["picture", "reference", "difference"]
    pictures = [review.locator("img").nth(k).bounding_box() for k in range(3)]
    edges = [(box["x"], box["x"] + box["width"]) for box in pictures if box is not None]
    assert edges[0][1] <= edges[1][0]
    assert edges[1][1] <= edges[2][0]
    box = review.locator("rect").first.bounding_box()
    assert box is not None
    assert edges[0][0] < box["x"] < edges[0][1]  # on the picture
    assert not review.locator(".switches").is_visible()
    window.page.context.close()
