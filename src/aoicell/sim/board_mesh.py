"""Puts a mesh where the board lies: one grey part, as it is drawn in the nominal twin."""

import mujoco

from aoicell.planning.meshes import GREY, BoardMesh


def add_board_mesh(spec: mujoco.MjSpec, body: mujoco.MjsBody, part: BoardMesh) -> None:
    """The triangles, and for contacts the box around them, in the frame of `body`."""
    mesh = spec.add_mesh(name=part.name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.userface = part.vertices.ravel(), part.faces.ravel()
    mesh.smoothnormal = False  # edges of a part are sharp
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=part.name, rgba=[*GREY, 1], group=2, mass=0,
        contype=0, conaffinity=0,
    )  # fmt: skip
    x, y, z = part.size
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[x / 2, y / 2, max(z / 2, 1e-4)], pos=[0, 0, -z / 2],
        group=0, mass=0,
    )  # fmt: skip
