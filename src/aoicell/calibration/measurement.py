"""Residuals of all sights and their derivatives by every parameter.

With E = T_base_camera and F = T_base_fixture a point p of the fixture, bent and scaled by s, lies
at x = E^-1 F (s p) in the camera. A twist of the camera in its own axes moves x by -(v + w x x);
a twist of the fixture is one of the camera the other way, carried over by the adjoint of
E^-1 F; a twist of the flange is one of whatever it carries, carried over by the adjoint of the
mount. So each sight needs its derivative by the camera's twist only, and 6 x 6 products.
"""

from dataclasses import dataclass

import cv2
import numpy as np
import pinocchio as pin

from aoicell.calibration.parameters import LENSES, Estimate, Layout
from aoicell.calibration.print_form import form_basis
from aoicell.calibration.problem import CalibrationView, Indices, PoseSight, Problem, Sight
from aoicell.camera import Camera
from aoicell.robot import Arm
from aoicell.transforms import SE3, Array, apply

# What counts as one unit where an eye reports poses: about what such eyes are good for.
POSE_UNIT = np.array([1e-3] * 3 + [2e-3] * 3)  # m, rad


@dataclass(frozen=True)
class Linearisation:
    """Residuals (measured minus predicted) and derivatives of the prediction, row by row.

    `residuals` (R,) in px, or in POSE_UNIT for poses; `J` (R, P) by the step of the layout;
    `J_view` (R, 6) by the deviation of the row's view. `rows[v]` is the slice of a view,
    `groups` (R,) numbers the point, or the pose, that a row belongs to, and `sights` (R,) its
    sight, counted over all views. `in_front`: all points lie in front of their camera.
    """

    residuals: Array
    J: Array
    J_view: Array
    rows: tuple[slice, ...]
    groups: Indices
    sights: Indices
    in_front: bool


@dataclass(frozen=True)
class Chain:
    """One sight's transforms, and how twists of flange and joints reach its camera and fixture."""

    T_camera_fixture: SE3
    eye_by_flange: Array | None
    fixture_by_flange: Array | None


def corrected_arm(problem: Problem, estimate: Estimate) -> Arm | None:
    """The arm with the estimated joint terms; None where the controller's poses are taken."""
    if problem.arm is None or not len(estimate.joint_offsets):
        return None
    return problem.arm.corrected(estimate.joint_offsets, estimate.joint_origins)


def flange_pose(view: CalibrationView, arm: Arm | None) -> SE3:
    """T_base_flange of a view without its deviation."""
    if arm is None or view.q is None:
        return view.T_base_flange
    return arm.fk(view.q)


def chain(problem: Problem, estimate: Estimate, eye: str, fixture: str, A: SE3) -> Chain:
    """From the flange pose A to what the eye sees of the fixture."""
    X, Y = estimate.T_mount_eye[eye], estimate.T_mount_fixture[fixture]
    on_flange = problem.eye(eye).mount == "flange"
    target_on_flange = problem.fixture(fixture).mount == "flange"
    E = A * X if on_flange else X
    F = A * Y if target_on_flange else Y
    return Chain(
        E.actInv(F),
        X.toActionMatrixInverse() if on_flange else None,
        Y.toActionMatrixInverse() if target_on_flange else None,
    )


def linearise(
    problem: Problem, layout: Layout, estimate: Estimate, derivatives: bool = True
) -> Linearisation:
    """All rows of a problem at an estimate; J and J_view stay empty without `derivatives`."""
    arm = corrected_arm(problem, estimate)
    parts: list[_Part] = []
    rows, start = [], 0
    for v, view in enumerate(problem.views):
        d = estimate.deviations[v]
        A = flange_pose(view, arm)
        deviates = bool(d.any())
        moved = A * pin.exp6(d) if deviates else A
        by_deviation = pin.Jexp6(d) if deviates and derivatives else np.eye(6)
        twists = None
        if arm is not None and derivatives and view.q is not None:
            J = np.hstack([arm.jacobian(view.q), arm.origin_jacobian(view.q)])
            twists = pin.exp6(d).toActionMatrixInverse() @ J if deviates else J
        first = start
        for sight in view.sights:
            link = chain(problem, estimate, sight.eye, sight.fixture, moved)
            part = _Part(sight, link, slice(start, start + _height(sight)), by_deviation, twists)
            parts.append(part)
            start = part.rows.stop
        rows.append(slice(first, start))
    return _fill(problem, layout, estimate, parts, tuple(rows), derivatives)


@dataclass(frozen=True)
class _Part:
    """A sight with its rows and the twists of its view."""

    sight: Sight | PoseSight
    link: Chain
    rows: slice
    by_deviation: Array
    joint_twists: Array | None


def _height(sight: Sight | PoseSight) -> int:
    return 6 if isinstance(sight, PoseSight) else 2 * len(sight.ids)


def _fill(
    problem: Problem, layout: Layout, estimate: Estimate, parts: list[_Part],
    rows: tuple[slice, ...], derivatives: bool,
) -> Linearisation:  # fmt: skip
    count = parts[-1].rows.stop if parts else 0
    width = layout.size if derivatives else 0
    r, J = np.zeros(count), np.zeros((count, width))
    J_view = np.zeros((count, 6 if derivatives else 0))
    by_camera = np.zeros((count, 6 if derivatives else 0))
    by_scale = np.zeros(count if derivatives else 0)
    in_front = True
    for eye in problem.eyes:
        mine = [p for p in parts if p.sight.eye == eye.name]
        if not mine:
            continue
        if eye.camera is None:
            for part in mine:
                _pose_rows(part, estimate, r, by_camera, by_scale, derivatives)
            continue
        seen = _pixel_rows(problem, layout, estimate, mine, r, J, by_camera, by_scale, derivatives)
        in_front = in_front and seen
    if derivatives:
        for part in parts:
            _chain_rows(layout, part, J, J_view, by_camera, by_scale)
    groups = _numbered([(p.rows, 6 if isinstance(p.sight, PoseSight) else 2) for p in parts])
    sights = _numbered([(p.rows, p.rows.stop - p.rows.start) for p in parts])
    return Linearisation(r, J, J_view, rows, groups, sights, in_front)


def _numbered(parts: list[tuple[slice, int]]) -> Indices:
    """Running numbers of groups of `size` rows."""
    numbers, start = [], 0
    for rows, size in parts:
        count = (rows.stop - rows.start) // size
        numbers.append(np.repeat(np.arange(start, start + count), size))
        start += count
    return np.concatenate(numbers) if numbers else np.zeros(0, dtype=int)


def _chain_rows(
    layout: Layout, part: _Part, J: Array, J_view: Array, by_camera: Array, by_scale: Array
) -> None:
    """From the derivative by the camera's twist to those by eye, fixture, flange and joints."""
    rows, link, blocks = part.rows, part.link, layout.blocks
    eye, fixture = part.sight.eye, part.sight.fixture
    g_eye = by_camera[rows]
    g_fixture = -g_eye @ link.T_camera_fixture.toActionMatrix()
    J[rows, blocks["eye", eye]] = g_eye
    if ("fixture", fixture) in blocks:  # a work point given in the base is nobody's parameter
        J[rows, blocks["fixture", fixture]] = g_fixture
    if ("scale", fixture) in blocks:
        J[rows, blocks["scale", fixture]] = by_scale[rows, None]
    g_flange = np.zeros_like(g_eye)
    if link.eye_by_flange is not None:
        g_flange = g_flange + g_eye @ link.eye_by_flange
    if link.fixture_by_flange is not None:
        g_flange = g_flange + g_fixture @ link.fixture_by_flange
    J_view[rows] = g_flange @ part.by_deviation
    if part.joint_twists is not None and ("joints", "arm") in blocks:
        J[rows, blocks["joints", "arm"]] = g_flange @ part.joint_twists


def _pixel_rows(
    problem: Problem, layout: Layout, estimate: Estimate, parts: list[_Part],
    r: Array, J: Array, by_camera: Array, by_scale: Array, derivatives: bool,
) -> bool:  # fmt: skip
    """One eye's pixels; whether all points are in front of it."""
    eye = parts[0].sight.eye
    camera = estimate.cameras[eye]
    points, uvs, where, lever = [], [], [], []
    names = {part.sight.fixture for part in parts}
    shown = {name: shaped_points(problem, estimate, name) for name in names}
    for part in parts:
        assert isinstance(part.sight, Sight)
        fixture = part.sight.fixture
        scale, T = estimate.scales[fixture], part.link.T_camera_fixture
        ps = apply(T, scale * shown[fixture][part.sight.ids])
        points.append(ps)
        lever.append((ps - T.translation) / scale)
        uvs.append(part.sight.uv_px)
        where.append(np.arange(part.rows.start, part.rows.stop))
    x, at = np.vstack(points), np.concatenate(where)
    if (x[:, 2] <= 0).any():
        r[at] = np.inf
        return False
    uv, by_point, by_intrinsics = project_with_derivatives(camera, x)
    r[at] = (np.vstack(uvs) - uv).ravel()
    if derivatives:
        # x moves by -(v + w x x): a row g of the derivative turns w into -(x x g) . w
        by_camera[at, :3] = -by_point.reshape(-1, 3)
        by_camera[at, 3:] = cross(by_point, x[:, None, :]).reshape(-1, 3)
        by_scale[at] = (by_point @ np.vstack(lever)[:, :, None]).ravel()
        if ("intrinsics", eye) in layout.blocks:
            free = [*range(4), *(4 + k for k in LENSES[layout.model.lens])]
            J[at, layout.blocks["intrinsics", eye]] = by_intrinsics[:, free]
        _form_rows(problem, layout, estimate, parts, J, by_point)
    return True


def shaped_points(problem: Problem, estimate: Estimate, fixture: str) -> Array:
    """Points (M, 3) of a fixture as its print turned out, its size left aside."""
    points, form = problem.fixture(fixture).points, estimate.form(fixture)
    return points + form_basis(points) @ form if form.any() else points


def _form_rows(
    problem: Problem, layout: Layout, estimate: Estimate, parts: list[_Part], J: Array,
    by_point: Array,
) -> None:  # fmt: skip
    """Derivatives by the forms of the prints, from those by the point (N, 2, 3) in the camera."""
    bases = {
        name: estimate.scales[name] * form_basis(problem.fixture(name).points)
        for name in {part.sight.fixture for part in parts}
        if ("form", name) in layout.blocks
    }
    first = 0
    for part in parts:
        assert isinstance(part.sight, Sight)
        count, name = len(part.sight.ids), part.sight.fixture
        if name in bases:
            turned = by_point[first : first + count] @ part.link.T_camera_fixture.rotation
            moved = turned @ bases[name][part.sight.ids]
            J[part.rows, layout.blocks["form", name]] = moved.reshape(2 * count, -1)
        first += count


def cross(a: Array, b: Array) -> Array:
    """Cross products along the last axis; numpy's own takes several times as long."""
    x, y, z = (a[..., i] for i in range(3))
    u, v, w = (b[..., i] for i in range(3))
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def project_with_derivatives(camera: Camera, points: Array) -> tuple[Array, Array, Array]:
    """Pixels (N, 2) of points (N, 3) in the camera frame and their derivatives.

    By the point (N, 2, 3), and by fx, fy, cx, cy, k1, k2, p1, p2, k3 (2N, 9).
    """
    zero = np.zeros(3)
    projected, derivative = cv2.projectPoints(
        points[:, None], zero, zero, camera.K, camera.distortion[:5]
    )
    uv, D = np.array(projected, dtype=float)[:, 0], np.array(derivative, dtype=float)
    slant = camera.K[0, 1] / camera.K[1, 1]
    if slant:  # OpenCV takes no notice of skew; v - cy does not depend on the intrinsics but fy
        uv[:, 0] += slant * (uv[:, 1] - camera.K[1, 2])
        moves = np.r_[3:6, 10 : D.shape[1]]
        D[0::2, moves] += slant * D[1::2, moves]
    return uv, D[:, 3:6].reshape(-1, 2, 3), D[:, 6:15]


def _pose_rows(
    part: _Part, estimate: Estimate, r: Array, by_camera: Array, by_scale: Array, derivatives: bool
) -> None:
    """A pose that an eye reports: log of (measured^-1 predicted), in POSE_UNIT."""
    assert isinstance(part.sight, PoseSight)
    B = part.sight.T_camera_fixture
    scaled = SE3(B.rotation, estimate.scales[part.sight.fixture] * B.translation)
    T = part.link.T_camera_fixture
    gap = scaled.actInv(T)
    r[part.rows] = -pin.log6(gap).vector / POSE_UNIT
    if derivatives:
        D = pin.Jlog6(gap) / POSE_UNIT[:, None]
        by_camera[part.rows] = -D @ T.toActionMatrixInverse()
        shift = -gap.rotation.T @ B.rotation.T @ B.translation
        by_scale[part.rows] = D[:, :3] @ shift
