"""Files of a batch for numpy, and its depth as PNG: what other programs read."""

import json

import camlux
import cv2
import numpy as np
import pytest
from PIL import Image

from conftest import SCENES

JOB = f"""
[job]
scene = "{SCENES / 'cornell_spot.toml'}"
frames = 2
size = [20, 16]
target_error = 0.3
"""


def batch(program, folder, name, keys):
    (folder / f"{name}.toml").write_text(JOB + keys)
    program("batch", folder / f"{name}.toml", "-o", folder / name)
    return camlux.Dataset(folder / name)


def test_numpy_reads_every_layer(program, tmp_path):
    whole = batch(program, tmp_path, "whole", "flow = true")
    for name, keys in [("npz", ""), ("packed", 'compression = "zip"\n')]:
        archives = batch(program, tmp_path, name, f'flow = true\nformat = "npz"\n{keys}')
        assert archives.about["file_format"] == "npz" and len(archives) == len(whole) == 2
        for mine, other in zip(archives, whole):
            assert mine.path.suffix == ".npz" and list(mine.path.parent.glob("*.exr")) == []
            with np.load(mine.path) as arrays:
                assert set(arrays.files) == set(other) >= {"radiance", "depth", "id.instance", "flow"}
                for layer, pixels in other.items():
                    assert arrays[layer].dtype == pixels.dtype and arrays[layer].flags["C_CONTIGUOUS"]
                    np.testing.assert_array_equal(arrays[layer], pixels, err_msg=layer)
                    np.testing.assert_array_equal(mine[layer], pixels, err_msg=layer)
            assert mine.units == other.units and mine.image.resolution_px == (20, 16)
            assert mine.points().positions_m.shape[1] == 3
            with pytest.raises(camlux.LayerError, match='no layer "colour"; it has'):
                mine["colour"]
    sizes = [sum(line["bytes"] for line in camlux.Dataset(tmp_path / name).lines) for name in ["npz", "packed"]]
    assert sizes[1] < 0.9 * sizes[0]
    # The same job again finds its files.
    before = (tmp_path / "packed/manifest.jsonl").read_bytes()
    program("batch", tmp_path / "packed.toml", "-o", tmp_path / "packed")
    assert (tmp_path / "packed/manifest.jsonl").read_bytes() == before


def test_half_precision_and_some_layers(program, tmp_path):
    whole = batch(program, tmp_path, "whole", 'layers = ["radiance", "albedo", "depth"]')
    half = batch(program, tmp_path, "half", 'layers = ["radiance", "albedo", "depth"]\nhalf = true\nformat = "npz"')
    for mine, other in zip(half, whole):
        assert {name: str(array.dtype) for name, array in mine.items()} == {"radiance": "float16", "albedo": "float16", "depth": "float32"}
        np.testing.assert_array_equal(mine["albedo"], other["albedo"].astype(np.float16))
        assert 0.1 < other["albedo"].max() <= 1


def test_depth_is_in_millimetres(program, tmp_path):
    # The second camera is so far away that 16 bits do not hold the depth of the back wall.
    scene = camlux.Scene.load(SCENES / "cornell_spot.toml")
    scene.indirect = None
    scene.camera.resolution_px = (20, 16)
    scene.save(tmp_path / "near")
    scene.camera.position_m = (0, 1, 65.3)
    scene.camera.look_at_m = (0, 1, 0)
    scene.camera.fov_y_deg = 2.5
    scene.save(tmp_path / "far")
    for name, fits in [("near", True), ("far", False)]:
        job = f'[job]\nscene = "{name}/scene.toml"\nframes = 1\nlayers = ["depth", "radiance"]\ndepth_png = true\n'
        (tmp_path / f"{name}.toml").write_text(job)
        program("batch", tmp_path / f"{name}.toml", "-o", tmp_path / f"set-{name}")
        (frame,) = camlux.Dataset(tmp_path / f"set-{name}")
        path = tmp_path / f"set-{name}" / frame.line["depth_png"]
        seen = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert seen.dtype == np.uint16 and seen.shape == (16, 20)
        np.testing.assert_array_equal(seen, np.asarray(Image.open(path)))
        depth_mm = 1e3 * frame["depth"].astype(np.float64)
        background = np.isinf(depth_mm)
        due = np.where(background, 0, np.minimum(np.rint(np.where(background, 0, depth_mm)), 65535))
        np.testing.assert_array_equal(seen, due)
        assert background.sum() < background.size and (fits or background.any())
        told = [warning for warning in frame.line["warnings"] if "16 bits of millimetres" in warning]
        count = int((np.rint(depth_mm[~background]) > 65535).sum())
        assert (count == 0) == fits and len(told) == (not fits)
        assert fits or told[0].startswith(f"{count} pixels")
        assert frame.line["bytes"] == path.stat().st_size + frame.path.stat().st_size
        # A damaged PNG is made again.
        good, manifest = path.read_bytes(), (tmp_path / f"set-{name}/manifest.jsonl").read_text()
        path.write_bytes(b"no image")
        program("batch", tmp_path / f"{name}.toml", "-o", tmp_path / f"set-{name}")
        assert path.read_bytes() == good
        assert json.loads((tmp_path / f"set-{name}/manifest.jsonl").read_text())["blake3"] == json.loads(manifest)["blake3"]
