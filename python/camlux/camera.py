"""Cameras and their lenses, and the types of numbers that scenes take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from ._fields import Fields, knows_its_arguments
from .errors import SceneError

#: A number of Python or numpy.
Number: TypeAlias = Union[float, np.floating, np.integer]
#: A whole number of Python or numpy.
Whole: TypeAlias = Union[int, np.integer]
#: Width, height.
Size: TypeAlias = Union[Sequence[Whole], npt.NDArray[np.integer]]
Numbers: TypeAlias = Union[Sequence[Number], npt.NDArray[Union[np.floating, np.integer]]]
#: x, y, z.
Vector: TypeAlias = Numbers
#: One number for all bands, or red, green and blue.
Bands: TypeAlias = Union[Number, Numbers]
#: Rows of numbers, such as a list of lists or an array.
Matrix: TypeAlias = Union[Sequence[Numbers], npt.NDArray[Union[np.floating, np.integer]]]


@dataclass(slots=True, eq=False)
class Intrinsics(Fields):
    """A lens without distortion. The centre of the first pixel is at (0.5, 0.5).

    fx, fy: focal lengths, pixels.
    cx, cy: principal point, pixels.
    skew: by how much a point one focal length lower is farther right, pixels.
    """

    fx: Number
    fy: Number
    cx: Number
    cy: Number
    skew: Number = 0.0


@dataclass(slots=True, eq=False)
class RationalDistortion(Fields):
    """The rational lens model of OpenCV. `RationalDistortion(*vector)` takes OpenCV's vector of 4, 5, 8, 12 or 14 numbers.

    k1, k2, k3: radial coefficients.
    p1, p2: tangential coefficients.
    k4, k5, k6: radial coefficients of the denominator.
    s1, s2, s3, s4: coefficients of a thin prism.
    tau_x, tau_y: tilt of the sensor, radians.
    """

    k1: Number = 0.0
    k2: Number = 0.0
    p1: Number = 0.0
    p2: Number = 0.0
    k3: Number = 0.0
    k4: Number = 0.0
    k5: Number = 0.0
    k6: Number = 0.0
    s1: Number = 0.0
    s2: Number = 0.0
    s3: Number = 0.0
    s4: Number = 0.0
    tau_x: Number = 0.0
    tau_y: Number = 0.0


@dataclass(slots=True, eq=False)
class FisheyeDistortion(Fields):
    """The fisheye lens model of OpenCV.

    k1, k2, k3, k4: its coefficients.
    """

    k1: Number = 0.0
    k2: Number = 0.0
    k3: Number = 0.0
    k4: Number = 0.0


@dataclass(slots=True, eq=False)
class Camera(Fields):
    """A camera by position and target, or by `Camera.from_matrix`, with a lens by one of `fov_x_deg`, `fov_y_deg`,
    `intrinsics_px` and `projection`.

    resolution_px: width, height, pixels.
    position_m: position, m.
    look_at_m: a point in the middle of the view, m.
    up: a direction that the image shows upwards; of any length.
    fov_y_deg: full angle of view from top to bottom, degrees. Pixels are square.
    fov_x_deg: likewise from left to right.
    intrinsics_px: focal lengths, principal point and skew, pixels.
    distortion: of the lens; it needs `intrinsics_px`.
    samples: number of points of a pixel over which light is averaged, up to 4096; 1: a pixel shows what is at its centre.
    filter: weights these points; None: box.
    projection: "equirectangular": all directions, 360° of longitude from left to right and 180° of latitude from top to bottom.
        "orthographic": parallel rays along the view, from the plane through `position_m`; it needs `height_m`.
    height_m: height of the image of an orthographic camera, m. Pixels are square.
    """

    resolution_px: Size
    position_m: Vector
    look_at_m: Vector
    up: Vector = (0.0, 1.0, 0.0)
    fov_y_deg: Number | None = None
    intrinsics_px: Intrinsics | None = None
    distortion: RationalDistortion | FisheyeDistortion | None = None
    samples: Whole = 1
    filter: Literal["box", "gaussian"] | None = None
    fov_x_deg: Number | None = None
    projection: Literal["equirectangular", "orthographic"] | None = None
    height_m: Number | None = None

    @staticmethod
    @knows_its_arguments
    def from_matrix(
        camera_to_world: Matrix,
        intrinsics: Matrix,
        resolution_px: Size,
        *,
        axes: Literal["opencv", "opengl"] = "opencv",
        distortion: RationalDistortion | FisheyeDistortion | None = None,
        samples: Whole = 1,
        filter: Literal["box", "gaussian"] | None = None,
    ) -> Camera:
        """A camera from a pose and an intrinsic matrix.

        camera_to_world: 4 x 4 or 3 x 4, for column vectors, metres. Give the inverse of an extrinsic matrix (world to camera).
        intrinsics: 3 x 3, pixels: [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]. The centre of the first pixel is at (0.5, 0.5); OpenCV has it
            at (0, 0), so add 0.5 to cx and cy of a calibration by OpenCV.
        axes: of the camera. opencv (COLMAP, Open3D): x right, y down, z forward. opengl (Blender, nerfstudio): x right, y up, z backward.

        Raises SceneError for a matrix that is none of these.
        """
        pose = _matrix("camera_to_world", camera_to_world, [(4, 4), (3, 4)])
        k = _matrix("intrinsics", intrinsics, [(3, 3)])
        if axes not in ("opencv", "opengl"):
            raise SceneError(f'camera: axes is "{axes}"; give "opencv" (x right, y down, z forward) or "opengl" (x right, y up, z backward)')
        if len(pose) == 4 and not np.array_equal(pose[3], [0, 0, 0, 1]):
            raise SceneError(f"camera: the last row of camera_to_world is {pose[3].tolist()}; give a matrix for column vectors, which ends in 0, 0, 0, 1")
        rotation = pose[:3, :3]
        # A larger deviation is not a rounding error of f32.
        if np.abs(rotation.T @ rotation - np.eye(3)).max() > 1e-3 or np.linalg.det(rotation) < 0:
            raise SceneError(f"camera: camera_to_world begins with {rotation.tolist()}, which is not a rotation; give a pose without scale or mirror")
        if k[1, 0] != 0 or not np.array_equal(k[2], [0, 0, 1]):
            raise SceneError(f"camera: intrinsics is {k.tolist()}; give [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]")
        # Of OpenCV's axes.
        down, forward = rotation[:, 1:].T if axes == "opencv" else -rotation[:, 1:].T
        position = pose[:3, 3]
        return Camera(
            resolution_px,
            position_m=_triple(position),
            look_at_m=_triple(position + forward),
            up=_triple(-down),
            intrinsics_px=Intrinsics(*map(float, (k[0, 0], k[1, 1], k[0, 2], k[1, 2], k[0, 1]))),
            distortion=distortion,
            samples=samples,
            filter=filter,
        )


def _matrix(name: str, value: Matrix, shapes: list[tuple[int, int]]) -> npt.NDArray[np.float64]:
    try:
        matrix = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise SceneError(f"camera: {name} is {value!r}; give a matrix of numbers") from None
    if matrix.shape not in shapes or not np.isfinite(matrix).all():
        due = " or ".join(f"{rows} x {columns}" for rows, columns in shapes)
        raise SceneError(f"camera: {name} is {matrix.tolist()}; give {due} finite numbers")
    return matrix


def _triple(vector: npt.NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z
