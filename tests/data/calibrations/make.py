"""Writes calibrations in each format, with OpenCV's and COLMAP's own writers where there are any, and where OpenCV and COLMAP see points.

    pip install opencv-python-headless pycolmap numpy
    python make.py
"""

import json
from pathlib import Path

import cv2
import numpy as np
import pycolmap

HERE = Path(__file__).parent
SIZE = (752, 480)
K = np.array([[458.654, 0, 367.215], [0, 457.296, 248.375], [0, 0, 1]])
K_SKEW = K + np.array([[0, 3.5, 0], [0, 0, 0], [0, 0, 0]])
BROWN = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
RATIONAL = [-0.28, 0.07, 2e-4, -3e-4, 0.01, 0.02, -0.01, 0.002]
PRISM = [0.011, -0.004, -0.007, 0.003]
TILT = [0.06, -0.09]
FISHEYE = [0.0034823894, 0.00071503485, -0.0020532361, 0.00020293674]
# From the camera's axes (x right, y down, z forward) to the world.
TO_WORLD = np.eye(4)
TO_WORLD[:3, :3] = cv2.Rodrigues(np.array([0.3, -0.5, 0.2]))[0]
TO_WORLD[:3, 3] = [0.4, -1.3, 2.2]
# OpenCV's centre of the first pixel is at (0, 0), camlux's at (0.5, 0.5).
HALF = 0.5

rng = np.random.default_rng(1)
AHEAD = np.concatenate([rng.uniform([-0.7, -0.45, 1], [0.7, 0.45, 1], (12, 3)) * rng.uniform(0.5, 5, (12, 1)), [[0, 0, 1]]])
cases = []


def case(path, name, pose, pixels, points=AHEAD):
    """`pose`: of the camera that sees these points at these pixels of camlux; None: the file has none."""
    to_world = np.eye(4) if pose is None else pose
    cases.append({
        "path": path,
        "name": name,
        "has_pose": pose is not None,
        "points_m": (points @ to_world[:3, :3].T + to_world[:3, 3]).tolist(),
        "pixels": pixels.tolist(),
    })  # fmt: skip


def seen(k, coefficients, is_fisheye=False):
    """Pixels in OpenCV's convention. OpenCV does not use the skew of its matrix, so that only the distortion is left to it."""
    project = cv2.fisheye.projectPoints if is_fisheye else cv2.projectPoints
    still = np.zeros(3)
    points = project(AHEAD.reshape(-1, 1, 3), still, still, np.eye(3), np.array(coefficients, dtype=float))[0].reshape(-1, 2)
    return points @ k[:2, :2].T + k[:2, 2]


def by_opencv(path, values):
    storage = cv2.FileStorage(str(HERE / path), cv2.FileStorage_WRITE)
    for key, value in values.items():
        storage.write(key, value)
    storage.release()


def opencv():
    size = {"image_width": SIZE[0], "image_height": SIZE[1]}
    for path, k, coefficients in [
        ("brown.yaml", K, [*BROWN, 0.0]),
        ("prism.xml", K, RATIONAL + PRISM),
        ("tilted.yml", K_SKEW, RATIONAL + PRISM + TILT),
        ("tilted.json", K_SKEW, RATIONAL + PRISM + TILT),
    ]:
        by_opencv(path, {
            "calibration_time": "Thu Jan 1 00:00:00 1970",
            **size,
            "camera_matrix": k,
            "distortion_coefficients": np.array(coefficients).reshape(-1, 1),
            "avg_reprojection_error": 0.25,
        })  # fmt: skip
        case(path, None, None, seen(k, coefficients) + HALF)
    other = K * [[0.9], [0.9], [1]]
    by_opencv("stereo.yaml", {"M1": K, "D1": np.array([BROWN]), "M2": other, "D2": np.array([RATIONAL])})
    # OpenCV 4 writes another first line, which is no YAML.
    stereo = HERE / "stereo.yaml"
    stereo.write_text(stereo.read_text().replace("%YAML 1.2", "%YAML:1.0"))
    case("stereo.yaml", "M1", None, seen(K, BROWN) + HALF)
    case("stereo.yaml", "M2", None, seen(other, RATIONAL) + HALF)


def ros():
    for path, model, coefficients in [
        ("ros_plumb_bob.yaml", "plumb_bob", [*BROWN, 0.0]),
        ("ros_equidistant.yaml", "equidistant", FISHEYE),
    ]:
        text = f"image_width: {SIZE[0]}\nimage_height: {SIZE[1]}\ncamera_name: narrow\n"
        for key, rows, columns, data in [
            ("camera_matrix", 3, 3, K.ravel().tolist()),
            ("distortion_coefficients", 1, len(coefficients), coefficients),
            ("rectification_matrix", 3, 3, np.eye(3).ravel().tolist()),
        ]:
            text += f"{key}:\n  rows: {rows}\n  cols: {columns}\n  data: {data}\n"
            if key == "camera_matrix":
                text += f"distortion_model: {model}\n"
        (HERE / path).write_text(text)
        case(path, None, None, seen(K, coefficients, model == "equidistant") + HALF)


def kalibr():
    intrinsics = K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    rows = ",\n         ".join(", ".join(map(repr, row)) for row in TO_WORLD.tolist())
    (HERE / "sensor.yaml").write_text(
        "# General sensor definitions.\nsensor_type: camera\ncomment: VI-Sensor cam0 (MT9M034)\n\n"
        "# Sensor extrinsics wrt. the body-frame.\nT_BS:\n  cols: 4\n  rows: 4\n"
        f"  data: [{rows}]\n\nrate_hz: 20\nresolution: [{SIZE[0]}, {SIZE[1]}]\ncamera_model: pinhole\n"
        f"intrinsics: {intrinsics} #fu, fv, cu, cv\n"
        f"distortion_model: radial-tangential\ndistortion_coefficients: {BROWN}\n"
    )
    case("sensor.yaml", None, TO_WORLD, seen(K, BROWN) + HALF)
    (HERE / "camchain.yaml").write_text(
        "".join(
            f"{name}:\n  camera_model: pinhole\n  distortion_coeffs: {coefficients}\n  distortion_model: {model}\n"
            f"  intrinsics: {intrinsics}\n  resolution: [{SIZE[0]}, {SIZE[1]}]\n  rostopic: /{name}/image_raw\n"
            for name, model, coefficients in [("cam0", "radtan", BROWN), ("cam1", "equidistant", FISHEYE)]
        )
    )
    case("camchain.yaml", "cam1", None, seen(K, FISHEYE, True) + HALF)


def colmap():
    """COLMAP's centre of the first pixel is at (0.5, 0.5), so these pixels are camlux's."""
    k = [K[0, 0], K[1, 1], K[0, 2], K[1, 2]]
    models = {
        "SIMPLE_PINHOLE": [460, 370, 245],
        "PINHOLE": k,
        "SIMPLE_RADIAL": [460, 370, 245, -0.1],
        "RADIAL": [460, 370, 245, -0.1, 0.02],
        "OPENCV": k + BROWN,
        "FULL_OPENCV": k + RATIONAL,
        "OPENCV_FISHEYE": k + FISHEYE,
    }
    model = pycolmap.Reconstruction()
    seen_by = {}
    for number, (name, parameters) in enumerate(models.items(), 1):
        camera = pycolmap.Camera(camera_id=number, model=name, width=SIZE[0], height=SIZE[1], params=np.array(parameters))
        model.add_camera_with_trivial_rig(camera)
        pose = TO_WORLD.copy()
        pose[:3, 3] += number
        to_camera = np.linalg.inv(pose)
        # Against the order of the names, as in files of COLMAP.
        image = pycolmap.Image(name=f"frames/{9 - number}.png", camera_id=number, image_id=number)
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(to_camera[:3]))
        seen_by[name] = (image.name, pose, camera)
    folder = HERE / "colmap"
    folder.mkdir(exist_ok=True)
    model.write_text(str(folder))
    model.write_binary(str(folder))
    for file in folder.iterdir():
        if file.stem not in ("cameras", "images"):
            file.unlink()
    for extension in ("txt", "bin"):
        for image, pose, camera in seen_by.values():
            pixels = np.array([camera.img_from_cam(point) for point in AHEAD])
            case(f"colmap/images.{extension}", image, pose, pixels)
        _, _, camera = seen_by["FULL_OPENCV"]
        case(f"colmap/cameras.{extension}", str(camera.camera_id), None, np.array([camera.img_from_cam(p) for p in AHEAD]))
    # COLMAP and OpenCV agree on the formulas.
    np.testing.assert_allclose(np.array([camera.img_from_cam(p) for p in AHEAD]), seen(K, RATIONAL), atol=1e-9)


def transforms():
    """nerfstudio's centre of the first pixel is at (0.5, 0.5), too. Its cameras look along -z, with y up."""
    poses = [TO_WORLD.copy(), TO_WORLD.copy()]
    poses[1][:3, 3] += 1
    frames = [
        {"file_path": f"images/frame_{number}.png", "transform_matrix": (pose @ np.diag([1, -1, -1, 1])).tolist()}
        for number, pose in enumerate(poses, 1)
    ]
    k1, k2, p1, p2 = BROWN
    shared = {"w": SIZE[0], "h": SIZE[1], "fl_x": K[0, 0], "fl_y": K[1, 1], "cx": K[0, 2], "cy": K[1, 2]}
    # The second frame has a camera of its own.
    frames[1] |= {"fl_x": 400.0, "fl_y": 410.0, "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}
    document = {"camera_model": "OPENCV", **shared, "k1": k1, "k2": k2, "p1": p1, "p2": p2, "frames": frames}
    (HERE / "transforms.json").write_text(json.dumps(document, indent=1))
    case("transforms.json", "images/frame_1.png", poses[0], seen(K, BROWN))
    own = np.array([[400, 0, K[0, 2]], [0, 410, K[1, 2]], [0, 0, 1]])
    case("transforms.json", "frame_2.png", poses[1], seen(own, [0, 0, 0, 0]))
    fisheye = {"camera_model": "OPENCV_FISHEYE", **shared} | dict(zip(["k1", "k2", "k3", "k4"], FISHEYE))
    (HERE / "fisheye.json").write_text(json.dumps({**fisheye, "frames": frames[:1]}, indent=1))
    case("fisheye.json", None, poses[0], seen(K, FISHEYE, True))
    # As in the synthetic scenes of NeRF: an angle of view is all there is, and the scene file says 752 x 480 pixels.
    angle = 0.9
    (HERE / "nerf.json").write_text(json.dumps({"camera_angle_x": angle, "frames": frames[:1]}, indent=1))
    f = 0.5 * SIZE[0] / np.tan(0.5 * angle)
    case("nerf.json", None, poses[0], seen(np.array([[f, 0, SIZE[0] / 2], [0, f, SIZE[1] / 2], [0, 0, 1]]), [0, 0, 0, 0]))


opencv()
ros()
kalibr()
colmap()
transforms()
(HERE / "seen.json").write_text("[\n" + ",\n".join(map(json.dumps, cases)) + "\n]\n")
