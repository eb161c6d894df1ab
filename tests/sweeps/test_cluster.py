"""Sweeps on a Dask cluster of this machine: same bits as a loop, and clients that are refused."""

import os

import numpy as np
import pytest

from taichi_dem import InputError, sweep
from taichi_dem.kit.sweeps import cluster as workers
from tests.sweeps import jobs
from tests.sweeps.test_sweep import QUIET, assert_same_bits, serial

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def client():
    """Two processes of one thread each."""
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as made:
        yield made


def test_a_worker_that_is_killed_loses_nothing_and_bits_are_those_of_a_loop(client, tmp_path):
    table = serial(jobs.damper, jobs.damper_rows(tmp_path))
    out = tmp_path / "out"
    found = sweep(jobs.damper, jobs.damper_rows(tmp_path, True), client=client, out=out, **QUIET)
    assert_same_bits(found, table)
    assert np.isfinite(table["rms_m"]).all() and len(set(table["rms_m"])) == 8
    # What was kept there is what local processes would have kept.
    again = sweep(jobs.damper, jobs.damper_rows(tmp_path), workers=1, out=out, **QUIET)
    assert_same_bits(again, table)


def test_a_job_runs_elsewhere_with_one_thread_and_its_failure_is_a_row(client):
    found = sweep(jobs.where, {"x": [1, 2, 3, 4]}, client=client, **QUIET)
    assert found["threads"].tolist() == [1, 1, 1, 1] and os.getpid() not in found["pid"]
    failures = sweep(jobs.bad, {"how": ["input", "well", "bug"]}, client=client, **QUIET)
    assert_same_bits(failures, serial(jobs.bad, {"how": ["input", "well", "bug"]}))


def test_what_a_row_raises_or_kills_is_an_error_of_that_row_alone(client):
    found = sweep(jobs.bad, {"how": [*jobs.RAISED, "killed"]}, client=client, **QUIET)
    assert found["error"].tolist() == [*jobs.SAID, "its worker was lost 4 times"]


def test_a_client_whose_workers_are_all_lost_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "_NO_WORKER", 2.0)
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:

        def lose(progress):
            if progress.done == 3:
                cluster.scale(0)

        with pytest.raises(InputError, match=r"^the client must have a worker, got none for 2 s"):
            sweep(jobs.squared, {"x": range(2000)}, client=client, out=tmp_path, progress=lose)
    assert len(list((tmp_path / "jobs").iterdir())) >= 3


def test_a_client_that_is_gone_is_a_sentence_and_keeps_what_is_finished(tmp_path):
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options) as cluster:
        client = distributed.Client(cluster)

        def leave(progress):
            if progress.done == 3:
                client.close()

        rows = {"x": range(20)}
        with pytest.raises(InputError, match=r"^the client has lost .*; 3 finished jobs are kept"):
            sweep(jobs.squared, rows, client=client, out=tmp_path, progress=leave)
        assert len(list((tmp_path / "jobs").iterdir())) == 3
        with pytest.raises(InputError, match=r"^the client has lost its scheduler: it is closed$"):
            sweep(jobs.squared, rows, client=client, out=tmp_path, **QUIET)


def test_workers_with_threads_are_refused():
    options = {"n_workers": 1, "threads_per_worker": 2, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options, processes=False) as cluster:
        with distributed.Client(cluster) as client:
            with pytest.raises(InputError, match="got 2: start them with threads_per_worker=1"):
                sweep(jobs.squared, {"x": [1]}, client=client, **QUIET)


def test_a_worker_in_this_process_is_refused_as_taichi_runs_on_another_thread():
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options, processes=False) as cluster:
        with distributed.Client(cluster) as client:
            with pytest.raises(
                InputError, match="Taichi must run on one thread in a worker of a sweep"
            ):
                sweep(jobs.squared, {"x": [1]}, client=client, **QUIET)


def test_clients_of_another_kind_are_refused(client):
    for other in (3, "tcp://localhost:1", distributed.Client):
        with pytest.raises(InputError, match=r"client must be a dask.distributed.Client, got "):
            sweep(jobs.squared, {"x": [1]}, client=other, **QUIET)
    with pytest.raises(InputError, match="workers must be left out with a client, got 2"):
        sweep(jobs.squared, {"x": [1]}, client=client, workers=2, **QUIET)
