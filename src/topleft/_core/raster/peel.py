"""Depth peeling: the nearest layers of every pixel, sorted.

In: meshes after the snap.  Out: `DepthLayers`, ids and depths of K layers, and attributes of each.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from typing import NoReturn, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import shown
from topleft._core.base.memory import FRESH, SCRATCH, Memory, check_fits
from topleft._core.base.options import Sampling, parse
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.sampling import bits_of_bands
from topleft._core.raster.snap import Snapped, refuse_changed, snap_mesh
from topleft._core.raster.view import View, ViewOptions
from topleft.typing import DepthTestOption

#: All layers of a band of rows, which stay in a cache while the band is drawn.
BAND_BYTES = 1 << 20


class DepthLayers:
    """The depth layers that `peel` returns: the triangles that cover a pixel's centre, the nearest first.

    Attributes
    ----------
    triangle : ndarray of int32, shape (H, W, K)
        Index of the triangle, -1 where there are fewer layers.
    depth : ndarray of float32, shape (H, W, K)
        Its depth; +inf where there are fewer, -inf with ``depth_test="greater"``.
    planes : (ndarray of int32, ndarray of float32), each of shape (K, H, W)
        `triangle` and `depth` as they lie in memory.

    Examples
    --------
    >>> import topleft as tl
    >>> far, near = [(0, 0, 0.9), (4, 0, 0.9), (0, 4, 0.9)], [(0, 0, 0.1), (4, 0, 0.1), (0, 4, 0.1)]
    >>> layers = tl.peel([*far, *near], [(0, 1, 2), (3, 4, 5)], (2, 1))
    >>> layers.triangle[0, 0].tolist(), layers.count.tolist()
    ([1, 0, -1, -1], [[2, 2]])
    """

    def __init__(self, ids: NDArray[np.int32], depth: NDArray[np.float32], snapped: Snapped) -> None:
        """Take planes (K, H, W) of a mesh."""
        self.planes = ids, depth
        self._snapped = snapped

    def __repr__(self) -> str:
        n, height, width = self.planes[0].shape
        return f"{type(self).__name__}({width}x{height}, {n} layers, {self.n_triangles} triangles)"

    def __len__(self) -> int:
        return len(self.planes[0])

    @property
    def triangle(self) -> NDArray[np.int32]:
        """Index of the triangle of each layer, int32 (H, W, K), -1 where there are fewer."""
        return np.moveaxis(self.planes[0], 0, -1)

    @property
    def depth(self) -> NDArray[np.float32]:
        """Depth of each layer, float32 (H, W, K)."""
        return np.moveaxis(self.planes[1], 0, -1)

    @property
    def n_triangles(self) -> int:
        """Triangles of the mesh that was peeled."""
        return self._snapped.n_triangles

    @property
    def n_vertices(self) -> int | None:
        """Vertices of the mesh that was peeled; None where there are several meshes."""
        return self._snapped.n_vertices

    @property
    def count(self) -> NDArray[np.int32]:
        """How many layers a pixel has, at most K: int32 (H, W)."""
        return (self.planes[0] >= 0).sum(0, dtype=np.int32)

    def layer(self, k: int) -> Fragments:
        """Return layer k, 0 the nearest, as a visibility buffer, which computes attributes."""
        return self.rows(k, 0, self.planes[0].shape[1])

    def rows(self, k: int, top: int, n_rows: int) -> Fragments:
        """Return rows [top, top + n_rows) of layer k as a visibility buffer."""
        n = len(self.planes[0])
        if not isinstance(k, int | np.integer):
            raise TypeError(f"k must be an integer, got {shown(k)}")
        if not -n <= k < n:
            raise IndexError(f"k must be a layer in [0, {n}), got {k}")
        (ids, depth), box = self.planes, (k, slice(top, top + n_rows))
        snapped = self._snapped
        return Fragments(ids[box], depth[box], snapped.mesh.moved(0, top), snapped.n_vertices, snapped.n_triangles)


def peel(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    *,
    layers: int = 4,
    depth_test: DepthTestOption = "less",
    **view: Unpack[ViewOptions],
) -> DepthLayers:
    """Return the nearest layers of every pixel: ids and depths, sorted, as depth peeling gives them.

    Parameters
    ----------
    vertices, triangles, size, **view
        As in `rasterize`, one sample a pixel.
    layers : int, 1 to 16
        How many layers are kept of a pixel.
    depth_test : "less" or "greater"
        Which depth comes first.

    Returns
    -------
    DepthLayers
        ``.triangle`` (H, W, K) int32 with -1 for none, ``.depth`` (H, W, K) float32, ``.count`` (H, W), and
        ``.layer(k)``, the visibility buffer of one layer.

    Raises
    ------
    ValueError, TypeError, IndexError
        As in `rasterize`; also a number of layers outside 1 to 16, or several samples a pixel.

    Notes
    -----
    The layers of a pixel are the triangles that cover its centre, by their depth, at equal depth by their index; each
    has the id and the depth that `rasterize` gives it when it is drawn alone. So layer 0 equals `rasterize`, and
    layer k equals it without the surfaces of the layers before. Vertices (V, 2) lie at depth 0: their
    layers are the triangles in the order of their indices.

    References
    ----------
    C. Everitt, Interactive Order-Independent Transparency, 2001.

    Examples
    --------
    >>> import topleft as tl
    >>> vertices = [[0, 0, 5], [4, 0, 5], [0, 4, 5], [0, 0, 0], [2, 0, 2], [0, 2, 2]]
    >>> tl.peel(vertices, [[0, 1, 2], [3, 4, 5]], (4, 1), layers=2).triangle
    array([[[ 1,  0],
            [ 0, -1],
            [ 0, -1],
            [-1, -1]]], dtype=int32)
    """
    return draw_layers_of(vertices, triangles, View.parse(size, view), layers, depth_test)


def draw_layers_of(
    vertices: ArrayLike, triangles: ArrayLike, view: View, layers: int, depth_test: DepthTestOption
) -> DepthLayers:
    """Return the layers of `peel` by checked options."""
    n, is_farthest = check_peel(view, layers, depth_test)
    # Layers refer to the arrays that they were drawn from, so none of these can be reused.
    snapped = snap_mesh(FRESH, vertices, triangles, view, with_depth=True, out=None)
    ids, depth = peel_meshes(SCRATCH, [[snapped.mesh]], view, n, is_farthest=is_farthest, refuse=snapped.refuse)
    return DepthLayers(ids, depth, snapped)


def check_peel(view: View, layers: int, depth_test: str) -> tuple[int, bool]:
    """Return how many layers are wanted, and whether the larger depth comes first, after checking the options."""
    view.refuse_classic("depth")
    if view.sampling is not Sampling.CENTER:
        raise ValueError(f"sampling {str(view.sampling)!r} gives no sorted layers: peel takes 'center'")
    return as_layers(layers), parse(DepthTestOption, "depth_test", depth_test) == "greater"


def as_layers(layers: object) -> int:
    """Return a number of layers after checking it."""
    try:
        n = operator.index(layers)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"layers must be an integer, got {layers!r}") from None
    if not 1 <= n <= engine.MAX_LAYERS:
        raise ValueError(f"layers must lie in 1 to {engine.MAX_LAYERS}, got {n}")
    return n


def peel_meshes(
    memory: Memory,
    chunks: Iterable[Sequence[engine.SnappedMesh]],
    view: View,
    n_layers: int,
    *,
    is_farthest: bool,
    at_fx: tuple[int, int] = (0, 0),
    refuse: Callable[[], NoReturn] = refuse_changed,
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return planes (K, H, W) of ids and depths of all meshes together, which know their first ids.

    `chunks`: some meshes at a time; a band of rows is drawn once with all of them, and none is held afterwards.
    `at_fx`: where in the pixel they are looked at, in sub-pixels of the view's grid from the centre. `refuse` raises
    the error for an index outside the vertices.
    """
    reach_fx = max(map(abs, at_fx))
    width, height = view.size
    check_fits((n_layers, height, width), np.int32, np.float32)
    ids: NDArray[np.int32] = FRESH.empty("layer ids", (n_layers, height, width), np.int32)
    depth: NDArray[np.float32] = FRESH.empty("layer depth", (n_layers, height, width), np.float32)
    # without bins each band looks at all triangles: few bands; a band has less than 2**31 pixels
    n_pixels = BAND_BYTES // (8 * n_layers) if choices.can_slice(view) else min(height * width, 2**31 - 1)

    def peel_chunk(meshes: Sequence[engine.SnappedMesh], *, is_first: bool) -> None:
        meshes = [mesh.at_sample(*at_fx) for mesh in meshes] if any(at_fx) else meshes
        n_threads = min(height, count_threads(view.threads, sum(mesh.n_triangles for mesh in meshes)))
        bits = bits_of_bands((height, width), n_pixels, n_threads)
        bins = [bins_of(memory, mesh, view, bits, reach_fx) for mesh in meshes]

        def peel_bands(first: int, end: int) -> int:
            return engine.peel(meshes, bins, ids, depth, is_farthest, bits, first, end, is_first)

        is_bad = any(one is not None and one.bad_row >= 0 for one in bins)
        if is_bad or max(run_parts(peel_bands, -(-height >> bits), n_threads)) >= 0:
            refuse()

    is_first = True
    for meshes in chunks if 0 not in view.size else ():
        peel_chunk(meshes, is_first=is_first)
        is_first = False
    return ids, depth


def bins_of(memory: Memory, mesh: engine.SnappedMesh, view: View, band_bits: int, reach_fx: int) -> engine.Bins | None:
    """Return the triangles of each band of rows; None where every band looks at all of them."""
    if not (mesh.n_triangles and choices.can_slice(view)):
        return None
    room = memory.scratch("bins", (3, mesh.n_triangles + 16), np.int32)
    bins = engine.Bins(mesh, *view.size[::-1], reach_fx, band_bits, room)
    if bins.bad_row < 0:
        bins.fill(np.empty(bins.n_listed + 1, np.int32))
    return bins
