"""A run as one self-contained page: `report.html`, which asks no network for anything."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from aoicell.benchmark.budget import read_budget
from aoicell.benchmark.store import RunStore
from aoicell.errors import InputError
from aoicell.report import page_figures as figures
from aoicell.report import paper
from aoicell.report.budget import budget_chart, conclusion
from aoicell.report.charts import distance_errors
from aoicell.report.figures import FEW
from aoicell.report.page_data import RunData, read_run, worst_of
from aoicell.report.page_figures import Drawing
from aoicell.report.page_inspection import inspection_section
from aoicell.report.page_inspection_figures import inspection_figures
from aoicell.report.page_pictures import pictured_trials
from aoicell.report.page_svg import inline_svg
from aoicell.report.page_tables import (
    cases_table,
    hand_eye_table,
    markers_table,
    refusals_table,
    unused_pictures,
    views_table,
    worst_table,
)
from aoicell.report.page_verdict import headline, predictions, verdicts
from aoicell.report.style import save

Drawings = Mapping[str, Sequence[Drawing]]  # by section
WORST_EACH = 8  # trials of a method
_HERE = Path(__file__).parent


def write_page(store: RunStore) -> tuple[Path, list[Path]]:
    """Write `report.html` and its figures (PNG, SVG, PDF) into the run directory.

    The same run gives the same bytes. Returns the page and the figures. Raises InputError
    where there is no run, or no finished trial in it.
    """
    run = read_run(store)
    drawings = draw(run, store)
    written = [
        path
        for group in drawings.values()
        for drawing in group
        for path in save(drawing.figure, store.figures / drawing.name)
    ]
    page = store.folder / "report.html"
    try:
        page.write_text(render(run, store, drawings), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{page}: cannot be written ({error.strerror})") from None
    return page, written


def draw(run: RunData, store: RunStore) -> Drawings:
    """All figures of the page, by section."""
    return {
        "distributions": [*figures.distributions(run), *_single_tests(run, store)],
        "motion": list(figures.against_motion(run)),
        "directions": list(figures.directions(run)),
        "prediction": list(figures.prediction(run)),
        "cases": list(figures.by_case(run)),
        "budget": list(_budget(run, store)),
        "inspection": list(inspection_figures(run, run.inspection)) if run.inspection else [],
    }


def render(run: RunData, store: RunStore, drawings: Drawings) -> str:
    """The page as text, with the figures that are given; a section may have none."""
    worst = [
        record
        for method in run.scenario.methods
        for record in worst_of(store, run.trials, method, WORST_EACH)
    ]
    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["units"] = _bind_units
    inspection = inspection_section(run, store) if run.inspection else None
    return environment.get_template("page.html.jinja").render(
        run=run,
        css=_text("page.css"),
        js=_text("page.js"),
        inspection=inspection,
        inspection_css=_text("page_inspection.css"),
        inspection_js=_text("page_inspection.js"),
        verdicts=verdicts(run),
        headline=headline(run),
        contradictions=paper.contradictions(),
        figures=defaultdict(list, drawings),
        svg=lambda drawing: inline_svg(drawing.figure, drawing.name),
        cases=cases_table(run) if run.by_case else None,
        views=views_table(run),
        markers=markers_table(run),
        refusals=refusals_table(run),
        predictions=predictions(run),
        hand_eye=hand_eye_table(run),
        unused=unused_pictures(run.worlds),
        worst=worst_table(run, worst),
        pictured=pictured_trials(run, store, worst, inspection.size if inspection else 0),
        environment=list(_environment(run.environment)),
        scenario_text=(store.folder / "scenario.toml").read_text(encoding="utf-8"),
    )


def _text(name: str) -> Markup:
    """A file of the page that is taken as it is."""
    return Markup((_HERE / name).read_text(encoding="utf-8"))


def _single_tests(run: RunData, store: RunStore) -> Iterator[Drawing]:
    """The paper's Figures 20 and 21, where the tests are few enough to be told apart."""
    if run.planned > FEW:
        return
    trials = [trial for trial in store.trials() if trial.views]
    if trials:
        order = run.scenario.methods
        ordered = sorted(trials, key=lambda trial: (order.index(trial.method), trial.trial))
        yield Drawing(
            "distance_errors", "Each marker in each view",
            "Distance of the marker's crosses between the standard and the new image, as in the "
            "paper's Figures 20 and 21.",
            distance_errors(ordered, run.arm_floor_mm), True,
        )  # fmt: skip


def _budget(run: RunData, store: RunStore) -> Iterator[Drawing]:
    """The error budget, where a finished run takes its sources apart and no trial failed."""
    failed = (run.trials["outcome"] == "failed").any()
    if run.takes_sources_apart and run.finished and not failed:
        table, methods = read_budget(store).table, run.scenario.methods
        chart = budget_chart(table, methods)
        yield Drawing("budget", "Error budget", conclusion(table, methods), chart, True)


def _bind_units(text: str) -> str:
    """A number and its unit stay on one line."""
    return re.sub(r"(?<=\d) (?=(mm|px|deg|%)(?!\w))", "\u00a0", text)


def _environment(environment: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """What the numbers depend on beside the scenario, as names and texts."""
    for name in ("python", "platform", "machine"):
        if environment.get(name):
            yield name, str(environment[name])
    for package, version in (environment.get("packages") or {}).items():
        yield package, str(version or "not installed")
    git = environment.get("git")
    if git:
        state = "" if git["clean"] else ", with changes that are not committed"
        yield "git", f"{git['commit']}{state}"
    else:
        yield "git", "not a checkout"
    for other in environment.get("resumed_in", []):
        yield "resumed in", "; ".join(f"{n} {text}" for n, text in _environment(other))
