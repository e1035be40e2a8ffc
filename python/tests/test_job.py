"""Jobs and the program, as the installed package brings them."""

import fcntl
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import camlux
import pytest

from conftest import SCENES

JOB = f"[job]\nscene = \"{SCENES / 'cornell_spot.toml'}\"\nsize = [16, 16]\ntarget_error = 0.3\n"
RANDOM = "[camera]\nrandom = { min = [-0.5, 0.8, 2.8], max = [0.5, 1.2, 3.2], look_at = [0, 1, 0] }\n"


def test_the_wheel_brings_the_program(tmp_path):
    program = Path(sys.executable).with_name("camlux")
    for command in [[program], [sys.executable, "-m", "camlux"]]:
        done = subprocess.run([*command, "--version"], capture_output=True, text=True)
        assert (done.returncode, done.stdout) == (0, f"camlux {camlux.__version__}\n")
        done = subprocess.run([*command, "rendr"], capture_output=True, text=True)
        assert done.returncode == 2 and "render" in done.stderr
    scene = camlux.Scene.load(SCENES / "cornell_spot.toml")
    scene.camera.resolution_px = (8, 8)
    scene.save(tmp_path / "saved")
    command = [program, "render", tmp_path / "saved/scene.toml", "-o", tmp_path / "x.exr", "--target-error", "0.3"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert camlux.read_exr(tmp_path / "x.exr").resolution_px == (8, 8)


def test_a_job_runs_with_progress_and_goes_on(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(JOB.replace("[job]", "[job]\nframes = 5") + RANDOM)
    seen = []
    dataset = camlux.run_job(job, tmp_path / "set", progress=lambda done, count: seen.append((done, count)))
    assert len(dataset) == 5 and dataset.failed == []
    assert seen == sorted(seen) and seen[-1] == (5, 5)
    before = [line["ms"] for line in dataset.lines]
    assert [line["ms"] for line in camlux.run_job(job, tmp_path / "set").lines] == before


def test_a_job_shows_a_bar(tmp_path, capsys):
    job = tmp_path / "job.toml"
    job.write_text(JOB)
    camlux.run_job(job, tmp_path / "set", progress=True)
    shown = capsys.readouterr().err
    assert "100%" in shown.splitlines()[-1]
    assert len(camlux.run_job(job, tmp_path / "set", progress=False)) == 1 and capsys.readouterr().err == ""


def test_errors_and_warnings_of_a_job(tmp_path):
    job = tmp_path / "job.toml"
    with pytest.raises(camlux.MissingFileError, match="job.toml: there is no such file; give a job file") as caught:
        camlux.run_job(job, tmp_path / "set")
    assert isinstance(caught.value, FileNotFoundError)
    with pytest.raises(camlux.ArgumentTypeError, match="progress is 5; give a function, or True for a bar"):
        camlux.run_job(job, tmp_path / "set", progress=5)
    job.write_text(JOB + "frmes = 5\n")
    with pytest.raises(camlux.Error, match=r'job.toml:5: unknown key "frmes" in \[job\]'):
        camlux.run_job(job, tmp_path / "set")
    job.write_text(JOB)
    with pytest.raises(camlux.Error, match="no usable Vulkan device"):
        camlux.run_job(job, tmp_path / "set", device="none of this name")
    job.write_text(JOB + "[[material]]\nname = \"white\"\nkd_min = 0.9\nkd_max = 0.9\nks_min = 0.2\nks_max = 0.3\nshininess_min = 5\nshininess_max = 6\n".replace("[[mat", "frames = 1\n[[mat"))
    with pytest.warns(camlux.CamluxWarning, match="reflects more than it receives") as warned:
        camlux.run_job(job, tmp_path / "set")
    assert warned[0].filename == __file__


@pytest.mark.skipif(sys.platform != "linux", reason="signals at the end of a parent are Linux's")
def test_a_job_ends_with_its_caller(tmp_path):
    job, folder = tmp_path / "job.toml", tmp_path / "set"
    job.write_text(JOB.replace("[job]", "[job]\nframes = 2000") + RANDOM)
    caller = subprocess.Popen([sys.executable, "-c", f"import camlux; camlux.run_job({str(job)!r}, {str(folder)!r})"])
    manifest = folder / "manifest.jsonl"
    while not (manifest.exists() and manifest.read_bytes().count(b"\n") >= 2):
        assert caller.poll() is None
        time.sleep(0.01)
    caller.kill()
    caller.wait()
    with open(folder / ".manifest.jsonl.lock", "w") as lock:
        # Until the batch ends.
        fcntl.flock(lock, fcntl.LOCK_EX)
    assert 2 <= len(camlux.Dataset(folder)) < 2000
    assert not list((folder / "frames").glob(".*.part"))


def test_shards_that_are_not_merged_name_the_command(tmp_path):
    job, folder = tmp_path / "job.toml", tmp_path / "set"
    job.write_text(JOB.replace("[job]", "[job]\nframes = 2") + RANDOM)
    program = [sys.executable, "-m", "camlux", "batch"]
    for shard in ["1/2", "2/2"]:
        subprocess.run([*program, job, "-o", folder, "--shard", shard], check=True, capture_output=True)
    command = f"camlux batch job.toml -o {folder} --merge"
    with pytest.raises(camlux.MissingFileError, match=f"shards alone \\(manifest-1-of-2.jsonl, manifest-2-of-2.jsonl\\); merge them by: {command}"):
        camlux.Dataset(folder)
    subprocess.run([*program, *command.split()[2:]], check=True, cwd=tmp_path, capture_output=True)
    assert len(camlux.Dataset(folder)) == 2


def test_a_job_is_stopped_by_its_callback_and_by_control_c(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(JOB.replace("[job]", "[job]\nframes = 400") + RANDOM)
    with pytest.raises(camlux.Cancelled):
        camlux.run_job(job, tmp_path / "set", progress=lambda done, count: done < 2)
    there = len(camlux.Dataset(tmp_path / "set"))
    assert 2 <= there < 400

    def interrupt(done, count):
        if done > there:
            # As from a terminal.
            threading.Timer(0, os.kill, [os.getpid(), signal.SIGINT]).start()

    # Python ignores SIGINT if a shell started the tests in the background.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            camlux.run_job(job, tmp_path / "set", progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)
    assert there < len(camlux.Dataset(tmp_path / "set")) < 400
    assert not list((tmp_path / "set/frames").glob(".*.part"))
