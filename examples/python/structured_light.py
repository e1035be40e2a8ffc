#!/usr/bin/env python3
"""Triangulates the depth of a scene from the frames of a Gray code, and compares it with the true depth.

    camlux batch examples/structured_light/job.toml -o out/structured_light
    python3 examples/python/structured_light.py out/structured_light
"""

import sys

import camlux
import numpy as np

FOCAL_PX, CENTRE_PX, BASELINE_M = 350.0, 128.0, 0.3  # of the projector, as in scene.toml

frames = camlux.Dataset(sys.argv[1])
raw = [np.asarray(frame["raw_dn"]) for frame in frames]
gray = np.array([shown > inverse for shown, inverse in zip(raw[::2], raw[1::2])])
bits = np.logical_xor.accumulate(gray, axis=0)  # Gray code to binary, the highest bit first
column = sum(bit * (1 << 7 - i) for i, bit in enumerate(bits)) + 0.5
camera = frames[0].line["camera"]["intrinsics_px"]
x = (np.arange(raw[0].shape[1]) + 0.5 - camera["cx"]) / camera["fx"]  # of a pixel at depth 1
disparity = x - (column - CENTRE_PX) / FOCAL_PX
depth = BASELINE_M / np.where(disparity > 0, disparity, np.nan)

# A pixel is lit by the projector where every image is clearly brighter or darker than its inverse. The true depth is then within the
# column of the code.
true = np.asarray(frames[0]["depth"])
contrast = np.min([abs(a - b) for a, b in zip(raw[::2], raw[1::2])], axis=0)
lit = (contrast > 60) & (disparity > 0)
half_column = 0.5 / FOCAL_PX
is_within = (true > BASELINE_M / (disparity + half_column) * (1 - 1e-5)) & (true < BASELINE_M / (disparity - half_column) * (1 + 1e-5))
print(f"{lit.mean():.0%} of the pixels are lit; median error {np.median(abs(depth - true)[lit]) * 1e3:.1f} mm")
print(f"{is_within[lit].mean():.2%} of them are within the column of their code")
if is_within[lit].mean() < 0.99:
    sys.exit("the code is not decoded")
