"""What is lit: a scene of plain Python objects, which can be changed between two renders.

Lengths are metres, angles degrees, powers watts. A vector is three numbers: a tuple, a list or an array. A value per band is one number for
all, or three, of red, green and blue. Values are checked when the scene is rendered; docs/scene.md says what each means, and its limits.
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
    """The rational lens model of OpenCV, with its coefficients."""

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
    """The fisheye lens model of OpenCV, with its coefficients."""

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0


@dataclass
class Camera:
    """A camera: resolution (width, height), where it is, what it looks at, and its lens by one of `fov_y_deg` and `intrinsics_px`."""

    resolution_px: tuple[int, int]
    position_m: Vector
    look_at_m: Vector
    up: Vector = (0.0, 1.0, 0.0)
    fov_y_deg: float | None = None
    intrinsics_px: Intrinsics | None = None
    #: Needs `intrinsics_px`.
    distortion: RationalDistortion | FisheyeDistortion | None = None
    #: Light is averaged over as many points of a pixel; 1: a pixel shows what lies at its centre.
    samples: int = 1
    #: What they are weighted with; None: the usual one.
    filter: Literal["box", "gaussian"] | None = None


@dataclass
class PointLight:
    """Emits its power evenly over the sphere."""

    kind: ClassVar[str] = "point"
    position_m: Vector
    power_w: Bands


@dataclass
class SpotLight:
    """Emits its power into a cone: evenly up to the inner half angle, and nothing beyond the outer one."""

    kind: ClassVar[str] = "spot"
    position_m: Vector
    direction: Vector
    inner_half_angle_deg: float
    outer_half_angle_deg: float
    power_w: Bands


@dataclass
class DirectionalLight:
    """Parallel light: the irradiance on a surface that faces it, W/m²."""

    kind: ClassVar[str] = "directional"
    direction: Vector
    irradiance_w_m2: Bands


@dataclass
class PatternLight:
    """Emits its power as a lamp was measured to do, or as a projector. `up` is up in the projector's image."""

    kind: ClassVar[str] = "pattern"
    position_m: Vector
    direction: Vector
    up: Vector
    pattern: Pattern | ProjectedImage
    power_w: Bands


@dataclass
class AreaLight:
    """Emits its power from every point of a rectangle (`size_m`: width, height) or a disc (`radius_m`) alike, to its front."""

    kind: ClassVar[str] = "area"
    position_m: Vector
    direction: Vector
    power_w: Bands
    size_m: tuple[float, float] | None = None
    radius_m: float | None = None
    #: Along the height of a rectangle.
    up: Vector | None = None


Light: TypeAlias = Union[PointLight, SpotLight, DirectionalLight, PatternLight, AreaLight]


@dataclass
class Material:
    """Modified Phong: f = kd/π + ks·(shininess + 2)/(2π)·max(0, r·v)^shininess."""

    name: str
    kd: Bands
    ks: Bands = 0.0
    shininess: float = 1.0
    #: Multiplies kd.
    kd_texture: Texture | None = None
    normal_texture: Texture | None = None
    #: There is no surface where its first channel is below 1/2.
    alpha_texture: Texture | None = None


@dataclass
class Sensor:
    """Turns radiance into the energy on a pixel."""

    #: Width, height.
    pixel_pitch_um: tuple[float, float]
    exposure_time_s: float
    #: Share of the exposure in which the signal is on, 0 to 1.
    duty_cycle: float = 1.0
    #: For time of flight, with `quantum_efficiency`.
    wavelength_nm: float | None = None
    quantum_efficiency: float | None = None
    #: Focal length over the diameter of the aperture; None: the irradiance is the radiance by number.
    f_number: float | None = None


@dataclass
class SensorNoise:
    """The noise of a time-of-flight sensor. Electrons are those of one tap in one phase image."""

    dark_e_per_s: float
    read_noise_e: float
    full_well_e: float
    gain_dn_per_e: float
    black_level_dn: float
    bits: int
    seed: int = 0


@dataclass
class TimeOfFlight:
    """What a time-of-flight camera makes of path lengths. Needs a sensor with `wavelength_nm`."""

    frequencies_hz: Sequence[float]
    #: One for each frequency, 0 to 1.
    contrasts: Sequence[float]
    #: What the sensor takes of red, green and blue.
    band_weights: Bands
    phase_count: int = 4
    phase_offset_deg: float = 0.0
    #: Indices of lights that are not modulated.
    ambient_lights: Sequence[int] = ()
    output: Literal["electrons", "dn"] = "electrons"
    noise: SensorNoise | None = None


@dataclass
class FinalGather:
    """Single bounce by rays, as exact as the target error: relRMSE of the indirect light, 0.002 to 0.5."""

    estimator: ClassVar[str] = "final-gather"
    target_error: float = 0.02
    error_norm: Literal["image", "local"] = "image"
    #: Texels along an edge of a face of the reflective shadow map; None: as many as the error takes.
    rsm_size: int | None = None
    #: Limits, of which the best image so far is the result.
    max_ms: float | None = None
    max_rays: int | None = None
    #: Whether frames have the layer `stderr`.
    stderr_layer: bool = False


@dataclass
class RsmAverage:
    """CamSim's average over the texels of the reflective shadow map; visibility is not part of it."""

    estimator: ClassVar[str] = "rsm-average"
    rsm_size: int = 64
    interpolation_error: float | None = None


@dataclass
class InstantRadiosity:
    """CamSim's sum over virtual point lights; visibility is not part of it."""

    estimator: ClassVar[str] = "instant-radiosity"
    rsm_size: int = 64


Indirect: TypeAlias = Union[FinalGather, RsmAverage, InstantRadiosity]


@dataclass
class Scene:
    """Everything that a frame is computed from.

    `indirect=None` is direct light alone, `shadow=None` the better way for the scene. The layer `id.instance` counts `meshes` from 1,
    `id.material` counts `materials`.
    """

    camera: Camera
    lights: list[Light] = field(default_factory=list)
    meshes: list[Mesh] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    indirect: Indirect | None = field(default_factory=FinalGather)
    sensor: Sensor | None = None
    tof: TimeOfFlight | None = None
    shadow: Literal["map", "rays"] | None = None
    #: Of a scene file whose lights are relative to its camera: their indices, and the camera for which `lights` has their places. They
    #: move along when `camera` is another.
    carried_by_camera: tuple[Sequence[int], Camera] | None = None

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Scene:
        """Loads a scene file with the meshes, materials and textures that it names.

        Raises SceneError with file and line. A light that the file has relative to a mesh stays where the file puts it.
        """
        return _camlux.load_scene(path)

    def validate(self) -> None:
        """Raises SceneError for what cannot be rendered, with what is wrong, where, and how to mend it."""
        _camlux.validate_scene(self)

    def warnings(self) -> list[str]:
        """What can be rendered but is probably not meant, one sentence each."""
        return _camlux.scene_warnings(self)
