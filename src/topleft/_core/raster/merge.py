"""Merges visibility buffers: several processes draw a share of the triangles each, for the whole picture.

Input: ids and depth of each share. Output: ids and depth of all triangles, to the bit, whatever the shares were.

Based on: S. Molnar, M. Cox, D. Ellsworth, H. Fuchs, A Sorting Classification of Parallel Rendering, 1994 (sort-last).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from topleft._core.base.array_types import F32, I32
from topleft._core.base.arrays import INT32_MAX, as_array, shown
from topleft._core.base.options import parse
from topleft._core.base.threads import parse_threads, run_parts
from topleft._core.raster.fragments import Fragments
from topleft.typing import DepthTestOption

#: Pixels a thread; below that starting it costs more than it saves.
MIN_PIXELS_PER_THREAD = 1 << 18

#: Pixels that stay in the second-level cache while they are merged.
PIXELS_AT_ONCE = 1 << 14


def merge(
    buffers: Iterable[Any],
    *,
    triangles: Sequence[Any] | None = None,
    depth_test: DepthTestOption | None = "less",
    threads: int | None = None,
) -> tuple[I32, F32]:
    """Return the visibility buffer of all triangles from the buffers of shares of them.

    Parameters
    ----------
    buffers : iterable of Fragments, or of pairs (ids, depth)
        Of one size; ids int32 with -1 for nothing, depth float32, both (H, W) or (H, W, S). A generator is read one by
        one: only the result and one buffer are held. Of `SceneFragments` the ids are ``.id``: the triangles of all
        instances.
    triangles : sequence of int or of arrays of integers, optional
        For each buffer which triangles were drawn to it: the index of the first, if they are neighbours, or the index
        of each, ascending. Unless given, ids are those of the whole already.
    depth_test : {"less", "greater", None}
        As they were drawn. None: the larger index shows, painter's order.
    threads : int, optional
        How many at most.

    Returns
    -------
    ids : ndarray of int32
    depth : ndarray of float32
        Equal to `rasterize` of all triangles, bit for bit: the nearest one, the lower index at equal depth.

    Raises
    ------
    ValueError
        If there are no buffers, their shapes differ, or ids have no triangle in `triangles`.
    TypeError
        If something is no buffer, or has the wrong dtype.

    Notes
    -----
    Merging is associative and commutative, so buffers may also be merged in pairs, in a tree. It takes 16 bytes a pixel
    of reading and 8 of writing: it pays where drawing a share takes longer.

    Examples
    --------
    >>> import numpy as np, topleft as tl
    >>> vertices, triangles, _ = tl.scenes.random_triangles(1000, 20, 64, 64)
    >>> whole = tl.rasterize(vertices, triangles, 64)
    >>> shares = [tl.rasterize(vertices, triangles[first : first + 250], 64) for first in range(0, 1000, 250)]
    >>> ids, depth = tl.merge(shares, triangles=range(0, 1000, 250))
    >>> np.array_equal(ids, whole.triangle), np.array_equal(depth, whole.depth)
    (True, True)
    """
    test = None if depth_test is None else parse(DepthTestOption, "depth_test", depth_test)
    n_threads = parse_threads(threads)
    if isinstance(buffers, Fragments | str | bytes | dict | set) or not hasattr(type(buffers), "__iter__"):
        raise TypeError(f"buffers must be an iterable of Fragments or pairs (ids, depth), got {shown(buffers)}")
    if getattr(buffers, "ndim", 1) == 0:
        raise TypeError("buffers must be an iterable of Fragments or pairs (ids, depth), got one number")
    shares = None if triangles is None else _as_shares(triangles)
    ids: I32 | None = None
    depth: F32 | None = None
    n = 0
    for i, buffer in enumerate(buffers):
        own_ids, own_depth = _as_buffer(buffer, i)
        names = None
        if shares is not None:
            if i >= len(shares):
                raise ValueError(f"triangles must have an item for each buffer, got {len(shares)}")
            own_ids = own_ids.copy()  # nobody else changes it after the check
            names = _as_names(shares[i], own_ids, i)
        if ids is None or depth is None:
            ids = np.full(own_ids.shape, -1, np.int32)
            depth = own_depth.copy()  # of the background, as in the first buffer
        if own_ids.shape != ids.shape:
            raise ValueError(f"buffers must have one shape, got {own_ids.shape} as buffer {i} after {ids.shape}")
        _merge_into(ids, depth, own_ids, own_depth, names, test, n_threads)
        n = i + 1
    if ids is None or depth is None:
        raise ValueError("buffers must be at least one, got none")
    if shares is not None and len(shares) != n:
        raise ValueError(f"triangles must have an item for each buffer, got {len(shares)} for {n}")
    return ids, depth


def _merge_into(
    ids: I32,
    depth: F32,
    own_ids: I32,
    own_depth: F32,
    names: int | I32 | None,
    test: DepthTestOption | None,
    threads: int | None,
) -> None:
    flat = ids.reshape(-1), depth.reshape(-1), own_ids.reshape(-1), own_depth.reshape(-1)

    def merge_part(first: int, end: int) -> None:
        for at in range(first, end, PIXELS_AT_ONCE):
            shown, z, other, other_z = (array[at : min(at + PIXELS_AT_ONCE, end)] for array in flat)
            if isinstance(names, np.ndarray):
                other = names[1 + other]
            elif names:
                other = np.where(other < 0, -1, other + np.int32(names))
            takes = other > shown
            if test is not None:
                is_nearer = other_z < z if test == "less" else other_z > z
                takes = (other >= 0) & ((shown < 0) | is_nearer | ((other_z == z) & (other < shown)))
            np.copyto(shown, other, where=takes)
            np.copyto(z, other_z, where=takes)

    n_parts = max(1, ids.size // MIN_PIXELS_PER_THREAD) if threads is None else threads
    run_parts(merge_part, ids.size, min(n_parts, 64))


def _as_shares(triangles: Any) -> list[Any]:
    is_one = isinstance(triangles, str | bytes | dict | set) or getattr(triangles, "ndim", 1) == 0
    if is_one or not hasattr(type(triangles), "__iter__"):
        raise TypeError(f"triangles must be a sequence with an item for each buffer, got {shown(triangles)}")
    return list(triangles)


def _as_buffer(buffer: Any, i: int) -> tuple[I32, F32]:
    try:
        ids, depth = _planes_of(buffer) if isinstance(buffer, Fragments) else buffer
    except (TypeError, ValueError):
        raise TypeError(f"buffers must be Fragments or pairs (ids, depth), got {shown(buffer)} as buffer {i}") from None
    ids, depth = as_array("ids", ids), as_array("depth", depth)
    if ids.dtype != np.int32 or depth.dtype != np.float32:
        raise TypeError(f"buffers must be int32 and float32, got {ids.dtype} and {depth.dtype} as buffer {i}")
    if ids.shape != depth.shape:
        raise ValueError(f"buffers must have ids and depth of one shape, got {ids.shape} and {depth.shape}")
    return np.ascontiguousarray(ids), np.ascontiguousarray(depth)


def _planes_of(frags: Fragments) -> tuple[Any, Any]:
    """Ids and depth, (H, W) or (H, W, S); ids of a scene count all its triangles."""
    samples = frags.samples_id
    return (samples, frags.samples_depth) if np.shape(samples)[-1:] != (1,) else (frags.id, frags.depth)


def _as_names(which: Any, ids: I32, i: int) -> int | I32:
    largest = int(ids.max(initial=-1))
    if isinstance(which, int | np.integer):
        if not (which >= 0 and which + max(largest, 0) <= INT32_MAX):
            raise ValueError(f"triangles must be indices from 0 to {INT32_MAX}, got {which} for buffer {i}")
        return int(which)
    array = as_array("triangles", which)
    array = array.astype(np.int32) if not array.size else array
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise TypeError(f"triangles must be an index or a column of them, got {shown(which)} for buffer {i}")
    if largest >= len(array) or int(ids.min(initial=-1)) < -1:
        raise ValueError(f"triangles has {len(array)} rows for buffer {i}, in which triangle {largest} shows")
    if len(array) and not (array.min() >= 0 and array.max() <= INT32_MAX and (np.diff(array) > 0).all()):
        raise ValueError(f"triangles must ascend from 0 to {INT32_MAX} at most, for buffer {i}")
    return np.concatenate([[-1], array]).astype(np.int32)
