"""The simulated cell: the only part that knows the truth, and the only importer of mujoco."""

import ctypes.util
import os

# Headless by default: EGL if it is there, else OSMesa. MuJoCo reads MUJOCO_GL when it is imported,
# and dies on a value or library that is not there; disabled, the first renderer complains, clearly.
_LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
WANTED = os.environ.get("MUJOCO_GL", "").lower().strip()
_there = [name for name, library in _LIBRARIES.items() if ctypes.util.find_library(library)]
if WANTED != "glfw":  # that one needs a display, and is the caller's own choice
    _usable = [name for name in _there if WANTED in ("", name)]
    os.environ["MUJOCO_GL"] = _usable[0] if _usable else "disable"
