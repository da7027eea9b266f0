"""The classics behind the public verbs: checks, one kernel call, the buffers that all methods fill.

In: arguments of `coverage`, `overdraw` or `fill`, with a ``method=`` of `CLASSICS`.  Out: their results.  Vertices are
pixels; there is no transform, clipping, culling or depth.  A count is the number of times that a pixel was drawn, so a
method that draws a row twice shows it.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core.base.arrays import apart_from, as_background, as_checked_triangles, as_out, as_triangles, as_vertices
from topleft._core.base.memory import Memory, empty
from topleft._core.base.options import Sampling, Sink, parse
from topleft._core.raster.view import View
from topleft.methods import Method, load_kernel
from topleft.typing import PerOption

NAMES = {Sink.MASK: "coverage", Sink.COUNT: "overdraw", Sink.LABEL: "labels"}


def bresenham_line(x0: int, y0: int, x1: int, y1: int) -> NDArray[np.int64]:
    """Return the pixels of Bresenham's line between two pixels, always from the upper one down.

    Parameters
    ----------
    x0, y0, x1, y1 : int
        Columns and rows of the ends; both are drawn. A horizontal line runs from the first to the second.

    Returns
    -------
    ndarray of int64, shape (N, 2)
        Columns and rows, ``N = max(abs(x1 - x0), abs(y1 - y0)) + 1``.

    Raises
    ------
    TypeError
        If a coordinate is not an integer.
    ValueError
        If one lies beyond 2**31.

    Notes
    -----
    Parts of a line need not hold the same pixels as the whole, which is why `method="bresenham_scanline"` leaves gaps.

    References
    ----------
    J. E. Bresenham, Algorithm for computer control of a digital plotter, 1965.

    Examples
    --------
    >>> bresenham_line(3, 2, 0, 0).tolist()
    [[0, 0], [1, 1], [2, 1], [3, 2]]
    """
    from topleft.methods.classics import classic_kernels

    try:
        ends = [operator.index(value) for value in (x0, y0, x1, y1)]
    except TypeError:
        raise TypeError(f"x0, y0, x1 and y1 must be integers, got {(x0, y0, x1, y1)}") from None
    if max(map(abs, ends)) > 2**31:
        raise ValueError(f"x0, y0, x1 and y1 must lie within 2**31 pixels of 0, got {tuple(ends)}")
    return classic_kernels.line_pixels(*ends)


def draw_classic(
    method: Method,
    memory: Memory,
    vertices: ArrayLike,
    triangles: ArrayLike,
    view: View,
    sink: Sink,
    out: object = None,
) -> NDArray[Any]:
    """Return the mask, the counts or the labels (-1: none) that a classic draws."""
    check_options(method, view)
    vertices, triangles = apart_from(out, "vertices", vertices), apart_from(out, "triangles", triangles)
    points, corners = as_scene(method, vertices, triangles, view)
    shape, dtype = view.size[::-1], np.dtype(np.bool_ if sink is Sink.MASK else np.int32)
    result = memory.empty(NAMES[sink], shape, dtype) if out is None else as_out("out", out, shape, dtype.type)
    canvas = result if result.flags.carray else empty(shape, dtype)
    canvas.fill(-1 if sink is Sink.LABEL else 0)
    draw, variant = load_kernel(method)
    pixels = canvas.reshape(-1).view(np.uint8)
    draw(points, corners, pixels, (*view.origin, *view.size), sink, variant, view.subpixel_bits)
    if canvas is not result:
        result[...] = canvas
    return result


def fill_classic(
    method: Method,
    memory: Memory,
    vertices: ArrayLike,
    triangles: ArrayLike,
    colors: NDArray[Any],
    view: View,
    per: PerOption,
    background: ArrayLike | None,
    out: object,
) -> NDArray[Any]:
    """Return the picture of triangles in one colour each, the later over the earlier."""
    n_triangles = len(as_triangles(triangles))
    if parse(PerOption, "per", per) == "vertex" or len(colors) != n_triangles:
        raise ValueError(
            f"colors must have {n_triangles} rows, one per triangle, for method {method.name!r}, got {len(colors)}"
        )
    labels = draw_classic(method, memory, vertices, triangles, view, Sink.LABEL)
    ground = as_background(background, colors)
    shape = (*view.size[::-1], *colors.shape[1:])
    result = memory.empty("fill", shape, colors.dtype) if out is None else as_out("out", out, shape, colors.dtype.type)
    if ground is not None:
        result[...] = ground
    elif out is None:
        result.fill(0)
    is_drawn = labels >= 0
    result[is_drawn] = colors[labels[is_drawn]]
    return result


def check_options(method: Method, view: View) -> None:
    """Raise an error for an option that would change the picture and that a classic does not have."""
    if view.transform is not None:
        raise ValueError(f"method {method.name!r} takes vertices in pixels, got a transform")
    if view.sampling is not Sampling.CENTER:
        raise ValueError(f"sampling must be 'center' for method {method.name!r}, got {str(view.sampling)!r}")
    if view.cull:
        raise ValueError(f"cull must be 'none' for method {method.name!r}")
    if view.subpixel_bits != 8 and not method.has_subpixel_bits:
        raise ValueError(f"method {method.name!r} has no sub-pixel bits, got subpixel_bits={view.subpixel_bits}")


def as_scene(
    method: Method, vertices: ArrayLike, triangles: ArrayLike, view: View
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return float64 pixels and int32 indices, after checking every vertex that a triangle uses."""
    points = as_vertices(vertices, has_transform=False)
    if points.shape[1] == 4:
        raise ValueError(f"method {method.name!r} takes vertices in pixels, (V, 2) or (V, 3), got shape {points.shape}")
    points = np.array(points, np.float64, order="C")  # a copy: nobody else changes it after the check
    corners = as_checked_triangles(triangles, len(points))
    # Without sub-pixel bits a kernel takes one bit, so that a pixel centre is an integer.
    limit = method.limit / 2 ** max(1, view.subpixel_bits) if method.has_subpixel_bits else method.limit
    with np.errstate(invalid="ignore"):
        is_bad = ~(np.abs(points[:, :2]) < limit).all(axis=1)
    if is_bad.any() and (bad := corners[is_bad[corners]]).size:
        i = int(bad.min())
        row = points[i].tolist()
        if not np.isfinite(points[i, :2]).all():
            raise ValueError(f"vertices must be finite where a triangle uses them, got {row} in row {i}")
        raise ValueError(
            f"vertices must lie within {limit:.0f} pixels of 0 for method {method.name!r}, got {row} in row {i}"
        )
    return points, corners
