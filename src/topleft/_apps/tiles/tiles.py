"""Huge rasters that are handed on to Dask and xarray, or written to Zarr, GeoTIFF and Deep Zoom.

Input: a mesh of any size, a `Grid` or a size in pixels, a kind of pixel. Output: `Tiles`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft import Grid
from topleft._core.base.array_types import Array
from topleft._core.base.grid import ExtentLike
from topleft.annex.windows import INDEX_BYTES, WINDOW, WindowedRaster
from topleft.typing import RasterKindOption, TiffCompressionOption, YOption, ZarrCompressionOption

if TYPE_CHECKING:
    from topleft._apps.tiles.levels import Written
    from topleft._apps.tiles.store import Progress

Path = str | os.PathLike[str]


def tiles(
    mesh: Any,
    size: int | tuple[int, int] | Grid | None = None,
    *,
    kind: RasterKindOption = "labels",
    values: npt.ArrayLike | Path | None = None,
    window: int | tuple[int, int] = WINDOW,
    extent: ExtentLike | None = None,
    pixel_size: float | tuple[float, float] | None = None,
    y: YOption = "up",
    threads: int | None = None,
    memory: int = INDEX_BYTES,
    folder: Path | None = None,
    **options: Any,
) -> Tiles:
    """Return a raster of any size; each window is drawn when it is read.

    Parameters
    ----------
    mesh : mesh, path, pair of paths, iterator of blocks, or polygons
        Whatever `as_mesh` takes, also arrays of `numpy.memmap`. The name of a file: binary STL, and binary PLY with
        triangles, are mapped and never read as a whole. Names of two .npy files, vertices and triangles. An iterator of
        pairs (vertices, triangles), the triangles naming vertices of their block: these go to two files in `folder`.
        Polygons are shapely's, a GeoSeries, GeoJSON, ``(coordinates, ring_offsets, polygon_offsets)`` or a list of
        polygons, which are lists of rings; they stay in memory.
    size : (width, height) or Grid, optional
        Of the whole raster, up to 2**31 - 1 a side. With a `Grid`, or with `extent` or `pixel_size`, vertices are in
        data units; otherwise in pixels, unless `kind` is "field" or "height_map".
    kind : {"labels", "depth", "coverage", "overdraw", "fill", "field", "height_map"}
        The content of pixels. "labels": the index of the triangle that shows, int32, -1 for none, as `rasterize` has
        it; "depth" likewise. The others: the result of the verb of that name. Of polygons, as `polygons` returns them:
        "labels", their numbers; "coverage", a mask; "fill", the `values` of each.
    values : array_like or str, optional
        For "fill" the colours, of triangles or of vertices; for "field" the values, of vertices or faces. Also the name
        of a .npy file, which is mapped, of a property of the mesh's binary PLY file, or of data of points or cells of
        a file that meshio reads.
    window : int or (width, height), pixels
        How large windows are; those of the last row and column may be smaller.
    extent, pixel_size, y
        As in `field`: they make the `Grid`.
    threads : int, optional
        How many at most. Never changes a bit.
    memory : int, bytes
        Limit for the index of triangles by windows; a larger index goes to a file.
    folder : path, optional
        Where temporary files go; that of the system unless given.
    **options
        Of the verb: ``subpixel_bits`` and ``cull``; "coverage", "overdraw" and "fill": ``sampling``; "labels" and
        "depth": ``depth_test``, ``background_depth``; "fill": ``per``, ``background``, ``blend``, ``alpha``,
        ``resolve``, ``dtype``; "field": ``per``, ``nodata``; "height_map": ``surface``. Of polygons ``rule``, ``crs``,
        ``sampling``, ``background``, ``subpixel_bits``, ``assume_valid`` and ``max_crossings`` of `polygons`.

    Returns
    -------
    Tiles
        Iterating over it gives `Window` objects row by row; slicing it, ``raster[1000:2000, 500:900]``, gives arrays.

    Raises
    ------
    ValueError
        If a window has no pixels, an option does not fit, or the verb cannot draw the mesh. Errors of single triangles
        come when the index is made, and name the block of the mesh.
    TypeError
        If there is no such option, or something is no mesh.

    Notes
    -----
    The first window that is drawn makes the index: one pass over the mesh, in blocks of 131,072 triangles. It takes 12
    bytes for each row of windows that a triangle touches. Besides it a window needs its pixels, and of each triangle
    that touches it about 150 bytes.

    The stitched windows are the whole raster to the bit, for every size of windows and number of threads.

    Examples
    --------
    >>> import topleft as tl
    >>> raster = tl.tiles(([[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]), (6, 6), window=4)
    >>> raster
    Tiles(labels: 6x6 int32, 2x2 windows of 4x4 pixels, 1 triangles)
    >>> [window.pixels.tolist() for window in raster][1]
    [[0, -1], [-1, -1], [-1, -1], [-1, -1]]
    >>> raster[2:4, 1:5]
    array([[ 0,  0, -1, -1],
           [ 0, -1, -1, -1]], dtype=int32)
    """
    return Tiles(
        mesh,
        size,
        kind=kind,
        values=values,
        window=window,
        extent=extent,
        pixel_size=pixel_size,
        y=y,
        threads=threads,
        memory=memory,
        folder=folder,
        options=options,
    )


class Tiles(WindowedRaster):
    """A raster that is drawn window by window, made by `tiles`.

    Attributes
    ----------
    shape : tuple of int
        (height, width), or (height, width, channels).
    dtype : dtype
    grid : Grid or None
        Where it lies in the plane of the data.
    window_size : (width, height), pixels
    n_windows : int

    Examples
    --------
    >>> import topleft as tl
    >>> raster = tl.tiles(([[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]), (6, 6), window=4)
    >>> raster.shape, raster.n_windows
    ((6, 6), 4)
    """

    def to_dask(self) -> Any:
        """Return a `dask.array.Array` of the raster, a chunk a window, none of it drawn yet.

        Slicing it computes the chunks of the slice. A chunk carries the triangles that touch its window to its worker,
        or their indices if the mesh lies in files.

        Raises
        ------
        MissingPackageError
            If dask is not installed.
        """
        from topleft._apps.tiles.dask_array import dask_array_of

        return dask_array_of(self)

    def to_xarray(self) -> Any:
        """Return an `xarray.DataArray` of the Dask array, with the coordinates of the pixels' centres.

        Raises
        ------
        MissingPackageError
            If dask or xarray is not installed.
        """
        from topleft._apps.tiles.dask_array import data_array_of

        return data_array_of(self)

    def to_zarr(
        self,
        path: Path,
        *,
        chunk: int | tuple[int, int] | None = None,
        compression: ZarrCompressionOption = "gzip",
        levels: int = 1,
        resume: bool = False,
        overwrite: bool = False,
        progress: Progress | bool | None = None,
        executor: Any = None,
        storage: dict[str, Any] | None = None,
    ) -> Written:
        """Write the raster as Zarr (version 3), which `xarray.open_zarr` opens; return the numbers of windows.

        The array has the name of the kind, ``zarr.open(path)["labels"]``, and a raster on a grid has the coordinates
        "x" and "y" beside it and the CRS in "spatial_ref", as rioxarray reads it.

        Parameters
        ----------
        path : path or URL
            A folder, or whatever fsspec can write to, "s3://bucket/name.zarr".
        chunk : int or (width, height), optional
            Pixels of a chunk; must divide those of a window, where the raster has several. A chunk a window unless
            given.
        compression : {"gzip", "zstd", "none"}
            How chunks are stored; "zstd" needs numcodecs, which comes with zarr.
        levels : int
            How many resolutions, each half of the one before: coarser ones are the groups "1", "2", ..., which
            `xarray.open_zarr` opens by ``group="1"``; from 2 on they are listed in the manner of OME-Zarr 0.5.
        resume : bool
            Continue an interrupted run: whole windows are kept; one with a tile that is missing, or on a disk cannot be
            read, is drawn again.
        overwrite : bool
            Replace the old file or folder, if topleft wrote it.
        progress : function of a `Step`, or True, optional
            Called after each window; True shows a bar (tqdm).
        executor : dask.distributed.Client, optional
            Its workers draw and write the windows; all of them see the folder, or reach the URL. A worker or a
            scheduler that dies loses nothing.
        storage : dict, optional
            Options of fsspec for a URL.

        Raises
        ------
        FileExistsError
            If something is there, and neither `resume` nor `overwrite` is set, or it was not written by topleft: no
            file or folder of somebody else is removed.
        BlockingIOError
            If another call writes it, in this process or another one.
        ValueError
            If `resume` finds the raster of another mesh, other options or another size of windows.
        OSError
            If it would not fit the disk, told before a byte is written; if it cannot be written; if a tile has gone or
            is damaged when it is read again, with its name.
        """
        from topleft._apps.tiles.store import Writing
        from topleft._apps.tiles.zarr_files import write_zarr

        writing = Writing(resume, overwrite, progress, executor)
        return write_zarr(self, path, chunk, compression, levels, writing, storage)

    def to_geotiff(
        self,
        path: Path,
        *,
        crs: str | int | None = None,
        nodata: float | None = None,
        compression: TiffCompressionOption = "deflate",
        tile: int = 512,
        overviews: bool = True,
        resume: bool = False,
        overwrite: bool = False,
        progress: Progress | bool | None = None,
        executor: Any = None,
    ) -> Written:
        """Write the raster as a cloud-optimised GeoTIFF, BigTIFF if it is large; return the numbers of windows.

        Parameters
        ----------
        path : path
            The file. While it is written, its tiles wait in a folder beside it, "NAME.parts", for `resume` to continue.
        crs : str or int, optional
            The CRS of the grid: "EPSG:25832", or any other that has an EPSG code in pyproj.
        nodata : number, optional
            The value of pixels where nothing is, and the no-data value of the file; unless given -1 for labels, NaN or
            `nodata` for fields and heights.
        compression : {"deflate", "none"}
            How tiles are stored; with a predictor.
        tile : int
            Pixels a side of a tile, a multiple of 16 that divides the sides of windows.
        overviews : bool
            Whether levels of half the size follow, down to one tile: means of numbers, every second label.
        resume, overwrite, progress, executor
            As in `to_zarr`.

        Raises
        ------
        ValueError, OSError
            As in `to_zarr`; if the CRS is unknown, or has no EPSG code.
        MissingPackageError
            If a CRS is given and pyproj is not installed.
        """
        from topleft._apps.tiles.geotiff import write_geotiff
        from topleft._apps.tiles.store import Writing

        writing = Writing(resume, overwrite, progress, executor)
        return write_geotiff(self, path, crs, nodata, compression, tile, overviews, writing)

    def to_deepzoom(
        self,
        path: Path,
        *,
        tile: int = 256,
        colors: Callable[[Array], npt.NDArray[np.uint8]] | None = None,
        resume: bool = False,
        overwrite: bool = False,
        progress: Progress | bool | None = None,
        executor: Any = None,
    ) -> Written:
        """Write the raster as a Deep Zoom pyramid, for viewers such as OpenSeadragon; return the numbers of windows.

        Parameters
        ----------
        path : path
            The .dzi file; the tiles go to the folder "NAME_files" beside it, as PNG.
        tile : int
            Pixels a side of a tile; a power of 2 that divides the sides of windows.
        colors : function of an array (H, W), optional
            Returns uint8 (H, W), (H, W, 3) or (H, W, 4). Unless given, labels get a colour each, masks become black and
            white, counts greys up to 255, depths, heights and values greys from the lowest to the highest, and uint8
            colours stay as they are; other colours need it.
        resume, overwrite, progress, executor
            As in `to_zarr`.

        Raises
        ------
        ValueError, OSError
            As in `to_zarr`.
        """
        from topleft._apps.tiles.deepzoom import write_deepzoom
        from topleft._apps.tiles.store import Writing

        writing = Writing(resume, overwrite, progress, executor)
        return write_deepzoom(self, path, tile, colors, writing)
