"""The simulated cell: the only part that knows the truth, and the only importer of mujoco."""

import ctypes.util
import os

# Headless by default: EGL if it is there, else OSMesa. MuJoCo reads this when it is imported, and
# dies on a library that is missing; disabled, it is the first renderer that complains, clearly.
_LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
_wanted = os.environ.get("MUJOCO_GL", "").lower()
if _wanted in ("", *_LIBRARIES):
    _there = [name for name in _LIBRARIES if ctypes.util.find_library(_LIBRARIES[name])]
    _usable = [name for name in _there if _wanted in ("", name)]
    os.environ["MUJOCO_GL"] = _usable[0] if _usable else "disable"
