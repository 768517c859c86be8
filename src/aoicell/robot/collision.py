"""Does the arm, with what it carries, touch itself or what stands around it? Asked of the design.

The arm's hulls come from its URDF; whatever else is there is given as boxes and convex meshes.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from aoicell.errors import ModelError
from aoicell.robot.arm import Arm
from aoicell.transforms import SE3

Pair = tuple[str, str]


@dataclass(frozen=True)
class Solid:
    """A thing that must not be touched: its `shape` in its own frame, `T_mount_solid` on its mount.

    A shape is a box about the origin, by its sides (m), or a file of a convex mesh in metres,
    stretched by `scale` along its axes. `slack` (m) is how far off it may really stand: nothing
    may come nearer than that and the clearance.
    """

    name: str
    shape: tuple[float, float, float] | Path
    T_mount_solid: SE3
    mount: Literal["base", "flange"] = "base"
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    slack: float = 0.0


class CollisionModel:
    """The arm among solids. Neighbouring links do not count: they always touch.

    Bodies closer than `clearance` (m) touch. Raises ModelError when a mesh is missing, or when
    solids that cannot move against each other are all there is to check.
    """

    def __init__(self, arm: Arm, solids: Iterable[Solid] = (), clearance: float = 0.01) -> None:
        self._model = pin.buildModelFromUrdf(str(arm.urdf))
        self._data = self._model.createData()
        try:
            self._shapes = pin.buildGeomFromUrdf(
                self._model, str(arm.urdf), pin.COLLISION, package_dirs=[str(arm.urdf.parent)]
            )
        except (ValueError, RuntimeError) as error:
            reason = str(error).splitlines()[0]
            raise ModelError(f"{arm.urdf}: a collision mesh is missing ({reason})") from None
        for shape in self._shapes.geometryObjects:
            shape.geometry = _hull(shape.geometry)
        self._links = self._shapes.ngeoms
        slacks = [0.0] * self._links
        for solid in solids:
            self._add(solid)
            slacks.append(solid.slack)
        self._pair_up()
        self._asked = pin.GeometryData(self._shapes)
        pairs = self._shapes.collisionPairs
        for pair, request in zip(pairs, self._asked.collisionRequests, strict=True):
            request.security_margin = clearance + slacks[pair.first] + slacks[pair.second]

    def _add(self, solid: Solid) -> None:
        joint, placement = 0, solid.T_mount_solid
        if solid.mount == "flange":
            frame = self._model.frames[self._model.getFrameId("flange")]
            joint, placement = frame.parentJoint, frame.placement * solid.T_mount_solid
        shape = pin.GeometryObject(solid.name, joint, placement, _shape(solid))
        self._shapes.addGeometryObject(shape)

    def _pair_up(self) -> None:
        """All pairs that can move against each other, neighbouring links left out."""
        objects = self._shapes.geometryObjects
        for i, first in enumerate(objects):
            for j, second in enumerate(objects[:i]):
                a, b = first.parentJoint, second.parentJoint
                neighbours = i < self._links and (a == self._parent(b) or b == self._parent(a))
                if a != b and not neighbours:
                    self._shapes.addCollisionPair(pin.CollisionPair(j, i))
        if not len(self._shapes.collisionPairs):
            raise ModelError("collision: nothing can move against anything; give the arm hulls")

    def _parent(self, joint: int) -> int:
        return int(self._model.parents[joint]) if joint else -1

    def touching(self, q: ArrayLike) -> Pair | None:
        """Names of two bodies that touch at joint angles q (rad); None when none do."""
        q = np.asarray(q, dtype=float)
        if not pin.computeCollisions(self._model, self._data, self._shapes, self._asked, q, True):
            return None
        hit = next(i for i, r in enumerate(self._asked.collisionResults) if r.isCollision())
        pair = self._shapes.collisionPairs[hit]
        objects = self._shapes.geometryObjects
        return str(objects[pair.first].name), str(objects[pair.second].name)

    def first_touch(self, qs: Iterable[ArrayLike]) -> tuple[int, Pair] | None:
        """Index of the first of the postures qs (N, dof; rad) in which bodies touch, and which."""
        for index, q in enumerate(qs):
            pair = self.touching(q)
            if pair:
                return index, pair
        return None


def _shape(solid: Solid) -> coal.CollisionGeometry:
    if not isinstance(solid.shape, Path):
        return coal.Box(*solid.shape)
    if not solid.shape.is_file():
        raise ModelError(f"{solid.shape}: no such mesh; the solid '{solid.name}' needs it")
    mesh = coal.MeshLoader().load(str(solid.shape), np.array(solid.scale))
    return _hull(mesh)


def _hull(mesh: coal.BVHModelBase) -> coal.CollisionGeometry:
    """A mesh as the solid that it encloses: its convex hull, so that nothing fits inside."""
    mesh.buildConvexHull(True, "Qt")  # Qhull's option for triangles
    return mesh.convex
