"""An engine for rasterix: polygons of geopandas on grids of xarray, drawn by `polygons`.

Input: shapely polygons, and the affine of a grid. Output: arrays of numbers or masks, in memory or for blocks of Dask.

These are the functions that `rasterix.rasterize` 0.2 takes from the module of an engine. It has no registry of engines:
its `_get_rasterize_funcs` and `_get_mask_funcs` name their modules, and need a line for this one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft import Grid, polygons

__all__ = ["dask_mask_wrapper", "dask_rasterize_wrapper", "np_geometry_mask", "rasterize_geometries"]


def rasterize_geometries(
    geometries: Sequence[Any],
    *,
    dtype: npt.DTypeLike,
    shape: tuple[int, int],
    affine: Any,
    offset: int,
    fill: Any,
    all_touched: bool = False,
    merge_alg: Any = "replace",
    subpixel_bits: int = 16,
    **_: Any,
) -> npt.NDArray[Any]:
    """Return the number of the last polygon that each pixel lies in.

    Parameters
    ----------
    geometries : sequence of shapely polygons
        In the CRS of the grid.
    dtype, fill
        The dtype of the result; the value of pixels in no polygon.
    shape : (rows, columns)
    affine : affine.Affine, or six numbers
        As `Grid.from_transform` takes it.
    offset : int
        The number of the first polygon.
    all_touched : bool
        False: the centre of the pixel decides. True: whether pixel and polygon share an area.
    merge_alg : "replace"
    subpixel_bits : int, 0 to 16
        Points snap to ``2**-subpixel_bits`` pixels: with 16 bits one pixel of 12 million is another than GDAL's.

    Returns
    -------
    ndarray, shape `shape`

    Raises
    ------
    NotImplementedError
        For another `merge_alg`: sums of numbers.
    ValueError, TypeError
        As in `polygons`, for geometries that are no polygons among others.
    """
    if str(merge_alg).rpartition(".")[2] not in ("replace", "last"):
        raise NotImplementedError(f"topleft puts later polygons over earlier ones, got merge_alg {merge_alg!r}")
    if not len(geometries):
        return np.full(shape, fill, dtype)
    numbers = np.arange(offset, offset + len(geometries)).astype(dtype)
    grid = Grid.from_transform(affine, shape[::-1])
    how: dict[str, Any] = {"sampling": "outer" if all_touched else "center", "subpixel_bits": subpixel_bits}
    return polygons(geometries, grid, values=numbers, background=fill, **how)


def np_geometry_mask(
    geometries: Sequence[Any],
    *,
    shape: tuple[int, int],
    affine: Any,
    all_touched: bool = False,
    invert: bool = False,
    subpixel_bits: int = 16,
    **_: Any,
) -> npt.NDArray[np.bool_]:
    """Return True for pixels outside of all polygons, or, with `invert`, inside of one.

    Parameters
    ----------
    geometries, shape, affine, all_touched, subpixel_bits
        As in `rasterize_geometries`.
    invert : bool

    Returns
    -------
    ndarray of bool, shape `shape`

    Raises
    ------
    ValueError, TypeError
        As in `polygons`.
    """
    inside = np.zeros(shape, np.bool_)
    if len(geometries):
        grid = Grid.from_transform(affine, shape[::-1])
        how: dict[str, Any] = {"sampling": "outer" if all_touched else "center", "subpixel_bits": subpixel_bits}
        polygons(geometries, grid, out=inside, **how)
    return inside if invert else ~inside


def dask_rasterize_wrapper(
    geom_array: npt.NDArray[Any],
    x_offsets: npt.NDArray[Any],
    y_offsets: npt.NDArray[Any],
    x_sizes: npt.NDArray[Any],
    y_sizes: npt.NDArray[Any],
    offset_array: npt.NDArray[Any],
    *,
    affine: Any,
    dtype_: npt.DTypeLike,
    **options: Any,
) -> npt.NDArray[Any]:
    """Return `rasterize_geometries` of a block of geometries (N, 1, 1) in a block of pixels, (1, rows, columns).

    Parameters
    ----------
    geom_array, x_offsets, y_offsets, x_sizes, y_sizes, offset_array : ndarray
        The geometries, the corner and the size of the block, and the number of the first polygon.
    affine, dtype_, **options
        Of the whole grid; the other arguments of `rasterize_geometries`.

    Returns
    -------
    ndarray, shape (1, rows, columns)
    """
    own, shape = _block(affine, x_offsets, y_offsets, x_sizes, y_sizes)
    rows = geom_array[:, 0, 0].tolist()
    return rasterize_geometries(rows, affine=own, shape=shape, offset=offset_array.item(), dtype=dtype_, **options)[
        None
    ]


def dask_mask_wrapper(
    geom_array: npt.NDArray[Any],
    x_offsets: npt.NDArray[Any],
    y_offsets: npt.NDArray[Any],
    x_sizes: npt.NDArray[Any],
    y_sizes: npt.NDArray[Any],
    *,
    affine: Any,
    **options: Any,
) -> npt.NDArray[np.bool_]:
    """Return `np_geometry_mask` of a block of geometries (N, 1, 1) in a block of pixels, (1, rows, columns).

    Parameters
    ----------
    geom_array, x_offsets, y_offsets, x_sizes, y_sizes : ndarray
        As in `dask_rasterize_wrapper`.
    affine, **options
        Of the whole grid; the other arguments of `np_geometry_mask`.

    Returns
    -------
    ndarray of bool, shape (1, rows, columns)
    """
    own, shape = _block(affine, x_offsets, y_offsets, x_sizes, y_sizes)
    return np_geometry_mask(geom_array[:, 0, 0].tolist(), affine=own, shape=shape, **options)[None]


def _block(affine: Any, *place: npt.NDArray[Any]) -> tuple[Any, tuple[int, int]]:
    """The affine and the shape of a block."""
    x, y, width, height = (number.item() for number in place)
    a, b, c, d, e, f = affine[:6]
    return (a, b, a * x + b * y + c, d, e, d * x + e * y + f), (height, width)
