"""Traces rays with Embree in PROCESSES processes. Each traces its share of the rays.

    embree FOLDER PROCESSES

The folder has little-endian float32 files: `triangles` (nine per triangle), `any` and `closest` (eight per
ray: origin, distance of its end, direction, a number that is not used).
Each line on standard input is `any` or `closest`. The answer is a line with the seconds of the slowest process.
The hits are written to `any.found` and `closest.found`, int32: the triangle, or −1 for none.
"""

import multiprocessing
import sys
import time
from pathlib import Path

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene


def floats(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<f4")


def work(folder: Path, share: int, shares: int, pipe) -> None:
    # Watertight, as camlux is. It also hits what is just beyond a ray's end.
    scene = EmbreeScene(robust=True)
    # Kept alive here, because the scene does not hold a reference.
    mesh = TriangleMesh(scene, floats(folder / "triangles").reshape(-1, 3, 3))
    assert mesh is not None
    rays = {}
    for kind in ("any", "closest"):
        all_rays = floats(folder / kind).reshape(-1, 8)
        mine = np.array_split(all_rays, shares)[share]
        rays[kind] = [np.ascontiguousarray(mine[:, columns]) for columns in (slice(3), slice(4, 7), 3)]
    pipe.send(None)
    while (kind := pipe.recv()) is not None:
        origins, directions, ends = rays[kind]
        if kind == "any":
            start = time.process_time()
            found = scene.run(origins, directions, dists=ends, query="OCCLUDED")
        else:
            start = time.process_time()
            found = scene.run(origins, directions, query="INTERSECT")
        seconds = time.process_time() - start
        pipe.send(seconds)
        pipe.send(np.asarray(found, dtype="<i4"))


def main() -> None:
    folder, count = Path(sys.argv[1]), int(sys.argv[2])
    pipes = []
    for share in range(count):
        here, there = multiprocessing.Pipe()
        arguments = (folder, share, count, there)
        multiprocessing.Process(target=work, args=arguments, daemon=True).start()
        pipes.append(here)
    for pipe in pipes:
        pipe.recv()
    for line in sys.stdin:
        kind = line.strip()
        for pipe in pipes:
            pipe.send(kind)
        # CPU time, without that of the pipes.
        seconds = max([pipe.recv() for pipe in pipes])
        np.concatenate([pipe.recv() for pipe in pipes]).tofile(folder / f"{kind}.found")
        print(seconds, flush=True)
    for pipe in pipes:
        pipe.send(None)


if __name__ == "__main__":
    main()
