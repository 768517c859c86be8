"""A simulated RGB-D camera in the robot's hand: depth with its noise, and colour."""

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from aoicell.camera import Camera
from aoicell.nominal import Nominal
from aoicell.observation import Image, RobotState
from aoicell.planning.depth import DepthImage
from aoicell.sim.backend import make_renderer
from aoicell.sim.cell import SimCell
from aoicell.sim.depth_noise import Depth, DepthSensor, measured
from aoicell.sim.drawing import stream
from aoicell.sim.scene import visible
from aoicell.sim.sensor import add_read_noise, add_shot_noise, digitise
from aoicell.sim.world import World


def with_rgbd(nominal: Nominal, sensor: DepthSensor) -> Nominal:
    """The cell with the RGB-D camera on the holder, in place of the inspection camera.

    It is calibrated there as that one is, from its colour pictures. Housing and holder are
    still those of the inspection camera.
    """
    return replace(nominal, cameras={**nominal.cameras, "hand": sensor.camera})


class RgbdCell:
    """The `DepthCell` protocol over a `World` that was built for `with_rgbd`."""

    __slots__ = ("_cell", "_device", "_renderer", "_sensor", "_taken", "_world")

    def __init__(self, world: World, sensor: DepthSensor) -> None:
        self._world, self._sensor, self._cell = world, sensor, SimCell(world)
        built = world.as_built
        draw = stream(built.seed, built.world, -1, f"trueness_{sensor.name}").standard_normal(2)
        self._device = 1 + sensor.trueness * draw  # true factors of depth and of the focal length
        self._taken = 0
        self._renderer: mujoco.Renderer | None = None

    def move(self, q: ArrayLike) -> None:
        """See `SimCell.move`."""
        self._cell.move(q)

    def state(self) -> RobotState:
        """See `SimCell.state`."""
        return self._cell.state()

    def capture_depth(self) -> DepthImage:
        """A depth image, rectified as the device does by its own, slightly wrong calibration."""
        built = self._world.as_built
        name = f"{self._sensor.name}_{self._taken}"
        self._taken += 1
        depth_noise, colour_noise = stream(built.seed, built.world, 0, name).spawn(2)
        bare = self._world.pinhole_picture("hand")  # larger: the raw picture's lens bends it
        true = replace(self._sensor, camera=self._camera(bare.shape[0]))
        depth = measured(self._true_depth(bare.shape), true, self._device[0], depth_noise)
        stated = self._camera(bare.shape[0], self._device[1])
        return DepthImage(
            depth, self._exposed(self._cropped(bare), colour_noise), stated, self.state()
        )

    def close(self) -> None:
        """Free the OpenGL context."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _camera(self, rendered: int, error: float = 1.0) -> Camera:
        """The pinhole of the rectified pictures, from the height (px) of what MuJoCo renders."""
        fovy = np.radians(self._world.model.camera("hand").fovy[0])
        focal_px = rendered / 2 / np.tan(fovy / 2) / error
        return Camera.pinhole(focal_px, self._sensor.camera.width, self._sensor.camera.height)

    def _true_depth(self, shape: tuple[int, ...]) -> Depth:
        if self._renderer is None:
            quality = self._world.model.vis.quality
            samples, quality.offsamples = quality.offsamples, 0  # the centre of each pixel
            self._renderer = make_renderer(self._world.model, shape[1], shape[0])
            quality.offsamples = samples
            self._renderer.enable_depth_rendering()
        self._renderer.update_scene(self._world.data, "hand", visible())
        return np.ascontiguousarray(self._cropped(self._renderer.render()), dtype=np.float32)

    def _cropped(self, picture: np.ndarray) -> np.ndarray:
        """The middle of a render, as large as the rectified picture."""
        width, height = self._sensor.camera.width, self._sensor.camera.height
        top, left = (picture.shape[0] - height) // 2, (picture.shape[1] - width) // 2
        return picture[top : top + height, left : left + width]

    def _exposed(self, rgb: np.ndarray, rng: np.random.Generator) -> Image:
        """The colour picture with the noise of the hand camera's sensor."""
        sensor = self._world.as_built.sensors["hand"]
        shot, read = rng.spawn(2)
        planes = []
        for plane in np.moveaxis(rgb.astype(np.float32), 2, 0):
            light = add_shot_noise(np.ascontiguousarray(plane), sensor.gain, shot)
            planes.append(digitise(add_read_noise(light, sensor.noise_grey, read), sensor.adc_bits))
        return np.dstack(planes)
