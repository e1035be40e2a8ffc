"""Compares camlux's metallic-roughness materials with Mitsuba, which gets the same BRDF (microfacets.py) or its own, `principled`.

Prints three tables: samples of the plugin against a quadrature of the formulas, spheres under a point light, and direct light and the bounce of
scenes/metals.toml and of textured glTF files. Errors are relRMSE.
"""

import argparse
import json
import subprocess
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

from peers import VARIANT, thread_count

mi.set_variant(VARIANT)
dr.set_thread_count(thread_count())

import check  # noqa: E402
import facets_scenes  # noqa: E402
import scene as scenes  # noqa: E402
import tracer  # noqa: E402
from material import Facets  # noqa: E402

SIZE_PX = (128, 128)
# Of scenes/metals.toml and of the glTF files, where maps leave nothing to interpolate and camlux gathers at each pixel.
TARGET_ERRORS = (0.02, 0.05)
SAMPLES = 1 << 22
# Of the bounce, a pixel. Batches of these with other seeds give the standard error.
SAMPLES_A_BATCH = 256
# Pixels that show a surface at a smaller n·v do not count: there, triangles and interpolated normals may face different sides.
SILHOUETTE_COSINE = 0.2
# Relative distance from the camera on the same surface.
SAME_DISTANCE = 1e-4
BASE_COLOR = [0.8, 0.5, 0.3]


def main():
    parser = argparse.ArgumentParser(prog="benches/peers/run --facets", description=__doc__)
    parser.add_argument("camlux", type=Path, help="the program, target/release/camlux")
    parser.add_argument("--output", type=Path, default=Path("out/facets"), help="folder for scenes and images (default %(default)s)")
    parser.add_argument("--batches", type=int, default=64, help=f"of {SAMPLES_A_BATCH} samples a pixel of the bounce (default %(default)s)")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)

    compare_with_quadrature()
    compare_spheres(options)
    compare_bounces(options)


def compare_with_quadrature():
    print("roughness metallic  n·v   directional reflectance by samples, and their error; per cent of R, G, B")
    for roughness in facets_scenes.ROUGHNESSES:
        for metallic in facets_scenes.METALLICS:
            for cosine in (1.0, 0.5, 0.1):
                sampled = sampled_reflectance(roughness, metallic, cosine)
                error = 100 * (sampled / quadrature(roughness, metallic, cosine) - 1)
                print(f"{roughness:9.1f} {metallic:8.1f} {cosine:4.1f}   {np.round(sampled, 4)}  {np.round(error, 3)}")


def sampled_reflectance(roughness: float, metallic: float, cosine: float) -> np.ndarray:
    facets = Facets(roughness, metallic)
    bsdf = mi.load_dict(tracer.metallic_roughness(facets, tracer.srgb(BASE_COLOR)))
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(float(np.sqrt(1 - cosine * cosine)), 0, cosine)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, SAMPLES)
    weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())[1]
    return np.array(weight, dtype=np.float64).mean(axis=1)


def quadrature(roughness: float, metallic: float, cosine: float) -> np.ndarray:
    """The integral of f·n·l over l, by the midpoint rule over h in the distribution D·n·h."""
    squared = roughness**4
    u, phi = np.meshgrid((np.arange(4000) + 0.5) / 4000, (np.arange(500) + 0.5) / 500 * np.pi)
    h_z = np.sqrt((1 - u) / (1 - u + squared * u))
    v_dot_h = np.sqrt(1 - cosine * cosine) * np.sqrt(1 - h_z * h_z) * np.cos(phi) + cosine * h_z
    l_z = 2 * v_dot_h * h_z - cosine
    smith = l_z * np.sqrt(squared + (1 - squared) * cosine**2) + cosine * np.sqrt(squared + (1 - squared) * l_z**2)
    common = np.where((l_z > 0) & (v_dot_h > 0), 2 * v_dot_h * l_z / h_z / np.where(l_z > 0, smith, 1), 0)
    base = np.array(BASE_COLOR)
    f0 = 0.04 + metallic * (base - 0.04)
    schlick = (1 - v_dot_h) ** 5
    return base * (1 - metallic) * 0.96 + f0 * (common * (1 - schlick)).mean() + (common * schlick).mean()


def compare_spheres(options):
    path = facets_scenes.spheres(options.output)
    loaded = scenes.load(path, facets_scenes.SPHERES_SIZE_PX)
    image, _ = rendered(options, path, facets_scenes.SPHERES_SIZE_PX, 0.5)
    same = tracer.Tracer(loaded)
    pixels, _ = counted(same, image, loaded)
    numbers = image["id.material"]
    ours, plugin = image["direct"], check.host(same.direct()[0])
    principled = check.host(tracer.Tracer(loaded, principled_bsdf).direct()[0])
    print("\nroughness metallic   direct light against the plugin, against principled (mean)")
    for number in np.unique(numbers[pixels]):
        sphere = pixels & (numbers == number)
        facets = loaded.materials[loaded.meshes[round(number) - 1].material].facets
        figures = f"{relative(ours, plugin, sphere):10.5%}  {relative(ours, principled, sphere):8.2%}"
        mean = ours[sphere].sum() / principled[sphere].sum() - 1
        print(f"{facets.roughness:9.1f} {facets.metallic:8.1f}   {figures} ({mean:+.2%})")


def principled_bsdf(material) -> dict:
    numbers = {"roughness": material.facets.roughness, "metallic": material.facets.metallic}
    return {"type": "principled", "base_color": tracer.srgb(material.kd), **numbers}


def compare_bounces(options):
    metals = Path(__file__).resolve().parents[2] / "scenes" / "metals.toml"
    print(f"\nscene, {SIZE_PX}, {options.batches * SAMPLES_A_BATCH} samples")
    print("scene     direct  bounce: target, estimate of camlux, measured, noise of Mitsuba, mean per band; pixels left out")
    for path in [metals, *facets_scenes.textured(options.output)]:
        loaded = scenes.load(path, SIZE_PX)
        target = TARGET_ERRORS[path != metals]
        image, estimated = rendered(options, path, SIZE_PX, target)
        render = tracer.Tracer(loaded)
        pixels, direct = counted(render, image, loaded)
        sums = np.zeros((2, *direct.shape))
        for seed in range(options.batches):
            pattern = tracer.Pattern(SAMPLES_A_BATCH, render.pixel_count, seed)
            bounce = check.host(render.indirect(pattern, SAMPLES_A_BATCH)[0])
            sums += np.stack([bounce, bounce**2])
        mean, square = sums / options.batches
        standard_error = np.sqrt(np.maximum(square - mean**2, 0) / (options.batches - 1))
        ours = image["indirect"]
        noise = check.rms(standard_error[pixels]) / check.rms(mean[pixels])
        error = np.sqrt(max(relative(ours, mean, pixels) ** 2 - noise**2, 0))
        bias = 100 * (ours[pixels].sum(axis=0) / mean[pixels].sum(axis=0) - 1)
        print(
            f"{path.stem:8} {relative(image['direct'], direct, pixels):8.4%}  {target:4.0%} {estimated:7.2%} {error:7.2%} {noise:7.2%}"
            f"  {np.round(bias, 2)} %; {(~pixels).sum()}",
            flush=True,
        )


def rendered(options, path: Path, size_px: tuple[int, int], target_error: float) -> tuple[dict, float]:
    """Layers of camlux's image, a row for each pixel, and the error of the bounce that camlux estimates."""
    exr, stats = options.output / f"{path.stem}.exr", options.output / f"{path.stem}.json"
    command = [options.camlux, "render", path, "-o", exr, "--stats", stats, "--target-error", str(target_error), "--size"]
    subprocess.run([*command, *map(str, size_px)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with check.OpenEXR.File(str(exr), separate_channels=True) as file:
        channels = {name: channel.pixels.astype(np.float64).ravel() for name, channel in file.channels().items()}
    image = {layer: np.stack([channels[f"{layer}.{band}"] for band in "RGB"], axis=1) for layer in ("direct", "indirect")}
    image["N"] = np.stack([channels[f"N.{axis}"] for axis in "XYZ"], axis=1)
    image |= {"range": channels["range.Z"], "id.material": channels["id.material"]}
    return image, json.loads(stats.read_text())["estimated_error"]


def counted(render, image: dict, loaded) -> tuple[np.ndarray, np.ndarray]:
    """The pixels in which both see the same surface, away from silhouettes, both in light or in shadow; and Mitsuba's direct light."""
    si = render.primary_hits()
    distance, cosine = np.array(si.t), np.abs(np.array(si.wi.z))
    direct, _, normal = map(check.host, render.direct_and_features())
    is_hit = np.isfinite(distance) & np.isfinite(image["range"])
    ratio = np.where(is_hit, distance, 0) / np.where(is_hit, image["range"], 1)
    is_alike = is_hit & (np.abs(ratio / np.median(ratio[is_hit]) - 1) < SAME_DISTANCE)
    if not any(material.normal_texture for material in loaded.materials.values()):
        is_alike &= (np.abs(normal - image["N"]) < check.SAME_NORMAL).all(axis=1)
    is_alike &= (image["direct"] > 0).any(axis=1) == (direct > 0).any(axis=1)
    return is_alike & (cosine > SILHOUETTE_COSINE), direct


def relative(image: np.ndarray, truth: np.ndarray, pixels: np.ndarray) -> float:
    return check.rms((image - truth)[pixels]) / check.rms(truth[pixels])


if __name__ == "__main__":
    main()
