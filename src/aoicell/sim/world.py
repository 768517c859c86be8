"""The true state of a cell. Whoever holds a `World` knows everything: only the benchmark may."""

import time
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from aoicell.camera import Camera
from aoicell.errors import Unreachable
from aoicell.nominal import Nominal
from aoicell.observation import CameraName, Image, Observation
from aoicell.robot.trajectories import plan
from aoicell.sim.arrivals import Arrivals
from aoicell.sim.as_built import AsBuilt, Light, plain_surfaces
from aoicell.sim.backend import make_renderer
from aoicell.sim.drawing import stream
from aoicell.sim.lamps import relight
from aoicell.sim.motion import first_contact, touching
from aoicell.sim.population import Population
from aoicell.sim.prints import true_corners, true_crosses
from aoicell.sim.scene import ARM, build_model, mocap_bodies, visible
from aoicell.sim.sensor import CameraModel, Conditions
from aoicell.sim.spoiling import Spoil
from aoicell.transforms import SE3, Array, apply, to_quat_wxyz, translation

PATH_STEP = float(np.radians(3))  # of the fastest joint, from one check for contact to the next
UNDERGROUND = translation(z=-5.0)  # where props are until they are wanted


@dataclass(frozen=True)
class Truth:
    """What was true at the instant of a picture; `picture` counts them within a trial."""

    T_base_camera: SE3
    T_base_board: SE3
    T_base_armtarget: SE3
    camera: Camera
    trial: int
    picture: int

    @property
    def T_camera_board(self) -> SE3:
        """The board as the camera really saw it."""
        return self.T_base_camera.actInv(self.T_base_board)


class World:
    """A simulated cell with its as-built geometry, the robot's true posture, and pictures of it."""

    def __init__(
        self, nominal: Nominal, as_built: AsBuilt, pictures: bool = True, props: bool = False
    ) -> None:
        """Build the cell; without `pictures` what only they would show is left out.

        With `props` there is what may get in the camera's way, put away for the time being.
        """
        self.nominal, self.as_built = nominal, as_built
        self.geometry = as_built.geometry
        self._cameras = {
            name: CameraModel(camera, as_built.sensors[name], as_built.light)
            for name, camera in self.geometry.cameras.items()
        }
        self._hand_as_built = self._cameras["hand"]
        self._surfaces = as_built.surfaces if pictures else plain_surfaces()
        self._with_props = props
        self.population: Population | None = None
        self.light = as_built.light
        self._compile()
        self._dofs = [self.model.joint(ARM + n).dofadr[0] for n in nominal.arm.joint_names]
        self._renderers: dict[CameraName, mujoco.Renderer] = {}
        self._truths: WeakKeyDictionary[Observation, Truth] = WeakKeyDictionary()
        self._joints = [self.model.joint(ARM + n).qposadr[0] for n in nominal.arm.joint_names]
        self._arm = Arrivals(
            nominal.arm, self.geometry.joint_offsets, as_built.arrival, self._gravity_torques
        )
        self.T_base_board = self.geometry.T_base_board
        self.render_seconds = 0.0
        self.spoils: tuple[tuple[int, Spoil], ...] = ()  # by the number of a picture in its trial
        self._props: dict[str, SE3] = {}
        self.begin()
        self.arrive(nominal.q_home)

    def _compile(self) -> None:
        """Build the model, as the cell was built, with what is on the board now."""
        self.model = build_model(
            self.nominal,
            self.as_built.geometry,
            {name: camera.pinhole for name, camera in self._cameras.items()},
            self.light,
            self.population.surfaces(self._surfaces) if self.population else self._surfaces,
            self._with_props,
            self.population,
        )
        self.data = mujoco.MjData(self.model)
        self._mocap = mocap_bodies(self.model)
        self._scratch = mujoco.MjData(self.model)  # for questions about other postures

    def begin(self, trial: int = -1) -> None:
        """Restart a trial: the clock, the random streams of arrivals and pictures, and the arm.

        It stands at home and no trial depends on the one before. Methods that are compared
        call it each, so that they share their random numbers.
        """
        self._trial, self._arrivals, self._pictures, self._observations = trial, 0, 0, 0
        self.clock = 0.0  # s: moves, pauses before pictures, exposures
        self.q_command = self.nominal.q_home.copy()
        self._arm.restart(self.q_command)
        self._take_posture()

    def drive(self, q: ArrayLike) -> None:
        """Move along the straight joint path from the present command to q (rad), and arrive.

        Raises Unreachable, before anything moves, when bodies would touch on the way.
        """
        q_command = np.array(q, dtype=float)
        trajectory = plan(self.nominal.arm, self.q_command, q_command)
        self._refuse_contact(trajectory.path(PATH_STEP))
        self.clock += trajectory.duration + self.as_built.arrival.wait
        self.arrive(q_command)

    def _refuse_contact(self, qs: Array) -> None:
        """Raise when bodies touch at joint angles qs (N, dof), the present ones left out."""
        self._scratch.mocap_pos[:] = self.data.mocap_pos
        self._scratch.mocap_quat[:] = self.data.mocap_quat
        found = first_contact(self.model, self._scratch, self._joints, self._arm.posture(qs[1:]))
        if found:
            index, (first, second) = found
            x, y, z = self.nominal.arm.fk(qs[index + 1]).translation * 1e3
            share = (index + 1) / (len(qs) - 1)
            raise Unreachable(
                f"move: {first} would touch {second} after {share:.0%} of the way, with "
                f"the flange at ({x:.0f}, {y:.0f}, {z:.0f}) mm in base; "
                "take another way there, for example through home"
            )

    def arrive(self, q: ArrayLike) -> None:
        """Bring the arm to the commanded joint angles q (rad), as exactly as it can.

        Without a move between: nothing is checked, and no time passes.
        """
        q_command = np.array(q, dtype=float)  # a copy: the caller may go on with its own
        rng = self._stream(f"arrival_{self._arrivals}")
        self._arrivals += 1
        self.q_command = q_command
        self._arm.arrive(q_command, rng)
        self._take_posture()

    def _take_posture(self) -> None:
        self.data.qpos[self._joints] = self._arm.at_picture()
        self._update()

    def _gravity_torques(self, q: Array) -> Array:
        """Torque (N m) of each joint that holds the arm against gravity at joint angles q."""
        data = self._scratch
        data.qpos[self._joints] = q
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        mujoco.mj_comVel(self.model, data)
        torques = np.empty(self.model.nv)
        mujoco.mj_rne(self.model, data, 0, torques)  # at rest: gravity alone
        return torques[self._dofs]

    def place_board(self, T_base_board: SE3) -> None:
        """Put the server board somewhere else."""
        self.T_base_board = T_base_board
        self._update()

    def populate(self, population: Population | None) -> None:
        """Let a board with these components lie where the board lies; None: the taught one.

        Nothing else changes: no posture, no pose, no random stream, no clock. The model is built
        anew, which takes about a second with the renderer; the same population again takes none.
        """
        if population is self.population:
            return
        self.population, qpos = population, self.data.qpos.copy()
        hand = self.model.body("hand")
        T_flange_hand = hand.pos.copy(), hand.quat.copy()
        self._compile()
        self.close()  # the renderers' pictures are of the old model
        self.data.qpos[:] = qpos
        hand = self.model.body("hand")
        hand.pos[:], hand.quat[:] = T_flange_hand
        self._update()

    def place(self, prop: str, T_base_prop: SE3) -> None:
        """Put a prop into view."""
        self._props[prop] = T_base_prop
        self._update()

    def put_away(self) -> None:
        """Take all props out of view."""
        self._props.clear()
        self._update()

    def change_camera(self, T_flange_camera: SE3, camera: Camera) -> None:
        """From now on the hand camera sits there and has that lens, nearly the old one.

        Pictures are rendered for the old lens: where the new one looks past its edge, the last
        pixels are repeated.
        """
        built, sensor = self.as_built.geometry.cameras["hand"], self.as_built.sensors["hand"]
        if camera is built:
            self._cameras["hand"] = self._hand_as_built
        elif camera is not self.geometry.cameras["hand"]:
            pinhole = self._hand_as_built.pinhole
            self._cameras["hand"] = CameraModel(camera, sensor, self.as_built.light, pinhole)
        cameras = {**self.geometry.cameras, "hand": camera}
        self.geometry = replace(self.geometry, T_flange_camera=T_flange_camera, cameras=cameras)
        hand = self.model.body("hand")
        hand.pos[:], hand.quat[:] = (
            T_flange_camera.translation, to_quat_wxyz(T_flange_camera.rotation)
        )  # fmt: skip
        self._update()

    def change_light(self, light: Light) -> None:
        """From now on the lamps have that level, colour and direction.

        What happens behind the lens, gradient and flicker, stays as it was built.
        """
        self.light = light
        relight(self.model, self.nominal.folder / "cell.xml", light)
        self._update()

    def _update(self) -> None:
        bodies = {"board": self.T_base_board, **self._props}
        for name, index in self._mocap.items():
            T_world_body = self.nominal.T_world_base * bodies.get(name, UNDERGROUND)
            self.data.mocap_pos[index] = T_world_body.translation
            self.data.mocap_quat[index] = to_quat_wxyz(T_world_body.rotation)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def T_base_body(self, name: str) -> SE3:
        """True pose of a body: arm/flange, hand, tripod, armtarget, tabletarget, board."""
        body = self.data.body(name)
        T_world_body = SE3(body.xmat.reshape(3, 3).copy(), body.xpos.copy())
        return self.nominal.T_world_base.actInv(T_world_body)

    def truth(self) -> Truth:
        """What is true right now, for the hand camera."""
        return Truth(
            T_base_camera=self.T_base_body("hand"),
            T_base_board=self.T_base_board,
            T_base_armtarget=self.T_base_body("armtarget"),
            camera=self.camera("hand"),
            trial=self._trial,
            picture=self._observations,
        )

    def truth_of(self, observation: Observation) -> Truth:
        """What was true when this observation of this world was made."""
        return self._truths[observation]

    def observe(self, observation: Observation) -> Observation:
        """Remember the truth behind an observation that was just made."""
        self.clock += self.as_built.sensors[observation.camera].exposure
        self._truths[observation] = self.truth()
        self._observations += 1
        return observation

    def picture(self, camera: CameraName, colour: bool = False) -> Image:
        """A raw picture, grey (H, W) or RGB (H, W, 3), with the lens and noise of this cell."""
        pinhole = self._spoiled(camera, self.pinhole_picture(camera))
        rng = self._stream(f"picture_{self._pictures}")
        self._pictures += 1
        return self._cameras[camera].expose(pinhole, self._conditions(camera, colour), rng)

    def _spoiled(self, camera: CameraName, image: Image) -> Image:
        for picture, spoil in self.spoils:
            if picture == self._pictures:
                image = spoil(image, self.T_base_body(camera), self._cameras[camera].pinhole[2])
        return image

    def _conditions(self, camera: CameraName, colour: bool) -> Conditions:
        T_base_camera, surface = self.T_base_body(camera), self.T_base_board.translation[2]
        drop = -T_base_camera.rotation[2, 2]  # downward part of the optical axis
        distance = float((T_base_camera.translation[2] - surface) / max(drop, 0.1))
        motion = self._motion_px(distance) if camera == "hand" else (0.0, 0.0)
        return Conditions(distance, motion, self.warm_up, colour)

    def _motion_px(self, distance: float) -> tuple[float, float]:
        """How far the picture moves during an exposure, at a distance (m)."""
        twist = self.nominal.arm.jacobian(self.q_command) @ self._arm.rates_at_picture()
        T_camera_flange = self.geometry.T_flange_camera.inverse()
        at_axis = T_camera_flange.inverse().act(np.array([0, 0, distance]))
        velocity = T_camera_flange.rotation @ (twist[:3] + np.cross(twist[3:], at_axis))
        scale = self.camera("hand").focal_px / distance * self.as_built.sensors["hand"].exposure
        return float(-velocity[0] * scale), float(-velocity[1] * scale)

    @property
    def warm_up(self) -> float:
        """How far the camera has warmed up, 0 at calibration to 1: ten trials take it to 63 %."""
        return 1 - float(np.exp(-(self._trial + 1) / 10))

    def camera(self, name: CameraName) -> Camera:
        """The true intrinsics right now."""
        return self._cameras[name].camera(self.warm_up)

    def pinhole_picture(self, camera: CameraName) -> Image:
        """MuJoCo's bare picture, before the lens."""
        renderer, start = self._renderer(camera), time.perf_counter()
        renderer.update_scene(self.data, camera, visible(props=bool(self._props)))
        image = renderer.render()
        self.render_seconds += time.perf_counter() - start
        return np.asarray(image, dtype=np.uint8)

    def board_points(self, which: str) -> Array:
        """True corners (N, 3) of a chessboard, armtarget or tabletarget, in its own frame."""
        nominal = self.nominal
        board = {"armtarget": nominal.armtarget, "tabletarget": nominal.tabletarget}[which]
        return true_corners(board, self.geometry.print_scales[which], self.geometry.bows[which])

    def marker_crosses(self, id: str) -> Array:
        """True centres (4, 3) of a marker's crosses on the board."""
        crosses = true_crosses(self.nominal.marker, self.geometry.print_scales[id])
        return self.marker_points(id, crosses)

    def contacts(self, tolerance: float = 0.0) -> list[tuple[str, str]]:
        """Pairs of bodies that touch in the present posture."""
        return touching(self.model, self.data, tolerance)

    def project(self, ps_board: ArrayLike) -> Array:
        """True pixels (N, 2) in the hand camera's raw picture of points (N, 3) on the board."""
        return self.camera("hand").project(ps_board, self.truth().T_camera_board)

    def marker_points(self, id: str, ps_marker: ArrayLike) -> Array:
        """True places (N, 3) on the board of points (N, 3) in a marker's frame."""
        return apply(self.geometry.Ts_board_marker[id], ps_marker)

    def close(self) -> None:
        """Free the OpenGL contexts."""
        for renderer in self._renderers.values():
            renderer.close()
        self._renderers.clear()

    def _stream(self, name: str) -> np.random.Generator:
        return stream(self.as_built.seed, self.as_built.world, self._trial, name)

    def _renderer(self, camera: CameraName) -> mujoco.Renderer:
        if camera not in self._renderers:
            width, height, _ = self._cameras[camera].pinhole
            self._renderers[camera] = make_renderer(
                self.model, width, height, self.as_built.light.shadows
            )
        return self._renderers[camera]
