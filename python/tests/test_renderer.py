"""Renderers: progress, signals, threads, devices."""

import concurrent.futures
import copy
import dataclasses
import os
import signal
import sys
import threading
import time
import warnings

import camlux
import numpy as np
import pytest

from conftest import SCENES


def cornell(size, target_error=0.02):
    scene = camlux.Scene.load(SCENES / "cornell.toml")
    scene.camera.resolution_px = (size, size)
    scene.indirect = camlux.FinalGather(target_error)
    return scene


def test_progress_rises_to_the_end(renderer, scene):
    seen = []
    renderer.render(scene, progress=seen.append)
    fractions = [progress.fraction for progress in seen]
    assert fractions == sorted(fractions) and 0 <= fractions[0] and fractions[-1] == 1
    assert {"gbuffer", "direct"} <= {progress.pass_name for progress in seen} and seen[-1].pass_name == "done"
    seen.clear()
    camlux.reference(scene, stderr=0.5, progress=seen.append)
    assert seen == sorted(seen) and seen[-1] == 1


def test_a_bar_ends_at_100_percent(renderer, scene, capsys, monkeypatch):
    renderer.render(scene, progress=True)
    assert "100%" in capsys.readouterr().err
    camlux.reference(scene, samples_per_pixel=4, progress=True)
    assert "100%" in capsys.readouterr().err
    renderer.render(scene, progress=False)
    assert capsys.readouterr().err == ""
    # A bar of work that fails does not claim to be done.
    scene.lights[0].power_w = -1
    with pytest.raises(camlux.SceneError):
        renderer.render(scene, progress=True)
    assert "100%" not in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    with pytest.raises(camlux.ArgumentError, match="pip install tqdm"):
        renderer.render(scene, progress=True)


def test_bounces_have_layers_of_their_own(renderer, scene):
    scene.indirect = camlux.FinalGather(target_error=0.1, bounces=2)
    names = ["indirect", "indirect.1", "indirect.2"]
    frame = renderer.render(scene, layers=names)
    assert sorted(frame) == names
    whole, first, second = (float(frame[name].mean()) for name in names)
    assert 0 < second < first
    assert abs(first + second - whole) < 0.1 * whole
    with pytest.raises(camlux.SceneError, match="gather 3 bounces or more"):
        renderer.render(scene, layers=["indirect.3"])


def test_cameras_of_a_list_see_what_they_see_alone(renderer, scene):
    cameras = [dataclasses.replace(scene.camera, position_m=(0.05 * i, 1, 3.2)) for i in range(3)]
    seen = []
    frames = renderer.render_cameras(scene, cameras, layers=["radiance", "depth"], target_error=0.1, frame_index=7, progress=seen.append)
    fractions = [progress.fraction for progress in seen]
    assert fractions == sorted(fractions) and fractions[-1] == 1
    assert [frame.frame_index for frame in frames] == [7, 7, 7]
    for camera, frame in zip(cameras, frames):
        alone = camlux.Renderer(renderer.device).render(dataclasses.replace(scene, camera=camera), target_error=0.1)
        assert list(frame) == ["radiance", "depth"]
        assert all(np.array_equal(frame[name], alone[name]) for name in frame)
    assert renderer.render_cameras(scene, []) == []
    cameras[1].fov_y_deg = 200
    with pytest.raises(camlux.SceneError, match="camera 1: .*fov_y_deg"):
        renderer.render_cameras(scene, cameras)
    with pytest.raises(camlux.ArgumentTypeError, match="give one"):
        renderer.render_cameras(scene, 3)
    with pytest.raises(camlux.SceneTypeError, match="camera 0"):
        renderer.render_cameras(scene, [scene])
    with pytest.raises(camlux.Cancelled):
        renderer.render_cameras(scene, cameras[:1] * 2, progress=lambda progress: False)


def test_false_cancels_and_an_exception_passes_through(renderer, scene):
    with pytest.raises(camlux.Cancelled):
        renderer.render(scene, progress=lambda progress: progress.fraction < 0.1)
    with pytest.raises(ZeroDivisionError):
        renderer.render(scene, progress=lambda progress: 1 / 0)
    with pytest.raises(camlux.Cancelled):
        camlux.reference(scene, samples_per_pixel=64, progress=lambda fraction: False)
    assert renderer.render(scene)["radiance"].max() > 0


def test_layers_that_are_wanted_come_alone(renderer, scene):
    whole = renderer.render(scene)
    frame = renderer.render(scene, layers=["depth", "radiance"])
    assert list(frame) == ["radiance", "depth"]
    assert all(np.array_equal(frame[name], whole[name]) for name in frame)
    with pytest.raises(ValueError, match='there is no layer "colour"'):
        renderer.render(scene, layers=["colour"])
    with pytest.raises(camlux.SceneError, match="no layer half_path|no layer tof0"):
        renderer.render(scene, layers=["tof0.range"])


def test_a_sensor_counts_electrons(device, scene):
    scene.indirect = None
    scene.sensor = camlux.Sensor((3, 3), 1e-3, wavelength_nm=550, quantum_efficiency=0.6, bayer="GRBG")
    renderer = camlux.Renderer(device)
    expected = renderer.render(scene)
    assert expected["raw_electrons"].shape == expected["depth"].shape and expected.units["raw_electrons"] == "e-"
    assert "raw_dn" not in expected and "electrons" not in expected
    per_joule = 0.6 * 550e-9 / (6.62607015e-34 * 299792458)
    np.testing.assert_allclose(expected["raw_electrons"][1::2, ::2], expected["energy"][1::2, ::2, 2] * per_joule, rtol=1e-6)
    scene.sensor.noise = camlux.SensorNoise(1e4, dark_e_per_s=1e5, read_noise_e=2, gain_dn_per_e=0.5, prnu=0.01)
    raw = renderer.render(scene, layers=["raw_dn"])
    assert raw.units["raw_dn"] == "DN" and (raw["raw_dn"] == np.round(raw["raw_dn"])).all()
    scene.sensor.bayer = None
    assert renderer.render(scene)["dn"].shape[-1] == 3
    scene.sensor.bayer = "RGBG"
    with pytest.raises(camlux.SceneError, match="RGGB"):
        renderer.render(scene)


def test_a_vignetting_map_is_an_array(device, scene, tmp_path):
    renderer = camlux.Renderer(device)
    scene.indirect = None
    scene.sensor = camlux.Sensor((3, 3), 1e-3)
    plain = renderer.render(scene)["energy"]
    scene.sensor.f_number = 2.0
    height, width = plain.shape[:2]
    values = np.linspace(0.0, 1.0, height * width, dtype=np.float32).reshape(height, width)
    scene.vignetting_map = values
    np.testing.assert_allclose(renderer.render(scene)["energy"], plain * values[..., None] * np.pi / 16, rtol=2e-6)
    scene.save(tmp_path / "saved")
    again = camlux.Scene.load(tmp_path / "saved" / "scene.toml")
    np.testing.assert_array_equal(again.vignetting_map, values)
    assert again.sensor.f_number == 2.0
    for wrong, words in [([1.0], "give \\(height, width\\)"), ([[0.5, -1.0]], "pixel \\(1, 0\\) is -1")]:
        scene.vignetting_map = wrong
        with pytest.raises(camlux.SceneError, match=words):
            renderer.render(scene)


def test_a_measured_vignetting_takes_the_place_of_the_cosine(device, scene):
    scene.indirect = None
    scene.sensor = camlux.Sensor((3, 3), 1e-3, f_number=2)
    renderer = camlux.Renderer(device)
    radiance = renderer.render(scene)["radiance"]
    scene.sensor.vignetting = (-0.5, 0.25, -0.125)
    energy = renderer.render(scene)["energy"]
    height, width = radiance.shape[:2]
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    square = (x**2 + y**2) * 4 / (width**2 + height**2)
    factor = 1 - 0.5 * square + 0.25 * square**2 - 0.125 * square**3
    joule = 9e-12 * 1e-3 * np.pi / 4 / 2**2
    np.testing.assert_allclose(energy, radiance * (factor * joule)[..., None], rtol=3e-6)
    for wrong, words in [(1.0, "give k1, k2 and k3, or None"), ((-2, 0, 0), "vignetting makes the factor -1.000 in pixel")]:
        scene.sensor.vignetting = wrong
        with pytest.raises(camlux.SceneError, match=words):
            renderer.render(scene)


def with_time_of_flight(scene):
    scene.indirect = None
    scene.sensor = camlux.Sensor((10, 10), exposure_time_s=1e-3, duty_cycle=0.5, wavelength_nm=850, quantum_efficiency=0.5)
    noise = camlux.SensorNoise(dark_e_per_s=0, read_noise_e=10, full_well_e=1e6, gain_dn_per_e=1, black_level_dn=0, bits=12)
    scene.tof = camlux.TimeOfFlight([20e6], [0.9], 1.0, noise=noise)
    return scene


def test_no_two_frames_of_a_loop_share_their_noise(device, scene):
    renderer, scene = camlux.Renderer(device), with_time_of_flight(scene)
    frames = [renderer.render(scene) for _ in range(3)]
    assert [frame.frame_index for frame in frames] == [0, 1, 2]
    frames.append(renderer.render(scene, frame_index=0, seed=1))
    taps = [frame["tof0.phase0"].copy() for frame in frames]
    for i, one in enumerate(taps):
        assert not any(np.array_equal(one, other) for other in taps[:i])
    for i, arguments in ((0, {"frame_index": 0}), (2, {"frame_index": 2}), (3, {"frame_index": 0, "seed": 1})):
        assert np.array_equal(renderer.render(scene, **arguments)["tof0.phase0"], taps[i])
    assert renderer.render(scene).frame_index == 3


def test_a_light_that_the_camera_leaves_behind_is_told(device, scene):
    renderer, scene = camlux.Renderer(device), with_time_of_flight(scene)
    scene.lights = [camlux.PointLight((0, 0, 0), power_w=1, relative_to="camera")]
    for relative_to, position_m in (("camera", (0, 0, 0)), (None, (0, 1.0, 3)), (None, (0.3, 1.0, 3))):
        renderer = camlux.Renderer(device)
        scene.camera.position_m = (0, 1, 3)
        scene.lights = [camlux.PointLight(position_m, power_w=1, relative_to=relative_to)]
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            for x_m in (0, 0.2, 0.4):
                scene.camera.position_m = (x_m, 1, 3)
                renderer.render(scene)
        is_left = position_m == (0, 1.0, 3)
        assert sum("light 0 was at the lens" in str(one.message) for one in told) == is_left


def test_a_job_renders_the_scene_as_it_was(renderer, scene):
    before = renderer.render(scene)["depth"]
    with concurrent.futures.ThreadPoolExecutor(1) as jobs:
        job = jobs.submit(renderer.render, copy.copy(scene))
        scene.camera = dataclasses.replace(scene.camera, position_m=(0, 1, 9))
        assert np.array_equal(job.result()["depth"], before)
    assert not np.array_equal(renderer.render(scene)["depth"], before)


def test_control_c_ends_a_render(device):
    renderer, scene = camlux.Renderer(device), cornell(400, 0.003)
    # Python ignores SIGINT if a shell started the tests in the background.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(100):
            renderer.render(scene)


def test_the_gil_is_free_during_a_render(device):
    renderer, scene = camlux.Renderer(device), cornell(128)
    done = threading.Event()

    def render():
        renderer.render(scene)
        done.set()

    thread = threading.Thread(target=render)
    thread.start()
    count = 0
    while not done.is_set():
        count += 1
        time.sleep(0.001)
    thread.join()
    # If a render held the GIL, this thread would run only between submissions.
    assert count > 20


def test_threads_render_side_by_side(device):
    scenes = [cornell(32, 0.1), cornell(48, 0.1)]
    alone = [camlux.Renderer(device).render(scene)["radiance"].copy() for scene in scenes]
    found = [None, None]

    def work(which):
        renderer = camlux.Renderer(device)
        found[which] = [renderer.render(scenes[which])["radiance"].copy() for _ in range(3)]

    threads = [threading.Thread(target=work, args=(which,)) for which in (0, 1)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    for which in (0, 1):
        for radiance in found[which]:
            np.testing.assert_array_equal(radiance, alone[which])


def test_one_renderer_takes_turns(renderer, scene):
    alone = renderer.render(scene)["radiance"].copy()
    found = []
    threads = [threading.Thread(target=lambda: found.append(renderer.render(scene)["radiance"])) for _ in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(found) == 4
    for radiance in found:
        np.testing.assert_array_equal(radiance, alone)


def test_a_target_error_and_a_seed(renderer, scene):
    scene.indirect = camlux.RsmAverage()
    first = renderer.render(scene, target_error=0.05)
    assert first.stats.estimated_error <= 0.05
    other = renderer.render(scene, target_error=0.05, seed=1)
    assert (first["indirect"] != other["indirect"]).any()
    np.testing.assert_array_equal(first["direct"], other["direct"])


def test_devices_have_names_and_are_chosen_by_them():
    infos = camlux.devices()
    usable = [info for info in infos if info.unusable is None]
    assert usable and infos[0].index == 0 and usable[0].memory_bytes > 0
    assert camlux.Device(usable[0].uuid).info.name == usable[0].name
    with pytest.raises(camlux.DeviceError, match="choose one of"):
        camlux.Device("no such device")
