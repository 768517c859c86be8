"""The lens puts each point where the camera model says, and blurs by what it is told."""

from dataclasses import dataclass

import numpy as np
import pytest

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.pipeline import flange_target
from aoicell.sim.drawing import draw
from aoicell.sim.optics import Lens, Plane, Resampler, blur, blur_circle_px, smear
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.targets.chessboard import half_turn
from aoicell.targets.pose import rms
from aoicell.transforms import Array, translation

WIDTH, HEIGHT = 640, 480
PLAIN = Camera.pinhole(800.0, WIDTH, HEIGHT)


def bent(
    *distortion: float, fx: float = 800.0, fy: float = 800.0, skew: float = 0.0, cx: float = 330.0
) -> Camera:
    K = np.array([[fx, skew, cx], [0, fy, 232.3], [0, 0, 1]])
    return Camera(K, WIDTH, HEIGHT, np.array([*distortion, *[0.0] * (5 - len(distortion))]))


CAMERAS = {
    "decentred": bent(),
    "k1": bent(-0.08),
    "k1 the other way": bent(0.05),
    "k2": bent(0.0, 0.2),
    "p1": bent(0.0, 0.0, 0.004),
    "p2": bent(0.0, 0.0, 0.0, -0.004),
    "skew": bent(skew=4.0),
    "fx and fy": bent(fx=812.0, fy=790.0),
    "all": bent(-0.08, 0.1, 0.002, -0.001, fx=805.0, fy=798.0, skew=-2.0, cx=311.7),
}


def field_points() -> Array:
    """Points (N, 3) in the camera frame that lie in the field of each camera here."""
    x, y = np.meshgrid(np.linspace(-0.34, 0.34, 7), np.linspace(-0.25, 0.25, 5))
    return np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)])


def analytic(camera: Camera, points: Array) -> Array:
    """Brown's projection written out: pixels (N, 2) of points (N, 3) in the camera frame."""
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    x_bent = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    y_bent = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    (fx, skew, cx), (_, fy, cy), _ = camera.K
    return np.column_stack([fx * x_bent + skew * y_bent + cx, fy * y_bent + cy])


def spots(shape: tuple[int, int], uv_px: Array, sigma: float = 2.5) -> Plane:
    """Bright spots at known places."""
    v, u = np.indices(shape)
    grey = np.full(shape, 20.0)
    for x, y in uv_px:
        grey += 200 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * sigma**2))
    return grey.astype(np.float32)


def centroid(plane: Plane, near: Array, reach: int = 12) -> Array:
    x, y = np.rint(near).astype(int)
    window = plane[y - reach : y + reach + 1, x - reach : x + reach + 1].astype(float) - 20
    v, u = np.indices(window.shape) - reach
    return np.array([x + (window * u).sum() / window.sum(), y + (window * v).sum() / window.sum()])


def seen_through(lens: Lens, points: Array, warm_up: float = 0.0) -> Plane:
    wide, high, focal = lens.pinhole
    uv = points[:, :2] / points[:, 2:] * focal + [(wide - 1) / 2, (high - 1) / 2]
    return lens.bend(spots((high, wide), uv), warm_up)


# ---- where points appear -----------------------------------------------------------------------


def test_a_plain_camera_needs_no_remapping() -> None:
    lens, plane = Lens(PLAIN), np.zeros((HEIGHT, WIDTH), dtype=np.float32)
    assert lens.pinhole == (WIDTH, HEIGHT, 800.0)
    assert lens.bend(plane) is plane


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("drift", [0.0, 0.01, -0.01])
def test_the_pinhole_covers_the_whole_field(name: str, drift: float) -> None:
    lens = Lens(CAMERAS[name], drift)
    wide, high, focal = lens.pinhole
    edge = np.array([[0, 0], [639, 0], [639, 479], [0, 479], [320, 0], [0, 240], [320, 479.0]])
    for warm_up in (0.0, 0.5, 1.0):
        uv = lens.camera(warm_up).unproject(edge) * focal + [(wide - 1) / 2, (high - 1) / 2]
        assert (uv >= 2).all()
        assert (uv <= [wide - 3, high - 3]).all()
    assert wide < 1.15 * WIDTH, "and not much more"


@pytest.mark.parametrize("name", CAMERAS)
def test_points_go_where_the_camera_projects_them(name: str) -> None:
    camera, points = CAMERAS[name], field_points()
    expected = analytic(camera, points)
    raw = seen_through(Lens(camera), points)
    assert raw.shape == (HEIGHT, WIDTH)
    inside = ((expected > 14) & (expected < [WIDTH - 15, HEIGHT - 15])).all(axis=1)
    assert inside.sum() >= 21
    found = np.array([centroid(raw, uv) for uv in expected[inside]])
    without = PLAIN if name == "decentred" else CAMERAS["decentred"]
    assert rms(expected - analytic(without, points)) > 0.3, "else the test would see nothing"
    assert np.abs(found - expected[inside]).max() < 0.01


@pytest.mark.parametrize("drift", [2e-3, -2e-3])
def test_a_warm_lens_magnifies_about_the_principal_point(drift: float) -> None:
    lens, points = Lens(CAMERAS["all"], drift), field_points()
    cold, warm = lens.camera(0.0), lens.camera(0.5)
    np.testing.assert_array_equal(cold.K, CAMERAS["all"].K)
    assert warm.focal_px / cold.focal_px - 1 == pytest.approx(drift / 2)
    assert warm.K[:2, 2].tolist() == cold.K[:2, 2].tolist()
    expected = analytic(warm, points)
    centre = cold.K[:2, 2]
    grown = (analytic(cold, points) - centre) * (1 + drift / 2)
    np.testing.assert_allclose(expected - centre, grown, atol=1e-9)
    raws = [seen_through(lens, points, warm_up) for warm_up in (0.5, 0.0, 0.5)]
    inside = ((expected > 14) & (expected < [WIDTH - 15, HEIGHT - 15])).all(axis=1)
    for raw, camera in zip(raws, (warm, cold, warm), strict=True):
        uv = analytic(camera, points)[inside]
        assert np.abs(np.array([centroid(raw, p) for p in uv]) - uv).max() < 0.01
    np.testing.assert_array_equal(raws[0], raws[2])


def test_warm_up_without_drift_changes_nothing() -> None:
    lens = Lens(CAMERAS["k1"])
    one, other = (seen_through(lens, field_points(), warm_up) for warm_up in (0.0, 1.0))
    assert lens.camera(1.0) is lens.camera(0.0)
    np.testing.assert_array_equal(one, other)


@dataclass(frozen=True)
class Edge:
    """A vertical edge between grey 30 and 220, leaning a little, sampled by exact area."""

    at: float
    shape: tuple[int, int] = (64, 64)

    @property
    def plane(self) -> Plane:
        rows = np.arange(self.shape[0])[:, None]
        # along a row the share of dark falls from 1 to 0 within the pixel that the edge crosses
        dark = np.clip(self.at + rows / 16 + 0.5 - np.arange(self.shape[1]), 0, 1)
        return (220 - 190 * dark).astype(np.float32)


def place_and_spread(plane: Plane) -> tuple[Array, Array]:
    """Mean place and standard deviation of the edge in each row, from its gradient."""
    gradient = np.diff(plane.astype(float), axis=1)
    u = np.arange(gradient.shape[1]) + 0.5
    weight = gradient.sum(axis=1)
    mean = (gradient * u).sum(axis=1) / weight
    variance = (gradient * u**2).sum(axis=1) / weight - mean**2
    return mean, np.sqrt(np.maximum(variance, 0))


@pytest.mark.parametrize("shift", np.arange(0, 32, 3) / 32 + 1 / 64)
def test_resampling_neither_moves_nor_blurs_an_edge(shift: float) -> None:
    v, u = np.indices((64, 56)).astype(float)
    before = Edge(30.0)
    after = Resampler(u + 4 + shift, v + shift / 3)(before.plane)[4:-4]
    mean, spread = place_and_spread(after)
    expected = 30 + np.arange(4, 60) / 16 + shift / 3 / 16 - 4 - shift
    # a quarter of the rows share a column of the dither
    assert abs((mean - expected).mean()) < 0.002
    assert np.abs((mean - expected).reshape(-1, 8).mean(axis=1)).max() < 0.005
    assert abs((spread**2).mean() - (place_and_spread(before.plane)[1] ** 2).mean()) < 0.02


KNOBS: dict[str, dict[str, float]] = {
    "focal_percent": {"focal_percent": 2.0},
    "principal_px": {"principal_px": 25.0},
    "skew_px": {"skew_px": 50.0},
    "k1": {"k1": -0.15},
    "k2_sigma": {"k2_sigma": 0.5},
    "tangential_sigma": {"tangential_sigma": 0.01},
    "focal_drift_ppm": {"focal_drift_ppm": 5000.0},
    "all": {
        "focal_percent": 1.0, "principal_px": 10.0, "skew_px": 1.0, "k1": -0.08, "k1_sigma": 0.02,
        "k2_sigma": 0.02, "tangential_sigma": 2e-4, "focal_drift_ppm": 500.0, "psf_px": 0.6,
    },
}  # fmt: skip


@pytest.mark.parametrize("knob", KNOBS)
def test_known_points_of_a_rendered_cell_once_the_knob_is_accounted_for(
    knob: str, nominal: Nominal
) -> None:
    world = World(nominal, draw(nominal, Tolerances(**KNOBS[knob]), seed=3))
    world.begin(20)  # well warmed up
    board, n = nominal.tabletarget, nominal
    q = flange_target(n, n.T_base_tabletarget, n.hand_eye_start, n.q_home)
    # the board lies towards a corner of the picture, where the lens bends most
    world.arrive(n.arm.ik(n.arm.fk(q) * translation(0.08, 0.035), q))
    T = world.truth().T_base_camera.actInv(world.geometry.T_base_tabletarget)
    uv = board.detect(world.picture("hand"))
    expected = world.camera("hand").project(board.corners, T)
    assert min(rms(uv - expected), rms(half_turn(uv) - expected)) < 0.03
    designed = n.cameras["hand"].project(board.corners, T)
    assert rms(designed - expected) > 0.1, "else the test would see nothing"
    q = flange_target(n, n.T_base_board * n.T_board_positioning, n.check, n.q_home)
    world.arrive(q)
    crosses = [world.project(world.marker_crosses(id)) for id in world.geometry.Ts_board_marker]
    found = n.marker.detect(world.picture("hand"))
    world.close()
    assert found
    for marker in found:
        readings = [np.roll(uv, turn, axis=0) for uv in crosses for turn in range(4)]
        assert min(rms(marker - reading) for reading in readings) < 0.05


# ---- blur --------------------------------------------------------------------------------------


@pytest.mark.parametrize("sigma", [0.1, 0.3, 0.6, 1.0, 2.5])
def test_the_point_spread_widens_an_edge_by_its_sigma(sigma: float) -> None:
    sharp = Edge(30.0).plane
    mean, spread = place_and_spread(blur(sharp, sigma)[20:-20])
    was_mean, was_spread = place_and_spread(sharp[20:-20])
    np.testing.assert_allclose(mean, was_mean, atol=0.07 * sigma)  # the edge leans
    widened = np.sqrt((spread**2 - was_spread**2).mean())
    assert widened == pytest.approx(sigma, rel=0.02)


def test_no_blur_is_no_change() -> None:
    plane = Edge(30.0).plane
    assert blur(plane, 0.0) is plane
    assert smear(plane, (0.0, 0.0)) is plane
    assert smear(plane, (0.01, -0.01)) is plane
    np.testing.assert_array_equal(blur(plane, 1e-9), plane)


def test_defocus_grows_with_the_distance_from_focus() -> None:
    def circle(distance: float, focus: float = 0.7) -> float:
        return blur_circle_px(PLAIN, 1.5e-3, focus, distance)

    assert circle(0.7) == 0
    assert circle(0.5, focus=0.0) == 0
    assert circle(0.5) == pytest.approx(800 * 1.5e-3 * (1 / 0.5 - 1 / 0.7))
    assert 0 < circle(0.72) < circle(0.8) < circle(1.15)
    assert 0 < circle(0.68) < circle(0.6) < circle(0.5)


@pytest.mark.parametrize("motion", [(0.3, 0), (0, 0.8), (1.5, 0), (4, 3), (-4, 3), (0.2, -0.6)])
def test_motion_smears_along_its_direction_by_its_length(motion: tuple[float, float]) -> None:
    point = spots((61, 61), np.array([[30.0, 30.0]])) - 20
    smeared = smear(point, motion)
    v, u = np.indices(point.shape) - 30.0

    def moments(plane: Plane) -> Array:
        weight = plane.astype(float) / plane.sum(dtype=float)
        mean = np.array([(weight * u).sum(), (weight * v).sum()])
        np.testing.assert_allclose(mean, 0, atol=1e-4)
        return np.array([[(weight * a * b).sum() for a in (u, v)] for b in (u, v)])

    # a uniform line of length L has the variance L^2 / 12
    gained = moments(smeared) - moments(point)
    np.testing.assert_allclose(gained, np.outer(motion, motion) / 12, rtol=0.03, atol=2e-4)
