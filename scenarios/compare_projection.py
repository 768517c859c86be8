"""Do projected points give the same residuals as rendered pictures? The same cells, both ways.

python scenarios/compare_projection.py [CELLS] [PROFILE] [SOURCE]

With SOURCE (for example "image and dust") that error source alone. Intervals are 95 % bootstrap
intervals over cells, both ways of a cell drawn together; the Kolmogorov-Smirnov test takes single
trials.
"""

import sys

import numpy as np
from scipy.stats import ks_2samp

import aoicell
from aoicell.benchmark.values import trial_values
from aoicell.sim.sources import only

QUANTITIES = ("residual_mm", "lateral_mm", "true_px")

Values = dict[tuple[str, str], list[float]]  # by method and quantity, over the trials of a cell


def run(scenario: aoicell.Scenario, nominal: aoicell.Nominal, world: int) -> Values:
    """All trials of a cell, NaN where one was refused."""
    found: Values = {}
    session = aoicell.prepare(scenario, nominal, world)
    for trial in range(scenario.trials_per_world):
        for result in aoicell.run_trial(session, trial):
            values = trial_values(result.record)
            for name in QUANTITIES:
                value = values[name]
                found.setdefault((result.record.method, name), []).append(
                    np.nan if value is None else value
                )
    session.world.close()
    return found


def compare(rendered: np.ndarray, projected: np.ndarray) -> str:
    """Both ways (cells, trials) side by side; cells with a refused trial are left out."""
    known = np.isfinite(rendered).all(axis=1) & np.isfinite(projected).all(axis=1)
    a, b = rendered[known], projected[known]
    drawn = np.random.default_rng(0).integers(len(a), size=(4000, len(a)))
    means = b[drawn].mean(axis=(1, 2)) / a[drawn].mean(axis=(1, 2))
    logs = np.log(b / a).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    geo_low, geo_high = np.exp(np.percentile(logs[drawn].mean(axis=1), [2.5, 97.5]))
    return (
        f"{len(a):4} cells {a.mean():8.3f} rendered {b.mean():8.3f} projected   ratio of means "
        f"{b.mean() / a.mean():.3f} ({low:.3f} to {high:.3f})   geometric mean of the ratio "
        f"{np.exp(logs.mean()):.3f} ({geo_low:.3f} to {geo_high:.3f})   Kolmogorov-Smirnov p "
        f"{ks_2samp(a.ravel(), b.ravel()).pvalue:.2f}"
    )


def main(cells: str = "10", profile: str = "paper", source: str = "") -> None:
    """Run the cells both ways and print a line for each method and quantity."""
    scenario = aoicell.load_scenario(aoicell.find("scenarios", "error_budget"), profile=profile)
    nominal = aoicell.load_nominal(scenario.cell_folder)
    if source:
        knobs = only(scenario.tolerances, source).model_dump()
        scenario = scenario.model_copy(update={"profile": "ideal", "knobs": knobs})
    both = [
        [run(scenario.model_copy(update={"pictures": pictures}), nominal, world)
         for world in range(int(cells))]
        for pictures in (True, False)
    ]  # fmt: skip
    for method in scenario.methods:
        for name in QUANTITIES:
            rendered, projected = ([cell[method, name] for cell in way] for way in both)
            line = compare(np.array(rendered), np.array(projected))
            print(f"{profile}, {source or 'all sources'}, {method:8} {name:12} {line}")


if __name__ == "__main__":
    main(*sys.argv[1:])
