"""Reads a data set that `camlux batch` has written."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._camlux import Image, read_exr


class PlainFiles(Mapping[str, npt.NDArray[np.float32]]):
    """The layers of a frame in a file each. A file is read on the first access to its layer."""

    def __init__(self, folder: Path, files: dict[str, str]) -> None:
        self._paths = {layer: folder / file for layer, file in files.items()}
        self._images: dict[str, Image] = {}

    def _image(self, layer: str) -> Image:
        if layer not in self._paths:
            raise KeyError(f'the frame has no layer "{layer}"; it has {", ".join(self._paths)}')
        if layer not in self._images:
            self._images[layer] = read_exr(self._paths[layer])
        return self._images[layer]

    def __getitem__(self, layer: str) -> npt.NDArray[np.float32]:
        return self._image(layer)[layer]

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    @property
    def resolution_px(self) -> tuple[int, int]:
        """Width, height."""
        return self._image(next(iter(self))).resolution_px

    @property
    def attributes(self) -> dict[str, str]:
        """The header of the first file."""
        return self._image(next(iter(self))).attributes


class DatasetFrame:
    """One frame of a data set. Its file is read on the first access to a layer."""

    #: The frame's line in the manifest: docs/batch.md.
    line: dict[str, Any]
    path: Path

    def __init__(self, path: Path, line: dict[str, Any]) -> None:
        self.path = path
        self.line = line
        self._image: Image | PlainFiles | None = None

    @property
    def image(self) -> Image | PlainFiles:
        """All layers of the file, or of the plain files, and the header."""
        if self._image is None:
            files = self.line.get("files")
            self._image = PlainFiles(self.path, files) if files else read_exr(self.path)
        return self._image

    def __getitem__(self, layer: str) -> npt.NDArray[np.float32]:
        """The pixels of a layer, row by row from the top: (height, width) or (height, width, channels)."""
        return self.image[layer]

    def camera_to_world(self) -> npt.NDArray[np.float64]:
        """Camera to world, 4 x 4, for column vectors; camera axes x right, y down, z forward."""
        return _matrix(self.line["camera"])

    def mesh_poses(self) -> dict[int, npt.NDArray[np.float64]]:
        """Mesh to world, 4 x 4, by mesh index, for the meshes that the job moves."""
        return {mesh["index"]: _matrix(mesh) for mesh in self.line["meshes"]}

    def intrinsics(self) -> npt.NDArray[np.float64]:
        """Intrinsics, 3 x 3, pixels; the centre of the first pixel is at (0.5, 0.5)."""
        k = self.line["camera"]["intrinsics_px"]
        return np.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]])


class Dataset:
    """The frames of a data set, sorted by index. Failed frames are left out; `failed` has their manifest lines.

    It supports `len()` and indexing, so that torch.utils.data.DataLoader accepts it. `transform` turns a frame into what the loader
    collates, such as lambda frame: frame["radiance"].copy(). A Dataset can be sent to other processes.
    """

    folder: Path
    #: The contents of dataset.json: docs/batch.md.
    about: dict[str, Any]
    failed: list[dict[str, Any]]

    def __init__(self, folder: str | os.PathLike[str], transform: Callable[[DatasetFrame], Any] | None = None) -> None:
        self.folder = Path(folder)
        self.transform = transform
        self.about = json.loads((self.folder / "dataset.json").read_text(encoding="utf-8"))
        by_index: dict[int, dict[str, Any]] = {}
        with open(self.folder / "manifest.jsonl", encoding="utf-8") as manifest:
            for text in manifest:
                try:
                    line = json.loads(text)
                except json.JSONDecodeError:
                    continue  # A killed run may have cut the line.
                by_index[line["index"]] = line
        lines = [line for _, line in sorted(by_index.items())]
        self.lines = [line for line in lines if "blake3" in line]
        self.failed = [line for line in lines if "error" in line]

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, number: int) -> Any:
        """The frame, or the result of `transform`."""
        line = self.lines[number]
        # The paths of plain files are relative to the folder of the data set.
        frame = DatasetFrame(self.folder / line.get("file", ""), line)
        return self.transform(frame) if self.transform else frame

    def __iter__(self) -> Iterator[Any]:
        return (self[number] for number in range(len(self)))


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
