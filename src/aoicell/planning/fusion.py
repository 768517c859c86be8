"""Depth images fused into one surface, by Open3D.

Each image moves a truncated signed distance to the surface, kept on a sparse grid, towards what it
saw (Curless and Levoy, "A volumetric method for building complex models from range images",
SIGGRAPH 1996): noise that differs from picture to picture averages out. The surface is the zero
crossing. Open3D is the optional extra `scan`.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aoicell.errors import InputError, Refused
from aoicell.observation import RobotState
from aoicell.planning.depth import DepthImage
from aoicell.planning.heights import HeightField
from aoicell.planning.scan import ScanArea
from aoicell.transforms import SE3, Array, apply

Faces = NDArray[np.int64]

_ABOVE = 1.0  # from where it is looked down (m): higher than anything


@dataclass(frozen=True)
class FusionConfig:
    """`voxel` (m) of the grid; surfaces nearer than `truncation` voxels to each other disturb one
    another; `least_sights`: in how many pictures what is kept was seen; `margin` (m) around the
    area within which measurements are kept.
    """

    voxel: float = 0.0005
    truncation: float = 4.0
    least_sights: float = 2.0
    margin: float = 0.02

    def __post_init__(self) -> None:
        if not 1e-4 <= self.voxel <= 0.01:
            raise InputError(f"voxel: {self.voxel * 1e3:g} mm is not from 0.1 to 10 mm")


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles (M, 3) over vertices (N, 3) in m, outward normals by the right-hand rule."""

    vertices: Array
    faces: Faces

    def moved(self, T: SE3) -> "Surface":
        """The same in the parent frame of T."""
        return Surface(apply(T, self.vertices), self.faces)


def fuse(
    images: Iterable[DepthImage],
    T_base_camera: Callable[[RobotState], SE3],
    area: ScanArea,
    config: FusionConfig | None = None,
) -> Surface:
    """The surface (frame `area`) of what images show, taken where the controller believes.

    `T_base_camera` gives the camera's pose for a state of the robot, by whichever calibration.
    Raises Refused when nothing was seen, InputError when Open3D is not installed.
    """
    config = config or FusionConfig()
    o3d = open3d()
    grid = o3d.t.geometry.VoxelBlockGrid(
        ("tsdf", "weight"), (o3d.core.float32, o3d.core.float32), ((1), (1)),
        config.voxel, 16, 20_000, o3d.core.Device("CPU:0"),
    )  # fmt: skip
    for image in images:
        T_area_camera = area.T_base_area.actInv(T_base_camera(image.state))
        depth = np.where(_inside(image, T_area_camera, area, config.margin), image.depth, 0)
        if not depth.any():
            continue
        picture = o3d.t.geometry.Image(o3d.core.Tensor(np.ascontiguousarray(depth, np.float32)))
        K = o3d.core.Tensor(image.camera.K)
        T = o3d.core.Tensor(T_area_camera.inverse().homogeneous)
        farthest = float(depth.max()) + config.margin
        blocks = grid.compute_unique_block_coordinates(
            picture, K, T, 1.0, farthest, config.truncation
        )
        grid.integrate(blocks, picture, K, T, 1.0, farthest, config.truncation)
    nothing = Refused("fusion: no surface inside the scan area is in enough depth images")
    if not grid.hashmap().size():
        raise nothing
    mesh = grid.extract_triangle_mesh(config.least_sights)
    if "positions" not in mesh.vertex or not len(mesh.vertex.positions):
        raise nothing
    vertices = mesh.vertex.positions.numpy().astype(float)
    return Surface(vertices, mesh.triangle.indices.numpy().astype(np.int64))


class FromAbove:
    """Looks down on a surface along the z axis of any frame."""

    def __init__(self, surface: Surface) -> None:
        self._core = open3d().core
        self._scene = open3d().t.geometry.RaycastingScene()
        self._scene.add_triangles(
            self._core.Tensor(surface.vertices.astype(np.float32)),
            self._core.Tensor(surface.faces.astype(np.uint32)),
        )

    def heights(
        self, size: tuple[float, float], cell: float, T_surface_frame: SE3 | None = None
    ) -> HeightField:
        """The highest point over each place of a raster about the origin of a frame.

        `size` and `cell` (m) along its x and y; NaN where there is nothing.
        """
        columns, rows = (int(np.ceil(side / cell)) for side in size)
        origin = (-(columns - 1) / 2 * cell, -(rows - 1) / 2 * cell)
        x, y = origin[0] + cell * np.arange(columns), origin[1] + cell * np.arange(rows)
        starts = np.dstack([*np.meshgrid(x, y), np.full((rows, columns), _ABOVE)])
        T = T_surface_frame or SE3.Identity()
        rays = np.empty((rows, columns, 6), np.float32)
        rays[..., :3], rays[..., 3:] = apply(T, starts), -T.rotation[:, 2]
        reach = self._scene.cast_rays(self._core.Tensor(rays))["t_hit"].numpy().astype(float)
        return HeightField(np.where(np.isfinite(reach), _ABOVE - reach, np.nan), origin, cell)


def simplified(surface: Surface, triangle: float) -> Surface:
    """The surface with one vertex in each cube of side `triangle` (m), the mean of those there."""
    o3d = open3d()
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(surface.vertices),
        o3d.utility.Vector3iVector(surface.faces.astype(np.int32)),
    ).simplify_vertex_clustering(triangle)
    return Surface(np.array(mesh.vertices), np.array(mesh.triangles, dtype=np.int64))


def open3d() -> Any:
    """The library. Raises InputError that says how to install it."""
    try:
        import open3d
    except ImportError:
        raise InputError(
            "fusing depth images needs Open3D, which is not installed: pip install 'aoicell[scan]'"
        ) from None
    return open3d


def _inside(
    image: DepthImage, T_area_camera: SE3, area: ScanArea, margin: float
) -> NDArray[np.bool_]:
    """Which pixels (H, W) show something inside the area's box."""
    R, t = (
        values.astype(np.float32) for values in (T_area_camera.rotation, T_area_camera.translation)
    )
    x, y, z = np.moveaxis(image.points().astype(np.float32) @ R.T + t, 2, 0)
    inside: NDArray[np.bool_] = (  # comparisons with NaN are false
        (np.abs(x) <= area.width / 2 + margin)
        & (np.abs(y) <= area.depth / 2 + margin)
        & (np.abs(z - area.height / 2) <= area.height / 2 + margin)
    )
    return inside
