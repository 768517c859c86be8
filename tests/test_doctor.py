"""The self-tests hold here, and notice when they should not."""

import numpy as np
import pytest
from helpers.running import Run

from aoicell import doctor
from aoicell.camera import Camera
from aoicell.doctor import Check, diagnose
from aoicell.errors import RenderingUnavailable
from aoicell.nominal import Nominal
from aoicell.sim.scene import ARM
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, translation

pytest_plugins = ["helpers.sessions"]

NAMES = [
    "OpenGL",
    "forward kinematics",
    "known points, no lens errors",
    "camera frame and pixel convention",
    "known points, distorted lens",
]


def diagnosis(nominal: Nominal) -> dict[str, Check]:
    """The checks by name."""
    return {check.name: check for check in diagnose(nominal)}


@pytest.fixture(scope="module")
def checks(doctor_run: Run) -> list[Check]:
    """As the command line prints them."""
    return [Check(**check) for check in doctor_run.summary["checks"]]


@pytest.fixture
def sure_of_the_kinematics(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take their time, and are not the matter."""
    monkeypatch.setattr(doctor, "_kinematics", lambda *_: (True, ""))


def test_every_check_holds_here(checks: list[Check]) -> None:
    assert [check.name for check in checks] == NAMES
    assert [check.name for check in checks if not check.passed] == []


def test_each_says_what_it_measured(checks: list[Check]) -> None:
    details = {check.name: check.detail for check in checks}
    assert "through " in details["OpenGL"]
    assert "over 1000 joint vectors (limit 1e-9)" in details["forward kinematics"]
    for name in (NAMES[2], NAMES[4]):
        assert details[name].startswith("16 cross centres lie 0.0")
        assert details[name].endswith("px rms from their projection (limit 0.05)")
    assert "x right, y down, z forward" in details[NAMES[3]]


@pytest.mark.usefixtures("sure_of_the_kinematics")
def test_half_a_pixel_fails(nominal: Nominal, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other pixel convention: the corner of the first pixel is (0, 0)."""
    project = Camera.project

    def shifted(self: Camera, points: Array, T_camera_frame: SE3 | None = None) -> Array:
        return project(self, points, T_camera_frame) + 0.5

    monkeypatch.setattr(Camera, "project", shifted)
    checks = diagnosis(nominal)
    for name in NAMES[2:]:
        assert not checks[name].passed, name
    assert "mean shift (-0.5" in checks[NAMES[3]].detail


def test_a_principal_point_that_is_not_centred_fails(
    nominal: Nominal, ideal_world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    errors, camera = np.zeros((16, 2)), nominal.cameras["hand"]
    K = camera.K + np.array([[0, 0, 0.5], [0, 0, 0], [0, 0, 0]])
    shifted = Camera(K, camera.width, camera.height)
    monkeypatch.setattr(doctor, "_overview_errors", lambda *_: (errors, shifted))
    passed, _ = doctor._conventions(nominal, ideal_world)
    assert not passed
    monkeypatch.setattr(doctor, "_overview_errors", lambda *_: (errors, camera))
    passed, _ = doctor._conventions(nominal, ideal_world)
    assert passed


def test_kinematics_that_differ_by_a_micrometre_fail(
    nominal: Nominal, ideal_world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = World.T_base_body

    def off(self: World, name: str) -> SE3:
        T = body(self, name)
        return T * translation(1e-6) if name == ARM + "flange" else T

    monkeypatch.setattr(World, "T_base_body", off)
    passed, detail = doctor._kinematics(nominal, ideal_world, draws=10)
    assert not passed
    assert "within 1.0e-06 m" in detail


def test_a_marker_that_is_not_found_fails(
    nominal: Nominal, ideal_world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "identify", lambda *_: {})
    for check in (doctor._known_points, doctor._conventions):
        passed, _ = check(nominal, ideal_world)
        assert not passed


@pytest.mark.usefixtures("sure_of_the_kinematics")
def test_without_opengl_the_other_checks_still_speak(
    nominal: Nominal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unavailable(*_: object, **__: object) -> None:
        raise RenderingUnavailable("no OpenGL to render with")

    monkeypatch.setattr("aoicell.sim.world.make_renderer", unavailable)
    monkeypatch.setattr(doctor, "opengl_description", unavailable)
    checks = diagnosis(nominal)
    assert list(checks) == NAMES
    assert [name for name in NAMES if checks[name].passed] == ["forward kinematics"]
    assert checks["OpenGL"].detail == "no OpenGL to render with"
