"""The visible geometry of a MuJoCo model as coloured and printed meshes, and where its bodies are.

For viewers that draw by themselves. Looks only: what collides but is not drawn is left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from aoicell.errors import ModelError
from aoicell.observation import Image
from aoicell.sim.scene import HULLS
from aoicell.transforms import SE3, Array, apply

ROUND = 32  # sides of a cylinder
FLOOR = 3.0  # what is drawn of an endless plane, from its middle (m)
PRINT_GAP = 2e-4  # between a print and the box that carries it (m)
UNSET = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's colour of a geom that is given none
RGB_ROLE = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)

Faces = NDArray[np.int64]
Rgb = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles (M, 3) over vertices (N, 3) in the body's frame (m), all of one colour."""

    vertices: Array
    faces: Faces
    rgb: Rgb


@dataclass(frozen=True, eq=False)
class Print:
    """Triangles that carry a picture, RGB (H, W, 3); `uv` (N, 2) from its lower left corner."""

    vertices: Array
    faces: Faces
    uv: Array
    image: Image


@dataclass(frozen=True, eq=False)
class BodyShape:
    """All that is seen of a body."""

    name: str
    solids: tuple[Solid, ...]
    prints: tuple[Print, ...]


@dataclass(frozen=True, eq=False)
class Posture:
    """Where everything movable is: joints (nq,) in rad, free-standing bodies (nmocap, 3 and 4)."""

    qpos: Array
    mocap_pos: Array
    mocap_quat: Array

    @classmethod
    def of(cls, data: mujoco.MjData) -> Self:
        """A copy of what MuJoCo's data say."""
        return cls(data.qpos.copy(), data.mocap_pos.copy(), data.mocap_quat.copy())

    def at_joints(self, qpos: Array) -> "Posture":
        """The same with other joint angles (rad)."""
        return Posture(qpos, self.mocap_pos, self.mocap_quat)


class Puppet:
    """The bodies of a model in any posture, apart from the data that a world works with."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model, self._data = model, mujoco.MjData(model)

    def Ts_world_body(self, posture: Posture) -> Mapping[str, SE3]:
        """Pose of each body by name; the world itself is among them."""
        data = self._data
        data.qpos[:], data.mocap_pos[:] = posture.qpos, posture.mocap_pos
        data.mocap_quat[:] = posture.mocap_quat
        mujoco.mj_kinematics(self._model, data)
        return {
            self._model.body(i).name: SE3(data.xmat[i].reshape(3, 3).copy(), data.xpos[i].copy())
            for i in range(self._model.nbody)
        }


def body_shapes(model: mujoco.MjModel) -> list[BodyShape]:
    """What is seen of each body, in its own frame; of some it is nothing."""
    shapes = []
    for body in range(model.nbody):
        parts: dict[Rgb, list[tuple[Array, Faces]]] = {}
        prints = []
        first = model.body_geomadr[body]
        for geom in range(first, first + model.body_geomnum[body]):
            if model.geom_group[geom] == HULLS:
                continue
            vertices, faces = _triangles(model, geom)
            T = _pose(model, geom)
            printed = _print(model, geom, T)
            if printed:
                prints.append(printed)
            if not printed or model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
                parts.setdefault(_rgb(model, geom), []).append((apply(T, vertices), faces))
        solids = tuple(_joined(pieces, rgb) for rgb, pieces in parts.items())
        shapes.append(BodyShape(model.body(body).name, solids, tuple(prints)))
    return shapes


def _joined(pieces: list[tuple[Array, Faces]], rgb: Rgb) -> Solid:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    faces = [faces + start for (_, faces), start in zip(pieces, starts, strict=False)]
    return Solid(np.concatenate([v for v, _ in pieces]), np.concatenate(faces), rgb)


def _triangles(model: mujoco.MjModel, geom: int) -> tuple[Array, Faces]:
    """A geom's vertices in its own frame, and its faces."""
    import trimesh  # only viewers draw triangles: it takes long to import

    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        return _mesh_vertices(model, mesh), _mesh_rows(model, mesh, model.mesh_face)
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        return _rectangle(size[0] or FLOOR, size[1] or FLOOR, 0.0)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        shape = trimesh.creation.box(2 * size)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        shape = trimesh.creation.cylinder(size[0], 2 * size[1], sections=ROUND)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        shape = trimesh.creation.capsule(2 * size[1], size[0])
    elif kind in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID):
        shape = trimesh.creation.icosphere(subdivisions=3)
        shape.apply_scale(size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else size[0])
    else:
        body = model.body(model.geom_bodyid[geom]).name
        raise ModelError(f"body '{body}': the viewer cannot draw a geom of the type {kind.name}")
    return np.asarray(shape.vertices, float), np.asarray(shape.faces, np.int64)


def _rectangle(half_width: float, half_height: float, z: float) -> tuple[Array, Faces]:
    x, y = half_width, half_height
    corners = np.array([[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def _mesh_vertices(model: mujoco.MjModel, mesh: int) -> Array:
    first = model.mesh_vertadr[mesh]
    return np.array(model.mesh_vert[first : first + model.mesh_vertnum[mesh]], float)


def _mesh_rows(model: mujoco.MjModel, mesh: int, table: NDArray[np.int32]) -> Faces:
    """The rows (M, 3) of a table over all faces that belong to a mesh."""
    first = model.mesh_faceadr[mesh]
    return np.array(table[first : first + model.mesh_facenum[mesh]], np.int64)


def _pose(model: mujoco.MjModel, geom: int) -> SE3:
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, model.geom_quat[geom])
    return SE3(R.reshape(3, 3), model.geom_pos[geom].copy())


def _print(model: mujoco.MjModel, geom: int, T: SE3) -> Print | None:
    """The picture on a geom: on the side of a box that faces z, or all over a mesh."""
    texture = _texture(model, geom)
    kind = model.geom_type[geom]
    if texture is None:
        return None
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        x, y, z = model.geom_size[geom]
        vertices, faces = _rectangle(x, y, z + PRINT_GAP)
        uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
        return Print(apply(T, vertices), faces, uv, texture)
    mesh = model.geom_dataid[geom]
    if kind != mujoco.mjtGeom.mjGEOM_MESH or model.mesh_texcoordadr[mesh] < 0:
        return None
    # corners of faces share a vertex or a place in the picture, but not always both
    vertices = _mesh_vertices(model, mesh)[_mesh_rows(model, mesh, model.mesh_face).ravel()]
    places = _mesh_rows(model, mesh, model.mesh_facetexcoord).ravel()
    uv = np.array(model.mesh_texcoord[model.mesh_texcoordadr[mesh] + places], float)
    uv[:, 1] = 1 - uv[:, 1]  # a mesh's picture has its top at 0
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return Print(apply(T, vertices), faces, uv, texture)


def _texture(model: mujoco.MjModel, geom: int) -> Image | None:
    material = model.geom_matid[geom]
    if material < 0 or model.mat_texid[material, RGB_ROLE] < 0:
        return None
    texture = model.mat_texid[material, RGB_ROLE]
    height, width = model.tex_height[texture], model.tex_width[texture]
    channels, first = model.tex_nchannel[texture], model.tex_adr[texture]
    data = model.tex_data[first : first + height * width * channels]
    return np.array(data.reshape(height, width, channels)[:, :, :3], np.uint8)


def _rgb(model: mujoco.MjModel, geom: int) -> Rgb:
    """The colour of a geom, or else of its material; with a texture, times the mean of that."""
    material, rgba = model.geom_matid[geom], model.geom_rgba[geom]
    if material >= 0 and (rgba == UNSET).all():
        rgba = model.mat_rgba[material]
    texture = _texture(model, geom)
    tint = 1.0 if texture is None else texture.reshape(-1, 3).mean(axis=0) / 255
    red, green, blue = np.rint(255 * np.clip(rgba[:3] * tint, 0, 1)).astype(int).tolist()
    return red, green, blue
