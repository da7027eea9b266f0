"""A raster of any size: its windows are drawn when they are needed.

Input: a mesh or polygons, a grid or a size in pixels, and the kind of pixels. Output: `WindowedRaster`: any window, any
part by slicing, all windows in order, jobs for other processes. Every pixel equals that of the whole raster, however it
is cut.
"""

from __future__ import annotations

import itertools
import os
import pathlib
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import I32, Array
from topleft._core.base.arrays import as_aligned, as_count, as_number, as_pair, as_path, as_size
from topleft._core.base.grid import Extent, ExtentLike, Grid
from topleft._core.base.options import check_choice
from topleft._core.base.threads import available_threads, parse_threads
from topleft._meshes.field.field import grid_of
from topleft._meshes.windows import areas, drawing
from topleft._meshes.windows.ahead import in_order, kept_memory
from topleft._meshes.windows.areas import AreaIndex, Areas, are_polygons, areas_of, extent_of_polygons
from topleft._meshes.windows.blocks import (
    BLOCK,
    DataByName,
    Triangles,
    fingerprint_of,
    mapped_npy,
    open_triangles,
    property_of,
)
from topleft._meshes.windows.drawing import ON_GRIDS, Crop, Painter, Payload, painter_of, without_values
from topleft._meshes.windows.spans import SPAN_BYTES, Tiling, WindowIndex
from topleft.typing import PerOption, RasterKindOption, YOption

Path = str | os.PathLike[str]

#: Pixels a side of a window. 80 px a triangle, two cores: 166 Mpx/s with 1024, 203 with 2048, 152 with 4096; pixels
#: that are written once more, ids of triangles as names, are then still in the cache.
WINDOW = 2048

INDEX_BYTES = 256 << 20
"""Memory of the index of triangles by windows; beyond that it goes to a file."""


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
        Its picture.
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


@dataclass(frozen=True)
class SentJob:
    """A window with all that it needs, to be drawn in another process."""

    painter: Painter
    payload: Payload
    crop: Crop

    def __call__(self) -> Array:
        """Draw it."""
        return self.painter.window(self.payload, self.crop)


@dataclass(frozen=True)
class MappedJob:
    """A window of a mesh in files: it carries their names and the indices of its triangles."""

    triangles: Triangles
    painter: Painter
    which: I32
    crop: Crop

    def __call__(self) -> Array:
        """Draw it."""
        which = as_aligned(self.which)  # bytes that were received lie anywhere
        payload = self.painter.gather(self.triangles, which, kept_memory())
        return self.painter.window(payload, self.crop)


class WindowedRaster:
    """A raster that is drawn window by window."""

    def __init__(
        self,
        mesh: Any,
        size: int | tuple[int, int] | Grid | None,
        *,
        kind: RasterKindOption,
        values: npt.ArrayLike | Path | None,
        window: int | tuple[int, int],
        extent: ExtentLike | None,
        pixel_size: float | tuple[float, float] | None,
        y: YOption,
        threads: int | None,
        memory: int,
        folder: Path | None,
        options: dict[str, Any],
    ) -> None:
        self._folder = None if folder is None else os.fspath(as_path("folder", folder))
        check_choice("kind", kind, tuple(drawing.KINDS))
        is_of_areas = are_polygons(mesh)
        self.triangles: Any = mesh if is_of_areas else open_triangles(mesh, self._folder)
        grid: Grid | None = None
        if isinstance(size, Grid) or kind in ON_GRIDS or extent is not None or pixel_size is not None:
            grid = grid_of(size, pixel_size, extent, y, lambda: extent_of(self.triangles))
        elif size is None:
            raise TypeError("size must be (width, height) or a Grid, or extent or pixel_size be given")
        self.kind: str = kind
        self.size = as_size(size) if grid is None else grid.size
        w, h = as_size(window, "window", smallest=1)
        self.window_size = min(w, max(self.size[0], 1)), min(h, max(self.size[1], 1))
        if isinstance(values, str | os.PathLike):
            values, per = values_of(values, self.triangles)
            if per is not None and "per" in drawing.KINDS[kind].options:
                options = {"per": per, **options}
        kinds = areas.KINDS if is_of_areas else drawing.KINDS
        if kind not in kinds:
            raise ValueError(f"kind must be 'labels', 'coverage' or 'fill' for polygons, got {kind!r}")
        if is_of_areas:
            self.triangles = areas_of(mesh, grid, options.pop("crs", None))
        self.painter = painter_of(kinds[kind], grid, self.triangles, values, options)
        bits = 0 if self.painter.is_exact else self.painter.view.get("subpixel_bits", 8)
        self.threads, self._memory = parse_threads(threads), as_count("memory", memory)
        self.tiling = Tiling(*self.size, *self.window_size, bits)
        self._index: WindowIndex | AreaIndex | None = None
        self._fingerprint: str | None = None

    def __repr__(self) -> str:
        (width, height), (w, h) = self.size, self.window_size
        t = self.tiling
        return (
            f"{type(self).__name__}({self.kind}: {width}x{height} {self.dtype}, "
            f"{t.n_columns}x{t.n_rows} windows of {w}x{h} pixels, "
            f"{self.triangles.n} {'polygons' if self.is_of_polygons else 'triangles'})"
        )

    @property
    def is_of_polygons(self) -> bool:
        """Whether it shows polygons, and no mesh."""
        return isinstance(self.triangles, Areas)

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
        """Whether the mean of neighbouring pixels has a meaning: not for labels, masks and counts."""
        if self.is_of_polygons and not self.painter.channels:  # values of polygons may be names
            return self.dtype.kind == "f"
        return self.dtype.kind == "f" or (self.kind == "fill" and self.painter.options.get("dtype") is None)

    @property
    def range_of_values(self) -> tuple[float, float]:
        """The lowest and the highest depth, height or value of the mesh; makes the index."""
        self.index  # noqa: B018  (which looks at depths and heights)
        if self.kind == "field" and self.painter.values is not None:
            return self.painter.values.range()
        return self.painter.low, self.painter.high

    @property
    def n_windows(self) -> int:
        """How many windows there are."""
        return self.tiling.n_rows * self.tiling.n_columns

    def with_nodata(self, nodata: float) -> Self:
        """Return the raster with a number where no triangle or polygon is, which files then have as that of no data."""
        as_number("nodata", nodata)
        found = copy(self)
        found.painter = self.painter.with_nodata(nodata, self.triangles.corners(np.empty(0, np.int32)))
        if self.kind == "labels" and 0 <= nodata < self.triangles.n_faces:
            raise ValueError(f"nodata must be no label, got {nodata} for {self.triangles.n_faces} labels from 0 on")
        found._fingerprint = None
        return found

    @property
    def index(self) -> WindowIndex | AreaIndex:
        """Which triangles each window needs; computed at the first use."""
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
        if self.is_of_polygons:
            return False
        state = getattr(self.triangles, "__getstate__")()  # noqa: B009
        arrays = [state.get("_rows"), state.get("triangles"), *state.get("columns", ())]
        return self.painter.values is None and not any(isinstance(array, np.ndarray) for array in arrays)

    @property
    def fingerprint(self) -> str:
        """A hash of the mesh, the values, the options and the size of windows."""
        if self._fingerprint is None:
            painter = self.painter
            words: tuple[object, ...] = (
                1,
                self.kind,
                self.size,
                self.window_size,
                self.grid,
                sorted(painter.options.items(), key=str),
            )
            words += () if painter.outside is None else (painter.outside,)
            values = None if painter.values is None else painter.values.array
            arrays = {"values": values, "faces": self.triangles.faces}
            self._fingerprint = fingerprint_of(self.triangles, arrays, words)
        return self._fingerprint

    def place(self, row: int, column: int) -> tuple[tuple[int, int], tuple[int, int]]:
        """The first pixel (x, y) of a window, and its size."""
        (width, height), (w, h) = self.size, self.window_size
        x, y = column * w, row * h
        return (x, y), (min(w, width - x), min(h, height - y))

    def draw_window(self, row: int, column: int, *, threads: int | None = None, out: Array | None = None) -> Array:
        """Return the pixels of a window, in a fresh array or in `out`."""
        crop = Crop(*self.place(row, column), self.threads if threads is None else threads, out)
        return self._draw(self.index.of_window(row, column), crop)

    def job(self, row: int, column: int) -> Callable[[], Array]:
        """Return a job that draws a window in another process: it carries the window's triangles, or where they are."""
        crop = Crop(*self.place(row, column))
        which = self.index.of_window(row, column)
        if self.is_mapped:
            return MappedJob(self.triangles, self.painter, which, crop)
        return SentJob(without_values(self.painter), self.painter.gather(self.triangles, which), crop)

    def __iter__(self) -> Iterator[Window]:
        """Give all windows, row by row, each with a fresh array."""
        return self.windows()

    def windows(self, *, reuse: bool = False) -> Iterator[Window]:
        """Yield all windows, row by row; with `reuse` the next one may overwrite pixels: fresh ones cost a touch."""
        n_threads = max(1, min(self.n_threads, self.n_windows))
        n_ahead = 2 * n_threads if n_threads > 1 else 1
        n_threads_each = 1 if n_threads > 1 else None
        w, h = self.window_size
        shape = (w * h, *self.painter.channels)
        spare = [np.empty(shape, self.dtype) for _ in range(n_ahead)] if reuse and self.n_windows else []

        def draw(place: tuple[int, int]) -> tuple[Window, Array | None]:
            row, column = place
            (x, y), (width, height) = self.place(row, column)
            memory = spare.pop() if reuse else None
            out = None if memory is None else memory[: width * height].reshape(height, width, *shape[1:])
            pixels = self.draw_window(row, column, threads=n_threads_each, out=out)
            return Window(row, column, x, y, pixels, int(self.index.counts[row, column])), memory

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
        return self._draw(self._triangles_in(x, y, width, height), Crop((x, y), (width, height), self.threads))

    def _draw(self, which: npt.NDArray[np.int32], crop: Crop) -> Array:
        return self.painter.window(self.painter.gather(self.triangles, which, kept_memory()), crop)

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
        for index, n in zip(keys[:2], self.shape[:2], strict=True):
            if isinstance(index, slice):
                ranges.append(range(*index.indices(n)))
            else:
                i = range(n)[index]
                ranges.append(range(i, i + 1))
        if any(places.step < 1 for places in ranges):
            raise IndexError("steps of slices of a raster must be positive")
        rows, columns = ranges
        width, height = (places[-1] + 1 - places[0] if places else 0 for places in (columns, rows))
        part = self.read(columns.start, rows.start, width, height)[:: rows.step, :: columns.step]
        first = tuple(slice(None) if isinstance(index, slice) else 0 for index in keys[:2])
        return part[(*first, *keys[2:])]

    def explain(self) -> str:
        """Return the costs of drawing it: windows, triangles listed, memory, in lines; makes the index."""
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


def extent_of(subject: Any) -> Extent:
    """The box round polygons, or round the points that triangles use, read block by block."""
    if are_polygons(subject):
        return extent_of_polygons(subject)
    triangles: Triangles = subject
    if not triangles.n:
        raise ValueError("a mesh without triangles has no extent")
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for first in range(0, triangles.n, BLOCK):
        corners = triangles.corners(slice(first, min(first + BLOCK, triangles.n)))
        x, y = corners[..., 0], corners[..., 1]
        low = np.minimum(low, (x.min(), y.min()))
        high = np.maximum(high, (x.max(), y.max()))
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def values_of(name: str | os.PathLike[str], triangles: Any) -> tuple[Array, PerOption | None]:
    """The values of a .npy file; or those that the file of the mesh has by a name, and the parts that they are of."""
    text = os.fspath(name)
    if text.endswith(".npy"):
        return mapped_npy(pathlib.Path(text)), None
    data: DataByName | None = getattr(triangles, "data", None)
    return property_of({}, {}, text) if data is None else data(text)
