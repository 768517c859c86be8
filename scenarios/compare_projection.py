"""Do projected points give the same residuals as rendered pictures? The same cells, both ways.

python scenarios/compare_projection.py [CELLS] [PROFILE]
"""

import sys

import numpy as np
from scipy.stats import ks_2samp

import aoicell
from aoicell.benchmark.summary import trial_mean

cells, profile = int((sys.argv[1:] or ["10"])[0]), (sys.argv[2:] or ["paper"])[0]
scenario = aoicell.load_scenario(aoicell.find("scenarios", "error_budget"), profile=profile)
nominal = aoicell.load_nominal(scenario.cell_folder)
left: dict[tuple[str, bool], list[float]] = {}
for world in range(cells):
    for pictures in (False, True):
        this_way = scenario.model_copy(update={"pictures": pictures})
        session = aoicell.prepare(this_way, nominal, world)
        for trial in range(scenario.trials_per_world):
            for result in aoicell.run_trial(session, trial):
                value = trial_mean(result.record, "residual_mm")
                left.setdefault((result.record.method, pictures), []).append(value or np.nan)
        session.world.close()
for method in scenario.methods:
    projected, rendered = (np.array(left[method, pictures]) for pictures in (False, True))
    both = np.isfinite(projected) & np.isfinite(rendered)
    projected, rendered = projected[both], rendered[both]
    ratio = np.exp(np.mean(np.log(projected / rendered)))
    print(
        f"{profile}, {method}: {len(projected)} trials, mean {rendered.mean():.3f} mm rendered, "
        f"{projected.mean():.3f} mm projected, geometric mean of the ratio {ratio:.3f}, "
        f"Kolmogorov-Smirnov p = {ks_2samp(projected, rendered).pvalue:.2f}"
    )
