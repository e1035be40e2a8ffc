"""Reads a data set that `camlux batch` has written."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._camlux import Image, read_exr


class DatasetFrame:
    """One frame of a data set. Its file is read when the first layer is asked for."""

    #: What the manifest says of it: docs/batch.md.
    line: dict[str, Any]
    path: Path

    def __init__(self, path: Path, line: dict[str, Any]) -> None:
        self.path = path
        self.line = line
        self._image: Image | None = None

    @property
    def image(self) -> Image:
        """Every layer of the file, and its header."""
        if self._image is None:
            self._image = read_exr(self.path)
        return self._image

    def __getitem__(self, layer: str) -> npt.NDArray[np.float32]:
        """The pixels of a layer, row by row from the top: (height, width) or (height, width, channels)."""
        return self.image[layer]

    def camera_to_world(self) -> npt.NDArray[np.float64]:
        """4 x 4, for column vectors; camera axes x right, y down, z forward."""
        return _matrix(self.line["camera"])

    def mesh_poses(self) -> dict[int, npt.NDArray[np.float64]]:
        """4 x 4 by the mesh's index, of the meshes that the job moves."""
        return {mesh["index"]: _matrix(mesh) for mesh in self.line["meshes"]}

    def intrinsics(self) -> npt.NDArray[np.float64]:
        """3 x 3, pixels; the centre of the first pixel is at (0.5, 0.5)."""
        k = self.line["camera"]["intrinsics_px"]
        return np.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]])


class Dataset:
    """The frames of a data set, in the order of their index; those that failed are left out, and `failed` has their lines.

    It has what a data set of torch has, `len()` and an index, so that torch.utils.data.DataLoader takes it; `transform` makes of a
    frame what the loader is to collate, such as lambda frame: frame["radiance"].copy(). It can be sent to other processes.
    """

    folder: Path
    #: dataset.json: docs/batch.md.
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
                    continue  # A run that was killed may have cut it.
                by_index[line["index"]] = line
        lines = [line for _, line in sorted(by_index.items())]
        self.lines = [line for line in lines if "file" in line]
        self.failed = [line for line in lines if "error" in line]

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, number: int) -> Any:
        """The frame, or what `transform` makes of it."""
        line = self.lines[number]
        frame = DatasetFrame(self.folder / line["file"], line)
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
