#!/usr/bin/env python3
"""Renders a job of `camlux batch` on a Dask cluster whose machines share a folder.

    pip install distributed, and camlux as docs/python.md says
    python3 render.py job.toml /shared/set tcp://scheduler:8786

Run it again to continue: frames that are there are kept.
"""

import subprocess
import sys

from distributed import Client


def batch(*arguments: str) -> None:
    command = [sys.executable, "-m", "camlux", "batch", *arguments]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr}")


def render(job: str, folder: str, scheduler: str) -> None:
    with Client(scheduler) as client:
        count = len(client.scheduler_info(n_workers=-1)["workers"])
        shards = [f"{number}/{count}" for number in range(1, count + 1)]
        # A worker that is lost leaves its finished frames: another one goes on.
        client.gather([client.submit(batch, job, "-o", folder, "--shard", shard, retries=2, pure=False) for shard in shards])
    batch(job, "-o", folder, "--merge")


if __name__ == "__main__":
    render(*sys.argv[1:])
