"""Manifests: nothing is guessed, and every complaint is one clear sentence."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from aoicell.datasets.manifest import Manifest, PairViews, PictureViews, load_manifest
from aoicell.datasets.recording import read_recording
from aoicell.datasets.writer import to_toml
from aoicell.errors import InputError

from .robots import MANIFEST
from .two_cameras import MANIFEST as SHARED

CAMERA = '[camera]\nintrinsics = "camera.yaml"\nrefine = true\n'
SHARED_TARGET = SHARED[
    SHARED.index("[[target]]") : SHARED.index('[[target]]\nkind = "chessboard"\nname = "arm"')
].replace('"table"', '"second"')
PAIRS = """mount = "eye_to_hand"
[views]
pairs = "samples.json"
pair_format = "json_effector_and_object"
pose_meaning = "T_base_flange"
length_unit = "m"
"""


def load(folder: Path, text: str) -> Manifest:
    path = folder / "m.toml"
    path.write_text(text, encoding="utf-8")
    return load_manifest(path)


def complaint(folder: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        load(folder, text)
    message = str(caught.value)
    assert message.startswith(f"{folder / 'm.toml'}: ")
    assert "\n" not in message
    return message.removeprefix(f"{folder / 'm.toml'}: ")


# -- What is read ------------------------------------------------------------------------


def test_the_manifest_of_pictures(tmp_path: Path) -> None:
    manifest = load(tmp_path, MANIFEST + CAMERA)
    assert manifest.mount == "eye_in_hand"
    assert isinstance(manifest.views, PictureViews)
    assert manifest.views.pose_format == "matrix4x4_row_major"
    assert manifest.target[0].kind == "chessboard"
    assert manifest.cameras[0].refine


def test_the_manifest_of_pose_pairs(tmp_path: Path) -> None:
    manifest = load(tmp_path, PAIRS)
    assert isinstance(manifest.views, PairViews)
    assert manifest.target == []


def test_several_cameras_have_pictures_of_their_own(tmp_path: Path) -> None:
    text = MANIFEST.replace('images = "images/*.png"\n', "")
    second = text[text.index("[[target]]") : text.index("[views]")]
    own = text.replace("rows = 6", 'rows = 6\ncamera = "tripod"\nmount = "eye_to_hand"')
    own += second.replace("rows = 6", 'rows = 6\ncamera = "hand"')
    cameras = '[[camera]]\nname = "hand"\nimages = "a/*"\n[[camera]]\nname = "tripod"\n'
    manifest = load(tmp_path, own + cameras + 'images = "b/*"\n')
    assert [camera.name for camera in manifest.cameras] == ["hand", "tripod"]
    assert manifest.target[0].mount == "eye_to_hand"
    assert [manifest.side_of(c) for c in manifest.cameras] == ["eye_in_hand", "eye_to_hand"]
    assert "key 'images' of camera 'tripod' is missing" in complaint(tmp_path, own + cameras)


def test_a_target_seen_by_two_cameras(tmp_path: Path) -> None:
    manifest = load(tmp_path, SHARED)
    assert manifest.target[0].camera == ["hand", "tripod"]
    assert [manifest.side_of(c) for c in manifest.cameras] == ["eye_in_hand", "eye_to_hand"]
    assert manifest.first_target_seen_by == "hand"
    assert manifest.seen_by(manifest.cameras[1]) == list(manifest.target)
    assert load(tmp_path, to_toml(manifest)) == manifest


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('name = "tripod"\nmount = "eye_to_hand"', 'name = "tripod"',
         "key 'camera.1.mount' is missing; 'target.0' is seen by hand too"),
        ('name = "hand"\nmount = "eye_in_hand"', 'name = "hand"',
         "key 'camera.0.mount' is missing; 'target.0' is seen by tripod too"),
        ('["hand", "tripod"]', '["hand", "tripd"]',
         "'target.0.camera' = 'tripd' is no camera; did you mean 'tripod'?"),
        ('["hand", "tripod"]', '["hand", "hand"]', "'hand' stands twice"),
        ('["hand", "tripod"]', "[]", "'target.0.camera' = []: "),
        ('["hand", "tripod"]', '"tripod"', "no target names camera 'hand'"),
        ('name = "tripod"\nmount = "eye_to_hand"', 'name = "tripod"\nmount = "table"',
         "'camera.1.mount' = 'table': give one of 'eye_in_hand', 'eye_to_hand'"),
    ],
)  # fmt: skip
def test_what_two_cameras_leave_open_is_named(
    tmp_path: Path, old: str, new: str, expected: str
) -> None:
    assert old in SHARED
    assert expected in complaint(tmp_path, SHARED.replace(old, new))


def test_targets_of_both_mounts_leave_the_cameras_open(tmp_path: Path) -> None:
    text = SHARED.replace('["hand", "tripod"]', '"tripod"').replace(
        'name = "hand"\nmount = "eye_in_hand"\n', 'name = "hand"\n'
    )
    text = text.replace('name = "tripod"\nmount = "eye_to_hand"', 'name = "tripod"')
    text = text.replace(
        "[views]", SHARED_TARGET.replace('["hand", "tripod"]', '"hand"') + "[views]"
    )
    message = complaint(tmp_path, text)
    assert "key 'camera.1.mount' is missing; its targets differ in their mount" in message


def test_a_camera_beside_all_its_targets_is_refused(tmp_path: Path) -> None:
    text = MANIFEST + CAMERA + 'mount = "eye_to_hand"\n'
    assert "the arm moves none of them in a picture" in complaint(tmp_path, text)
    assert load(tmp_path, text.replace('"eye_to_hand"', '"eye_in_hand"')).camera[0].mount


# -- What is refused ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "choices"),
    [
        ("mount", "'eye_in_hand', 'eye_to_hand'"),
        ("views.pose_format", "'matrix4x4_row_major', 'xyz_quat_xyzw', 'xyz_quat_wxyz', "),
        ("views.pose_meaning", "'T_base_flange', 'T_flange_base'"),
        ("views.length_unit", "'m', 'mm'"),
        ("views.pairing", "'order', 'name'"),
        ("target.0.kind", "'chessboard', 'charuco', "),
    ],
)
def test_a_missing_convention_lists_the_choices(tmp_path: Path, key: str, choices: str) -> None:
    name = key.split(".")[-1]
    text = "\n".join(x for x in MANIFEST.splitlines() if not x.startswith(f"{name} ="))
    expected = f"key '{key}' is missing; nothing is guessed: give one of {choices}"
    assert complaint(tmp_path, text).startswith(expected)


@pytest.mark.parametrize("key", ["columns", "rows", "square_mm", "poses"])
def test_other_missing_keys_are_named(tmp_path: Path, key: str) -> None:
    text = "\n".join(x for x in MANIFEST.splitlines() if not x.startswith(f"{key} ="))
    message = complaint(tmp_path, text)
    assert f".{key}' is missing" in message


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("pose_meaning", "pose_meanin", "unknown key 'views.pose_meanin'; did you mean 'pose_mean"),
        ('"m"', '"cm"', "'views.length_unit' = 'cm': give one of 'm', 'mm'"),
        ('"eye_in_hand"', '"eye_on_hand"', "'mount' = 'eye_on_hand': give one of 'eye_in_hand', "),
        ('"chessboard"', '"chesboard"', "'target.0.kind' = 'chesboard': did you mean 'chessboard'"),
        ("columns = 9", "columns = 9.5", "'target.0.columns' = 9.5: input should be a valid int"),
        ("columns = 9", "columns = 1", "'target.0.columns' = 1: input should be greater than or"),
        ("25.0", "-25.0", "'target.0.square_mm' = -25.0: input should be greater than 0"),
        ("25.0", "nan", "'target.0.square_mm' = nan: input should be a finite number"),
        ("square_mm", "square", "unknown key 'target.0.square'; did you mean 'square_mm'?"),
        ("[views]", "[vews]", "unknown key 'vews'; did you mean 'views'?"),
        ('"images/*.png"', "3", "'views.images' = 3: input should be a valid string"),
        ('images = "images/*.png"\n', "", "key 'images' of views is missing; give a glob"),
        ("rows = 6", 'rows = 6\ncamera = "x"', "'target.0.camera' = 'x' is no camera; known: "),
    ],
)
def test_wrong_values_are_named(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert complaint(tmp_path, MANIFEST.replace(old, new)).startswith(expected)


@pytest.mark.parametrize(
    ("extra", "expected"),
    [
        ("[camera]\nrefine = false", "'camera.0': refine = false needs 'intrinsics'"),
        ("[camera]\nrefin = true", "unknown key 'camera.0.refin'; did you mean 'refine'?"),
        ('[camera]\nimages = "a/*"', "'views.images' = 'images/*.png' and 'camera.images' = 'a/*'"),
        ('[camera]\ncamera_in_file = "cam0"', "'camera.0': camera_in_file needs 'intrinsics'"),
        ('[[camera]]\nname = "a"\n[[camera]]\nname = "a"', "'camera.name' = 'a' stands twice"),
        (
            '[[camera]]\nname = "a"\n[[camera]]\nname = "b"',
            "'views.images' = 'images/*.png' cannot",
        ),
        ("camera = 3", "unknown key 'views.camera'"),
    ],
)
def test_cameras_that_contradict_are_named(tmp_path: Path, extra: str, expected: str) -> None:
    assert complaint(tmp_path, MANIFEST + extra).startswith(expected)


def test_with_several_cameras_a_target_has_to_name_its_own(tmp_path: Path) -> None:
    text = MANIFEST.replace('images = "images/*.png"\n', "")
    text += '[[camera]]\nname = "a"\nimages = "a/*"\n[[camera]]\nname = "b"\nimages = "b/*"\n'
    expected = "key 'target.0.camera' is missing; with several cameras name one of a, b"
    assert complaint(tmp_path, text) == expected


def test_pictures_need_a_target_and_pairs_take_none(tmp_path: Path) -> None:
    head, views = MANIFEST.split("[[target]]")[0], MANIFEST[MANIFEST.index("[views]") :]
    assert complaint(tmp_path, head + views).startswith("key 'target' is missing")
    assert complaint(tmp_path, PAIRS + CAMERA).startswith(
        "'camera' has no use beside 'views.pairs'"
    )


CHARUCO = MANIFEST.replace(
    'kind = "chessboard"', 'kind = "charuco"\nmarker_mm = 18.0\ndictionary = "DICT_6X6_250"'
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (CHARUCO, "'target.0': legacy is missing; with an even number of rows (6) give true"),
        (CHARUCO.replace("18.0", "25.0"), "'target.0': marker_mm = 25 has to be below square_mm"),
        (
            CHARUCO.replace("6X6_250", "6X6_251"),
            "'target.0.dictionary' = 'DICT_6X6_251': that is no dictionary; did",
        ),
    ],
)
def test_a_charuco_board_is_checked(tmp_path: Path, text: str, expected: str) -> None:
    assert complaint(tmp_path, text).startswith(expected)


APRILTAG = MANIFEST.replace('"chessboard"', '"apriltag"\nfamily = "tag36h11"').replace(
    "square_mm", "tag_mm"
)


def test_a_grid_of_tags_is_described_in_full(tmp_path: Path) -> None:
    assert complaint(tmp_path, APRILTAG).startswith("'target.0': gap_mm is missing; a grid of tags")
    with_gap = APRILTAG.replace("[views]", "gap_mm = 5.0\n[views]")
    expected = "'target.0': from_bottom is missing; give true where the lowest id stands at the"
    assert complaint(tmp_path, with_gap).startswith(expected)
    whole = with_gap.replace("[views]", "from_bottom = true\n[views]")
    assert load(tmp_path, whole).target[0].kind == "apriltag"
    unknown = complaint(tmp_path, whole.replace("tag36h11", "tag36h12"))
    assert unknown.startswith("'target.0.family' = 'tag36h12': that is no family of tags; did")


def test_an_odd_number_of_rows_needs_no_legacy(tmp_path: Path) -> None:
    assert load(tmp_path, CHARUCO.replace("rows = 6", "rows = 7")).target[0].kind == "charuco"


@pytest.mark.parametrize("content", [b"a = ", b"\xff", b"x=" + b"1" * 5000, b"x=" + b"[" * 5000])
def test_a_broken_file_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "m.toml").write_bytes(content)
    with pytest.raises(InputError, match=r"m.toml: not valid TOML"):
        load_manifest(tmp_path / "m.toml")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent.toml: no such manifest"):
        load_manifest(tmp_path / "absent.toml")


# -- Anything at all ---------------------------------------------------------------------

WORDS = [
    "eye_in_hand", "chessboard", "charuco", "DICT_4X4_50", "m", "name", "order", "images/*.png",
    "poses.csv", "named_quat", "T_base_flange", "camera", "pose_pairs", "pictures", "[", "a*b?",
]  # fmt: skip
KEYS = [
    *Manifest.model_fields, *PictureViews.model_fields, *PairViews.model_fields, "kind", "columns",
    "square_mm", "marker_mm", "dictionary", "intrinsics", "refine", "chessboard", "pictures", "",
]  # fmt: skip
scalars = st.one_of(
    st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(), st.sampled_from(WORDS),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="*?["), max_size=5),
)  # fmt: skip
anything = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(st.sampled_from(KEYS), inner, max_size=3)
    ),
    max_leaves=4,
)


def places(table: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    inner = table.items() if isinstance(table, dict) else enumerate(table)
    found = [at]
    for key, value in inner:
        found += places(value, (*at, key)) if isinstance(value, dict | list) else [(*at, key)]
    return found


@st.composite
def mutated(draw: st.DrawFn) -> str:
    """A sound manifest with up to three places replaced, deleted or added to."""
    text = draw(st.sampled_from([MANIFEST + CAMERA, PAIRS, CHARUCO]))
    values = tomllib.loads(text)
    for _ in range(draw(st.integers(1, 3))):
        place = draw(st.sampled_from([p for p in places(values) if p] or [("mount",)]))
        parent: Any = values
        for key in place[:-1]:
            parent = parent[key]
        action = draw(st.sampled_from(["replace", "delete", "add"]))
        if action == "replace":
            parent[place[-1]] = draw(anything)
        elif action == "delete":
            parent.pop(place[-1], None) if isinstance(parent, dict) else parent.pop(place[-1])
        elif isinstance(parent, dict):
            parent[draw(st.sampled_from(KEYS))] = draw(anything)
    return tomli_w.dumps(values)


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(text=mutated())
def test_a_mutated_manifest_is_read_or_complained_about(tmp_path: Path, text: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:  # the files that it names do not exist
        read_recording(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_number_too_long_to_be_shown_is_a_complaint_too(tmp_path: Path) -> None:
    absurd = MANIFEST.replace('"eye_in_hand"', "0x" + "f" * 5000)
    assert complaint(tmp_path, absurd).startswith("'mount' = ...: give one of")
