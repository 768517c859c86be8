"""Pictures of the simulated cell, and what is true of them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from aoicell.board import Component
from aoicell.camera import Camera
from aoicell.inspection import FineRegistration, ViewInspection
from aoicell.observation import Image
from aoicell.registration import component_points
from aoicell.sim.board_foreign import FOREIGN
from aoicell.sim.cell import SimCell
from aoicell.sim.defects import Defect
from aoicell.sim.population import Population
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array

WASHER = Component("WASHER", FOREIGN, 0, 0, 0, 0, 6e-3, 6e-3, 0.5e-3, "washer")
WASHER_AT = (-0.045, -0.09)
SHIFTED = {"U32": (0.0, -0.5e-3), "L18": (0.5e-3, 0.0)}
ROTATED = {"U9": np.radians(10), "U34": np.radians(-10)}
MISSING = ("C24", "U33", "L17", "J30", "R5")
TOLERATED = {"L8": (0.25e-3, 0.0)}  # of 0.4 mm
# all are seen by V3
DEFECTS = (
    *(Defect("shifted", id, shift) for id, shift in {**SHIFTED, **TOLERATED}.items()),
    *(Defect("rotated", id, rotation=turn) for id, turn in ROTATED.items()),
    *(Defect("missing", id) for id in MISSING),
    Defect("foreign_object", "WASHER", WASHER_AT, part=WASHER),
)


@dataclass(frozen=True)
class Look:
    """A picture, and the board in the camera as it really was."""

    grey: Image
    camera: Camera
    T_base_camera: SE3
    T_camera_board: SE3


class Scene:
    """The cell's hand camera at the taught views."""

    def __init__(self, world: World) -> None:
        self.world = world
        nominal = world.nominal
        T_camera_flange = nominal.T_flange_camera.inverse()
        self._q = {
            view.id: nominal.arm.ik(
                nominal.T_base_board * view.T_target_camera * T_camera_flange,
                nominal.q_home, view.id,
            )
            for view in nominal.inspection_views
        }  # fmt: skip

    def look(
        self, view: str, population: Population | None = None, aside: ArrayLike = 0.0,
        light: float = 1.0, T_base_board: SE3 | None = None,
    ) -> Look:  # fmt: skip
        """From a taught view, joints turned `aside` (rad); `light` is a factor of the lamps."""
        world, lamps, lying = self.world, self.world.light, self.world.T_base_board
        world.populate(population)
        world.arrive(self._q[view] + np.asarray(aside))
        if light != 1:
            world.change_light(replace(lamps, level=light * lamps.level))
        world.place_board(T_base_board or lying)
        observation = SimCell(world).capture()
        if light != 1:
            world.change_light(lamps)
        world.place_board(lying)
        truth = world.truth_of(observation)
        return Look(observation.grey, truth.camera, truth.T_base_camera, truth.T_camera_board)

    def error_px(self, registration: FineRegistration, old: Look, new: Look) -> Array:
        """How far (N,) the registration carries the tops of the parts in view off their place."""
        T = registration.T_camera_board * registration.T_camera_reference.inverse()
        tops = component_points(self.world.nominal.board, old.camera, old.T_camera_board)
        carried = registration.camera.project(tops, T * old.T_camera_board)
        return np.linalg.norm(carried - new.camera.project(tops, new.T_camera_board), axis=1)


def called(inspection: ViewInspection) -> list[str]:
    """The components with which something is said to be wrong."""
    return [id for id, finding in inspection.findings.items() if finding.is_defect]


def is_finite(inspection: ViewInspection) -> bool:
    """Whether each number that was found is one, and each confidence a probability."""
    findings = inspection.findings.values()
    numbers = [v for f in findings for v in (*f.shift, f.rotation, f.visible)]
    numbers += [v for f in inspection.foreign for v in (*f.place, f.size)]
    sure = [f.confidence for f in (*findings, *inspection.foreign)]
    return bool(np.isfinite(numbers).all() and all(0 <= share <= 1 for share in sure))


def gives_no_verdict(inspection: ViewInspection) -> bool:
    """Whether nothing is judged, with a reason, in a view that should show components."""
    return bool(
        inspection.registration.state == "no_verdict"
        and inspection.registration.reason
        and inspection.findings
        and all(f.state == "no_verdict" and f.reason for f in inspection.findings.values())
        and not inspection.foreign
    )
