"""Light becomes grey values as the knobs say, each by its own draws."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.observation import Image, to_grey
from aoicell.sim.as_built import Light, Sensor
from aoicell.sim.sensor import (
    CameraModel,
    Conditions,
    add_read_noise,
    add_shot_noise,
    digitise,
    shading,
)
from aoicell.transforms import Array

WIDTH, HEIGHT = 320, 240
CAMERA = Camera.pinhole(400.0, WIDTH, HEIGHT)
STILL = Conditions(distance=0.5)
EVERYTHING = Sensor(
    psf_px=0.6, aperture=1.5e-3, focus=0.7, exposure=5e-3, brightness=1.03, vignetting=0.15,
    gain=40.0, noise_grey=0.8, adc_bits=10,
)  # fmt: skip
UNEVEN = Light(gradient=(0.05, -0.08), flicker=0.01)


def flat(grey: int, height: int = HEIGHT, width: int = WIDTH) -> Image:
    return np.full((height, width, 3), grey, dtype=np.uint8)


def textured() -> Image:
    """All grey values, with edges."""
    values = np.random.default_rng(5).integers(0, 256, (HEIGHT // 8, WIDTH // 8, 3))
    return np.kron(values, np.ones((8, 8, 1))).astype(np.uint8)


def shot(
    image: Image,
    sensor: Sensor,
    light: Light | None = None,
    seed: int = 0,
    at: Conditions = STILL,
) -> Image:
    model = CameraModel(CAMERA, sensor, light or Light())
    return model.expose(image, at, np.random.default_rng(seed))


def test_everything_at_zero_returns_the_render() -> None:
    image = textured()
    np.testing.assert_array_equal(shot(image, Sensor()), to_grey(image))
    coloured = shot(image, Sensor(), at=replace(STILL, colour=True))
    np.testing.assert_array_equal(coloured, image)


# A value so small that it cannot be seen switches the source on: it draws, and nothing changes.
WHISPERS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "psf": ({"psf_px": 1e-12}, {}),
    "focus": ({"aperture": 1e-12, "focus": 0.7}, {}),
    "brightness": ({"brightness": 1 + 1e-12}, {}),
    "vignetting": ({"vignetting": 1e-12}, {}),
    "gain": ({"gain": 1e30}, {}),
    "noise_grey": ({"noise_grey": 1e-15}, {}),
    "focal_drift": ({"focal_drift": 0.0}, {}),
    "gradient": ({}, {"gradient": (1e-12, 1e-12)}),
    "flicker": ({}, {"flicker": 1e-15}),
}


@pytest.mark.parametrize("knob", WHISPERS)
def test_a_source_that_is_switched_on_changes_no_other_draw(knob: str) -> None:
    in_sensor, in_light = WHISPERS[knob]
    off: dict[str, Any] = {"gain": 0.0, "aperture": 0.0, "brightness": 1.0}
    without = replace(EVERYTHING, **{name: off.get(name, 0.0) for name in in_sensor})
    dark: dict[str, Any] = {"flicker": 0.0, "gradient": (0.0, 0.0)}
    dim = replace(UNEVEN, **{name: dark[name] for name in in_light})
    image = textured()
    quiet = shot(image, without, dim, seed=3)
    whisper = shot(image, replace(without, **in_sensor), replace(dim, **in_light), seed=3)
    np.testing.assert_array_equal(quiet, whisper)


def test_the_picture_is_its_streams() -> None:
    image = textured()
    one, same, other = (shot(image, EVERYTHING, UNEVEN, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert (one != other).mean() > 0.3


def test_a_model_keeps_no_memory_of_its_pictures() -> None:
    image, drifting = textured(), replace(EVERYTHING, focal_drift=1e-3)
    model = CameraModel(CAMERA, drifting, UNEVEN)
    wide, high, _ = model.pinhole
    image = np.pad(image, ((0, high - HEIGHT), (0, wide - WIDTH), (0, 0)))
    first, _, again = (
        model.expose(image, replace(STILL, warm_up=w), np.random.default_rng(4))
        for w in (0.2, 0.9, 0.2)
    )
    np.testing.assert_array_equal(first, again)


# ---- noise -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("gain", "read"), [(40.0, 0.8), (8.0, 1.5)])
def test_the_mean_variance_line_gives_gain_and_read_noise(gain: float, read: float) -> None:
    sensor = Sensor(gain=gain, noise_grey=read)
    levels, variances = [], []
    for index, grey in enumerate(range(20, 231, 14)):
        model = CameraModel(Camera.pinhole(400.0, 700, 500), sensor, Light())
        picture = model.expose(flat(grey, 500, 700), STILL, np.random.default_rng(index))
        levels.append(picture.mean())
        variances.append(picture.var() - 1 / 12)  # less what rounding adds
    slope, intercept = np.polyfit(levels, variances, 1)
    assert 1 / slope == pytest.approx(gain, rel=0.03)
    assert np.sqrt(intercept) == pytest.approx(read, rel=0.05)
    np.testing.assert_allclose(levels, range(20, 231, 14), atol=0.04)  # 4 sigma


def test_noise_is_white_and_new_in_each_picture() -> None:
    image = flat(128, 600, 800)
    model = CameraModel(Camera.pinhole(400.0, 800, 600), Sensor(gain=20, noise_grey=2), Light())
    first, second = (
        model.expose(image, STILL, np.random.default_rng(seed)).astype(float) - 128
        for seed in (0, 1)
    )

    def correlation(a: Array, b: Array) -> float:
        return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])

    assert abs(correlation(first, second)) < 0.01
    assert abs(correlation(first[:, :-1], first[:, 1:])) < 0.01
    assert abs(correlation(first[:-1], first[1:])) < 0.01


def test_shot_and_read_noise_are_independent() -> None:
    light = np.full((600, 800), 100.0, dtype=np.float32)
    one, two = np.random.default_rng(7).spawn(2)
    shot_noise = add_shot_noise(light, 20.0, one) - light
    read_noise = add_read_noise(light, 2.0, two) - light
    assert abs(np.corrcoef(shot_noise.ravel(), read_noise.ravel())[0, 1]) < 0.01
    assert shot_noise.std() == pytest.approx(np.sqrt(100 / 20), rel=0.01)
    assert read_noise.std() == pytest.approx(2.0, rel=0.01)


def test_noise_does_not_wrap_around() -> None:
    image = flat(0)
    image[HEIGHT // 2 :] = 255
    noisy = shot(image, Sensor(noise_grey=10.0, gain=2.0))
    assert noisy[: HEIGHT // 2].max() < 80
    assert noisy[HEIGHT // 2 :].min() > 150


def test_the_channels_of_a_colour_picture_have_noise_of_their_own() -> None:
    picture = shot(flat(128), Sensor(noise_grey=3.0), at=replace(STILL, colour=True))
    r, g, b = (picture[..., channel].ravel() for channel in range(3))
    for one, other in ((r, g), (g, b), (r, b)):
        assert abs(np.corrcoef(one, other)[0, 1]) < 0.02
    assert picture.std() == pytest.approx(np.hypot(3.0, np.sqrt(1 / 12)), rel=0.02)


# ---- counting ----------------------------------------------------------------------------------


def test_a_converter_has_its_levels() -> None:
    ramp = np.linspace(0, 255, 20001, dtype=np.float32)[None]
    for bits in (2, 3, 5):
        levels = np.unique(digitise(ramp, bits))
        np.testing.assert_array_equal(levels, np.rint(np.linspace(0, 255, 2**bits)))
    for bits in (0, 8, 10, 12):
        assert len(np.unique(digitise(ramp, bits))) == 256
        assert np.abs(digitise(ramp, bits) - ramp).max() <= 0.5 + (bits > 8) * 0.5 * 255 / 1023
    np.testing.assert_array_equal(digitise(ramp, 8), digitise(ramp, 0))


@pytest.mark.parametrize("bits", [0, 8, 9, 10, 11, 12])
def test_whole_grey_values_pass_every_converter(bits: int) -> None:
    values = np.arange(256, dtype=np.float32)[None]
    np.testing.assert_array_equal(digitise(values, bits)[0], np.arange(256))


def test_more_than_full_scale_is_full_scale() -> None:
    np.testing.assert_array_equal(
        digitise(np.array([[-3.0, 300.0]], dtype=np.float32), 10), [[0, 255]]
    )


# ---- light -------------------------------------------------------------------------------------


def test_brightness_scales_the_picture() -> None:
    assert shot(flat(100), Sensor(brightness=1.1)).mean() == pytest.approx(110)
    assert shot(flat(100), Sensor(brightness=0.9)).mean() == pytest.approx(90)


def test_vignetting_takes_its_share_in_the_corners() -> None:
    factor = shading(CAMERA, Sensor(vignetting=0.15), Light())
    assert factor is not None
    corners = factor[[0, 0, -1, -1], [0, -1, 0, -1]]
    np.testing.assert_allclose(corners, 0.85, rtol=1e-6)
    assert factor.max() == pytest.approx(1, abs=1e-4)
    middle = factor[HEIGHT // 2, 0]  # at 0.8 of the way to a corner
    assert middle == pytest.approx(1 - 0.15 * 0.8**2, abs=1e-3)
    picture = shot(flat(200), Sensor(vignetting=0.15))
    assert picture[0, 0] == 170
    assert picture[HEIGHT // 2, WIDTH // 2] == 200


def test_a_gradient_brightens_the_right_and_the_lower_edge() -> None:
    picture = shot(flat(100), Sensor(), Light(gradient=(0.2, 0.0)))
    assert (picture[:, 0] == 80).all()
    assert (picture[:, -1] == 120).all()
    picture = shot(flat(100), Sensor(), Light(gradient=(0.0, 0.1)))
    assert (picture[0] == 90).all()
    assert (picture[-1] == 110).all()
    picture = shot(flat(100), Sensor(), Light(gradient=(0.1, -0.1)))
    assert picture[-1, 0] == 80
    assert picture[0, -1] == 120


def test_flicker_has_its_variance() -> None:
    camera, light = Camera.pinhole(40.0, 32, 24), Light(flicker=0.03)
    model, image = CameraModel(camera, Sensor(noise_grey=0.6), light), flat(200, 24, 32)
    means = [model.expose(image, STILL, np.random.default_rng(s)).mean() for s in range(300)]
    # 300 draws tell a standard deviation to 4 %
    assert np.std(means) == pytest.approx(0.03 * 200, rel=0.15)
    assert np.mean(means) == pytest.approx(200, abs=4 * 6 / np.sqrt(300))


def test_flicker_with_uneven_light_is_the_same_factor() -> None:
    light = Light(flicker=0.05)
    alone = shot(flat(100), Sensor(), light, seed=2).mean() / 100
    shaded = shot(flat(100), Sensor(brightness=1.2), light, seed=2).mean() / 120
    assert alone != 1
    assert shaded == pytest.approx(alone, abs=0.01)


# ---- blur --------------------------------------------------------------------------------------


def edge_width(sensor: Sensor, at: Conditions = STILL) -> float:
    """Standard deviation (px) of a vertical edge in the picture."""
    image = flat(20)
    image[:, WIDTH // 2 :] = 240
    gradient = np.diff(shot(image, sensor, at=at)[HEIGHT // 2].astype(float))
    u = np.arange(len(gradient)) - (len(gradient) - 1) / 2
    return float(np.sqrt((gradient * u**2).sum() / gradient.sum()))


@pytest.mark.parametrize("sigma", [0.6, 1.2, 3.0])
def test_an_edge_in_focus_is_as_wide_as_the_point_spread(sigma: float) -> None:
    assert edge_width(Sensor(psf_px=sigma)) == pytest.approx(sigma, rel=0.05)


def test_defocus_adds_to_the_point_spread() -> None:
    lens = Sensor(psf_px=0.6, aperture=20e-3, focus=0.7)
    assert edge_width(lens, Conditions(distance=0.7)) == pytest.approx(0.6, rel=0.05)
    circle = 400 * 20e-3 * (1 / 0.5 - 1 / 0.7)
    expected = np.hypot(0.6, circle / 4)
    assert edge_width(lens, Conditions(distance=0.5)) == pytest.approx(expected, rel=0.05)
    far = [edge_width(lens, Conditions(distance=d)) for d in (0.7, 0.8, 1.15)]
    assert far == sorted(far)


def test_motion_blurs_across_an_edge_only() -> None:
    across = edge_width(Sensor(), replace(STILL, motion_px=(6.0, 0.0)))
    assert across == pytest.approx(6 / np.sqrt(12), rel=0.05)
    assert edge_width(Sensor(), replace(STILL, motion_px=(0.0, 6.0))) == 0
    assert edge_width(Sensor(), replace(STILL, motion_px=(0.015, 0.0))) == 0
