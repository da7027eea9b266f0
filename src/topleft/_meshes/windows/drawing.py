"""Draws a window of a raster: masks, counts, labels, depth, colours, fields, heights.

Input: the triangles of the window with what belongs to them, and where it lies. Output: the array, the crop of the
whole raster to the bit.

A `Painter` has two halves. `gather` takes a window's triangles out of the mesh; `draw` makes the picture of that alone,
so it can be sent to another process. Each triangle has three corners of its own there: their pixels are computed from
the same numbers by the same operations as for the whole mesh, so they are the same.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from topleft._core.base.array_types import F64, I32, Array
from topleft._core.base.arrays import as_array, as_colors, check_real, set_aligned, shown
from topleft._core.base.grid import Grid
from topleft._core.base.memory import FRESH, Memory
from topleft._core.base.options import Sampling, parse, parse_sampling
from topleft._core.raster.rasterize import Canvas, FragmentOptions, draw_fragments
from topleft._core.raster.verbs import coverage, fill, overdraw
from topleft._core.raster.view import View
from topleft._meshes.field.field import draw_field, draw_heights, dtype_of_field, is_per_face, nodata_of
from topleft._meshes.windows.ahead import kept_memory
from topleft._meshes.windows.blocks import Triangles
from topleft.typing import PerOption, SurfaceOption

Size = tuple[int, int]

VIEW_OPTIONS = ("cull", "subpixel_bits")

RANGE_ROWS = 1 << 20


@dataclass(frozen=True)
class Payload:
    """The content of a window: its triangles, ascending, their corners, and values of either."""

    triangles: I32
    corners: Array
    values: Array | None = None

    __setstate__ = set_aligned


@dataclass
class Painter:
    """One kind of raster: its options, its pixels, and how a window is drawn."""

    grid: Grid | None
    options: dict[str, Any]
    view: dict[str, Any]
    n_components: int
    own: ClassVar[tuple[str, ...]] = ()
    takes_values: ClassVar[bool] = False
    needs_depth: ClassVar[bool] = False

    __setstate__ = set_aligned

    dtype: Any = field(default=np.dtype(bool), init=False)
    empty: Any = field(default=False, init=False)
    """The value of a pixel without triangles: a number, or one a channel."""
    nodata: float | None = field(default=None, init=False)
    """The number of pixels without data in a file, if there is one."""
    channels: tuple[int, ...] = field(default=(), init=False)
    low: float = field(default=np.inf, init=False)
    high: float = field(default=-np.inf, init=False)
    """The range of heights, depths or values, once the index is made."""

    @property
    def is_exact(self) -> bool:
        """Whether vertices stay where they are, and are not snapped."""
        return bool(self.view.get("subpixel_bits") == "exact")

    def prepare(self, triangles: Triangles, values: Any) -> None:
        """Check options and values against the mesh."""

    def check(self, corners: Array, where: Callable[[int], str]) -> None:
        """Look at a block of corners (N, 3, C) while the index is made."""
        if self.needs_depth and corners.shape[2] == 3:
            with np.errstate(over="ignore", invalid="ignore"):
                is_bad = ~np.isfinite(corners[..., 2].astype(np.float32)).all(axis=1)
            if is_bad.any():
                row = int(np.argmax(is_bad))
                at = corners[row].tolist()
                if not np.isfinite(corners[row]).all():
                    raise ValueError(f"vertices must be finite where a triangle uses them, got {at} {where(row)}")
                raise ValueError(f"vertices must have a depth that float32 can hold, got {at} {where(row)}")

    def widen(self, low: float, high: float) -> None:
        """Note the lowest and the highest value of a block."""
        with _checking:  # blocks are looked at on several threads
            self.low, self.high = min(self.low, low), max(self.high, high)

    def to_pixels(self, points: Array) -> F64:
        """Pixels (N, 2) of points (N, C)."""
        if self.grid is not None:
            return self.grid.to_pixels(points)
        return np.ascontiguousarray(points[:, :2], np.float64)

    def points(self, payload: Payload) -> Array:
        """The corners as vertices (3 N, 2 or 3) of a verb: in pixels, with their depth."""
        flat = payload.corners.reshape(-1, self.n_components)
        if self.grid is None:
            return flat
        pixels = self.grid.to_pixels(flat)
        return np.column_stack([pixels, flat[:, 2]]) if self.n_components == 3 and self.needs_depth else pixels

    def gather(self, triangles: Triangles, which: I32, memory: Memory = FRESH) -> Payload:
        """Take a window's triangles out of the mesh."""
        return Payload(which, triangles.corners(which, memory))

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W)."""
        raise NotImplementedError

    def blank(self, size: Size, out: Array | None = None) -> Array:
        """Return pixels without triangles."""
        array = np.empty((*size[::-1], *self.channels), self.dtype) if out is None else out
        array[...] = self.empty
        return array

    def window(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None) -> Array:
        """Return the pixels of a window, drawn or blank."""
        if not len(payload.triangles):
            return self.blank(size, out)
        return self.draw(payload, origin, size, threads, out)

    def view_at(self, origin: Size, threads: int | None) -> dict[str, Any]:
        """The options of a verb."""
        return {**self.view, "origin": origin, "threads": threads}


_rows = np.empty((0, 3), np.int32)


def rows(n: int) -> I32:
    """Return triangles (n, 3) that have three corners each of their own."""
    global _rows
    known = _rows
    if len(known) < n:
        known = np.arange(3 * max(n, 1 << 16), dtype=np.int32).reshape(-1, 3)
        known.flags.writeable = False
        _rows = known
    return known[:n]


_checking = threading.Lock()


class CoveragePainter(Painter):
    """`coverage`: bool, or float32 for several samples and "area"."""

    own = ("sampling",)
    verb: ClassVar[Callable[..., Array]] = staticmethod(coverage)
    of_one: ClassVar[tuple[type, Any]] = (np.bool_, False)
    """The dtype of one sample a pixel, and what it is without triangles."""

    def prepare(self, triangles: Triangles, values: Any) -> None:  # noqa: ARG002
        """Check options and values against the mesh."""
        sampling = parse_sampling(self.options.get("sampling", "center"))
        self.check_sampling(sampling)
        is_share = sampling is Sampling.AREA or sampling.n_samples > 1
        dtype, self.empty = (np.float32, 0.0) if is_share else self.of_one
        self.dtype = np.dtype(dtype)
        self.view["sampling"] = str(sampling)

    def check_sampling(self, sampling: Sampling) -> None:
        """Raise an error for a sampling that windows do not have."""

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W)."""
        n = len(payload.triangles)
        return self.verb(self.points(payload), rows(n), size, out=out, **self.view_at(origin, threads))


class OverdrawPainter(CoveragePainter):
    """`overdraw`: int32, or float32 for "area"."""

    verb = staticmethod(overdraw)
    of_one = (np.int32, 0)

    def check_sampling(self, sampling: Sampling) -> None:
        """Raise an error for several numbers a pixel."""
        if sampling.n_samples > 1:
            raise ValueError(f"sampling must be of one number a pixel for overdraw in tiles, got {str(sampling)!r}")


class FragmentsPainter(Painter):
    """`rasterize`: labels, int32, or depth, float32."""

    own = ("depth_test", "background_depth")
    needs_depth = True

    def prepare(self, triangles: Triangles, values: Any) -> None:  # noqa: ARG002
        """Check options and values against the mesh."""
        asked = FragmentOptions.parse(
            self.options.get("depth_test", "less"), self.options.get("background_depth"), None
        )
        self.asked = asked
        self.depth_test = self.options.get("depth_test", "less")

    def draw_into(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Any) -> None:
        """Draw a window into ids or depth, the other one into memory that the thread's next window overwrites."""
        view = View.parse(size, self.view_at(origin, threads))  # type: ignore[arg-type]
        points, own, names = self.points(payload), rows(len(payload.triangles)), payload.triangles
        draw_fragments(kept_memory(), points, own, view, self.depth_test, self.asked.background, out, names)


class LabelsPainter(FragmentsPainter):
    """The index of the triangle that shows, -1 for none."""

    def prepare(self, triangles: Triangles, values: Any) -> None:
        """Check options and values against the mesh."""
        super().prepare(triangles, values)
        self.dtype, self.empty, self.nodata = np.dtype(np.int32), -1, -1

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W)."""
        with Canvas.of(FRESH, "labels", out, size[::-1], np.int32) as (result, ids):
            self.draw_into(payload, origin, size, threads, (ids, None))
        return result


class DepthPainter(FragmentsPainter):
    """The depth of the triangle that shows."""

    def prepare(self, triangles: Triangles, values: Any) -> None:
        """Check options and values against the mesh."""
        super().prepare(triangles, values)
        self.dtype = np.dtype(np.float32)
        self.empty = self.nodata = float(np.float32(self.asked.background))
        self.low, self.high = (np.inf, -np.inf) if triangles.n_components == 3 else (0.0, 0.0)

    def check(self, corners: Array, where: Callable[[int], str]) -> None:
        """Look at a block of corners (N, 3, C) while the index is made."""
        super().check(corners, where)
        if len(corners) and corners.shape[2] == 3:
            self.widen(float(corners[..., 2].min()), float(corners[..., 2].max()))

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W)."""
        depth = np.empty(size[::-1], np.float32) if out is None else out
        self.draw_into(payload, origin, size, threads, (None, depth))
        return depth


class FillPainter(Painter):
    """`fill`: colours of triangles or vertices, or labels of triangles with `dtype`."""

    own = ("alpha", "background", "blend", "dtype", "per", "resolve", "sampling")
    takes_values = True

    def prepare(self, triangles: Triangles, values: Any) -> None:
        """Check options and values against the mesh."""
        if values is None:
            raise ValueError("kind 'fill' needs values: the colours of triangles or vertices")
        dtype = self.options.get("dtype")
        colors = as_array("colors", values)
        self.values = colors if dtype is not None else as_colors(colors)
        per = parse(PerOption, "per", self.options.get("per", "auto"))
        self.is_flat = dtype is not None or _is_flat(self.values, triangles, per)
        self.view["sampling"] = self.options.get("sampling", "center")
        self.style = {name: value for name, value in self.options.items() if name not in self.view and name != "per"}
        self.style["per"] = "triangle" if self.is_flat else "vertex"
        self.channels = self.values.shape[1:]
        # one pixel of nothing tells dtype and background, and raises the errors of the options
        nothing = Payload(np.empty(0, np.int32), np.empty((0, 3, self.n_components)), self.values[:0])
        sample = self.draw(nothing, (0, 0), (1, 1), 1)
        self.dtype, self.empty = sample.dtype, sample[0, 0].copy()

    def gather(self, triangles: Triangles, which: I32, memory: Memory = FRESH) -> Payload:
        """Take a window's triangles out of the mesh."""
        at = which if self.is_flat else triangles.indices(which).ravel()
        return Payload(which, triangles.corners(which, memory), np.ascontiguousarray(self.values[at]))

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W) or (H, W, C)."""
        assert payload.values is not None
        n, view = len(payload.triangles), self.view_at(origin, threads)
        if out is not None:  # `fill` draws over its pixels
            out[...] = self.empty
        return fill(self.points(payload), rows(n), payload.values, size, out=out, **self.style, **view)


class FieldPainter(Painter):
    """`field`: values of vertices or faces on a grid."""

    own = ("nodata", "per")
    takes_values = True

    def prepare(self, triangles: Triangles, values: Any) -> None:
        """Check options and values against the mesh."""
        if values is None:
            raise ValueError("kind 'field' needs values of the vertices or the faces")
        array = as_array("values", values)
        check_real("values", array, "fiub")
        per = parse(PerOption, "per", self.options.get("per", "auto"))
        self.is_of_faces = is_per_face(array, triangles.n_vertices, triangles.n_faces, per)
        self.faces = triangles.faces
        nodata = self.options.get("nodata")
        nodata = self.grid.nodata if nodata is None and self.grid is not None else nodata
        self.dtype = np.dtype(dtype_of_field(array.dtype, is_of_faces=self.is_of_faces, has_nodata=nodata is not None))
        self.empty = nodata_of(nodata, self.dtype.type)[0]
        self.nodata = float(self.empty)
        self.values = array

    def find_range(self) -> None:
        """Note the lowest and the highest value, block by block: values may be mapped."""
        for first in range(0, len(self.values), RANGE_ROWS):
            part = self.values[first : first + RANGE_ROWS]
            part = part[np.isfinite(part)] if part.dtype.kind == "f" else part
            if len(part):
                self.widen(float(part.min()), float(part.max()))

    def gather(self, triangles: Triangles, which: I32, memory: Memory = FRESH) -> Payload:
        """Take a window's triangles out of the mesh."""
        if self.is_of_faces:
            values = self.values[which if self.faces is None else self.faces[which]]
        else:
            values = self.values[triangles.indices(which).ravel()].astype(np.float64, copy=False)
        return Payload(which, triangles.corners(which, memory), values)

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W)."""
        assert self.grid is not None
        assert payload.values is not None
        points = self.grid.to_pixels(payload.corners.reshape(-1, self.n_components))
        view = View.parse(size, self.view_at(origin, threads))  # type: ignore[arg-type]
        own, values = rows(len(payload.triangles)), payload.values
        with Canvas.of(FRESH, "field", out, size[::-1], self.dtype) as (result, canvas):
            draw_field(canvas, points, own, values, view, self.empty, is_of_faces=self.is_of_faces)
        return result


class HeightPainter(Painter):
    """`height_map`: the upper or lower surface on a grid."""

    own = ("surface",)

    def prepare(self, triangles: Triangles, values: Any) -> None:  # noqa: ARG002
        """Check options and values against the mesh."""
        self.surface = self.options.get("surface", "upper")
        parse(SurfaceOption, "surface", self.surface)
        if triangles.n_components != 3:
            raise ValueError(f"a height map needs points of shape (V, 3), got (V, {triangles.n_components})")
        empty = np.nan if self.grid is None or self.grid.nodata is None else self.grid.nodata
        self.dtype, self.empty, self.nodata = np.dtype(np.float64), empty, empty

    def check(self, corners: Array, where: Callable[[int], str]) -> None:
        """Look at a block of corners (N, 3, C) while the index is made."""
        if not len(corners):
            return
        is_bad = ~np.isfinite(corners[..., 2]).all(axis=1)
        if is_bad.any():
            row = int(np.argmax(is_bad))
            raise ValueError(
                f"vertices must be finite where a triangle uses them, got {corners[row].tolist()} {where(row)}"
            )
        heights = corners[..., 2]
        self.widen(float(heights.min()), float(heights.max()))

    def draw(self, payload: Payload, origin: Size, size: Size, threads: int | None, out: Array | None = None) -> Array:
        """Return the pixels of a window (H, W)."""
        assert self.grid is not None
        flat = payload.corners.reshape(-1, 3)
        points, heights = self.grid.to_pixels(flat), np.ascontiguousarray(flat[:, 2], np.float64)
        view = View.parse(size, self.view_at(origin, threads))  # type: ignore[arg-type]
        own, ends, nodata = rows(len(payload.triangles)), (self.low, self.high), self.grid.nodata
        with Canvas.of(FRESH, "field", out, size[::-1], np.float64) as (result, canvas):
            draw_heights(canvas, points, own, heights, view, ends, self.surface, nodata)
        return result


KINDS: dict[str, type[Painter]] = {
    "coverage": CoveragePainter,
    "overdraw": OverdrawPainter,
    "labels": LabelsPainter,
    "depth": DepthPainter,
    "fill": FillPainter,
    "field": FieldPainter,
    "height_map": HeightPainter,
}

ON_GRIDS = ("field", "height_map")


def painter_of(kind: str, grid: Grid | None, triangles: Triangles, values: Any, options: dict[str, Any]) -> Painter:
    """Return the painter of a kind of raster."""
    made = KINDS[kind]
    known = (*made.own, *VIEW_OPTIONS)
    unknown = sorted(options.keys() - set(known))
    if unknown:
        raise TypeError(f"kind {kind!r} has no option {unknown[0]!r}; its options are {', '.join(known)}")
    if values is not None and not made.takes_values:
        raise ValueError(f"values are for the kinds 'fill' and 'field', got {shown(values)} for {kind!r}")
    view = {name: options[name] for name in VIEW_OPTIONS if name in options}
    View.parse(1, view)  # type: ignore[arg-type]
    painter = made(grid, options, view, triangles.n_components)
    painter.prepare(triangles, values)
    return painter


def without_values(painter: Painter) -> Painter:
    """Return a painter that draws payloads, without the arrays that `gather` takes them from."""
    light = replace(painter)
    vars(light).update({**vars(painter), "values": None, "faces": None})
    return light


def _is_flat(colors: Array, triangles: Triangles, per: PerOption) -> bool:
    fits_triangles, fits_vertices = len(colors) == triangles.n, len(colors) == triangles.n_vertices
    if per == "auto" and fits_triangles and fits_vertices:
        raise ValueError(f"colors has {len(colors)} rows, as many as triangles and as vertices: say per=")
    if fits_triangles and per != "vertex":
        return True
    if fits_vertices and per != "triangle":
        return False
    raise ValueError(
        f"colors must have {triangles.n} rows, one per triangle, or {triangles.n_vertices}, one per vertex, "
        f"got {len(colors)}"
    )
