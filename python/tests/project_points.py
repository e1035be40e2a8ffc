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
# In OpenCV, pixel centres have integer coordinates.
matrix = numpy.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
coefficients = numpy.array(json.loads(header["camlux.camera.distortion"]))
is_fisheye = header["camlux.camera.distortion_model"] == "fisheye"
project = cv2.fisheye.projectPoints if is_fisheye else cv2.projectPoints
still = numpy.zeros(3)
pixels = project(offsets, still, still, matrix, coefficients)[0].reshape(-1, 2)
off_px = numpy.hypot(pixels[:, 0] - columns, pixels[:, 1] - rows)
print(f"{len(off_px)} points within {off_px.max():.2e} px")
