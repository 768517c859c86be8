"""Scenario files as the tests write them."""

from pathlib import Path
from typing import Any

import pytest

from aoicell.errors import ScenarioError
from aoicell.scenario import Scenario, load_scenario

NAME = 'name = "x"\n'

# every key of a scenario except `sweep`, which cannot stand beside `cases`
RICH = """\
name = "rich"
title = "Every key, ünïcode too"
cell = "../cell"
profile = "paper"
seed = 7
worlds = 3
trials_per_world = 2
methods = ["aoicell", "paper"]
pictures = true
visit = false
views = "../cell/../models/server_board/targets.toml"
inspect = false
inject = ["none", "glare"]
colour = true
tolerance_mm = 2.5
ablate = "each source"
isolate = ["gravity", "print_um"]

[displacement]
shift_mm = [49.1, 50.6]
turn_deg = { min = -15, max = 15.5 }
lift_mm = { min = 0, max = 10 }
tilt_deg = { min = -3, max = 3 }

[knobs]
marker_mm = 0.25
k1 = -0.2
adc_bits = 12

[marker]
kind = "coded"
pitch_mm = 30

[inspection]
defects = 4
kinds = ["missing", "shifted"]
reference = "virtual"
golden_samples = 2

[store]
images = true

[cases."strong noise"]
title = "Noise"
knobs = { noise_grey = 8, electrons_per_grey = 2.0 }

[cases.large]
cell = "../cell"
seed = 8
displacement = { shift_mm = { min = 100, max = 150 }, turn_deg = { max = 45 } }
"""
SWEPT = """\
name = "swept"
trials_per_world = 1

[displacement]
turn_deg = { min = 0, max = 0 }

[sweep]
profile = ["typical", "paper"]
cell = ["../cell", ""]
colour = [false, true]

[sweep.displacement]
shift_mm = [{ min = 5, max = 5 }, { min = 10, max = 20 }, [35.5]]
turn_deg = { max = [1, 2.5] }

[sweep.knobs]
k1 = [-0.1, 0, 0.1]
"""


def load(folder: Path, text: str, **overrides: Any) -> Scenario:
    """Write a file and load it."""
    path = folder / "s.toml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path, **overrides)


def complaint(folder: Path, text: str, **overrides: Any) -> str:
    """What the loader says about a file, without the file's path at its beginning."""
    with pytest.raises(ScenarioError) as caught:
        load(folder, text, **overrides)
    message, start = str(caught.value), f"{folder / 's.toml'}: "
    assert message.startswith(start)
    assert len(message.splitlines()) == 1
    return message.removeprefix(start)
