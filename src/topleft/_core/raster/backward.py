"""From a visibility buffer back to its mesh: gradients of vertices and of attributes, in float64."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import as_array, as_checked_triangles, as_real, as_size
from topleft._core.base.texels import FILTER_CODES, WRAP_CODES, ValueLevels
from topleft._core.base.threads import parse_threads, run_parts, threads_of_rows
from topleft._core.gradients import tensors
from topleft._core.gradients.tensors import PixelGrid, TexelFilter, TexelLook, TexelsBeyond, as_rule
from topleft.typing import EdgesOption

Floats = NDArray[np.float64]


LOG_OF_2 = 0.6931471805599453


class Given(Protocol):
    """The mesh that a visibility buffer was drawn from: `GivenCorners`."""

    vertices: Any
    triangles: Any
    transform: Any
    viewport: tuple[int, int]
    origin: tuple[int, int]
    zero_to_one: bool


class ShownMesh(Protocol):
    """A visibility buffer: `Fragments`."""

    @property
    def triangle(self) -> NDArray[np.int32]:
        """Ids (H, W)."""

    corners: Any


@dataclass(frozen=True)
class Backward:
    """A mesh in a picture: vertices (1, V, 4) as (x w, y w, z, w) in pixels of the picture, and `rast`."""

    given: Given
    vertices: Floats
    pos: Floats
    grid: PixelGrid
    rast: Floats
    rast_db: Floats

    @classmethod
    def of(cls, frags: ShownMesh) -> Backward:
        """Return where the pixels of a visibility buffer lie in the triangles."""
        given: Given | None = frags.corners
        if given is None:
            raise ValueError("gradients are those of rasterize and rasterize_mesh, not of layers")
        vertices = np.asarray(as_array("vertices", given.vertices), np.float64)
        pos = in_pixels(given, vertices)
        ids = np.require(frags.triangle, np.int32, ["C", "A"])
        tri = as_checked_triangles(given.triangles, len(vertices))
        grid = PixelGrid(tri, 1, len(ids), ids.shape[1], in_pixels=True)
        return cls(given, vertices, pos, grid, *tensors.points(grid, pos, [(ids, 0)], is_flipped=False, with_db=True))

    def to_vertices(self, g_pos: Floats) -> Floats:
        """Return the gradient of the vertices, as they were given, from that of `pos`."""
        (g_x, g_y, g_z, g_w), (x, y) = np.moveaxis(g_pos[0], -1, 0), self.given.origin
        g_w = g_w - x * g_x - y * g_y
        if self.given.transform is None and self.vertices.shape[1] < 4:
            return np.stack([g_x, g_y, g_z], axis=-1)[:, : self.vertices.shape[1]]
        width, height = self.given.viewport
        of_clip = np.stack(
            [g_x * (width / 2), -g_y * (height / 2), g_z, g_w + g_x * (width / 2) + g_y * (height / 2)], -1
        )
        if self.given.transform is None:
            return of_clip
        matrix = np.asarray(as_array("transform", self.given.transform), np.float64)
        return engine.product(of_clip, np.ascontiguousarray(matrix[:, :3]))

    def weights(self, grad: ArrayLike) -> Floats:
        """Return the gradient of the vertices from that of the weights."""
        g = self.as_grad("grad", grad, 3)
        g_rast = np.zeros_like(self.rast)
        g_rast[..., 0], g_rast[..., 1] = g[..., 0] - g[..., 2], g[..., 1] - g[..., 2]
        return self.to_vertices(tensors.points_vjp(self.grid, self.pos, self.rast, g_rast, None))

    def depth(self, grad: ArrayLike) -> Floats:
        """Return the gradient of the vertices from that of the depth."""
        is_pixels = self.given.transform is None and self.vertices.shape[1] < 4
        g_rast = np.zeros_like(self.rast)
        g_rast[..., 2] = self.as_grad("grad", grad) * (1.0 if is_pixels or self.given.zero_to_one else 0.5)
        return self.to_vertices(tensors.points_vjp(self.grid, self.pos, self.rast, g_rast, None))

    def interpolate(
        self, values: NDArray[Any], grad: ArrayLike, grad_derivatives: ArrayLike | None
    ) -> tuple[Floats, Floats]:
        """Return the gradients of values and vertices from the gradients of an attribute and of its derivatives."""
        n = values.shape[-1] if values.ndim > 1 else 1
        attr = np.ascontiguousarray(values, np.float64).reshape(1, -1, n)
        tri = np.arange(len(attr[0]), dtype=np.int32).reshape(-1, 3) if values.ndim == 3 else self.grid.tri
        grid = replace(self.grid, tri=tri)
        columns = (n,) if values.ndim > 1 else ()
        g_out, g_da = self.as_grad("grad", grad, *columns).reshape(*grid.shape(), n), None
        if grad_derivatives is not None:
            g_da = self.as_grad("grad_derivatives", grad_derivatives, *columns, 2).reshape(*grid.shape(), 2 * n)
        g_attr, g_rast, g_db = tensors.values_vjp(grid, attr, self.rast, g_out, self.rast_db, g_da, range(n))
        g_pos = tensors.points_vjp(self.grid, self.pos, self.rast, g_rast, g_db)
        return g_attr.reshape(values.shape), self.to_vertices(g_pos)

    def sample(
        self, levels: ValueLevels, uv: NDArray[Any], found: NDArray[Any], slopes: NDArray[Any] | None, grad: ArrayLike
    ) -> tuple[Floats, Floats, Floats]:
        """Return the gradients of a texture, of uv and of the vertices from that of `sample`.

        `found`, `slopes`: uv at pixels and its derivatives, where there are halvings.
        """
        code, wrap, other_wrap = levels.codes
        if wrap != other_wrap:
            raise ValueError("wrap must be the same for u and v where gradients are asked for")
        columns = () if levels.is_flat else (levels.n_channels,)
        g_out = self.as_grad("grad", grad, *columns).reshape(*self.grid.shape(), levels.n_channels)
        g_out = g_out * (self.rast[..., 3:] > 0)
        at, turns = found.astype(np.float64), np.array([1.0, -1.0])  # v from the top down
        at[..., 1] = 1 - at[..., 1]
        if wrap == WRAP_CODES["mirror"]:
            at %= 2
            at, turns = np.where(at > 1, 2 - at, at), np.where(at > 1, -turns, turns)
        sizes = levels.rows[:, :0:-1].tolist()
        texels = np.split(levels.texels.astype(np.float64), levels.rows[1:, 0])
        arrays = [one.reshape(1, *size, -1) for one, size in zip(texels, sizes, strict=True)]
        step = np.zeros((*at.shape, 2)) if slopes is None else slopes * np.array(sizes[0][::-1], float)[:, None]
        squares = (step**2).sum(axis=-2)
        longer = squares.max(axis=-1)
        level = np.zeros(longer.shape)
        if slopes is not None:
            engine.levels_seen(levels.rows, slopes.reshape(-1, 2, 2), level.reshape(-1))
        beyond = TexelsBeyond.WRAP if wrap == WRAP_CODES["repeat"] else TexelsBeyond.CLAMP
        g_arrays, g_at, g_level = [np.zeros_like(one) for one in arrays], np.zeros_like(at), np.zeros_like(level)
        for texel_filter, is_used in ways_to_look(code, level):
            has_levels = texel_filter is TexelFilter.LINEAR_MIPMAP_LINEAR
            own = arrays if has_levels else arrays[:1]
            look = TexelLook(own, texel_filter, beyond, at[None], None, level[None] if has_levels else None)
            g_own, g_uv, _, g_bias = tensors.texels_vjp(look, g_out * is_used[..., None])
            for made, more in zip(g_arrays, g_own, strict=False):
                made += more
            g_at += 0 if g_uv is None else g_uv[0]
            g_level += 0 if g_bias is None else g_bias[0]
        g_texture = g_arrays.pop()[0]
        while g_arrays:
            finer = g_arrays.pop()[0]
            g_texture = finer + spread(spread(g_texture, len(finer), 0), finer.shape[1], 1)
        is_between = (longer > 1) & (level < len(arrays) - 1)
        step = np.where(is_between[..., None, None], step, 0)
        g_squares = np.where(is_between, g_level / (2 * LOG_OF_2 * np.maximum(longer, 1)), 0)
        is_longer = np.arange(2) == squares.argmax(axis=-1)[..., None]
        g_slopes = (
            2 * step * np.array(sizes[0][::-1], float)[:, None] * (g_squares[..., None] * is_longer)[..., None, :]
        )
        by_uv, by_vertices = self.interpolate(uv, g_at * turns, g_slopes)
        return g_texture[..., 0] if levels.is_flat else g_texture, by_uv, by_vertices

    def smooth(self, picture: ArrayLike, edges: EdgesOption) -> NDArray[Any]:
        """Return a picture with smooth silhouettes."""
        given, color = self.as_picture(picture)
        out = tensors.smooth(self.grid, as_rule(edges), self.outline(), self.pos, self.rast, color)
        return out.reshape(given.shape).astype(np.float32 if given.dtype.type is np.float32 else np.float64, copy=False)

    def smooth_vjp(self, picture: ArrayLike, grad: ArrayLike, edges: EdgesOption) -> tuple[Floats, Floats]:
        """Return the gradients of the picture and of the vertices."""
        given, color = self.as_picture(picture)
        g_out = self.as_grad("grad", grad, *given.shape[2:]).reshape(color.shape)
        outline = self.outline()
        g_color, g_pos = tensors.smooth_vjp(self.grid, as_rule(edges), outline, self.pos, self.rast, color, g_out)
        return g_color.reshape(given.shape), self.to_vertices(g_pos)

    def outline(self) -> tensors.Outline:
        """Return the outline of the mesh: its silhouette and inner edges."""
        return tensors.outline_of(self.grid, self.pos, tensors.halves_across(self.grid.tri))

    def as_picture(self, picture: ArrayLike) -> tuple[NDArray[Any], Floats]:
        """Return a picture as it is, and as (1, H, W, C) float64."""
        given = np.asarray(as_array("picture", picture))
        shape = self.grid.shape()[1:]
        if given.shape[:2] != shape or given.ndim not in (2, 3):
            raise ValueError(f"picture must have shape {shape} or {(*shape, 'C')}, got {given.shape}")
        return given, as_pixels("picture", given).reshape(1, *shape, -1)

    def as_grad(self, name: str, grad: ArrayLike, *columns: int) -> Floats:
        """Return a gradient by pixel as (1, H, W, *columns) float64."""
        given = as_pixels(name, grad)
        shape = (*self.grid.shape()[1:], *columns)
        if given.shape != shape:
            raise ValueError(f"{name} must have shape {shape}, got {given.shape}")
        return given[None]


def ways_to_look(code: int, level: Floats) -> list[tuple[TexelFilter, NDArray[np.bool_]]]:
    """Return the filters of a code of `FILTER_CODES`, and the pixels that look by each."""
    every, is_level_0 = np.ones(level.shape, np.bool_), level == 0
    if code in (FILTER_CODES["nearest"], FILTER_CODES["bilinear"]):
        return [(TexelFilter.NEAREST if code == FILTER_CODES["nearest"] else TexelFilter.LINEAR, every)]
    if code == FILTER_CODES["trilinear"]:
        return [(TexelFilter.LINEAR_MIPMAP_LINEAR, every)]
    return [(TexelFilter.NEAREST, is_level_0), (TexelFilter.LINEAR_MIPMAP_LINEAR, ~is_level_0)]


def spread(halved: Floats, n: int, axis: int) -> Floats:
    """Return the gradient of n texels along an axis from that of their halving, each a mean over its area."""
    m = halved.shape[axis]
    if m == n:
        return halved
    own = np.moveaxis(halved, axis, 0)
    made = np.zeros((n, *own.shape[1:]))
    part = np.arange(m).reshape(-1, 1, 1) / m if n % 2 else np.zeros((m, 1, 1))  # of the first texel lies before
    made[0 : 2 * m : 2] += (1 - part) * own
    made[1 : 2 * m : 2] += own
    if n % 2:
        made[2::2] += (part + 1 / m) * own
    return np.moveaxis(made * (m / n), 0, axis)


def as_pixels(name: str, values: ArrayLike) -> Floats:
    """Return real numbers, or a mask, as contiguous float64."""
    array = as_array(name, values)
    return np.ascontiguousarray(array if array.dtype == np.bool_ else as_real(name, array), np.float64)


def in_pixels(given: Given, vertices: Floats) -> Floats:
    """Return vertices (1, V, 4) as (x w, y w, z, w), x and y in pixels from the origin of a picture."""
    points = vertices
    if given.transform is not None:
        matrix = np.asarray(as_array("transform", given.transform), np.float64)
        points = engine.product(vertices, matrix[:, :3].T) + matrix[:, 3]
    pos = np.ones((len(points), 4))
    pos[:, 2] = points[:, 2] if points.shape[1] > 2 else 0.0
    if points.shape[1] < 4:
        pos[:, :2] = points[:, :2]
    else:
        (width, height), (x, y, _, w) = given.viewport, points.T
        pos[:, 0], pos[:, 1], pos[:, 3] = (w + x) * (width / 2), (w - y) * (height / 2), w
    pos[:, :2] -= np.multiply.outer(pos[:, 3], given.origin)
    return pos[None]


def area_vjp(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    grad: ArrayLike,
    *,
    colors: ArrayLike | None = None,
    threads: int | None = None,
) -> Floats:
    """Return the gradient of vertices from that of exact areas, as ``sampling="area"`` has them.

    Parameters
    ----------
    vertices : array_like, shape (V, 2) or (V, 3)
        Pixels; depth has no part in it.
    triangles : array_like of integers, shape (T, 3)
        Indices of vertices; either winding.
    size : (int, int), or int for a square
        Width and height of the picture in pixels.
    grad : array_like, shape (H, W), or (H, W, C) with `colors`
        Gradient of some number with respect to ``overdraw(sampling="area")``, the sum of the areas of a pixel. For
        `coverage` it is the same where less than 1 is covered, and 0 elsewhere. With `colors`: with respect to the sum
        of areas times colours, which is `fill` over black where no triangles overlap.
    colors : array_like, shape (T, C), optional
        Of each triangle.
    threads : int, optional
        As in `rasterize`; never changes a bit.

    Returns
    -------
    ndarray of float64, shape of `vertices`
        Its gradient with respect to the vertices; 0 for triangles without area. It is exact for the triangles
        before the snap.

    Raises
    ------
    ValueError
        For a wrong shape, or a vertex that is not finite.
    IndexError
        For an index outside the vertices.

    References
    ----------
    T. Auzinger, M. Guthe, S. Jeschke, Analytic Anti-Aliasing of Linear Functions on Polytopes, 2012.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> tl.area_vjp([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 4), np.ones((4, 4)))
    array([[-2., -2.],
           [ 2.,  0.],
           [ 0.,  2.]])
    """
    points = as_real("vertices", vertices)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"vertices must have shape (V, 2) or (V, 3), got {points.shape}")
    points_px = np.ascontiguousarray(points[:, :2])
    if not np.isfinite(points_px).all():
        raise ValueError(f"vertices must be finite, row {np.argwhere(~np.isfinite(points_px))[0][0]} is not")
    rows = as_checked_triangles(triangles, len(points))
    width, height = as_size(size)
    of_triangles = None
    if colors is not None:
        of_triangles = np.ascontiguousarray(as_real("colors", colors))
        if of_triangles.ndim != 2 or len(of_triangles) != len(rows):
            raise ValueError(f"colors must have shape ({len(rows)}, C), got {of_triangles.shape}")
    shape = (height, width) if of_triangles is None else (height, width, of_triangles.shape[1])
    given = as_pixels("grad", grad)
    if given.shape != shape:
        raise ValueError(f"grad must have shape {shape}, got {given.shape}")
    corners_px, g_corners = points_px[rows].reshape(-1, 2), np.zeros((3 * len(rows), 2))
    of_pixels = given.reshape(height, width, -1)

    def work(first: int, end: int) -> None:
        own, part = np.arange(3 * (end - first), dtype=np.int32).reshape(-1, 3), slice(3 * first, 3 * end)
        values = None if of_triangles is None else of_triangles[first:end]
        engine.area_vjp(corners_px[part], own, values, of_pixels, g_corners[part])

    n_threads = threads_of_rows(len(rows), parse_threads(threads))
    # parts of at most 2**20 steps from pixel to pixel, or a triangle, for Ctrl-C is heard between parts alone
    n_steps = 3 * len(rows) * (width + height) * of_pixels.shape[2]
    run_parts(work, len(rows), max(n_threads, n_steps >> 20), n_threads)
    out = np.zeros(points_px.shape)
    for axis in range(2):
        out[:, axis] = np.bincount(rows.ravel(), g_corners[:, axis], len(points))
    return out if points.shape[1] == 2 else np.column_stack([out, np.zeros(len(out))])
