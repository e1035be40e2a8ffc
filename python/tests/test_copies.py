"""Copies, pickles, comparisons, and what happens after a fork."""

import copy
import dataclasses
import multiprocessing
import os
import pickle
import subprocess
import sys

import camlux
import numpy as np
import pytest

from conftest import SCENES


def everything(scene):
    """A scene with a part of every class."""
    floor = scene.meshes[0]
    texcoords = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    scene.meshes[0] = camlux.Mesh(
        "floor", floor.positions_m, floor.triangles, normals=np.full((4, 3), (0, 1, 0)), texcoords=texcoords, texcoords_1=texcoords / 3,
        colors=np.full((4, 3), 0.7), tangents=np.full((4, 4), (1.0, 0.0, 0.0, -1.0)),
    )  # fmt: skip
    scene.meshes += [scene.meshes[0].posed((0.1 * i, 0, 0), (0, np.sin(0.1), 0, np.cos(0.1))) for i in range(3)]
    rng = np.random.default_rng(1)
    for name, pixels in [("kd", rng.integers(0, 255, (2, 3, 3), np.uint8)), ("ks", rng.integers(0, 65535, (2, 3), np.uint16)), ("alpha", rng.random((2, 3)))]:
        texture = camlux.Texture(name, pixels, encoding=None if name == "alpha" else "linear")
        setattr(scene.materials[0], f"{name}_texture", camlux.TextureLookup(texture, wrap=("mirror", "clamp")))
    leaf = camlux.Texture("leaf", rng.integers(0, 255, (2, 3, 4), np.uint8))
    scene.materials[1].kd_texture = scene.materials[1].alpha_texture = scene.materials[1].normal_texture = leaf
    scene.materials[1].ks_texture = camlux.Texture("encoded", rng.random((2, 3, 4)), encoding="srgb")
    lamp = camlux.Pattern([0, 50, 90.5], [0, 100.1, 360], np.array([[1, 0.5, 0.3], [0.7, 0.5, 0.1], [1, 0.5, 0.3]]))
    image = camlux.ProjectedImage(rng.random((4, 5)), fx=5.3, fy=5.1, cx=2.5, cy=2)
    scene.lights += [
        camlux.PatternLight((0, 1, 0), (0, -1, 0), (1, 0, 0), lamp, 3),
        camlux.PatternLight((0, 1, 0), (0, -1, 0), (0, 0, -1), image, 5),
        camlux.AreaLight((0, 1, 0), (0, -1, 0), power_w=5, radius_m=0.01),
    ]
    scene.camera.distortion, scene.camera.fov_y_deg = camlux.RationalDistortion(0.01, s1=0.002, tau_y=0.03), None
    scene.camera.intrinsics_px = camlux.Intrinsics(20, 20, 16, 12, skew=0.5)
    scene.sensor = camlux.Sensor((3, 3), 1e-3, wavelength_nm=850, quantum_efficiency=0.4)
    scene.tof = camlux.TimeOfFlight([20e6], [1], 1.0, noise=camlux.SensorNoise(full_well_e=1e5, read_noise_e=1))
    scene.validate()
    return scene


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda scene: pickle.loads(pickle.dumps(scene)), lambda scene: pickle.loads(pickle.dumps(scene, 2))])
def test_a_copy_is_the_same_scene(renderer, scene, copied):
    scene = everything(scene)
    again = copied(scene)
    assert again == scene and again is not scene and again.camera is not scene.camera
    layers = ["radiance", "tof0.phase0"]
    first, second = (renderer.render(each, layers=layers, frame_index=0) for each in (scene, again))
    assert first.scene_hash == second.scene_hash
    for name in layers:
        np.testing.assert_array_equal(first[name], second[name])
    # It is a scene of its own.
    again.camera.position_m = (9, 9, 9)
    again.lights.pop()
    assert len(scene.lights) == 4 and scene != again and scene.camera.position_m != (9, 9, 9)


def test_copies_share_meshes_and_textures(scene):
    scene = everything(scene)
    again = copy.deepcopy(scene)
    assert all(a is b for a, b in zip(scene.meshes, again.meshes))
    assert again.materials[0].kd_texture.texture is scene.materials[0].kd_texture.texture
    assert copy.copy(scene.meshes[0]) is scene.meshes[0]
    near = dataclasses.replace(scene, camera=dataclasses.replace(scene.camera, position_m=(0, 1, 2)))
    assert near.meshes is scene.meshes and near.camera.position_m == (0, 1, 2) and scene.camera.position_m == (0, 1, 3)


def test_a_pickle_has_shared_arrays_once():
    count = 1000
    positions = np.random.default_rng(1).random((count, 3))
    mesh = camlux.Mesh("mesh", positions, np.arange(count * 3).reshape(-1, 3) % count)
    one = len(pickle.dumps(mesh))
    many = pickle.dumps([mesh] + [mesh.posed((i, 0, 0)) for i in range(50)])
    assert one > 24 * count and len(many) < 1.5 * one
    again = pickle.loads(many)
    np.testing.assert_array_equal(again[3].positions_m, mesh.posed((2, 0, 0)).positions_m)
    # So do meshes that a file repeats.
    mesh = camlux.Mesh.load(SCENES / "cornell.obj")[0][0]
    assert pickle.loads(pickle.dumps(mesh)) == mesh


def test_scenes_are_equal_by_value(scene):
    again = copy.deepcopy(scene)
    again.camera.position_m = np.array([0.0, 1.0, 3.0])
    again.materials[1].kd = [0.7, 0.1, 0.1]
    again.meshes = [camlux.Mesh(mesh.name, mesh.positions_m, mesh.triangles, mesh.triangle_materials) for mesh in scene.meshes]
    assert scene == again and hash(scene.meshes[0]) == hash(again.meshes[0])
    scene.materials[0].kd, again.materials[0].kd = np.array(0.25), np.float32(0.25)
    assert scene == again
    again.camera.position_m[2] = 4
    assert scene != again and scene.camera != scene and scene != None  # noqa: E711
    again = copy.deepcopy(scene)
    again.lights.append(camlux.PointLight((0, 0, 0), 1))
    assert scene != again


@pytest.mark.parametrize(("make", "instead"), [
    (lambda renderer, scene: renderer, "make one in each process"),
    (lambda renderer, scene: renderer.device, "open one in each process"),
    (lambda renderer, scene: renderer.render(scene), "send its arrays"),
])  # fmt: skip
def test_what_cannot_be_sent_says_so(renderer, scene, make, instead):
    with pytest.raises(TypeError, match=f"cannot be copied, or sent to another process; {instead}") as caught:
        pickle.dumps(make(renderer, scene))
    assert isinstance(caught.value, camlux.Error)


def test_an_image_is_its_own_copy(renderer, scene, tmp_path):
    frame = renderer.render(scene)
    frame.save(tmp_path / "frame.exr")
    image = camlux.read_exr(tmp_path / "frame.exr")
    assert copy.deepcopy(frame) is frame and copy.copy(image) is image
    with pytest.raises(camlux.UnsupportedError, match="or save it"):
        pickle.dumps(image)


FORK = """
import os, sys
import camlux
scene = camlux.Scene.load(sys.argv[1])
scene.camera.resolution_px, scene.indirect = (8, 8), None
renderer = camlux.Renderer()
renderer.render(scene)
process = os.fork()
if process == 0:
    for use in [lambda: renderer.render(scene), camlux.Renderer, camlux.Device, camlux.devices, lambda: camlux.reference(scene, samples_per_pixel=1),
                lambda: renderer.device.info]:
        try:
            use()
        except camlux.DeviceError as error:
            print(str(error).count('get_context("spawn")'))
    del renderer, use
    sys.stdout.flush()
    os._exit(0)
_, status = os.waitpid(process, 0)
print("exit", status, renderer.render(scene)["direct"].max() > 0)
"""


def test_a_forked_process_is_told_of_spawn():
    done = subprocess.run([sys.executable, "-c", FORK, str(SCENES / "cornell.toml")], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n") == ["1"] * 6 + ["exit 0 True", ""]


FIRST_IN_CHILD = """
import os, sys
import camlux
scene = camlux.Scene.load(sys.argv[1])
scene.camera.resolution_px, scene.indirect = (8, 8), None
process = os.fork()
if process == 0:
    print(camlux.Renderer().render(scene)["direct"].max() > 0, flush=True)
    os._exit(0)
os.waitpid(process, 0)
"""


def test_a_process_that_is_forked_before_the_first_use_renders():
    done = subprocess.run([sys.executable, "-c", FIRST_IN_CHILD, str(SCENES / "cornell.toml")], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout == "True\n", done.stderr


def rendered(scene):
    return os.getpid(), camlux.Renderer().render(scene)["direct"].copy()


def test_spawned_processes_render_scenes_that_are_sent(renderer, scene):
    scene.indirect = None
    direct = renderer.render(scene)["direct"]
    with multiprocessing.get_context("spawn").Pool(1) as workers:
        [(process, theirs)] = workers.map(rendered, [scene])
    assert process != os.getpid()
    np.testing.assert_array_equal(theirs, direct)
