"""Reads a data set that `camlux batch` has written."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, SupportsIndex, overload

import numpy as np
import numpy.typing as npt

from . import _layers
from ._camlux import Image, read_exr
from ._fields import knows_its_arguments
from ._layers import Points
from .errors import LayerError, MissingFileError, UnsupportedError


class PlainFiles(Mapping[str, npt.NDArray[Any]]):
    """The layers of a frame in a file each. A file is read on the first access to its layer."""

    def __init__(self, folder: Path, files: dict[str, str]) -> None:
        self._paths = {layer: folder / file for layer, file in files.items()}
        self._images: dict[str, Image] = {}

    def _image(self, layer: str) -> Image:
        if layer not in self._paths:
            raise LayerError(f'the frame has no layer "{layer}"; it has {", ".join(self._paths)}')
        if layer not in self._images:
            self._images[layer] = read_exr(self._paths[layer])
        return self._images[layer]

    def __getitem__(self, layer: str) -> npt.NDArray[Any]:
        pixels = self._image(layer)[layer]
        # A plain file has floats, which hold whole numbers exactly.
        is_whole = layer.startswith(("id.", "flow_occlusion")) or layer.endswith(".wraps")
        return pixels.astype(np.uint32) if is_whole else pixels

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    @property
    def units(self) -> dict[str, str]:
        """The unit of each layer."""
        return {layer: self._image(layer).units[layer] for layer in self}

    @property
    def resolution_px(self) -> tuple[int, int]:
        """Width, height."""
        return self._image(next(iter(self))).resolution_px

    @property
    def attributes(self) -> dict[str, str]:
        """The header of the first file."""
        return self._image(next(iter(self))).attributes


class NpzFile(Mapping[str, npt.NDArray[Any]]):
    """The layers of a frame in an archive of numpy. An array is read on the first access to its layer."""

    def __init__(self, path: Path, units: dict[str, str]) -> None:
        self._path = path
        try:
            with np.load(path) as file:
                self._arrays: dict[str, npt.NDArray[Any] | None] = dict.fromkeys(file.files)
        except FileNotFoundError:
            raise MissingFileError(f"{path}: there is no such file; run the batch again") from None
        self._units = units

    def __getitem__(self, layer: str) -> npt.NDArray[Any]:
        if layer not in self._arrays:
            raise LayerError(f'the frame has no layer "{layer}"; it has {", ".join(self._arrays)}')
        array = self._arrays[layer]
        if array is None:
            with np.load(self._path) as file:
                array = self._arrays[layer] = file[layer]
        return array

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    @property
    def units(self) -> dict[str, str]:
        """The unit of each layer."""
        return {layer: self._units[layer] for layer in self}

    @property
    def resolution_px(self) -> tuple[int, int]:
        """Width, height."""
        height, width = self[next(iter(self))].shape[:2]
        return width, height

    @property
    def attributes(self) -> dict[str, str]:
        """Empty: an archive has no header. The manifest describes the frame."""
        return {}


class DatasetFrame(Mapping[str, npt.NDArray[Any]]):
    """One frame of a data set: a mapping from the names of its layers to arrays, like a Frame. Its file is read on the first access.

    line: its line of the manifest: docs/batch.md.
    path: its file.
    mesh_names: names for the ids of `id.instance`, from 1.
    material_names: names for the ids of `id.material`, from 1.
    """

    line: dict[str, Any]
    path: Path
    mesh_names: list[str]
    material_names: list[str]

    def __init__(self, path: Path, line: dict[str, Any], scene: dict[str, Any] | None = None) -> None:
        self.path = path
        self.line = line
        # A loop may change the lists of its scene.
        self.mesh_names = line.get("mesh_names", (scene or {}).get("meshes", []))
        self.material_names = line.get("material_names", (scene or {}).get("materials", []))
        self._units = {name: layer["unit"] for name, layer in (scene or {}).get("layers", {}).items()}
        self._image: Image | PlainFiles | NpzFile | None = None

    @property
    def image(self) -> Image | PlainFiles | NpzFile:
        """All layers of the file, or of the plain files, and the header."""
        if self._image is None:
            files = self.line.get("files")
            if files:
                self._image = PlainFiles(self.path, files)
            elif self.path.suffix == ".npz":
                self._image = NpzFile(self.path, self._units)
            else:
                self._image = read_exr(self.path)
        return self._image

    def __getitem__(self, layer: str) -> npt.NDArray[Any]:
        """The pixels of a layer, row by row from the top: (height, width) or (height, width, channels)."""
        return self.image[layer]

    def __contains__(self, layer: object) -> bool:
        return isinstance(layer, str) and layer in self.image

    def __iter__(self) -> Iterator[str]:
        return iter(self.image)

    def __len__(self) -> int:
        return len(self.image)

    # By identity, like other frames: a mapping of arrays cannot be compared by its items, because arrays have no truth value.
    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)

    @property
    def units(self) -> dict[str, str]:
        """The unit of each layer: W/sr/m^2, m, J, px, or 1 for a plain number."""
        return self.image.units

    @property
    def attributes(self) -> dict[str, str]:
        """The texts and numbers of the file's header, as text by name."""
        return self.image.attributes

    @property
    def resolution_px(self) -> tuple[int, int]:
        """Width, height."""
        width, height = self.line["camera"]["resolution_px"]
        return width, height

    def camera_to_world(self) -> npt.NDArray[np.float64]:
        """Camera to world, 4 x 4, for column vectors; camera axes x right, y down, z forward."""
        return _matrix(self.line["camera"])

    def mesh_poses(self) -> dict[int, npt.NDArray[np.float64]]:
        """Mesh to world, 4 x 4, by mesh index, for the meshes that the job moves."""
        return {mesh["index"]: _matrix(mesh) for mesh in self.line["meshes"]}

    def intrinsics(self) -> npt.NDArray[np.float64]:
        """Intrinsics, 3 x 3, pixels; the centre of the first pixel is at (0.5, 0.5).

        Raises UnsupportedError for an orthographic camera, which has none.
        """
        k = self.line["camera"]["intrinsics_px"]
        if k is None:
            raise UnsupportedError("an orthographic camera has no intrinsics: its pixels are height_m / height_px apart; use the layer P or P_camera")
        return np.array([[k["fx"], k.get("skew", 0), k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]])

    def points(self) -> Points:
        """The surface points that the pixels show, with their colours. It needs the layers P and radiance."""
        return _layers.points(self)

    def __getstate__(self) -> dict[str, Any]:
        # Another process reads the file again.
        return {**self.__dict__, "_image": None}

    def __repr__(self) -> str:
        if self._image is not None:
            return _layers.text(self)
        width, height = self.resolution_px
        return f"<camlux.DatasetFrame {width} x {height}: {self.path}, not read yet>"

    def _repr_png_(self) -> bytes | None:
        return _layers.png(self)

    def _repr_html_(self) -> str:
        return _layers.html(self)


class Dataset:
    """The frames of a data set, sorted by index. Failed frames are left out; `failed` has their manifest lines.

    It supports `len()`, indexing and slices, so that torch.utils.data.DataLoader accepts it. `transform` turns a frame into what the
    loader collates, such as lambda frame: frame["radiance"].copy(). A Dataset can be sent to other processes.

    folder: the folder of dataset.json.
    about: the contents of dataset.json: docs/batch.md.
    failed: the manifest lines of frames that failed.
    """

    folder: Path
    about: dict[str, Any]
    failed: list[dict[str, Any]]

    @knows_its_arguments
    def __init__(self, folder: str | os.PathLike[str], transform: Callable[[DatasetFrame], Any] | None = None) -> None:
        self.folder = Path(folder)
        self.transform = transform
        try:
            self.about = json.loads((self.folder / "dataset.json").read_text(encoding="utf-8"))
            manifest = (self.folder / "manifest.jsonl").read_text(encoding="utf-8")
        except FileNotFoundError as error:
            raise MissingFileError(f"{error.filename}: there is no such file; {self._hint()}") from None
        by_index: dict[int, dict[str, Any]] = {}
        for text in manifest.splitlines():
            try:
                line = json.loads(text)
            except json.JSONDecodeError:
                continue  # A killed run may have cut the line.
            by_index[line["index"]] = line
        lines = [line for _, line in sorted(by_index.items())]
        self.lines = [line for line in lines if "blake3" in line]
        self.failed = [line for line in lines if "error" in line]

    def _hint(self) -> str:
        """What to do if a file of the data set is missing."""
        shards = sorted(self.folder.glob("manifest-*-of-*.jsonl"))
        if not shards:
            return "give the folder that camlux batch has written"
        job = (getattr(self, "about", {}).get("job") or {}).get("file", "JOB.toml")
        names = ", ".join(path.name for path in shards)
        return f"the folder has the manifests of shards alone ({names}); merge them by: camlux batch {job} -o {self.folder} --merge"

    def __len__(self) -> int:
        return len(self.lines)

    @overload
    def __getitem__(self, number: SupportsIndex) -> Any: ...
    @overload
    def __getitem__(self, number: slice) -> Dataset: ...
    def __getitem__(self, number: SupportsIndex | slice) -> Any:
        """The frame, or the result of `transform`; for a slice, a data set of these frames."""
        if isinstance(number, slice):
            some = copy.copy(self)
            some.lines = self.lines[number]
            return some
        line = self.lines[number]
        scenes = {scene["file"]: scene for scene in self.about["scenes"]}
        # The paths of plain files are relative to the folder of the data set.
        frame = DatasetFrame(self.folder / line.get("file", ""), line, scenes.get(line["scene"]))
        return self.transform(frame) if self.transform else frame

    def __iter__(self) -> Iterator[Any]:
        return (self[number] for number in range(len(self)))

    def __repr__(self) -> str:
        count = self.about.get("frame_count")
        of_all = "" if count is None or count <= len(self) else f" of {count}"
        return f"<camlux.Dataset {self.folder}: {len(self)}{of_all} frames, {len(self.failed)} failed>"


def _matrix(pose: dict[str, Any]) -> npt.NDArray[np.float64]:
    x, y, z, w = pose["rotation_xyzw"]
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = pose["position_m"]
    return matrix
