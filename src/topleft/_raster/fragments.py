"""The visibility buffer: which triangle shows in each pixel, how deep, and attributes on top of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft import _engine
from topleft._base.arrays import as_number, as_values, shown

__all__ = ["Fragments"]

#: Makes the snapped mesh that attributes of some triangles need: these are snapped, no others.
PartOfMesh = Callable[..., _engine.SnappedMesh]


class Fragments:
    """What `rasterize` returns.

    Attributes are computed when they are asked for, from the `triangles` that were passed in, and for clip space from
    the `vertices` too: do not change those arrays before.

    Attributes
    ----------
    triangle : ndarray of int32, shape (H, W)
        Index of the triangle that shows in the pixel, -1 where there is none.
    depth : ndarray of float32, shape (H, W)
        Depth of that triangle at the pixel's centre; the background's value elsewhere.
    mask : ndarray of bool, shape (H, W)
        Where there is a triangle.
    id, instance : ndarray of int32, shape (H, W)
        The same as `triangle`, and 0 where there is one: of several instances `SceneFragments` tells more.
    samples_triangle, samples_depth : ndarray of int32 and of float32, shape (H, W, S)
        The same for each sample, with several a pixel. `triangle`, `depth`, `mask` and the attributes are then those of
        the first sample, which is nearest to the centre; `sample` gives those of another.
    """

    #: Fragments of each sample when there are several.
    _samples: tuple[Fragments, ...] = ()
    #: Ids and depth of these, (S, H, W).
    _planes: tuple[NDArray[np.int32], NDArray[np.float32]] | None = None

    def __init__(
        self,
        triangle: NDArray[np.int32],
        depth: NDArray[np.float32] | float,
        snapped: _engine.SnappedMesh | PartOfMesh,
        n_vertices: int,
        n_triangles: int,
    ) -> None:
        self.id = triangle
        self._depth = depth
        self._snapped_or_maker = snapped
        self._n_vertices = n_vertices
        self._n_triangles = n_triangles

    def __repr__(self) -> str:
        height, width = self.triangle.shape
        return f"Fragments({width}x{height}, {self._n_triangles} triangles)"

    def _repr_png_(self) -> bytes | None:
        from topleft._render.notebook import png_of_fragments  # which imports this module

        return png_of_fragments(self)

    @property
    def triangle(self) -> NDArray[np.int32]:
        """Index of the triangle that shows in the pixel, int32 (H, W), -1 where there is none."""
        return self.id

    @property
    def instance(self) -> NDArray[np.int32]:
        """Index of the mesh that shows in the pixel, int32 (H, W): 0, -1 where there is none."""
        return np.minimum(self.id, 0)

    @property
    def depth(self) -> NDArray[np.float32]:
        """Depth of each pixel, float32 (H, W); made now where all triangles lie at 0."""
        if not isinstance(self._depth, np.ndarray):
            self._depth = np.where(self.mask, np.float32(0.0), np.float32(self._depth))
        return self._depth

    @property
    def samples_triangle(self) -> NDArray[np.int32]:
        """Indices of triangles by sample, int32 (H, W, S)."""
        return self.id[..., None] if self._planes is None else np.moveaxis(self._planes[0], 0, -1)

    @property
    def samples_depth(self) -> NDArray[np.float32]:
        """Depth by sample, float32 (H, W, S)."""
        return self.depth[..., None] if self._planes is None else np.moveaxis(self._planes[1], 0, -1)

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Where there is a triangle, bool (H, W)."""
        return self.id >= 0

    @classmethod
    def of_samples(
        cls,
        triangle: NDArray[np.int32],
        depth: NDArray[np.float32],
        meshes: Sequence[_engine.SnappedMesh],
        n_vertices: int,
        n_triangles: int,
    ) -> Fragments:
        """Return the fragments of several samples: planes (S, H, W), and the mesh as each sample sees it."""
        samples = tuple(cls(*planes, n_vertices, n_triangles) for planes in zip(triangle, depth, meshes, strict=True))
        frags = cls(triangle[0], depth[0], meshes[0], n_vertices, n_triangles)
        frags._samples = samples
        frags._planes = triangle, depth
        return frags

    def sample(self, i: int) -> Fragments:
        """Return ids, depth and attributes at one sample of each pixel."""
        samples = self._samples or (self,)
        if not isinstance(i, int | np.integer):
            raise TypeError(f"i must be an integer, got {shown(i)}")
        if not -len(samples) <= i < len(samples):
            raise IndexError(f"i must lie in 0 to {len(samples) - 1}, got {i}")
        return samples[i]

    def only(self, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> Fragments:
        """Return what is left when no other pixels than these show a triangle."""
        triangle = np.full_like(self.triangle, -1)
        triangle[rows, cols] = self.triangle[rows, cols]
        return Fragments(triangle, self.depth, self._snapped_or_maker, self._n_vertices, self._n_triangles)

    def barycentric(self) -> NDArray[np.float32]:
        """Return the weights of the three vertices of the triangle that shows in each pixel.

        Returns
        -------
        ndarray of float32, shape (H, W, 3)
            In the order of the triangle's row in `triangles`; they sum to 1. 0 where there is no triangle.
            Perspective-correct for clip-space vertices, screen-linear for pixels.

        Notes
        -----
        The weights come from the exact edge functions of the snapped triangle, so none is below 0 and the rounding of
        float32 is the only error, 2**-23 at most; for triangles cut by a clip plane 2**-21.

        References
        ----------
        J. F. Blinn, Hyperbolic Interpolation, 1992.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, 0], [2, 0], [0, 2]], [[0, 1, 2]], (2, 2))
        >>> frags.barycentric()[0, 0]
        array([0.5 , 0.25, 0.25], dtype=float32)
        """
        out = np.empty((*self.triangle.shape, 3), np.float32)
        self._snapped.with_inverse_w(self.id.size).barycentric(self._ids(), out)
        return out

    def interpolate(self, values: ArrayLike, *, background: float = 0.0) -> NDArray[np.float32]:
        """Return an attribute of the vertices at each visible pixel.

        Parameters
        ----------
        values : array_like of real numbers, shape (V, K) or (V,) per vertex, or (T, 3, K) per corner of each triangle
            Used as float32.
        background : float
            Value where there is no triangle.

        Returns
        -------
        ndarray of float32, shape (H, W, K), or (H, W) for values of shape (V,)
            Perspective-correct for clip-space vertices, screen-linear for pixels.

        Raises
        ------
        ValueError
            If the number of rows is not that of the vertices or triangles.
        TypeError
            If the values are no real numbers.

        Examples
        --------
        >>> import topleft as tl
        >>> frags = tl.rasterize([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]], (4, 2))
        >>> frags.interpolate([0.0, 4.0, 0.0])
        array([[0.5, 1.5, 2.5, 0. ],
               [0.5, 1.5, 0. , 0. ]], dtype=float32)
        """
        array = as_values(values, self._n_vertices, self._n_triangles)
        channels = array.shape[-1] if array.ndim > 1 else 1
        out: NDArray[Any] = np.empty((*self.triangle.shape, channels), np.float32)
        rows = array.reshape(-1, channels) if array.size else np.empty((0, channels), np.float32)
        snapped = self._snapped.with_inverse_w(self.id.size)
        snapped.interpolate(self._ids(), rows, array.ndim == 3, as_number("background", background), out)
        return out if array.ndim > 1 else out[..., 0]

    @cached_property
    def _snapped(self) -> _engine.SnappedMesh:
        """The triangles that show, snapped; maybe the others too."""
        return self._snapped_with()

    def _snapped_with(self, *triangles: NDArray[np.int32]) -> _engine.SnappedMesh:
        """Return the triangles that show and these, snapped; maybe the others too."""
        if isinstance(self._snapped_or_maker, _engine.SnappedMesh):
            return self._snapped_or_maker
        return self._snapped_or_maker(self.id, *triangles)

    def _ids(self) -> NDArray[np.int32]:
        return np.require(self.triangle, np.int32, ["C", "A"])
