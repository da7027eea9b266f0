"""Huge rasters, drawn window by window.

Input: a mesh of any size, a `Grid` or a size in pixels, what is drawn. Output: `Tiles`: an iterator of windows, any
part by slicing, a Dask array, files. Every pixel is what it is in the whole raster, to the bit, however it is cut.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from topleft._apps.tiles.ahead import in_order, kept_memory
from topleft._apps.tiles.areas import AreaIndex, AreaPainter, Areas, are_polygons, areas_of, extent_of_polygons
from topleft._apps.tiles.blocks import BLOCK, Triangles, fingerprint_of, triangles_of
from topleft._apps.tiles.drawing import KINDS, ON_GRIDS, Painter, painter_of
from topleft._apps.tiles.spans import SPAN_BYTES, Tiling, WindowIndex
from topleft._core.base.array_types import Array
from topleft._core.base.arrays import as_count, as_pair, as_path, as_size
from topleft._core.base.grid import Extent, ExtentLike, Grid, grid_around
from topleft._core.base.options import check_choice
from topleft._core.base.threads import available_threads, parse_threads
from topleft.typing import RasterKindOption, TiffCompressionOption, YOption, ZarrCompressionOption

if TYPE_CHECKING:
    from topleft._apps.tiles.levels import Progress, Written

Path = str | os.PathLike[str]

#: Pixels a side of a window. 80 px a triangle, two cores: 166 Mpx/s with 1024, 203 with 2048, 152 with 4096; what is
#: written once more, ids of triangles as names, is then still in the cache.
WINDOW = 2048

INDEX_BYTES = 256 << 20


@dataclass(frozen=True, eq=False)
class Window:
    """A part of a raster.

    Attributes
    ----------
    row, column : int
        Which window it is, counted from the upper left one.
    x, y : int
        Its first pixel in the raster.
    pixels : ndarray (H, W) or (H, W, C)
        What it shows.
    n_triangles : int
        How many triangles may touch it; 0: it is blank.

    Examples
    --------
    >>> import topleft as tl
    >>> raster = tl.tiles(([[0, 0], [6, 0], [0, 6]], [[0, 1, 2]]), (6, 6), window=4)
    >>> [(window.x, window.y, window.pixels.shape) for window in raster]
    [(0, 0, (4, 4)), (4, 0, (4, 2)), (0, 4, (2, 4)), (4, 4, (2, 2))]
    """

    row: int
    column: int
    x: int
    y: int
    pixels: Array
    n_triangles: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Where it lies in an array of the whole raster."""
        height, width = self.pixels.shape[:2]
        return slice(self.y, self.y + height), slice(self.x, self.x + width)

    def __repr__(self) -> str:
        height, width = self.pixels.shape[:2]
        return f"Window(row {self.row}, column {self.column}: {width}x{height} at ({self.x}, {self.y}))"


def tiles(
    mesh: Any,
    size: int | tuple[int, int] | Grid | None = None,
    *,
    kind: RasterKindOption = "labels",
    values: npt.ArrayLike | None = None,
    window: int | tuple[int, int] = WINDOW,
    extent: ExtentLike | None = None,
    pixel_size: float | tuple[float, float] | None = None,
    y: YOption = "up",
    threads: int | None = None,
    memory: int = INDEX_BYTES,
    folder: Path | None = None,
    **options: Any,
) -> Tiles:
    """Return a raster of any size, of which windows are drawn when they are asked for.

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
        What pixels hold. "labels": the index of the triangle that shows, int32, -1 for none, as `rasterize` has it;
        "depth" likewise. The others: what the verb of that name returns. Of polygons "labels", their numbers,
        "coverage", a mask, and "fill", the `values` of each: what `polygons` returns.
    values : array_like, optional
        For "fill" the colours, of triangles or of vertices; for "field" the values, of vertices or faces.
    window : int or (width, height), pixels
        How large windows are; those of the last row and column may be smaller.
    extent, pixel_size, y
        As in `field`: they make the `Grid`.
    threads : int, optional
        How many at most. Never changes a bit.
    memory : int, bytes
        What the index of triangles by windows takes of memory; beyond that it goes to a file.
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
        If a window has no pixels, an option does not fit, or the mesh is not what the verb needs. What is wrong with
        single triangles comes when the index is made, and names the block of the mesh.
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
    where = None if folder is None else os.fspath(as_path("folder", folder))
    check_choice("kind", kind, tuple(KINDS))
    is_of_areas = are_polygons(mesh)
    triangles: Any = None if is_of_areas else triangles_of(mesh, where)
    grid: Grid | None = None
    if isinstance(size, Grid):
        if extent is not None or pixel_size is not None or y != "up":
            raise ValueError("a Grid says extent, pixel_size and y itself: give none of them beside it")
        grid = size
    elif kind in ON_GRIDS or extent is not None or pixel_size is not None:
        around = extent if extent is not None else extent_of_polygons(mesh) if is_of_areas else extent_of(triangles)
        whole = None if size is None else as_size(size)
        grid = grid_around(around, whole, pixel_size, y)
    elif size is None:
        raise TypeError("size must be (width, height) or a Grid, or extent or pixel_size be given")
    whole = as_size(size) if grid is None else grid.size
    tiling_size = as_size(window, "window", smallest=1)
    painter: Painter
    if is_of_areas:
        triangles = areas_of(mesh, grid, options.pop("crs", None))
        painter = AreaPainter.of_kind(kind, grid, triangles, values, options)
    else:
        painter = painter_of(kind, grid, triangles, values, options)
    return Tiles(
        triangles, painter, kind, whole, tiling_size, parse_threads(threads), as_count("memory", memory), where
    )  # fmt: skip


class Tiles:
    """A raster that is drawn window by window: what `tiles` returns.

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

    def __init__(
        self,
        triangles: Triangles | Areas,
        painter: Painter,
        kind: str,
        size: tuple[int, int],
        window_size: tuple[int, int],
        threads: int | None,
        memory: int,
        folder: str | None,
    ) -> None:
        self.triangles: Any = triangles
        self.painter, self.kind = painter, kind
        self.size, self.threads = size, threads
        self.window_size = min(window_size[0], max(size[0], 1)), min(window_size[1], max(size[1], 1))
        self.tiling = Tiling(*size, *self.window_size, 0 if painter.is_exact else painter.view.get("subpixel_bits", 8))
        self._memory, self._folder = memory, folder
        self._index: WindowIndex | AreaIndex | None = None
        self._fingerprint: str | None = None

    def __repr__(self) -> str:
        (width, height), (w, h) = self.size, self.window_size
        t = self.tiling
        return (
            f"Tiles({self.kind}: {width}x{height} {self.dtype}, {t.n_columns}x{t.n_rows} windows of {w}x{h} pixels, "
            f"{self.triangles.n} {'polygons' if isinstance(self.triangles, Areas) else 'triangles'})"
        )

    @property
    def grid(self) -> Grid | None:
        """Where it lies in the plane of the data."""
        return self.painter.grid

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of the pixels."""
        return np.dtype(self.painter.dtype)

    @property
    def shape(self) -> tuple[int, ...]:
        """Height and width, and channels if there are several numbers a pixel."""
        return (*self.size[::-1], *self.painter.channels)

    @property
    def has_means(self) -> bool:
        """Whether the mean of neighbouring pixels says something: not of labels, masks and counts."""
        if isinstance(self.triangles, Areas) and not self.painter.channels:  # values of polygons may be names
            return self.dtype.kind == "f"
        return self.dtype.kind == "f" or (self.kind == "fill" and self.painter.options.get("dtype") is None)

    @property
    def range_of_values(self) -> tuple[float, float]:
        """The lowest and the highest depth, height or value of the mesh; makes the index."""
        self.index  # noqa: B018  (which looks at depths and heights)
        if hasattr(self.painter, "find_range"):
            self.painter.find_range()
        return self.painter.low, self.painter.high

    @property
    def n_windows(self) -> int:
        """How many windows there are."""
        return self.tiling.n_rows * self.tiling.n_columns

    @property
    def index(self) -> WindowIndex | AreaIndex:
        """Which triangles each window needs; made when it is first asked for."""
        if self._index is None and isinstance(self.triangles, Areas):
            self._index = AreaIndex(self.triangles, self.tiling)
        elif self._index is None:
            self._index = WindowIndex(
                self.triangles,
                self.tiling,
                self.painter.to_pixels,
                self.painter.check,
                memory=self._memory,
                folder=self._folder,
                n_threads=self.n_threads,
            )
        return self._index

    @property
    def n_threads(self) -> int:
        """How many threads draw, a window each."""
        return available_threads() if self.threads is None else self.threads

    @property
    def is_mapped(self) -> bool:
        """Whether the mesh lies in files that other processes can map."""
        if isinstance(self.triangles, Areas):
            return False
        values = getattr(self.painter, "values", None)
        state = getattr(self.triangles, "__getstate__")()  # noqa: B009
        arrays = [state.get("_rows"), state.get("triangles"), *state.get("columns", ())]
        return values is None and not any(isinstance(array, np.ndarray) for array in arrays)

    @property
    def fingerprint(self) -> str:
        """What tells this raster from those of other meshes, values, options and windows."""
        if self._fingerprint is None:
            painter = self.painter
            words = (1, self.kind, self.size, self.window_size, self.grid, sorted(painter.options.items(), key=str))
            arrays = {"values": getattr(painter, "values", None), "faces": self.triangles.faces}
            self._fingerprint = fingerprint_of(self.triangles, arrays, words)
        return self._fingerprint

    def place(self, row: int, column: int) -> tuple[tuple[int, int], tuple[int, int]]:
        """The first pixel (x, y) of a window, and its size."""
        (width, height), (w, h) = self.size, self.window_size
        x, y = column * w, row * h
        return (x, y), (min(w, width - x), min(h, height - y))

    def n_triangles_of(self, row: int, column: int) -> int:
        """How many triangles may touch a window."""
        return int(self.index.counts[row, column])

    def draw_window(self, row: int, column: int, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the pixels of a window, in a fresh array or in `out`."""
        origin, size = self.place(row, column)
        payload = self.painter.gather(self.triangles, self.index.of_window(row, column), kept_memory())
        return self.painter.window(payload, origin, size, self.threads if threads is None else threads, out)

    def __iter__(self) -> Iterator[Window]:
        """Give all windows, row by row, each with an array of its own."""
        return self.windows()

    def windows(self, *, reuse: bool = False) -> Iterator[Window]:
        """Yield all windows, row by row; each thread draws one, a few ahead of the one that is asked for.

        Parameters
        ----------
        reuse : bool
            Whether the next window may overwrite the pixels of this one: a fresh array costs its first touch.
        """
        n_threads = max(1, min(self.n_threads, self.n_windows))
        n_ahead = 2 * n_threads if n_threads > 1 else 1
        own_threads = 1 if n_threads > 1 else None
        w, h = self.window_size
        shape = (w * h, *self.painter.channels)
        spare = [np.empty(shape, self.dtype) for _ in range(n_ahead)] if reuse and self.n_windows else []

        def draw(place: tuple[int, int]) -> tuple[Window, Array | None]:
            row, column = place
            (x, y), (width, height) = self.place(row, column)
            memory = spare.pop() if reuse else None
            out = None if memory is None else memory[: width * height].reshape(height, width, *shape[1:])
            pixels = self.draw_window(row, column, threads=own_threads, out=out)
            return Window(row, column, x, y, pixels, self.n_triangles_of(row, column)), memory

        self.index  # noqa: B018  (made once, here, on all threads)
        places = itertools.product(range(self.tiling.n_rows), range(self.tiling.n_columns))
        for window, memory in in_order(draw, places, n_threads, n_ahead):
            yield window
            if memory is not None:
                spare.append(memory)

    def read(self, x: int, y: int, width: int, height: int) -> Array:
        """Return a part of the raster, drawn at once, whatever windows it lies in."""
        (x, y), (width, height) = as_pair("x and y", (x, y)), as_size((width, height))
        if not (0 <= x <= self.size[0] - width and 0 <= y <= self.size[1] - height):
            raise ValueError(
                f"the part must lie in the raster of {self.size[0]} x {self.size[1]} pixels, got {width} x {height} "
                f"from ({x}, {y}) on"
            )
        which = self._triangles_in(x, y, width, height)
        payload = self.painter.gather(self.triangles, which, kept_memory())
        return self.painter.window(payload, (x, y), (width, height), self.threads, None)

    def _triangles_in(self, x: int, y: int, width: int, height: int) -> npt.NDArray[np.int32]:
        if not (width and height):
            return np.empty(0, np.int32)
        (w, h), index = self.window_size, self.index
        lists = [
            index.of_window(row, column)
            for row in range(y // h, (y + height - 1) // h + 1)
            for column in range(x // w, (x + width - 1) // w + 1)
        ]
        return lists[0] if len(lists) == 1 else np.unique(np.concatenate(lists))

    def __getitem__(self, key: Any) -> Array:
        """Return a part of the raster as NumPy's slicing would of the whole; steps are positive."""
        keys = list(key if isinstance(key, tuple) else (key,))
        if Ellipsis in keys:
            i = keys.index(Ellipsis)
            keys[i : i + 1] = [slice(None)] * (len(self.shape) + 1 - len(keys))
        if len(keys) > len(self.shape):
            raise IndexError(f"a raster of shape {self.shape} has no {len(keys)} indices")
        keys += [slice(None)] * (len(self.shape) - len(keys))
        ranges = []
        for one, n in zip(keys[:2], self.shape[:2], strict=True):
            if isinstance(one, slice):
                ranges.append(range(*one.indices(n)))
            else:
                i = range(n)[one]
                ranges.append(range(i, i + 1))
        if any(one.step < 1 for one in ranges):
            raise IndexError("steps of slices of a raster must be positive")
        rows, columns = ranges
        width, height = (one[-1] + 1 - one[0] if one else 0 for one in (columns, rows))
        part = self.read(columns.start, rows.start, width, height)[:: rows.step, :: columns.step]
        own = tuple(0 if not isinstance(one, slice) else slice(None) for one in keys[:2])
        return part[(*own, *keys[2:])]

    def explain(self) -> str:
        """Return what drawing it takes: windows, triangles listed, memory, in lines; makes the index."""
        index, (w, h) = self.index, self.window_size
        n_bytes = w * h * self.dtype.itemsize * int(np.prod(self.painter.channels, dtype=int))
        most = int(index.counts.max(initial=0))
        n_drawn = int((index.counts > 0).sum())
        lines = [
            repr(self),
            f"windows with triangles: {n_drawn} of {self.n_windows}; the others are blank and are not drawn",
            f"triangles a window: {most} at most, {index.counts.sum() / max(1, n_drawn):.0f} on average",
            f"index: {index.n_spans} spans, {SPAN_BYTES * index.n_spans} bytes "
            + ("in a file" if index.is_on_disk else "in memory"),
            f"a window: {n_bytes} bytes of pixels, about {most * 150} bytes for its triangles",
            f"the mesh is read in blocks of {BLOCK} triangles",
        ]
        return "\n".join(lines)

    def to_dask(self) -> Any:
        """Return a `dask.array.Array` of the raster, a chunk a window, none of it drawn yet.

        Slicing it computes the chunks that are asked for; a chunk carries the triangles that touch its window to where
        it is drawn, or their indices where the mesh lies in files.

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
        """Write the raster as a Zarr array (version 3), or as a group of levels; return what was done.

        Parameters
        ----------
        path : path or URL
            A folder, or whatever fsspec can write to, "s3://bucket/name.zarr".
        chunk : int or (width, height), optional
            Pixels of a chunk; must divide those of a window. A chunk a window unless given.
        compression : {"gzip", "zstd", "none"}
            How chunks are stored; "zstd" needs numcodecs, which comes with zarr.
        levels : int
            How many resolutions, each half of the one before: from 2 on a group in the manner of OME-Zarr 0.5, with the
            arrays "0", "1", ...
        resume : bool
            Go on with what an interrupted run has left, and draw no window again that is whole: a tile on a disk that
            is missing or cannot be read is drawn again.
        overwrite : bool
            Replace what is there, if topleft wrote it.
        progress : function of a `Step`, or True, optional
            Called after each window; True shows a bar (tqdm).
        executor : dask.distributed.Client, optional
            Whose workers draw and write the windows; all of them see the folder, or reach the URL. A worker or a
            scheduler that dies loses nothing.
        storage : dict, optional
            What fsspec needs for a URL.

        Raises
        ------
        FileExistsError
            If something is there, and neither `resume` nor `overwrite` is set, or it was not written by topleft: no
            file or folder of somebody else is removed.
        BlockingIOError
            If another call writes it, in this process or another one.
        ValueError
            If what is there is of another run: of another mesh, other options or another size of windows.
        OSError
            If it would not fit the disk, told before a byte is written; if it cannot be written; if a tile has gone or
            is damaged when it is read again, with its name.
        """
        from topleft._apps.tiles.zarr_files import write_zarr

        return write_zarr(self, path, chunk, compression, levels, resume, overwrite, progress, executor, storage)

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
        """Write the raster as a cloud-optimised GeoTIFF, BigTIFF where it is large; return what was done.

        Parameters
        ----------
        path : path
            The file. While it is written, its tiles wait in a folder beside it, "NAME.parts", which `resume` goes on
            with.
        crs : str or int, optional
            What the grid's units are: "EPSG:25832", or anything of which pyproj knows the EPSG code.
        nodata : number, optional
            What the file calls no data; -1 for labels and NaN or `nodata` for fields and heights unless given.
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

        return write_geotiff(
            self, path, crs, nodata, compression, tile, overviews, resume, overwrite, progress, executor
        )

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
        """Write the raster as a pyramid of Deep Zoom, for viewers such as OpenSeadragon; return what was done.

        Parameters
        ----------
        path : path
            The .dzi file; the tiles go to the folder "NAME_files" beside it, as PNG.
        tile : int
            Pixels a side of a tile; a power of 2 that divides the sides of windows.
        colors : function of an array (H, W), optional
            Returns uint8 (H, W), (H, W, 3) or (H, W, 4). Unless given, labels get a colour each, masks become black and
            white, counts greys up to 255, depths, heights and values greys from the lowest to the highest, and uint8
            colours stay what they are; other colours need it.
        resume, overwrite, progress, executor
            As in `to_zarr`.

        Raises
        ------
        ValueError, OSError
            As in `to_zarr`.
        """
        from topleft._apps.tiles.deepzoom import write_deepzoom

        return write_deepzoom(self, path, tile, colors, resume, overwrite, progress, executor)


def extent_of(triangles: Triangles) -> Extent:
    """The box round the points that triangles use, found block by block."""
    if not triangles.n:
        raise ValueError("a mesh without triangles has no extent")
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for first in range(0, triangles.n, BLOCK):
        corners = triangles.corners(slice(first, min(first + BLOCK, triangles.n)))
        x, y = corners[..., 0], corners[..., 1]
        low = np.minimum(low, (x.min(), y.min()))
        high = np.maximum(high, (x.max(), y.max()))
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])
