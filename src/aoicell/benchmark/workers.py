"""Worker processes: spawned, one numeric thread each, so that results do not depend on them."""

import os
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing import get_context

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "LP_NUM_THREADS")


def local_workers(count: int | None = None) -> Executor:
    """A pool of `count` processes (default: one a core).

    N processes with one rendering thread each beat one process with N threads.
    """
    for name in _ONE_THREAD:  # read by the libraries when a spawned worker loads them
        os.environ.setdefault(name, "1")
    workers = count or os.cpu_count() or 1
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
