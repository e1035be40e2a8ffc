"""The example of a job on a Dask cluster, with two worker processes."""

import subprocess
import sys
from pathlib import Path

import camlux
import pytest
from conftest import SCENES
from distributed import LocalCluster

EXAMPLE = Path(__file__).parents[2] / "examples/dask/render.py"
JOB = f"""
[job]
scene = "{SCENES / 'cornell_spot.toml'}"
frames = 6
size = [16, 16]
target_error = 0.3
[camera]
random = {{ min = [-0.5, 0.8, 2.8], max = [0.5, 1.2, 3.2], look_at = [0, 1, 0] }}
"""


@pytest.fixture(scope="module")
def cluster():
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        yield cluster


def run(cluster, *arguments):
    command = [sys.executable, EXAMPLE, *arguments, cluster.scheduler_address]
    return subprocess.run(command, capture_output=True, text=True)


def files(dataset):
    return {line["index"]: line["blake3"] for line in dataset.lines}


def test_shards_on_two_workers_are_the_job(cluster, tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(JOB)
    whole = camlux.run_job(job, tmp_path / "whole")
    done = run(cluster, job, tmp_path / "set")
    assert done.returncode == 0, done.stderr
    merged = camlux.Dataset(tmp_path / "set")
    assert len(merged) == 6 and files(merged) == files(whole)
    # One frame is lost; only that one is rendered again.
    merged[3].path.unlink()
    assert run(cluster, job, tmp_path / "set").returncode == 0
    again = camlux.Dataset(tmp_path / "set")
    assert files(again) == files(whole)
    assert [a["ms"] == b["ms"] for a, b in zip(again.lines, merged.lines)] == [True, True, True, False, True, True]


def test_a_shard_that_fails_says_why(cluster, tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(JOB.replace("frames = 6", "frame = 6"))
    done = run(cluster, job, tmp_path / "set")
    assert done.returncode != 0 and 'unknown key "frame"' in done.stderr
