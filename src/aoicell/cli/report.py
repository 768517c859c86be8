"""The command that draws a run: its figures and one page that explains it."""

import json
from pathlib import Path
from typing import Annotated

import typer

from aoicell.benchmark.store import RunStore
from aoicell.cli.app import AsJson, app, err, out
from aoicell.nominal import load_nominal


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help="A run directory.", show_default=False)],
    as_json: AsJson = False,
) -> None:
    """One self-contained report.html, and all figures as PNG, SVG and PDF.

    The page lies in the run directory; it needs no network and can be sent as it is.

    Example: aoicell report runs/two_tests
    """
    from aoicell.report.figures import write_figures  # these bring Matplotlib
    from aoicell.report.page import write_page

    store = RunStore(run)
    page, _ = write_page(store)
    finished = (run / "summary.json").is_file()
    if finished and not any(store.figures.glob("schematic.*")):  # 'run' has drawn these, mostly
        scenario = store.scenario()
        write_figures(store, scenario.fitted(load_nominal(scenario.cell_folder)))
    figures = sorted(store.figures.iterdir())
    if as_json:
        print(json.dumps({"report": str(page), "bytes": page.stat().st_size, "finished": finished,
                          "figures": [str(path) for path in figures]}))  # fmt: skip
        return
    out.print(str(page), markup=False, highlight=False, soft_wrap=True)
    state = "" if finished else "; the run is not finished"
    err.print(
        f"{page.stat().st_size / 1e6:.1f} MB; {len(figures)} files of figures are in "
        f"{store.figures}{state}",
        markup=False, highlight=False, soft_wrap=True,
    )  # fmt: skip
