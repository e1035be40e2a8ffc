"""Materials of camlux: what a scene file, an MTL file or a glTF file says of a surface."""

from dataclasses import dataclass
from pathlib import Path

from failure import Unsupported

# An image file, or its content.
Image = Path | bytes

# As in camlux, smoother surfaces are as rough as this.
SMOOTHEST = 0.03


@dataclass
class Facets:
    """A metallic-roughness lobe of docs/model.md, "Microfacets". Of the texture, green multiplies `roughness`, blue `metallic`."""

    roughness: float
    metallic: float
    # R, what the surface reflects straight on where it is no metal.
    dielectric: float = 0.04
    texture: Image | None = None


@dataclass
class Material:
    """A modified Phong material; or facets, which leave ks and shininess unused. kd multiplies its texture. With facets it is the base colour."""

    kd: list[float]
    ks: list[float]
    shininess: float
    kd_texture: Image | None = None
    facets: Facets | None = None
    normal_texture: Image | None = None


def bands(value) -> list[float]:
    return [float(v) for v in (value if isinstance(value, list) else [value] * 3)]


def dielectric(ior: float, specular: float) -> float:
    return specular * ((ior - 1.0) / (ior + 1.0)) ** 2


def refuse_light_and_sides(emission, is_one_sided: bool):
    if any(value != 0.0 for value in bands(emission)):
        raise Unsupported("a material emits light, which the peers do not know")
    if is_one_sided:
        raise Unsupported("a material is one-sided, which the peers do not know")


def of_scene_file(keys: dict) -> Material:
    refuse_light_and_sides(keys.get("emission_w_sr_m2", 0.0), keys.get("one_sided", False))
    if any(key.endswith("_texture") for key in keys):
        raise Unsupported("a material of the scene file has a texture, which the peers know from MTL and glTF files alone")
    if "base_color" not in keys:
        return Material(bands(keys["kd"]), bands(keys.get("ks", 0.0)), float(keys.get("shininess", 1.0)))
    reflectance = dielectric(keys.get("ior", 1.5), keys.get("specular", 1.0))
    facets = Facets(float(keys["roughness"]), float(keys.get("metallic", 0.0)), reflectance)
    return Material(bands(keys["base_color"]), bands(0.0), 1.0, facets=facets)


def of_mtl(properties: dict) -> Material:
    for what in ("a map of normals", "cut-outs", "a map of roughness or metallic"):
        if what in properties:
            raise Unsupported(f"a material has {what}, which the peers do not know")
    refuse_light_and_sides(properties.get("Ke", 0.0), False)
    kd = properties.get("Kd", [1.0, 1.0, 1.0])
    ks = properties.get("Ks", [0.0, 0.0, 0.0])
    facets = None
    if "Pr" in properties:
        facets = Facets(max(properties["Pr"], SMOOTHEST), properties.get("Pm", 0.0))
    return Material(kd, ks, properties.get("Ns", 1.0), properties.get("map_Kd"), facets)


def of_gltf(properties: dict, image) -> Material:
    """`image` gives the content of a texture's image."""
    if properties.get("alphaMode", "OPAQUE") == "MASK":
        raise Unsupported("a material has cut-outs, which the peers do not know")
    # Seen from their fronts, one-sided surfaces are as others.
    refuse_light_and_sides(properties.get("emissiveFactor", 0.0), False)
    surface = properties.get("pbrMetallicRoughness", {})
    extensions = properties.get("extensions", {})
    ior = extensions.get("KHR_materials_ior", {}).get("ior", 1.5)
    specular = extensions.get("KHR_materials_specular", {}).get("specularFactor", 1.0)
    normals = properties.get("normalTexture", {})
    if normals.get("scale", 1.0) != 1.0:
        raise Unsupported("a map of normals has a scale, which the peers do not know")
    facets = Facets(
        max(float(surface.get("roughnessFactor", 1.0)), SMOOTHEST),
        float(surface.get("metallicFactor", 1.0)),
        dielectric(ior, specular),
        image(surface.get("metallicRoughnessTexture")),
    )
    kd = bands(surface.get("baseColorFactor", [1.0] * 4)[:3])
    return Material(kd, bands(0.0), 1.0, image(surface.get("baseColorTexture")), facets, image(normals or None))
