#!/usr/bin/env python3
"""Draws the multipath error of images of a time-of-flight camera that have different numbers of bounces: docs/guides/time-of-flight.md.

    pip install matplotlib, and camlux as docs/python.md says
    python3 examples/python/multipath.py multipath.png 1.exr 2.exr 4.exr 8.exr
"""

import sys

import camlux
import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

picture, *paths = sys.argv[1:]
images = [camlux.read_exr(path) for path in paths]
attributes = images[0].attributes
frequencies_hz = [float(attributes[f"camlux.tof{index}.frequency_hz"]) for index in range(4) if f"tof{index}.mpi" in images[0].keys()]

figure, rows = pyplot.subplots(
    len(frequencies_hz), len(images), figsize=(2.5 * len(images), 2.1 * len(frequencies_hz)), layout="constrained", squeeze=False
)
for index, (row, frequency_hz) in enumerate(zip(rows, frequencies_hz)):
    errors_mm = [1e3 * image[f"tof{index}.mpi"] for image in images]
    low_mm, high_mm = np.nanpercentile(errors_mm, (1, 99))
    for axes, image, error_mm in zip(row, images, errors_mm):
        drawn = axes.imshow(error_mm, vmin=min(low_mm, 0), vmax=high_mm, cmap="viridis")
        bounces = int(image.attributes["camlux.bounces"])
        axes.set_title(f"{frequency_hz / 1e6:.0f} MHz, {bounces} bounce{'s' if bounces > 1 else ''}", fontsize=9)
        axes.set_axis_off()
    figure.colorbar(drawn, ax=list(row), label="multipath error, mm", fraction=0.03)
figure.savefig(picture, dpi=80)
