"""Turns what happens in a watched cell into what the window shows."""

import time
from collections.abc import Callable

from aoicell.benchmark.records import TrialRecord
from aoicell.benchmark.trial import Session
from aoicell.benchmark.values import trial_values
from aoicell.errors import Refused
from aoicell.observation import Image, Observation
from aoicell.online import Looked, relocate
from aoicell.pipeline import Calibration
from aoicell.robot.trajectories import plan
from aoicell.scenario import Scenario
from aoicell.sim.meshes import Posture, Puppet
from aoicell.sim.world import World
from aoicell.targets.detector import Detector
from aoicell.transforms import SE3, Array, apply, distance_deg, distance_mm
from aoicell.view.frames import Belief, believed_axes, true_axes
from aoicell.view.picture import detect, draw_detections
from aoicell.view.shown import Shown
from aoicell.view.watched import Gate

FRAME_SECONDS = 1 / 30  # between two places of the arm on its way
Rows = list[tuple[str, str]]


class Display:
    """The `Watcher` of a world: follows the arm, draws detections, keeps the table of results.

    Only looks on: what it detects and solves for is asked of the same functions with the same
    pictures, and changes nothing in the trial.
    """

    show: Callable[[Shown], None] | None = None  # where it is shown; nowhere at first

    def __init__(
        self, scenario: Scenario, world: World, detector: Detector, gate: Gate, speed: float
    ) -> None:
        self.records: list[TrialRecord] = []
        self._scenario, self._world, self._detector = scenario, world, detector
        self._gate, self._speed = gate, speed
        self._puppet, self._before = Puppet(world.model), Posture.of(world.data)
        self._phase, self._calibrating, self._pictures = "starting", False, 0
        self._belief, self._trial_rows = Belief(), Rows()
        self._looking: tuple[Session, str] | None = None  # at the picture that localises
        self._picture: Image | None = None
        self._caption = ""

    # -- What the cell reports ---------------------------------------------------------------

    def departs(self) -> None:
        """Remember where the arm was."""
        self._before = Posture.of(self._world.data)

    def arrives(self, q_start: Array, q_end: Array) -> None:
        """Show the way, in the time that the drives take for it."""
        trajectory = plan(self._world.nominal.arm, q_start, q_end)
        way, before, after = q_end - q_start, self._before, Posture.of(self._world.data)
        start = time.perf_counter()
        while (t := (time.perf_counter() - start) * self._speed) < trajectory.duration:
            q = trajectory.sample(t)
            share = float((q - q_start) @ way / (way @ way))
            self._show(after.at_joints(before.qpos + share * (after.qpos - before.qpos)), q)
            time.sleep(FRAME_SECONDS)
        self._show()

    def sees(self, observation: Observation) -> None:
        """Show the picture with what is detected in it; halt there when paused."""
        nominal, camera = self._world.nominal, observation.camera
        found, words = detect(observation, nominal, self._detector, self._calibrating)
        self._pictures += 1
        self._picture = draw_detections(observation, found, nominal.cameras[camera])
        self._caption = f"{camera} camera, picture {self._pictures}: {words}"
        if self._looking:
            self._localise(observation, *self._looking)
            self._looking = None
        self._show()
        self._gate.halt()

    # -- What the procedure tells ------------------------------------------------------------

    def tell(
        self, phase: str, calibrating: bool = False, calibration: Calibration | None = None
    ) -> None:
        """A new phase; with a calibration when one was found."""
        self._phase, self._calibrating = phase, calibrating
        if calibration:
            self._belief = Belief(calibration)
        self._show()

    def begin(self, session: Session, trial: int, method: str) -> None:
        """A method's trial is about to start."""
        self._belief = Belief(session.calibrations[method])
        self._looking, self._pictures = (session, method), 0
        self._trial_rows = [(f"Trial {trial}, method {method}", "")]
        self.tell("looking, correcting, visiting")

    def end(self, record: TrialRecord) -> None:
        """Its result; the board lies where it was taught again."""
        self.records.append(record)
        self._belief = Belief(self._belief.calibration)
        self._show()

    # -- What is shown -----------------------------------------------------------------------

    def shown(self, posture: Posture | None = None, q: Array | None = None) -> Shown:
        """Everything as it is now; on the way with the commanded joint angles q (rad) there."""
        world = self._world
        q = world.q_command if q is None else q
        return Shown(
            Ts_world_body=self._puppet.Ts_world_body(posture or Posture.of(world.data)),
            axes=[*true_axes(world), *believed_axes(world.nominal, self._belief, q)],
            picture=self._picture,
            caption=self._caption,
            rows=[*self._rows(), *self._trial_rows, *self._results()],
        )

    def _show(self, posture: Posture | None = None, q: Array | None = None) -> None:
        if self.show:
            self.show(self.shown(posture, q))

    def _rows(self) -> Rows:
        scenario, built = self._scenario, self._world.as_built
        rows = [
            (scenario.title or scenario.name, ""),
            ("world", f"{built.world} of profile {scenario.profile}, seed {scenario.seed}"),
            ("phase", self._phase),
        ]
        if calibration := self._belief.calibration:
            T_true = self._world.geometry.T_flange_camera
            T = calibration.hand_eye.T_flange_camera
            rows.append(("hand-eye", f"{_off(T, T_true)} off the truth"))
        return rows

    def _localise(self, observation: Observation, session: Session, method: str) -> None:
        """Where the software believes the board to be now, by the method at work."""
        online = session.online(method)
        nominal, template, calibration = session.nominal, online.template, online.calibration
        shift = distance_mm(self._world.T_base_board, session.T_base_board_taught)
        turn = distance_deg(self._world.T_base_board, session.T_base_board_taught)
        self._trial_rows.append(("board moved", f"{shift:.1f} mm, {turn:.1f}°"))
        try:
            correction = relocate(Looked(observation), online)
        except Refused as refusal:
            self._trial_rows.append(("refused", str(refusal)))
            return
        T_base_board = (
            calibration.T_base_camera(observation.state) * correction.located.T_camera_target
        )
        layout = template.layout
        if not session.methods[method].all_markers:  # then the marker itself was located
            T_board_marker = nominal.T_board_positioning
            T_base_board = T_base_board * T_board_marker.inverse()
            layout = {id: apply(T_board_marker, crosses) for id, crosses in layout.items()}
        self._belief = Belief(calibration, T_base_board, layout)
        off = _off(T_base_board, self._world.T_base_board)
        self._trial_rows.append(("board found", f"{off} off the truth, in base"))

    def _results(self) -> Rows:
        """One row a finished trial, the last eight."""
        rows: Rows = []
        for record in self.records[-8:]:
            mm, px = (trial_values(record)[name] for name in ("residual_mm", "detected_px"))
            result = record.outcome if mm is None else f"{mm:.2f} mm"
            result += "" if px is None else f", {px:.1f} px"
            rows.append((f"{record.trial} {record.method}", result))
        return [("Residual, mean over the views", ""), *rows] if rows else []


def _off(T: SE3, T_true: SE3) -> str:
    return f"{distance_mm(T, T_true):.2f} mm, {distance_deg(T, T_true):.3f}°"
