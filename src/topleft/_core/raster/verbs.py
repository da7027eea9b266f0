"""The five verbs on fresh memory, and `Rasterizer`, which has them on memory that is kept."""

from __future__ import annotations

from functools import partial
from threading import Lock
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from topleft._core.base.arrays import as_size
from topleft._core.base.memory import FRESH, SCRATCH, KeptMemory
from topleft._core.base.threads import parse_threads
from topleft._core.raster.fill import Style, draw_fill
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.lines import draw_wireframe
from topleft._core.raster.rasterize import draw_coverage, draw_fragments, draw_overdraw, fragment_options
from topleft._core.raster.view import View, ViewOptions
from topleft.typing import AlphaOption, BlendOption, DepthTestOption, PerOption, ResolveOption

WHY_LINES = "lines run between points of the grid"


def coverage(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    *,
    out: NDArray[Any] | None = None,
    **view: Unpack[ViewOptions],
) -> NDArray[Any]:
    """Return the mask of the pixels with a covered centre, or how much of each pixel triangles cover.

    Parameters
    ----------
    vertices : array_like, shape (V, 2), (V, 3) or (V, 4)
        Pixels (x right, y down), pixels and depth, or clip space. Object space (V, 3) with `transform`. Any real dtype.
    triangles : array_like of integers, shape (T, 3)
        Indices of vertices; either winding.
    size : (int, int), or int for a square
        Width and height of the picture in pixels.
    out : ndarray of bool (float32 for several samples and "area"), shape (H, W), optional
        Where the result goes. The first write to a fresh array takes several times as long as drawing a small mesh.
    **view
        * transform : array_like, shape (4, 4). Clip space from object space.
        * origin : (int, int). The pixel of the whole picture that is row 0, column 0 here.
        * viewport : (int, int). Width and height of the whole picture for clip space; default `size`.
        * subpixel_bits : int, 0 to 16, or "exact". Vertices snap to ``2**-subpixel_bits`` pixels; default 8. "exact":
          they stay where they are, the float64 numbers of the array, and these decide every sample, at every
          `sampling` but "area". `wireframe` has lines between points of the grid, and takes 0 to 16.
        * sampling : "center"; "msaa2", "msaa4", "msaa8" or "msaa16": so many samples a pixel, at the standard positions
          of Direct3D; "area": the exact area of the pixel (`coverage`, `overdraw` and `fill`). For `coverage` and
          `overdraw` also "outer": every pixel square that a triangle meets in positive area; "inner": every square
          that lies wholly inside a triangle.
        * method : "auto" (or "topleft"), "edge" or "scanline": the same picture. Or a classic of the literature, to
          compare with: `topleft.methods.CLASSICS` names them, and docs/guide/methods.md tells where each of them fails.
        * cull : "none", "back" or "front"; the front is counter-clockwise seen with y up.
        * clip_depth : "minus_one_to_one" (OpenGL) or "zero_to_one" (Direct3D, Vulkan).
        * near_clip, far_clip : bool. Whether that plane clips.
        * threads : int or None. The result is the same to the bit.

    Returns
    -------
    ndarray of bool, shape (H, W)
        False where nothing is. With several samples float32: the share of them that is covered. With
        ``sampling="area"`` float32: the areas of the triangles in each pixel, added up, at
        most 1. They are exactly 1 where triangles tile a pixel, and a single one is within 9e-8 of its exact area.

    Raises
    ------
    ValueError
        For a wrong shape, an unknown option, a vertex in use that is not finite or beyond ``2**62`` sub-pixels.
    TypeError
        For a wrong dtype.
    IndexError
        For an index outside the vertices; names the row.

    References
    ----------
    J. Pineda, A Parallel Algorithm for Polygon Rasterization, 1988; R. Levien, font-rs, 2015 (area).

    Examples
    --------
    >>> import topleft as tl
    >>> tl.coverage([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 3)).astype(int)
    array([[1, 1, 1, 0],
           [1, 1, 0, 0],
           [1, 0, 0, 0]])
    >>> tl.coverage([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 3), sampling="area")
    array([[1. , 1. , 1. , 0.5],
           [1. , 1. , 0.5, 0. ],
           [1. , 0.5, 0. , 0. ]], dtype=float32)
    """
    return draw_coverage(SCRATCH, vertices, triangles, View.parse(size, view), out)


def overdraw(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    *,
    out: NDArray[Any] | None = None,
    **view: Unpack[ViewOptions],
) -> NDArray[Any]:
    """Return how many triangles cover each pixel's centre, or the sum of the areas that they cover.

    Parameters
    ----------
    vertices, triangles, size, **view
        As in `coverage`.
    out : ndarray of int32 (float32 for "area"), shape (H, W), or (H, W, S) for S samples, optional
        Where the result goes.

    Returns
    -------
    ndarray of int32, shape (H, W), or (H, W, S) for S samples a pixel
        0 where nothing is. With ``sampling="area"`` float32: the areas of the triangles in each pixel, added up.

    Raises
    ------
    ValueError, TypeError, IndexError
        As in `coverage`.

    Examples
    --------
    Two triangles share the diagonal of a square; each pixel on it belongs to one of them.

    >>> import topleft as tl
    >>> tl.overdraw([[0, 0], [3, 0], [3, 3], [0, 3]], [[0, 1, 2], [0, 2, 3]], (3, 3))
    array([[1, 1, 1],
           [1, 1, 1],
           [1, 1, 1]], dtype=int32)
    """
    return draw_overdraw(SCRATCH, vertices, triangles, View.parse(size, view), out)


def fill(
    vertices: ArrayLike,
    triangles: ArrayLike,
    colors: ArrayLike,
    size: int | tuple[int, int],
    *,
    per: PerOption = "auto",
    background: ArrayLike | None = None,
    blend: BlendOption = "replace",
    alpha: AlphaOption = "straight",
    resolve: ResolveOption = "values",
    dtype: DTypeLike | None = None,
    out: NDArray[Any] | None = None,
    **view: Unpack[ViewOptions],
) -> NDArray[Any]:
    """Return a picture of coloured triangles in painter's order: later ones cover earlier ones, or blend with them.

    Parameters
    ----------
    vertices, triangles, size, **view
        As in `coverage`.
    colors : array_like, shape (T, C), (V, C), (T,) or (V,), C from 1 to 4
        uint8 (any integers in 0..255) or float32 (any floats). Per triangle: flat. Per vertex: interpolated linearly
        on the screen.
    per : "auto", "triangle" or "vertex"
        The owner of a row of `colors`; "auto" decides by the number of rows.
    background : number or array_like, shape (C,), optional
        Fills the picture first; 0 when neither `background` nor `out` is given.
    blend : "replace", "over", "add", "multiply", "max" or "min"
        How a colour is combined with the picture, one triangle after the other. "over" keeps 1 - alpha of the picture;
        alpha is the last of 2 or 4 channels. The others act on each channel alike, alpha included; uint8
        sums stop at 255, and 255 is 1 in products. With ``sampling="area"`` the share of the pixel that the triangle
        covers multiplies alpha, or is the share of the way from the old colour to the new. With several samples a pixel
        each sample is blended by itself.
    alpha : "straight" or "premultiplied"
        Whether colours and picture, the last of 2 or 4 channels alpha, have been multiplied by it. "over" uses alpha,
        and "replace" where a pixel mixes colours, by area or in the mean of samples. Choose "premultiplied" for
        numbers that are no colours: all channels are treated alike.
    resolve : "values" or "linear"
        With several samples a pixel ("msaa4", say) each pixel is the mean of its samples: of their values as they are,
        or, for uint8, of the light that sRGB values stand for (alpha, the last of 2 or 4 channels, as it is).
    dtype : dtype of integers, optional
        `colors` are labels, (T,) or (T, C), and so is the picture: a pixel has exactly the numbers of its triangle.
    out : ndarray of uint8, float32 or `dtype`, shape (H, W, C) or (H, W), optional
        The picture to draw over.

    Returns
    -------
    ndarray of uint8 or float32, shape (H, W, C), or (H, W) for one-dimensional `colors`
        uint8 values are the exact ones rounded to nearest, ties to even.

    Raises
    ------
    ValueError
        As in `coverage`; also when `colors` fits neither the triangles nor the vertices, or both.
    TypeError, IndexError
        As in `coverage`.

    References
    ----------
    H. Gouraud, Continuous Shading of Curved Surfaces, 1971; T. Porter, T. Duff, Compositing Digital Images, 1984.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> tl.fill([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], [0, 200, 0], (4, 2), per="vertex", background=9)
    array([[ 25,  75, 125,   9],
           [ 25,  75,   9,   9]], dtype=uint8)
    >>> twice, half_white = [[0, 1, 2]] * 2, [[255, 128]] * 2
    >>> tl.fill([[0, 0], [4, 0], [0, 4]], twice, half_white, (4, 1), blend="over", background=(0, 255))[..., 0]
    array([[192, 192, 192,   0]], dtype=uint8)
    >>> tl.fill([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], [70000], (4, 2), background=-1, dtype=np.int32)
    array([[70000, 70000, 70000,    -1],
           [70000, 70000,    -1,    -1]], dtype=int32)
    """
    checked = View.parse(size, view)
    style = Style(per, background, blend, alpha, resolve, dtype)
    return draw_fill(SCRATCH, vertices, triangles, colors, checked, style, out)


def rasterize(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    *,
    depth_test: DepthTestOption | None = "less",
    background_depth: float | None = None,
    out: tuple[NDArray[np.int32] | None, NDArray[np.float32] | None] | None = None,
    **view: Unpack[ViewOptions],
) -> Fragments:
    """Return the visibility buffer: which triangle shows in each pixel, and how deep.

    Parameters
    ----------
    vertices, triangles, size, **view
        As in `coverage`; `rasterize_poses` takes many poses of a mesh. The depth of pixel-space vertices (V, 3) is
        their third column; (V, 2) vertices lie at depth 0 and are drawn in painter's order.
    depth_test : "less", "greater" or None
        Which triangle is kept: the one with the smaller depth, with the larger depth, or the later one. At equal depth
        the triangle with the lower index.
    background_depth : float, optional
        Depth where nothing is; +inf, or -inf with "greater", unless given.
    out : (ndarray of int32, ndarray of float32), each of shape (H, W), or (H, W, S) for S samples, optional
        Where ids and depth go; either may be None. Without an array for it, the depth of vertices (V, 2) is made on
        first access: ids alone take half the time.

    Returns
    -------
    Fragments
        ``.triangle`` (H, W) int32 with -1 for none, ``.depth`` (H, W) float32, ``.mask`` (H, W) bool,
        ``.barycentric()``, ``.interpolate(values)``. With several samples a pixel also ``.samples_triangle`` and
        ``.samples_depth`` (H, W, S); all else is then of the first sample, which is nearest to the centre, and
        ``.sample(i)`` returns the fragments of another.

    Raises
    ------
    ValueError, TypeError, IndexError
        As in `coverage`; also for a vertex in use with a depth outside float32.

    Notes
    -----
    Depth is that of the plane through the snapped vertices, rounded once: at most half a unit in the last place of
    float32 from the exact value, plus ``2**-35`` times the largest depth of the triangle. Clip space gives window
    depth: ``(z/w + 1) / 2``, or ``z/w`` with ``clip_depth="zero_to_one"``, in [0, 1].

    References
    ----------
    E. Catmull, A Subdivision Algorithm for Computer Display of Curved Surfaces, 1974 (the depth buffer).

    Examples
    --------
    >>> import topleft as tl
    >>> vertices = [[0, 0, 0.5], [4, 0, 0.5], [0, 4, 0.5], [0, 0, 0], [2, 0, 2], [0, 2, 2]]
    >>> frags = tl.rasterize(vertices, [[0, 1, 2], [3, 4, 5]], (4, 2), depth_test="greater")
    >>> frags.triangle
    array([[ 1,  0,  0, -1],
           [ 0,  0, -1, -1]], dtype=int32)
    >>> frags.depth
    array([[ 1. ,  0.5,  0.5, -inf],
           [ 0.5,  0.5, -inf, -inf]], dtype=float32)
    """
    # fragments refer to the arrays that they were drawn from, so none of these can be reused
    checked = View.parse(size, view)
    options = fragment_options(checked, depth_test, background_depth, out)
    return draw_fragments(FRESH, vertices, triangles, checked, options)


def wireframe(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    *,
    depth: Fragments | NDArray[np.float32] | None = None,
    depth_test: DepthTestOption = "less",
    depth_bias: float = 2.0**-10,
    antialias: bool = False,
    out: NDArray[Any] | None = None,
    **view: Unpack[ViewOptions],
) -> NDArray[Any]:
    """Return the edges of the triangles as lines, each pixel of a line once.

    Parameters
    ----------
    vertices, triangles, size, **view
        As in `coverage`; `method` makes no difference. `cull` leaves out degenerate triangles, and edges of culled
        triangles alone.
    depth : Fragments or ndarray of float32, shape (H, W), optional
        Hides lines: a pixel of a line is drawn where its depth is at most `depth_bias` behind the buffer's.
    depth_test : "less" or "greater"
        Whether the smaller or the larger depth is nearer.
    depth_bias : float
        In units of depth. An edge lies on the surface that hides it, which falls away from the edge within the pixel:
        take the change of depth from pixel to pixel. The default suits window depth, 0 to 1 over the whole view.
    antialias : bool
        False: Bresenham lines between the pixels that hold the ends. True: coverage of lines one pixel wide between
        the ends themselves.
    out : ndarray, shape (H, W), optional
        Where the result goes.

    Returns
    -------
    ndarray of bool, or of float32 with `antialias`, shape (H, W)
        Where lines are; coverage in [0, 1].

    Raises
    ------
    ValueError, TypeError, IndexError
        As in `coverage`.

    Notes
    -----
    A line goes from its upper end to the lower one (a level one from left to right), so triangles on both sides of an
    edge draw the same pixels: of `d` steps along the longer side, step `k` is ``floor((q*k + floor(d/2)) / d)`` pixels
    across, `q` being the shorter side. It is computed in integers, whatever part of it the picture shows. Depth is
    linear in `k`. With `antialias` the coverage of a pixel is ``max(0, 1 - distance)``, the distance in pixels of its
    centre from the nearest edge that shows there, and depth that of the nearest point.

    References
    ----------
    J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965.
    S. Gupta, R. F. Sproull, Filtering Edges for Gray-Scale Displays, 1981 (intensity by distance).

    Examples
    --------
    >>> import topleft as tl
    >>> tl.wireframe([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (5, 5)).astype(int)
    array([[1, 1, 1, 1, 1],
           [1, 0, 0, 1, 0],
           [1, 0, 1, 0, 0],
           [1, 1, 0, 0, 0],
           [1, 0, 0, 0, 0]])
    """
    checked = View.parse(size, view, why_snapped=WHY_LINES)
    return draw_wireframe(SCRATCH, vertices, triangles, checked, depth, depth_test, depth_bias, antialias, out)


class LentMemory:
    """Lends a memory to one call at a time, and refuses other calls while it runs."""

    def __init__(self) -> None:
        self._lock, self.memory = Lock(), KeptMemory()

    def __enter__(self) -> KeptMemory:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("a Rasterizer draws one picture at a time, and this one draws: give each thread its own")
        return self.memory

    def __exit__(self, *_: object) -> None:
        self._lock.release()


class Rasterizer:
    """The five verbs for one size, on memory that is kept from call to call.

    The next call of a verb overwrites its last result; copy what must last. Not for use from several
    threads at once: give each its own. A copy, and one that has been pickled, has memory of its own.

    Parameters
    ----------
    size : (int, int), or int for a square
        Width and height of the picture in pixels.
    threads : int or None
        For every call that does not say otherwise.

    Examples
    --------
    >>> import topleft as tl
    >>> rasterizer = tl.Rasterizer((4, 4))
    >>> int(rasterizer.coverage([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]]).sum())
    6
    """

    def __init__(self, size: int | tuple[int, int], *, threads: int | None = None) -> None:
        self.size = as_size(size)
        self.threads = parse_threads(threads)
        self._lent = LentMemory()

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(type(self), threads=self.threads), (self.size,)

    def __repr__(self) -> str:
        return f"Rasterizer(size={self.size}, threads={self.threads})"

    def _view(self, options: ViewOptions, *, why_snapped: str | None = None) -> View:
        options.setdefault("threads", self.threads)
        return View.parse(self.size, options, why_snapped=why_snapped)

    def coverage(
        self, vertices: ArrayLike, triangles: ArrayLike, *, out: NDArray[Any] | None = None, **view: Unpack[ViewOptions]
    ) -> NDArray[Any]:
        """Return the mask of the pixels that a triangle covers, as `topleft.coverage` does."""
        with self._lent as memory:
            return draw_coverage(memory, vertices, triangles, self._view(view), out)

    def overdraw(
        self, vertices: ArrayLike, triangles: ArrayLike, *, out: NDArray[Any] | None = None, **view: Unpack[ViewOptions]
    ) -> NDArray[Any]:
        """Return how many triangles cover each pixel, as `topleft.overdraw` does."""
        with self._lent as memory:
            return draw_overdraw(memory, vertices, triangles, self._view(view), out)

    def fill(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        colors: ArrayLike,
        *,
        per: PerOption = "auto",
        background: ArrayLike | None = None,
        blend: BlendOption = "replace",
        alpha: AlphaOption = "straight",
        resolve: ResolveOption = "values",
        dtype: DTypeLike | None = None,
        out: NDArray[Any] | None = None,
        **view: Unpack[ViewOptions],
    ) -> NDArray[Any]:
        """Return a picture of coloured triangles in painter's order, as `topleft.fill` does."""
        style = Style(per, background, blend, alpha, resolve, dtype)
        with self._lent as memory:
            return draw_fill(memory, vertices, triangles, colors, self._view(view), style, out)

    def rasterize(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        *,
        depth_test: DepthTestOption | None = "less",
        background_depth: float | None = None,
        out: tuple[NDArray[np.int32] | None, NDArray[np.float32] | None] | None = None,
        **view: Unpack[ViewOptions],
    ) -> Fragments:
        """Return the visibility buffer, as `topleft.rasterize` does; its attributes also end with the next call."""
        checked = self._view(view)
        options = fragment_options(checked, depth_test, background_depth, out)
        with self._lent as memory:
            return draw_fragments(memory, vertices, triangles, checked, options)

    def wireframe(
        self,
        vertices: ArrayLike,
        triangles: ArrayLike,
        *,
        depth: Fragments | NDArray[np.float32] | None = None,
        depth_test: DepthTestOption = "less",
        depth_bias: float = 2.0**-10,
        antialias: bool = False,
        out: NDArray[Any] | None = None,
        **view: Unpack[ViewOptions],
    ) -> NDArray[Any]:
        """Return the edges of the triangles as lines, as `topleft.wireframe` does."""
        checked = self._view(view, why_snapped=WHY_LINES)
        with self._lent as memory:
            return draw_wireframe(memory, vertices, triangles, checked, depth, depth_test, depth_bias, antialias, out)
