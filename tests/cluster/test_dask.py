"""Sweeps on Dask: real processes that are killed, added and late."""

from __future__ import annotations

import os
import random
import signal
import threading
import time

import pytest
from distributed import Client, LocalCluster

import tarsus as ts
from study.sweep_case import files, small
from tarsus.cluster.dask import dask_executor
from tarsus.study.axes import Linspace, Sobol

SWEEP = small(vary={"ground.restitution.coefficient": Linspace(start=0.1, stop=0.6)}, design=Sobol(count=80), chunk=2)


def test_threads_of_a_dask_cluster_give_the_same_bytes(alone, tmp_path):
    with (
        LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        result = ts.sweep(SWEEP, tmp_path, threads=client)
    assert files(tmp_path) == files(alone)
    assert sum(result.workers.values()) == 80 and result.units == 40


def test_no_scheduler_is_a_sentence(monkeypatch):
    monkeypatch.setattr("tarsus.cluster.dask.PATIENCE", "300 ms")
    with pytest.raises(ts.InputError, match="no scheduler answers"), dask_executor("tcp://127.0.0.1:9"):
        pass


# Slow: processes that load everything, and are killed.
@pytest.mark.slow
def test_workers_that_are_killed_and_added_change_nothing(alone, tmp_path):
    chance = random.Random(3)
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        killed = []
        over = threading.Event()

        def kill() -> None:
            while len(killed) < 4 and not over.wait(chance.uniform(0.5, 1.5)):
                pids = [nanny.pid for nanny in list(cluster.workers.values()) if nanny.pid]
                if pids:
                    os.kill(chance.choice(pids), signal.SIGKILL)
                    killed.append(time.monotonic())
                cluster.scale(3)

        def slowly(plan, start, stop):
            time.sleep(0.2)
            return whole(plan, start, stop)

        import tarsus.study.pool as pool

        whole, pool.remote_unit = pool.remote_unit, slowly
        killer = threading.Thread(target=kill)
        killer.start()
        try:
            result = ts.sweep(SWEEP, tmp_path, threads=client)
        finally:
            pool.remote_unit = whole
            over.set()
            killer.join()
    assert killed and len(result.workers) >= 2
    assert files(tmp_path) == files(alone)
