"""Program files: what is written is read bit for bit, and what is wrong is told."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.programs import FILES, TWO_VIEWS
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.errors import InputError
from aoicell.nominal import Nominal
from aoicell.planning.program import Move, Program, in_degrees
from aoicell.planning.program_file import load_program, write_program

GOLDEN = FILES / "two_views.json"


def test_the_file_is_as_it_was(tmp_path: Path) -> None:
    write_program(TWO_VIEWS, tmp_path / "program.json")
    assert (tmp_path / "program.json").read_text() == GOLDEN.read_text()


def test_the_file_is_the_program(nominal: Nominal) -> None:
    assert load_program(GOLDEN, nominal) == TWO_VIEWS


@given(
    shares=st.lists(st.floats(0, 1), min_size=6, max_size=6),
    duration=st.floats(5, 1e6, exclude_min=True),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_read_is_what_was_planned_bit_for_bit(
    nominal: Nominal, tmp_path: Path, shares: list[float], duration: float
) -> None:
    arm = nominal.arm
    q = arm.lower + 1e-6 + np.array(shares) * (arm.upper - arm.lower - 2e-6)
    move = Move("there", in_degrees(q), duration)
    program = Program("p", "ra620_1621", arm.joint_names, in_degrees(nominal.q_home), (move,))
    write_program(program, tmp_path / "p.json")
    (again,) = load_program(tmp_path / "p.json", nominal).moves
    assert again.q.tobytes() == move.q.tobytes()
    assert again.duration == duration
    assert np.abs(again.q - q).max() < 1e-8


def test_the_folder_is_made(tmp_path: Path) -> None:
    write_program(TWO_VIEWS, tmp_path / "new" / "program.json")
    assert (tmp_path / "new" / "program.json").is_file()


def test_where_it_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"p\.json: cannot be written \("):
        write_program(TWO_VIEWS, tmp_path / "file" / "p.json")


# -- What is wrong is told ----------------------------------------------------


def complaint(path: Path, nominal: Nominal) -> str:
    with pytest.raises(InputError) as caught:
        load_program(path, nominal)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert caught.value.exit_code == 2
    return message.removeprefix(f"{path}: ")


def put(*keys: str | int, value: Any) -> Callable[[dict], None]:
    def change(program: dict) -> None:
        for key in keys[:-1]:
            program = program[key]
        program[keys[-1]] = value

    return change


def drop(*keys: str | int) -> Callable[[dict], None]:
    def change(program: dict) -> None:
        for key in keys[:-1]:
            program = program[key]
        del program[keys[-1]]

    return change


FIVE = [0.0, -8.0, -23.0, 0.0, -59.0]
SIX = [*FIVE, -68.0]

WRONG = [
    (put("schema", value=2), "'schema' is 2; it must be 1"),
    (drop("schema"), "key 'schema' is missing"),
    (put("nmae", value="x"), "unknown key 'nmae'; did you mean 'name'?"),
    (put("name", value=""), "'name' is ''; it must be a text"),
    (put("arm", value="ra620_1621"), "'arm' is 'ra620_1621'; it must be an object"),
    (put("arm", "name", value="ur5"), "'arm.name' is 'ur5'; it must be 'ra620_1621', the arm of"),
    (put("arm", "joints", value=["a"]), "'arm.joints' is ['a']; it must be those of the arm"),
    (put("arm", "maker", value="HIWIN"), "unknown key 'arm.maker'"),
    (put("start_deg", value=FIVE), "'start_deg' is [0.0, -8.0, -23.0, 0.0, -59.0]; it must be 6"),
    (put("start_deg", 1, value=101.0), "joint_2 at 101 deg is not from -135 to 100 deg"),
    (put("steps", value={}), "'steps' is {}; it must be a list of steps"),
    (put("steps", 1, value=7), "'steps[1]' is 7; it must be an object with the key 'step'"),
    (put("steps", 1, value={}), "key 'steps[1].step' is missing"),
    (put("steps", 1, "step", value="mvoe"), "'move' or 'capture'; did you mean 'move'?"),
    (put("steps", 1, "step", value=None), "'steps[1].step' is None; it must be 'move' or"),
    (put("steps", 1, "speed", value=1), "unknown key 'steps[1].speed'"),
    (drop("steps", 1, "duration_s"), "key 'steps[1].duration_s' is missing"),
    (put("steps", 1, "joints_deg", value=FIVE), "-59.0]; it must be 6 numbers"),
    (put("steps", 1, "joints_deg", value=[*SIX, 0.0]), "'steps[1].joints_deg' is [0.0, -8.0"),
    (put("steps", 1, "joints_deg", value=None), "'steps[1].joints_deg' is None; it must be 6"),
    (put("steps", 1, "joints_deg", 0, value=float("nan")), "it must be 6 numbers"),
    (put("steps", 1, "joints_deg", 5, value=-180.5), "joint_6 at -180.5 deg is not from -180 to"),
    (put("steps", 1, "duration_s", value=-1), "'steps[1].duration_s' is -1; it must be at least"),
    (put("steps", 1, "duration_s", value="soon"), "'steps[1].duration_s' is 'soon'; it must be 1"),
    (put("steps", 1, "to", value=3), "'steps[1].to' is 3; it must be a text"),
    (put("steps", 2, "view", value="../V1"), "'steps[2].view' is '../V1'; it must be letters"),
    (put("steps", 4, "view", value="V1"), "'steps[4].view' is 'V1'; it must be another name"),
]


@pytest.mark.parametrize(("change", "message"), WRONG, ids=[m for _, m in WRONG])
def test_one_sentence_with_the_key(
    tmp_path: Path, nominal: Nominal, change: Callable[[dict], None], message: str
) -> None:
    program = json.loads(GOLDEN.read_text())
    change(program)
    path = tmp_path / "program.json"
    path.write_text(json.dumps(program))
    assert message in complaint(path, nominal)


def test_faster_than_the_drives(tmp_path: Path, nominal: Nominal) -> None:
    program = json.loads(GOLDEN.read_text())
    path = tmp_path / "program.json"
    # joint 1 has the longest way to the first stop: 20 deg, at 192 deg/s
    needed = np.radians(20) / nominal.arm.velocity_limits[0]
    for share, fits in ((1.001, True), (0.999, False)):
        program["steps"][0]["duration_s"] = share * needed
        path.write_text(json.dumps(program))
        if fits:
            load_program(path, nominal)
        else:
            assert "at least 0.104, which joint_1 needs" in complaint(path, nominal)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"{", "not valid JSON ("),
        (b"\xff", "not valid JSON ("),
        (b"[" * 100_000, "not valid JSON ("),
        (b"[]", "holds []; a program is a JSON object"),
    ],
)
def test_what_is_no_program_at_all(
    tmp_path: Path, nominal: Nominal, data: bytes, message: str
) -> None:
    path = tmp_path / "program.json"
    path.write_bytes(data)
    assert complaint(path, nominal).startswith(message)


def test_a_missing_file(tmp_path: Path, nominal: Nominal) -> None:
    assert complaint(tmp_path / "none.json", nominal).startswith("cannot be read (")


def test_a_program_for_another_arm(second_cell: Nominal) -> None:
    assert "it must be 'second'" in complaint(GOLDEN, second_cell)
