"""The simulated cell: the only part that knows the truth, and the only importer of mujoco."""

import ctypes.util
import os

# Headless by default. EGL if it is there, else OSMesa; MuJoCo reads this when it is imported.
if not os.environ.get("MUJOCO_GL"):
    os.environ["MUJOCO_GL"] = "egl" if ctypes.util.find_library("EGL") else "osmesa"
