"""The rasterizer of PyTorch3D, drawn by topleft: ``from topleft.compat.pytorch3d import MeshRasterizer``.

Has `rasterize_meshes`, `MeshRasterizer`, `RasterizationSettings` and `Fragments` of `pytorch3d.renderer`, for
``blur_radius=0``. Input: `Meshes` of PyTorch3D, or pairs of arrays. Output: tensors, with gradients, or arrays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

import topleft as tl
from topleft.compat._arrays import F64, detached, library_of

__all__ = ["Fragments", "MeshRasterizer", "RasterizationSettings", "rasterize_meshes"]

MOST_FACES = 16
"""Of a pixel."""

ON_EDGE = 2.0**-24
"""A weight of no more than this is 0 to PyTorch3D, whose weights have 24 bits."""


@dataclass(frozen=True)
class Fragments:
    """What a rasterizer returns: see `rasterize_meshes`."""

    pix_to_face: Any
    zbuf: Any
    bary_coords: Any
    dists: Any

    def detach(self) -> Fragments:
        """Fragments without gradients."""
        parts = {name: getattr(self, name).detach() for name in ("zbuf", "bary_coords", "dists")}
        return replace(self, **parts)


@dataclass
class RasterizationSettings:
    """The options of a `MeshRasterizer`: see `rasterize_meshes`."""

    image_size: int | tuple[int, int] = 256
    blur_radius: float = 0.0
    faces_per_pixel: int = 1
    bin_size: int | None = None
    max_faces_opengl: int = 10_000_000
    max_faces_per_bin: int | None = None
    perspective_correct: bool | None = None
    clip_barycentric_coords: bool | None = None
    cull_backfaces: bool = False
    z_clip_value: float | None = None
    cull_to_frustum: bool = False


class MeshRasterizer:
    """Draws meshes as cameras of PyTorch3D see them.

    Parameters
    ----------
    cameras : cameras of PyTorch3D, optional
        As many as there are meshes, or one; those of a call come first.
    raster_settings : RasterizationSettings, optional
    """

    def __init__(self, cameras: Any = None, raster_settings: Any = None) -> None:
        self.cameras = cameras
        self.raster_settings = RasterizationSettings() if raster_settings is None else raster_settings

    def to(self, device: Any) -> MeshRasterizer:
        """Move the cameras to a device."""
        if self.cameras is not None:
            self.cameras = self.cameras.to(device)
        return self

    def transform(self, meshes_world: Any, **options: Any) -> Any:
        """The meshes in normalized device coordinates, with distances along the view for their z."""
        cameras = options.get("cameras", self.cameras)
        if cameras is None:
            raise ValueError("cameras must be given to the rasterizer or to the call, got None")
        if len(cameras) not in (1, len(meshes_world)):
            raise ValueError(f"cameras must be 1, or {len(meshes_world)} as the meshes, got {len(cameras)}")
        world = meshes_world.verts_padded()
        own = {name: value for name, value in options.items() if name not in ("cameras", "raster_settings", "eps")}
        eps = options.get("eps")
        verts = cameras.transform_points_ndc(world, eps=eps, **own)
        verts[..., 2] = cameras.get_world_to_view_transform(**own).transform_points(world, eps=eps)[..., 2]
        return meshes_world.update_padded(new_verts_padded=verts)

    def forward(self, meshes_world: Any, **options: Any) -> Fragments:
        """Draw meshes; options are the options of the cameras, `cameras` and `raster_settings`."""
        cameras = options.get("cameras", self.cameras)
        settings = options.get("raster_settings", self.raster_settings)
        verts = self.transform(meshes_world, **options)
        perspective_correct, z_clip_value = settings.perspective_correct, settings.z_clip_value
        if perspective_correct is None:
            perspective_correct = cameras.is_perspective()
        near = cameras.get_znear()
        if z_clip_value is None and perspective_correct and near is not None:
            z_clip_value = float(detached(near).min()) / 2
        return Fragments(
            *rasterize_meshes(
                verts,
                settings.image_size,
                settings.blur_radius,
                settings.faces_per_pixel,
                perspective_correct=perspective_correct,
                cull_backfaces=settings.cull_backfaces,
                z_clip_value=z_clip_value,
            )
        )

    __call__ = forward


def rasterize_meshes(
    meshes: Any,
    image_size: int | tuple[int, int] = 256,
    blur_radius: float = 0.0,
    faces_per_pixel: int = 8,
    bin_size: int | None = None,  # noqa: ARG001
    max_faces_per_bin: int | None = None,  # noqa: ARG001
    perspective_correct: bool = False,
    clip_barycentric_coords: bool = False,  # noqa: ARG001
    cull_backfaces: bool = False,
    z_clip_value: float | None = None,
    cull_to_frustum: bool = False,  # noqa: ARG001
) -> tuple[Any, Any, Any, Any]:
    """Return the nearest faces of each pixel, a picture for each mesh.

    Parameters
    ----------
    meshes : pytorch3d.structures.Meshes, or sequence of (verts, faces)
        Of N meshes; verts (V, 3) in normalized device coordinates: x to the left, y up, -1 to 1 over the shorter side
        of the picture, z the distance along the view; faces (F, 3) integers.
    image_size : int or (height, width)
        Pixels.
    blur_radius : float
        0.
    faces_per_pixel : int, 1 to 16
        K, how many are kept.
    perspective_correct : bool
        Whether weights are those in space, not on the screen.
    cull_backfaces : bool
        Leaves out faces whose vertices run clockwise as they are seen.
    z_clip_value : float, optional
        Cuts what is nearer. Without it faces are cut where z is 0.
    bin_size, max_faces_per_bin, clip_barycentric_coords, cull_to_frustum
        Make no difference to what is returned.

    Returns
    -------
    pix_to_face : (N, H, W, K) int64
        Index of the face, of all meshes counted together; the nearest comes first, at equal z that of the lower index.
    zbuf : (N, H, W, K) float32
        Its z.
    bary_coords : (N, H, W, K, 3) float32
        Weights of its vertices.
    dists : (N, H, W, K) float32
        -d^2, d the distance from the pixel to the nearest edge of the face, in normalized device coordinates.

        All are -1 where there are fewer faces. Of tensors they are tensors, and all but the first have gradients.

    Raises
    ------
    ValueError
        If `blur_radius` is not 0, or `faces_per_pixel` is not 1 to 16.

    Notes
    -----
    As in PyTorch3D a pixel whose centre lies on an edge does not belong to the face.

    Examples
    --------
    >>> from topleft.compat.pytorch3d import rasterize_meshes
    >>> mesh = [[1.0, -1, 2], [-1, -1, 2], [0, 1, 2]], [[0, 1, 2]]
    >>> pix_to_face, zbuf, _, _ = rasterize_meshes([mesh], (2, 4), faces_per_pixel=1)
    >>> pix_to_face[0, ..., 0]
    array([[-1, -1, -1, -1],
           [-1,  0,  0, -1]])
    >>> float(zbuf[0, 1, 1, 0])
    2.0
    """
    if blur_radius != 0:
        raise ValueError(f"blur_radius must be 0, got {blur_radius}")
    if not 1 <= faces_per_pixel <= MOST_FACES:
        raise ValueError(f"faces_per_pixel must lie in 1 to {MOST_FACES}, got {faces_per_pixel}")
    height, width = np.broadcast_to(image_size, 2).tolist()
    half = np.array([max(width / height, 1.0), max(height / width, 1.0)])
    verts, faces, counts = packed(meshes)
    of = library_of(verts)
    places = detached(verts).astype(np.float64)
    ids = np.full((len(counts), height, width, faces_per_pixel), -1, np.int64)
    for own, first, n in zip(ids, np.cumsum(counts) - counts, counts, strict=True):
        if n:
            rows = np.asarray(faces[first : first + n])
            found = draw(places, rows, own.shape, half, perspective_correct, cull_backfaces, z_clip_value)
            own[:] = np.where(found >= 0, found + first, -1)
    seen = np.flatnonzero(ids >= 0)
    y, x = np.divmod(seen // faces_per_pixel % (height * width), width)
    centers = half * np.column_stack([1 - (2 * x + 1) / width, 1 - (2 * y + 1) / height])
    corners = verts[faces[of.asarray(ids.reshape(-1)[seen])]] * of.ones(1, dtype=of.float64)
    zbuf, bary, dists = values_at(of.asarray(centers), corners, perspective_correct)
    where = of.asarray(seen)
    made = []
    for values, more in ((zbuf, ()), (of.stack(bary, -1), (3,)), (dists, ())):
        out = of.full((ids.size, *more), -1.0, dtype=of.float32)
        out[where] = values.astype(np.float32) if of is np else values.to(of.float32)
        made.append(out.reshape((*ids.shape, *more)))
    return of.asarray(ids), *made


def packed(meshes: Any) -> tuple[Any, Any, list[int]]:
    """Vertices (V, 3), faces (F, 3) of all meshes, which count them together, and how many faces each mesh has."""
    if hasattr(meshes, "verts_packed"):
        return meshes.verts_packed(), meshes.faces_packed(), meshes.num_faces_per_mesh().tolist()
    pairs = [(np.asarray(verts, np.float32), np.asarray(faces, np.int64)) for verts, faces in meshes]
    firsts = np.cumsum([0, *(len(verts) for verts, _ in pairs)])
    faces = [own.reshape(-1, 3) + first for (_, own), first in zip(pairs, firsts, strict=False)]
    return np.concatenate([verts for verts, _ in pairs]), np.concatenate(faces), [len(own) for own in faces]


def draw(
    places: F64, rows: Any, shape: tuple[int, ...], half: F64, perspective: bool, culls: bool, z_clip: float | None
) -> npt.NDArray[np.int32]:
    """The faces that show in a picture (H, W, K), -1 for none.

    Perspective: 1 / z is linear on the screen, so it is the depth, larger in front.
    """
    height, width, k = shape
    first, end = rows.min(), rows.max() + 1
    x, y, z = places[first:end].T
    clip = np.column_stack([-x / half[0], y / half[1], z - (z_clip or 0.0), np.ones_like(z)])
    options: dict[str, Any] = {"depth_test": "less", "near_clip": True, "far_clip": False}
    if perspective:
        near = z_clip or z[z > 0].min(initial=1.0)
        clip[:, :2] *= z[:, None]
        clip[:, 2], clip[:, 3] = near, z
        options = {"depth_test": "greater", "near_clip": False, "far_clip": True}
    options |= {"cull": "back" if culls else "none", "clip_depth": "zero_to_one", "subpixel_bits": "exact"}
    found, is_on_edge = peeled(clip, rows - first, (width, height), k, options)
    if is_on_edge.any():  # what lies behind comes forward
        found, is_on_edge = peeled(clip, rows - first, (width, height), min(2 * k, MOST_FACES), options)
        found[is_on_edge] = -1
        found = np.take_along_axis(found, np.argsort(found < 0, axis=2, kind="stable"), axis=2)[..., :k]
    return found


def peeled(
    clip: F64, rows: Any, size: tuple[int, int], k: int, options: dict[str, Any]
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.bool_]]:
    """The nearest k faces of each pixel, (H, W, k), and which of them have its centre on an edge."""
    if k == 1:
        frags = tl.rasterize(clip, rows, size, **options)
        return frags.triangle[..., None], (frags.mask & (frags.barycentric().min(axis=2) <= ON_EDGE))[..., None]
    layers = tl.peel(clip, rows, size, layers=k, **options)
    weights = np.stack([layers.layer(i).barycentric().min(axis=2) for i in range(k)], axis=2)
    return layers.triangle, (layers.triangle >= 0) & (weights <= ON_EDGE)


def values_at(centers: Any, corners: Any, perspective: bool) -> tuple[Any, list[Any], Any]:
    """The z, the three weights and the distances of points (M, 2) in faces (M, 3, 3).

    Corners are homogeneous, (x w, y w, w). The plane through the eye and two of them is one edge; what its normal says
    of a point, over the sum of all three, is the weight of the third corner.
    """
    z = corners[..., 2]
    w = z if perspective else z * 0 + 1
    x, y = corners[..., 0] * w, corners[..., 1] * w
    sides, gaps = [], []
    for i, j in ((1, 2), (2, 0), (0, 1)):
        across = y[:, i] * w[:, j] - w[:, i] * y[:, j]
        down = w[:, i] * x[:, j] - x[:, i] * w[:, j]
        side = centers[:, 0] * across + centers[:, 1] * down + (x[:, i] * y[:, j] - y[:, i] * x[:, j])
        sides.append(side)
        gaps.append(side * side / (across * across + down * down))
    total = sides[0] + sides[1] + sides[2]
    weights = [side / total for side in sides]
    of = library_of(corners)
    nearest = of.minimum(of.minimum(gaps[0], gaps[1]), gaps[2])
    return weights[0] * z[:, 0] + weights[1] * z[:, 1] + weights[2] * z[:, 2], weights, -nearest
