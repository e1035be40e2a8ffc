"""Plain OpenEXR files, and files with a part for each layer: what other programs read."""

import os

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"

import camlux
import cv2
import numpy as np
import OpenEXR
import pytest

from conftest import SCENES


def seen_by_opencv(path):
    pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert pixels is not None and pixels.dtype == np.float32, path
    # Blue first.
    return pixels[..., ::-1] if pixels.ndim == 3 else pixels


@pytest.mark.parametrize("name", ["cornell", "tof_corner"])
def test_opencv_and_openexr_read_every_layer(renderer, tmp_path, name):
    scene = camlux.Scene.load(SCENES / f"{name}.toml")
    scene.camera.resolution_px = (24, 16)
    scene.indirect = camlux.FinalGather(0.2)
    frame = renderer.render(scene)
    frame.save(tmp_path / "x.exr", plain=True)
    assert not (tmp_path / "x.exr").exists() and len(list(tmp_path.iterdir())) == len(frame)
    for layer, pixels in frame.items():
        path = tmp_path / f"x.{layer}.exr"
        pixels = pixels.astype(np.float32)
        channels = pixels.shape[2] if pixels.ndim == 3 else 1
        theirs = seen_by_opencv(path)
        assert channels != 2 or not theirs[..., 2].any()
        np.testing.assert_array_equal(theirs[..., :2] if channels == 2 else theirs, pixels, err_msg=layer)
        with OpenEXR.File(str(path)) as file:
            assert set(file.channels()) == ({"Y"} if channels == 1 else {"RGB"})
        image = camlux.read_exr(path)
        assert list(image) == [layer] and image.attributes["camlux.layer"] == layer
        np.testing.assert_array_equal(image[layer], pixels)
    found = camlux.compare(camlux.read_exr(tmp_path / "x.radiance.exr"), frame, "radiance")
    assert found.rel_rmse == 0


def test_a_data_set_of_plain_files(program, tmp_path):
    job = f"[job]\nscene = \"{SCENES / 'cornell_spot.toml'}\"\nframes = 2\nsize = [16, 16]\ntarget_error = 0.3\nflow = true\n"
    for name, key in [("plain", "plain = true"), ("whole", "")]:
        (tmp_path / f"{name}.toml").write_text(job + key)
        program("batch", tmp_path / f"{name}.toml", "-o", tmp_path / name)
    plain, whole = (camlux.Dataset(tmp_path / name) for name in ["plain", "whole"])
    assert len(plain) == len(whole) == 2
    for mine, other in zip(plain, whole):
        assert set(mine.image) == set(other.image) >= {"radiance", "depth", "flow", "id.instance"}
        for layer in other.image:
            np.testing.assert_array_equal(mine[layer], other[layer], err_msg=layer)
        assert mine.image.resolution_px == (16, 16) and mine.image.attributes["camlux.batch.frame"] == str(mine.line["index"])
        np.testing.assert_array_equal(seen_by_opencv(plain.folder / mine.line["files"]["depth"]), other["depth"])
        with pytest.raises(KeyError, match="no layer"):
            mine["colour"]


def test_openexr_reads_every_part(renderer, tmp_path):
    scene = camlux.Scene.load(SCENES / "tof_corner.toml")
    scene.camera.resolution_px = (24, 16)
    frame = renderer.render(scene)
    frame.save(tmp_path / "x.exr", multipart=True)
    with OpenEXR.File(str(tmp_path / "x.exr")) as file:
        assert [part.name() for part in file.parts] == list(frame)
        for part, (layer, pixels) in zip(file.parts, frame.items()):
            stored = part.channels
            if set(stored) == {"RGB"}:
                theirs = stored["RGB"].pixels
            else:
                names = sorted(stored, key=["re", "im", "A", "B", "X", "Y", "Z"].index)
                theirs = np.stack([stored[name].pixels for name in names], axis=-1).reshape(pixels.shape)
            assert theirs.dtype == pixels.dtype
            np.testing.assert_array_equal(theirs, pixels, err_msg=layer)
            assert part.header["camlux.unit." + layer]
    image = camlux.read_exr(tmp_path / "x.exr")
    assert set(image) == set(frame)
    for layer, pixels in frame.items():
        np.testing.assert_array_equal(image[layer], pixels, err_msg=layer)
    # A program that looks at the first part alone sees the radiance.
    np.testing.assert_array_equal(seen_by_opencv(tmp_path / "x.exr"), frame["radiance"])
    with pytest.raises(camlux.FileError, match="a plain file has one part"):
        frame.save(tmp_path / "y.exr", multipart=True, plain=True)
