#!/usr/bin/env python3
"""Renders a box with rising reflectance, plots the share of indirect light on its floor, and checks the result.

    pip install matplotlib, and camlux as docs/python.md says
    python3 sweep.py sweep.png
"""

import sys

import camlux
import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

SIZE_PX = 128


def quad(name: str, corners: list[list[float]], material: int) -> camlux.Mesh:
    return camlux.Mesh(name, corners, [[0, 1, 2], [0, 2, 3]], material)


# A box of 2 m, open towards the camera, with a lamp below its ceiling.
low, high = -1.0, 1.0
scene = camlux.Scene(
    camera=camlux.Camera((SIZE_PX, SIZE_PX), position_m=(0, 0, 3.6), look_at_m=(0, 0, 0), fov_y_deg=42),
    lights=[camlux.PointLight((0.0, 0.8, 0.0), power_w=50.0)],
    materials=[camlux.Material("walls", kd=0.5), camlux.Material("red", kd=(0.7, 0.1, 0.1))],
    meshes=[
        quad("floor", [[low, low, low], [high, low, low], [high, low, high], [low, low, high]], 0),
        quad("ceiling", [[low, high, low], [high, high, low], [high, high, high], [low, high, high]], 0),
        quad("back", [[low, low, low], [high, low, low], [high, high, low], [low, high, low]], 0),
        quad("left", [[low, low, low], [low, high, low], [low, high, high], [low, low, high]], 1),
        quad("right", [[high, low, low], [high, high, low], [high, high, high], [high, low, high]], 0),
    ],
    indirect=camlux.FinalGather(target_error=0.02),
)

renderer = camlux.Renderer()
reflectances = np.linspace(0.1, 0.9, 9)
shares, frames = [], []
for kd in reflectances:
    scene.materials[0].kd = float(kd)
    frame = renderer.render(scene)
    floor = frame["id.instance"] == 1 + frame.mesh_names.index("floor")
    shares.append(frame["indirect"][floor].sum() / frame["radiance"][floor].sum())
    frames.append(frame)
    print(f"kd {kd:.1f}: {shares[-1]:.1%} indirect, error {frame.stats.estimated_error:.1%}, {frame.stats.wall_ms:.0f} ms")

# Checks the engine's own estimate against the true bounce.
truth = camlux.reference(scene, stderr=0.01)
found = camlux.compare(frames[-1], truth, "indirect")
print(f"kd 0.9 against the reference: {found}")

figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
radiance = frames[-1]["radiance"]
left.imshow(np.clip(radiance / np.percentile(radiance, 99), 0, 1) ** (1 / 2.2))
left.set_title(f"radiance, kd = {reflectances[-1]:.1f}")
left.set_axis_off()
right.plot(reflectances, 100 * np.array(shares), "o-")
right.set_xlabel("kd of the walls")
right.set_ylabel("indirect light on the floor, %")
right.grid(alpha=0.3)
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "sweep.png", dpi=120)
