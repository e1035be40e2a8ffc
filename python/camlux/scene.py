"""A scene of plain Python objects, which you can change between two renders.

Lengths are metres, angles degrees, powers watts. A vector is three numbers: a tuple, a list or an array. A value per band is one number for
all bands, or three numbers for red, green and blue. Values are checked when the scene is rendered; docs/scene.md gives their meaning and limits.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from . import _camlux
from ._camlux import Mesh, Pattern, ProjectedImage, Texture

Vector: TypeAlias = Union[Sequence[float], npt.NDArray[np.floating]]
Bands: TypeAlias = Union[float, Sequence[float], npt.NDArray[np.floating]]


@dataclass
class Intrinsics:
    """Focal lengths and principal point, pixels; the centre of the first pixel is at (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float


@dataclass
class RationalDistortion:
    """The rational lens model of OpenCV and its coefficients."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0


@dataclass
class FisheyeDistortion:
    """The fisheye lens model of OpenCV and its coefficients."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0


@dataclass
class Camera:
    """A camera: resolution (width, height), position, target, and a lens given by either `fov_y_deg` or `intrinsics_px`."""

    resolution_px: tuple[int, int]
    position_m: Vector
    look_at_m: Vector
    up: Vector = (0.0, 1.0, 0.0)
    fov_y_deg: float | None = None
    intrinsics_px: Intrinsics | None = None
    #: Requires `intrinsics_px`.
    distortion: RationalDistortion | FisheyeDistortion | None = None
    #: Number of points per pixel over which light is averaged; 1: a pixel shows what is at its centre.
    samples: int = 1
    #: Filter that weights the points; None: the default.
    filter: Literal["box", "gaussian"] | None = None


@dataclass
class PointLight:
    """Emits its power evenly over the sphere."""

    kind: ClassVar[str] = "point"
    position_m: Vector
    power_w: Bands


@dataclass
class SpotLight:
    """Emits its power into a cone: evenly inside the inner half angle, and nothing outside the outer one."""

    kind: ClassVar[str] = "spot"
    position_m: Vector
    direction: Vector
    inner_half_angle_deg: float
    outer_half_angle_deg: float
    power_w: Bands


@dataclass
class DirectionalLight:
    """Parallel light, given by the irradiance on a surface that faces it, W/m²."""

    kind: ClassVar[str] = "directional"
    direction: Vector
    irradiance_w_m2: Bands


@dataclass
class PatternLight:
    """Emits its power with the measured pattern of a lamp, or as a projector. `up` is the up direction of the projector's image."""

    kind: ClassVar[str] = "pattern"
    position_m: Vector
    direction: Vector
    up: Vector
    pattern: Pattern | ProjectedImage
    power_w: Bands


@dataclass
class AreaLight:
    """Emits its power evenly from the front of a rectangle (`size_m`: width, height) or a disc (`radius_m`)."""

    kind: ClassVar[str] = "area"
    position_m: Vector
    direction: Vector
    power_w: Bands
    size_m: tuple[float, float] | None = None
    radius_m: float | None = None
    #: Direction of a rectangle's height.
    up: Vector | None = None


Light: TypeAlias = Union[PointLight, SpotLight, DirectionalLight, PatternLight, AreaLight]


Wrap: TypeAlias = Literal["repeat", "mirror", "clamp"]


@dataclass
class TextureLookup:
    """A texture, and how a material looks it up. A plain texture is looked up by the mesh's `texcoords`, repeated and bilinear."""

    texture: Texture
    #: 0: by the mesh's `texcoords`; 1: by its `texcoords_1`.
    texcoord_set: int = 0
    #: The rows of the affine transform from (u, v, 1) of the mesh to (u, v) of the texture.
    transform: Sequence[Sequence[float]] | npt.NDArray[np.floating] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    #: What is beyond 0 and 1, along u and v. "mirror": repeated, every second time mirrored; "clamp": the texels at the edge.
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    filter: Literal["bilinear", "nearest"] = "bilinear"


@dataclass
class Material:
    """Modified Phong: f = kd/π + ks·(shininess + 2)/(2π)·max(0, r·v)^shininess."""

    name: str
    kd: Bands
    ks: Bands = 0.0
    shininess: float = 1.0
    #: Multiplies kd.
    kd_texture: Texture | TextureLookup | None = None
    normal_texture: Texture | TextureLookup | None = None
    #: Cut-out: there is no surface where its first channel is below `alpha_cutoff`.
    alpha_texture: Texture | TextureLookup | None = None
    #: Multiplies ks.
    ks_texture: Texture | TextureLookup | None = None
    #: Its first channel multiplies the shininess.
    shininess_texture: Texture | TextureLookup | None = None
    #: 0 to 1.
    alpha_cutoff: float = 0.5


@dataclass
class Sensor:
    """Converts radiance to the energy on a pixel."""

    #: Width, height.
    pixel_pitch_um: tuple[float, float]
    exposure_time_s: float
    #: Share of the exposure in which the signal is on, 0 to 1.
    duty_cycle: float = 1.0
    #: Required for time of flight, together with `quantum_efficiency`.
    wavelength_nm: float | None = None
    quantum_efficiency: float | None = None
    #: Focal length divided by aperture diameter; None: the irradiance has the same number as the radiance.
    f_number: float | None = None


@dataclass
class SensorNoise:
    """The noise of a time-of-flight sensor. Electrons are counted per tap and phase image."""

    dark_e_per_s: float
    read_noise_e: float
    full_well_e: float
    gain_dn_per_e: float
    black_level_dn: float
    bits: int
    seed: int = 0


@dataclass
class TimeOfFlight:
    """Turns path lengths into the images of a time-of-flight camera. Requires a sensor with `wavelength_nm`."""

    frequencies_hz: Sequence[float]
    #: One for each frequency, 0 to 1.
    contrasts: Sequence[float]
    #: The sensor's weights of red, green and blue.
    band_weights: Bands
    phase_count: int = 4
    phase_offset_deg: float = 0.0
    #: Indices of lights that are not modulated.
    ambient_lights: Sequence[int] = ()
    output: Literal["electrons", "dn"] = "electrons"
    noise: SensorNoise | None = None


@dataclass
class FinalGather:
    """Single bounce by rays, refined to the target error: relRMSE of the indirect light, 0.002 to 0.5."""

    estimator: ClassVar[str] = "final-gather"
    target_error: float = 0.02
    error_norm: Literal["image", "local"] = "image"
    #: Texels along an edge of a face of the reflective shadow map (RSM); None: chosen from the target error.
    rsm_size: int | None = None
    #: Time and ray limits. At a limit, the result is the best image so far.
    max_ms: float | None = None
    max_rays: int | None = None
    #: Whether frames have the layer `stderr`.
    stderr_layer: bool = False


@dataclass
class RsmAverage:
    """CamSim's average over the texels of the reflective shadow map, without visibility."""

    estimator: ClassVar[str] = "rsm-average"
    rsm_size: int = 64
    interpolation_error: float | None = None


@dataclass
class InstantRadiosity:
    """CamSim's sum over virtual point lights (VPLs), without visibility."""

    estimator: ClassVar[str] = "instant-radiosity"
    rsm_size: int = 64


Indirect: TypeAlias = Union[FinalGather, RsmAverage, InstantRadiosity]


@dataclass
class Scene:
    """Everything that a frame is computed from.

    `indirect=None` renders direct light only. `shadow=None` chooses the better shadow method for the scene. The layer `id.instance` numbers
    `meshes` from 1; `id.material` numbers `materials` from 1.
    """

    camera: Camera
    lights: list[Light] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    indirect: Indirect | None = field(default_factory=FinalGather)
    sensor: Sensor | None = None
    tof: TimeOfFlight | None = None
    shadow: Literal["map", "rays"] | None = None
    #: For scene files with lights relative to the camera: the indices of these lights, and the camera that their positions in `lights`
    #: belong to. If `camera` differs from it, the lights move along.
    carried_by_camera: tuple[Sequence[int], Camera] | None = None

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Scene:
        """Loads a scene file and the meshes, materials and textures that it names.

        Raises SceneError with file and line. A light that the file defines relative to a mesh keeps its position from the file.
        """
        return _camlux.load_scene(path)

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
