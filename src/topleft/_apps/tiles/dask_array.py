"""Hands a raster to Dask, a chunk a window, and to xarray with coordinates.

Input: a raster. Output: a lazy array. A task of the graph is a `WindowJob`, which takes its triangles out of the mesh
when it is sent to another process.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from topleft._core.base.array_types import Array
from topleft._core.base.georeference import xarray_module
from topleft.annex.windows import WindowedRaster
from topleft.errors import MissingPackageError


@dataclass(frozen=True)
class WindowJob:
    """A window to be drawn elsewhere: its triangles are taken out of the mesh when it is sent."""

    raster: WindowedRaster
    row: int
    column: int

    def __call__(self) -> Array:
        """Draw it."""
        return self.raster.draw_window(self.row, self.column, threads=1)

    def __reduce__(self) -> tuple[Any, ...]:
        return received, (self.raster.job(self.row, self.column),)


def received(job: Callable[[], Array]) -> Callable[[], Array]:
    """Return the job that a `WindowJob` becomes in another process."""
    return job


def run_job(job: Callable[[], Any]) -> Any:
    """Draw a window, and maybe write it."""
    return job()


def dask_array_of(raster: WindowedRaster) -> Any:
    """`Tiles.to_dask`."""
    try:
        import dask.array as da
    except ImportError:
        raise MissingPackageError("to_dask needs the package dask: pip install 'dask[array]'") from None
    t, (w, h) = raster.tiling, raster.window_size
    name = f"topleft-{raster.kind}-{raster.fingerprint}"
    tail = (0,) * len(raster.painter.channels)
    raster.index  # noqa: B018  (made once, here)
    graph = {
        (name, row, column, *tail): (run_job, WindowJob(raster, row, column))
        for row in range(t.n_rows)
        for column in range(t.n_columns)
    }
    rows = tuple(min(h, t.height - row * h) for row in range(t.n_rows))
    columns = tuple(min(w, t.width - column * w) for column in range(t.n_columns))
    chunks = (rows or (0,), columns or (0,), *((n,) for n in raster.painter.channels))
    if not graph:
        return da.zeros(raster.shape, dtype=raster.dtype)
    return da.Array(graph, name, chunks, meta=np.empty((0,) * len(raster.shape), raster.dtype))


def data_array_of(raster: WindowedRaster) -> Any:
    """`Tiles.to_xarray`."""
    xr, nodata = xarray_module(), raster.painter.nodata
    if raster.grid is None:
        names = ["y", "x", "channel"][: len(raster.shape)]
        own = {} if nodata is None else {"nodata": nodata}
        return xr.DataArray(dask_array_of(raster), dims=names, name=raster.kind, attrs=own)
    return replace(raster.grid, nodata=nodata).to_xarray(dask_array_of(raster), raster.kind)
