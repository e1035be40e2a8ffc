"""Reads OBJ and MTL files like camlux: polygons as fans of triangles; Kd, Ks, Ke, Ns, Pr, Pm and map_Kd. Everything else is ignored."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from failure import Failure


@dataclass
class Group:
    """Triangles of one material, all with or all without normals and texture coordinates. Lists are per corner, three per triangle."""

    material: str | None
    positions_m: list = field(default_factory=list)
    texcoords: list = field(default_factory=list)
    normals: list = field(default_factory=list)


def statements(path: Path):
    """Keyword and rest of each line. A backslash at the end continues a line, except a comment."""
    try:
        text = path.read_bytes().decode("utf-8-sig", errors="replace")
    except OSError as error:
        raise Failure(f"cannot read {path}: {error.strerror}; check the path") from error
    lines = iter(text.split("\n"))
    for line in lines:
        line = line.strip()
        while line.endswith("\\") and not line.startswith("#"):
            line = line[:-1] + " " + next(lines, "").strip()
        if line and not line.startswith("#"):
            keyword, _, rest = line.partition(" ")
            yield keyword, rest.strip()


def numbers(rest: str) -> list[float]:
    return [float(word) for word in rest.split("#")[0].split()]


def read_obj(path: Path, flat: bool) -> tuple[list[Group], list[Path]]:
    """The groups of an OBJ file, in the file's units, and the paths of its material libraries."""
    positions, texcoords, normals, libraries = [], [], [], []
    groups: dict[tuple, Group] = {}
    material = None
    for keyword, rest in statements(path):
        if keyword == "v":
            positions.append(numbers(rest)[:3])
        elif keyword == "vt":
            texcoords.append((numbers(rest) + [0.0])[:2])
        elif keyword == "vn":
            normals.append(numbers(rest))
        elif keyword == "usemtl":
            material = rest
        elif keyword == "mtllib":
            whole = path.parent / rest
            libraries += [whole] if whole.exists() else [path.parent / name for name in rest.split()]
        elif keyword == "f":
            corners = [
                (
                    element(positions, parts[0]),
                    element(texcoords, parts[1]),
                    None if flat else element(normals, parts[2]),
                )
                for parts in ((word + "//").split("/") for word in rest.split("#")[0].split())
            ]
            has_texcoords = corners[0][1] is not None
            # A face with a zero normal is flat.
            has_normals = all(normal is not None and any(normal) for _, _, normal in corners)
            group = groups.setdefault((material, has_texcoords, has_normals), Group(material))
            for triangle in fan(corners, path):
                for position, texcoord, normal in triangle:
                    group.positions_m.append(position)
                    if has_texcoords:
                        group.texcoords.append(texcoord)
                    if has_normals:
                        group.normals.append(normal)
    return list(groups.values()), libraries


def element(elements: list, index: str):
    """The element with an OBJ index. Indices begin at 1; negative ones count back from the last element so far."""
    if not index:
        return None
    return elements[int(index) - 1 if int(index) > 0 else int(index)]


def fan(corners: list, path: Path):
    """The triangles of a polygon, as a fan from the first corner whose fan does not fold over. camlux uses the same diagonals."""
    if len(corners) == 3:
        return [corners]
    outline = np.array([position for position, _, _ in corners])
    for apex in range(len(corners)):
        turned = np.roll(outline, -apex, axis=0)
        doubled_areas = np.cross(turned[1:-1] - turned[0], turned[2:] - turned[0])
        whole = doubled_areas.sum(axis=0)
        if (doubled_areas @ whole >= -1e-9 * (whole @ whole)).all():
            corners = corners[apex:] + corners[:apex]
            return [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    raise Failure(
        f"{path}: a face is a concave polygon that camlux cannot split into a fan of triangles; "
        "triangulate the mesh before you export it"
    )


def read_mtl(path: Path) -> dict[str, dict]:
    """The given properties of each material: Kd, Ks, Ke, Ns, Pr, Pm, map_Kd (a path), and which maps it has that the peers do not know."""
    materials: dict[str, dict] = {}
    properties: dict = {}
    for keyword, rest in statements(path):
        if keyword == "newmtl":
            properties = materials.setdefault(rest, {})
        elif keyword in ("Kd", "Ks", "Ke"):
            values = numbers(rest)
            properties[keyword] = values * 3 if len(values) == 1 else values
        elif keyword in ("Ns", "Pr", "Pm"):
            properties[keyword] = numbers(rest)[0]
        elif keyword == "map_Kd":
            properties["map_Kd"] = path.parent / rest
        elif keyword in ("norm", "bump", "map_Bump", "map_bump"):
            properties["a map of normals"] = True
        elif keyword in ("map_Pr", "map_Pm"):
            properties["a map of roughness or metallic"] = True
        elif keyword == "map_d":
            properties["cut-outs"] = True
    return materials
