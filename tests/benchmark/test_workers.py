"""Workers: local ones are tried by the runner's tests; here a cluster, and what goes wrong."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.runs import CHEAP, results, workers_in_this_process

from aoicell.benchmark.runner import run_scenario
from aoicell.benchmark.workers import local_workers
from aoicell.errors import InputError

SMALL = CHEAP.model_copy(update={"trials_per_world": 3, "methods": ["paper"]})


@pytest.fixture
def in_this_process() -> Iterator[None]:
    with workers_in_this_process():
        yield


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A scheduler and two worker processes on this machine, without a dashboard."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        yield cluster


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.usefixtures("in_this_process")  # the one without a cluster
def test_a_cluster_finds_the_same_although_a_worker_dies(cluster: Any, tmp_path: Path) -> None:
    run_scenario(SMALL, tmp_path / "alone")
    killed: list[int] = []

    def kill_one(progress: Any) -> None:
        if progress.done == 1 and not killed:
            killed.append(next(iter(cluster.workers.values())).pid)  # the nanny's child
            os.kill(killed[0], signal.SIGKILL)

    run_scenario(SMALL, tmp_path / "cluster", kill_one, scheduler=cluster.scheduler_address)
    assert killed
    assert results(tmp_path / "cluster") == results(tmp_path / "alone")


def test_where_no_scheduler_answers_that_is_said(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        run_scenario(SMALL, tmp_path, scheduler="nonsense://x")


def test_the_cores_are_shared_out() -> None:
    with local_workers(1) as (worker,):
        threads = worker.submit(os.getenv, "LP_NUM_THREADS").result()
        assert threads == str(os.cpu_count())
        assert worker.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"


def test_an_idle_worker_that_died_is_replaced() -> None:
    with local_workers(1) as (worker,):
        os.kill(worker.submit(os.getpid).result(), signal.SIGKILL)
        for _ in range(50):  # until the pool has noticed, calls fail as those of a dead worker
            call = worker.submit(os.getpid)
            error = call.exception()
            if error is None:
                break
            assert worker.died(error)
        assert call.result() > 0
