"""A twin of a scanned board: draws its mesh with the colours of the scan, and nothing else."""

import mujoco
import numpy as np

from aoicell.camera import Camera
from aoicell.observation import Image
from aoicell.planning.scanned_model import ScannedModel
from aoicell.sim.backend import make_renderer
from aoicell.sim.scene import optical_to_mujoco
from aoicell.sim.solids import set_pose
from aoicell.transforms import SE3, to_quat_wxyz

BACKGROUND = (120, 120, 120)
NEAR, FAR = 0.02, 10.0  # what is drawn (m)


class MeshTwin:
    """The `Renderer` protocol for a scanned model: no truth, and no light of its own.

    The scan's colours are drawn as they are, shadows and highlights of its lamps among them.
    """

    def __init__(self, model: ScannedModel, camera: Camera) -> None:
        """`camera`: the design of the camera whose pictures are wanted, a centred pinhole."""
        spec = mujoco.MjSpec()
        spec.visual.global_.offwidth, spec.visual.global_.offheight = camera.width, camera.height
        spec.stat.extent, spec.visual.map.znear, spec.visual.map.zfar = 1.0, NEAR, FAR
        for light in ("ambient", "diffuse", "specular"):
            setattr(spec.visual.headlight, light, [0, 0, 0])
        _add_sky(spec)
        _add_model(spec, model)
        fovy = float(2 * np.degrees(np.arctan(camera.height / 2 / camera.focal_px)))
        spec.worldbody.add_camera(name="hand", fovy=fovy)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._renderer = make_renderer(self._model, camera.width, camera.height)

    def render(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """Picture (H, W, 3) from a camera pose, with the board at a given pose; no lens errors."""
        lens = optical_to_mujoco(
            T_base_board.actInv(T_base_camera)
        )  # the board stays at the origin
        self._model.cam_pos[0] = lens.translation
        self._model.cam_quat[0] = to_quat_wxyz(lens.rotation)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._renderer.update_scene(self._data, "hand")
        return np.asarray(self._renderer.render(), dtype=np.uint8)

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.close()


def _add_sky(spec: mujoco.MjSpec) -> None:
    grey = np.array(BACKGROUND) / 255
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=8, height=48,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT, rgb1=grey, rgb2=grey,
    )  # fmt: skip


def _add_model(spec: mujoco.MjSpec, model: ScannedModel) -> None:
    """The triangles with the photo on them, glowing: no lamp shades what is lit already."""
    height, width = model.photo.shape[:2]
    texture = spec.add_texture(
        name="photo", type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = np.ascontiguousarray(model.photo).tobytes()
    material = spec.add_material(name="photo", emission=1.0, specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "photo"
    mesh = spec.add_mesh(name="board", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert = model.surface.vertices.ravel()
    mesh.userface = model.surface.faces.astype(np.int32).ravel()
    mesh.usertexcoord = model.uv.ravel()
    geom = spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="board", material="photo", mass=0,
        contype=0, conaffinity=0,
    )  # fmt: skip
    set_pose(geom, SE3.Identity())
