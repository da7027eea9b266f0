"""The edges of a mesh as lines: which edges, then their pixels.

arrays -> transform -> snap -> edges -> lines
"""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core import engine
from topleft._core.base.arrays import apart_from, as_array, as_number
from topleft._core.base.memory import Memory
from topleft._core.base.options import parse
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.rasterize import Canvas
from topleft._core.raster.snap import Snapped, snap_mesh
from topleft._core.raster.view import View
from topleft.typing import DepthTestOption


def list_edges(memory: Memory, snapped: Snapped) -> NDArray[np.uint64]:
    """Return the edges of the triangles that are not culled, each once: lower index + 2**32 * higher index."""
    n_vertices, n_edges = snapped.n_vertices, 3 * snapped.n_triangles
    edges: NDArray[np.uint64] = memory.scratch("edges", (n_edges,), np.uint64)
    starts = memory.scratch("edge starts", (n_vertices + 1,), np.int64)
    last_low = memory.scratch("edge last_low", (n_vertices,), np.int32)
    highs = memory.scratch("edge highs", (n_edges,), np.int32)
    n = engine.list_edges(snapped.mesh, starts, last_low, highs, edges)
    if n < 0:
        snapped.refuse()
    return edges[:n]


def as_depth(depth: object, shape: tuple[int, ...]) -> NDArray[np.float32] | None:
    """Return the buffer that hides lines, contiguous."""
    if depth is None:
        return None
    array = depth.depth if isinstance(depth, Fragments) else as_array("depth", cast("ArrayLike", depth))
    if array.dtype != np.float32:
        raise TypeError(f"depth must be Fragments or a float32 array, got dtype {array.dtype}")
    if array.shape != shape:
        raise ValueError(f"depth must have the shape of the picture, {shape}, got {array.shape}")
    return np.ascontiguousarray(array)


def draw_wireframe(
    memory: Memory,
    vertices: ArrayLike,
    triangles: ArrayLike,
    view: View,
    depth: object,
    depth_test: DepthTestOption,
    depth_bias: float,
    antialias: bool,
    out: object,
) -> NDArray[Any]:
    """Draw as `wireframe` does, in this memory."""
    width, height = view.size
    hides = as_depth(depth, (height, width))
    hides = None if hides is None else np.asarray(apart_from(out, "depth", hides))
    is_farthest = parse(DepthTestOption, "depth_test", depth_test) == "greater"
    bias = as_number("depth_bias", depth_bias)
    if not math.isfinite(bias):
        raise ValueError(f"depth_bias must be finite, got {depth_bias!r}")
    snapped = snap_mesh(memory, vertices, triangles, view, with_depth=depth is not None, out=out)
    edges = list_edges(memory, snapped)
    dtype = np.float32 if antialias else np.bool_
    with Canvas.of(memory, "wireframe", out, (height, width), dtype) as (result, canvas):
        flat = engine.as_bytes(canvas)

        def draw_rows(first: int, end: int) -> None:
            engine.draw_lines(snapped.mesh, edges, flat, hides, bias, is_farthest, antialias, width, first, end - first)

        run_parts(draw_rows, height, count_threads(view.threads, snapped.n_triangles))
    return result
