"""Reads glTF files like camlux: triangles, their nodes' transforms, and metallic-roughness materials with textures."""

import json
import struct
from pathlib import Path

import numpy as np

import material
from failure import Failure, Unsupported
from obj import Group

TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
COUNTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES = 4
REPEAT, NEAREST = 10497, 9728


def read_gltf(path: Path, flat: bool) -> tuple[list[Group], dict[str, material.Material]]:
    """The groups of the file's scene, in its units, and their materials. v runs upwards, as in an OBJ."""
    file = File(path)
    groups = []
    nodes = file.json["nodes"]
    scenes = file.json.get("scenes")
    roots = scenes[file.json.get("scene", 0)]["nodes"] if scenes else range(len(nodes))
    pending = [(number, np.identity(4)) for number in reversed(roots)]
    while pending:
        number, parent = pending.pop()
        node = nodes[number]
        if node.get("extensions"):
            raise Unsupported("a node of a glTF file has a light or instances, which the peers do not know")
        transform = parent @ own_transform(node)
        pending += [(child, transform) for child in reversed(node.get("children", []))]
        if "mesh" in node:
            primitives = file.json["meshes"][node["mesh"]]["primitives"]
            groups += [file.group(primitive, transform, flat) for primitive in primitives]
    return groups, file.materials()


def own_transform(node: dict) -> np.ndarray:
    if "matrix" in node:
        return np.array(node["matrix"]).reshape(4, 4).T
    matrix = np.identity(4)
    x, y, z, w = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix[:3, :3] = rotation * node.get("scale", [1.0, 1.0, 1.0])
    matrix[:3, 3] = node.get("translation", [0.0, 0.0, 0.0])
    return matrix


class File:
    def __init__(self, path: Path):
        self.path = path
        content = self.read(path.name)
        self.chunk = b""
        if content[:4] == b"glTF":
            length = struct.unpack_from("<I", content, 12)[0]
            self.chunk = content[20 + length + 8 :]
            content = content[20 : 20 + length]
        self.json = json.loads(content)
        if self.json.get("extensionsRequired"):
            raise Unsupported("a glTF file requires extensions, which the peers do not know")

    def read(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            raise Unsupported("a glTF file has data URIs, which the peers do not know")
        try:
            return (self.path.parent / uri).read_bytes()
        except OSError as error:
            raise Failure(f"cannot read {uri} of {self.path}: {error.strerror}; check the path") from error

    def view(self, number: int) -> tuple[bytes, dict]:
        view = self.json["bufferViews"][number]
        buffer = self.json["buffers"][view["buffer"]]
        content = self.read(buffer["uri"]) if "uri" in buffer else self.chunk
        start = view.get("byteOffset", 0)
        return content[start : start + view["byteLength"]], view

    def accessor(self, number: int) -> np.ndarray:
        accessor = self.json["accessors"][number]
        content, view = self.view(accessor["bufferView"])
        element, count = np.dtype(TYPES[accessor["componentType"]]), COUNTS[accessor["type"]]
        if "sparse" in accessor or view.get("byteStride", element.itemsize * count) != element.itemsize * count:
            raise Unsupported("a glTF file has sparse or interleaved accessors, which the peers do not know")
        values = np.frombuffer(content, element, accessor["count"] * count, accessor.get("byteOffset", 0))
        largest = np.iinfo(element).max if accessor.get("normalized") else 1.0
        return values.reshape(-1, count) / largest if count > 1 else values

    def group(self, primitive: dict, transform: np.ndarray, flat: bool) -> Group:
        attributes = primitive["attributes"]
        if primitive.get("mode", TRIANGLES) != TRIANGLES or "COLOR_0" in attributes or "TANGENT" in attributes:
            raise Unsupported("a glTF file has strips, fans, colours of vertices or tangents, which the peers do not know")
        positions = self.accessor(attributes["POSITION"])
        corners = self.accessor(primitive["indices"]) if "indices" in primitive else np.arange(len(positions))
        linear = transform[:3, :3]
        group = Group(str(primitive.get("material")))
        group.positions_m = (positions @ linear.T + transform[:3, 3])[corners]
        if "NORMAL" in attributes and not flat:
            group.normals = (self.accessor(attributes["NORMAL"]) @ np.linalg.inv(linear))[corners]
        if "TEXCOORD_0" in attributes:
            group.texcoords = (self.accessor(attributes["TEXCOORD_0"]) * [1.0, -1.0] + [0.0, 1.0])[corners]
        return group

    def materials(self) -> dict[str, material.Material]:
        all_of_them = {"None": {}} | {str(number): keys for number, keys in enumerate(self.json.get("materials", []))}
        return {name: material.of_gltf(keys, self.image) for name, keys in all_of_them.items()}

    def image(self, info: dict | None) -> material.Image | None:
        if info is None:
            return None
        texture = self.json["textures"][info["index"]]
        sampler = self.json["samplers"][texture["sampler"]] if "sampler" in texture else {}
        wraps = [sampler.get(key, REPEAT) for key in ("wrapS", "wrapT")]
        if info.get("texCoord", 0) or info.get("extensions") or wraps != [REPEAT] * 2 or sampler.get("magFilter") == NEAREST:
            raise Unsupported("a texture has another set of coordinates, a transform or a sampler, which the peers do not know")
        image = self.json["images"][texture["source"]]
        return self.read(image["uri"]) if "uri" in image else self.view(image["bufferView"])[0]
