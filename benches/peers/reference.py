"""An image by Mitsuba's plugin `path` with the standard error of each pixel. Tests compare camlux's reference with it.

Import this after the variant is set."""

from pathlib import Path

import numpy as np
import OpenEXR

from frames import to_host
from tracer import Tracer

# Batches with different seeds. Their spread gives the standard error.
BATCHES = 64


def render(tracer: Tracer, size_px: tuple[int, int], samples: int, path: Path):
    """Writes the layers `direct`, `indirect` and `stderr` (of `indirect`) as 16-bit floats. Uses `samples` samples in total."""
    [direct] = to_host([tracer.direct()[0]], size_px)
    samples_a_batch = max(1, samples // BATCHES)
    mean = np.zeros(direct.shape)
    scatter = np.zeros(direct.shape)
    for batch in range(BATCHES):
        [radiance] = to_host([tracer.by_path_plugin(samples_a_batch, batch)], size_px)
        change = radiance - direct - mean
        mean += change / (batch + 1)
        scatter += change * (radiance - direct - mean)
    standard_error = np.sqrt(scatter / (BATCHES * (BATCHES - 1)))
    layers = {"direct": direct, "indirect": mean, "stderr": standard_error}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {name: values.astype(np.float16) for name, values in layers.items()}) as file:
        file.write(str(path))
