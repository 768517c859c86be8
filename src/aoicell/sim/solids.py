"""Small helpers to put solids and prints into a MuJoCo specification."""

from dataclasses import dataclass

import mujoco
import numpy as np

from aoicell.observation import Image
from aoicell.sim.prints import plate_height
from aoicell.transforms import SE3, Array, to_quat_wxyz, translation

CELLS = (24, 18)  # of the mesh of a face that is bent or glossy, along x and y
MIRROR, SHARP = 3.0, 0.7  # MuJoCo's specular and shininess at full glare
VEIL = 0.25  # share of white in what is printed black, at full glare
GAP = 5e-5  # between such a face and the plate that carries it (m)


@dataclass(frozen=True)
class Face:
    """How the printed side of a plate is: bow and twist (m, see `plate_height`), and its gloss.

    `glare` from 0, a face with no more than its own `specular` and `shininess` (as in MuJoCo),
    to 1: the lamps' reflections saturate, and that of the bright room veils what is dark.
    """

    bow: float = 0.0
    twist: float = 0.0
    specular: float = 0.0
    shininess: float = 0.3
    glare: float = 0.0

    @property
    def plain(self) -> bool:
        """Whether the side of a box will do: flat, and without highlights, which OpenGL only
        knows at the vertices.
        """
        return not (self.bow or self.twist or self.glare)


MATT = Face()


def set_pose(element: object, T: SE3) -> None:
    """Give a body, frame, geom or camera of a specification the pose T in its parent."""
    element.pos = T.translation  # type: ignore[attr-defined]
    element.quat = to_quat_wxyz(T.rotation)  # type: ignore[attr-defined]


def add_print(spec: mujoco.MjSpec, name: str, image: Image, face: Face = MATT) -> None:
    """A material that carries a picture, (H, W) grey or (H, W, 3) RGB, as a 2D texture."""
    if face.glare:  # MuJoCo multiplies highlights by the picture: on pure black there are none
        level = np.arange(256)
        image = np.rint(level + VEIL * face.glare * (255.0 - level)).astype(np.uint8)[image]
    rgb = np.repeat(image[:, :, None], 3, axis=2) if image.ndim == 2 else image
    height, width = rgb.shape[:2]
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = np.ascontiguousarray(rgb).tobytes()
    material = spec.add_material(
        name=name,
        specular=face.specular + face.glare * (MIRROR - face.specular),
        shininess=face.shininess + face.glare * (SHARP - face.shininess),
    )
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def add_printed_plate(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, image: Image,
    size: tuple[float, float, float], T_body_face: SE3 | None = None, face: Face = MATT,
    collides: bool = True,
) -> None:  # fmt: skip
    """A plate (width, height, thickness in m) with the picture on its face.

    The face is at z = 0 of its frame, z out of it, the picture's right along x and its top
    along y; a 2D texture on a box covers the sides along z once.
    """
    add_print(spec, name, image, face)
    T = SE3.Identity() if T_body_face is None else T_body_face
    width, height, thickness = size
    top = 0.0 if face.plain else _add_face(spec, body, name, (width, height), T, face)
    geom = body.add_geom(
        name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=[width / 2, height / 2, thickness / 2],
        rgba=[1, 1, 1, 1], group=1, mass=0, contype=int(collides), conaffinity=int(collides),
    )  # fmt: skip
    if face.plain:
        geom.material = name
    set_pose(geom, T * translation(z=top - thickness / 2))


def _add_face(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, size: tuple[float, float], T: SE3,
    face: Face,
) -> float:  # fmt: skip
    """The printed side as a mesh of its own; returns how high the plate may reach behind it."""
    points, texture, faces = _grid(size, face)
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.usertexcoord = points.ravel(), texture.ravel()
    mesh.userface = mesh.userfacetexcoord = faces.ravel()
    geom = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, material=name, rgba=[1, 1, 1, 1],
        group=1, mass=0, contype=0, conaffinity=0,
    )  # fmt: skip
    set_pose(geom, T)
    return float(points[:, 2].min()) - GAP


def _grid(size: tuple[float, float], face: Face) -> tuple[Array, Array, np.ndarray]:
    """Vertices (N, 3), their places in the picture (N, 2), and triangles (M, 3), z outwards."""
    across, up = CELLS
    u, v = np.meshgrid(np.linspace(0, 1, across + 1), np.linspace(0, 1, up + 1))
    x, y = (u - 0.5) * size[0], (v - 0.5) * size[1]
    z = plate_height(x, y, size, face.bow, face.twist)
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    index = np.arange(points.shape[0]).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    # a mesh's picture has its top at 0, a box's at 1
    return points, np.column_stack([u.ravel(), 1 - v.ravel()]), triangles
