"""What holds for every test: rendering without a display, and one thread for each library."""

import os

# Before any test imports mujoco or numpy, which read these once.
os.environ.setdefault("MUJOCO_GL", "egl")
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[_variable] = "1"
