"""Names of fields, kinds of errors, help texts, and types."""

import dataclasses
import inspect
import pathlib
import runpy
import subprocess
import sys

import camlux
import numpy as np
import pytest

from conftest import SCENES

PARTS = [
    value
    for value in map(camlux.__dict__.get, camlux.__all__)
    if dataclasses.is_dataclass(value)
]


@pytest.mark.parametrize(("part", "name", "near"), [
    (lambda scene: scene.camera, "resolution", "did you mean resolution_px?"),
    (lambda scene: scene.camera, "fov", "did you mean fov_y_deg?"),
    (lambda scene: scene.lights[0], "power", "did you mean power_w?"),
    (lambda scene: scene.lights[0], "modulated", "it has position_m, power_w"),
    (lambda scene: scene.materials[0], "albedo", "did you mean kd?"),
    (lambda scene: scene.materials[0], "nonsense", "it has name, kd, ks"),
    (lambda scene: scene.indirect, "target", "did you mean target_error?"),
    (lambda scene: scene, "material", "did you mean materials?"),
])  # fmt: skip
def test_a_misspelt_field_is_refused_with_the_nearest(scene, part, name, near):
    part = part(scene)
    with pytest.raises(AttributeError, match=f"{type(part).__name__} has no field {name}; ") as caught:
        setattr(part, name, 1)
    assert near in str(caught.value) and isinstance(caught.value, camlux.Error)


@pytest.mark.parametrize(("use", "name", "near"), [
    (camlux.Material, "difuse", "kd"),
    (camlux.Material, "color", "kd"),
    (camlux.Material, "specular", "ks"),
    (camlux.Material, "normal", "normal_texture"),
    (camlux.Camera, "resolutoin", "resolution_px"),
    (camlux.Camera, "fov", "fov_y_deg"),
    (camlux.Camera, "target", "look_at_m"),
    (camlux.PointLight, "power", "power_w"),
    (camlux.FinalGather, "error", "target_error"),
    (camlux.TimeOfFlight, "frequency", "frequencies_hz"),
    (camlux.Scene, "light", "lights"),
    (camlux.Camera.from_matrix, "resolution", "resolution_px"),
    (camlux.Mesh, "vertices", "positions_m"),
    (camlux.Mesh.load, "sclae", "scale"),
    (camlux.Texture, "image", "pixels"),
    (camlux.Pattern, "gammas", "gammas_deg"),
    (camlux.Pattern.load, "encodnig", "encoding"),
    (camlux.ProjectedImage, "value", "values"),
    (camlux.Device, "validate", "validation"),
    (camlux.Renderer, "devise", "device"),
    (camlux.Scene.load, "file_path", "path"),
    (camlux.Dataset, "fodler", "folder"),
    (camlux.DatasetWriter, "layer", "layers"),
    (camlux.compare, "ref", "reference"),
    (camlux.run_job, "progres", "progress"),
])  # fmt: skip
def test_a_misspelt_argument_is_refused_with_the_nearest(use, name, near):
    # Even where arguments are missing.
    required = [] if use is not camlux.Pattern.load and use is not camlux.Mesh.load else ["none"]
    with pytest.raises(TypeError) as caught:
        use(*required, **{name: 1})
    assert f"{use.__qualname__} has no argument {name}; did you mean {near}?" in str(caught.value)
    assert isinstance(caught.value, camlux.ArgumentTypeError)


def test_methods_refuse_misspelt_arguments(renderer, scene, tmp_path):
    frame = renderer.render(scene)
    for use, message in [
        (lambda: renderer.render(scene, target_eror=0.1), "Renderer.render has no argument target_eror; did you mean target_error?"),
        (lambda: frame.save(tmp_path / "x.exr", layer="depth"), "Frame.save has no argument layer; did you mean layers?"),
        (lambda: scene.save(fodler=tmp_path), "Scene.save has no argument fodler; did you mean folder?"),
        (lambda: scene.meshes[0].posed(position=(0, 0, 0)), "Mesh.posed has no argument position; did you mean position_m?"),
        (lambda: camlux.reference(scene, stder=0.1), "reference has no argument stder; did you mean stderr?"),
        (lambda: dataclasses.replace(scene.camera, fov=3), "Camera has no argument fov; did you mean fov_y_deg?"),
    ]:
        with pytest.raises(camlux.ArgumentTypeError) as caught:
            use()
        assert str(caught.value) == message
    assert list(tmp_path.iterdir()) == []


def test_missing_arguments_are_named():
    for use, message in [
        (lambda: camlux.Mesh("m", [[0.0, 0, 0]]), "Mesh needs the argument triangles"),
        (lambda: camlux.Texture("t"), "Texture needs the argument pixels"),
        (lambda: camlux.ProjectedImage([[1.0]], fx=1, fy=1, cx=0), "ProjectedImage needs the argument cy"),
        (lambda: camlux.Material("m"), "missing 1 required positional argument: 'kd'"),
    ]:
        with pytest.raises(TypeError) as caught:
            use()
        assert message in str(caught.value)


@pytest.mark.parametrize(("change", "message"), [
    (lambda scene: setattr(scene, "lights", [camlux.PointLight]), "light 0: is the class PointLight; give an object of it: PointLight(...)"),
    (lambda scene: setattr(scene, "camera", camlux.Camera), "camera: is the class Camera"),
    (lambda scene: setattr(scene, "meshes", [camlux.Mesh]), "mesh 0: is the class Mesh"),
    (lambda scene: setattr(scene, "indirect", camlux.FinalGather), "indirect: is the class FinalGather"),
    (lambda scene: setattr(scene.materials[0], "kd_texture", camlux.Texture), "kd_texture: is the class Texture"),
    (lambda scene: setattr(scene, "lights", scene.lights[0]), "lights is <class 'camlux.scene.PointLight'>; give a list"),
    (lambda scene: setattr(scene.materials[0], "kd", True), "material 0: kd is True; give a number"),
    (lambda scene: setattr(scene.camera, "samples", True), "camera: samples is True; give a whole number"),
    (lambda scene: setattr(scene.camera, "fov_y_deg", True), "camera: fov_y_deg is True; give a number"),
    (lambda scene: setattr(scene.indirect, "stderr_layer", 1), "stderr_layer is 1; give True or False"),
])  # fmt: skip
def test_wrong_types_in_a_scene_are_refused(scene, change, message):
    change(scene)
    with pytest.raises(TypeError) as caught:
        scene.validate()
    assert message in str(caught.value) and isinstance(caught.value, camlux.SceneTypeError)


@pytest.mark.parametrize("part", PARTS)
def test_every_class_refuses_names_that_it_does_not_have(part):
    one = part.__new__(part)
    with pytest.raises(camlux.FieldError, match="has no field nonsense"):
        one.nonsense = 1
    assert not hasattr(one, "__dict__")
    with pytest.raises(TypeError):
        part(nonsense=1)


@pytest.mark.parametrize("part", PARTS)
def test_help_explains_every_field(part):
    text = part.__doc__
    explained = [name.strip() for line in text.splitlines() if ":" in line for name in line.split(":")[0].split(",")]
    assert {field.name for field in dataclasses.fields(part)} <= set(explained)
    # The defaults.
    assert all(f"{name}" in str(inspect.signature(part)) for name in explained if name in inspect.signature(part).parameters)


def test_help_explains_every_method_and_property():
    for name in camlux.__all__:
        value = getattr(camlux, name)
        if name == "__version__":
            continue
        assert value.__doc__, name
        if isinstance(value, type) and not issubclass(value, BaseException) and not hasattr(value, "_fields"):
            for member, defined in vars(value).items():
                if not member.startswith("_") and (callable(defined) or isinstance(defined, (property, staticmethod)) or inspect.isgetsetdescriptor(defined)):
                    assert defined.__doc__, f"{name}.{member}"


def test_errors_speak_of_fields_not_of_keys(scene):
    def refused(change, *words):
        change()
        with pytest.raises(camlux.SceneError) as caught:
            scene.validate()
        for word in words:
            assert word in str(caught.value), str(caught.value)
        for key in ["[sensor", "[tof", "phases", "modulated =", "::", "toml"]:
            assert key not in str(caught.value), str(caught.value)

    scene.sensor = camlux.Sensor((3, 3), 1e-3)
    scene.tof = camlux.TimeOfFlight([20e6], [1], 1.0)
    refused(lambda: None, "give the sensor a wavelength_nm and a quantum_efficiency")
    scene.sensor.wavelength_nm, scene.sensor.quantum_efficiency = 850, 0.4
    refused(lambda: setattr(scene.tof, "phase_count", 2), "phase_count is 2")
    scene.tof.phase_count = 4
    refused(lambda: setattr(scene.tof, "output", "dn"), "give the time of flight its noise")
    scene.tof.output = "electrons"
    refused(lambda: scene.lights.append(camlux.DirectionalLight((0, -1, 0), 1)), "list it in ambient_lights")
    scene.lights.pop()
    refused(lambda: setattr(scene.camera, "look_at_m", scene.camera.position_m), "position_m and look_at_m are both")
    scene.camera.look_at_m = (0, 0, 0)
    refused(lambda: setattr(scene.camera, "resolution_px", (0, 4)), "resolution_px is 0 x 4")


def test_errors_are_also_pythons(renderer, scene, tmp_path):
    with pytest.raises(ValueError, match="resolution_px") as caught:
        scene.camera.resolution_px = (0, 1)
        renderer.render(scene)
    assert isinstance(caught.value, camlux.SceneError)
    scene.camera.resolution_px = (4, 4)
    (tmp_path / "broken.exr").write_bytes(b"no image")
    for error, expected, use in [
        (camlux.MissingSceneFileError, (FileNotFoundError, camlux.SceneError, ValueError), lambda: camlux.Scene.load("none.toml")),
        (camlux.MissingSceneFileError, FileNotFoundError, lambda: camlux.Pattern.load("none.ies")),
        (camlux.MissingSceneFileError, FileNotFoundError, lambda: camlux.Mesh.load("none.obj")),
        (camlux.MissingFileError, FileNotFoundError, lambda: camlux.read_exr("none.exr")),
        (camlux.MissingFileError, FileNotFoundError, lambda: camlux.Dataset(tmp_path)),
        (camlux.MissingFileError, OSError, lambda: renderer.render(scene).save(tmp_path / "none" / "file.exr")),
        (camlux.FileError, OSError, lambda: camlux.read_exr(tmp_path / "broken.exr")),
        (camlux.DeviceError, RuntimeError, lambda: camlux.Device("no such device")),
        (camlux.LayerError, KeyError, lambda: renderer.render(scene)["colour"]),
        (camlux.ArgumentError, ValueError, lambda: renderer.render(scene, layers=["colour"])),
        (camlux.ArgumentError, ValueError, lambda: camlux.compare(np.ones((2, 2)), np.ones((2, 3)))),
    ]:
        with pytest.raises(error) as caught:
            use()
        for base in [camlux.Error, *(expected if isinstance(expected, tuple) else [expected])]:
            assert isinstance(caught.value, base)
        assert "\\n" not in str(caught.value) and not str(caught.value).startswith("'")


@pytest.mark.parametrize(("use", "message"), [
    (lambda renderer, scene, path: renderer.render(scene, seed=-1), "seed is -1; give a whole number from 0"),
    (lambda renderer, scene, path: renderer.render(scene, seed=1.5), "seed is 1.5; give a whole number"),
    (lambda renderer, scene, path: renderer.render(scene, seed=True), "seed is True; give a whole number"),
    (lambda renderer, scene, path: renderer.render(scene, target_error="2%"), "target_error is '2%'; give a number, such as 0.02 for 2 %"),
    (lambda renderer, scene, path: camlux.reference(scene, stderr="1%"), "stderr is '1%'; give a number, such as 0.01 for 1 %"),
    (lambda renderer, scene, path: camlux.Mesh("m", np.zeros((3, 3)), np.array([[True, False, True]])), "triangles is an array of bool; give whole numbers"),
    (lambda renderer, scene, path: camlux.Mesh("m", np.zeros((3, 3)), [[0, 1, 2]], material=True), "material is an array of bool"),
    (lambda renderer, scene, path: camlux.Mesh("m", np.zeros((3, 3), bool), [[0, 1, 2]]), "positions_m is an array of bool; give numbers"),
    (lambda renderer, scene, path: camlux.Texture(3, [[1.0]]), "name is 3; give a string"),
    (lambda renderer, scene, path: renderer.render(scene, frame_index=2**40), "frame_index is 1099511627776; give a whole number"),
    (lambda renderer, scene, path: renderer.render(scene, layers=5), "layers is <class 'int'>; give a list of names"),
    (lambda renderer, scene, path: renderer.render(scene, layers="colour"), 'there is no layer "colour"'),
    (lambda renderer, scene, path: renderer.render(scene, progress=5), "progress is <class 'int'>; give a function, or True"),
    (lambda renderer, scene, path: renderer.render(scene).save_png(path / "x.jpg"), "writes .png files; end the path with .png"),
    (lambda renderer, scene, path: renderer.render(scene).save(path / "x.png"), "writes .exr files; end the path with .exr"),
    (lambda renderer, scene, path: camlux.Mesh("m", np.zeros((3, 3)), np.array([[0.0, 1.0, 2.0]])), "triangles is an array of float64; give whole numbers"),
    (lambda renderer, scene, path: camlux.Mesh("m", np.zeros((3, 3)), [[0, 1, 2]], material=0.5), "material is an array of float64; give whole numbers"),
    (lambda renderer, scene, path: scene.meshes[0].posed((1, 2)), "position_m is (1, 2); give 3 numbers"),
    (lambda renderer, scene, path: camlux.Device(1.5), "choice is 1.5; give a whole number"),
    (lambda renderer, scene, path: camlux.Mesh.load(SCENES / "cornell.obj", first_material=-1), "first_material is -1"),
])  # fmt: skip
def test_wrong_arguments_are_refused(renderer, scene, tmp_path, use, message):
    with pytest.raises(ValueError) as caught:
        use(renderer, scene, tmp_path)
    assert message in str(caught.value) and isinstance(caught.value, camlux.Error)
    assert list(tmp_path.iterdir()) == []


def test_values_of_a_wrong_type_are_type_errors(renderer, scene):
    for use in [
        lambda: renderer.render(scene, seed=True),
        lambda: renderer.render(scene, target_error="2%"),
        lambda: renderer.render(scene, layers=5),
        lambda: renderer.render(scene, progress=5),
        lambda: camlux.Mesh("m", np.zeros((3, 3)), np.array([[True, False, True]])),
        lambda: camlux.Texture("t", np.zeros((2, 2), bool)),
    ]:
        with pytest.raises(TypeError) as caught:
            use()
        assert isinstance(caught.value, camlux.Error)


def test_a_preview_needs_the_radiance_alone(renderer, scene, tmp_path):
    with pytest.raises(camlux.LayerError) as caught:
        renderer.render(scene, layers=["depth", "N"]).save_png(tmp_path / "x.png")
    assert 'x.png: a preview shows the layer "radiance", and the frame has only N, depth; render it with' in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    renderer.render(scene, layers=["radiance", "indirect"]).save_png(tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 100


def test_one_layer_is_named_without_a_list(renderer, scene, tmp_path):
    frame = renderer.render(scene, layers="depth")
    assert frame.keys() == ["depth"]
    renderer.render(scene).save(tmp_path / "one.exr", layers="depth")
    assert camlux.read_exr(tmp_path / "one.exr").keys() == ["depth"]


def test_what_has_types_runs():
    runpy.run_path(str(pathlib.Path(__file__).with_name("types_of_users.py")))


def test_the_import_is_light():
    code = "import sys, camlux; print([name for name in ('tqdm', 'difflib', 'matplotlib', 'multiprocessing', 'subprocess', 'tempfile', 'hashlib', 'base64') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
