#!/usr/bin/env python3
"""Reads a data set that `camlux batch` has written. Needs numpy and OpenEXR (pip install -r requirements.txt).

    from read_dataset import Dataset
    for frame in Dataset("dataset"):
        radiance = frame.layer("radiance")    # (height, width, 3), W/sr/m^2
        depth = frame.layer("depth")          # (height, width), m; background is infinite
        pose = frame.camera_to_world()        # 4 x 4; camera axes x right, y down, z forward

As a program it reads every frame and prints what is there: read_dataset.py DATASET
"""

import json
import sys
from pathlib import Path

import numpy
import OpenEXR


class Dataset:
    """The frames of a data set, in the order of their index. Frames that failed are left out; `failed` has their lines."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.about = json.loads((self.folder / "dataset.json").read_text(encoding="utf-8"))
        lines = {}
        with open(self.folder / "manifest.jsonl", encoding="utf-8") as manifest:
            for text in manifest:
                try:
                    line = json.loads(text)
                except json.JSONDecodeError:
                    continue  # A run that was killed may have cut it.
                lines[line["index"]] = line
        self.lines = [line for _, line in sorted(lines.items()) if "file" in line]
        self.failed = [line for _, line in sorted(lines.items()) if "error" in line]
        self._layers = {scene["file"]: scene["layers"] for scene in self.about["scenes"]}

    def __len__(self):
        return len(self.lines)

    def __getitem__(self, number):
        line = self.lines[number]
        return Frame(self.folder, line, self._layers[line["scene"]])


class Frame:
    """One frame: `line` is what the manifest says of it."""

    def __init__(self, folder, line, layers):
        self.line = line
        self.path = folder / line["file"]
        self.layers = layers
        self._channels = None

    def layer(self, name):
        """The pixels of a layer, row by row from the top: (height, width) or (height, width, channels)."""
        if self._channels is None:
            with OpenEXR.File(str(self.path), separate_channels=True) as file:
                channels = file.channels()
                self._channels = {key: numpy.array(channel.pixels) for key, channel in channels.items()}
        planes = [self._channels[channel] for channel in self.layers[name]["channels"]]
        return planes[0] if len(planes) == 1 else numpy.stack(planes, axis=-1)

    def header(self):
        """The attributes of the file by their names, as docs/output.md lists them."""
        with OpenEXR.File(str(self.path), header_only=True) as file:
            return dict(file.header())

    def camera_to_world(self):
        """4 x 4, for column vectors."""
        return _matrix(self.line["camera"])

    def mesh_poses(self):
        """4 x 4 by the mesh's index, of the meshes that the job moves."""
        return {mesh["index"]: _matrix(mesh) for mesh in self.line["meshes"]}

    def intrinsics(self):
        """3 x 3, pixels; the centre of the first pixel is at (0.5, 0.5)."""
        k = self.line["camera"]["intrinsics_px"]
        return numpy.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]])


def _matrix(pose):
    x, y, z, w = pose["rotation_xyzw"]
    matrix = numpy.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = pose["position_m"]
    return matrix


def reprojection_error_px(frame):
    """How far the layer P, seen through the pose and the intrinsics, lies from the pixels' centres, at most."""
    position, depth = frame.layer("P"), frame.layer("depth")
    seen = numpy.isfinite(depth)
    if not seen.any():
        return 0.0
    world = numpy.concatenate([position[seen], numpy.ones((seen.sum(), 1))], axis=1)
    camera = (numpy.linalg.inv(frame.camera_to_world()) @ world.T)[:3]
    pixels = frame.intrinsics() @ (camera / camera[2])
    rows, columns = numpy.nonzero(seen)
    return max(abs(pixels[0] - columns - 0.5).max(), abs(pixels[1] - rows - 0.5).max())


def main():
    dataset = Dataset(sys.argv[1])
    print(f"{len(dataset)} of {dataset.about['frame_count']} frames, {len(dataset.failed)} failed")
    for frame in dataset:
        values = {name: frame.layer(name) for name in frame.layers}
        shapes = ", ".join(f"{name} {list(pixels.shape)}" for name, pixels in values.items())
        # A lens with distortion has no matrix.
        is_pinhole = frame.line["camera"]["distortion"] is None
        if is_pinhole and "P" in values and "depth" in values:
            shapes += f", pose fits to {reprojection_error_px(frame):.1e} px"
            apart = abs(frame.header()["camlux.cameraToWorld"].T - frame.camera_to_world()).max()
            shapes += f", header's pose within {apart:.0e}"
        print(f"{frame.line['index']}: {shapes}")


if __name__ == "__main__":
    main()
