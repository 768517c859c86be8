"""Your own localiser against ours, on the same displacements: python scenarios/own_localizer.py."""

from dataclasses import replace

import aoicell


def nearest_marker(picture, markers, template, camera):
    """Stands for yours: the positioning marker alone, although all four are in the picture."""
    one = dict(list(template.layout.items())[:1])
    return aoicell.locate_layout(markers, one, camera, template.taught.T_camera_target)


ours = aoicell.METHODS["aoicell"]
methods = [ours, replace(ours, name="mine", localize=nearest_marker)]
scenario = aoicell.load_scenario(aoicell.find("scenarios", "random_displacement"), pictures=False)
session = aoicell.prepare(scenario, aoicell.load_nominal(scenario.cell_folder), 0, methods)
for trial in range(5):
    for result in aoicell.run_trial(session, trial):
        left = aoicell.trial_values(result.record)["residual_mm"]
        print(f"trial {trial}, {result.record.method:8} {result.record.outcome}: {left:.3f} mm")
