"""The renderer of bop_toolkit, drawn by topleft: ``from topleft.compat import bop as renderer``.

Has the calls of `bop_toolkit_lib.rendering.renderer`, without OpenGL, a display or a GPU, and without bop_toolkit.
Input: files of meshes, poses, intrinsics. Output: colours and depth as the renderers of bop_toolkit return them.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, moved

__all__ = ["Renderer", "create_renderer"]

Floats = npt.NDArray[np.floating[Any]]
Intrinsics = tuple[float, float, float, float]
Box = tuple[int, int, int, int]

TYPES = ("vispy", "cpp", "python")
MODES = ("rgb+depth", "rgb", "depth")
SHADINGS = ("phong", "flat")

SLACK = 2.0**-10
"""How far the planes lie before and behind the box of the object, as a share of their distance."""

OPENGL_OF_OPENCV = np.array([[1.0], [-1], [-1], [1]])
"""Signs of the rows of a pose: y up and z backward, of y down and z forward."""

NEAREST = 2.0**-10
"""The near plane of an object that reaches the camera, as a share of the distance of its farthest point."""


def create_renderer(
    width: int,
    height: int,
    renderer_type: str = "cpp",
    mode: str = "rgb+depth",
    shading: str = "phong",
    bg_color: Any = (0.0, 0.0, 0.0, 0.0),
) -> Renderer:
    r"""Return a renderer of pictures of a size.

    Parameters
    ----------
    width, height : int
        Pixels.
    renderer_type : {"cpp", "vispy", "python"}
        Makes no difference.
    mode, shading, bg_color
        As for `Renderer`.

    Raises
    ------
    ValueError
        For an unknown word.

    Examples
    --------
    >>> import tempfile, numpy as np
    >>> from pathlib import Path
    >>> from topleft.compat import bop
    >>> renderer = bop.create_renderer(64, 48, "vispy", mode="depth")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "obj_000001.obj")
    ...     _ = path.write_text("v -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\n")
    ...     renderer.add_object(1, path)
    >>> depth = renderer.render_object(1, np.eye(3), np.array([[0], [0], [100]]), 80, 80, 32, 24)["depth"]
    >>> depth.shape, float(depth[24, 32]), float(depth[0, 0])
    ((48, 64), 100.0, 0.0)
    """
    check_word("renderer_type", renderer_type, TYPES)
    return Renderer(width, height, mode, shading, bg_color)


def check_word(name: str, word: str, words: tuple[str, ...]) -> None:
    """Refuse a word that is not among these."""
    if word not in words:
        raise ValueError(f"{name} must be one of {', '.join(words)}, got {word!r}")


class Renderer:
    """Draws one object at a time, in its pose before a calibrated camera.

    Parameters
    ----------
    width, height : int
        Pixels.
    mode : {"rgb+depth", "rgb", "depth"}
        What `render_object` returns.
    shading : {"phong", "flat"}
        Whether the light of a pixel is that of the interpolated normal, or of the triangle's.
    bg_color : (4,) of float
        Where nothing is, 0 to 1; its alpha is not looked at.

    Raises
    ------
    ValueError
        For an unknown word.

    Notes
    -----
    The projection of a point lies in the pixel whose column is the whole part of its x: the centre of the first pixel
    is (0.5, 0.5), as in the vispy renderer. Light comes from one point, and light beyond white counts as white.
    """

    def __init__(
        self,
        width: int,
        height: int,
        mode: str = "rgb+depth",
        shading: str = "phong",
        bg_color: Any = (0.0, 0.0, 0.0, 0.0),
    ) -> None:
        check_word("mode", mode, MODES)
        check_word("shading", shading, SHADINGS)
        self.width, self.height = int(width), int(height)
        self.mode, self.shading, self.bg_color = mode, shading, bg_color
        self.light_cam_pos: Any = (0.0, 0.0, 0.0)
        self.light_ambient_weight = 0.5
        self.models: dict[Any, Model] = {}
        self._ground = np.empty((self.height, self.width, 3), np.uint8)
        self._ground[:] = np.rint(255 * np.clip(np.asarray(bg_color, np.float64)[:3], 0, 1)).astype(np.uint8)

    def set_light_cam_pos(self, light_cam_pos: Any) -> None:
        """Put the light somewhere, (3,), in the coordinates of the camera: x right, y up, z backward."""
        self.light_cam_pos = light_cam_pos

    def set_light_ambient_weight(self, light_ambient_weight: float) -> None:
        """Set how much light, 0 to 1, comes from everywhere."""
        self.light_ambient_weight = light_ambient_weight

    def add_object(self, obj_id: Any, model_path: str | os.PathLike[str], *, surf_color: Any = None, **_: Any) -> None:
        """Load an object.

        Parameters
        ----------
        obj_id : hashable
            Its name.
        model_path : path-like
            PLY, with colours of vertices or a texture, or another file that `topleft.load` reads.
        surf_color : (3,) of float, optional
            0 to 1, in place of its own colours.
        """
        mesh = tl.load(model_path)
        if not isinstance(mesh, tl.Mesh):
            raise ValueError(f"model_path must be a file of triangles, got {os.fspath(model_path)!r}")
        self.models[obj_id] = Model(mesh, surf_color)

    def remove_object(self, obj_id: Any) -> None:
        """Forget an object."""
        del self.models[obj_id]

    def render_object(
        self, obj_id: Any, R: Any, t: Any, fx: float, fy: float, cx: float, cy: float
    ) -> dict[str, npt.NDArray[Any]]:
        """Draw an object.

        Parameters
        ----------
        obj_id : hashable
            Of an object that was added.
        R : (3, 3) array_like
            Rotation, camera from object; the camera has x to the right, y down, z forward.
        t : (3,) or (3, 1) array_like
            Translation, in the unit of the file.
        fx, fy, cx, cy : float
            Intrinsics, pixels.

        Returns
        -------
        dict
            As `mode` says: "rgb" (H, W, 3) uint8; "depth" (H, W) float32, the distance along the view, 0 where nothing
            is.

        Raises
        ------
        KeyError
            If there is no such object.
        """
        model = self.models[obj_id]
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = R, np.ravel(t)
        found: dict[str, npt.NDArray[Any]] = {}
        if "rgb" in self.mode:
            found["rgb"] = self._ground.copy()
        if "depth" in self.mode:
            found["depth"] = np.zeros((self.height, self.width), np.float32)
        corners = moved(model.corners, pose)
        near, far = float(corners[:, 2].min()), float(corners[:, 2].max())
        box = self._seen_box(corners, (fx, fy, cx, cy))
        if far <= 0 or box[0] >= box[2] or box[1] >= box[3]:
            return found
        camera = self._camera(pose, (fx, fy, cx, cy), max(near * (1 - SLACK), far * NEAREST), far * (1 + SLACK))
        frags = tl.rasterize_mesh(
            model.mesh, camera, (box[2] - box[0], box[3] - box[1]),
            cull="none", origin=box[:2], viewport=(self.width, self.height),
        )  # fmt: skip
        if "depth" in found:
            a, b = camera.projection[2, 2:]
            distance = b / (2 * frags.depth.astype(np.float64) - 1 + a)  # 0 of +inf
            found["depth"][box[1] : box[3], box[0] : box[2]] = distance + 0.0  # and not -0
        if "rgb" in found:
            seen = np.flatnonzero(frags.mask)
            rows, columns = np.divmod(seen, frags.mask.shape[1])
            places = (rows + box[1]) * self.width + (columns + box[0])
            back = np.eye(4)
            back[:3, :3] = pose[:3, :3].T
            points = np.array([(0, 0, 0), self.light_cam_pos]) * (1, -1, -1) - pose[:3, 3]
            eye, light = moved(points, back)
            color = model.shaded(frags, seen, light, eye, self.light_ambient_weight, self.shading)
            found["rgb"].reshape(-1, 3)[places] = color
        return found

    def _camera(self, pose: F64, intrinsics: Intrinsics, near: float, far: float) -> tl.Camera:
        """The camera of `tl.Camera.from_intrinsics`, without its checks, which take a fifth of a call."""
        fx, fy, cx, cy = intrinsics
        projection = np.zeros((4, 4))
        projection[0, :3] = 2 * fx / self.width, 0, 1 - 2 * cx / self.width
        projection[1, :3] = 0, 2 * fy / self.height, 2 * cy / self.height - 1
        projection[2:, 2] = -(far + near) / (far - near), -1
        projection[2, 3] = -2 * far * near / (far - near)
        return tl.Camera(pose * OPENGL_OF_OPENCV, projection)

    def _seen_box(self, corners: F64, intrinsics: Intrinsics) -> Box:
        """Left, top, right and bottom of the pixels that what lies in a box may show in."""
        if corners[:, 2].min() <= 0:
            return 0, 0, self.width, self.height
        fx, fy, cx, cy = intrinsics
        x, y = fx * corners[:, 0] / corners[:, 2] + cx, fy * corners[:, 1] / corners[:, 2] + cy
        low = np.floor([x.min(), y.min()]) - 1
        high = np.ceil([x.max(), y.max()]) + 1
        left, top = np.clip(low, 0, (self.width, self.height)).astype(int).tolist()
        right, bottom = np.clip(high, 0, (self.width, self.height)).astype(int).tolist()
        return left, top, right, bottom


class Model:
    """An object, and what is interpolated of it."""

    def __init__(self, mesh: tl.Mesh, surf_color: Any) -> None:
        self.mesh = mesh
        low, high = mesh.bounds
        self.corners = np.where(np.indices((2, 2, 2)).reshape(3, 8).T, high, low)
        """Of the box of the object, (8, 3)."""
        textures = [material.texture for material in mesh.materials if material.texture is not None]
        self.texture: Any = textures[0].image if textures and mesh.uv is not None and surf_color is None else None
        colors = np.full((len(mesh.vertices), 3), 0.5)
        if surf_color is not None:
            colors[:] = surf_color
        elif mesh.colors is not None:
            colors = mesh.colors[:, :3] / 255
        normals = mesh.vertex_normals()
        self.per_vertex = np.hstack([mesh.vertices, normals, colors]).astype(np.float32)
        """Place, normal and colour, (V, 9)."""

    def shaded(
        self, frags: tl.Fragments, seen: npt.NDArray[np.intp], light: F64, eye: F64, ambient: float, shading: str
    ) -> npt.NDArray[np.uint8]:
        """The colours of some pixels, (N, 3).

        `seen` names them, row by row; `light` and `eye` lie in the space of the object; shading "flat" is with the
        normals of the triangles, turned to the eye.
        """
        values = frags.interpolate(self.per_vertex).reshape(-1, 9)[seen].T.copy()
        normal: Floats = values[3:6]
        color: Floats = values[6:]
        if self.texture is not None:
            texels = frags.sample(self.texture, self.mesh.uv, filter="nearest", wrap="clamp")
            color = texels.reshape(-1, texels.shape[2])[seen, :3].T
        if shading == "flat":
            corners = self.mesh.vertices[self.mesh.triangles[frags.triangle.reshape(-1)[seen]]]
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).T
            normal = np.where(dot(normal, (eye - corners[:, 0]).T) < 0, -normal, normal)
        to_light = light.astype(np.float32)[:, None] - values[:3]
        lengths = np.sqrt(dot(to_light, to_light) * dot(normal, normal))
        weight = ambient + np.maximum(dot(to_light, normal), 0) / np.maximum(lengths, np.finfo(np.float32).tiny)
        shown: npt.NDArray[np.uint8] = np.rint(255 * np.minimum(weight, 1) * color).astype(np.uint8).T
        return shown


def dot(a: Floats, b: Floats) -> Floats:
    """The scalar products of the columns of (3, N) and (3, N)."""
    products: Floats = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return products
