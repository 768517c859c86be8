"""Pictures of the board alone, for the eye: an oblique one and a measured one from above."""

from __future__ import annotations

import math
import time
from pathlib import Path

import cv2
import mujoco
import numpy as np

from aoicell.board import BoardDesign, MarkerDesign
from aoicell.sim.board_geometry import board_parts, label_image, silkscreen_image

SHAPES = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
}
GLOSS = {"matte": (0.05, 0.1), "plastic": (0.25, 0.35), "metal": (0.55, 0.5)}


def render_oblique(board: BoardDesign, path: Path) -> None:
    """The picture of the README: 1400 x 1100, 35 degrees off the vertical."""
    tilt, far = math.radians(35), 0.66
    eye = (0.0, -far * math.sin(tilt) - 0.018, far * math.cos(tilt))
    image, _ = render(board, eye, tilt, 1400, 1100, fovy=34, shadows=True)
    cv2.imwrite(str(path), image[:, :, ::-1])


def render(
    board: BoardDesign, eye: tuple[float, float, float], tilt: float, width: int, height: int,
    fovy: float, shadows: bool,
) -> tuple[np.ndarray, float]:  # fmt: skip
    """An RGB picture and the milliseconds that it took; the eye in frame `board`."""
    spec = scene(board, width, height, shadows)
    quat = [math.cos(tilt / 2), math.sin(tilt / 2), 0, 0]
    spec.worldbody.add_camera(name="eye", pos=eye, quat=quat, fovy=fovy)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, height, width, max_geom=3000) as renderer:
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        times = []
        for _ in range(6):
            start = time.perf_counter()
            renderer.update_scene(data, "eye")
            image = renderer.render()
            times.append((time.perf_counter() - start) * 1e3)
    return image, min(times)


def scene(board: BoardDesign, width: int, height: int, shadows: bool) -> mujoco.MjSpec:
    """The board on a grey bench under two lights."""
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.quality.offsamples = 4
    spec.visual.quality.shadowsize = 4096
    spec.visual.quality.numquads = 1
    spec.visual.quality.numslices, spec.visual.quality.numstacks = 20, 8
    spec.visual.map.znear, spec.visual.map.zfar = 0.05, 10.0
    spec.stat.extent, spec.stat.center = 1.0, (0, 0, 0)
    spec.visual.headlight.ambient = (0.42, 0.42, 0.42)
    spec.visual.headlight.diffuse = (0.12, 0.12, 0.12)
    spec.visual.headlight.specular = (0, 0, 0)
    world = spec.worldbody
    for pos, level, casts in (((-0.5, 0.45, 0.9), 0.60, True), ((0.6, -0.3, 0.9), 0.30, False)):
        world.add_light(
            pos=pos, dir=[-p for p in pos], diffuse=[level] * 3, specular=[0.35] * 3,
            ambient=[0, 0, 0], castshadow=casts and shadows, cutoff=70,
            type=mujoco.mjtLightType.mjLIGHT_SPOT,
        )  # fmt: skip
    for finish, (specular, shininess) in GLOSS.items():
        spec.add_material(name=finish, specular=specular, shininess=shininess, rgba=[1] * 4)
    world.add_geom(
        type=SHAPES["box"], size=[2, 2, 0.01], pos=[0, 0, -0.016], rgba=[0.80, 0.81, 0.83, 1]
    )
    x, y, thickness = board.size
    printed_box(spec, "pcb", silkscreen_image(board, 4), (0, 0, -thickness / 2), 0.0,
                (x / 2, y / 2, thickness / 2), 0.3)  # fmt: skip
    for component_id, parts in board_parts(board).items():
        for number, part in enumerate(parts):
            if part.printed:
                image = label_image(board.component(component_id))
                name = f"{component_id}_{number}"
                printed_box(spec, name, image, part.centre, part.yaw, part.half_size, 0.05)
                continue
            world.add_geom(
                type=SHAPES[part.shape], pos=part.centre, size=_size(part.shape, part.half_size),
                quat=_yaw(part.yaw), rgba=part.rgba, material=part.finish,
            )  # fmt: skip
    for marker in board.markers:
        half = (marker.size / 2, marker.size / 2, 0.25e-3)
        pos = (marker.x, marker.y, marker.z - 0.25e-3)
        printed_box(spec, marker.id, marker_image(marker), pos, marker.rotation, half, 0.0)
    return spec


def printed_box(
    spec: mujoco.MjSpec, name: str, image: np.ndarray, pos: tuple[float, float, float],
    yaw: float, half: tuple[float, float, float], specular: float,
) -> None:  # fmt: skip
    """A box with a picture on its upper side (a 2d texture is projected along z)."""
    height, width = image.shape[:2]
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = np.ascontiguousarray(image).tobytes()
    material = spec.add_material(name=name, specular=specular, shininess=0.3)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    spec.worldbody.add_geom(
        type=SHAPES["box"], pos=pos, quat=_yaw(yaw), size=half, material=name, rgba=[1] * 4
    )


def marker_image(marker: MarkerDesign, pixels: int = 360) -> np.ndarray:
    """A white square with a frame and four crosses; the outline only, for the preview."""
    image = np.full((pixels, pixels, 3), 245, np.uint8)
    cv2.rectangle(image, (6, 6), (pixels - 7, pixels - 7), (15, 15, 15), 6)
    offset, arm = marker.pitch / marker.size * pixels / 2, pixels // 14
    for sx in (-1, 1):
        for sy in (-1, 1):
            x, y = round(pixels / 2 + sx * offset), round(pixels / 2 + sy * offset)
            cv2.line(image, (x - arm, y), (x + arm, y), (15, 15, 15), 9)
            cv2.line(image, (x, y - arm), (x, y + arm), (15, 15, 15), 9)
    return image


def _size(shape: str, half: tuple[float, float, float]) -> tuple[float, float, float]:
    return (half[0], half[2], 0.0) if shape == "cylinder" else half


def _yaw(yaw: float) -> list[float]:
    return [math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]
