"""Jobs and the program, as the installed package brings them."""

import os
import signal
import subprocess
import sys
import threading
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


def test_errors_and_warnings_of_a_job(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(JOB + "frmes = 5\n")
    with pytest.raises(camlux.Error, match=r'job.toml:5: unknown key "frmes" in \[job\]'):
        camlux.run_job(job, tmp_path / "set")
    job.write_text(JOB)
    with pytest.raises(camlux.Error, match="no usable Vulkan device"):
        camlux.run_job(job, tmp_path / "set", device="none of this name")
    job.write_text(JOB + "[[material]]\nname = \"white\"\nkd_min = 0.9\nkd_max = 0.9\nks_min = 0.2\nks_max = 0.3\nshininess_min = 5\nshininess_max = 6\n".replace("[[mat", "frames = 1\n[[mat"))
    with pytest.warns(camlux.CamluxWarning, match="reflects more than it receives"):
        camlux.run_job(job, tmp_path / "set")


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
