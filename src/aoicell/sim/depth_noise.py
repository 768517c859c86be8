"""What an RGB-D camera makes of the true depth: its noise, its steps, its holes.

Both kinds measure disparity, a camera against a second camera or against a projector `baseline`
away, so depth z = f b / d and its error grows with z^2 / (f b). On top of that, after Handa et al.,
"A benchmark for RGB-D visual odometry, 3D reconstruction and SLAM", ICRA 2014 (ICL-NUIM): a pixel
looks a little beside its place, which makes depths between near and far at edges; disparity is
counted in steps. Noise grows towards grazing angles, where at last nothing comes back: Nguyen,
Izadi and Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking", 2012.
Not modelled: mirrors, light that is scattered twice, and dark or shiny parts that give no signal.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from aoicell.camera import Camera

Depth = NDArray[np.float32]


@dataclass(frozen=True)
class DepthSensor:
    """A kind of RGB-D camera. Lengths in m, angles in rad.

    `disparity_sigma_px` and `disparity_step_px` (0: none), noise equal over `correlation_px`;
    `lateral_sigma_px`: how far beside itself a pixel looks; `flying`: the share of such mixed
    pixels at edges that the device's own filter lets through; `grazing`: angle of incidence from
    which nothing is measured; `depth_step` of the numbers it delivers; `trueness`: sigma of the
    scale of all depths and of the focal length that it states; `distance`: where it is used best.
    """

    name: str
    camera: Camera
    baseline: float
    disparity_sigma_px: float
    disparity_step_px: float
    correlation_px: float
    lateral_sigma_px: float
    flying: float
    grazing: float
    depth_step: float
    trueness: float
    reach: tuple[float, float]
    distance: float

    def sigma(self, distance: float) -> float:
        """Axial noise (m) of one pixel, face on."""
        return distance**2 * self.disparity_sigma_px / (self.camera.focal_px * self.baseline)


# An industrial camera with a pattern projector, of the size of a Zivid 2: 1944 x 1200 points
# (maker's SDK documentation, "Sampling"), 0.39 mm apart at 0.7 m. The noise is set to some 60 um at
# 0.7 m and the scale to 0.1 %: the order that data sheets of this class state as point precision
# and dimension trueness. Assumed: baseline, mixed pixels, angle.
STRUCTURED_LIGHT = DepthSensor(
    name="structured_light",
    camera=Camera.pinhole(1805.0, 1944, 1200),
    baseline=0.10,
    disparity_sigma_px=0.022,
    disparity_step_px=0.0,  # phase is continuous
    correlation_px=0.7,
    lateral_sigma_px=0.3,
    flying=0.1,
    grazing=float(np.radians(75)),
    depth_step=1e-6,
    trueness=0.001,
    reach=(0.30, 1.50),
    distance=0.45,
)

# A small stereo camera without projector, of the size of a RealSense D405: 1280 x 720 at 87
# degrees, baseline 18 mm, depths in 0.1 mm (the maker's documentation); disparity in 1/32 px, and
# noise between the 0.05 and 0.08 px that the maker's tuning guide (Grunnet-Jepsen et al.) calls
# usual. Assumed: correlation over the matching window, mixed pixels, angle, scale.
STEREO = DepthSensor(
    name="stereo",
    camera=Camera.pinhole(674.0, 1280, 720),
    baseline=0.018,
    disparity_sigma_px=0.06,
    disparity_step_px=1 / 32,
    correlation_px=2.0,
    lateral_sigma_px=0.5,
    flying=0.3,
    grazing=float(np.radians(70)),
    depth_step=1e-4,
    trueness=0.003,
    reach=(0.07, 0.60),
    distance=0.25,
)

SENSORS = {sensor.name: sensor for sensor in (STRUCTURED_LIGHT, STEREO)}


def measured(depth: Depth, sensor: DepthSensor, scale: float, rng: np.random.Generator) -> Depth:
    """The depth image (H, W) that a device delivers of true depths (H, W; m); NaN: nothing.

    `scale` is the factor on all depths of this device. Every source draws from a child of `rng` of
    its own, in the order lateral, axial, flying.
    """
    lateral, axial, flying = rng.spawn(3)
    cosine = cosine_of_incidence(depth, sensor.camera)
    f_b = sensor.camera.focal_px * sensor.baseline
    seen = _beside(depth, sensor.lateral_sigma_px, lateral)
    noise = _field(depth.shape, sensor.correlation_px, axial) * sensor.disparity_sigma_px
    disparity = f_b / seen + noise / np.maximum(cosine, 0.1)
    if sensor.disparity_step_px:
        disparity = np.rint(disparity / sensor.disparity_step_px) * sensor.disparity_step_px
    z = scale * f_b / disparity
    z = np.rint(z / sensor.depth_step) * sensor.depth_step
    filtered = _mixed(depth, seen) & (flying.random(depth.shape) >= sensor.flying)
    near, far = sensor.reach
    lost = filtered | (cosine < np.cos(sensor.grazing)) | shadowed(depth, f_b)
    lost |= (depth < near) | (depth > far)
    return np.where(lost, np.nan, z).astype(np.float32)


def cosine_of_incidence(depth: Depth, camera: Camera) -> Depth:
    """Cosine (H, W) of the angle between the line of sight and the surface's normal.

    Steps of the depth do not count: of both sides of a pixel, the flatter one does.
    """
    f, height, width = camera.focal_px, camera.height, camera.width
    x = (np.arange(width, dtype=np.float32) - camera.K[0, 2]) / f
    y = ((np.arange(height, dtype=np.float32) - camera.K[1, 2]) / f)[:, None]
    by_u, by_v = _slope(depth, 1) * f, _slope(depth, 0) * f
    normal = np.sqrt(by_u**2 + by_v**2 + (depth + x * by_u + y * by_v) ** 2)
    cosine: Depth = depth / (normal * np.sqrt(x**2 + y**2 + 1))
    return cosine


def shadowed(depth: Depth, f_b: float) -> NDArray[np.bool_]:
    """What (H, W) the other eye, a baseline to the right, cannot see: something stands before it.

    Going from the right, a pixel's place in the other picture may only move left; `f_b` in px m.
    """
    place = np.arange(depth.shape[1], dtype=np.float32) - np.float32(f_b) / depth
    leftmost = np.minimum.accumulate(place[:, ::-1], axis=1)[:, ::-1]
    hidden: NDArray[np.bool_] = place > leftmost + 1.0
    return hidden


def _slope(depth: Depth, axis: int) -> Depth:
    """Change of depth to the next pixel (m), on the side where it changes less."""
    steps = np.diff(depth, axis=axis)
    ends = [(0, 0), (0, 0)]
    ends[axis] = (1, 1)
    padded = np.pad(steps, ends, mode="edge")
    before, after = (np.take(padded, range(i, i + depth.shape[axis]), axis=axis) for i in (0, 1))
    return np.where(np.abs(before) < np.abs(after), before, after)


def _beside(depth: Depth, sigma_px: float, rng: np.random.Generator) -> Depth:
    """Each pixel as it is `sigma_px` beside its place, along both axes."""
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]].astype(np.float32)
    du, dv = rng.standard_normal((2, *depth.shape), dtype=np.float32) * np.float32(sigma_px)
    edge = cv2.BORDER_REPLICATE
    return np.asarray(cv2.remap(depth, u + du, v + dv, cv2.INTER_LINEAR, borderMode=edge))


def _field(shape: tuple[int, ...], correlation_px: float, rng: np.random.Generator) -> Depth:
    """Normal noise of unit variance, smoothed over some pixels."""
    noise = rng.standard_normal(shape, dtype=np.float32)
    if correlation_px == 0:
        return noise
    smooth = cv2.GaussianBlur(noise, (0, 0), correlation_px, borderType=cv2.BORDER_REFLECT)
    return np.asarray(smooth / smooth.std(), dtype=np.float32)


def _mixed(depth: Depth, seen: Depth) -> NDArray[np.bool_]:
    """Where (H, W) a pixel saw neither the near nor the far side of an edge."""
    kernel = np.ones((5, 5), np.uint8)
    near, far = cv2.erode(depth, kernel), cv2.dilate(depth, kernel)
    margin = 0.1 * (far - near)
    slopes = np.abs(_slope(depth, 0)) + np.abs(_slope(depth, 1))
    edge = far - near > 0.002 * depth + 6 * slopes  # four pixels of a leaning surface are no edge
    mixed: NDArray[np.bool_] = edge & (seen > near + margin) & (seen < far - margin)
    return mixed
