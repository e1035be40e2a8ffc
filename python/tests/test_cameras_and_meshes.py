"""Cameras from matrices, and meshes from files."""

import base64
import json
import pickle
import warnings

import camlux
import numpy as np
import pytest

from conftest import SCENES


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def test_a_camera_is_made_from_matrices(renderer, scene):
    rng = np.random.default_rng(1)
    k = np.array([[30, 0.25, 15.5], [0, 31, 12.25], [0, 0, 1]])
    for _ in range(3):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation(rng), rng.normal(size=3)
        camera = camlux.Camera.from_matrix(pose, k, (32, 24))
        scene.camera = camera
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            frame = renderer.render(scene, layers=["depth"])
        np.testing.assert_allclose(frame.camera_to_world(), pose, atol=1e-12)
        np.testing.assert_array_equal(frame.intrinsics(), k)
        # The same camera with the axes of OpenGL, and of fewer rows.
        opengl = pose @ np.diag([1, -1, -1, 1])
        assert camlux.Camera.from_matrix(opengl[:3].tolist(), k.tolist(), (32, 24), axes="opengl") == camera


def test_a_lens_by_fov_x_and_by_the_vector_of_opencv(renderer, scene):
    vector = np.array([[-0.2, 0.05, 0.002, -0.001, 0.01, 0, 0, 0, 0.01, -0.002, 0.003, 0, 0.05, -0.03]])
    lens = camlux.RationalDistortion(*vector.ravel())
    assert (lens.k3, lens.s1, lens.tau_y) == (0.01, 0.01, -0.03)
    scene.camera.resolution_px, scene.camera.fov_y_deg, scene.camera.fov_x_deg = (32, 16), None, 90
    k = renderer.render(scene, layers=["depth"]).intrinsics()
    np.testing.assert_allclose(k, [[16, 0, 16], [0, 16, 8], [0, 0, 1]], rtol=1e-15)
    scene.camera.fov_x_deg, scene.camera.intrinsics_px, scene.camera.distortion = None, camlux.Intrinsics(16, 16, 16, 8, 2), lens
    assert renderer.render(scene, layers=["depth"]).intrinsics()[0, 1] == 2


def test_an_orthographic_camera_shows_points_on_a_grid(renderer, scene, tmp_path):
    camera = scene.camera
    camera.resolution_px, camera.fov_y_deg, camera.projection, camera.height_m = (32, 16), None, "orthographic", 0.4
    frame = renderer.render(scene, layers=["P_camera", "range", "depth", "id.instance"])
    x, y = (np.arange(32) - 15.5) * 0.4 / 16, (np.arange(16) - 7.5) * 0.4 / 16
    seen = frame["id.instance"] > 0
    due = np.stack(np.broadcast_arrays(x[np.newaxis], y[:, np.newaxis]), axis=2)
    assert seen.any()
    np.testing.assert_allclose(frame["P_camera"][..., :2][seen], due[seen], atol=1e-6)
    np.testing.assert_array_equal(frame["depth"], frame["range"])
    with pytest.raises(camlux.UnsupportedError, match="orthographic camera has no intrinsics"):
        frame.intrinsics()
    scene.save(tmp_path)
    assert camlux.Scene.load(tmp_path / "scene.toml").camera == camera
    camera.height_m = None
    with pytest.raises(camlux.SceneError, match="height_m and projection"):
        renderer.render(scene)
    camera.height_m, camera.fov_y_deg = 0.4, 50
    with pytest.raises(camlux.SceneError, match="projection is given with a lens"):
        renderer.render(scene)


@pytest.mark.parametrize(("arguments", "message"), [
    ((np.eye(3), np.eye(3)), "camera_to_world is .* give 4 x 4 or 3 x 4 finite numbers"),
    ((np.eye(4), np.eye(4)), "intrinsics is .* give 3 x 3"),
    ((2 * np.eye(4) - np.diag([0, 0, 0, 1]), np.eye(3)), "is not a rotation; give a pose without scale or mirror"),
    ((np.diag([1, 1, -1, 1]), np.eye(3)), "is not a rotation"),
    ((np.eye(4) + np.eye(4, k=-3), np.eye(3)), "the last row of camera_to_world is .* for column vectors"),
    ((np.eye(4), [[1, 0, 0], [0.1, 1, 0], [0, 0, 1]]), "give .*skew"),
    ((np.full((4, 4), np.nan), np.eye(3)), "finite numbers"),
    (("pose", np.eye(3)), "give a matrix of numbers"),
])  # fmt: skip
def test_matrices_that_are_no_camera_are_refused(arguments, message):
    with pytest.raises(camlux.SceneError, match=message):
        camlux.Camera.from_matrix(*arguments, (8, 8))
    with pytest.raises(camlux.SceneError, match='axes is "blender"'):
        camlux.Camera.from_matrix(np.eye(4), np.eye(3), (8, 8), axes="blender")


def test_meshes_are_loaded_with_their_materials(renderer, tmp_path):
    scene = camlux.Scene.load(SCENES / "cornell.toml")
    scene.camera.resolution_px, scene.indirect = (16, 16), None
    whole = renderer.render(scene)
    meshes, materials = camlux.Mesh.load(SCENES / "cornell.obj")
    assert [material.name for material in materials] == [material.name for material in scene.materials]
    scene.meshes, scene.materials = meshes, materials
    np.testing.assert_array_equal(renderer.render(scene)["direct"], whole["direct"])
    # Beside materials that are there already.
    first = [camlux.Material("other", 0.1)]
    meshes, materials = camlux.Mesh.load(SCENES / "cornell.obj", first_material=len(first))
    scene.meshes, scene.materials = meshes, first + materials
    np.testing.assert_array_equal(renderer.render(scene)["direct"], whole["direct"])
    # With one of them, larger.
    meshes, materials = camlux.Mesh.load(SCENES / "cornell.obj", 0, scale=2, flat=True)
    assert materials == [] and set(meshes[0].triangle_materials) == {0} and len(meshes[0].normals) == 0
    np.testing.assert_allclose(np.ptp(meshes[0].positions_m, axis=0), 2 * np.ptp(scene.meshes[0].positions_m, axis=0))


def test_meshes_are_loaded_from_every_format(tmp_path):
    (tmp_path / "mesh.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    (tmp_path / "mesh.stl").write_text("solid m\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid m\n")
    (tmp_path / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    corners = base64.b64encode(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()).decode()
    lights = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    gltf = {
        "asset": {"version": "2.0"}, "extensionsUsed": list(lights), "extensions": lights,
        "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64," + corners}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"name": "one", "mesh": 0}, {"name": "two", "mesh": 0, "translation": [0, 0, 1]}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "scenes": [{"nodes": [0, 1, 2]}],
    }  # fmt: skip
    (tmp_path / "mesh.gltf").write_text(json.dumps(gltf))
    for name in ["mesh.ply", "mesh.stl", "mesh.obj"]:
        [mesh], materials = camlux.Mesh.load(tmp_path / name, material=2)
        assert mesh.triangle_count == 1 and materials == [] and list(mesh.triangle_materials) == [2]
        with pytest.raises(camlux.SceneError, match="give material, the index of one of the scene's materials"):
            camlux.Mesh.load(tmp_path / name)
    with pytest.warns(camlux.CamluxWarning, match="its lights are left out"):
        meshes, materials = camlux.Mesh.load(tmp_path / "mesh.gltf", first_material=5)
    assert [mesh.name.split("#")[1] for mesh in meshes] == ["one", "two"] and len(materials) == 1
    assert list(meshes[1].triangle_materials) == [5]
    np.testing.assert_allclose(meshes[1].positions_m[0], [0, 0, 1])
    # Both nodes share their mesh, also in a pickle.
    again = pickle.loads(pickle.dumps(meshes))
    assert again == meshes
    with pytest.raises(camlux.SceneError, match="in no format that camlux reads; export the mesh as .gltf"):
        camlux.Mesh.load(tmp_path / "mesh.fbx")
    with pytest.raises(camlux.SceneError, match="scale is 0; give a number above 0"):
        camlux.Mesh.load(tmp_path / "mesh.obj", scale=0)
