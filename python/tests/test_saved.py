"""Saved scenes."""

import camlux
import numpy as np
import pytest

from conftest import SCENES


@pytest.mark.parametrize("name", ["cornell_spot", "textured", "leaves", "lamp", "projector", "tof_corner", "lens", "area"])
def test_a_scene_file_comes_back(renderer, tmp_path, name):
    scene = camlux.Scene.load(SCENES / f"{name}.toml")
    width, height = scene.camera.resolution_px
    assert_comes_back(renderer, tmp_path, scene)


def test_a_scene_from_arrays_comes_back(renderer, tmp_path):
    rng = np.random.default_rng(3)
    quad = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
    mesh = camlux.Mesh(
        "floor \"1\"",
        np.array(quad) / 3,
        [[0, 1, 2], [0, 2, 3]],
        material=[0, 1],
        normals=rng.normal(size=(4, 3)) / 9 + [0, 1, 0],
        texcoords=rng.random((4, 2)),
        colors=rng.random((4, 3)),
    )
    texels = [rng.integers(0, 256, (4, 5, 3), np.uint8), rng.integers(0, 65536, (4, 5, 3), np.uint16), rng.random((4, 5, 3), np.float32)]
    textures = [camlux.Texture(f"t{i}", texels) for i, texels in enumerate(texels)]
    lookup = camlux.TextureLookup(textures[2], transform=[[2, 0, 1 / 3], [0, 2, 0]], wrap=("mirror", "clamp"), filter="nearest")
    materials = [
        camlux.Material("same", kd=(0.1, 0.2, 1 / 3), kd_texture=textures[0], ks=0.1, shininess=7, ks_texture=lookup),
        camlux.Material("same", kd=0.4, kd_texture=textures[1]),
        camlux.Material("gold", kd=(1, 0.77, 0.34), microfacets=camlux.MetallicRoughness(roughness=1 / 3, metallic=0.9)),
        camlux.Material("lamp", kd=0.1, emission_w_sr_m2=(1 / 3, 2, 3), emission_texture=textures[0], one_sided=True),
    ]
    light = camlux.PointLight((0.2, 1 / 3, 0.1), power_w=20)
    scene = camlux.Scene(
        camera=camlux.Camera((24, 16), position_m=(0, 1, 1), look_at_m=(0, 0, 0), fov_y_deg=45),
        lights=[light],
        meshes=[mesh, mesh.posed((0.1, 0.2, 0.3))],
        materials=materials,
        indirect=camlux.FinalGather(0.3),
    )
    again = assert_comes_back(renderer, tmp_path, scene)
    assert [mesh.name for mesh in again.meshes] == ["floor \"1\""] * 2
    assert [material.name for material in again.materials] == ["same", "same", "gold", "lamp"]
    assert again.materials[2].microfacets == materials[2].microfacets
    assert again.materials[3].emission_w_sr_m2 == (1 / 3, 2, 3) and again.materials[3].one_sided
    assert again.materials[3].emission_texture is not None and not again.materials[2].one_sided
    assert again.materials[0].ks_texture.wrap == ("mirror", "clamp")


def assert_comes_back(renderer, folder, scene):
    scene.camera.resolution_px = (24, 16) if scene.camera.intrinsics_px is None else scene.camera.resolution_px
    if isinstance(scene.indirect, camlux.FinalGather):
        scene.indirect.target_error = 0.3
    scene.save(folder / "saved")
    again = camlux.Scene.load(folder / "saved" / "scene.toml")
    mine, other = renderer.render(again), renderer.render(scene)
    assert mine.scene_hash == other.scene_hash
    for layer in other:
        np.testing.assert_array_equal(mine[layer], other[layer], err_msg=layer)
    return again


def test_what_cannot_be_saved_is_an_error(tmp_path, scene):
    (tmp_path / "file").write_text("")
    with pytest.raises(camlux.FileError, match="cannot create the folder"):
        scene.save(tmp_path / "file" / "scene")
    scene.materials[0].kd = 2
    with pytest.raises(camlux.SceneError, match="kd is"):
        scene.save(tmp_path)
