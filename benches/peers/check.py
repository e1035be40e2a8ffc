"""Compares the peers' renders with an image of the same scene, and their estimator with Mitsuba's own.

Import this after the variant is set."""

import sys
from pathlib import Path

import drjit as dr
import numpy as np
import OpenEXR

from failure import Failure
from tracer import Pattern, Tracer

BATCHES = 16
SAMPLES_A_BATCH = 256
# Tolerance for the normal's components on the same surface. Mitsuba uses float32, and the image may have 16-bit floats.
SAME_NORMAL = 2e-3
# Relative difference of direct light above which a pixel counts as different: on the other side of an edge or a shadow.
EDGE = 1e-3
# Allowed share of such pixels. Measured on the scenes of this repository at 200 x 200: 0.2 % on the knot, less elsewhere.
MOST_EDGES = 5e-3
# Limit for the mean over an image. One in 16 000 correct programs exceeds 4 standard errors.
MOST_STANDARD_ERRORS = 4.0
# camlux's default target error (relRMSE) of direct light of area lights, and of the bounce.
MOST_OF_WHOLE = 0.02


def compare(tracer: Tracer, size_px: tuple[int, int], path: Path):
    """Prints the differences to standard error.

    Compares direct light with the image's layer `direct`. Compares indirect light with the plugin `path`, and also with the
    image's layer `indirect` if it has `stderr`, the standard error of that layer. Raises Failure if they differ too much.
    """
    image = read(path, size_px)
    failures = []
    direct, _, normal = tracer.direct_and_features()
    direct, normal = host(direct), host(normal)
    same_surface = (np.abs(normal - image["N"].reshape(-1, 3)) < SAME_NORMAL).all(axis=1)
    say(f"{(~same_surface).sum()} of {same_surface.size} pixels see another surface: their centres lie on an edge")

    reference = image["direct"].reshape(-1, 3)
    lit = reference > 0
    difference = np.abs(direct - reference) / np.maximum(reference, EDGE * reference.mean())
    edges = (difference > EDGE).any(axis=1) | ~same_surface
    say(
        f"direct: relative difference median {np.median(difference[lit]):.1e}, "
        f"99 % below {np.percentile(difference[lit], 99):.1e}"
    )
    say(f"direct: {edges.sum()} of {edges.size} pixels differ by more than {EDGE}")
    if edges.mean() > MOST_EDGES:
        failures.append("direct light")

    count = BATCHES * SAMPLES_A_BATCH
    ours, ours_error = estimate(
        lambda seed: tracer.indirect(Pattern(SAMPLES_A_BATCH, tracer.pixel_count, seed), SAMPLES_A_BATCH)[0]
    )
    plugin, plugin_error = estimate(lambda seed: tracer.by_path_plugin(SAMPLES_A_BATCH, seed))
    say(
        f"indirect: {count} samples a pixel; "
        f"variance of `path` {(plugin_error**2).mean() / (ours_error**2).mean():.1f} times ours"
    )
    failures += compare_indirect(
        "`path` less direct light", ours, ours_error, plugin - direct, plugin_error, same_surface
    )
    if "stderr" in image:
        truth, truth_error = (image[name].reshape(-1, 3) for name in ("indirect", "stderr"))
        failures += compare_indirect(str(path), ours, ours_error, truth, truth_error, same_surface)
    if failures:
        raise Failure(f"not the same: {', '.join(failures)}; see the figures above")


def compare_whole(tracer: Tracer, size_px: tuple[int, int], path: Path):
    """Prints the difference between an image's layer `radiance` and the plugin `path` with Mitsuba's own emitter `area`.

    Mitsuba's area lights are visible and block light, camlux's are not. So pixels that see one do not count. Raises Failure if the
    difference is above camlux's default target error.
    """
    image = read(path, size_px)
    normal = host(tracer.direct_and_features()[2])
    same_surface = (np.abs(normal - image["N"].reshape(-1, 3)) < SAME_NORMAL).all(axis=1)
    counted = same_surface & ~np.array(tracer.sees_emitter()).astype(bool)
    say(f"{(~counted).sum()} of {counted.size} pixels lie on an edge or see a light, and do not count")
    theirs, error = (values[counted] for values in estimate(lambda seed: tracer.by_path_plugin(SAMPLES_A_BATCH, seed)))
    ours = image["radiance"].reshape(-1, 3)[counted]
    difference, noise = rms(ours - theirs) / rms(theirs), rms(error) / rms(theirs)
    without_noise = np.sqrt(max(difference**2 - noise**2, 0.0))
    say(f"radiance against `path`: relative RMS difference {difference:.4f}, of which noise {noise:.4f}")
    say(f"radiance against `path`: without the noise {without_noise:.4f}")
    say(f"radiance against `path`: mean differs by {np.round(100 * (ours.sum(axis=0) / theirs.sum(axis=0) - 1), 3)} %")
    if without_noise > MOST_OF_WHOLE:
        raise Failure("not the same: radiance; see the figures above")


def compare_indirect(name: str, a, a_error, b, b_error, pixels) -> list[str]:
    a, a_error, b, b_error = (values[pixels] for values in (a, a_error, b, b_error))
    error = np.hypot(a_error, b_error)
    counted = error > 0
    z = (a - b)[counted] / error[counted]
    # Bands share their samples, so each band is tested separately.
    standard_errors = (a - b).sum(axis=0) / np.sqrt((error**2).sum(axis=0))
    say(
        f"indirect against {name}: relative RMS difference {rms(a - b) / rms(b):.4f}, "
        f"expected from noise {rms(error) / rms(b):.4f}"
    )
    say(f"indirect against {name}: z of the pixels has mean {z.mean():+.3f}, deviation {z.std():.3f}")
    say(
        f"indirect against {name}: mean differs by {np.round(100 * (a.sum(axis=0) / b.sum(axis=0) - 1), 3)} %, "
        f"{np.round(standard_errors, 2)} standard errors"
    )
    return [f"indirect light against {name}"] if np.abs(standard_errors).max() > MOST_STANDARD_ERRORS else []


def estimate(render) -> tuple[np.ndarray, np.ndarray]:
    """Mean over batches with different seeds, and its standard error."""
    batches = np.stack([host(render(seed)) for seed in range(BATCHES)])
    return batches.mean(axis=0), batches.std(axis=0, ddof=1) / np.sqrt(BATCHES)


def host(image) -> np.ndarray:
    dr.eval(image)
    return np.array(image).T.astype(np.float64)


def read(path: Path, size_px: tuple[int, int]) -> dict[str, np.ndarray]:
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {name: channel.pixels for name, channel in file.channels().items()}
    except Exception as error:
        raise Failure(f"cannot read {path}: {error}; give an OpenEXR file with the layers `direct` and `N`") from error
    image = {}
    for layer, letters in (("radiance", "RGB"), ("direct", "RGB"), ("indirect", "RGB"), ("stderr", "RGB"), ("N", "XYZ")):
        names = [f"{layer}.{letter}" for letter in letters]
        if all(name in channels for name in names):
            image[layer] = np.stack([channels[name] for name in names], axis=-1).astype(np.float64)
    for name in ("direct", "N"):
        if name not in image or image[name].shape != (size_px[1], size_px[0], 3):
            raise Failure(
                f"{path} has no layer `{name}` of {size_px[0]} x {size_px[1]} pixels; render it with that --size"
            )
    return image


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


def say(text: str):
    print(text, file=sys.stderr)
