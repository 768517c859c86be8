"""Which OpenGL renders."""

import os
import warnings

import mujoco

from aoicell.errors import RenderingUnavailable
from aoicell.sim import WANTED


def make_renderer(
    model: mujoco.MjModel, width: int, height: int, shadows: bool = False
) -> mujoco.Renderer:
    """An offscreen renderer. Raises RenderingUnavailable when there is no OpenGL."""
    try:
        if os.environ.get("MUJOCO_GL") == "glfw" and not _display():
            raise OSError("glfw needs a display, and there is none")  # it would abort
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # glfw warns before it fails; one complaint is enough
            renderer = mujoco.Renderer(model, height, width)
    except Exception as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        if os.environ.get("MUJOCO_GL") == "disable":
            reason = f"{WANTED or 'egl or osmesa'} was asked for, and its library is not there"
        raise RenderingUnavailable(
            f"no OpenGL to render with ({reason}); MUJOCO_GL may be egl or osmesa: install Mesa's "
            "EGL with 'apt-get install libegl1 libgl1 libgl1-mesa-dri' or run 'make setup'"
        ) from error
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
    return renderer


def _display() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def opengl_description() -> str:
    """The OpenGL implementation and how it was reached, as in 'llvmpipe ... through egl'."""
    spec = mujoco.MjSpec()
    renderer = make_renderer(spec.compile(), 16, 16)
    try:
        from OpenGL import GL  # after the back end has chosen its platform

        name = GL.glGetString(GL.GL_RENDERER)
        text = name.decode() if isinstance(name, bytes) else str(name)
    finally:
        renderer.close()
    return f"{text} through {os.environ['MUJOCO_GL']}"
