"""Reads a camlux scene file (docs/scene.md) in the space in which Mitsuba computes.

camlux validates scenes. Here a broken scene may give a KeyError.

Mitsuba computes in float32 and offsets rays from surfaces by distances that suit scenes of size 1. So the scene is moved to
the origin and scaled by a power of two, and intensities are scaled by its square. This changes no digit of a radiance.
"""

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import material
from failure import Failure, Unsupported
from gltf import read_gltf
from material import Material, bands
from obj import Group, read_mtl, read_obj

SPEED_OF_LIGHT_M_S = 299_792_458.0


@dataclass
class Mesh:
    """Triangles of one material, in local units. Every three corners are a triangle; triangles share no corners."""

    material: str
    positions: np.ndarray
    texcoords: np.ndarray | None
    normals: np.ndarray | None


@dataclass
class Light:
    """`emission`: I (point) or I_0 (spot), W/sr times the square of the local scale; E_L (directional), W/m²; the radiance of an area, W/sr/m²."""

    kind: str
    emission: np.ndarray
    position: np.ndarray | None = None
    direction: np.ndarray | None = None
    inner_rad: float = 0.0
    outer_rad: float = 0.0
    # Vectors from the centre of an area to the middles of two edges, or to two points of a disc's rim.
    half_axes: np.ndarray | None = None
    is_disc: bool = False
    # For a projector. Its `emission` is its power times the square of the local scale.
    image: Path | None = None
    up: np.ndarray | None = None
    fov_y_deg: float = 0.0


@dataclass
class TimeOfFlight:
    """Modulation frequencies in turns per local unit of path length, and the pixels' weight of each band."""

    turns_per_unit: list[float]
    band_weights: list[float]


@dataclass
class Scene:
    size_px: tuple[int, int]
    camera_position: np.ndarray
    # Unit vectors through the pixels' centres, row by row from the top: height · width, 3.
    ray_directions: np.ndarray
    lights: list[Light]
    meshes: list[Mesh]
    materials: dict[str, Material] = field(default_factory=dict)
    tof: TimeOfFlight | None = None
    # Most surfaces that reflect light before what the camera sees.
    bounces: int = 1

    def has_area_light(self) -> bool:
        return any(light.kind == "area" for light in self.lights)


def load(path: Path, size_px: tuple[int, int]) -> Scene:
    """Loads the scene at this image size. The field of view stays the same, as with `camlux render --size`."""
    try:
        with path.open("rb") as file:
            toml = tomllib.load(file)
    except OSError as error:
        raise Failure(f"cannot read {path}: {error.strerror}; check the path") from error
    except tomllib.TOMLDecodeError as error:
        raise Failure(f"{path} is not TOML: {error}; camlux render says more") from error

    if {"distortion", "fisheye", "projection"} & set(toml["camera"]):
        raise Unsupported("the camera has a lens with distortion or another projection, which the peers do not know")
    if "path" in toml["camera"] or "light" not in toml:
        raise Unsupported("the camera or the lights are those of another file, which the peers do not know")
    if not toml["camera"].keys().isdisjoint({"camera_matrix", "camera_to_world", "world_to_camera"}):
        raise Unsupported("the camera is given by matrices, which the peers do not know")
    if toml["camera"].get("samples", 1) != 1:
        raise Unsupported("the camera averages over the pixels, which the peers do not")
    for keys in toml["light"]:
        if keys["kind"] == "pattern" or "relative_to" in keys:
            raise Unsupported("a light is measured, or relative to what carries it, which the peers do not know")
        if "intrinsics_px" in keys or "encoding" in keys or str(keys.get("image", "")).endswith(".exr"):
            raise Unsupported("a projector has intrinsics, or values that are not sRGB, which the peers do not know")
    scene = Scene(size_px, vector(toml["camera"]["position"]), ray_directions(toml["camera"], size_px), [], [])
    for name, keys in toml.get("material", {}).items():
        scene.materials[name] = material.of_scene_file(keys)
    for number, keys in enumerate(toml["mesh"]):
        add_mesh(scene, path.parent, keys, f"mesh {number}")
    scene.lights = [light(keys, path.parent) for keys in toml["light"]]
    if "indirect" not in toml:
        raise Unsupported("the scene has no [indirect]: there is no indirect light to compare")
    scene.bounces = toml["indirect"].get("bounces", 1)
    if "tof" in toml:
        scene.tof = time_of_flight(toml)
    move_to_local_space(scene)
    return scene


def time_of_flight(toml: dict) -> TimeOfFlight:
    """The time-of-flight settings, with lengths in metres until the scene is scaled."""
    if any(not light.get("modulated", True) for light in toml["light"]):
        raise Unsupported("a light of the scene is not modulated: the peers' phasors know no ambient light")
    band = toml["tof"]["band"]
    weights = [float(band == name) for name in "RGB"] if isinstance(band, str) else bands(band)
    return TimeOfFlight([1e6 * mhz / SPEED_OF_LIGHT_M_S for mhz in toml["tof"]["frequencies_mhz"]], weights)


def vector(value) -> np.ndarray:
    return np.array(value, dtype=np.float64)


def unit(value) -> np.ndarray:
    value = vector(value)
    return value / np.linalg.norm(value)


def ray_directions(camera: dict, size_px: tuple[int, int]) -> np.ndarray:
    width, height = size_px
    if "intrinsics_px" in camera:
        lens = camera["intrinsics_px"]
        scale_x, scale_y = width / camera["resolution"][0], height / camera["resolution"][1]
        fx, cx = lens["fx"] * scale_x, lens["cx"] * scale_x
        fy, cy = lens["fy"] * scale_y, lens["cy"] * scale_y
        skew = lens.get("skew", 0) * scale_x
    else:
        length, angle = (width, "fov_x_deg") if "fov_x_deg" in camera else (height, "fov_y_deg")
        fx = fy = 0.5 * length / math.tan(0.5 * math.radians(camera[angle]))
        cx, cy, skew = 0.5 * width, 0.5 * height, 0
    forward = unit(vector(camera["look_at"]) - vector(camera["position"]))
    right = unit(np.cross(forward, vector(camera["up"])))
    down = np.cross(forward, right)
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    y = (y - cy) / fy
    rays = forward + ((x - cx - skew * y) / fx)[..., None] * right + y[..., None] * down
    return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)


def light(keys: dict, folder: Path) -> Light:
    if keys["kind"] == "directional":
        return Light("directional", vector(bands(keys["irradiance_w_m2"])), direction=unit(keys["direction"]))
    power_w, position = vector(bands(keys["power_w"])), vector(keys["position"])
    if keys["kind"] == "area":
        return area_light(keys, power_w, position)
    if keys["kind"] == "projector":
        aim = {"direction": unit(keys["direction"]), "up": vector(keys["up"]), "fov_y_deg": keys["fov_y_deg"]}
        return Light("projector", power_w, position, image=folder / keys["image"], **aim)
    if keys["kind"] == "point":
        return Light("point", power_w / (4.0 * math.pi), position)
    inner_rad = math.radians(keys["inner_half_angle_deg"])
    outer_rad = math.radians(keys["outer_half_angle_deg"])
    intensity = power_w / (2.0 * math.pi * falloff_integral(inner_rad, outer_rad))
    return Light("spot", intensity, position, unit(keys["direction"]), inner_rad, outer_rad)


def area_light(keys: dict, power_w: np.ndarray, position: np.ndarray) -> Light:
    direction = unit(keys["direction"])
    up = vector(keys.get("up", [1.0, 0.0, 0.0] if abs(direction[0]) < 0.7 else [0.0, 1.0, 0.0]))
    up = unit(up - direction * (up @ direction))
    is_disc = "radius" in keys
    width, height = [2 * keys["radius"]] * 2 if is_disc else keys["size"]
    area_m2 = width * height * (math.pi / 4 if is_disc else 1.0)
    half_axes = np.array([0.5 * width * np.cross(up, direction), 0.5 * height * up])
    return Light("area", power_w / (math.pi * area_m2), position, direction, half_axes=half_axes, is_disc=is_disc)


def falloff_integral(inner_rad: float, outer_rad: float) -> float:
    """∫ s(θ)·sin θ dθ over a spot light's cone, by Gauss-Legendre quadrature, exact up to rounding."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    width_rad = outer_rad - inner_rad
    t = 0.5 * (nodes + 1.0)
    ramp = 0.5 * width_rad * np.sum(weights * np.cos(0.5 * math.pi * t) * np.sin(inner_rad + width_rad * t))
    return 2.0 * math.sin(0.5 * inner_rad) ** 2 + ramp


def add_mesh(scene: Scene, folder: Path, keys: dict, prefix: str):
    path, flat = folder / keys["path"], keys.get("flat", False)
    library = {}
    if path.suffix in (".gltf", ".glb"):
        groups, library = read_gltf(path, flat)
    else:
        groups, libraries = read_obj(path, flat)
        if "material" not in keys:
            for mtl in libraries:
                library |= {name: material.of_mtl(properties) for name, properties in read_mtl(mtl).items()}
    rotation = rotation_matrix(keys.get("rotate_deg", [0.0, 0.0, 0.0]))
    translation_m = vector(keys.get("translate", [0.0, 0.0, 0.0]))
    for group in groups:
        name = keys.get("material")
        if name is None:
            name = f"{prefix}: {group.material}"
            if group.material not in library:
                raise Failure(f"{keys['path']}: material {group.material} is in no MTL file; camlux render says more")
            scene.materials[name] = library[group.material]
        scene.meshes.append(transformed(group, name, float(keys.get("scale", 1.0)), rotation, translation_m))


def transformed(group: Group, material: str, scale: float, rotation: np.ndarray, translation_m: np.ndarray) -> Mesh:
    normals = None
    if len(group.normals):
        normals = vector(group.normals) @ rotation.T
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    texcoords = vector(group.texcoords) if len(group.texcoords) else None
    return Mesh(material, scale * vector(group.positions_m) @ rotation.T + translation_m, texcoords, normals)


def rotation_matrix(rotate_deg: list[float]) -> np.ndarray:
    """Rotation about x first, then y, then z."""
    matrix = np.identity(3)
    for axis, angle_deg in enumerate(rotate_deg):
        cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.identity(3)
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = cosine, -sine, sine, cosine
        matrix = turn @ matrix
    return matrix


def move_to_local_space(scene: Scene):
    corners = np.concatenate([mesh.positions for mesh in scene.meshes])
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre = 0.5 * (low + high)
    scale = 2.0 ** -round(math.log2(0.5 * np.linalg.norm(high - low)))
    for mesh in scene.meshes:
        mesh.positions = scale * (mesh.positions - centre)
    scene.camera_position = scale * (scene.camera_position - centre)
    for source in scene.lights:
        if source.position is not None:
            source.position = scale * (source.position - centre)
            if source.half_axes is None:
                source.emission = source.emission * scale**2
            else:
                source.half_axes = scale * source.half_axes
    if scene.tof is not None:
        scene.tof.turns_per_unit = [turns / scale for turns in scene.tof.turns_per_unit]
