"""Projects the layer P of an image with OpenCV and the camera in the header. Prints the largest distance from the pixel centres."""

import json
import sys

import cv2
import numpy
import OpenEXR

with OpenEXR.File(sys.argv[1], separate_channels=True) as file:
    header = dict(file.header())
    points = numpy.stack([numpy.array(file.channels()[f"P.{axis}"].pixels, dtype=float) for axis in "XYZ"], axis=-1)
    seen = numpy.isfinite(numpy.array(file.channels()["depth.Z"].pixels))

pose = numpy.linalg.inv(numpy.array(header["camlux.cameraToWorld"], dtype=float).reshape(4, 4).T)
rows, columns = numpy.nonzero(seen)
offsets = points[seen] @ pose[:3, :3].T + pose[:3, 3]
# OpenCV's fisheye model cannot project points beside or behind the lens.
ahead = offsets[:, 2] > 0.02 * numpy.linalg.norm(offsets, axis=1)
rows, columns, offsets = rows[ahead], columns[ahead], offsets[ahead].reshape(-1, 1, 3)

(fx, fy), (cx, cy) = header["camlux.camera.focal_px"], header["camlux.camera.principal_point_px"]
skew = header.get("camlux.camera.skew_px", 0)
coefficients = numpy.array(json.loads(header["camlux.camera.distortion"]))
is_fisheye = header["camlux.camera.distortion_model"] == "fisheye"
project = cv2.fisheye.projectPoints if is_fisheye else cv2.projectPoints
still = numpy.zeros(3)
# OpenCV does not use the skew of its matrix, so that only the distortion is left to it.
x, y = project(offsets, still, still, numpy.eye(3), coefficients)[0].reshape(-1, 2).T
# In OpenCV, pixel centres have integer coordinates.
pixels = numpy.stack([fx * x + skew * y + cx - 0.5, fy * y + cy - 0.5], axis=1)
off_px = numpy.hypot(pixels[:, 0] - columns, pixels[:, 1] - rows)
print(f"{len(off_px)} points within {off_px.max():.2e} px")
