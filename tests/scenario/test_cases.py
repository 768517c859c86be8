"""The cases of a scenario: all combinations, merged changes, sources off and alone."""

from pathlib import Path

import pytest

from aoicell.errors import ScenarioError
from aoicell.scenario import Scenario, ShiftRange, TurnRange, cases_of
from aoicell.sim.profiles import PAPER, PROFILES, TYPICAL
from aoicell.sim.sources import SOURCES, all_but, only
from scenario.written import NAME, RICH, SWEPT, complaint, load


def test_a_plain_scenario_is_its_own_single_case() -> None:
    scenario = Scenario(name="x", seed=3)
    (case,) = cases_of(scenario)
    assert (case.index, case.kind, case.label, case.scenario) == (0, "as it stands", "", scenario)


# -- Sweeps -----------------------------------------------------------------------------


def test_a_sweep_makes_every_combination_the_last_key_fastest(tmp_path: Path) -> None:
    text = NAME + "seed = 9\n[sweep]\nseed = [3, 4]\nknobs.noise_grey = [0, 1.5, 8]"
    cases = cases_of(load(tmp_path, text))
    made = [(c.scenario.seed, c.scenario.tolerances.noise_grey) for c in cases]
    assert made == [(3, 0), (3, 1.5), (3, 8), (4, 0), (4, 1.5), (4, 8)]
    assert [case.index for case in cases] == list(range(6))
    assert cases[1].label == "seed = 3, noise_grey = 1.5"
    assert {case.kind for case in cases} == {"sweep"}
    for case in cases:
        assert case.scenario.sweep == {}
        assert case.scenario.tolerances.model_copy(update={"noise_grey": 0.3}) == TYPICAL


def test_labels_show_ranges_and_whole_paths_only_where_they_must(tmp_path: Path) -> None:
    ranges = "[{ min = 5, max = 5 }, { min = 10, max = 20 }]"
    swept = cases_of(load(tmp_path, NAME + f"sweep.displacement.shift_mm = {ranges}"))
    assert [case.label for case in swept] == ["shift_mm = 5", "shift_mm = 10 to 20"]
    assert swept[1].scenario.displacement.shift_mm == ShiftRange(min=10, max=20)
    both = "sweep.displacement = { turn_deg.max = [20, 30], tilt_deg.max = [1] }"
    labels = [case.label for case in cases_of(load(tmp_path, NAME + both))]
    assert labels[0] == "displacement.turn_deg.max = 20, displacement.tilt_deg.max = 1"
    flags = cases_of(load(tmp_path, NAME + 'sweep = { colour = [true], title = ["a\\nb"] }'))
    assert [case.label for case in flags] == ["colour = true, title = 'a\\nb'"]


def test_cells_can_be_swept_and_are_called_by_what_tells_them_apart(folder: Path) -> None:
    for name in ("a/cell", "b/cell"):
        (folder / name).mkdir(parents=True)
        (folder / name / "nominal.toml").touch()
    cases = cases_of(load(folder, NAME + 'sweep.cell = ["a/cell", "b/cell"]'))
    assert [case.label for case in cases] == ["cell = a/cell", "cell = b/cell"]
    assert [case.scenario.cell_folder for case in cases] == [
        (folder / name / "cell").resolve() for name in "ab"
    ]
    assert cases_of(load(folder, NAME + 'sweep.cell = ["a/cell"]'))[0].label == "cell = cell"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("seed = 3", "'sweep.seed' = 3: give a list of at least one value"),
        ("seed = []", "'sweep.seed' = []: give a list of at least one value"),
        ("knobs = {}", "'sweep.knobs' = {}: give a list of at least one value"),
        (
            "seed = [1, -1]",
            "'sweep.seed' = -1: give an integer from 0 to 4294967295 (in the case 'seed = -1')",
        ),
        (
            "knobs.k1 = [0, 7]\nworlds = [2]",
            "'sweep.knobs.k1' = 7: give a number from -0.5 to 0.5 (in the case 'k1 = 7, worlds = 2",
        ),
        ("sede = [1]", "unknown key 'sweep.sede'; did you mean 'seed'? (in the case 'sede = 1')"),
        ('"knobs.k1" = [0]', "unknown key 'sweep.\"knobs.k1\"'; did you mean 'knobs'?"),
        ('profile = ["papr"]', "'sweep.profile' = 'papr': did you mean 'paper'? (in the case"),
        ("displacement.shift_mm = [5]", "'sweep.displacement.shift_mm' = 5: give a list of at"),
        (
            "displacement.shift_mm = [[5]]",
            "'sweep': 'displacement.shift_mm' lists 1 distances for trials_per_world = 2; give one "
            "a trial, or a range (in the case 'shift_mm = [5]')",
        ),
        ("seed = [1, 2, 1]", "'sweep.seed.2' = 1: it stands there twice"),
        ('name = ["a"]', "'sweep.name': 'name' is one for all cases; leave it out here"),
        ("methods = [1]", "'sweep.methods': 'methods' is one for all cases"),
        ("store.images = [true]", "'sweep.store': 'store' is one for all cases"),
        ("sweep.seed = [1]", "'sweep.sweep': 'sweep' is one for all cases"),
        ("cell = [3]", "'sweep.cell' = 3: give a text"),
        ("seed = [0x" + "f" * 5000 + "]", "'sweep.seed' = ...: give an integer from 0"),
    ],
)
def test_a_bad_sweep_is_named_with_its_case(tmp_path: Path, text: str, expected: str) -> None:
    assert complaint(tmp_path, NAME + "[sweep]\n" + text).startswith(expected)


def test_a_sweep_is_counted_before_it_is_made(tmp_path: Path) -> None:
    lists = "".join(f"{key} = {list(range(1, 501))}\n" for key in ("seed", "worlds"))
    message = complaint(tmp_path, NAME + "[sweep]\n" + lists)
    assert message == "'sweep' makes 250000 cases; at most 1000 are accepted"


@pytest.mark.parametrize("key", ['ablate = "each source"', "cases.x.seed = 1"])
def test_a_sweep_stands_alone(tmp_path: Path, key: str) -> None:
    message = complaint(tmp_path, NAME + key + "\nsweep.seed = [1, 2]")
    assert (
        message
        == f"'sweep' and '{key[:6].rstrip('.x')}' cannot stand together; make two files of it"
    )


# -- Named changes ------------------------------------------------------------------------


def test_named_cases_come_after_the_scenario_as_it_stands(folder: Path) -> None:
    scenario = load(folder, RICH)
    cases = cases_of(scenario)
    assert [(c.kind, c.label) for c in cases[:3]] == [
        ("as it stands", ""), ("named", "strong noise"), ("named", "large"),
    ]  # fmt: skip
    plain, noise, large = (case.scenario for case in cases[:3])
    assert plain.cases == {}
    assert plain.tolerances == scenario.tolerances
    assert noise.knobs == {**scenario.knobs, "noise_grey": 8, "electrons_per_grey": 2}
    assert (noise.title, noise.displacement) == ("Noise", scenario.displacement)
    assert large.seed == 8
    assert large.cell_folder == scenario.cell_folder


def test_tables_are_merged_key_by_key_and_lists_replaced(folder: Path) -> None:
    large = cases_of(load(folder, RICH))[2].scenario.displacement
    assert large.shift_mm == ShiftRange(min=100, max=150)  # a list before
    assert large.turn_deg == TurnRange(min=-15, max=45)
    assert (large.lift_mm.max, large.tilt_deg.max) == (10, 3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("light.seed = -1", "'cases.light.seed' = -1: give an integer from 0 to 4294967295"),
        ('"dim light".sede = 1', "unknown key 'cases.\"dim light\".sede'; did you mean 'seed'?"),
        ("x.knobs.k1 = 7", "'cases.x.knobs.k1' = 7: give a number from -0.5 to 0.5"),
        ("x.displacement.shift_mm.list = 1", "unknown key 'cases.x.displacement.shift_mm.list'; "),
        (
            "x.displacement.shift_mm = [3]",
            "'cases.x': 'displacement.shift_mm' lists 1 distances for trials_per_world = 2",
        ),
        ("x.store.images = true", "'cases.x.store': 'store' is one for all cases"),
        ('x.methods = ["paper"]', "'cases.x.methods': 'methods' is one for all cases"),
        ("x.ablate = []", "'cases.x.ablate': 'ablate' is one for all cases"),
        ("x = 3", "'cases.x' = 3: give a table"),
        ('x.cell = "nowhere"', "'cases.x.cell' = 'nowhere': there is no nominal.toml in it"),
    ],
)
def test_a_bad_change_is_named_by_its_path(tmp_path: Path, text: str, expected: str) -> None:
    assert complaint(tmp_path, NAME + "[cases]\n" + text).startswith(expected)


def test_cases_are_counted(tmp_path: Path) -> None:
    many = "".join(f"c{i}.seed = {i}\n" for i in range(1001))
    message = complaint(tmp_path, NAME + "[cases]\n" + many)
    assert message == "'cases' makes 1001 cases; at most 1000 are accepted"


# -- Sources ------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", ["typical", "paper"])
def test_each_source_alone_and_all_but_each(profile: str) -> None:
    scenario = Scenario(name="x", profile=profile, ablate="each source", isolate="each source")
    cases = cases_of(scenario)
    full = PROFILES[profile]
    expected = [("as it stands", "", full)]
    expected += [("alone", source, only(full, source)) for source in SOURCES]
    expected += [("without", source, all_but(full, source)) for source in SOURCES]
    assert [(c.kind, c.label, c.scenario.tolerances) for c in cases] == expected
    assert {c.scenario.profile for c in cases if c.kind == "without"} == {profile}


def test_each_source_means_each_that_is_on(tmp_path: Path) -> None:
    text = 'profile = "ideal"\nablate = "each source"\n[knobs]\njoint_zero_deg = 0.1'
    cases = cases_of(load(tmp_path, NAME + text))
    assert [case.label for case in cases] == ["", "arm geometry"]
    assert cases_of(load(tmp_path, NAME + 'profile = "ideal"\nisolate = "each source"'))[1:] == []


def test_a_single_knob_is_a_source_too(tmp_path: Path) -> None:
    text = 'profile = "paper"\nablate = ["k1"]\nisolate = ["k1", "gravity"]\n[knobs]\nk1 = -0.2'
    _, alone, gravity, without = cases_of(load(tmp_path, NAME + text))
    assert alone.scenario.tolerances.model_dump(exclude_defaults=True) == {"k1": -0.2}
    assert gravity.scenario.tolerances == only(PAPER, "gravity")
    assert without.scenario.tolerances == PAPER.model_copy(update={"k1": 0})


def test_a_source_that_is_off_cannot_be_named(tmp_path: Path) -> None:
    message = complaint(tmp_path, NAME + 'ablate = ["gravity", "occlusion_percent"]')
    assert message.startswith("'ablate.1' = 'occlusion_percent': it is off in profile 'typical'")


# -- All of them --------------------------------------------------------------------------


@pytest.mark.parametrize("text", [RICH, SWEPT])
def test_every_case_is_a_file_of_its_own(folder: Path, text: str) -> None:
    cases = cases_of(load(folder, text))
    assert len({(case.kind, case.label) for case in cases}) == len(cases)
    for case in cases:
        assert load(folder, case.scenario.to_toml()) == case.scenario
        assert [c.scenario for c in cases_of(case.scenario)] == [case.scenario]


def test_a_scenario_that_no_file_held_is_checked_too() -> None:
    with pytest.raises(ScenarioError, match=r"'sweep\.seed' = -1"):
        cases_of(Scenario(name="x", sweep={"seed": [-1]}))
