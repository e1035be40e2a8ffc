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
camera = frames[0].info["camera"]["intrinsics_px"]
x = (np.arange(raw[0].shape[1]) + 0.5 - camera["cx"]) / camera["fx"]  # of a pixel at depth 1
disparity = x - (column - CENTRE_PX) / FOCAL_PX
depth = BASELINE_M / np.where(disparity > 0, disparity, np.nan)

# The projector lights a pixel where one of the images is clearly brighter than its inverse. A code says half a column at best.
true = np.asarray(frames[0]["depth"])
contrast = np.min([abs(a.astype(float) - b) for a, b in zip(raw[::2], raw[1::2])], axis=0)
seen = (contrast > 15) & np.isfinite(depth)
bound = true**2 * 0.5 / FOCAL_PX / BASELINE_M
error = abs(depth - true)[seen] / bound[seen]
print(f"{seen.mean():.0%} of the pixels; median error {np.median(abs(depth - true)[seen]) * 1e3:.1f} mm")
print(f"{(error <= 1.05).mean():.1%} within half a column of the code")
