"""Frames: arrays, units, files."""

import gc

import camlux
import cv2
import numpy as np
import pytest


def test_layers_are_arrays_with_units(renderer, scene):
    scene.sensor = camlux.Sensor((3.0, 3.0), exposure_time_s=1e-3)
    frame = renderer.render(scene)
    assert frame["radiance"].shape == (24, 32, 3) and frame["radiance"].dtype == np.float32
    assert frame["depth"].shape == (24, 32) and frame["id.instance"].dtype == np.uint32
    assert frame.units["radiance"] == "W/sr/m^2" and frame.units["energy"] == "J" and frame.units["depth"] == "m"
    assert frame.resolution_px == (32, 24)
    np.testing.assert_allclose(frame["radiance"], frame["direct"] + frame["indirect"], rtol=1e-6)
    np.testing.assert_allclose(frame["energy"], frame["radiance"] * 9e-12 * 1e-3, rtol=1e-5)
    # A frame is a mapping.
    assert dict(frame).keys() == set(frame) == set(frame.keys()) and len(frame) == len(frame.keys())
    assert [name for name, _ in frame.items()] == frame.keys()
    assert "stderr" not in frame
    with pytest.raises(KeyError, match="no layer \"stderr\"; it has radiance, direct"):
        frame["stderr"]


def test_a_frame_says_where_its_camera_and_its_points_are(renderer, scene):
    frame = renderer.render(scene)
    camera_to_world, k = frame.camera_to_world(), frame.intrinsics()
    np.testing.assert_allclose(camera_to_world[:3, 3], scene.camera.position_m)
    np.testing.assert_allclose(camera_to_world[:3, :3] @ camera_to_world[:3, :3].T, np.eye(3), atol=1e-14)
    points = frame.points()
    seen = frame["id.instance"] > 0
    np.testing.assert_array_equal(points.positions_m, frame["P"][seen])
    assert points.colors.shape == points.positions_m.shape and points.colors.dtype == np.float32
    assert 0 <= points.colors.min() and points.colors.max() == 1 and points.positions_m.dtype == np.float32
    # The points, seen by that camera, are at their pixels.
    in_camera = (np.linalg.inv(camera_to_world) @ np.c_[points.positions_m, np.ones(len(points.positions_m))].T)[:3]
    pixels = k @ (in_camera / in_camera[2])
    rows, columns = np.nonzero(seen)
    np.testing.assert_allclose(pixels[:2], [columns + 0.5, rows + 0.5], atol=1e-3)
    # A camera of these matrices sees the same.
    scene.camera = camlux.Camera.from_matrix(camera_to_world, k, frame.resolution_px)
    np.testing.assert_allclose(renderer.render(scene)["depth"], frame["depth"], rtol=1e-5)
    with pytest.raises(camlux.LayerError, match='no layer "P"'):
        renderer.render(scene, layers="radiance").points()


def test_a_frame_shows_itself(renderer, scene, tmp_path):
    frame = renderer.render(scene)
    text = repr(frame)
    assert text.startswith("<camlux.Frame 32 x 24\n") and "radiance     (24, 32, 3)  float32  W/sr/m^2" in text
    assert "id.instance  (24, 32)     uint32   1" in text
    assert "error of the indirect light: " in text and "below, with 95 % confidence: " in text
    picture = cv2.imdecode(np.frombuffer(frame._repr_png_(), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert picture.shape == (24, 32, 3)
    seen = frame["id.instance"] > 0
    np.testing.assert_array_equal(picture[seen], np.round(255 * frame.points().colors))
    html = frame._repr_html_()
    assert "data:image/png;base64," in html and "<td" in html and "W/sr/m^2" in html and "error of the indirect light" in html
    # An image file shows the same.
    frame.save(tmp_path / "frame.exr")
    image = camlux.read_exr(tmp_path / "frame.exr")
    assert image._repr_png_() == frame._repr_png_() and "error of the indirect light" in image._repr_html_()
    assert set(repr(image).rstrip(">").splitlines()[1:]) == set(repr(frame).rstrip(">").splitlines()[1:])
    assert renderer.render(scene, layers="depth")._repr_png_() is None


def test_a_file_is_the_same_kind_of_mapping(renderer, scene, tmp_path):
    scene.sensor = camlux.Sensor((10.0, 10.0), exposure_time_s=1e-3, wavelength_nm=850, quantum_efficiency=0.5)
    scene.tof = camlux.TimeOfFlight([20e6], contrasts=[0.8], band_weights=(1, 0, 0))
    frame = renderer.render(scene)
    frame.save(tmp_path / "frame.exr")
    image = camlux.read_exr(tmp_path / "frame.exr")
    assert image.units == frame.units
    for name, array in image.items():
        assert array.dtype == frame[name].dtype, name
        np.testing.assert_array_equal(array, frame[name])
    assert {name for name in image if image[name].dtype == np.uint32} == {"id.instance", "id.material", "tof0.wraps"}
    for mapping in frame, image:
        assert mapping.get("depth") is not None and mapping.get("none") is None and mapping.get("none", 3) == 3
        assert len(mapping.values()) == len(mapping)
        with pytest.raises(ValueError, match="read-only"):
            mapping["id.instance"][0, 0] = 1
    np.testing.assert_array_equal(image.points().positions_m, frame.points().positions_m)


def test_ids_have_names(renderer, scene):
    frame = renderer.render(scene)
    ids, materials = frame["id.instance"], frame["id.material"]
    assert {frame.mesh_names[i - 1] for i in np.unique(ids[ids > 0])} == {"floor", "wall"}
    assert {frame.material_names[i - 1] for i in np.unique(materials[materials > 0])} == {"white", "red"}
    # Background pixels.
    assert np.isinf(frame["depth"][ids == 0]).all() and (frame["radiance"][ids == 0] == 0).all() and (ids == 0).any()


def test_arrays_read_the_memory_of_the_frame_and_keep_it(renderer, scene):
    frame = renderer.render(scene)
    first, second = frame["radiance"], frame["radiance"]
    assert np.shares_memory(first, second)
    with pytest.raises(ValueError, match="read-only"):
        first[0, 0, 0] = 1
    before = first.copy()
    del frame, second
    gc.collect()
    # Later frames use other memory, or memory that nothing holds.
    scene.lights[0].power_w = 40
    for _ in range(3):
        brighter = renderer.render(scene)["radiance"]
    np.testing.assert_array_equal(first, before)
    np.testing.assert_allclose(brighter, 2 * first, rtol=1e-4)


def test_a_file_holds_what_the_frame_does(renderer, scene, tmp_path):
    frame = renderer.render(scene)
    frame.save(tmp_path / "all.exr", compression="zip")
    image = camlux.read_exr(tmp_path / "all.exr")
    assert set(image) == set(frame) and image.resolution_px == (32, 24)
    for name in frame:
        np.testing.assert_array_equal(image[name], frame[name].astype(np.float32))
    assert image.attributes["camlux.scene_hash"] == frame.scene_hash
    frame.save(tmp_path / "two.exr", layers=["P", "radiance"], half=True)
    assert set(camlux.read_exr(tmp_path / "two.exr")) == {"P", "radiance"}
    assert frame.save_png(tmp_path / "preview.png") > 0
    assert (tmp_path / "preview.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(camlux.FileError, match="nowhere"):
        frame.save(tmp_path / "nowhere" / "file.exr")
    with pytest.raises(ValueError, match="give one of: none, rle"):
        frame.save(tmp_path / "file.exr", compression="best")
    with pytest.raises(ValueError, match="no layer \"colour\""):
        frame.save(tmp_path / "file.exr", layers=["colour"])
    with pytest.raises(camlux.FileError, match="not an OpenEXR|OpenEXR"):
        camlux.read_exr(tmp_path / "preview.png")


def test_statistics_tell_cost_and_error(renderer, scene):
    stats = renderer.render(scene, seed=7).stats
    assert 0 < stats.estimated_error <= 0.1 and stats.stop == "target-met" and stats.estimated_error_upper > stats.estimated_error
    assert stats.ray_count > 0 and stats.vpl_count > 0 and stats.device and stats.driver
    assert stats.passes_ms["final_gather_shade"] > 0 and sum(stats.passes_ms.values()) < 2 * stats.wall_ms
    # Nothing has changed: the frame comes back.
    again = renderer.render(scene, seed=7).stats
    assert again.passes_ms == {} and again.estimated_error == stats.estimated_error
    scene.indirect = None
    stats = renderer.render(scene).stats
    assert stats.estimated_error is None and stats.stop is None and stats.ray_count == 0


def test_time_of_flight_begins_with_the_defaults_of_scene_files(renderer, scene):
    scene.sensor = camlux.Sensor((10.0, 10.0), exposure_time_s=1e-3, wavelength_nm=850, quantum_efficiency=0.5)
    scene.indirect = None
    noise = camlux.SensorNoise(1e6)
    assert (noise.full_well_e, noise.bits, noise.gain_dn_per_e) == (1e6, 12, 1.0)
    scene.tof = camlux.TimeOfFlight([20e6, 100e6], noise=noise)
    scene.validate()
    scene.tof = camlux.TimeOfFlight([20e6, 100e6])
    short = renderer.render(scene)
    scene.tof = camlux.TimeOfFlight([20e6, 100e6], [1.0, 1.0], (1.0, 0.0, 0.0))
    assert np.array_equal(short["tof1.phase0"], renderer.render(scene)["tof1.phase0"])
    scene.tof.frequencies_hz = [20]
    with pytest.raises(camlux.SceneError, match="frequency 0 is 20 Hz; give 1 kHz"):
        scene.validate()


def test_time_of_flight_has_its_layers(renderer, scene):
    scene.sensor = camlux.Sensor((10.0, 10.0), exposure_time_s=1e-3, wavelength_nm=850, quantum_efficiency=0.5)
    scene.tof = camlux.TimeOfFlight([20e6], contrasts=[0.8], band_weights=(1, 0, 0))
    scene.indirect = None
    frame = renderer.render(scene)
    assert frame["tof0.range"].shape == (24, 32) and frame.units["tof0.range"] == "m"
    seen = frame["id.instance"] > 0
    light = np.array(scene.lights[0].position_m)
    path_m = np.linalg.norm(frame["P"] - light, axis=-1) + frame["range"]
    lit = seen & (frame["direct"][..., 0] > 0)
    np.testing.assert_allclose(frame["tof0.range"][lit], path_m[lit] / 2, atol=1e-4)


def test_a_target_of_the_range(renderer, scene):
    scene.sensor = camlux.Sensor((10.0, 10.0), exposure_time_s=1e-3, wavelength_nm=850, quantum_efficiency=0.5)
    scene.tof = camlux.TimeOfFlight([20e6, 100e6])
    scene.indirect = camlux.FinalGather(0.5, target_range_error_mm=20)
    frame = renderer.render(scene)
    assert 0 < frame.stats.estimated_range_error_mm <= frame.stats.estimated_range_error_upper_mm <= 20
    assert "error of the range" in frame._repr_html_()
    scene.indirect.target_range_error_mm = None
    assert renderer.render(scene).stats.estimated_range_error_mm is None
