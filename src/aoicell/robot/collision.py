"""Does the arm, with what it carries, touch itself or what stands around it? Asked of the design.

The arm's hulls come from its URDF; whatever else is there is given as boxes and convex meshes.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from aoicell.errors import ModelError
from aoicell.robot.arm import Arm
from aoicell.transforms import SE3, Array

Pair = tuple[str, str]
Mount = Literal["base", "flange"]


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
    mount: Mount = "base"
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

    def between(
        self, q: ArrayLike, p_from: ArrayLike, p_to: ArrayLike, ignored: Collection[str] = ()
    ) -> str | None:
        """The name of a body that stands across the straight line between two points of the base
        (m), with the arm at joint angles q (rad); None when there is none but the `ignored`.
        """
        q, start, end = (np.asarray(values, dtype=float) for values in (q, p_from, p_to))
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._asked, q)
        length = float(np.linalg.norm(end - start))
        R = pin.Quaternion.FromTwoVectors(np.array([0, 0, 1.0]), end - start).matrix()
        line, T = coal.Capsule(1e-4, length), coal.Transform3s(R, (start + end) / 2)
        request = coal.CollisionRequest()
        for body, T_base_body in zip(self._shapes.geometryObjects, self._asked.oMg, strict=True):
            there = coal.Transform3s(T_base_body.rotation, T_base_body.translation)
            if body.name not in ignored and coal.collide(
                line, T, body.geometry, there, request, coal.CollisionResult()
            ):
                return str(body.name)
        return None

    def travel(self, way: ArrayLike) -> float:
        """How far (m) any point of the arm and its load may come, against any other body, while
        the joints turn by `way` (dof,; rad) along a straight line: an upper bound.
        """
        return float(np.abs(np.asarray(way, dtype=float)) @ self._outreach)

    @cached_property
    def _outreach(self) -> Array:
        """How far (dof,; m) from each joint's origin anything that it turns can ever be."""
        far = np.zeros(self._model.njoints)
        for body in self._shapes.geometryObjects:
            body.geometry.computeLocalAABB()
            middle = body.placement.act(body.geometry.aabb_center)
            reach = float(np.linalg.norm(middle)) + body.geometry.aabb_radius
            far[body.parentJoint] = max(far[body.parentJoint], reach)
        for joint in range(self._model.njoints - 1, 1, -1):
            parent = self._model.parents[joint]
            step = float(np.linalg.norm(self._model.jointPlacements[joint].translation))
            far[parent] = max(far[parent], step + far[joint])
        return np.array(far[1:])


def _shape(solid: Solid) -> coal.CollisionGeometry:
    if not isinstance(solid.shape, Path):
        return coal.Box(*solid.shape)
    if not solid.shape.is_file():
        raise ModelError(f"{solid.shape}: no such mesh; the solid '{solid.name}' needs it")
    mesh = coal.MeshLoader().load(str(solid.shape), np.array(solid.scale))
    return _hull(mesh)


def _hull(mesh: coal.CollisionGeometry) -> coal.CollisionGeometry:
    """A mesh as the solid that it encloses: its convex hull, so that nothing fits inside.

    Boxes, cylinders and spheres are solid as they are.
    """
    if not isinstance(mesh, coal.BVHModelBase):
        return mesh
    mesh.buildConvexHull(True, "Qt")  # Qhull's option for triangles
    return mesh.convex
