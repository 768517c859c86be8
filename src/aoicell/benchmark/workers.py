"""Workers: on this machine or of a Dask cluster, both as `concurrent.futures` executors.

Each worker has an executor of its own, so that the trials of a world can be sent to the one
that has calibrated it. Every worker computes on one numeric thread: sums are then formed in
the same order everywhere, and N processes with one rendering thread each beat one process
with N.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from multiprocessing import get_context, parent_process
from typing import Any, Protocol

import cv2
from threadpoolctl import threadpool_limits

from aoicell.errors import InputError

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


class Worker(Protocol):
    """One worker."""

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Queue a call."""

    def died(self, error: BaseException) -> bool:
        """Whether a future's error means that the worker died; it is replaced if so."""


class LocalWorker:
    """A spawned process, replaced by a new one when it dies."""

    def __init__(self, render_threads: int = 1) -> None:
        self._render_threads = render_threads
        self._executor = self._spawn()

    def _spawn(self) -> Executor:
        for name in _ONE_THREAD:  # read by the libraries when a spawned worker loads them
            os.environ.setdefault(name, "1")
        return ProcessPoolExecutor(
            1, get_context("spawn"), initializer=_begin, initargs=(self._render_threads,)
        )

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Queue a call."""
        try:
            return self._executor.submit(function, *arguments)
        except BrokenProcessPool:  # it died while it was idle
            self._executor = self._spawn()
            return self._executor.submit(function, *arguments)

    def died(self, error: BaseException) -> bool:
        """Whether a future's error means that the worker died."""
        return isinstance(error, BrokenProcessPool)

    def stop(self) -> None:
        """End the process after its present call, or at once when it is idle."""
        self._executor.shutdown(wait=True, cancel_futures=True)


class DaskWorker:
    """One worker of a Dask cluster; when it dies the scheduler sends its calls to another."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def submit(self, function: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Queue a call."""
        return self._executor.submit(function, *arguments)

    def died(self, error: BaseException) -> bool:
        """Whether a future's error means that several workers died over it."""
        return type(error).__name__ in ("KilledWorker", "CancelledError", "FutureCancelledError")


@contextmanager
def local_workers(count: int) -> Iterator[list[Worker]]:
    """`count` processes on this machine; the cores are shared out among their renderers."""
    threads = max(1, (os.cpu_count() or 1) // count)
    workers = [LocalWorker(threads) for _ in range(count)]
    try:
        yield list(workers)
    finally:
        for worker in workers:
            worker.stop()


@contextmanager
def dask_workers(address: str) -> Iterator[list[Worker]]:
    """The workers of the cluster whose scheduler listens at `address` (tcp://host:8786).

    Raises InputError when there is no scheduler, no worker, or the extra is not installed.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "--scheduler needs the package distributed; type: pip install 'aoicell[cluster]'"
        ) from None
    try:
        client: Any = Client(address, timeout=10, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers ({reason}); "
            "give its address as in tcp://host:8786"
        ) from None
    with client:
        names = list(client.scheduler_info(n_workers=-1)["workers"])
        if not names:
            raise InputError(f"--scheduler {address}: it has no workers; start one: dask worker")
        yield [
            DaskWorker(client.get_executor(workers=[name], allow_other_workers=True))
            for name in names
        ]


def _begin(render_threads: int) -> None:
    """In a new process: leave Ctrl-C to the runner, and end when the runner is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["LP_NUM_THREADS"] = str(render_threads)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@cache
def compute_on_one_thread() -> None:
    """BLAS, OpenMP and OpenCV on one thread from now on, also where they are loaded already."""
    cv2.setNumThreads(1)
    threadpool_limits(1)
