"""camlux computes how a light illuminates what a camera sees, in physical units.

    import camlux

    scene = camlux.Scene.load("scenes/cornell.toml")
    frame = camlux.Renderer().render(scene, target_error=0.02)
    frame["radiance"]             # (height, width, 3), float32
    frame.units["radiance"]       # W/sr/m^2
    frame.stats.estimated_error   # of the indirect light, relative to the true bounce

Scenes are plain objects (camlux.scene). You load them from a file or build them from arrays. docs/python.md is the manual.
"""

from collections.abc import Mapping as _Mapping

from ._camlux import (
    Comparison,
    Device,
    DeviceInfo,
    Frame,
    FrameStats,
    Image,
    Mesh,
    Pattern,
    Progress,
    ProjectedImage,
    Renderer,
    Texture,
    __version__,
    devices,
    read_exr,
    reference,
)
from ._camlux import Layers as _Layers
from ._layers import Points
from .comparison import compare
from .dataset import Dataset, DatasetFrame
from .errors import (
    ArgumentError,
    ArgumentTypeError,
    CamluxWarning,
    Cancelled,
    DeviceError,
    DeviceLostError,
    Error,
    FieldError,
    FileError,
    LayerError,
    MissingFileError,
    MissingSceneFileError,
    SceneError,
    SceneTypeError,
    UnsupportedError,
)
from .job import run_job
from .scene import (
    AreaLight,
    Camera,
    DirectionalLight,
    FinalGather,
    FisheyeDistortion,
    InstantRadiosity,
    Intrinsics,
    Material,
    MetallicRoughness,
    PatternLight,
    PointLight,
    RationalDistortion,
    RsmAverage,
    Scene,
    Sensor,
    SensorNoise,
    SpotLight,
    TextureLookup,
    TimeOfFlight,
)
from .writer import DatasetWriter

_Mapping.register(_Layers)  # pyright: ignore[reportAttributeAccessIssue]

__all__ = [
    "AreaLight",
    "ArgumentError",
    "ArgumentTypeError",
    "Camera",
    "CamluxWarning",
    "Cancelled",
    "Comparison",
    "Dataset",
    "DatasetFrame",
    "DatasetWriter",
    "Device",
    "DeviceError",
    "DeviceInfo",
    "DeviceLostError",
    "DirectionalLight",
    "Error",
    "FieldError",
    "FileError",
    "FinalGather",
    "FisheyeDistortion",
    "Frame",
    "FrameStats",
    "Image",
    "InstantRadiosity",
    "Intrinsics",
    "LayerError",
    "Material",
    "Mesh",
    "MetallicRoughness",
    "MissingFileError",
    "MissingSceneFileError",
    "Pattern",
    "PatternLight",
    "PointLight",
    "Points",
    "Progress",
    "ProjectedImage",
    "RationalDistortion",
    "Renderer",
    "RsmAverage",
    "Scene",
    "SceneError",
    "SceneTypeError",
    "Sensor",
    "SensorNoise",
    "SpotLight",
    "Texture",
    "TextureLookup",
    "TimeOfFlight",
    "UnsupportedError",
    "__version__",
    "compare",
    "devices",
    "read_exr",
    "reference",
    "run_job",
]
