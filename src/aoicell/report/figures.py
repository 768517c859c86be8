"""All figures of a run, drawn from its directory."""

from collections.abc import Sequence
from pathlib import Path

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.store import RunStore
from aoicell.nominal import Nominal
from aoicell.report.charts import distance_errors, residual_distribution
from aoicell.report.pictures import standard_images, view_comparison
from aoicell.report.schematic import schematic
from aoicell.report.style import save

FEW = 4  # up to so many displacements are shown one by one


def write_figures(store: RunStore, nominal: Nominal) -> list[Path]:
    """Draw what the run holds into its `figures` folder; pictures only when they were kept."""
    scenario = store.scenario()
    order: list[str] = [*scenario.methods]
    found = store.trials("case_index = 0 AND world = 0 AND trial < ?", FEW)
    first = sorted(found, key=lambda t: (order.index(t.method), t.trial))
    floor = store.read_json("summary.json")["arm_floor_mm"]
    folder, written = store.figures, []
    if any(trial.views for trial in first):
        last = [trial for trial in first if trial.method == order[-1]][:2]
        written += save(schematic(last, nominal), folder / "schematic")
        written += save(distance_errors(first, floor), folder / "distance_errors")
        written += _pictures(store, first)
    if store.count_trials() > FEW:
        trials = store.columns("trials", ("method", "residual_mm"))
        written += save(residual_distribution(trials, floor), folder / "distribution")
    return written


def _pictures(store: RunStore, trials: Sequence[TrialRecord]) -> list[Path]:
    views = list(dict.fromkeys(view.id for trial in trials for view in trial.views))
    standards = {view: store.image_path(0, view) for view in views}
    if not all(path.is_file() for path in standards.values()):
        return []
    written = save(standard_images(standards), store.figures / "standard_images", vector=False)
    for view, standard in standards.items():
        paths = [store.image_path(0, view, trial.trial, trial.method) for trial in trials]
        if any(path.is_file() for path in paths):
            figure = view_comparison(view, standard, list(zip(trials, paths, strict=True)))
            written += save(figure, store.figures / f"view_{view}", vector=False)
    return written
