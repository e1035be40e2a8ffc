"""Runs a job of `camlux batch`."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING

from ._fields import knows_its_arguments
from ._progress import Bar
from .dataset import Dataset
from .errors import ArgumentTypeError, CamluxWarning, Cancelled, Error, MissingFileError

if TYPE_CHECKING:
    import subprocess

_WARNING = "camlux: warning: "
#: Time between two looks at the manifest, seconds.
_INTERVAL_S = 0.2
_PROGRAM = "import sys, camlux.__main__ as program; sys.exit(program.main_of_job({caller}))"


@knows_its_arguments
def run_job(
    job: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    device: str | None = None,
    progress: Callable[[int, int], object] | bool | None = None,
) -> Dataset:
    """Renders the missing frames of a job file to a data set, as `camlux batch` does in a process of its own, and opens the data set.

    device: an index, a part of a name, a UUID or a PCI address; None: the best one. progress: called with the number of complete frames and
    that of all frames; if it returns False, Cancelled is raised. True shows a bar, for which tqdm must be installed. Control-C and Cancelled
    finish the frames in flight, and on Linux so does the end of this process by a signal; call run_job again to continue. On other systems
    the batch then goes on to its end.

    Raises MissingFileError without a job file, and Error with the program's message if the job is wrong or a frame fails; the other frames
    are then complete.
    """
    if progress is not None and not isinstance(progress, bool) and not callable(progress):
        raise ArgumentTypeError(f"progress is {progress!r}; give a function, or True for a bar")
    if not Path(job).exists():
        raise MissingFileError(f"{os.fspath(job)}: there is no such file; give a job file, as docs/batch.md describes it")
    bar = Bar() if progress is True else None

    def report(done: int, count: int) -> object:
        if bar is not None:
            bar.show(done / max(count, 1), f"{done} of {count} frames ")
        return progress(done, count) if callable(progress) else None

    is_done = False
    try:
        dataset = _run(job, folder, device, report if progress else None)
        is_done = True
    finally:
        if bar is not None:
            bar.close(is_done)
    return dataset


def _run(
    job: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    device: str | None,
    report: Callable[[int, int], object] | None,
) -> Dataset:
    import signal
    import subprocess
    import threading

    command = [sys.executable, "-c", _PROGRAM.format(caller=os.getpid()), "batch", os.fspath(job), "-o", os.fspath(folder)]
    command += [] if device is None else ["--device", device]
    # A process group of its own: a terminal would send Control-C to both processes.
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert process.stderr is not None
    lines: list[str] = []
    reader = threading.Thread(target=_collect, args=(process.stderr, lines))
    reader.start()
    try:
        _watch(process, Path(folder), report)
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
            # At the line that calls run_job, whose arguments are checked before.
            warnings.warn(line.removeprefix(_WARNING), CamluxWarning, stacklevel=4)
    if process.returncode != 0:
        errors = [line.removeprefix("camlux: ").removeprefix("error: ") for line in lines if line.startswith("camlux: ")]
        raise Error("; ".join(line for line in errors if not line.startswith("warning: ")) or "the program ended without a message")
    dataset = Dataset(folder)
    if report is not None:
        report(len(dataset), len(dataset))
    return dataset


def _collect(stream: IO[str], lines: list[str]) -> None:
    lines.extend(line.rstrip("\n") for line in stream)


def _watch(process: subprocess.Popen[str], folder: Path, report: Callable[[int, int], object] | None) -> None:
    """Reports progress until the process ends."""
    import subprocess

    shown = -1
    while True:
        try:
            process.wait(_INTERVAL_S)
            return
        except subprocess.TimeoutExpired:
            pass
        if report is None:
            continue
        try:
            count = json.loads((folder / "dataset.json").read_text(encoding="utf-8"))["frame_count"]
            done = (folder / "manifest.jsonl").read_bytes().count(b'"blake3":')
        except (OSError, ValueError, KeyError):
            continue  # Not written yet.
        # The last call is made when all is written.
        if done > shown and done < count:
            shown = done
            if report(done, count) is False:
                raise Cancelled("the progress callback returned False")
