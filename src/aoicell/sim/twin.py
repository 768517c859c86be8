"""The nominal twin: draws the cell as designed, for virtual pictures of inspection targets."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from aoicell.nominal import Nominal
from aoicell.observation import Image
from aoicell.planning.meshes import BoardMesh
from aoicell.sim.as_built import Light, designed, plain_surfaces
from aoicell.sim.backend import make_renderer
from aoicell.sim.board_scene import PART
from aoicell.sim.scene import ARM, build_model, optical_to_mujoco, visible
from aoicell.transforms import SE3, to_quat_wxyz


class NominalTwin:
    """The `Renderer` protocol, from the URDF and the cell's folder only: no seed, no truth.

    The camera stands free; arm, cameras and tripod are left out, so nothing hides the board.
    """

    def __init__(self, nominal: Nominal, part: BoardMesh | None = None) -> None:
        """With a part, a mesh lies where the board would."""
        self._nominal = nominal
        camera = nominal.cameras["hand"]
        pinhole = (camera.width, camera.height, camera.focal_px)
        self._model = build_model(nominal, designed(nominal), {"hand": pinhole, "tripod": pinhole},
            Light(), plain_surfaces(), part=part)  # fmt: skip
        self._data = mujoco.MjData(self._model)
        self._camera = self._model.camera("hand").id
        self._model.cam_bodyid[self._camera] = 0
        self._hide_robot()
        self._shows = self._components()
        self._renderer = make_renderer(self._model, camera.width, camera.height)

    def _hide_robot(self) -> None:
        for geom, body in enumerate(self._model.geom_bodyid):
            name = self._model.body(body).name
            if name.startswith(ARM) or name in ("hand", "armtarget", "bracket", "tripod"):
                self._model.geom_rgba[geom, 3] = 0

    def _components(self) -> NDArray[np.int16]:
        """For each geom, and after them for none, the number of its component, -1 for others."""
        numbers = {c.id: number for number, c in enumerate(self._nominal.board.components)}
        shown = []
        for geom in range(self._model.ngeom):
            name = self._model.geom(geom).name
            is_part, id = name.startswith(PART), name.removeprefix(PART).rpartition("_")[0]
            shown.append(numbers[id] if is_part else -1)
        return np.array([*shown, -1], np.int16)

    def render(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """Picture (H, W, 3) from a camera pose, with the board at a given pose; no lens errors."""
        self._place(T_base_camera, T_base_board)
        return np.asarray(self._renderer.render(), dtype=np.uint8)

    def bare(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """The same picture of the board without its components."""
        alpha = self._model.geom_rgba[:, 3]
        designed = alpha.copy()
        alpha[self._shows[:-1] >= 0] = 0
        try:
            return self.render(T_base_camera, T_base_board)
        finally:
            alpha[:] = designed

    def half_turned(self, T_base_camera: SE3, T_base_board: SE3) -> Image:
        """The same picture with each component turned by half about its own middle."""
        model, numbers = self._model, self._shows[:-1]
        parts = np.flatnonzero(numbers >= 0)
        places, turns = model.geom_pos[parts].copy(), model.geom_quat[parts].copy()
        components = self._nominal.board.components
        middles = np.array([(components[n].x, components[n].y) for n in numbers[parts]])
        middles = middles.reshape(-1, 2)
        model.geom_sameframe[parts] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        model.geom_pos[parts, :2] = 2 * middles - places[:, :2]
        w, x, y, z = turns.T
        model.geom_quat[parts] = np.column_stack([-z, -y, x, w])  # a half turn about z before it
        try:
            return self.render(T_base_camera, T_base_board)
        finally:
            model.geom_pos[parts], model.geom_quat[parts] = places, turns

    def solids(
        self, T_base_camera: SE3, T_base_board: SE3
    ) -> tuple[NDArray[np.int16], NDArray[np.float32]]:
        """For each pixel (H, W) of the picture the number of the component that it shows, -1 for
        anything else, and how far in front of the camera that is (m, along its axis).
        """
        self._place(T_base_camera, T_base_board)
        renderer = self._renderer
        renderer.enable_segmentation_rendering()
        numbers = self._shows[renderer.render()[..., 0]]
        renderer.disable_segmentation_rendering()
        renderer.enable_depth_rendering()
        depths = renderer.render().astype(np.float32)
        renderer.disable_depth_rendering()
        return numbers, depths

    def _place(self, T_base_camera: SE3, T_base_board: SE3) -> None:
        """Set the scene up."""
        T_world_base = self._nominal.T_world_base
        lens, board = optical_to_mujoco(T_world_base * T_base_camera), T_world_base * T_base_board
        self._model.cam_pos[self._camera] = lens.translation
        self._model.cam_quat[self._camera] = to_quat_wxyz(lens.rotation)
        self._data.mocap_pos[0] = board.translation
        self._data.mocap_quat[0] = to_quat_wxyz(board.rotation)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._renderer.update_scene(self._data, self._camera, visible())

    def close(self) -> None:
        """Free the OpenGL context."""
        self._renderer.close()
