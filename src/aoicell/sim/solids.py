"""Small helpers to put solids and prints into a MuJoCo specification."""

import mujoco
import numpy as np

from aoicell.observation import Image
from aoicell.transforms import SE3, to_quat_wxyz


def set_pose(element: object, T: SE3) -> None:
    """Give a body, frame, geom or camera of a specification the pose T in its parent."""
    element.pos = T.translation  # type: ignore[attr-defined]
    element.quat = to_quat_wxyz(T.rotation)  # type: ignore[attr-defined]


def add_print(spec: mujoco.MjSpec, name: str, image: Image, specular: float = 0.0) -> None:
    """A material that carries a picture, (H, W) grey or (H, W, 3) RGB, as a 2D texture."""
    rgb = np.repeat(image[:, :, None], 3, axis=2) if image.ndim == 2 else image
    height, width = rgb.shape[:2]
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = np.ascontiguousarray(rgb).tobytes()
    material = spec.add_material(name=name, specular=specular, shininess=0.3)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def add_printed_plate(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, image: Image,
    size: tuple[float, float, float], T_body_face: SE3 | None = None, specular: float = 0.0,
    collides: bool = True,
) -> None:  # fmt: skip
    """A plate (width, height, thickness in m) with the picture on its face.

    The face is at z = 0 of its frame, z out of it, the picture's right along x and its top
    along y; a 2D texture on a box covers the sides along z once.
    """
    add_print(spec, name, image, specular)
    face = SE3.Identity() if T_body_face is None else T_body_face
    width, height, thickness = size
    geom = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[width / 2, height / 2, thickness / 2],
        material=name, rgba=[1, 1, 1, 1], group=1, mass=0,
        contype=int(collides), conaffinity=int(collides),
    )  # fmt: skip
    set_pose(geom, face * SE3(np.eye(3), np.array([0, 0, -thickness / 2])))
