"""Scenes of metallic-roughness materials for facets.py: spheres as OBJ, and textured glTF files like the sample models of Khronos."""

import json
from pathlib import Path

import mitsuba as mi
import numpy as np

ROUGHNESSES = [0.1, 0.2, 0.4, 0.7, 1.0]
METALLICS = [0.0, 0.5, 1.0]
SPHERES_SIZE_PX = (320, 200)
TEXELS = 256


def camera_and_light(position, look_at, fov_y_deg, light, power_w) -> str:
    return f"""[camera]
resolution = [100, 100]
position = {position}
look_at = {look_at}
up = [0.0, 1.0, 0.0]
fov_y_deg = {fov_y_deg}
[indirect]
estimator = "final-gather"
[[light]]
kind = "point"
position = {light}
power_w = {power_w}
"""


def spheres(folder: Path) -> Path:
    """A sphere for each roughness and metallic, named by them, none in another's shadow."""
    toml = camera_and_light([0.0, 0.0, 60.0], [0.0, 0.0, 0.0], 8.8, [30.0, 30.0, 40.0], 30000.0)
    for row, metallic in enumerate(METALLICS):
        for column, roughness in enumerate(ROUGHNESSES):
            name = f"m{10 * metallic:.0f}r{10 * roughness:.0f}"
            centre = [2.9 * (column - 2), 2.9 * (1 - row), 0.0]
            toml += f'[[mesh]]\npath = "sphere.obj"\nmaterial = "{name}"\ntranslate = {centre}\n'
            toml += f"[material.{name}]\nbase_color = [0.8, 0.5, 0.3]\nroughness = {roughness}\nmetallic = {metallic}\n"
    positions, normals, _, corners = sphere(192, 96)
    lines = [f"v {x} {y} {z}" for x, y, z in positions] + [f"vn {x} {y} {z}" for x, y, z in normals]
    lines += ["f " + " ".join(f"{i + 1}//{i + 1}" for i in triangle) for triangle in corners.reshape(-1, 3)]
    (folder / "sphere.obj").write_text("\n".join(lines))
    return written(folder / "spheres.toml", toml)


def textured(folder: Path) -> list[Path]:
    return [helmet(folder), checker(folder), grid(folder)]


def helmet(folder: Path) -> Path:
    """A dented ball with plates of metal and lacquer, rivets in a map of normals, over a floor."""
    u, v = texel_centres()
    is_metal = (np.sin(12 * np.pi * u) * np.sin(8 * np.pi * v) > 0).astype(float)
    lacquer = np.stack([0.5 + 0.2 * np.sin(6 * np.pi * u), 0.1 + 0.1 * v, 0.2 + 0 * u], axis=-1)
    colours = np.where(is_metal[..., None] > 0, [0.9, 0.7, 0.5], lacquer)
    roughness = 0.4 + 0.2 * np.sin(10 * np.pi * v) * np.cos(4 * np.pi * u)
    slopes = 0.25 * np.stack([np.sin(48 * np.pi * u), np.sin(32 * np.pi * v)])
    file = Gltf(folder, "helmet")
    plates = file.material([1.0] * 3, 1.0, 1.0, colours, (roughness, is_metal), slopes)
    file.node(sphere(160, 80, lambda u, v: 1 + np.sin(np.pi * v) ** 3 * 0.12 * np.sin(6 * np.pi * u)), plates)
    file.node(plane([-3, -1.1, 3], [6, 0, 0], [0, 0, -6]), file.material([0.7, 0.7, 0.7], 0.0, 0.8))
    return file.write(camera_and_light([0.0, 1.0, 3.6], [0.0, -0.2, 0.0], 45.0, [1.5, 2.5, 2.0], 200.0))


def checker(folder: Path) -> Path:
    """A floor and a wall of squares, half of them gold, with two balls."""
    u, v = texel_centres()
    is_gold = ((np.floor(8 * u) + np.floor(8 * v)) % 2).astype(float)
    colours = np.where(is_gold[..., None] > 0, [1.0, 0.8, 0.4], [0.1, 0.2, 0.5])
    file = Gltf(folder, "checker")
    squares = file.material([0.9] * 3, 1.0, 1.0, colours, (0.6 - 0.25 * is_gold, is_gold))
    file.node(plane([-2, 0, 2], [4, 0, 0], [0, 0, -4]), squares)
    file.node(plane([-2, 0, -2], [4, 0, 0], [0, 3, 0]), squares)
    file.node(sphere(96, 48), file.material([0.8, 0.1, 0.1], 0.0, 0.3), [-0.7, 0.6, 0.0], 0.6)
    file.node(sphere(96, 48), file.material([0.9, 0.9, 0.9], 1.0, 0.5), [0.7, 0.6, 0.3], 0.6)
    return file.write(camera_and_light([0.0, 1.6, 4.5], [0.0, 0.8, 0.0], 45.0, [0.8, 2.6, 1.8], 150.0))


def grid(folder: Path) -> Path:
    """Balls of roughness 0.2 to 1 and metallic 0 to 1, in rows before a white wall."""
    file = Gltf(folder, "grid")
    for row in range(4):
        for column in range(5):
            material = file.material([0.9, 0.6, 0.3], row / 3, 0.2 + 0.2 * column)
            file.node(sphere(48, 24), material, [1.1 * (column - 2), 0.5 + 1.1 * row, 0.0], 0.5)
    white = file.material([0.8, 0.8, 0.8], 0.0, 0.9)
    file.node(plane([-4, 0, 3], [8, 0, 0], [0, 0, -4]), white)
    file.node(plane([-4, 0, -1], [8, 0, 0], [0, 6, 0]), white)
    return file.write(camera_and_light([0.0, 2.4, 9.0], [0.0, 2.1, 0.0], 34.0, [2.0, 4.0, 4.0], 500.0))


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def texel_centres():
    """u to the right, v downwards, 0 to 1."""
    return np.meshgrid(*[(np.arange(TEXELS) + 0.5) / TEXELS] * 2)


def sphere(columns: int, rows: int, radius=lambda u, v: 1 + 0 * u):
    """Positions, normals, texture coordinates and corners. `radius` is a function of u and v, 0 to 1 from the north."""

    def point(u, v):
        sine = np.sin(np.pi * v)
        directions = [sine * np.sin(2 * np.pi * u), np.cos(np.pi * v), sine * np.cos(2 * np.pi * u)]
        return np.stack(directions, axis=-1) * radius(u, v)[..., None]

    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    # A pole has no direction in which u grows.
    inner = np.clip(v, 1e-4, 1 - 1e-4)
    step = 1e-5
    along_u, along_v = point(u + step, inner) - point(u - step, inner), point(u, inner + step) - point(u, inner - step)
    return flattened(point(u, v), np.cross(along_v, along_u), u, v)


def plane(origin, along_u, up):
    u, v = np.meshgrid([0.0, 1.0], [0.0, 1.0])
    positions = np.array(origin) + u[..., None] * np.array(along_u) + (1 - v)[..., None] * np.array(up)
    return flattened(positions, np.cross(along_u, up) + 0 * positions, u, v)


def flattened(positions, normals, u, v):
    normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    numbers = np.arange(u.size).reshape(u.shape)
    a, b, c, d = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    corners = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    positions = positions.reshape(-1, 3)
    p, q, r = (positions[corners[:, i]] for i in range(3))
    has_area = np.linalg.norm(np.cross(q - p, r - p), axis=1) > 1e-12
    return positions, normals.reshape(-1, 3), np.stack([u.ravel(), v.ravel()], axis=1), corners[has_area].ravel()


class Gltf:
    """A glTF file, its buffer and its images, that is being written."""

    def __init__(self, folder: Path, name: str):
        self.folder, self.name, self.buffer = folder, name, b""
        self.json = {"asset": {"version": "2.0"}}

    def add(self, kind: str, item: dict) -> int:
        self.json.setdefault(kind, []).append(item)
        return len(self.json[kind]) - 1

    def accessor(self, values: np.ndarray, kind: str, component: int, **more) -> int:
        view = {"buffer": 0, "byteOffset": len(self.buffer), "byteLength": values.nbytes}
        self.buffer += values.tobytes()
        accessor = {"bufferView": self.add("bufferViews", view), "componentType": component, "count": len(values), "type": kind}
        return self.add("accessors", accessor | more)

    def texture(self, values: np.ndarray) -> dict:
        uri = f"{self.name}{len(self.json.get('images', []))}.png"
        mi.Bitmap(np.round(255 * values).astype(np.uint8)).write(str(self.folder / uri))
        return {"index": self.add("textures", {"source": self.add("images", {"uri": uri})})}

    def material(self, base_color, metallic, roughness, colours=None, roughness_metallic=None, slopes=None) -> int:
        surface = {"baseColorFactor": [*base_color, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness}
        material = {"pbrMetallicRoughness": surface}
        if colours is not None:
            surface["baseColorTexture"] = self.texture(colours)
            surface["metallicRoughnessTexture"] = self.texture(np.stack([0 * roughness_metallic[0], *roughness_metallic], axis=-1))
        if slopes is not None:
            normals = np.stack([*slopes, 1 + 0 * slopes[0]], axis=-1)
            normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
            material["normalTexture"] = self.texture(0.5 + 0.5 * normals)
        return self.add("materials", material)

    def node(self, shape, material: int, translation=(0.0, 0.0, 0.0), scale=1.0):
        positions, normals, texcoords, corners = shape
        limits = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
        attributes = {
            "POSITION": self.accessor(positions.astype(np.float32), "VEC3", 5126, **limits),
            "NORMAL": self.accessor(normals.astype(np.float32), "VEC3", 5126),
            "TEXCOORD_0": self.accessor(texcoords.astype(np.float32), "VEC2", 5126),
        }
        indices = self.accessor(corners.astype(np.uint32), "SCALAR", 5125)
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        mesh = self.add("meshes", {"primitives": [primitive]})
        self.add("nodes", {"mesh": mesh, "translation": list(translation), "scale": [scale] * 3})

    def write(self, toml: str) -> Path:
        """The scene file that shows it."""
        self.json["buffers"] = [{"uri": f"{self.name}.bin", "byteLength": len(self.buffer)}]
        self.json |= {"scenes": [{"nodes": list(range(len(self.json["nodes"])))}], "scene": 0}
        (self.folder / f"{self.name}.bin").write_bytes(self.buffer)
        written(self.folder / f"{self.name}.gltf", json.dumps(self.json))
        return written(self.folder / f"{self.name}.toml", toml + f'[[mesh]]\npath = "{self.name}.gltf"\n')
