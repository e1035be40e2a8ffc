"""Data sets of `camlux batch`, read by camlux and, as a check, by the OpenEXR package."""

import pickle
import sys

import camlux
import numpy as np
import OpenEXR
import pytest

from conftest import SCENES

JOB = f"""
[job]
scene = "{SCENES / 'cornell.toml'}"
frames = 4
size = [16, 16]
[camera]
keyframes = [
    {{ frame = 0, position = [-0.6, 1.0, 3.2], look_at = [0.0, 1.0, 0.0] }},
    {{ frame = 3, position = [0.6, 1.2, 2.8], look_at = [0.0, 1.0, 0.0] }},
]
[[mesh]]
index = 0
poses = [
    {{ position = [0.0, 0.0, 0.0] }},
    {{ position = [0.0, 0.1, 0.0] }},
    {{ position = [0.0, 0.2, 0.0], rotation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476] }},
    {{ position = [0.0, 0.3, 0.0] }},
]
"""


@pytest.fixture
def folder(program, tmp_path):
    (tmp_path / "job.toml").write_text(JOB)
    program("batch", tmp_path / "job.toml", "-o", tmp_path / "set")
    return tmp_path / "set"


def test_frames_come_with_layers_poses_and_intrinsics(folder):
    dataset = camlux.Dataset(folder)
    assert len(dataset) == 4 and dataset.failed == [] and dataset.about["frame_count"] == 4
    for index, frame in enumerate(dataset):
        assert frame.line["index"] == index
        layers = dataset.about["scenes"][0]["layers"]
        with OpenEXR.File(str(frame.path), separate_channels=True) as file:
            channels, header = file.channels(), dict(file.header())
            for name, layer in layers.items():
                planes = [np.array(channels[channel].pixels) for channel in layer["channels"]]
                theirs = planes[0] if len(planes) == 1 else np.stack(planes, axis=-1)
                np.testing.assert_array_equal(frame[name], theirs, err_msg=name)
        np.testing.assert_allclose(header["camlux.cameraToWorld"].T, frame.camera_to_world(), atol=1e-14)
        np.testing.assert_allclose(header["camlux.mesh.0.toWorld"].T, frame.mesh_poses()[0], atol=1e-14)
        # P, projected with pose and intrinsics, is at its pixel's centre up to f32 rounding. Rounding matters most on slanted surfaces.
        seen = np.isfinite(frame["depth"])
        world = np.concatenate([frame["P"][seen], np.ones((seen.sum(), 1))], axis=1)
        camera = (np.linalg.inv(frame.camera_to_world()) @ world.T)[:3]
        pixels = frame.intrinsics() @ (camera / camera[2])
        rows, columns = np.nonzero(seen)
        assert seen.any()
        np.testing.assert_allclose(pixels[0], columns + 0.5, atol=1e-3)
        np.testing.assert_allclose(pixels[1], rows + 0.5, atol=1e-3)


def test_a_frame_of_a_data_set_is_like_a_rendered_one(folder):
    dataset = camlux.Dataset(folder)
    frame = dataset[1]
    assert "not read yet" in repr(frame) and "4 frames" in repr(dataset)
    assert frame["id.instance"].dtype == np.uint32 and frame.units["radiance"] == "W/sr/m^2"
    names = [frame.mesh_names[i - 1] for i in np.unique(frame["id.instance"]) if i > 0]
    assert names == ["cornell.obj"] and "white" in frame.material_names
    assert set(frame) == set(frame.keys()) == set(frame.image) and len(frame) == len(frame.items())
    assert frame.get("none") is None and "depth" in frame and frame.resolution_px == (16, 16)
    assert "radiance     (16, 16, 3)  float32  W/sr/m^2" in repr(frame)
    np.testing.assert_array_equal(frame.points().positions_m, frame["P"][frame["id.instance"] > 0])
    assert frame._repr_png_().startswith(b"\x89PNG") and "<table>" in frame._repr_html_()
    assert frame == frame and frame != dataset[1]
    # An index of numpy, and slices.
    np.testing.assert_array_equal(dataset[np.int64(1)]["depth"], frame["depth"])
    some = dataset[1:3]
    assert isinstance(some, camlux.Dataset) and [frame.line["index"] for frame in some] == [1, 2] and len(dataset) == 4
    with pytest.raises(TypeError, match="float"):
        dataset[1.0]
    # A frame that has been read can be sent.
    again = pickle.loads(pickle.dumps(frame))
    np.testing.assert_array_equal(again["depth"], frame["depth"])
    assert camlux.compare(frame, dataset[1]).rel_rmse == 0


def test_a_loader_of_torch_finds_what_it_needs(folder):
    dataset = camlux.Dataset(folder, transform=total)
    assert [dataset[number].shape for number in range(len(dataset))] == [(16, 16, 3)] * 4
    assert len(list(dataset)) == 4
    # torch pickles the data set to send it to other processes.
    again = pickle.loads(pickle.dumps(dataset))
    np.testing.assert_array_equal(again[-1], dataset[3])
    with pytest.raises(IndexError):
        dataset[4]
    assert "torch" not in sys.modules


def total(frame):
    return frame["radiance"].copy()


def test_frames_that_failed_and_cut_lines_are_left_out(folder):
    with open(folder / "manifest.jsonl", "a", encoding="utf-8") as manifest:
        manifest.write('{"index": 1, "error": "no memory"}\n{"index": 2, "fi')
    dataset = camlux.Dataset(folder)
    assert [frame.line["index"] for frame in dataset] == [0, 2, 3]
    assert [line["error"] for line in dataset.failed] == ["no memory"]
