"""Bakes: the values of a mesh at the texels of its atlas, from itself, from another mesh, or from pictures.

Input: a `Mesh` with `uv`. Output: `Baked`, an atlas (H, W, C). The kernels are csrc/grid/atlas.c.

Based on: Sander, P. V. et al., "Texture Mapping Progressive Meshes", SIGGRAPH 2001 (from a fine mesh to the atlas of a
coarse one); Debevec, P. E., C. J. Taylor and J. Malik, "Modeling and Rendering Architecture from Photographs", SIGGRAPH
1996 (pictures that are projected on a model, weighed by the angle at which they see it).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, F64, I32, U8, MeshLike
from topleft._core.base.arrays import as_array, as_number, as_size, as_values, shown
from topleft._core.base.color import LIGHT_OF_SRGB, LINEAR_ONE, srgb_tables
from topleft._core.base.memory import FRESH, check_fits
from topleft._core.base.options import parse
from topleft._core.base.threads import run_parts, threads_for
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.verbs import overdraw, rasterize
from topleft._meshes.camera.camera import Camera, CameraLike, as_camera
from topleft._meshes.lod.distance import TriangleTree
from topleft._meshes.lod.simplify import weights_of
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.normals import face_normals, unit_or_zero
from topleft._meshes.picture.render import rasterize_mesh
from topleft._meshes.scene.adapt import as_mesh
from topleft.errors import MeshError, MeshWarning
from topleft.typing import BakeOption, BakeRuleOption, TakenOption

MOST_GUTTER = 1024
OUTSIDE = 2.0**-20
"""How far texture coordinates may leave [0, 1] without a warning: rounding."""


@dataclass(frozen=True, eq=False)
class Baked:
    """The result of `bake`; row 0 is the top, where v = 1, as in a `Texture`.

    Attributes
    ----------
    values : (H, W, C) float32; of pictures uint8; of "triangle" (H, W) int32
        The values of the mesh at the texels, in the gutter the values of the nearest texel; 0, or -1 for triangles,
        elsewhere.
    triangle : (H, W) int32
        The triangle of each texel, -1 in the gutter and elsewhere.
    mask : (H, W) bool
        Which texels the mesh covers: not the gutter.

    Examples
    --------
    >>> import topleft as tl
    >>> square = tl.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]], uv=[[0, 0], [1, 0], [1, 1]])
    >>> baked = tl.bake(square, "position", 4, gutter=0)
    >>> baked.mask.sum(), baked.values[3, 2].tolist()
    (np.int64(10), [0.625, 0.125, 0.0])
    """

    values: npt.NDArray[Any]
    triangle: I32
    mask: npt.NDArray[np.bool_]

    def __repr__(self) -> str:
        height, width = self.mask.shape
        return f"Baked({width}x{height}, {self.values.dtype}, {np.count_nonzero(self.mask)} texels)"


def bake(
    mesh: MeshLike,
    what: BakeOption | npt.ArrayLike | Sequence[npt.ArrayLike] = "position",
    size: int | tuple[int, int] = 1024,
    *,
    rule: BakeRuleOption = "center",
    gutter: int = 8,
    source: MeshLike | None = None,
    max_distance: float | None = None,
    cameras: Sequence[CameraLike] | None = None,
    blend: TakenOption = "best",
    threads: int | None = None,
) -> Baked:
    """The values of a mesh at the texels of its atlas, the square of its texture coordinates.

    Parameters
    ----------
    mesh : Mesh, or whatever `as_mesh` takes, with `uv`
    what : str, array_like, or sequence of pictures
        "position": in the space of the mesh. "normal": unit normals in this space; "tangent_normal": normals of
        `source` in the frame of the mesh along u, along v and outwards, as in normal maps. "color": sRGB of the
        vertices, 0 to 255. "triangle": indices. Or values of vertices (V,) or (V, K), or of corners (T, 3, K). With
        `cameras` pictures (h, w, 3 or 4) uint8, sRGB.
    size : int or (width, height)
        Texels.
    rule : {"center", "touched", "area"}
        The triangles of a texel. "center": the triangle that covers its middle, by the top-left rule on vertices that
        are not snapped. "touched": where no triangle does, the triangle nearest to the middle of all that meet the
        texel, at its point nearest to the middle. "area": the mean over the area that triangles cover.
    gutter : int, 0 to 1024
        Texels round charts that get the value of the nearest texel (by Euclid, the upper left of several), so that a
        filter that reaches beyond a chart reads no background.
    source : Mesh, optional
        Another mesh at this place, a finer mesh, say: values, normals and colours are taken at its point nearest to
        the mesh. Ids of triangles are indices of `source`, too.
    max_distance : float, optional
        The largest distance of this point; texels farther away have no value.
    cameras : sequence of Camera, optional
        The cameras of the pictures, without a lens; each picture shows only the mesh. A texel gets its pixel of a
        picture if the mesh does not hide it, weighed by the squared cosine of the angle of view.
    blend : {"best", "mean"}
        Of several pictures the picture with the largest weight, or the weighed mean, in linear light.
    threads : int, optional
        Never changes a bit.

    Returns
    -------
    Baked

    Warns
    -----
    MeshWarning
        If charts overlap, or triangles leave the square: the parts outside are not baked.

    Raises
    ------
    ValueError
        If the mesh has no `uv` or no triangles, an option is unknown or out of range, or values do not fit it.
    MeshError
        If the mesh or `source` lacks the values to bake.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> vertices, triangles = tl.scenes.icosphere(3)
    >>> uv = np.c_[np.arctan2(vertices[:, 1], vertices[:, 0]) / 7 + 0.5, vertices[:, 2] / 2.1 + 0.5]
    >>> front = vertices[triangles][:, :, 0].max(axis=1) > 0  # without the seam at the back
    >>> ball = tl.Mesh(vertices, triangles[front], uv=uv)
    >>> baked = tl.bake(ball, "normal", 64, rule="touched")
    >>> bool(np.allclose(np.linalg.norm(baked.values[baked.mask], axis=1), 1, atol=1e-5))
    True
    """
    mesh = as_mesh(mesh)
    other = None if source is None else as_mesh(source)
    width, height = as_size(size, smallest=1)
    parse(BakeRuleOption, "rule", rule)
    parse(TakenOption, "blend", blend)
    if not (isinstance(gutter, int | np.integer) and 0 <= gutter <= MOST_GUTTER):
        raise ValueError(f"gutter must be a number of texels in [0, {MOST_GUTTER}], got {gutter!r}")
    if max_distance is not None and not as_number("max_distance", max_distance) >= 0:
        raise ValueError(f"max_distance must be at least 0, got {max_distance!r}")
    if cameras is not None and other is not None:
        raise ValueError("values come from a source or from pictures with cameras, got both")
    chart = chart_of(mesh, (width, height), rule, threads_for(threads, len(mesh.triangles)))
    if cameras is not None:
        return with_gutter(from_pictures(chart, pictures_of(what, cameras), blend), gutter, chart.n_threads)
    if isinstance(what, str):
        parse(BakeOption, "what", what)
    if isinstance(what, str) and what == "triangle" and other is None:
        _, ids = chart.values_of(np.zeros((len(mesh.vertices), 1), np.float32))
        return with_gutter(Baked(ids.copy(), ids, ids >= 0), gutter, chart.n_threads)
    if other is not None:
        baked = from_source(chart, other, what, max_distance)
    else:
        values, ids = chart.values_of(values_to_bake(mesh, what))
        if isinstance(what, str) and what.endswith("normal"):
            values = unit_or_zero(values.reshape(-1, 3)).astype(np.float32).reshape(values.shape)
        baked = Baked(values, ids, ids >= 0)
    return with_gutter(baked, gutter, chart.n_threads)


class Chart(NamedTuple):
    """A mesh in the texels of its atlas."""

    mesh: Mesh
    points: F64
    """(V, 2): texels, y down."""
    size: tuple[int, int]
    rule: str
    n_threads: int

    def values_of(self, values: F32) -> tuple[F32, I32]:
        """The values (H, W, K) of vertices (V, K) or corners (T, 3, K), and the triangles (H, W)."""
        width, height = self.size
        n_values, triangles = values.shape[-1], self.mesh.triangles
        check_fits((height, width, n_values), np.float32)
        if self.rule == "area":
            ids, out = np.full((height, width), -1, np.int32), np.zeros((height, width, n_values), np.float32)
        else:
            frags = rasterize(self.points, triangles, self.size, subpixel_bits="exact", threads=self.n_threads)
            ids, out = frags.triangle, frags.interpolate(values)
        if self.rule == "center":
            return out, ids
        rows = values.reshape(-1, n_values) if values.ndim == 3 else values
        atlas = engine.Atlas(self.points, triangles, self.size, rows, values.ndim == 3)
        if self.rule == "touched":
            squared = np.full((height, width), np.inf, np.float32)
            run_parts(lambda first, end: atlas.touch(first, end, ids, squared, out), height, self.n_threads)
        else:
            check_fits((height, width, 1 + n_values), np.float64)
            sums, most = np.zeros((height, width, 1 + n_values)), np.zeros((height, width), np.float32)
            run_parts(lambda first, end: atlas.average(first, end, sums, most, ids, out), height, self.n_threads)
        return out, ids


def chart_of(mesh: Mesh, size: tuple[int, int], rule: str, n_threads: int) -> Chart:
    """The atlas of a mesh; warns of triangles that leave it, and of charts that overlap."""
    if mesh.uv is None:
        raise ValueError("a mesh is baked by its texture coordinates, got one without uv")
    if not len(mesh.triangles):
        raise ValueError("mesh must have triangles, got none")
    uv = mesh.uv.astype(np.float64)
    is_inside = np.logical_and.reduce((uv >= -OUTSIDE) & (uv <= 1 + OUTSIDE), axis=1)
    if not is_inside.all():
        if not np.isfinite(uv[mesh.triangles]).all():
            raise ValueError("uv must be finite where triangles use them, got NaN or infinite ones")
        n_outside = np.count_nonzero(~is_inside[mesh.triangles].all(axis=1))
        line = f"{n_outside} triangles leave the square of uv from 0 to 1: their parts outside are not baked"
        warnings.warn(line, MeshWarning, stacklevel=3)
    points = np.ascontiguousarray(np.stack([uv[:, 0] * size[0], (1 - uv[:, 1]) * size[1]], axis=1))
    n_shared = int(
        np.count_nonzero(overdraw(points, mesh.triangles, size, subpixel_bits="exact", threads=n_threads) > 1)
    )
    if n_shared:
        line = f"charts overlap in {n_shared} texels, which several triangles own"
        warnings.warn(line, MeshWarning, stacklevel=3)
    return Chart(mesh, points, size, rule, n_threads)


def values_to_bake(mesh: Mesh, what: object) -> F32:
    """The values of vertices (V, K) or corners (T, 3, K) to bake: of a word, or of an array."""
    if not isinstance(what, str):
        return as_values(cast(Any, what), len(mesh.vertices), len(mesh.triangles))
    if what == "color":
        if mesh.colors is None:
            raise MeshError("what='color' needs a mesh whose vertices have colours, got one without")
        return mesh.colors.astype(np.float32)
    if what == "position":
        return np.ascontiguousarray(mesh.vertices, np.float32)
    if what == "normal":
        return normals_to_bake(mesh)
    raise ValueError(f"what={what!r} needs a source")


def normals_to_bake(mesh: Mesh) -> F32:
    """The unit normals of vertices (V, 3) or corners (T, 3, 3)."""
    if mesh.is_faceted:
        return np.repeat(faces_of(mesh)[:, None], 3, axis=1)
    corners = mesh.corner_normals()
    normals = mesh.vertex_normals() if corners is None else corners.rows[corners.of_corner]
    return np.ascontiguousarray(normals, np.float32)


def faces_of(mesh: Mesh) -> F32:
    """The unit normals of triangles, (T, 3); 0 where a triangle has no area."""
    return face_normals(mesh.vertices, mesh.triangles).astype(np.float32)


def from_source(chart: Chart, source: Mesh, what: object, max_distance: float | None) -> Baked:
    """The values of another mesh at its points nearest to the texels of the atlas."""
    if not len(source.triangles):
        raise MeshError("source must have triangles, got none")
    word = what if isinstance(what, str) else ""
    values = normals_to_bake(source) if word.endswith("normal") else None
    if values is None and word != "triangle":
        values = values_to_bake(source, what)
    positions, ids = chart.values_of(np.ascontiguousarray(chart.mesh.vertices, np.float32))
    at = np.flatnonzero(ids.reshape(-1) >= 0)
    points = positions.reshape(-1, 3)[at].astype(np.float64)
    center = source.vertices[source.triangles[0, 0]].astype(np.float64)
    tree = TriangleTree(source.vertices.astype(np.float64) - center, source.triangles)
    nearest, feet = np.empty(len(at), np.int32), np.empty((len(at), 3))
    points -= center
    engine_tree = tree.tree  # built before threads use it

    def find(first: int, end: int) -> None:
        engine_tree.find_nearest(points, first, end, nearest, feet)

    # parts of at most 2**14 texels, for Ctrl-C is heard between parts alone
    run_parts(find, len(at), max(chart.n_threads, len(at) >> 14), chart.n_threads)
    is_near = np.ones(len(at), np.bool_)
    if max_distance is not None:
        is_near = np.einsum("ij,ij->i", feet - points, feet - points) <= max_distance * max_distance
    at, nearest_triangle = at[is_near], tree.order[nearest[is_near]]
    triangle: I32 = np.full(ids.shape, -1, np.int32)
    triangle.reshape(-1)[at] = nearest_triangle
    if values is None:
        return Baked(triangle.copy(), triangle, triangle >= 0)
    corners = source.triangles[nearest_triangle]
    weights = weights_of(tree.points[corners], feet[is_near]).astype(np.float32)
    each = values[nearest_triangle] if values.ndim == 3 else values[corners]
    values_at = np.einsum("nk,nkc->nc", weights, each)
    if word.endswith("normal"):
        values_at = unit_or_zero(values_at).astype(np.float32)
    if word == "tangent_normal":
        values_at = in_tangent_frame(chart, ids.reshape(-1)[at], at, values_at)
    out = np.zeros((ids.size, values_at.shape[1]), np.float32)
    out[at] = values_at
    return Baked(out.reshape(*ids.shape, -1), triangle, triangle >= 0)


def in_tangent_frame(chart: Chart, triangle_of: I32, at: npt.NDArray[np.intp], normals: F32) -> F32:
    """Normals (N, 3) along u, along v and outwards, at texels `at` of triangles `triangle_of` of the mesh."""
    mesh = chart.mesh
    smooth, _ = chart.values_of(normals_to_bake(mesh))
    outwards = unit_or_zero(smooth.reshape(-1, 3)[at])
    a, b, c = (mesh.vertices[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    ta, tb, tc = (mesh.uv[mesh.triangles[:, k]].astype(np.float64) for k in range(3))  # type: ignore[index]
    (u1, v1), (u2, v2) = (tb - ta).T, (tc - ta).T
    sign = np.where(u1 * v2 - u2 * v1 < 0, -1.0, 1.0)[:, None]
    along_u = (((b - a) * v2[:, None] - (c - a) * v1[:, None]) * sign)[triangle_of]
    along_v = (((c - a) * u1[:, None] - (b - a) * u2[:, None]) * sign)[triangle_of]
    tangent = unit_or_zero(along_u - outwards * np.einsum("ij,ij->i", along_u, outwards)[:, None])
    other = np.cross(outwards, tangent)
    other *= np.where(np.einsum("ij,ij->i", other, along_v) < 0, -1.0, 1.0)[:, None]
    axes = (tangent, other, outwards)
    return np.stack([np.einsum("ij,ij->i", normals, axis) for axis in axes], axis=1).astype(np.float32)


def pictures_of(pictures: object, cameras: Sequence[CameraLike]) -> list[tuple[U8, Camera]]:
    """Pictures and their cameras, checked."""
    if isinstance(pictures, str) or not isinstance(pictures, Sequence | np.ndarray):
        raise TypeError(f"what must be a sequence of pictures with cameras=, got {shown(pictures)}")
    if len(pictures) != len(cameras) or not len(cameras):
        raise ValueError(
            f"there must be a camera for each picture, got {len(pictures)} pictures and {len(cameras)} cameras"
        )
    checked = []
    for i, (image, camera_like) in enumerate(zip(pictures, cameras, strict=True)):
        picture, camera = as_array(f"what[{i}]", image), as_camera(camera_like)
        if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] not in (3, 4):
            raise ValueError(
                f"what[{i}] must be (h, w, 3) or (h, w, 4) uint8, got {picture.dtype} of shape {picture.shape}"
            )
        if camera.lens is not None:
            raise ValueError(f"cameras[{i}] must have no lens: straighten the picture first")
        checked.append((picture, camera))
    return checked


def from_pictures(chart: Chart, pictures: Sequence[tuple[U8, Camera]], blend: str) -> Baked:
    """The colours (H, W, 3) uint8 that pictures show of the mesh."""
    mesh = chart.mesh
    positions, ids = chart.values_of(np.ascontiguousarray(mesh.vertices, np.float32))
    points, flat = positions.reshape(-1, 3), ids.reshape(-1)
    normals = np.append(faces_of(mesh), np.zeros((1, 3), np.float32), axis=0)[flat]
    sums, weights = np.zeros((flat.size, 3), np.float32), np.zeros(flat.size, np.float32)

    def add(picture: U8, camera: Camera) -> None:
        size = picture.shape[1], picture.shape[0]
        frags = rasterize_mesh(mesh, camera, size, cull="none", threads=chart.n_threads)
        light, (clip, depth), eye = LIGHT_OF_SRGB[picture[..., :3]], depth_of(frags, camera), eye_of(camera)
        what = frags.triangle, depth, light, clip, eye, blend == "best", points, normals, flat

        def add_texels(first: int, end: int) -> None:
            engine.add_taken(*what, first, end, sums, weights)

        run_parts(add_texels, flat.size, chart.n_threads)

    for picture, camera in pictures:
        if picture.size:
            add(picture, camera)
    is_seen = weights > 0
    light_of = np.divide(sums, weights[:, None], out=np.zeros_like(sums), where=is_seen[:, None])
    steps = np.rint(np.minimum(light_of, 1) * LINEAR_ONE).astype(np.int64)
    values = srgb_tables()[1][steps].reshape(*ids.shape, 3)
    triangle = np.where(is_seen.reshape(ids.shape), ids, np.int32(-1))
    return Baked(values, triangle, triangle >= 0)


def depth_of(frags: Fragments, camera: Camera) -> tuple[F64, F32]:
    """The matrix of a picture, clip from world, and window depths (H, W) that agree with it; 1 is the largest."""
    height, width = frags.depth.shape
    clip, depth = camera.drawn_from_world((width, height)), frags.depth
    if not camera.has_planes:
        largest = max(float(np.abs(depth[frags.mask]).max(initial=0.0)), 1e-30)
        clip[2], depth = clip[2] * (2 / largest) - clip[3], depth / np.float32(largest)  # depth is (z / w + 1) / 2
    return clip, depth


def eye_of(camera: Camera) -> F64:
    """The position of a camera (x, y, z, 1), or, without perspective, the direction to it (x, y, z, 0)."""
    if not camera.projection[3, :3].any():
        return np.append(camera.view[2, :3], 0.0)
    return np.append(engine.product(engine.inverse(camera.view[:3, :3]), -camera.view[:3, 3]), 1.0)


def with_gutter(baked: Baked, gutter: int, n_threads: int) -> Baked:
    """Baked texels with a gutter: texels round the charts, with the value of the nearest texel."""
    if not gutter:
        return baked
    height = len(baked.triangle)
    along = FRESH.empty("along rows", baked.triangle.shape, np.int16)
    nearest = FRESH.empty("nearest texels", baked.triangle.shape, np.int32)
    triangle, values = np.ascontiguousarray(baked.triangle), np.ascontiguousarray(baked.values)
    run_parts(lambda first, end: engine.find_in_rows(triangle, first, end, gutter, along), height, n_threads)
    run_parts(lambda first, end: engine.find_gutter(along, first, end, gutter, nearest), height, n_threads)
    run_parts(lambda first, end: engine.copy_texels(nearest, first, end, values), height, n_threads)
    return Baked(values, triangle, baked.mask)
