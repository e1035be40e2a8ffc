"""Runs a job of `camlux batch`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import IO

from .dataset import Dataset
from .errors import CamluxWarning, Cancelled, Error

_WARNING = "camlux: warning: "
#: Time between two looks at the manifest, seconds.
_INTERVAL_S = 0.2


def run_job(
    job: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    device: str | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Dataset:
    """Renders the missing frames of a job file to a data set, as `camlux batch` does in a process of its own, and opens the data set.

    device: an index, a part of a name, a UUID or a PCI address; None: the best one. progress: called with the number of complete frames and
    that of all frames; if it returns False, Cancelled is raised. Control-C and Cancelled finish the frames in flight; call run_job again to
    continue. If this process is killed, the batch goes on to its end.

    Raises Error with the program's message if the job is wrong or a frame fails; the other frames are then complete.
    """
    command = [sys.executable, "-m", "camlux", "batch", os.fspath(job), "-o", os.fspath(folder)]
    command += [] if device is None else ["--device", device]
    # A process group of its own: a terminal would send Control-C to both processes.
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stderr is not None
    lines: list[str] = []
    reader = threading.Thread(target=_collect, args=(process.stderr, lines))
    reader.start()
    try:
        _watch(process, Path(folder), progress)
    except BaseException:
        process.send_signal(signal.SIGINT)
        raise
    finally:
        try:
            process.wait()
        except KeyboardInterrupt:
            process.kill()
            raise
        finally:
            reader.join()
            process.stderr.close()
    for line in lines:
        if line.startswith(_WARNING):
            warnings.warn(line.removeprefix(_WARNING), CamluxWarning, stacklevel=2)
    if process.returncode != 0:
        errors = [line.removeprefix("camlux: ").removeprefix("error: ") for line in lines if line.startswith("camlux: ")]
        raise Error("; ".join(line for line in errors if not line.startswith("warning: ")) or "the program ended without a message")
    dataset = Dataset(folder)
    if progress is not None:
        progress(len(dataset), len(dataset))
    return dataset


def _collect(stream: IO[str], lines: list[str]) -> None:
    lines.extend(line.rstrip("\n") for line in stream)


def _watch(process: subprocess.Popen[str], folder: Path, progress: Callable[[int, int], object] | None) -> None:
    """Reports progress until the process ends."""
    shown = -1
    while True:
        try:
            process.wait(_INTERVAL_S)
            return
        except subprocess.TimeoutExpired:
            pass
        if progress is None:
            continue
        try:
            count = json.loads((folder / "dataset.json").read_text(encoding="utf-8"))["frame_count"]
            done = (folder / "manifest.jsonl").read_bytes().count(b'"blake3":')
        except (OSError, ValueError, KeyError):
            continue  # Not written yet.
        # The last call is made when all is written.
        if done > shown and done < count:
            shown = done
            if progress(done, count) is False:
                raise Cancelled("the progress callback returned False")
