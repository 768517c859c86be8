"""What touches what: in a posture, and along the way from one to another."""

from collections.abc import Sequence

import mujoco

from aoicell.transforms import Array

Pair = tuple[str, str]


def touching(model: mujoco.MjModel, data: mujoco.MjData, tolerance: float = 0.0) -> list[Pair]:
    """Pairs of bodies that overlap by more than `tolerance` (m); `data` holds their poses."""
    mujoco.mj_collision(model, data)
    pairs = set()
    for contact in data.contact[: data.ncon]:
        if contact.dist < -tolerance:
            bodies = (model.geom_bodyid[g] for g in contact.geom)
            first, second = sorted(model.body(b).name for b in bodies)
            pairs.add((first, second))
    return sorted(pairs)


def first_contact(
    model: mujoco.MjModel, data: mujoco.MjData, joints: Sequence[int], qs: Array
) -> tuple[int, Pair] | None:
    """Index of the first of the postures qs (N, dof; rad) in which bodies touch, and which.

    `joints` are the places of the arm's joints in qpos. Overwrites `data`.
    """
    for index, q in enumerate(qs):
        data.qpos[joints] = q
        mujoco.mj_kinematics(model, data)
        pairs = touching(model, data)
        if pairs:
            return index, pairs[0]
    return None
