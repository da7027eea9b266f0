"""Calibrations as other programs keep them: COLMAP, nerfstudio, PyTorch3D.

In: their objects, by attributes, or the text of their files. Out: a `Calibration` in the terms of OpenCV, from which
`Camera` makes a camera. None of those programs is imported.

Based on: J. L. Schoenberger, J.-M. Frahm, Structure-from-Motion Revisited, 2016 (the camera models of COLMAP);
M. Tancik and others, Nerfstudio, 2023 (transforms.json); N. Ravi and others, Accelerating 3D Deep Learning with
PyTorch3D, 2020.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._core.base.arrays import as_number, as_path, as_real, as_size, shown
from topleft._meshes.camera.lens import FLIP
from topleft._meshes.camera.matrices import tangent
from topleft._meshes.model.pose import as_pose, joined_pose, rotation_of_quaternion

#: How many focal lengths each model of COLMAP has, and its terms of a lens after the principal point: those of
#: `OpenCVLens` ("distortion") or of `FisheyeLens` ("fisheye"), in OpenCV's order.
COLMAP_MODELS: Mapping[str, tuple[int, str, int]] = {
    "SIMPLE_PINHOLE": (1, "", 0),
    "PINHOLE": (2, "", 0),
    "SIMPLE_RADIAL": (1, "distortion", 1),
    "RADIAL": (1, "distortion", 2),
    "OPENCV": (2, "distortion", 4),
    "FULL_OPENCV": (2, "distortion", 8),
    "SIMPLE_FISHEYE": (1, "fisheye", 0),
    "FISHEYE": (2, "fisheye", 0),
    "SIMPLE_RADIAL_FISHEYE": (1, "fisheye", 1),
    "RADIAL_FISHEYE": (1, "fisheye", 2),
    "OPENCV_FISHEYE": (2, "fisheye", 4),
}

NERFSTUDIO_MODELS: Mapping[str, str] = {
    "SIMPLE_PINHOLE": "distortion",
    "PINHOLE": "distortion",
    "SIMPLE_RADIAL": "distortion",
    "RADIAL": "distortion",
    "OPENCV": "distortion",
    "OPENCV_FISHEYE": "fisheye",
}

#: Keys of Instant NGP's transforms.json for lenses that `Camera` does not have.
OTHER_LENSES = "ftheta_p0", "latlong", "equirectangular", "orthographic"


class Calibration(NamedTuple):
    """The arguments of `Camera.from_intrinsics`."""

    intrinsics: F64
    camera_from_world: F64
    size: tuple[int, int]
    distortion: list[float] | None = None
    fisheye: list[float] | None = None
    near: float | None = None
    far: float | None = None


def of_colmap(camera: Any, image: Any) -> Calibration:
    """The calibration of a camera and an image of COLMAP; see `Camera.from_colmap`."""
    own, model, width, height, params = colmap_camera(camera)
    named, pose = colmap_image(image)
    if None not in (own, named) and own != named:
        raise ValueError(f"image must be of camera {own}, got one of camera {named}")
    if model not in COLMAP_MODELS:
        raise ValueError(f"camera must be of a model of {', '.join(COLMAP_MODELS)}, got {model}")
    n_focal, kind, n_terms = COLMAP_MODELS[model]
    if params.shape != (n_focal + 2 + n_terms,):
        raise ValueError(f"params of {model} must be {n_focal + 2 + n_terms} numbers, got {params.size}")
    size = as_size((as_whole(width), as_whole(height)), smallest=1)
    fx, fy = params[0], params[n_focal - 1]
    cx, cy, *terms = params[n_focal:].tolist()
    terms += [0.0] * ((4 if kind == "fisheye" or n_terms < 5 else 8) - n_terms)
    lens = {kind: terms} if kind else {}
    return Calibration(matrix_of(fx, fy, cx, cy), pose, size, **lens)


def colmap_camera(camera: Any) -> tuple[int | None, str, int, int, F64]:
    """Number, model, width, height and parameters of a camera, or of its line in cameras.txt."""
    if isinstance(camera, str):
        words = camera.split()
        try:
            numbers = np.array(words[4:], np.float64)
            return int(words[0]), words[1], int(words[2]), int(words[3]), numbers
        except (ValueError, IndexError):
            line = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS..."
            raise ValueError(f"camera must be a line {line!r} of cameras.txt, got {shown(camera)}") from None
    model = read(camera, "camera", "model")
    model = str(getattr(model, "name", model)).rpartition(".")[2]
    number = read(camera, "camera", "camera_id", "id", otherwise=None)
    width, height = (read(camera, "camera", side) for side in ("width", "height"))
    params = as_real("params of camera", read(camera, "camera", "params"))
    return number, model, width, height, params


def colmap_image(image: Any) -> tuple[int | None, F64]:
    """The number of the camera of an image, or of its line in images.txt, and its pose."""
    if isinstance(image, str):
        words = image.split()
        try:
            numbers = [float(word) for word in words[1:8]]
            quaternion, translation, number = numbers[:4], numbers[4:], int(words[8])
        except (ValueError, IndexError):
            line = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"
            raise ValueError(f"image must be a line {line!r} of images.txt, got {shown(image)}") from None
    else:
        number = read(image, "image", "camera_id", otherwise=None)
        pose = read(image, "image", "cam_from_world", otherwise=None)
        if pose is not None:
            pose = pose() if callable(pose) else pose
            return number, as_pose("cam_from_world of image", pose.matrix() if hasattr(pose, "matrix") else pose)
        quaternion = as_real("qvec of image", read(image, "image", "qvec")).tolist()
        translation = as_real("tvec of image", read(image, "image", "tvec")).tolist()
    if len(quaternion) != 4 or len(translation) != 3:
        raise ValueError(f"qvec and tvec of image must have 4 and 3 numbers, got {len(quaternion)}, {len(translation)}")
    return number, as_pose("pose of image", joined_pose(rotation_of_quaternion(*quaternion), np.array(translation)))


def of_nerfstudio(transforms: Any, i: int, size: object) -> Calibration:
    """The calibration of frame i of a transforms.json; see `Camera.from_nerfstudio`."""
    content = transforms
    if isinstance(transforms, str | os.PathLike):
        content = read_json(as_path("transforms", transforms))
    if not isinstance(content, Mapping) or not isinstance(content.get("frames"), list | tuple):
        raise ValueError("transforms must be the content or the path of a transforms.json with frames")
    frame = element("i", content["frames"], i)
    if not isinstance(frame, Mapping):
        raise ValueError(f"frame {i} must be a mapping, got {shown(frame)}")
    known = {**content, **frame}
    if "transform_matrix" not in known:
        raise ValueError(f"frame {i} must have a transform_matrix, got {', '.join(frame) or 'nothing'}")
    for key in OTHER_LENSES:
        if known.get(key) is not None and known[key] is not False:  # a p0 of 0.0 is a lens, too
            raise ValueError(f"transforms must be of perspective or is_fisheye cameras, got {key}")
    is_fisheye = bool(known.get("is_fisheye"))
    model = known.get("camera_model", "OPENCV_FISHEYE" if is_fisheye else "OPENCV")
    if model not in NERFSTUDIO_MODELS:
        raise ValueError(f"camera_model must be one of {', '.join(NERFSTUDIO_MODELS)}, got {model!r}")
    if is_fisheye and NERFSTUDIO_MODELS[model] != "fisheye":
        raise ValueError(f"is_fisheye must be false where camera_model is {model}, got {known['is_fisheye']!r}")
    given = (as_whole(known.get("w")), as_whole(known.get("h"))) if size is None else size
    width, height = as_size(given, "size (w and h of the file)", smallest=1)
    if "fl_x" in known:
        fx = as_number("fl_x", known["fl_x"])
        fy = as_number("fl_y", known.get("fl_y", fx))
    elif "camera_angle_x" in known:
        angle_x = as_number("camera_angle_x", known["camera_angle_x"])
        fx = width / (2 * tangent(math.degrees(angle_x) / 2))
        angle_y = known.get("camera_angle_y")
        fy = fx if angle_y is None else height / (2 * tangent(math.degrees(as_number("camera_angle_y", angle_y)) / 2))
    else:
        raise ValueError(f"transforms must have fl_x or camera_angle_x, got {', '.join(map(str, known))}")
    cx, cy = (as_number(key, known.get(key, middle)) for key, middle in (("cx", width / 2), ("cy", height / 2)))
    k1, k2, k3, k4, p1, p2 = (as_number(key, known.get(key, 0.0)) for key in ("k1", "k2", "k3", "k4", "p1", "p2"))
    pose = of_opengl(known["transform_matrix"], f"transform_matrix of frame {i}")
    lens: dict[str, Any] = {"distortion": [k1, k2, p1, p2, k3]} if any((k1, k2, p1, p2, k3)) else {}
    if NERFSTUDIO_MODELS[model] == "fisheye":
        if p1 or p2:
            raise ValueError(f"p1 and p2 of an OPENCV_FISHEYE camera must be 0, got {p1} and {p2}")
        lens = {"fisheye": [k1, k2, k3, k4]}
    for key in ("k5", "k6") if "fisheye" in lens else ("k4", "k5", "k6"):
        if known.get(key):
            raise ValueError(f"{key} of a camera_model {model} must be 0, got {known[key]!r}: its lens has none")
    if np.any(known.get("rolling_shutter", 0.0)):
        raise ValueError(f"rolling_shutter must be 0, got {known['rolling_shutter']!r}: a picture is of one moment")
    return Calibration(matrix_of(fx, fy, cx, cy), pose, (width, height), **lens)


def read_json(path: Path) -> Any:
    """The value that a JSON file holds."""
    import json  # which only files need

    if not path.is_file():
        raise FileNotFoundError(f"there is no file {str(path)!r}")
    try:
        return json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise ValueError(f"cannot read {str(path)!r}: {error}") from None


def of_opengl(c2w: Any, name: str = "c2w") -> F64:
    """The pose (4, 4) of OpenCV of a camera that stands in the world with the axes of OpenGL."""
    eye_from_world = engine.inverse(as_pose(name, c2w))
    eye_from_world[3] = [0, 0, 0, 1]
    return np.append(FLIP, 1)[:, None] * eye_from_world


def of_pytorch3d(cameras: Any, i: int, size: object) -> Calibration:
    """The calibration of camera i of a batch of PyTorch3D; see `Camera.from_pytorch3d`."""
    kind = type(cameras).__name__
    if "Orthographic" in kind or kind == "FishEyeCameras":
        raise ValueError(f"cameras must have perspective without a lens, got {kind}")
    rotation, translation = (rows_of(cameras, name, (3, 3)[: 2 - (name == "T")], i) for name in ("R", "T"))
    given = read(cameras, "cameras", "image_size", otherwise=None)
    if size is None:
        if given is None:
            raise ValueError("size must be given: the cameras have no image_size")
        height, width = rows_of(cameras, "image_size", (2,), i).astype(int).tolist()
        size = width, height
    width, height = as_size(size, smallest=1)
    half = min(width, height) / 2  # pixels of a unit of NDC
    in_ndc = read(cameras, "cameras", "in_ndc", otherwise=True)
    in_ndc = bool(in_ndc() if callable(in_ndc) else in_ndc)
    near = far = None
    if read(cameras, "cameras", "K", otherwise=None) is not None:
        matrix = rows_of(cameras, "K", (4, 4), i)
        focal, center = np.array([matrix[0, 0], matrix[1, 1]]), matrix[:2, 2]
    elif read(cameras, "cameras", "fov", otherwise=None) is not None:
        angle = float(rows_of(cameras, "fov", (), i))
        is_degrees = bool(read(cameras, "cameras", "degrees", otherwise=True))
        slope = tangent((angle if is_degrees else math.degrees(angle)) / 2)
        focal = np.array([1 / (slope * float(rows_of(cameras, "aspect_ratio", (), i))), 1 / slope])
        center, in_ndc = np.zeros(2), True
        near, far = (float(rows_of(cameras, name, (), i)) for name in ("znear", "zfar"))
    else:
        focal = np.broadcast_to(rows_of(cameras, "focal_length", None, i), (2,))
        center = rows_of(cameras, "principal_point", (2,), i)
    if in_ndc:  # x to the left, y up, from the middle
        focal, center = focal * half, np.array([width, height]) / 2 - center * half
    turn = np.array([-1.0, -1.0, 1.0])  # x left and y up become x right and y down
    pose = joined_pose(turn[:, None] * rotation.T, turn * translation)
    return Calibration(matrix_of(*focal, *center), as_pose("R and T", pose), (width, height), near=near, far=far)


def rows_of(cameras: Any, name: str, shape: tuple[int, ...] | None, i: int) -> F64:
    """The value of camera i of a batch by a name; a value without a batch counts for each camera."""
    value = as_real(name, read(cameras, "cameras", name))
    if value.ndim == 0 or len(value) == 1:
        value = value.reshape(value.shape[1:])
    else:
        value = np.asarray(element("i", value, i))
    if shape is not None and value.shape != shape and value.size != math.prod(shape):
        raise ValueError(f"{name} of cameras must have shape (N, {', '.join(map(str, shape))}), got {value.shape}")
    return value if shape is None else value.reshape(shape)


def element(name: str, values: Any, i: int) -> Any:
    """Element i of a sequence."""
    if not isinstance(i, int | np.integer) or not 0 <= i < len(values):
        raise IndexError(f"{name} must be an index from 0 to {len(values) - 1}, got {shown(i)}")
    return values[i]


def as_whole(value: Any) -> Any:
    """The integer of a float that is whole, as files have sides of pictures; other values as they are."""
    return int(value) if isinstance(value, float | np.floating) and float(value).is_integer() else value


def matrix_of(fx: float, fy: float, cx: float, cy: float) -> F64:
    """The matrix (3, 3) of focal lengths and a principal point, pixels."""
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


_NOTHING = object()


def read(source: Any, what: str, *names: str, otherwise: Any = _NOTHING) -> Any:
    """An attribute, or the value of a key, by the first of several names that is there."""
    for name in names:
        if isinstance(source, Mapping):
            if name in source:
                return source[name]
        elif hasattr(source, name):
            return getattr(source, name)
    if otherwise is _NOTHING:
        raise TypeError(f"{what} must have {names[0]}, got {shown(source)}")
    return otherwise
