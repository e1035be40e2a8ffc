"""Measures camlux's microfacets against Mitsuba's principled material and against glTF 2.0, appendix B.

Evaluates spheres under parallel light with the formulas of docs/model.md. Prints the relRMSE of each image, and the relative error of its
total light. Appendix B has another base: it gets what the facets leave, 1 - F(h·v). Mitsuba's has a third, which grows towards grazing
angles, and its facets hide each other independently of the two directions.

Run this with benches/peers/run --gltf-materials, which provides Mitsuba.
"""

import mitsuba
import numpy as np

mitsuba.set_variant("llvm_ad_rgb")

SIZE = 200
BASE = 0.6


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


def facets_radiance(n, light, metallic, roughness, *, base):
    """Of camlux, if base is "lambert", or of appendix B, if it is "layered"."""
    view = np.array([0.0, 0, 1])
    h = (light + view) / np.linalg.norm(light + view)
    cosine_l, cosine_v, cosine_h = (np.maximum(n @ direction, 0) for direction in (light, view, h))
    squared = roughness**4
    f0 = 0.04 + metallic * (BASE - 0.04)
    schlick = (1 - h @ view) ** 5
    d = squared / (np.pi * (cosine_h**2 * (squared - 1) + 1) ** 2)
    smith = cosine_l * np.sqrt(squared + (1 - squared) * cosine_v**2) + cosine_v * np.sqrt(squared + (1 - squared) * cosine_l**2)
    left = 0.96 * (1 - schlick) if base == "layered" else 0.96
    kd = BASE * (1 - metallic) * left
    return (kd / np.pi + d * 0.5 / np.maximum(smith, 1e-9) * (f0 + (1 - f0) * schlick)) * cosine_l


def main():
    n = normals()
    print("against     metallic roughness  light at 0 / 45 / 90 / 120 degrees: relRMSE (light off)")
    for metallic in (0.0, 1.0):
        for roughness in (0.2, 0.4, 0.6, 0.8, 1.0):
            rows = {"appendix B": [], "principled": []}
            for angle in np.radians([0, 45, 90, 120]):
                light = np.array([np.sin(angle), 0, np.cos(angle)])
                ours = facets_radiance(n, light, metallic, roughness, base="lambert")
                for name, truth in [
                    ("appendix B", facets_radiance(n, light, metallic, roughness, base="layered")),
                    ("principled", mitsuba_radiance(n, light, metallic, roughness)),
                ]:
                    error = np.sqrt(((ours - truth) ** 2).sum() / (truth**2).sum())
                    rows[name].append(f"{error:8.2%} ({ours.sum() / truth.sum() - 1:+.2%})")
            for name, row in rows.items():
                print(f"{name:10} {metallic:9.0f} {roughness:9.1f}  {'  '.join(row)}")


if __name__ == "__main__":
    main()
