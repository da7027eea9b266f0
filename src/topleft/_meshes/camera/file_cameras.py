"""Cameras that a file brings: those of glTF.

Input: a path. Output: `Camera`, one for each node that holds one.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F64
from topleft._core.base.arrays import as_scale
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.matrices import box_matrix, frustum_matrix, tangent
from topleft._meshes.io.load import GLTF_SUFFIXES, as_moment, input_file, reading
from topleft._meshes.io.references import InputFile
from topleft.errors import MeshError

if TYPE_CHECKING:
    from topleft._meshes.io.gltf.reader import CameraOfFile


def load_cameras(
    path: str | os.PathLike[str],
    *,
    time: float | None = None,
    clip: int | str | None = None,
    scale: float = 1.0,
    root: str | os.PathLike[str] | None = None,
    **limits: int | None,
) -> list[Camera]:
    r"""The cameras of a glTF or GLB file, in the order of the nodes that hold them; of other formats none.

    Parameters
    ----------
    path : path
        The file that `load` reads the mesh from.
    time, clip
        As for `load`: where an animation has the nodes of the cameras at a time.
    scale : float
        As for `load`: the cameras see the mesh that is read with it as they see the mesh of the file.
    root, **limits
        As for `load`: the folder whose files an animation may name, too, and `max_bytes` and its kind.

    Returns
    -------
    list of Camera
        In the world of the mesh. A picture of another shape has the height of the view of the file, and is wider or
        narrower. A camera without a far plane sees to infinity.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeshError
        If the file is broken, or a camera of it has numbers that none can have, or there is no such animation, or it
        is a folder, JSON or text: `Camera.from_nerfstudio` and `Camera.from_colmap` are for those.
    ValueError
        If `time` is negative, infinite or NaN, `scale` is not positive and finite, or `root` is no folder.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import topleft as tl
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "one.obj")
    ...     _ = path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    ...     tl.load_cameras(path)
    []
    """
    factor = as_scale(scale)
    source = input_file(path, root, **limits)
    if source.path.is_dir() or (source.path.is_file() and source.path.suffix.lower() in (".json", ".txt", ".bin")):
        raise MeshError(
            f"{str(path)!r} is no mesh with cameras: Camera.from_nerfstudio reads a frame of a transforms.json, "
            "Camera.from_colmap an image of COLMAP"
        )
    source.moment = as_moment(time, clip)

    def cameras() -> list[Camera]:
        if source.path.suffix.lower() not in GLTF_SUFFIXES:
            return []
        from topleft._meshes.io.gltf.reader import read_cameras  # as late as in `load`

        return [_camera(own, source, factor) for own in read_cameras(source)]

    return reading(source, cameras)


LENGTHS = ("znear", "zfar", "xmag", "ymag")


def _camera(own: CameraOfFile, source: InputFile, scale: float) -> Camera:
    numbers = {name: value * (scale if name in LENGTHS else 1) for name, value in own.numbers.items()}
    if not np.isfinite(own.world_from_eye).all() or not np.isfinite(list(numbers.values())).all():
        raise MeshError("a camera of it stands nowhere")
    # A node may be scaled, and the eye is not: its axes keep their directions alone.
    axes = own.world_from_eye[:3, :3]
    lengths = np.sqrt((axes * axes).sum(axis=0))
    if not (lengths > 0).all():
        raise MeshError(f"cannot read {str(source.path)!r}: a camera of it stands in a space without a volume")
    rigid = np.eye(4)
    rigid[:3, :3] = axes / lengths
    rigid[:3, 3] = own.world_from_eye[:3, 3] * scale
    view = engine.inverse(rigid.astype(np.float64))
    return Camera(view, _projection(own.kind, numbers), aspect=1.0)


def _projection(kind: str, numbers: Mapping[str, float]) -> F64:
    """Clip from eye of a picture as wide as it is high."""
    near, far = numbers["znear"], numbers.get("zfar")
    if kind == "orthographic":
        half = numbers["ymag"]
        return box_matrix(-half, half, -half, half, near, numbers["zfar"])
    half = tangent(math.degrees(numbers["yfov"]) / 2) * near
    matrix = frustum_matrix(-half, half, -half, half, near, 2 * near if far is None else far)
    if far is None:
        matrix[2, 2:] = -1, -2 * near
    return matrix
