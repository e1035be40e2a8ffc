"""What runs, as users write it; test_manual.py checks its types, and test_types.py runs it."""

import copy

import camlux
import numpy as np

rng = np.random.default_rng(1)
lights = [camlux.PointLight(rng.uniform(-0.1, 0.1, 3), power_w=np.float32(20)), camlux.PointLight([0, 1, 1], [1, 2, 3])]
materials = [camlux.Material("grey", kd=0.5), camlux.Material("red", kd=np.array([0.7, 0.1, 0.1]), ks=np.float64(0.1), shininess=np.int64(20))]
triangles = np.array([[0, 1, 2]])
mesh = camlux.Mesh("triangle", [[-1, 0, -3], [1, 0, -3], [0, 1, -3]], triangles, material=np.int64(1))
camera = camlux.Camera([np.int64(8), 6], np.zeros(3), np.array([0, 0, -1]), fov_y_deg=np.float32(50))
scene = camlux.Scene(camera, lights=lights, meshes=[mesh], materials=materials, indirect=None)
scene.lights.append(camlux.DirectionalLight((0, 0, -1), irradiance_w_m2=1))
scene.sensor = camlux.Sensor([3, 3], exposure_time_s=np.float32(1e-3))
scene.tof = camlux.TimeOfFlight([20e6], [1], band_weights=1.0, ambient_lights=[np.int64(2)])
scene.tof = None
again = copy.deepcopy(scene)
assert again == scene

frame = camlux.Renderer().render(scene, layers="radiance", seed=np.int64(3), frame_index=np.uint8(2))
mean = float(frame["radiance"].mean())
missing = frame.get("depth")
assert missing is None and mean >= 0
arrays = {name: array.copy() for name, array in frame.items()}
everything = dict(frame)
pose = camlux.Camera.from_matrix(frame.camera_to_world(), frame.intrinsics(), frame.resolution_px)
pose = camlux.Camera.from_matrix(np.eye(4).tolist(), [[10, 0, 4], [0, 10, 3], [0, 0, 1]], (8, 6), axes="opengl")
error = frame.stats.estimated_error
if error is not None:
    print(f"{100 * error:.1f} %")
