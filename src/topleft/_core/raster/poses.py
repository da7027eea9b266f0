"""Draws many poses of a mesh: a visibility buffer for each, one behind the other.

Input: vertices (B, V, C) or transforms (B, 4, 4), and triangles that all poses share. Output: `FragmentsBatch`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._core.base.arrays import as_array, as_checked_triangles, as_out, as_transform, as_triangles
from topleft._core.base.memory import FRESH, empty
from topleft._core.base.threads import available_threads, run_parts
from topleft._core.raster.fragments import Attributes, Fragments
from topleft._core.raster.rasterize import draw_fragments, fragment_options
from topleft._core.raster.view import View, ViewOptions
from topleft.typing import DepthTestOption


class FragmentsBatch(Attributes, Sequence[Fragments]):
    """The visibility buffers of B poses that `rasterize_poses` returns, one behind the other.

    Attributes
    ----------
    triangle : ndarray of int32, shape (B, H, W)
        Index of the triangle that shows in the pixel, -1 where there is none.
    depth : ndarray of float32, shape (B, H, W)
        Its depth.
    samples_triangle, samples_depth : ndarray of int32 and of float32, shape (B, H, W, S)
        `triangle` and `depth` of each sample, with several a pixel; all else is then of the first sample.

    Examples
    --------
    >>> import numpy as np
    >>> import topleft as tl
    >>> poses = np.array([np.eye(4), np.diag([0.5, 0.5, 1, 1])])
    >>> corners = [(-1, -1, 0), (1, -1, 0), (-1, 1, 0)]
    >>> batch = tl.rasterize_poses(corners, [(0, 1, 2)], (4, 4), transform=poses)
    >>> batch.triangle.shape, batch.mask.sum(axis=(1, 2)).tolist()
    ((2, 4, 4), [6, 1])
    """

    def __init__(self, triangle: NDArray[np.int32], depth: NDArray[np.float32], frags: Sequence[Fragments]) -> None:
        self.id, self.depth = triangle, depth
        self._frags = tuple(frags)

    def __repr__(self) -> str:
        n, height, width = self.triangle.shape
        return f"FragmentsBatch({n} of {width}x{height})"

    def __len__(self) -> int:
        return len(self._frags)

    @overload
    def __getitem__(self, i: int) -> Fragments: ...
    @overload
    def __getitem__(self, i: slice) -> Sequence[Fragments]: ...
    def __getitem__(self, i: int | slice) -> Fragments | Sequence[Fragments]:
        """Return the visibility buffer of a pose; its arrays are views."""
        return self._frags[i]

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the triangles' vertices, (B, H, W, 3) float32; see `Fragments.barycentric`."""
        return self._stacked([frags.barycentric() for frags in self], (3,))

    @classmethod
    def stacked(cls, frags: Sequence[Fragments], size: tuple[int, int]) -> FragmentsBatch:
        """Return the batch of visibility buffers (H, W); each keeps its arrays."""
        shape = (0, *size[::-1])
        triangle = np.stack([one.triangle for one in frags]) if frags else empty(shape, np.int32)
        depth = np.stack([one.depth for one in frags]) if frags else empty(shape, np.float32)
        return cls(triangle, depth, frags)

    @property
    def samples_triangle(self) -> NDArray[np.int32]:
        """Indices of triangles by sample, int32 (B, H, W, S)."""
        found = [frags.samples_triangle for frags in self]
        return np.stack(found) if found else self.triangle[..., None]

    @property
    def samples_depth(self) -> NDArray[np.float32]:
        """Depth by sample, float32 (B, H, W, S)."""
        found = [frags.samples_depth for frags in self]
        return np.stack(found) if found else self.depth[..., None]

    def _at_sample(self, i: object) -> FragmentsBatch:
        height, width = self.id.shape[1:]
        return FragmentsBatch.stacked([frags._at_sample(i) for frags in self], (width, height))

    def _checked(self, values: Any) -> Sequence[NDArray[Any]]:
        """Check the values of all poses, or of each (B, ...), and return those of each."""
        array = as_array("values", values)
        has_own = array.ndim == 4 or (array.ndim == 3 and array.shape[1] == (self[0]._n_vertices if self else 0))
        if has_own and len(array) != len(self):
            raise ValueError(f"values must be those of all, or {len(self)} of them, got {len(array)}")
        return list(array) if has_own and len(self) else [array] * max(1, len(self))  # of no pose for its channels

    def _interpolated(self, array: Sequence[NDArray[Any]], background: float) -> NDArray[np.float32]:
        pairs = zip(self, array, strict=False)
        found = [frags._interpolated(frags._checked(values), background) for frags, values in pairs]
        return self._stacked(found, array[0].shape[1:][-1:])

    def _derivatives(self, array: Sequence[NDArray[Any]]) -> NDArray[np.float32]:
        found = [frags._derivatives(frags._checked(values)) for frags, values in zip(self, array, strict=False)]
        return self._stacked(found, (*array[0].shape[1:][-1:], 2))

    def _stacked(self, found: list[NDArray[np.float32]], channels: tuple[int, ...]) -> NDArray[np.float32]:
        return np.stack(found) if found else empty((*self.id.shape, *channels), np.float32)


def rasterize_poses(
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: int | tuple[int, int],
    *,
    depth_test: DepthTestOption | None = "less",
    background_depth: float | None = None,
    out: tuple[NDArray[np.int32] | None, NDArray[np.float32] | None] | None = None,
    **view: Unpack[ViewOptions],
) -> FragmentsBatch:
    """Return the visibility buffers of B poses of a mesh, each drawn by one thread, on all cores.

    Parameters
    ----------
    vertices : array_like, shape (B, V, C) or (V, C)
        As in `rasterize`, of each pose or of all.
    triangles, size, depth_test, background_depth, **view
        As in `rasterize`; `transform` may be (B, 4, 4).
    out : (ndarray of int32, ndarray of float32), each of shape (B, H, W), or (B, H, W, S) for S samples, optional
        Where ids and depth go; either may be None.

    Returns
    -------
    FragmentsBatch
        ``.triangle`` and ``.depth`` (B, H, W); ``[i]`` is the `Fragments` of a pose, equal to what `rasterize` returns
        for it.

    Raises
    ------
    ValueError, TypeError, IndexError
        As in `rasterize`; also where neither `vertices` nor `transform` has an axis of poses, or B differs.

    Examples
    --------
    >>> import topleft as tl
    >>> corners = [[0, 0], [4, 0], [0, 4]]
    >>> tl.rasterize_poses([corners, corners[::-1]], [[0, 1, 2]], (4, 1)).triangle
    array([[[ 0,  0,  0, -1]],
    <BLANKLINE>
           [[ 0,  0,  0, -1]]], dtype=int32)
    """
    transform, points = view.pop("transform", None), as_array("vertices", vertices)
    matrices = np.empty(0) if transform is None else as_array("transform", transform)
    counts = {len(array) for array in (points, matrices) if array.ndim == 3}
    if len(counts) != 1:
        wish = "vertices (B, V, C), transform (B, 4, 4) or both must have one number of poses B"
        raise ValueError(f"{wish}, got {points.shape} and {None if transform is None else matrices.shape}")
    (n,), checked = counts, View.parse(size, view)
    options = fragment_options(checked, depth_test, background_depth, out)
    of_poses = list(points) if points.ndim == 3 else [points] * n
    matrix = None if transform is None or matrices.ndim == 3 else as_transform(matrices)
    transforms = list(map(as_transform, matrices)) if matrices.ndim == 3 else [matrix] * n
    (width, height), n_samples = checked.size, checked.sampling.n_samples
    shape = (n, height, width) if n_samples == 1 else (n, height, width, n_samples)
    outs: list[NDArray[Any] | None] = []
    for name, array, dtype in (("triangle", options.ids_out, np.int32), ("depth", options.depth_out, np.float32)):
        if array is not None:
            outs.append(as_out(f"out {name}", array, shape, dtype))
        else:  # each pose has planes for its samples
            outs.append(empty(shape, dtype) if n_samples == 1 else None)
    indices = as_triangles(triangles)
    if indices.dtype == np.int64:  # once for all poses
        indices = as_checked_triangles(indices, points.shape[-2] if points.ndim > 1 else 0)
    n_threads = min(n, available_threads() if checked.threads is None else checked.threads)
    if n_threads > 1:
        checked = replace(checked, threads=1)

    def draw_pose(i: int) -> Fragments:
        ids, depth = (None if array is None else array[i] for array in outs)
        own = options._replace(ids_out=ids, depth_out=depth)
        return draw_fragments(FRESH, of_poses[i], indices, replace(checked, transform=transforms[i]), own)

    parts = run_parts(lambda first, end: [draw_pose(i) for i in range(first, end)], n, n_threads) if n else []
    frags, (ids, depth) = [drawn for part in parts for drawn in part], outs
    if n_samples == 1 and ids is not None and depth is not None:
        return FragmentsBatch(ids, depth, frags)
    return FragmentsBatch.stacked(frags, checked.size)
