"""Textures in the roles that materials give them. They are read as a scene file reads the same pixels."""

import camlux
import cv2
import numpy as np
import pytest

CORNERS = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
TEXCOORDS = [[0, 0], [1, 0], [1, 1], [0, 1]]


def floor_with(scene, **textures):
    """The scene with textures on its floor."""
    scene.meshes[0] = camlux.Mesh("floor", CORNERS, [[0, 2, 1], [0, 3, 2]], texcoords=TEXCOORDS)
    scene.materials[0] = camlux.Material("white", 0.8, **textures)
    scene.indirect = None
    return scene


def pixels(channels, kind):
    """A picture in which every channel has values on both sides of a half."""
    of_8_bits = np.random.default_rng(channels).integers(0, 256, (3, 4, channels), np.uint8)
    return of_8_bits if kind == np.uint8 else of_8_bits.astype(kind) * 257


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_every_role_reads_pixels_as_a_scene_file_does(renderer, tmp_path, channels, kind):
    picture = pixels(channels, kind)
    cv2.imwrite(str(tmp_path / "t.png"), picture[..., [2, 1, 0, 3][:channels]] if channels > 1 else picture)
    faces = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 3/3 2/2\nf 1/1 4/4 3/3\n"
    (tmp_path / "mesh.obj").write_text("mtllib mesh.mtl\n" + faces)
    (tmp_path / "scene.toml").write_text(
        "[camera]\nresolution = [8, 8]\nposition = [0, 2, 2]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov_y_deg = 50\n"
        '[[light]]\nkind = "point"\nposition = [0, 2, 0]\npower_w = 10\n[[mesh]]\npath = "mesh.obj"\n'
    )
    maps = {"map_Kd": "kd", "map_Ks": "ks", "map_Ns": "shininess", "norm": "normal", "map_d": "alpha"}
    for line, role in maps.items():
        (tmp_path / "mesh.mtl").write_text(f"newmtl m\nKd .5 .5 .5\nKs .2 .2 .2\nNs 20\n{line} t.png\n")
        scene = camlux.Scene.load(tmp_path / "scene.toml")
        from_file = renderer.render(scene)
        texture = camlux.Texture("t", picture)
        setattr(scene.materials[0], f"{role}_texture", texture)
        assert getattr(scene.materials[0], f"{role}_texture") is texture
        from_array = renderer.render(scene)
        assert from_array.scene_hash == from_file.scene_hash, role
        np.testing.assert_array_equal(from_array["radiance"], from_file["radiance"])


def test_a_flat_normal_map_tilts_as_much_as_its_bits_say(renderer, scene):
    up = camlux.Texture("up", np.full((1, 1, 3), (128, 128, 255), np.uint8))
    frame = renderer.render(floor_with(scene, normal_texture=up))
    normals = frame["N"][frame["id.material"] == 1]
    # A half lies between two of 255 steps.
    np.testing.assert_allclose(np.degrees(np.arccos(normals[:, 1])), 0.3178, atol=0.003)
    for pixels, most_deg in [(np.full((1, 1, 3), (32768, 32768, 65535), np.uint16), 0.03), (np.array([[[0.5, 0.5, 1]]]), 0)]:
        frame = renderer.render(floor_with(scene, normal_texture=camlux.Texture("flat", pixels)))
        tilts_deg = np.degrees(np.arccos(frame["N"][frame["id.material"] == 1][:, 1]))
        assert tilts_deg.max() <= most_deg
    floor_with(scene, normal_texture=up)
    # The same texture as a colour is sRGB, in the same scene.
    scene.materials[0].kd_texture = up
    colored = renderer.render(scene)
    floor = colored["direct"][colored["id.material"] == 1]
    np.testing.assert_allclose(floor[:, 0] / floor[:, 2], ((128 / 255 + 0.055) / 1.055) ** 2.4, rtol=1e-4)


def test_normal_maps_that_point_along_the_surface_are_warned_of(renderer, scene):
    grey = np.full((2, 2), 128, np.uint8)
    blue_first = np.full((2, 2, 3), (255, 128, 128), np.uint8)
    for doubtful in [grey, blue_first]:
        with pytest.warns(camlux.CamluxWarning, match="OpenCV has blue first"):
            renderer.render(floor_with(scene, normal_texture=camlux.Texture("n", doubtful)))
    right = camlux.Texture("n", np.ascontiguousarray(blue_first[..., ::-1]))
    assert not any("blue" in text for text in floor_with(scene, normal_texture=right).warnings())


def test_alpha_cuts_out_whatever_the_colours_are(renderer, scene):
    leaf = np.zeros((2, 2, 4), np.uint8)
    leaf[:, 0, 3] = 255
    leaf[..., 1] = 200
    counts = [
        (renderer.render(floor_with(scene, kd_texture=texture, alpha_texture=texture))["id.material"] == 1).sum()
        for texture in [camlux.Texture("leaf", leaf), camlux.Texture("leaf", leaf, encoding="srgb"), camlux.Texture("leaf", leaf / 255.0)]
    ]
    whole = (renderer.render(floor_with(scene))["id.material"] == 1).sum()
    assert 0.4 * whole < counts[0] < 0.6 * whole and counts == [counts[0]] * 3
    # Without alpha, the brightness is compared with the cutoff as it is: decoded from sRGB, 160 would be below a half.
    grey = camlux.Texture("grey", np.full((1, 1), 160, np.uint8))
    assert (renderer.render(floor_with(scene, alpha_texture=grey))["id.material"] == 1).sum() == whole


@pytest.mark.parametrize("role", ["normal_texture", "shininess_texture", "alpha_texture"])
def test_an_encoding_that_contradicts_the_role_is_refused(scene, role):
    for picture in [np.full((1, 1, 3), 200, np.uint8), np.full((1, 1, 3), 0.5)]:
        scene.materials[0] = camlux.Material("white", 0.8, ks=0.1, shininess=20, **{role: camlux.Texture("map", picture, encoding="srgb")})
        with pytest.raises(camlux.SceneError, match=f'the texture of {role} is encoded as sRGB.*make its encoding linear'):
            scene.validate()
        scene.materials[0] = camlux.Material("white", 0.8, ks=0.1, shininess=20, **{role: camlux.Texture("map", picture, encoding="linear")})
        scene.validate()


def test_floats_are_decoded_only_if_they_say_so(renderer, scene):
    values = []
    for encoding in [None, "linear", "srgb"]:
        texture = camlux.Texture("half", np.full((1, 1), 0.5), encoding=encoding)
        frame = renderer.render(floor_with(scene, kd_texture=texture))
        values.append(frame["direct"][frame["id.material"] == 1].max())
    assert values[0] == values[1]
    assert values[2] / values[0] == pytest.approx(0.214041 / 0.5, rel=1e-4)
    for picture, part in [(np.full((1, 1, 3), 2.0), "texel 0"), (np.array([[[0.5, 0.5, 0.5, 2]]]), "alpha of texel 0 is 2")]:
        with pytest.raises(camlux.SceneError, match=f'texture "t": {part}'):
            camlux.Texture("t", picture)
