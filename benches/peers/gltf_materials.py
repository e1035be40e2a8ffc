"""Measures the error of camlux's modified Phong for glTF's metallic-roughness materials.

Renders spheres under parallel light. The reference is Mitsuba's principled material. Prints the relRMSE of each image, and the relative
error of its total light.

Run this with benches/peers/run --gltf-materials, which provides Mitsuba. The mapping is MetallicRoughness::as_phong in
src/scene/gltf/material.rs.
"""

import mitsuba
import numpy as np

mitsuba.set_variant("llvm_ad_rgb")

SIZE = 200
BASE = 0.6


def phong(metallic, roughness):
    alpha = max(roughness, 0.03) ** 2
    shininess = 1.3 * (2 / alpha**2 - 2) / 4 + 0.8
    diffuse = min(0.14 + 0.36 * roughness**2, 0.4)
    lobe = 0.84 * (1 - roughness**4) ** 3.5
    f0 = 0.04 + metallic * (BASE - 0.04)
    return BASE * (1 - metallic) * 0.96 + f0 * diffuse, f0 * lobe, shininess


def normals():
    """Normals of a sphere that fills the image, seen along z."""
    x, y = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 2 - 1] * 2)
    inside = x * x + y * y < 1
    return np.stack([x[inside], y[inside], np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)], axis=1)


def local(n, direction):
    """The direction in a frame whose z axis is the normal."""
    helper = np.where(abs(n[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    s = np.cross(n, helper)
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    t = np.cross(n, s)
    return np.stack([s @ direction, t @ direction, n @ direction])


def mitsuba_radiance(n, light, metallic, roughness):
    bsdf = mitsuba.load_dict(
        {"type": "principled", "base_color": {"type": "rgb", "value": [BASE] * 3}, "metallic": metallic, "roughness": roughness, "specular": 0.5}
    )
    si = mitsuba.SurfaceInteraction3f()
    si.wi = mitsuba.Vector3f(local(n, np.array([0.0, 0, 1])))
    value = bsdf.eval(mitsuba.BSDFContext(), si, mitsuba.Vector3f(local(n, light)))
    return np.array(value)[0].reshape(-1)


def phong_radiance(n, light, metallic, roughness):
    kd, ks, s = phong(metallic, roughness)
    view = np.array([0.0, 0, 1])
    cosine = np.maximum(n @ light, 0)
    mirrored = 2 * (n @ light)[:, None] * n - light
    lobe = np.where(cosine > 0, np.maximum(mirrored @ view, 0), 0) ** s if s > 0 else (cosine > 0).astype(float)
    return (kd / np.pi + ks * (s + 2) / (2 * np.pi) * lobe) * cosine


def main():
    n = normals()
    print("metallic roughness  light at 0 / 45 / 90 degrees: relRMSE (light off)")
    for metallic in (0.0, 1.0):
        for roughness in (0.2, 0.4, 0.6, 0.8, 1.0):
            row = []
            for angle in np.radians([0, 45, 90]):
                light = np.array([np.sin(angle), 0, np.cos(angle)])
                truth = mitsuba_radiance(n, light, metallic, roughness)
                ours = phong_radiance(n, light, metallic, roughness)
                error = np.sqrt(((ours - truth) ** 2).sum() / (truth**2).sum())
                row.append(f"{error:7.1%} ({ours.sum() / truth.sum() - 1:+.1%})")
            print(f"{metallic:8.0f} {roughness:9.1f}  {'  '.join(row)}")


if __name__ == "__main__":
    main()
