"""The frames of a cell: where they truly are, and where the software believes them to be."""

from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from aoicell.nominal import Nominal
from aoicell.pipeline import Calibration
from aoicell.sim.scene import ARM
from aoicell.sim.world import World
from aoicell.targets.layout import Layout
from aoicell.transforms import SE3, Array
from aoicell.view.shown import Axes

SMALL = 0.03  # axes of a marker (m)


@dataclass(frozen=True)
class Belief:
    """What a method has estimated so far; None is not known yet.

    `layout` has the cross centres (4, 3) by marker id in the board's frame.
    """

    calibration: Calibration | None = None
    T_base_board: SE3 | None = None
    layout: Layout | None = None


def true_axes(world: World) -> list[Axes]:
    """Every frame of the cell, as built."""
    nominal = world.nominal
    axes = [
        Axes("base", nominal.T_world_base, length=0.2),
        Axes("flange", SE3.Identity(), f"{ARM}flange"),
    ]
    axes += [Axes("camera", SE3.Identity(), "hand")]
    axes += [Axes(n, SE3.Identity(), n) for n in ("tripod", "armtarget", "tabletarget", "board")]
    for id, T_board_marker in world.geometry.Ts_board_marker.items():
        axes.append(Axes(id, T_board_marker, "board", SMALL))
    return axes


def believed_axes(nominal: Nominal, belief: Belief, q: Array) -> list[Axes]:
    """The estimates at the commanded joint angles q (rad)."""
    T_world_base, calibration = nominal.T_world_base, belief.calibration

    def estimate(name: str, T_base_frame: SE3, length: float = 0.10) -> Axes:
        return Axes(name, T_world_base * T_base_frame, "world", length, estimate=True)

    arm = calibration.arm if calibration else nominal.arm
    T_base_flange = arm.fk(q)
    axes = [estimate("flange", T_base_flange)]
    if calibration:
        axes.append(estimate("camera", T_base_flange * calibration.hand_eye.T_flange_camera))
        axes.append(estimate("tabletarget", calibration.world.T_base_tabletarget))
    if belief.T_base_board:
        axes.append(estimate("board", belief.T_base_board))
        for id, crosses in (belief.layout or {}).items():
            T_board_marker = marker_pose(crosses, nominal.marker.crosses)
            axes.append(estimate(id, belief.T_base_board * T_board_marker, SMALL))
    return axes


def marker_pose(crosses: Array, design: Array) -> SE3:
    """T_board_marker by the centres (4, 3) of a marker's crosses on the board.

    `design` are the same in the marker's own frame. The fit is Kabsch's.
    """
    own, placed = design.mean(axis=0), crosses.mean(axis=0)
    turn, _ = Rotation.align_vectors(crosses - placed, design - own)
    R = turn.as_matrix()
    return SE3(R, placed - R @ own)
