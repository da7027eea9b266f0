"""Draws many poses of one mesh: a visibility buffer for each, one behind the other.

Input: vertices (B, V, C) or transforms (B, 4, 4), and triangles that all poses share. Output: `FragmentsBatch`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._base.arrays import as_array, as_out
from topleft._base.memory import FRESH, empty
from topleft._base.options import Sampling
from topleft._base.threads import available_threads, run_parts
from topleft._raster.fragments import Fragments
from topleft._raster.rasterize import Asked, draw_fragments
from topleft._raster.view import View, ViewOptions
from topleft.typing import DepthTestOption

__all__ = ["FragmentsBatch", "draw_batch", "n_poses"]


class FragmentsBatch(Sequence[Fragments]):
    """What `rasterize` returns of a batch: a visibility buffer for each of B poses, behind each other.

    Attributes
    ----------
    triangle : ndarray of int32, shape (B, H, W)
        Index of the triangle that shows in the pixel, -1 where there is none.
    depth : ndarray of float32, shape (B, H, W)
        Its depth.
    """

    def __init__(self, triangle: NDArray[np.int32], depth: NDArray[np.float32], frags: Sequence[Fragments]) -> None:
        self.triangle, self.depth = triangle, depth
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
        """Return one of them, whose arrays are views."""
        return self._frags[i]

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Where there is a triangle, bool (B, H, W)."""
        return self.triangle >= 0

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the triangles' vertices, (B, H, W, 3) float32; see `Fragments.barycentric`."""
        return self._stacked([frags.barycentric() for frags in self], (3,))

    def interpolate(self, values: ArrayLike, *, background: float = 0.0) -> NDArray[np.float32]:
        """Return an attribute of the vertices at each visible pixel, (B, H, W, K) or (B, H, W) float32.

        Parameters
        ----------
        values : array_like of real numbers
            Those of all, as `Fragments.interpolate` takes them, (V, K), say; or with a leading axis of B, (B, V, K).
        background : float
            Value where there is no triangle.

        Raises
        ------
        ValueError
            If there are neither one nor B arrays of values, or they do not fit.
        """
        array = as_array("values", values)
        has_own = array.ndim == 4 or (array.ndim == 3 and array.shape[1] == (self[0]._n_vertices if self else 0))
        if has_own and len(array) != len(self):
            raise ValueError(f"values must be those of all, or {len(self)} of them, got {len(array)}")
        own = array if has_own else [array] * len(self)
        channels = array.shape[(2 if array.ndim == 3 and has_own else array.ndim - 1) :] if array.ndim > 1 else ()
        found = [frags.interpolate(one, background=background) for frags, one in zip(self, own, strict=True)]
        return self._stacked(found, channels)

    def _stacked(self, found: list[NDArray[np.float32]], channels: tuple[int, ...]) -> NDArray[np.float32]:
        shape = *self.triangle.shape, *channels
        return np.stack(found) if found else empty(shape, np.float32)


def n_poses(vertices: object, transform: object) -> int | None:
    """How many poses vertices (B, V, C) or transforms (B, 4, 4) have; None where they have no leading axis."""
    counts = {}
    for name, array in (("vertices", vertices), ("transform", transform)):
        shape = getattr(array, "shape", ())
        if len(shape) == 3 or depth_of_lists(array) == 3:
            counts[name] = len(cast("Sequence[Any]", array))
    if len(set(counts.values())) > 1:
        raise ValueError(f"vertices and transform must have one number of poses, got {counts}")
    return next(iter(counts.values()), None)


def depth_of_lists(values: object) -> int:
    """How many axes nested lists have, told by their first items."""
    if isinstance(values, list | tuple):
        return 1 + (depth_of_lists(values[0]) if values else 0)
    return 0


def draw_batch(
    n: int,
    vertices: ArrayLike,
    triangles: ArrayLike,
    size: object,
    options: ViewOptions,
    depth_test: DepthTestOption | None,
    background_depth: float | None,
    out: object,
) -> FragmentsBatch:
    """`rasterize` of n poses: each is drawn by one thread, so many side by side as there are.

    Raises
    ------
    ValueError
        If several samples a pixel, or a plan, are asked for; else as `rasterize`.
    """
    view = View.parse(size, options, takes_exact=True)
    asked = Asked.parse(depth_test, background_depth, out)
    if view.sampling is not Sampling.CENTER:
        raise ValueError(f"sampling must be 'center' for a batch, got {str(view.sampling)!r}")
    if view.plan is not None:
        raise ValueError("plan is for one pose: a batch takes none")
    shape = (n, *view.size[::-1])
    ids = empty(shape, np.int32) if asked.ids_out is None else as_out("out triangle", asked.ids_out, shape, np.int32)
    planes = asked.depth_out
    depth = empty(shape, np.float32) if planes is None else as_out("out depth", planes, shape, np.float32)
    points = as_array("vertices", vertices)
    matrices = None if view.transform is None else as_array("transform", view.transform)
    n_threads = min(n, available_threads() if view.threads is None else view.threads)
    one = replace(view, threads=1) if n_threads > 1 else view

    def draw_some(first: int, end: int) -> list[Fragments]:
        found = []
        for i in range(first, end):
            own = points[i] if points.ndim == 3 else points
            transform = matrices[i] if matrices is not None and matrices.ndim == 3 else matrices
            pose, arrays = replace(one, transform=transform), (ids[i], depth[i])
            found.append(draw_fragments(FRESH, own, triangles, pose, depth_test, background_depth, arrays))
        return found

    drawn = [frags for part in run_parts(draw_some, n, n_threads) for frags in part] if n else []
    return FragmentsBatch(ids, depth, drawn)
