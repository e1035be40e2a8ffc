"""Frames: arrays, units, files."""

import gc

import camlux
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
    stats = renderer.render(scene).stats
    assert 0 < stats.estimated_error <= 0.1 and stats.stop == "target-met" and stats.estimated_error_upper > stats.estimated_error
    assert stats.ray_count > 0 and stats.vpl_count > 0 and stats.device and stats.driver
    assert stats.passes_ms["final_gather"] > 0 and sum(stats.passes_ms.values()) < 2 * stats.wall_ms
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
