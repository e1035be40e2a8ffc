#!/usr/bin/env python3
"""Frames a second from Python against `camlux batch`: the same frames of the Cornell box, rendered and saved. Both take turns, each one's
best round counts.

    python3 python/benches/batch.py target/release/camlux [FRAMES [ROUNDS]]
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

SCENES = Path(__file__).parents[2] / "scenes"
SIZE_PX = (320, 240)


def batch(program: str, frames: int, folder: Path, scene: Path) -> float:
    (folder / "job.toml").write_text(
        f"""[job]
scene = "{scene}"
size = {list(SIZE_PX)}
frames = {frames}
[camera]
keyframes = [
    {{ frame = 0, position = [-0.6, 1.0, 3.2], look_at = [0.0, 1.0, 0.0] }},
    {{ frame = {frames - 1}, position = [0.6, 1.2, 2.8], look_at = [0.0, 1.0, 0.0] }},
]
"""
    )
    start = time.perf_counter()
    subprocess.run([program, "batch", folder / "job.toml", "-o", folder / "set"], check=True, capture_output=True)
    return time.perf_counter() - start


# As a program of its own, as the other one is: each opens its device and loads its scene.
PYTHON = """
import sys
from concurrent.futures import ThreadPoolExecutor

import camlux
import numpy as np

scene_file, folder, frames = sys.argv[1], sys.argv[2], int(sys.argv[3])
scene, renderer = camlux.Scene.load(scene_file), camlux.Renderer()
scene.camera.resolution_px = (%d, %d)
with ThreadPoolExecutor(1) as writer:
    written = []
    for index, t in enumerate(np.linspace(0, 1, frames)):
        scene.camera.position_m = (-0.6 + 1.2 * t, 1.0 + 0.2 * t, 3.2 - 0.4 * t)
        frame = renderer.render(scene, frame_index=index)
        # Not more than two frames wait to be written.
        if len(written) > 1:
            written.pop(0).result()
        written.append(writer.submit(frame.save, f"{folder}/{index:06}.exr", compression="rle"))
    for done in written:
        done.result()
""" % SIZE_PX


def python(frames: int, folder: Path, scene: Path) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", PYTHON, scene, folder, str(frames)], check=True)
    return time.perf_counter() - start


def main() -> None:
    program = sys.argv[1]
    frames = int(sys.argv[2]) if len(sys.argv) > 2 else 120
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    text = (SCENES / "cornell.toml").read_text().replace('"cornell.obj"', f'"{SCENES / "cornell.obj"}"')
    direct = text.split("[indirect]")[0]
    gather = direct + '[indirect]\nestimator = "final-gather"\n'
    for name, content in [("direct light only", direct), ("final gathering to 2 %", gather)]:
        seconds = {"batch": [], "python": []}
        for _ in range(rounds):
            with tempfile.TemporaryDirectory() as folder:
                scene = Path(folder) / "scene.toml"
                scene.write_text(content)
                seconds["batch"].append(batch(program, frames, Path(folder), scene))
            with tempfile.TemporaryDirectory() as folder:
                scene = Path(folder) / "scene.toml"
                scene.write_text(content)
                seconds["python"].append(python(frames, Path(folder), scene))
        best = {who: frames / min(times) for who, times in seconds.items()}
        print(f"{name}: batch {best['batch']:.2f}, python {best['python']:.2f} frames/s, ratio {best['python'] / best['batch']:.3f}")


if __name__ == "__main__":
    main()
