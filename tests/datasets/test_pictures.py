"""Pictures from files: what is read, and why one cannot be used."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image as Pillow

from aoicell.datasets.pictures import picture_size, read_picture
from aoicell.errors import TargetNotFound

GREY = np.add.outer(np.arange(48), np.arange(64)).astype(np.uint8) * 2


def save(path: Path, pixels: object) -> Path:
    Pillow.fromarray(np.asarray(pixels)).save(path)
    return path


def test_grey_stays_grey(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", GREY)
    np.testing.assert_array_equal(read_picture(path), GREY)
    assert picture_size(path) == (64, 48)


def test_colour_is_red_green_blue(tmp_path: Path) -> None:
    rgb = np.dstack([GREY, GREY // 2, GREY // 3])
    np.testing.assert_array_equal(read_picture(save(tmp_path / "a.png", rgb)), rgb)
    rgba = np.dstack([rgb, np.full_like(GREY, 255)])
    np.testing.assert_array_equal(read_picture(save(tmp_path / "b.png", rgba)), rgb)


def test_sixteen_bits_become_eight(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", GREY.astype(np.uint16) * 256 + 7)
    np.testing.assert_array_equal(read_picture(path), GREY)


def test_why_a_picture_cannot_be_used(tmp_path: Path, rng: np.random.Generator) -> None:
    whole = save(tmp_path / "whole.png", rng.integers(0, 255, (200, 300), np.uint8)).read_bytes()
    (tmp_path / "cut.png").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.png").write_bytes(b"no picture")
    save(tmp_path / "black.png", np.zeros((48, 64), np.uint8))
    save(tmp_path / "white.png", 250 + rng.integers(0, 5, (48, 64), np.uint8))
    for name, reason in [
        ("cut", "the picture cannot be read (image file is truncated"),
        ("text", "the picture cannot be read (cannot identify image file"),
        ("absent", "the picture cannot be read ("),
        ("black", "the picture is blank (grey values 0 to 0)"),
        ("white", "the picture is blank (grey values 250 to 254)"),
    ]:
        path = tmp_path / f"{name}.png"
        with pytest.raises(TargetNotFound) as caught:
            read_picture(path)
        assert str(caught.value).startswith(f"{path}: {reason}")
    assert picture_size(tmp_path / "text.png") is None
    assert picture_size(tmp_path / "absent.png") is None
