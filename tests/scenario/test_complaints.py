"""Every complaint is one sentence: the path of the key, its value, all that would be legal."""

from pathlib import Path

import pytest

from aoicell.errors import shown
from aoicell.scenario.complaints import dotted
from scenario.written import NAME, complaint


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # misspelt
        ("sede = 1", "unknown key 'sede'; did you mean 'seed'?"),
        ("[store]\nimage = true", "unknown key 'store.image'; did you mean 'images'?"),
        (
            "[displacement]\nturn_dg = { min = 0, max = 1 }",
            "unknown key 'displacement.turn_dg'; did you mean 'turn_deg'?",
        ),
        ("[displacement]\nlist = 1", "unknown key 'displacement.list'; "),
        (
            "[displacement]\nturn_deg = { min = 0, mx = 1 }",
            "unknown key 'displacement.turn_deg.mx'; did you mean 'max'?",
        ),
        (
            "[displacement]\nshift_mm = { mn = 1, max = 3 }",
            "unknown key 'displacement.shift_mm.mn'; did you mean 'min'?",
        ),
        (
            "[displacement]\nshift_mm = { min = 1, max = 3, zzz = 3 }",
            "unknown key 'displacement.shift_mm.zzz'; known: max, min",
        ),
        ("[knobs]\nmarker_m = 1", "unknown key 'knobs.marker_m'; did you mean 'marker_mm'?"),
        ('[knobs]\nmarker_m = "a"', "unknown key 'knobs.marker_m'; did you mean 'marker_mm'?"),
        ('"knobs.k1" = 1', "unknown key '\"knobs.k1\"'; did you mean 'knobs'?"),
        ('profile = "idael"', "'profile' = 'idael': did you mean 'ideal'?"),
        ('profile = "zzz"', "'profile' = 'zzz': known: ideal, paper, typical"),
        ('methods = ["papr"]', "'methods.0' = 'papr': did you mean 'paper'?"),
        ('ablate = ["gravty"]', "'ablate.0' = 'gravty': did you mean 'gravity'?"),
        ('isolate = ["joint_zero_dg"]', "'isolate.0' = 'joint_zero_dg': did you mean 'joint_zero_"),
        # missing
        (
            "[displacement]\nturn_deg = { min = 0 }",
            "key 'displacement.turn_deg.max' is missing; give a number from -180 to 180",
        ),
        # wrong type
        ("profile = 3", "'profile' = 3: give one of 'ideal', 'typical', 'paper'"),
        (
            "methods = [3]",
            "'methods.0' = 3: give one of 'uncorrected', 'paper', 'aoicell_one_look', 'aoicell', "
            "'markerless'",
        ),
        ('methods = "paper"', "'methods' = 'paper': give a list of at least one value"),
        ("cell = 3", "'cell' = 3: give a text"),
        ("views = 3", "'views' = 3: give a text"),
        ('views = "nowhere.toml"', "'views' = 'nowhere.toml': there is no such file; name a file"),
        ("inspect = true\nvisit = false", "'inspect' goes with visit = true and pictures = true"),
        ("[inspection]\ndefects = 101", "'inspection.defects' = 101: give an integer from 0"),
        ('[inspection]\nkinds = ["mising"]', "'inspection.kinds.0' = 'mising': did you mean 'mis"),
        ("seed = 1.5", "'seed' = 1.5: give an integer from 0 to 4294967295"),
        ('seed = "many"', "'seed' = 'many': give an integer from 0 to 4294967295"),
        ("seed = true", "'seed' = True: give an integer from 0 to 4294967295"),
        ("pictures = 1", "'pictures' = 1: give true or false"),
        ("store = 3", "'store' = 3: give { images = ... }"),
        ("knobs = 3", "'knobs' = 3: give a table"),
        ("sweep = 3", "'sweep' = 3: give a table"),
        ("cases = { list = 3 }", "'cases.list' = 3: give a table"),
        ("ablate = 3", "'ablate' = 3: give a list or 'each source'"),
        ('ablate = "gravity"', "'ablate' = 'gravity': give a list or 'each source'"),
        ("[displacement]\nturn_deg = 3", "'displacement.turn_deg' = 3: give { min = ..., max"),
        (
            "[displacement]\nshift_mm = 3",
            "'displacement.shift_mm' = 3: give a list of at least one value or { min = ..., max",
        ),
        ('[knobs]\nk1 = "big"', "'knobs.k1' = 'big': give a number from -0.5 to 0.5"),
        ("[knobs]\nmarker_mm = true", "'knobs.marker_mm' = True: give a number from 0 to 10"),
        # out of range
        ("seed = -1", "'seed' = -1: give an integer from 0 to 4294967295"),
        ("seed = 4294967296", "'seed' = 4294967296: give an integer from 0 to 4294967295"),
        ("worlds = 0", "'worlds' = 0: give an integer from 1 to 10000"),
        ("trials_per_world = 0", "'trials_per_world' = 0: give an integer from 1 to 100000"),
        ("methods = []", "'methods' = []: give a list of at least one value"),
        ("tolerance_mm = nan", "'tolerance_mm' = nan: give a number from 0.001 to 1000"),
        ("tolerance_mm = -2", "'tolerance_mm' = -2: give a number from 0.001 to 1000"),
        ("[knobs]\njoint_zero_deg = nan", "'knobs.joint_zero_deg' = nan: give a number from 0 to"),
        ("[knobs]\njoint_zero_deg = -1", "'knobs.joint_zero_deg' = -1: give a number from 0 to 5"),
        ("[knobs]\nk1 = 7", "'knobs.k1' = 7: give a number from -0.5 to 0.5"),
        (
            "[displacement]\nturn_deg = { min = nan, max = 1 }",
            "'displacement.turn_deg.min' = nan: give a number from -180 to 180",
        ),
        ("[displacement]\nshift_mm = []", "'displacement.shift_mm' = []: give a list of at least"),
        ("[displacement]\nshift_mm = [-1, 3]", "'displacement.shift_mm.0' = -1: give a number"),
        ("[displacement]\nshift_mm = [1, nan]", "'displacement.shift_mm.1' = nan: give a number"),
        (
            "[displacement]\nshift_mm = { min = nan, max = 3 }",
            "'displacement.shift_mm.min' = nan: give a number from 0 to 300",
        ),
        # more than a line can show
        ("seed = 0x" + "f" * 5000, "'seed' = ...: give an integer from 0 to 4294967295"),
        ("seed." + "a." * 2000 + "a = 1", "'seed' = ...: give an integer from 0 to 4294967295"),
        ("[knobs]\nk1 = 1" + "0" * 400, "...: give a number from -0.5 to 0.5"),
    ],
)
def test_a_complaint_names_key_value_and_all_that_is_legal(
    tmp_path: Path, text: str, expected: str
) -> None:
    message = complaint(tmp_path, NAME + text)
    assert message.startswith(expected) if expected[0] != "." else expected in message
    assert len(message) < 1500


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('nam = "x"', "unknown key 'nam'; did you mean 'name'?"),
        ("seed = 1", "key 'name' is missing; give a text of letters, digits, '_' and '-'"),
        ("name = 3", "'name' = 3: give a text of letters, digits, '_' and '-'"),
        ('name = "a b"', "'name' = 'a b': give a text of letters, digits, '_' and '-'"),
    ],
)
def test_a_name_is_asked_for(tmp_path: Path, text: str, expected: str) -> None:
    assert complaint(tmp_path, text) == expected


def test_paths_are_written_as_toml_writes_them() -> None:
    assert dotted(["cases", "dim light", "knobs", 0]) == 'cases."dim light".knobs.0'
    assert dotted(["a\nb", "é"], "sweep") == r'sweep."a\nb"."\u00e9"'


def test_values_take_one_bounded_line() -> None:
    assert shown({"min": 3}) == "{'min': 3}"
    assert shown("a\nb") == r"'a\nb'"
    assert len(shown("x" * 500)) == 80
