"""A scene of plain Python objects, which you can change between two renders.

Lengths are metres, angles degrees, powers watts. A vector is three numbers: a tuple, a list or an array. A value per band is one number for
all bands, or three numbers for red, green and blue. Values are checked when the scene is rendered; docs/scene.md gives their meaning and limits.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias, Union

from . import _camlux
from ._camlux import Mesh, Pattern, ProjectedImage, Texture
from ._fields import Fields, knows_its_arguments
from .camera import Bands as Bands
from .camera import Camera as Camera
from .camera import FisheyeDistortion as FisheyeDistortion
from .camera import Intrinsics as Intrinsics
from .camera import Matrix as Matrix
from .camera import Number as Number
from .camera import Numbers as Numbers
from .camera import RationalDistortion as RationalDistortion
from .camera import Size as Size
from .camera import Vector as Vector
from .camera import Whole as Whole


@dataclass(slots=True, eq=False)
class PointLight(Fields):
    """Emits its power evenly over the sphere.

    position_m: position, m.
    power_w: power of each band, W.
    relative_to: camera: position and directions are in the camera's axes (x right, y down, z forward), and the light moves with it; None:
        they are in world space.
    """

    kind: ClassVar[str] = "point"
    position_m: Vector
    power_w: Bands
    relative_to: Literal["camera"] | None = None


@dataclass(slots=True, eq=False)
class DirectionalLight(Fields):
    """Parallel light.

    direction: in which the light travels; of any length.
    irradiance_w_m2: irradiance of each band on a surface that faces the light, W/m².
    relative_to: camera: the direction is in the camera's axes (x right, y down, z forward), and the light moves with it; None:
        it is in world space.
    """

    kind: ClassVar[str] = "directional"
    direction: Vector
    irradiance_w_m2: Bands
    relative_to: Literal["camera"] | None = None


@dataclass(slots=True, eq=False)
class PatternLight(Fields):
    """Emits its power with the measured pattern of a lamp, or as a projector.

    position_m: position, m.
    direction: of the lamp's axis, of any length.
    up: up in the projector's image, or the plane C = 0 of a lamp; of any length.
    pattern: of the lamp, or the projector's image.
    power_w: power of each band, W.
    relative_to: camera: position and directions are in the camera's axes (x right, y down, z forward), and the light moves with it; None:
        they are in world space.
    """

    kind: ClassVar[str] = "pattern"
    position_m: Vector
    direction: Vector
    up: Vector
    pattern: Pattern | ProjectedImage
    power_w: Bands
    relative_to: Literal["camera"] | None = None


@dataclass(slots=True, eq=False)
class AreaLight(Fields):
    """Emits its power evenly from the front of a rectangle or a disc.

    position_m: of its centre, m.
    direction: to which the front points; of any length.
    power_w: power of each band, W.
    size_m: width and height of a rectangle, m; None: a disc.
    radius_m: of a disc, m; None: a rectangle.
    up: along a rectangle's height; of any length. A rectangle needs it.
    relative_to: camera: position and directions are in the camera's axes (x right, y down, z forward), and the light moves with it; None:
        they are in world space.
    """

    kind: ClassVar[str] = "area"
    position_m: Vector
    direction: Vector
    power_w: Bands
    size_m: Numbers | None = None
    radius_m: Number | None = None
    up: Vector | None = None
    relative_to: Literal["camera"] | None = None


# lights: from the rows of the engine's parameters.


@dataclass(slots=True, eq=False)
class SpotLight(Fields):
    """Emits its power into a cone: evenly inside the inner half angle, and nothing outside the outer one.

    position_m: position, m.
    direction: of the axis, of any length.
    inner_half_angle_deg: θ_i, up to which the intensity is full, degrees from the axis; at most `outer_half_angle_deg`.
    outer_half_angle_deg: θ_o, beyond which there is no light, degrees from the axis. Limits: 0.0001 to 180.
    power_w: power of each band, W.
    relative_to: camera: position and directions are in the camera's axes (x right, y down, z forward), and the light moves with it; None:
        they are in world space.
    """

    kind: ClassVar[str] = "spot"
    position_m: Vector
    direction: Vector
    inner_half_angle_deg: Number
    outer_half_angle_deg: Number
    power_w: Bands
    relative_to: Literal["camera"] | None = None


Light: TypeAlias = Union[PointLight, SpotLight, DirectionalLight, PatternLight, AreaLight]


# End of lights.


Wrap: TypeAlias = Literal["repeat", "mirror", "clamp"]


@dataclass(slots=True, eq=False)
class TextureLookup(Fields):
    """A texture, and how a material looks it up. A plain texture is looked up by the mesh's `texcoords`, repeated and bilinear.

    texture: the texture.
    texcoord_set: 0: by the mesh's `texcoords`; 1: by its `texcoords_1`.
    transform: the rows of the affine transform from (u, v, 1) of the mesh to (u, v) of the texture.
    wrap: what is beyond 0 and 1, along u and v. repeat: the texels at an edge blend with those at the opposite edge; mirror: repeated, every
        second time mirrored; clamp: the texels at the edge, for a picture that covers a surface once.
    filter: between texels.
    """

    texture: Texture
    texcoord_set: Whole = 0
    transform: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: Literal["bilinear", "nearest"] = "bilinear"


@dataclass(slots=True, eq=False)
class Material(Fields):
    """Modified Phong: f = kd/π + ks·(shininess + 2)/(2π)·max(0, r·v)^shininess. Or a metallic-roughness surface, if `microfacets` are given.

    name: of the material.
    kd: diffuse reflectance of each band, 0 to 1. With microfacets, the base colour.
    ks: specular reflectance of each band, 0 to 1.
    shininess: Phong exponent, 0 or more; required where ks is above 0.
    kd_texture: multiplies kd.
    normal_texture: turns the normal. Red, green and blue from 0 to 1 stand for -1 to 1: along the direction in which u grows, across it on
        the side to which v grows, and along the normal of the mesh. The flat (128, 128, 255) of 8 bits tilts it by 0.32 degrees; floats of
        (0.5, 0.5, 1) are exactly flat.
    alpha_texture: cut-out: there is no surface where its alpha, or the brightness of a texture without alpha, is below
        `alpha_cutoff`.
    ks_texture: multiplies ks.
    shininess_texture: its brightness multiplies the shininess.
    alpha_cutoff: 0 to 1.
    microfacets: of a metallic-roughness surface, which has no ks and no shininess.
    metallic_roughness_texture: its green value multiplies the roughness, its blue value `metallic`.
    emission_w_sr_m2: radiance of each band that the surface emits in every direction, W/(sr·m²): from both sides, or from the
        front of a one-sided surface.
    emission_texture: multiplies emission_w_sr_m2.
    one_sided: whether the camera looks through the surface where it sees it from behind. The front is the side on which the corners of a
        triangle turn counterclockwise. Light meets both sides.
    """

    name: str
    kd: Bands
    ks: Bands = 0.0
    shininess: Number | None = None
    kd_texture: Texture | TextureLookup | None = None
    normal_texture: Texture | TextureLookup | None = None
    alpha_texture: Texture | TextureLookup | None = None
    ks_texture: Texture | TextureLookup | None = None
    shininess_texture: Texture | TextureLookup | None = None
    alpha_cutoff: Number = 0.5
    microfacets: MetallicRoughness | None = None
    metallic_roughness_texture: Texture | TextureLookup | None = None
    emission_w_sr_m2: Bands = 0.0
    emission_texture: Texture | TextureLookup | None = None
    one_sided: bool = False


# microfacets: from the rows of the engine's parameters.


@dataclass(slots=True, eq=False)
class MetallicRoughness(Fields):
    """A metallic-roughness surface, as in glTF 2.0: a Lambert base under microfacets (GGX). Metal reflects its base colour in the lobe and nothing else.

    roughness: how rough the surface is, to the eye. α of the facets is its square. Limits: 0.03 to 1.
    metallic: share of the surface that is metal. Limits: 0 to 1.
    ior: index of refraction where the surface is no metal. It reflects ((n−1)/(n+1))² straight on. Limits: 1 to 10.
    specular: factor of what the surface reflects straight on where it is no metal. Limits: 0 to 1.
    """

    roughness: Number
    metallic: Number = 0.0
    ior: Number = 1.5
    specular: Number = 1.0


# End of microfacets.


# sensor: from the rows of the engine's parameters.


@dataclass(slots=True, eq=False)
class SensorNoise(Fields):
    """The noise of a sensor, and its conversion of electrons to digital numbers (DN), after EMVA 1288. Each value of a pixel is a well of its own: for time of flight, each tap of a phase image.

    full_well_e: the most electrons that a well holds.
    dark_e_per_s: dark current of a well, electrons per second.
    read_noise_e: σ_r, the standard deviation of the read noise, electrons.
    gain_dn_per_e: DN per electron.
    black_level_dn: the DN of 0 electrons.
    bits: DN are from 0 to 2^bits − 1. Limits: 1 to 24.
    seed: each seed gives different noise.
    dsnu_e: dark signal non-uniformity (DSNU), electrons: standard deviation over the pixels of what a pixel adds to every reading. It
        depends on the seed, and stays from frame to frame.
    prnu: photo response non-uniformity (PRNU): standard deviation over the pixels of the factor of their quantum efficiency. It stays
        like `dsnu_e`. Limits: 0 to 1.
    """

    full_well_e: Number
    dark_e_per_s: Number = 0.0
    read_noise_e: Number = 0.0
    gain_dn_per_e: Number = 1.0
    black_level_dn: Number = 0.0
    bits: Whole = 12
    seed: Whole = 0
    dsnu_e: Number = 0.0
    prnu: Number = 0.0


@dataclass(slots=True, eq=False)
class Sensor(Fields):
    """Converts the radiance that a pixel sees to energy: Q_C = E_C · pixel area · duty cycle · exposure time.

    pixel_pitch_um: width and height of a pixel, micrometres. Limits: 0.01 to 1e6.
    exposure_time_s: of an image, or of each phase image of time of flight, seconds.
    duty_cycle: share of the exposure in which the signal is on. Limits: 0 to 1.
    wavelength_nm: λ of the light, nanometres. Electrons are counted with it and `quantum_efficiency`: time of flight and `noise` need
        both. Limits: 1 to 1e6.
    quantum_efficiency: η, electrons per photon. Limits: above 0, up to 1.
    f_number: focal length divided by the diameter of the aperture. Without it, E_C equals the radiance in number, as in the model.
    vignetting: k1, k2 and k3 of the measured vignetting, in place of cos⁴: 1 + k1·r² + k2·r⁴ + k3·r⁶, where r is the distance of a
        pixel's centre from the principal point over half the diagonal of the image, both in pixels. With an `f_number`. Limits: -10000
        to 10000.
    band_weights: factors of `quantum_efficiency` for light in the bands R, G and B. Time of flight has its own. Limits: 0 to 1e6.
    bayer: colour filters of the pixels, row by row from the upper left one: each pixel then counts the electrons of one band.
    monochrome: whether a pixel counts the electrons of all bands together.
    noise: how electrons are counted; None: layers hold expected values.
    """

    pixel_pitch_um: Numbers
    exposure_time_s: Number
    duty_cycle: Number = 1.0
    wavelength_nm: Number | None = None
    quantum_efficiency: Number | None = None
    f_number: Number | None = None
    vignetting: Numbers | None = None
    band_weights: Bands = (1.0, 1.0, 1.0)
    bayer: Literal["RGGB", "GRBG", "GBRG", "BGGR"] | None = None
    monochrome: bool = False
    noise: SensorNoise | None = None


# End of sensor.


@dataclass(slots=True, eq=False)
class TimeOfFlight(Fields):
    """Turns path lengths into the images of a time-of-flight camera. Requires a sensor with `wavelength_nm`.

    frequencies_hz: one to four modulation frequencies, Hz.
    contrasts: one for all frequencies, or one for each, 0 to 1.
    band_weights: the sensor's weights of red, green and blue.
    phase_count: number of phase images, 3 to 8.
    phase_offset_deg: added to every measured phase, degrees.
    ambient_lights: indices of lights that are not modulated.
    output: unit of the phase images.
    noise: of the sensor; None: no noise. "dn" needs it.
    """

    frequencies_hz: Numbers
    contrasts: Union[Number, Numbers] = 1.0
    band_weights: Bands = (1.0, 0.0, 0.0)
    phase_count: Whole = 4
    phase_offset_deg: Number = 0.0
    ambient_lights: Sequence[Whole] = ()
    output: Literal["electrons", "dn"] = "electrons"
    noise: SensorNoise | None = None


# indirect light: from the rows of the engine's parameters.


@dataclass(slots=True, eq=False)
class FinalGather(Fields):
    """One bounce or more by rays, refined to the target error.

    target_error: target error of the indirect light against the true bounces, relRMSE: sqrt(Σ(x−t)²/Σt²). 0.02 is 2 %. Limits: 0.002 to
        0.5.
    error_norm: what the target error applies to. image: all pixels at once, so bright pixels count most; local: tiles of the image, of
        which each with light has the same weight.
    rsm_size: texels along an edge of a face of the reflective shadow map (RSM). There is none: it sets the number of tiles through
        which a light sends rays. Without it, camlux chooses.
    max_ms: limit of the wall time of a frame from the call on, without compiling, ms. At a limit, the result is the best image so far;
        the least image with an estimate is always made. The image then depends on the speed of the device.
    max_rays: limit of the number of rays, like `max_ms`. The image does not depend on the speed of the device.
    stderr_layer: whether frames have the layer `stderr`.
    target_range_error_mm: with time of flight: target of the range error that the error of the bounce causes, rms over pixels, of the
        worst frequency, mm. `target_error` is then for the light alone; without it, `target_error` is also for the phasors. Limits: 0.1
        to 1000.
    bounces: largest number of surfaces that reflect light on its way from a light to what the camera sees. Limits: 1 to 16.
    """

    estimator: ClassVar[str] = "final-gather"
    target_error: Number = 0.02
    error_norm: Literal["image", "local"] = "image"
    rsm_size: Whole | None = None
    max_ms: Number | None = None
    max_rays: Whole | None = None
    stderr_layer: bool = False
    target_range_error_mm: Number | None = None
    bounces: Whole = 1


@dataclass(slots=True, eq=False)
class RsmAverage(Fields):
    """The average of the CamSim document over the texels of the reflective shadow map, without visibility.

    rsm_size: texels along an edge of a face of the reflective shadow map (RSM).
    interpolation_error: target error of the interpolation between pixels against the sum at every pixel, relRMSE. It does not limit the
        error of that sum against the true bounce. Without it, the sum is computed at every pixel. Limits: 0.002 to 0.5.
    """

    estimator: ClassVar[str] = "rsm-average"
    rsm_size: Whole = 64
    interpolation_error: Number | None = None


@dataclass(slots=True, eq=False)
class InstantRadiosity(Fields):
    """The sum over virtual point lights (VPLs), without visibility.

    rsm_size: texels along an edge of a face of the reflective shadow map (RSM).
    """

    estimator: ClassVar[str] = "instant-radiosity"
    rsm_size: Whole = 64


Indirect: TypeAlias = Union[FinalGather, RsmAverage, InstantRadiosity]


# End of indirect light.


@dataclass(slots=True, eq=False)
class Scene(Fields):
    """Everything that a frame is computed from.

    camera: the camera.
    lights: of any kinds. Without one, every frame is black.
    meshes: the layer `id.instance` numbers them from 1.
    materials: the layer `id.material` numbers them from 1; meshes name them by index, from 0.
    indirect: how the bounce is computed; None: direct light only.
    sensor: converts radiance to energy; None: frames have no layer `energy`.
    tof: time of flight; None: frames have no layers of it.
    shadow: how shadows are found; None: the better method for the scene.
    vignetting_map: measured vignetting as an image, (height, width), in place of `vignetting` of the sensor: light over that on the axis. It
        spans the image of the camera at any resolution. With an `f_number`.
    """

    camera: Camera
    lights: list[Light] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    indirect: Indirect | None = field(default_factory=FinalGather)
    sensor: Sensor | None = None
    tof: TimeOfFlight | None = None
    shadow: Literal["map", "rays"] | None = None
    vignetting_map: Matrix | None = None

    if TYPE_CHECKING:
        # Unlike the attributes, the arguments may be lists of one kind of light, which type checkers tell from lists of any kind.
        def __init__(
            self,
            camera: Camera,
            lights: Sequence[Light] = ...,
            meshes: Sequence[Mesh] = ...,
            materials: Sequence[Material] = ...,
            indirect: Indirect | None = ...,
            sensor: Sensor | None = None,
            tof: TimeOfFlight | None = None,
            shadow: Literal["map", "rays"] | None = None,
            vignetting_map: Matrix | None = None,
        ) -> None: ...

    @staticmethod
    @knows_its_arguments
    def load(path: str | os.PathLike[str]) -> Scene:
        """Loads a scene file and the meshes, materials and textures that it names.

        Raises SceneError with file and line. A light that the file defines relative to a mesh keeps its position from the file.
        """
        return _camlux.load_scene(path)

    @knows_its_arguments
    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes the scene to a folder: scene.toml, with its meshes, textures and patterns below.

        Scene.load(folder / "scene.toml") gives the same scene, bit by bit; `camlux render` and `camlux batch` read it as well.
        Raises SceneError for a scene that cannot be rendered, FileError if a file cannot be written.
        """
        _camlux.save_scene(self, folder)

    def validate(self) -> None:
        """Raises SceneError if the scene cannot be rendered. The message says what is wrong, where, and how to fix it."""
        _camlux.validate_scene(self)

    def warnings(self) -> list[str]:
        """Returns probable mistakes that do not prevent rendering, one sentence each."""
        return _camlux.scene_warnings(self)
