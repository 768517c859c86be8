"""What a calibration estimates, in one value, and how a small step changes it.

Poses are stepped by T * exp(twist), a twist (translation, rotation) in the pose's own axes, so
that no rotation is special: a camera that looks straight down is a half turn and as good as any.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

import numpy as np
import pinocchio as pin

from aoicell.calibration.print_form import FORM, form_prior, has_form
from aoicell.calibration.problem import Problem
from aoicell.camera import Camera
from aoicell.transforms import SE3, Array

Lens = Literal["none", "k1k2", "k1k2p1p2", "k1k2p1p2k3"]
RobotModel = Literal["exact", "per_view", "joint_terms"]

# Which of OpenCV's (k1, k2, p1, p2, k3) a lens model frees; the others are zero.
LENSES: Mapping[Lens, tuple[int, ...]] = MappingProxyType(
    {"none": (), "k1k2": (0, 1), "k1k2p1p2": (0, 1, 2, 3), "k1k2p1p2k3": (0, 1, 2, 3, 4)}
)
_INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
# What is assumed of a lens, one standard deviation each: the principal point within 2 % of the
# picture's width of the start (a sensor is glued and a lens screwed on to 0.1 to 0.2 mm), lens
# elements centred to some 10 um, which makes p1 and p2 a few 1e-4, and a k3 below k1.
_CENTRE, _TANGENTIAL, _K3 = 0.02, 1e-3, 0.3
_ORIGIN = ("origin x", "origin y", "origin z", "axis tilt 1", "axis tilt 2")
_TWIST = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True)
class Model:
    """Which of the possible explanations is estimated.

    `robot`: the controller's poses are exact; or each view deviates a little on its own (the
    repeatability, and whatever else differs from pose to pose); or, beside that, the joint
    offsets, origins and axes differ from the design. `free_scales` names the fixtures of whose
    size nothing is believed; that of the others is held by what a printer is good for.
    """

    lens: Lens = "k1k2p1p2"
    robot: RobotModel = "per_view"
    free_scales: tuple[str, ...] = ()


@dataclass(frozen=True)
class ArmPrior:
    """What is assumed of an arm that nobody calibrated, one standard deviation each.

    The deviations of a view are where the search for their size starts.
    """

    joint_deg: float = 0.05
    origin_mm: float = 0.3
    axis_deg: float = 0.05
    deviation_mm: float = 0.05
    deviation_deg: float = 0.005


DEFAULT_PRIOR = ArmPrior()


_AS_DRAWN = np.zeros(len(FORM))


@dataclass(frozen=True)
class Estimate:
    """Values of all parameters.

    `T_mount_eye`, `T_mount_fixture`: poses on what carries them, base or flange. `joint_offsets`
    (dof,) in rad and `joint_origins` (dof, 5) in m and rad are those of `Arm.corrected`.
    `deviations` (views, 6): the flange stood at T_base_flange * exp(deviation). `forms` (4,) by
    fixture are those of `print_form`; one that is not there is as drawn.
    """

    T_mount_eye: Mapping[str, SE3]
    T_mount_fixture: Mapping[str, SE3]
    cameras: Mapping[str, Camera]
    scales: Mapping[str, float]
    deviations: Array
    joint_offsets: Array = field(default_factory=lambda: np.zeros(0))
    joint_origins: Array = field(default_factory=lambda: np.zeros((0, 5)))
    forms: Mapping[str, Array] = field(default_factory=dict)

    def form(self, fixture: str) -> Array:
        """The form (4,) of a fixture's print, zeros where it is as drawn."""
        return self.forms.get(fixture, _AS_DRAWN)


@dataclass(frozen=True)
class Layout:
    """Where each block of parameters stands in a step vector.

    `blocks` maps (kind, name) to a slice, kind being intrinsics, eye, fixture, scale, form or
    joints; `names` (P,) are for people; `prior` (P,) holds standard deviations, infinite without
    one, about `mean` (P,).
    """

    model: Model
    blocks: Mapping[tuple[str, str], slice]
    names: tuple[str, ...]
    prior: Array
    mean: Array

    @property
    def joints(self) -> slice:
        """Where the arm's terms stand; empty where they are not estimated."""
        return self.blocks.get(("joints", "arm"), slice(0, 0))

    @property
    def size(self) -> int:
        """Number of parameters, the deviations of the views left out."""
        return len(self.names)


def layout_of(problem: Problem, model: Model, prior: ArmPrior = DEFAULT_PRIOR) -> Layout:
    """The parameters of a problem under a model, in a settled order."""
    blocks: dict[tuple[str, str], slice] = {}
    names: list[str] = []
    sigmas: list[float] = []
    means: list[float] = []

    def add(
        kind: str, name: str, labels: list[str], sigma: Sequence[float] = (),
        mean: Sequence[float] = (),
    ) -> None:  # fmt: skip
        blocks[kind, name] = slice(len(names), len(names) + len(labels))
        names.extend(labels)
        sigmas.extend(sigma or [np.inf] * len(labels))
        means.extend(mean or [0.0] * len(labels))

    for eye in problem.eyes:
        if eye.camera is not None and eye.refine:
            free = [*range(4), *(4 + k for k in LENSES[model.lens])]
            sigma, mean = _lens_prior(eye.camera)
            labels = [f"{eye.name} {_INTRINSICS[i]}" for i in free]
            add("intrinsics", eye.name, labels, [sigma[i] for i in free], [mean[i] for i in free])
        add("eye", eye.name, [f"T_{eye.mount}_{eye.name} {c}" for c in _TWIST])
    for fixture in problem.fixtures:
        name, free_size = fixture.name, fixture.name in model.free_scales
        add("fixture", name, [f"T_{fixture.mount}_{name} {c}" for c in _TWIST])
        if free_size or not problem.of_poses:
            add(
                "scale", name, [f"{name} scale"], [np.inf if free_size else fixture.size_std], [1.0]
            )
        if not problem.of_poses and has_form(fixture.points):
            labels = [f"{name} {what}" for what in FORM]
            held = form_prior(fixture.points, fixture.size_std, fixture.flatness_std)
            add("form", name, labels, held.tolist())
    if model.robot == "joint_terms" and problem.arm is not None:
        joints = problem.arm.joint_names
        labels = [f"{j} offset" for j in joints]
        labels += [f"{j} {what}" for j in joints for what in _ORIGIN]
        dof = len(joints)
        origin = [prior.origin_mm / 1e3] * 3 + [float(np.radians(prior.axis_deg))] * 2
        sigma = [float(np.radians(prior.joint_deg))] * dof + origin * dof
        add("joints", "arm", labels, sigma)
    return Layout(model, MappingProxyType(blocks), tuple(names), np.array(sigmas), np.array(means))


def _lens_prior(start: Camera) -> tuple[list[float], list[float]]:
    """Standard deviations and means of fx, fy, cx, cy, k1, k2, p1, p2, k3."""
    centre = _CENTRE * start.width
    sigma = [np.inf, np.inf, centre, centre, np.inf, np.inf, _TANGENTIAL, _TANGENTIAL, _K3]
    return sigma, [0, 0, float(start.K[0, 2]), float(start.K[1, 2]), 0, 0, 0, 0, 0]


def offset_from_prior(layout: Layout, estimate: Estimate) -> Array:
    """How far each parameter that has a prior stands from its mean, (P,); 0 for the others."""
    x = np.array(layout.mean)
    for (kind, name), where in layout.blocks.items():
        if kind == "intrinsics":
            camera = estimate.cameras[name]
            free = list(LENSES[layout.model.lens])
            x[where] = [*camera.K[[0, 1, 0, 1], [0, 1, 2, 2]], *camera.distortion[free]]
        elif kind == "scale":
            x[where] = estimate.scales[name]
        elif kind == "form":
            x[where] = estimate.form(name)
        elif kind == "joints":
            x[where] = np.concatenate([estimate.joint_offsets, estimate.joint_origins.ravel()])
    return np.where(np.isfinite(layout.prior), x - layout.mean, 0.0)


def retract(layout: Layout, estimate: Estimate, step: Array, deviations: Array) -> Estimate:
    """The estimate after a step (P,), with new deviations (views, 6)."""
    eyes, fixtures = dict(estimate.T_mount_eye), dict(estimate.T_mount_fixture)
    cameras, scales, forms = dict(estimate.cameras), dict(estimate.scales), dict(estimate.forms)
    offsets, shifts = estimate.joint_offsets, estimate.joint_origins
    for (kind, name), where in layout.blocks.items():
        delta = step[where]
        if kind == "eye":
            eyes[name] = eyes[name] * pin.exp6(delta)
        elif kind == "fixture":
            fixtures[name] = fixtures[name] * pin.exp6(delta)
        elif kind == "scale":
            scales[name] = scales[name] + float(delta[0])
        elif kind == "form":
            forms[name] = estimate.form(name) + delta
        elif kind == "intrinsics":
            cameras[name] = _stepped(cameras[name], layout.model.lens, delta)
        else:
            offsets, moved = offsets + delta[: len(offsets)], delta[len(offsets) :]
            shifts = shifts + moved.reshape(-1, 5)
    return replace(
        estimate,
        T_mount_eye=eyes,
        T_mount_fixture=fixtures,
        cameras=cameras,
        scales=scales,
        deviations=deviations,
        joint_offsets=offsets,
        joint_origins=shifts,
        forms=forms,
    )


def conform(problem: Problem, model: Model, estimate: Estimate) -> Estimate:
    """The estimate with everything at rest that the model does not free."""
    cameras = {}
    for name, camera in estimate.cameras.items():
        distortion = np.zeros(5)
        free = list(LENSES[model.lens])
        distortion[free] = camera.distortion[free]
        kept = not problem.eye(name).refine
        cameras[name] = camera if kept else replace(camera, distortion=distortion)
    scales = {n: s if n in model.free_scales else 1.0 for n, s in estimate.scales.items()}
    dof = problem.arm.dof if problem.arm is not None and model.robot == "joint_terms" else 0
    fresh = len(estimate.joint_offsets) != dof
    return replace(
        estimate,
        cameras=cameras,
        scales=scales,
        deviations=estimate.deviations * (model.robot != "exact"),
        joint_offsets=np.zeros(dof) if fresh else estimate.joint_offsets,
        joint_origins=np.zeros((dof, 5)) if fresh else estimate.joint_origins,
    )


def _stepped(camera: Camera, lens: Lens, delta: Array) -> Camera:
    K, distortion = np.array(camera.K), np.array(camera.distortion)
    K[[0, 1, 0, 1], [0, 1, 2, 2]] += delta[:4]
    distortion[list(LENSES[lens])] += delta[4:]
    return replace(camera, K=K, distortion=distortion)
