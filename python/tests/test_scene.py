"""Scenes from files and from arrays, changes between renders, and refused scenes."""

import dataclasses
import math

import camlux
import numpy as np
import pytest

from conftest import SCENES


@pytest.mark.parametrize("path", sorted(SCENES.glob("*.toml")), ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore::camlux.CamluxWarning")
def test_a_loaded_scene_renders_as_by_the_program(renderer, program, path, tmp_path):
    scene = camlux.Scene.load(path)
    if k := scene.camera.intrinsics_px:
        # The program does this with --size.
        factor = 24 / scene.camera.resolution_px[0]
        scene.camera.intrinsics_px = camlux.Intrinsics(factor * k.fx, factor * k.fy, factor * k.cx, factor * k.cy)
    scene.camera.resolution_px = (24, 24)
    options = []
    if isinstance(scene.indirect, camlux.FinalGather):
        # A large target error is fast; both sides use it.
        scene.indirect.target_error = 0.2
        options = ["--target-error", 0.2]
    program("render", path, "--size", 24, 24, *options, "-o", tmp_path / "frame.exr")
    image, frame = camlux.read_exr(tmp_path / "frame.exr"), renderer.render(scene)
    assert set(image) == set(frame)
    assert image.attributes["camlux.scene_hash"] == frame.scene_hash
    for name in frame:
        np.testing.assert_array_equal(image[name], frame[name].astype(np.float32), err_msg=name)


def test_arrays_of_any_type_make_one_mesh(renderer, scene):
    radiance = renderer.render(scene)["radiance"]
    wall = scene.meshes[1]
    for positions, triangles in [
        (wall.positions_m, wall.triangles),
        (wall.positions_m.astype(np.float32), wall.triangles.astype(np.int64)),
        (wall.positions_m.astype(">f4"), wall.triangles.astype(np.uint16)),
        (wall.positions_m.astype(np.int32), wall.triangles.tolist()),
        (np.asfortranarray(wall.positions_m), np.repeat(wall.triangles, 2, axis=1)[:, ::2]),
    ]:
        scene.meshes[1] = camlux.Mesh("wall", positions, triangles, material=np.ones(2, np.uint8))
        np.testing.assert_array_equal(renderer.render(scene)["radiance"], radiance)
    again = scene.meshes[1]
    assert again.vertex_count == 4 and again.triangle_count == 2 and again.name == "wall"
    np.testing.assert_array_equal(again.positions_m, wall.positions_m)
    np.testing.assert_array_equal(again.triangle_materials, [1, 1])
    assert again.normals.shape == (0, 3) and again.texcoords.shape == (0, 2)


def test_what_is_changed_between_renders_is_seen(renderer, scene):
    scene.indirect = None
    before = renderer.render(scene)
    scene.materials[0].kd = 0.4
    darker = renderer.render(scene)
    floor = before["id.material"] == 1
    np.testing.assert_allclose(darker["direct"][floor], before["direct"][floor] / 2, rtol=1e-6)
    np.testing.assert_array_equal(darker["direct"][~floor], before["direct"][~floor])
    # A quarter turn about y moves the wall from z = -1 to x = -1. The translation then moves it 2 m along -z.
    half = math.radians(45)
    scene.meshes[1] = scene.meshes[1].posed((0, 0, -2), (0, math.sin(half), 0, math.cos(half)))
    np.testing.assert_allclose(scene.meshes[1].positions_m[:, 0], -1, atol=1e-12)
    with pytest.raises(camlux.SceneError, match="unit quaternion"):
        scene.meshes[1].posed(orientation_xyzw=(0, 0, 0, 2))
    scene.camera.position_m = np.array([0, 1.0, 3.5])
    farther = renderer.render(scene)
    seen = np.isfinite(farther["depth"]) & np.isfinite(before["depth"])
    assert seen.any() and (farther["depth"][seen] > before["depth"][seen]).all()


def test_lights_of_a_camera_move_with_it(renderer, tmp_path):
    text = (SCENES / "cornell.toml").read_text().replace("[800, 800]", "[16, 16]").replace('"cornell.obj"', f'"{SCENES / "cornell.obj"}"')
    text += '\n[[light]]\nkind = "point"\nrelative_to = "camera"\nposition = [0.1, 0.2, 0.3]\npower_w = 5.0\n'
    (tmp_path / "scene.toml").write_text(text)
    scene = camlux.Scene.load(tmp_path / "scene.toml")
    scene.indirect = None
    fixed, light = scene.lights
    # The file's own numbers.
    assert (fixed.relative_to, light.relative_to, light.position_m) == (None, "camera", (0.1, 0.2, 0.3))
    # In place, and another camera; lights may be removed and reordered.
    scene.lights = [light]
    scene.camera.position_m, scene.camera.look_at_m = (0.3, 1.2, 3), (0.3, 1.2, 0)
    moved = renderer.render(scene)["direct"]
    scene.camera = dataclasses.replace(scene.camera)
    assert np.array_equal(moved, renderer.render(scene)["direct"])
    # The camera looks along -z, so that its y is down.
    scene.lights = [camlux.PointLight((0.4, 1.0, 2.7), power_w=5.0)]
    np.testing.assert_allclose(moved, renderer.render(scene)["direct"], rtol=1e-5)
    scene.lights[0].relative_to = "mesh"
    with pytest.raises(camlux.SceneError, match='light 0: relative_to is "mesh"; give one of: camera'):
        renderer.render(scene)


def test_every_kind_of_light_can_be_relative_to_the_camera(renderer, scene):
    scene.indirect = None
    scene.camera.position_m, scene.camera.look_at_m = (0, 1, 3), (0, 1, 0)
    everywhere = camlux.Pattern([0, 90, 180], [0, 180, 360], np.ones((3, 3)))
    down, down_of_camera = (0.0, -1.0, -1.0), (0.0, 1.0, 1.0)
    lights = [
        (camlux.PointLight, {"power_w": 5}),
        (camlux.SpotLight, {"power_w": 5, "inner_half_angle_deg": 20, "outer_half_angle_deg": 40}),
        (camlux.PatternLight, {"power_w": 5, "pattern": everywhere}),
        (camlux.AreaLight, {"power_w": 5, "size_m": (0.2, 0.1)}),
        (camlux.DirectionalLight, {"irradiance_w_m2": 5}),
    ]
    for kind, values in lights:
        fields = {field.name for field in dataclasses.fields(kind)}
        world = {"position_m": (0.1, 1.5, 1.0), "direction": down, "up": (0, 1, -1)}
        camera = {"position_m": (0.1, -0.5, 2.0), "direction": down_of_camera, "up": (0, -1, 1)}
        frames = []
        for place, relative_to in ((world, None), (camera, "camera")):
            place = {name: value for name, value in place.items() if name in fields}
            scene.lights = [kind(**values, **place, relative_to=relative_to)]
            frames.append(renderer.render(scene)["direct"])
        assert frames[0].max() > 0
        np.testing.assert_allclose(*frames, rtol=1e-5)


def test_lamps_that_are_off_leave_depth_and_ids(renderer, scene):
    lit = renderer.render(scene)
    for lights in ([], [camlux.PointLight((0.2, 1, 0.1), power_w=0)]):
        scene.lights = lights
        with pytest.warns(camlux.CamluxWarning, match="the image is black"):
            dark = renderer.render(scene)
        assert not dark["radiance"].any() and not dark["indirect"].any()
        assert dark.stats.estimated_error is None and dark.stats.ray_count == 0
        for layer in ("depth", "id.instance", "N"):
            assert np.array_equal(dark[layer], lit[layer])


def test_every_light_from_arrays(renderer, scene):
    scene.indirect = None
    point = renderer.render(scene)["direct"]
    [light] = scene.lights
    everywhere = camlux.Pattern([0, 90, 180], [0, 180, 360], np.ones((3, 3)))
    scene.lights = [camlux.PatternLight(light.position_m, (0, -1, 0), (1, 0, 0), everywhere, light.power_w)]
    np.testing.assert_allclose(renderer.render(scene)["direct"], point, rtol=1e-4)
    scene.lights = [camlux.SpotLight(light.position_m, (0, -1, 0), 180, 180, light.power_w)]
    np.testing.assert_allclose(renderer.render(scene)["direct"], point, rtol=1e-5)
    image = camlux.ProjectedImage(np.ones((8, 8)), fx=8, fy=8, cx=4, cy=4)
    scene.lights = [camlux.PatternLight((0, 1, 0), (0, -1, 0), (0, 0, -1), image, 5)]
    projected = renderer.render(scene)
    on_floor = (projected["id.instance"] == 1) & (projected["direct"][..., 0] > 0)
    # The light projects its whole power evenly onto an area of 1 m x 1 m.
    np.testing.assert_allclose(projected["direct"][on_floor], 5 * 0.8 / np.pi, rtol=1e-4)
    np.testing.assert_array_less(abs(projected["P"][on_floor][:, [0, 2]]), 0.5 + 1e-5)
    scene.lights = [camlux.DirectionalLight((0, -1, 0), 10)]
    floor = renderer.render(scene)
    np.testing.assert_allclose(floor["direct"][floor["id.instance"] == 1], 10 * 0.8 / np.pi, rtol=1e-5)
    scene.lights = [camlux.AreaLight((0, 1, 0), (0, -1, 0), power_w=5, radius_m=0.01)]
    disc = renderer.render(scene)
    scene.lights = [camlux.AreaLight((0, 1, 0), (0, -1, 0), power_w=5, size_m=(0.02, 0.02), up=(0, 0, 1))]
    square = renderer.render(scene)
    np.testing.assert_allclose(disc["direct"], square["direct"], rtol=2e-2, atol=1e-4)
    assert square.stats.estimated_area_light_error is not None


@pytest.mark.parametrize("pixels", [np.full((2, 3), 0.5, np.float32), np.full((2, 3, 1), 0.5), np.full((2, 3, 4), 32768, np.uint16)])
def test_an_even_texture_is_a_factor(renderer, scene, pixels):
    floor = scene.meshes[0]
    texcoords = [[0, 0], [1, 0], [1, 1], [0, 1]]
    scene.meshes[0] = camlux.Mesh("floor", floor.positions_m, floor.triangles, texcoords=texcoords)
    scene.indirect = None
    plain = renderer.render(scene)["direct"]
    scene.materials[0].kd_texture = camlux.Texture("even", pixels, encoding="linear")
    textured = renderer.render(scene)
    floor = textured["id.material"] == 1
    np.testing.assert_allclose(textured["direct"][floor], plain[floor] / 2, rtol=1e-4)
    np.testing.assert_array_equal(textured["direct"][~floor], plain[~floor])


def striped(scene):
    """The floor's stripes along u, half white and half black, as the program would load them from a file."""
    floor = scene.meshes[0]
    texcoords = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[: floor.vertex_count]
    scene.meshes[0] = camlux.Mesh("floor", floor.positions_m, floor.triangles, texcoords=texcoords, texcoords_1=texcoords[:, ::-1])
    return camlux.Texture("stripes", np.array([[1.0, 0.0]]))


def test_lookups_say_how_a_texture_lies_on_a_surface(renderer, scene):
    scene.indirect = None
    texture = striped(scene)
    hashes = set()
    for lookup in [
        texture,
        camlux.TextureLookup(texture, texcoord_set=1),
        camlux.TextureLookup(texture, transform=((2, 0, 0), (0, 1, 0))),
        camlux.TextureLookup(texture, transform=np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]])),
        camlux.TextureLookup(texture, wrap=("mirror", "clamp")),
        camlux.TextureLookup(texture, filter="nearest"),
    ]:
        for name in ["kd_texture", "ks_texture", "shininess_texture", "normal_texture", "alpha_texture"]:
            material = camlux.Material("floor", 0.5, ks=0.2, shininess=1.0, **{name: lookup})
            scene.materials[0] = material
            hashes.add(renderer.render(scene).scene_hash)
    assert len(hashes) == 30
    # A lookup without arguments is the texture itself.
    scene.materials[0] = camlux.Material("floor", 0.5, ks=0.2, shininess=1.0, kd_texture=camlux.TextureLookup(texture))
    assert renderer.render(scene).scene_hash in hashes
    scene.materials[0].alpha_cutoff = 0.25
    assert renderer.render(scene).scene_hash not in hashes


@pytest.mark.parametrize(
    ("lookup", "message"),
    [
        ("stripes.png", "kd_texture is of .*give a camlux.Texture, a camlux.TextureLookup, or None"),
        (lambda t: camlux.TextureLookup(t, wrap=("repeat", "once")), 'kd_texture: wrap is "once"; give one of: repeat, mirror, clamp'),
        (lambda t: camlux.TextureLookup(t, wrap="repeat"), "give two strings"),
        (lambda t: camlux.TextureLookup(t, filter="cubic"), 'filter is "cubic"; give one of: bilinear, nearest'),
        (lambda t: camlux.TextureLookup(t, transform=(1, 0, 0)), "give two rows of three numbers"),
        (lambda t: camlux.TextureLookup(t, texcoord_set=2), "give 0 or 1"),
    ],
)
def test_lookups_that_cannot_be_are_refused(scene, lookup, message):
    scene.materials[0].kd_texture = lookup(striped(scene)) if callable(lookup) else lookup
    with pytest.raises(camlux.SceneError, match=message):
        scene.validate()


def test_meshes_have_colours_and_tangents(renderer, scene):
    scene.indirect = None
    plain = renderer.render(scene)
    floor = scene.meshes[0]
    count = floor.vertex_count
    colors = np.full((count, 3), (0.5, 0.25, 1.0))
    tangents = np.full((count, 4), (1.0, 0.0, 0.0, -1.0))
    scene.meshes[0] = camlux.Mesh("floor", floor.positions_m, floor.triangles, colors=colors, tangents=tangents)
    np.testing.assert_array_equal(scene.meshes[0].colors, colors.astype(np.float32))
    np.testing.assert_array_equal(scene.meshes[0].tangents, tangents.astype(np.float32))
    assert floor.colors.shape == (0, 3) and floor.tangents.shape == (0, 4) and floor.texcoords_1.shape == (0, 2)
    colored = renderer.render(scene)
    is_floor = plain["id.material"] == 1
    np.testing.assert_allclose(colored["direct"][is_floor], plain["direct"][is_floor] * (0.5, 0.25, 1.0), rtol=1e-4)


def test_a_loaded_material_loses_nothing(renderer, program, tmp_path):
    (tmp_path / "mesh.obj").write_text(
        "mtllib mesh.mtl\nv -1 0 1\nv 1 0 1\nv 0 0 -1\nvt 0 0\nvt 1 0\nvt .5 1\nusemtl m\nf 1/1 2/2 3/3\n"
    )
    stripes = "stripes.png"
    (tmp_path / "mesh.mtl").write_text(
        f"newmtl m\nKd .5 .5 .5\nKs .2 .2 .2\nNs 20\nmap_Kd -s 2 3 1 -o .1 .2 0 -clamp on {stripes}\nmap_Ks {stripes}\nmap_Ns {stripes}\n"
    )
    (tmp_path / stripes).write_bytes((SCENES / stripes).read_bytes())
    (tmp_path / "scene.toml").write_text(
        "[camera]\nresolution = [8, 8]\nposition = [0, 2, 2]\nlook_at = [0, 0, 0]\nup = [0, 1, 0]\nfov_y_deg = 50\n"
        '[[light]]\nkind = "point"\nposition = [0, 2, 0]\npower_w = 10\n[[mesh]]\npath = "mesh.obj"\n'
    )
    scene = camlux.Scene.load(tmp_path / "scene.toml")
    material = scene.materials[0]
    assert material.kd_texture.wrap == ("clamp", "clamp") and material.kd_texture.transform[0][0] == 2
    assert isinstance(material.ks_texture, camlux.Texture) and isinstance(material.shininess_texture, camlux.Texture)
    program("render", tmp_path / "scene.toml", "-o", tmp_path / "frame.exr")
    image = camlux.read_exr(tmp_path / "frame.exr")
    assert image.attributes["camlux.scene_hash"] == renderer.render(scene).scene_hash


def test_8_bit_textures_are_srgb_unless_they_say_otherwise(renderer, scene):
    floor = scene.meshes[0]
    scene.meshes[0] = camlux.Mesh("floor", floor.positions_m, floor.triangles, texcoords=np.zeros((4, 2)))
    scene.indirect = None
    values = []
    for encoding in ["linear", "srgb", None]:
        scene.materials[0].kd_texture = camlux.Texture("grey", np.full((1, 1, 3), 128, np.uint8), encoding=encoding)
        values.append(renderer.render(scene)["direct"].max(axis=(0, 1))[1])
    assert values[1] == values[2]
    assert values[1] / values[0] == pytest.approx(((128 / 255 + 0.055) / 1.055) ** 2.4 / (128 / 255), rel=1e-4)


def test_what_cannot_be_is_refused_where_it_is(renderer, scene):
    def refused(change, match, error=camlux.SceneError):
        import copy

        broken = copy.copy(scene)
        broken.camera, broken.lights, broken.materials = copy.copy(scene.camera), list(scene.lights), list(scene.materials)
        change(broken)
        with pytest.raises(error, match=match):
            renderer.render(broken)

    refused(lambda s: setattr(s.camera, "position_m", "here"), "camera: position_m is 'here'; give three numbers")
    refused(lambda s: setattr(s.camera, "fov_y_deg", None), "camera: the lens is missing or ambiguous; give one of")
    refused(lambda s: setattr(s.camera, "resolution_px", (0, 4)), "camera: resolution_px is 0 x 4")
    refused(lambda s: setattr(s.camera, "filter", "bix"), "filter is \"bix\"; give one of: box, gaussian")
    refused(lambda s: setattr(s, "camera", None), "scene: camera is None; give a camlux.Camera")
    refused(lambda s: setattr(s, "lights", 5), "scene: lights is <class 'int'>; give a list")
    refused(lambda s: s.lights.append(7), "light 1: is of <class 'int'>; give a PointLight")
    refused(lambda s: s.lights.append(camlux.PointLight((0, 0, 0), -1)), "light 1 .point.: power_w is")
    refused(lambda s: s.materials.clear(), "mesh 0 .\"floor\"")
    refused(lambda s: s.materials.append(camlux.Material("odd", kd=None)), "material 2: kd is None")
    refused(lambda s: setattr(s, "indirect", "final-gather"), "indirect: is of <class 'str'>; give a FinalGather")
    refused(lambda s: setattr(s, "indirect", camlux.FinalGather(7)), "target_error is 7")
    with pytest.raises(camlux.SceneError, match="mesh \"m\": triangles holds -1"):
        camlux.Mesh("m", [[0, 0, 0]], [[0, 0, -1]])
    with pytest.raises(camlux.SceneError, match=r"positions_m has the shape \[2, 2\]; give an array of the shape \(n, 3\)"):
        camlux.Mesh("m", [[0, 0], [1, 1]], [])
    with pytest.raises(camlux.SceneError, match="is an array of"):
        camlux.Mesh("m", [["a", "b", "c"]], [])
    with pytest.raises(camlux.SceneError, match="shape"):
        camlux.Texture("t", np.zeros((2, 2, 2)))
    for make in (lambda: camlux.Texture("t", np.zeros((2, 2)), encoding="gamma"), lambda: camlux.Pattern.load("lamp.ies", encoding="gamma")):
        with pytest.raises(camlux.SceneError, match="encoding is \"gamma\"; give"):
            make()
    with pytest.raises(camlux.SceneError, match="none.toml"):
        camlux.Scene.load("none.toml")
    with pytest.raises(camlux.SceneError, match="intensities has the shape"):
        camlux.Pattern([0, 180], [0, 360], [1, 2])
    with pytest.raises(camlux.SceneError, match="lamp.none"):
        camlux.Pattern.load("lamp.none")
    # The renderer still works.
    assert renderer.render(scene)["radiance"].max() > 0


def test_a_lamp_is_loaded():
    pattern = camlux.Pattern.load(SCENES / "lamp.ies")
    scene = camlux.Scene.load(SCENES / "lamp.toml")
    assert isinstance(scene.lights[0].pattern, type(pattern))


def test_warnings_are_python_warnings(renderer, scene):
    scene.materials[0].ks, scene.materials[0].shininess = 0.5, 20
    assert any("reflects more than it receives" in text for text in scene.warnings())
    scene.materials[0].ks = 0
    assert scene.warnings() == []
    scene.camera.look_at_m = (0, 1, 9)
    with pytest.warns(camlux.CamluxWarning, match="nothing is in view"):
        frame = renderer.render(scene)
    assert frame.warnings()


def test_a_lobe_needs_its_exponent(scene):
    scene.materials[0] = camlux.Material("floor", 0.5, ks=0.2)
    with pytest.raises(camlux.SceneError, match="shininess is None; set shininess"):
        scene.validate()
    scene.materials[0].shininess = 20.0
    scene.validate()


def test_warnings_of_a_file_are_shown_where_it_is_loaded(tmp_path, scene):
    scene.materials[0].kd, scene.materials[0].ks, scene.materials[0].shininess = 0.9, 0.5, 20
    scene.save(tmp_path)
    with pytest.warns(camlux.CamluxWarning, match="reflects more than it receives") as caught:
        camlux.Scene.load(tmp_path / "scene.toml")
    assert caught[0].filename == __file__
