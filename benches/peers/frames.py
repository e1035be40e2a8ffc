"""Frames of a scene by Mitsuba, with and without Open Image Denoise, written to OpenEXR files.

Import this after the variant is set."""

import time
from pathlib import Path

import drjit as dr
import numpy as np
import OpenEXR
import pyoidn

from failure import Failure
from tracer import Pattern, Tracer

SEED = 1


class Clock:
    """Measures the seconds of a frame's parts."""

    def __init__(self):
        self.seconds_of: dict[str, float] = {}
        self.last = time.perf_counter()

    def lap(self, part: str):
        now = time.perf_counter()
        self.seconds_of[part] = now - self.last
        self.last = now


class PathTraced:
    """Direct light and `samples` samples of the bounces per pixel, with Z of each modulation frequency."""

    def __init__(self, tracer: Tracer, size_px: tuple[int, int], samples: int):
        self.tracer, self.size_px, self.samples = tracer, size_px, samples

    def render(self, path: Path, iterations: int | None = None) -> dict[str, float]:
        """Writes a frame. With `iterations` below the number of samples, the same kernels run in less time."""
        clock = Clock()
        pattern = Pattern(self.samples, self.tracer.pixel_count, SEED)
        direct, direct_phasors = self.tracer.direct()
        indirect, phasors = self.tracer.indirect(pattern, iterations or self.samples)
        direct, indirect, *phasors = to_host([direct, indirect, *direct_phasors, *phasors], self.size_px)
        clock.lap("render")
        count = len(direct_phasors)
        totals = [of_direct + bounced for of_direct, bounced in zip(phasors[:count], phasors[count:])]
        write(path, direct, indirect, phasor_layers(totals, phasors[count:]))
        clock.lap("write")
        return clock.seconds_of


class TransientPath(PathTraced):
    """The same by mitransient's unmodified plugin `transient_path`. The exact direct light is subtracted."""

    def render(self, path: Path, iterations: int | None = None) -> dict[str, float]:
        clock = Clock()
        radiance, phasors = self.tracer.by_transient_path(iterations or self.samples, SEED)
        direct, direct_phasors = self.tracer.direct()
        direct, radiance, *phasors = to_host([direct, radiance, *direct_phasors, *phasors], self.size_px)
        clock.lap("render")
        count = len(direct_phasors)
        bounced = [total - of_direct for of_direct, total in zip(phasors[:count], phasors[count:])]
        write(path, direct, radiance - direct, phasor_layers(phasors[count:], bounced))
        clock.lap("write")
        return clock.seconds_of


class PathPlugin:
    """The same, without Z, by the unmodified plugin `path`. The exact direct light is subtracted from its radiance.

    With several lights, the noise from the choice of one light stays in the indirect light."""

    def __init__(self, tracer: Tracer, size_px: tuple[int, int], samples: int):
        self.tracer, self.size_px, self.samples = tracer, size_px, samples

    def render(self, path: Path, iterations: int | None = None) -> dict[str, float]:
        clock = Clock()
        images = [self.tracer.direct()[0], self.tracer.by_path_plugin(iterations or self.samples, SEED)]
        direct, radiance = to_host(images, self.size_px)
        clock.lap("render")
        write(path, direct, radiance - direct)
        clock.lap("write")
        return clock.seconds_of


class Denoised:
    """The frame of `PathTraced`, without Z, with denoised indirect light. Guides are albedo and normals at the pixel centres."""

    def __init__(self, tracer: Tracer, size_px: tuple[int, int], samples: int, denoiser: "Denoiser"):
        self.tracer, self.size_px, self.samples, self.denoiser = tracer, size_px, samples, denoiser

    def render(self, path: Path, iterations: int | None = None) -> dict[str, float]:
        clock = Clock()
        pattern = Pattern(self.samples, self.tracer.pixel_count, SEED)
        images = [*self.tracer.direct_and_features(), self.tracer.indirect(pattern, iterations or self.samples)[0]]
        direct, albedo, normal, indirect = to_host(images, self.size_px)
        clock.lap("render")
        denoised = self.denoiser.denoise(indirect, albedo, normal)
        clock.lap("denoise")
        write(path, direct, denoised)
        clock.lap("write")
        return clock.seconds_of


class Denoiser:
    """Open Image Denoise for one image size: filter `RT`, high dynamic range, in its best or its fastest quality.

    Albedo and normals have no noise. The setting `cleanAux` states this. It lowers the error in the best quality and raises it
    in the fastest: at 800 x 800 in the Cornell box with 4 samples from 4.9 to 4.1 %, and from 5.0 to 5.4 %. So only the best
    quality uses it.
    """

    def __init__(self, size_px: tuple[int, int], threads: int, fast: bool):
        width, height = size_px
        if not pyoidn.Device.is_cpu_available():
            raise Failure("Open Image Denoise does not run on this processor; it needs SSE 4.1")
        self.device = pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU)
        self.device.set_int("numThreads", threads)
        self.device.commit()
        self.filter = pyoidn.Filter(self.device, pyoidn.OIDN_FILTER_TYPE_RT)
        names = [pyoidn.OIDN_IMAGE_COLOR, pyoidn.OIDN_IMAGE_ALBEDO, pyoidn.OIDN_IMAGE_NORMAL, pyoidn.OIDN_IMAGE_OUTPUT]
        self.images = {name: np.zeros((height, width, 3), np.float32) for name in names}
        for name, image in self.images.items():
            self.filter.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
        self.filter.set_bool("hdr", True)
        self.filter.set_bool("cleanAux", not fast)
        self.filter.set_int("quality", pyoidn.OIDN_QUALITY_FAST if fast else pyoidn.OIDN_QUALITY_HIGH)
        self.filter.commit()
        self.check()

    def denoise(self, colour: np.ndarray, albedo: np.ndarray, normal: np.ndarray) -> np.ndarray:
        self.images[pyoidn.OIDN_IMAGE_COLOR][:] = colour
        self.images[pyoidn.OIDN_IMAGE_ALBEDO][:] = albedo
        self.images[pyoidn.OIDN_IMAGE_NORMAL][:] = normal
        self.filter.execute()
        self.check()
        return self.images[pyoidn.OIDN_IMAGE_OUTPUT]

    def check(self):
        problem = self.device.get_error()
        if problem is not None:
            raise Failure(f"Open Image Denoise: {problem}; try a smaller image")


def to_host(images: list, size_px: tuple[int, int]) -> list[np.ndarray]:
    """Evaluates the images together. Each has the shape height x width x 3, phasors height x width x 2."""
    width, height = size_px
    dr.eval(*images)
    return [np.ascontiguousarray(planes(image).T).reshape(height, width, -1) for image in images]


def planes(image) -> np.ndarray:
    """Channels by pixels. Splits complex numbers, which Dr.Jit would convert to numpy's complex type."""
    if dr.is_complex_v(image):
        return np.stack([np.array(dr.real(image)), np.array(dr.imag(image))])
    return np.array(image)


def phasor_layers(totals: list[np.ndarray], indirect: list[np.ndarray]) -> dict[str, np.ndarray]:
    """The channels of camlux's phasor layers, by name."""
    layers = {}
    for index, pair in enumerate(zip(totals, indirect)):
        for name, phasor in zip(("phasor", "phasor_indirect"), pair):
            for part, channel in enumerate(("re", "im")):
                layers[f"tof{index}.{name}.{channel}"] = np.ascontiguousarray(phasor[..., part])
    return layers


def write(path: Path, direct: np.ndarray, indirect: np.ndarray, more: dict[str, np.ndarray] = {}):
    # Uncompressed like camlux's files, because that is fastest.
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"direct": direct, "indirect": indirect, **more}) as file:
        file.write(str(path))
