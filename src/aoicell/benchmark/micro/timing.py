"""Times that others on the same machine do not change much."""

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import cv2

ROUNDS = 5


def milliseconds(work: Callable[[], Any], rounds: int = ROUNDS) -> float:
    """Median CPU time of this thread: what others compute meanwhile does not count."""
    times = []
    for _ in range(rounds):
        start = time.thread_time()
        work()
        times.append(time.thread_time() - start)
    return 1e3 * statistics.median(times)


@contextmanager
def one_opencv_thread() -> Iterator[None]:
    """Everything that OpenCV does is done by the thread that asks for it."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
