"""Data sets from a loop."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import camlux
import numpy as np
import pytest

from conftest import SCENES

CAMERAS = [(-0.6, 1.0, 3.2), (0.1, 1.1, 3.0), (0.6, 1.2, 2.8)]
MESHES = [(0.0, 0.05, 0.0), (0.0, 0.1, 0.0), (0.05, 0.2, 0.0)]
JOB = f"""
[job]
scene = "{SCENES / 'cornell_spot.toml'}"
size = [16, 16]
target_error = 0.2
flow = true
[camera]
poses = [{", ".join(f"{{ position = {list(at)}, look_at = [0.0, 1.0, 0.0] }}" for at in CAMERAS)}]
[[mesh]]
index = 0
poses = [{", ".join(f"{{ position = {list(at)} }}" for at in MESHES)}]
"""


def cornell():
    scene = camlux.Scene.load(SCENES / "cornell_spot.toml")
    scene.camera.resolution_px = (16, 16)
    scene.indirect = camlux.FinalGather(0.2)
    return scene


def loop(folder, scene, **options):
    """The frames of the job. Returns the indices of those that were rendered."""
    mesh, rendered = scene.meshes[0], []
    with camlux.DatasetWriter(folder, scene, flow=True, **options) as writer:
        for index, (camera, at) in enumerate(zip(CAMERAS, MESHES)):
            scene.camera.position_m, scene.camera.look_at_m = camera, (0, 1, 0)
            scene.meshes[0] = mesh.posed(at)
            if writer.render(scene) is not None:
                rendered.append(index)
    scene.meshes[0] = mesh
    return rendered


def test_a_loop_writes_the_files_of_a_batch(program, tmp_path):
    (tmp_path / "job.toml").write_text(JOB)
    program("batch", tmp_path / "job.toml", "-o", tmp_path / "batch")
    assert loop(tmp_path / "loop", cornell()) == [0, 1, 2]
    by_batch, by_loop = (camlux.Dataset(tmp_path / name) for name in ["batch", "loop"])
    assert by_loop.about["frame_count"] == len(by_loop) == len(by_batch) == 3
    for name in ["layers", "meshes", "materials", "resolution_px"]:
        assert by_loop.about["scenes"][0][name] == by_batch.about["scenes"][0][name]
    for mine, other in zip(by_loop, by_batch):
        assert mine.path.read_bytes() == other.path.read_bytes()
        for key in ["index", "frame", "camera", "lights", "meshes", "materials_kd", "file", "blake3", "bytes", "estimated_error", "stop", "device"]:
            assert mine.line[key] == other.line[key], key
    assert np.isfinite(by_loop[0]["flow"]).any() and not np.isfinite(by_loop[2]["flow"]).any()
    assert np.nanmax(np.abs(by_loop[0]["scene_flow"] - by_batch[0]["scene_flow"])) == 0


def test_a_loop_goes_on_where_it_was(tmp_path):
    scene = cornell()
    assert loop(tmp_path, scene) == [0, 1, 2]
    before = (tmp_path / "manifest.jsonl").read_bytes()
    assert loop(tmp_path, scene) == []
    assert (tmp_path / "manifest.jsonl").read_bytes() == before
    # A damaged file, a cut line and what a killed run leaves.
    (tmp_path / "frames/000001.exr").write_bytes(b"damaged")
    (tmp_path / "frames/.000001.exr.abc.part").write_bytes(b"")
    assert loop(tmp_path, scene) == [1]
    text = (tmp_path / "manifest.jsonl").read_text()
    (tmp_path / "manifest.jsonl").write_text(text[: len(text) - 40])
    assert loop(tmp_path, scene) == [2]
    lines = [json.loads(line) for line in (tmp_path / "manifest.jsonl").read_text().splitlines()]
    assert [line["index"] for line in lines] == [0, 1, 2]
    assert sorted(path.name for path in (tmp_path / "frames").iterdir()) == ["000000.exr", "000001.exr", "000002.exr"]
    # Another scene, or other settings: all frames again.
    scene.materials[0].kd = 0.123
    assert loop(tmp_path, scene) == [0, 1, 2]
    assert loop(tmp_path, scene, plain=True) == [0, 1, 2]
    dataset = camlux.Dataset(tmp_path)
    assert dataset[0].line["files"]["flow"] == "frames/000000.flow.exr" and dataset[0]["flow"].shape == (16, 16, 2)


def test_a_shorter_loop_keeps_the_later_frames(tmp_path, scene):
    def frames(folder, count, flow, kd=0.5):
        scene.materials[0].kd = kd
        with camlux.DatasetWriter(folder, scene, flow=flow) as writer:
            rendered = 0
            for index in range(count):
                scene.camera.position_m = (0.1 * index, 1, 3)
                rendered += writer.render(scene, layers=["radiance", "range", "id.instance"]) is not None
        scene.camera.position_m = (0, 1, 3)
        return rendered

    for flow in [False, True]:
        folder = tmp_path / str(flow)
        assert frames(folder, 5, flow) == 5
        before = (folder / "manifest.jsonl").read_bytes()
        with pytest.warns(camlux.CamluxWarning, match="frames 2 to 4 are of an earlier loop") as caught:
            assert frames(folder, 2, flow) == 0
        assert len(caught) == 1 and caught[0].filename == __file__
        assert (folder / "manifest.jsonl").read_bytes() == before
        assert camlux.Dataset(folder).about["frame_count"] == 5
        # Also if the scene has changed; the flow of the last frame of a loop is then unknown.
        with pytest.warns(camlux.CamluxWarning, match="frames 3 to 4"):
            assert frames(folder, 3, flow, kd=0.4) == 3
        assert [frame.line["index"] for frame in camlux.Dataset(folder)] == [0, 1, 2, 3, 4]
        with pytest.warns(camlux.CamluxWarning, match="the flow of frame 2") if flow else contextlib.nullcontext():
            assert frames(folder, 5, flow, kd=0.4) == 2


def test_layers_that_frames_will_not_have_are_refused_before_rendering(tmp_path, scene):
    for layers, options, message in [
        (["tof0.range"], {}, "a frame of this scene has no layer tof0.range; give the scene time of flight"),
        ("energy", {}, "has no layer energy; give the scene a sensor"),
        (["colour"], {}, 'there is no layer "colour"'),
    ]:
        with pytest.raises(ValueError) as caught:
            camlux.DatasetWriter(tmp_path / "set", scene, layers=layers, **options)
        assert message in str(caught.value) and isinstance(caught.value, camlux.Error)
        assert not (tmp_path / "set").exists()
    # The scene of a frame, or the options of its render.
    scene.sensor = camlux.Sensor((3, 3), 1e-3)
    with camlux.DatasetWriter(tmp_path / "set", scene, layers=["radiance", "energy"]) as writer:
        with pytest.raises(camlux.ArgumentError, match="the files of the data set need energy; add these"):
            writer.render(scene, layers="radiance")
        scene.sensor = None
        with pytest.raises(camlux.SceneError, match="no layer energy"):
            writer.render(scene)
    assert [line["index"] for line in camlux.Dataset(tmp_path / "set").failed] == [0, 1]
    assert not list((tmp_path / "set/frames").iterdir())
    with camlux.DatasetWriter(tmp_path / "flow", scene, flow=True) as writer:
        with pytest.raises(camlux.ArgumentError, match="need range, id.instance; add these"):
            writer.render(scene, layers=["radiance"])
    # Indirect light by an option of the render.
    scene.indirect = None
    with camlux.DatasetWriter(tmp_path / "indirect", scene, layers=["indirect", "flow"], flow=True) as writer:
        writer.render(scene, target_error=0.2)
    assert camlux.Dataset(tmp_path / "indirect")[0].keys() >= {"indirect", "flow"}


def test_flow_to_another_scene_is_rendered_again(tmp_path):
    def two(last):
        scene = cornell()
        with camlux.DatasetWriter(tmp_path, scene, flow=True) as writer:
            first = writer.render(scene)
            scene.camera.position_m = last
            return first is not None, writer.render(scene) is not None

    assert two((0, 1, 3)) == (True, True)
    with pytest.warns(camlux.CamluxWarning, match="the flow of frame 0 is to another scene"):
        assert two((0, 1, 2)) == (False, True)
    assert len(camlux.Dataset(tmp_path)) == 1
    assert two((0, 1, 2)) == (True, False)
    assert len(camlux.Dataset(tmp_path)) == 2


def test_errors_are_recorded_and_raised(tmp_path, scene):
    with pytest.raises(camlux.SceneError):
        with camlux.DatasetWriter(tmp_path, scene) as writer:
            writer.render(scene)
            writer.render(scene, layers=["energy"])
    dataset = camlux.Dataset(tmp_path)
    assert len(dataset) == 1 and "energy" in dataset.failed[0]["error"]
    with camlux.DatasetWriter(tmp_path, scene) as writer:
        with pytest.raises(camlux.Error, match="another run uses it"):
            camlux.DatasetWriter(tmp_path, scene)
        assert writer.render(scene) is None and writer.render(scene) is not None
    assert len(camlux.Dataset(tmp_path)) == 2


def test_a_scene_that_is_refused_keeps_its_place(tmp_path, scene):
    with camlux.DatasetWriter(tmp_path, scene) as writer:
        for kd in [0.5, 2.0, 0.6]:
            scene.materials[0].kd = kd
            if kd == 2.0:
                with pytest.raises(camlux.SceneError):
                    writer.render(scene)
            else:
                writer.render(scene)
    dataset = camlux.Dataset(tmp_path)
    assert [frame.line["index"] for frame in dataset] == [0, 2]
    assert [(line["index"], "kd" in line["error"]) for line in dataset.failed] == [(1, True)]


def test_the_manifest_has_the_lights_and_the_names_of_each_frame(tmp_path, scene):
    scene.lights = [camlux.PointLight((0, 0, 0), power_w=5, relative_to="camera")]
    with camlux.DatasetWriter(tmp_path, scene) as writer:
        writer.render(scene)
        scene.meshes.reverse()
        frames = [writer.render(scene)]
    first, second = camlux.Dataset(tmp_path)
    assert first.line["lights"][0]["position_m"] == [0, 1, 3]
    assert first.mesh_names == ["floor", "wall"] and second.mesh_names == frames[0].mesh_names == ["wall", "floor"]


def test_a_job_leaves_the_data_set_of_a_writer_alone(tmp_path, scene):
    with camlux.DatasetWriter(tmp_path / "set", scene) as writer:
        writer.render(scene)
    job = tmp_path / "job.toml"
    job.write_text(f"[job]\nscene = \"{SCENES / 'cornell_spot.toml'}\"\nsize = [16, 16]\n")
    with pytest.raises(camlux.Error, match="a loop has written; name another folder"):
        camlux.run_job(job, tmp_path / "set")
    assert len(camlux.Dataset(tmp_path / "set")) == 1


def test_a_writer_leaves_the_data_set_of_a_job_alone(program, tmp_path, scene):
    (tmp_path / "job.toml").write_text(JOB)
    program("batch", tmp_path / "job.toml", "-o", tmp_path / "batch", "--frames", "0..1")
    with pytest.raises(camlux.FileError, match="data set of the job job.toml; name another folder"):
        camlux.DatasetWriter(tmp_path / "batch", scene)
    assert len(camlux.Dataset(tmp_path / "batch")) == 1


LOOP = """
import sys
sys.path.insert(0, {tests!r})
import camlux, test_writer
scene = test_writer.cornell()
with camlux.DatasetWriter(sys.argv[1], scene) as writer:
    for index in range(40):
        scene.camera.position_m = (0.01 * index, 1, 3)
        writer.render(scene)
"""


def test_a_killed_loop_loses_the_frames_in_flight_alone(tmp_path):
    program = LOOP.format(tests=os.path.dirname(__file__))
    command = [sys.executable, "-c", program, str(tmp_path)]
    process = subprocess.Popen(command)
    manifest = tmp_path / "manifest.jsonl"
    while not (manifest.exists() and manifest.read_bytes().count(b"\n") >= 2):
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    there = len(camlux.Dataset(tmp_path))
    assert 2 <= there < 40
    before = {line["index"]: line["ms"] for line in camlux.Dataset(tmp_path).lines}
    subprocess.run(command, check=True)
    dataset = camlux.Dataset(tmp_path)
    assert len(dataset) == 40 and len({line["blake3"] for line in dataset.lines}) == 40
    assert all(dataset.lines[index]["ms"] == ms for index, ms in before.items())


def test_layers_on_request_are_those_of_a_batch(program, tmp_path):
    layers = ["radiance", "albedo", "N_camera", "scene_flow_backward", "flow_backward", "flow_occlusion", "flow_occlusion_backward"]
    job = JOB.replace("flow = true", f"layers = {json.dumps(layers)}")
    (tmp_path / "job.toml").write_text(job)
    program("batch", tmp_path / "job.toml", "-o", tmp_path / "batch")
    scene = cornell()

    def loop_of(count):
        mesh, rendered = scene.meshes[0], []
        with camlux.DatasetWriter(tmp_path / "loop", scene, layers=layers) as writer:
            for index in range(count):
                scene.camera.position_m, scene.camera.look_at_m = CAMERAS[index], (0, 1, 0)
                scene.meshes[0] = mesh.posed(MESHES[index])
                frame = writer.render(scene)
                rendered.append(frame is not None)
                # The frame has all that frames have by default, too.
                assert frame is None or {"depth", "radiance", "albedo"} <= set(frame)
        scene.meshes[0] = mesh
        return rendered

    assert loop_of(3) == [True] * 3
    assert loop_of(3) == [False] * 3
    by_batch, by_loop = (camlux.Dataset(tmp_path / name) for name in ["batch", "loop"])
    assert by_loop.about["scenes"][0]["layers"] == by_batch.about["scenes"][0]["layers"]
    assert set(by_loop[0]) == set(layers)
    for mine, other in zip(by_loop, by_batch):
        assert mine.path.read_bytes() == other.path.read_bytes()
    for name, ends in [("flow_backward", [False, True, True]), ("scene_flow_backward", [False, True, True])]:
        assert [bool(np.isfinite(frame[name]).any()) for frame in by_loop] == ends
    hidden = [frame["flow_occlusion"] for frame in by_loop]
    is_surface = np.isfinite(by_loop[2]["flow_backward"][..., 0])
    assert 0 < hidden[0].sum() < hidden[0].size and is_surface.any() and hidden[2][is_surface].min() == 1
    # Only these layers of the render: the files need more.
    with camlux.DatasetWriter(tmp_path / "few", scene, layers=layers) as writer:
        with pytest.raises(camlux.ArgumentError, match="need albedo, N_camera, range, id.instance, N; add these"):
            writer.render(scene, layers=["radiance"])


def test_archives_and_pngs_of_the_depth_are_those_of_a_batch(program, tmp_path):
    layers = ["radiance", "id.instance"]
    for options, keys in [
        ({"format": "npz"}, 'format = "npz"'),
        ({"format": "npz", "compression": "zip", "depth_png": True}, 'format = "npz"\ncompression = "zip"\ndepth_png = true'),
        ({"depth_png": True}, "depth_png = true"),
        ({"depth_png": True, "plain": True}, "depth_png = true\nplain = true"),
        ({"multipart": True}, "multipart = true"),
    ]:
        name = "-".join(options)
        (tmp_path / f"{name}.toml").write_text(JOB.replace("flow = true", f"flow = true\nlayers = {json.dumps(layers)}\n{keys}"))
        program("batch", tmp_path / f"{name}.toml", "-o", tmp_path / f"batch-{name}")
        assert loop(tmp_path / f"loop-{name}", cornell(), layers=layers, **options) == [0, 1, 2]
        assert loop(tmp_path / f"loop-{name}", cornell(), layers=layers, **options) == []
        by_batch, by_loop = (camlux.Dataset(tmp_path / f"{of}-{name}") for of in ["batch", "loop"])
        for key in ["file_format", "depth_png", "compression", "plain", "multipart"]:
            assert by_loop.about[key] == by_batch.about[key], key
        for mine, other in zip(by_loop.lines, by_batch.lines):
            for key in ["file", "files", "depth_png", "blake3", "bytes"]:
                assert mine.get(key) == other.get(key), key
        files = [sorted(path.name for path in (data.folder / "frames").iterdir()) for data in [by_loop, by_batch]]
        assert files[0] == files[1]
        for file in files[0]:
            assert (by_loop.folder / "frames" / file).read_bytes() == (by_batch.folder / "frames" / file).read_bytes()
        if options.get("depth_png"):
            # A damaged PNG is written again.
            path = by_loop.folder / by_loop.lines[1]["depth_png"]
            path.write_bytes(b"")
            assert 1 in loop(tmp_path / f"loop-{name}", cornell(), layers=layers, **options)
            assert path.read_bytes() == (by_batch.folder / by_batch.lines[1]["depth_png"]).read_bytes()
    scene = cornell()
    with camlux.DatasetWriter(tmp_path / "few", scene, layers=layers, depth_png=True) as writer:
        with pytest.raises(camlux.ArgumentError, match="need depth; add these"):
            writer.render(scene, layers=layers)
    for options, message in [
        ({"format": "png"}, 'format is "png"; give "exr" or "npz"'),
        ({"format": "npz", "plain": True}, "only OpenEXR files can be plain"),
        ({"format": "npz", "multipart": True}, "only OpenEXR files have parts"),
        ({"plain": True, "multipart": True}, "a plain file has one part"),
        ({"format": "npz", "compression": "rle"}, 'compression is "rle", in npz files'),
    ]:
        with pytest.raises(camlux.ArgumentError, match=message):
            camlux.DatasetWriter(tmp_path / "no", scene, **options)
