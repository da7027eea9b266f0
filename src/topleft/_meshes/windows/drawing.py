"""Draws a window of a raster: a verb with `origin=` on the triangles of the window alone.

Input: the triangles of the window with what belongs to them, and where it lies. Output: the array, the crop of the
whole raster to the bit.

A `Painter` has two halves. `gather` takes a window's triangles out of the mesh; `draw` calls the verb with that alone,
so it can be sent to another process. Each triangle has three corners of its own there: their pixels are computed from
the same numbers by the same operations as for the whole mesh, so they are the same.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from topleft._core.base.array_types import F64, I32, Array
from topleft._core.base.arrays import as_array, as_colors, check_real, set_aligned, shown
from topleft._core.base.grid import Grid
from topleft._core.base.memory import FRESH, Memory
from topleft._core.base.options import parse
from topleft._core.raster.fill import colors_are_flat
from topleft._core.raster.rasterize import Canvas, draw_fragments, fragment_options
from topleft._core.raster.verbs import coverage, fill, overdraw
from topleft._core.raster.view import View
from topleft._meshes.field.field import draw_field, draw_heights, is_per_face
from topleft._meshes.windows.ahead import kept_memory
from topleft._meshes.windows.blocks import Triangles
from topleft.typing import PerOption, SurfaceOption

Size = tuple[int, int]

VIEW_OPTIONS = ("cull", "subpixel_bits")

RANGE_ROWS = 1 << 20


@dataclass(frozen=True)
class Payload:
    """The content of a window: its triangles, ascending, their corners, and values of either.

    Of polygons the corners are their `RingSet`.
    """

    triangles: I32
    corners: Any
    values: Array | None = None

    __setstate__ = set_aligned


class Crop(NamedTuple):
    """Where a window lies in its raster, how many threads draw it, and where its pixels go."""

    origin: Size
    size: Size
    threads: int | None = 1
    out: Array | None = None


class Values(NamedTuple):
    """The values that a mesh is drawn with."""

    array: Array
    is_flat: bool
    """Whether a row belongs to a triangle, or to a face; otherwise it belongs to a vertex."""
    faces: Array | None = None
    """The face of each triangle, where rows belong to faces of several triangles."""

    def of(self, triangles: Triangles, which: I32) -> Array:
        """The rows of some triangles, or of their corners."""
        at = which if self.is_flat else triangles.indices(which).ravel()
        if self.is_flat and self.faces is not None:
            at = self.faces[which]
        return np.ascontiguousarray(self.array[at])

    def range(self) -> tuple[float, float]:
        """The lowest and the highest finite value, read block by block: values may be mapped."""
        low, high = np.inf, -np.inf
        for first in range(0, len(self.array), RANGE_ROWS):
            part = self.array[first : first + RANGE_ROWS]
            part = part[np.isfinite(part)] if part.dtype.kind == "f" else part
            if len(part):
                low, high = min(low, float(part.min())), max(high, float(part.max()))
        return low, high


@dataclass(frozen=True)
class Kind:
    """A kind of raster: the verb that draws a window of it, and what the verb takes."""

    name: str
    draw: Callable[[Painter, Payload, Crop], Array]
    options: tuple[str, ...]
    """Of the verb, beside the options of the view."""
    values: Callable[[Any, Any, dict[str, Any]], Values] | None = None
    """Of values, the mesh and options: the checked values. None: the verb has no values."""
    needs: str | None = None
    """The values that a caller must give; None: none may be given."""
    view: tuple[str, ...] = VIEW_OPTIONS
    depth: type | None = None
    """The dtype of depths or heights, which are then the third coordinate."""
    has_nodata: bool = False


@dataclass
class Painter:
    """A kind of raster with its options: draws windows, and tells what pixels are."""

    kind: Kind
    grid: Grid | None
    options: dict[str, Any]
    n_components: int
    values: Values | None

    __setstate__ = set_aligned

    view: dict[str, Any] = field(init=False)
    """The options of every verb."""
    style: dict[str, Any] = field(init=False)
    """The options of this verb."""
    dtype: np.dtype[Any] = field(init=False)
    empty: Any = field(init=False)
    """The value of a pixel without triangles: a number, or one a channel."""
    nodata: float | None = field(init=False)
    """The number of pixels without data in a file, if there is one."""
    outside: tuple[Any, Any] | None = field(default=None, init=False)
    """The value that the verb gives a pixel without triangles, and the value that `with_nodata` puts there."""
    channels: tuple[int, ...] = field(init=False)
    low: float = field(default=np.inf, init=False)
    high: float = field(default=-np.inf, init=False)
    """The range of heights or depths, once the index is made."""

    def learn(self, nothing: Any) -> None:
        """Check the options, and learn what a pixel without triangles is: by a window of one pixel with nothing in it.

        `nothing` is the corners of no triangles.
        """
        kind, options = self.kind, self.options
        self.view = {name: options[name] for name in kind.view if name in options}
        self.style = {name: options[name] for name in kind.options if name in options}
        values = None if self.values is None else self.values.array[:0]
        sample = kind.draw(self, Payload(np.empty(0, np.int32), nothing, values), Crop((0, 0), (1, 1)))
        self.dtype, self.empty, self.channels = sample.dtype, sample[0, 0].copy(), sample.shape[2:]
        self.nodata = self.empty.flat[0].item() if kind.has_nodata and self.empty.size else None
        if kind.depth is not None and self.n_components == 2:
            self.low = self.high = 0.0

    def with_nodata(self, nodata: float, nothing: Any) -> Painter:
        """Return a painter that gives pixels without triangles a number; `nothing` as for `learn`."""
        number = np.asarray(nodata).item()
        with np.errstate(all="ignore"):
            held = np.array(number).astype(self.dtype)[()]
        is_there = np.all(self.empty == number) or (number != number and np.all(self.empty != self.empty))
        has_one = self.kind.has_nodata or not self.channels  # which all channels share
        if not is_there and not (has_one and (self.dtype.kind == "f" or held == number)):
            raise ValueError(f"nodata must be {self.empty.tolist()} or one {self.dtype}, as pixels are, got {nodata!r}")
        found = copy(self)
        if not is_there and "background" in self.kind.options:  # a value may be that of the background before
            found.options = {**self.options, "background": number}
            found.learn(nothing)
        elif not is_there:
            found.outside = (self.empty if self.outside is None else self.outside[0]), held
            found.empty = np.full_like(self.empty, held)[()]
        found.nodata = held.item() if has_one else number
        return found

    @property
    def is_exact(self) -> bool:
        """Whether vertices stay where they are, and are not snapped."""
        return bool(self.view.get("subpixel_bits") == "exact")

    def check(self, corners: Array, where: Callable[[int], str]) -> None:
        """Look at the depths of a block of corners (N, 3, C) while the index is made."""
        if self.kind.depth is None or corners.shape[2] == 2 or not len(corners):
            return
        depths = corners[..., 2]
        with np.errstate(over="ignore", invalid="ignore"):
            is_bad = ~np.isfinite(depths.astype(self.kind.depth, copy=False)).all(axis=1)
        if is_bad.any():
            row = int(np.argmax(is_bad))
            at = corners[row].tolist()
            if not np.isfinite(corners[row]).all():
                raise ValueError(f"vertices must be finite where a triangle uses them, got {at} {where(row)}")
            raise ValueError(f"vertices must have a depth that float32 can hold, got {at} {where(row)}")
        if self.dtype.kind == "f":
            low, high = float(depths.min()), float(depths.max())
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
        has_depth = self.n_components == 3 and self.kind.depth is not None
        return np.column_stack([pixels, flat[:, 2]]) if has_depth else pixels

    def gather(self, triangles: Triangles, which: I32, memory: Memory = FRESH) -> Payload:
        """Take a window's triangles out of the mesh."""
        values = None if self.values is None else self.values.of(triangles, which)
        return Payload(which, triangles.corners(which, memory), values)

    def view_at(self, crop: Crop) -> dict[str, Any]:
        """The options of every verb, for a window."""
        return {**self.view, "origin": crop.origin, "threads": crop.threads}

    def blank(self, size: Size, out: Array | None = None) -> Array:
        """Return pixels without triangles."""
        array = np.empty((*size[::-1], *self.channels), self.dtype) if out is None else out
        array[...] = self.empty
        return array

    def window(self, payload: Payload, crop: Crop) -> Array:
        """Return the pixels (H, W) or (H, W, C) of a window, drawn or blank."""
        if not len(payload.triangles):
            return self.blank(crop.size, crop.out)
        drawn = self.kind.draw(self, payload, crop)
        if self.outside is not None:
            empty, nodata = self.outside
            drawn[np.isnan(drawn) if np.isnan(empty).any() else drawn == empty] = nodata
        return drawn


_rows = np.empty((0, 3), np.int32)


def rows(n: int) -> I32:
    """Return triangles (n, 3) that have three corners each and share none."""
    global _rows
    known = _rows
    if len(known) < n:
        known = np.arange(3 * max(n, 1 << 16), dtype=np.int32).reshape(-1, 3)
        known.flags.writeable = False
        _rows = known
    return known[:n]


_checking = threading.Lock()


def draw_share(verb: Callable[..., Array], painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of `coverage` or `overdraw`, one number a pixel."""
    points, triangles, view = painter.points(payload), rows(len(payload.triangles)), painter.view_at(crop)
    found = verb(points, triangles, crop.size, out=crop.out, **painter.style, **view)
    if found.ndim > 2:
        sampling = str(painter.style["sampling"])
        raise ValueError(f"sampling must be of one number a pixel for overdraw in tiles, got {sampling!r}")
    return found


def draw_ids(painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of the ids of `rasterize`."""
    with Canvas.of(FRESH, "labels", crop.out, crop.size[::-1], np.int32) as (result, ids):
        _rasterize(painter, payload, crop, (ids, None))
    return result


def draw_depth(painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of the depth of `rasterize`."""
    depth = np.empty(crop.size[::-1], np.float32) if crop.out is None else crop.out
    _rasterize(painter, payload, crop, (None, depth))
    return depth


def _rasterize(painter: Painter, payload: Payload, crop: Crop, out: tuple[Array | None, Array | None]) -> None:
    """Draw ids or depth; the other buffer is memory that the thread's next window overwrites."""
    test, background = painter.style.get("depth_test", "less"), painter.style.get("background_depth")
    view = View.parse(crop.size, painter.view_at(crop))  # type: ignore[arg-type]
    points, names = painter.points(payload), payload.triangles
    options = fragment_options(view, test, background, out)
    draw_fragments(kept_memory(), points, rows(len(names)), view, options, names)


def colors_of(values: Any, triangles: Triangles, options: dict[str, Any]) -> Values:
    """Check the colours of triangles or vertices, or labels of triangles with `dtype`."""
    colors, per, n_vertices = as_array("colors", values), options.get("per", "auto"), triangles.n_vertices
    if options.get("dtype") is None:
        colors = as_colors(colors)
    elif per == "auto":
        per = "triangle"
    return Values(colors, colors_are_flat(len(colors), triangles.n, n_vertices, per))


def draw_fill(painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of `fill`."""
    assert painter.values is not None
    assert payload.values is not None
    style = {**painter.style, "per": "triangle" if painter.values.is_flat else "vertex"}
    if style.get("background") is None:  # or `fill` draws over the pixels of `out`
        style["background"] = 0
    points, triangles, view = painter.points(payload), rows(len(payload.triangles)), painter.view_at(crop)
    return fill(points, triangles, payload.values, crop.size, out=crop.out, **style, **view)


def field_values_of(values: Any, triangles: Triangles, options: dict[str, Any]) -> Values:
    """Check the values of vertices or faces."""
    array, per = as_array("values", values), parse(PerOption, "per", options.get("per", "auto"))
    check_real("values", array, "fiub")
    return Values(array, is_per_face(array, triangles.n_vertices, triangles.n_faces, per), triangles.faces)


def draw_field_window(painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of `field`."""
    assert painter.grid is not None
    assert painter.values is not None
    assert payload.values is not None
    points, triangles = payload.corners.reshape(-1, painter.n_components), rows(len(payload.triangles))
    view, nodata = View.parse(crop.size, painter.view_at(crop)), painter.style.get("nodata")  # type: ignore[arg-type]
    is_of_faces = painter.values.is_flat
    return draw_field(points, triangles, payload.values, painter.grid, view, nodata, crop.out, is_of_faces=is_of_faces)


def draw_heights_window(painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of `height_map`."""
    assert painter.grid is not None
    if painter.n_components != 3:
        raise ValueError(f"a height map needs points of shape (V, 3), got (V, {painter.n_components})")
    surface = parse(SurfaceOption, "surface", painter.style.get("surface", "upper"))
    points, triangles = payload.corners.reshape(-1, 3), rows(len(payload.triangles))
    view, ends = View.parse(crop.size, painter.view_at(crop)), (painter.low, painter.high)  # type: ignore[arg-type]
    return draw_heights(points, triangles, painter.grid, view, surface, ends, crop.out)


COVERAGE_OPTIONS = ("sampling",)
DEPTH_OPTIONS = ("depth_test", "background_depth")
FIELD_OPTIONS = ("nodata", "per")
FILL_OPTIONS = ("alpha", "background", "blend", "dtype", "per", "resolve", "sampling")

KINDS = {
    kind.name: kind
    for kind in (
        Kind("coverage", partial(draw_share, coverage), COVERAGE_OPTIONS),
        Kind("overdraw", partial(draw_share, overdraw), COVERAGE_OPTIONS),
        Kind("labels", draw_ids, DEPTH_OPTIONS, depth=np.float32, has_nodata=True),
        Kind("depth", draw_depth, DEPTH_OPTIONS, depth=np.float32, has_nodata=True),
        Kind("fill", draw_fill, FILL_OPTIONS, colors_of, "colours of triangles or vertices"),
        Kind(
            "field", draw_field_window, FIELD_OPTIONS, field_values_of, "numbers of vertices or faces", has_nodata=True
        ),
        Kind("height_map", draw_heights_window, ("surface",), depth=np.float64, has_nodata=True),
    )
}
"""The kinds of rasters of a mesh."""

ON_GRIDS = ("field", "height_map")


def painter_of(kind: Kind, grid: Grid | None, triangles: Triangles, values: Any, options: dict[str, Any]) -> Painter:
    """Return the painter of a kind of raster."""
    known = (*kind.options, *kind.view)
    unknown = sorted(options.keys() - set(known))
    if unknown:
        raise TypeError(f"kind {kind.name!r} has no option {unknown[0]!r}; its options are {', '.join(known)}")
    if kind.needs is None and values is not None:
        raise ValueError(f"values are for the kinds 'fill' and 'field', got {shown(values)} for {kind.name!r}")
    if kind.needs is not None and values is None:
        raise ValueError(f"kind {kind.name!r} needs values: {kind.needs}")
    checked = None if kind.values is None else kind.values(values, triangles, options)
    painter = Painter(kind, grid, options, triangles.n_components, checked)
    painter.learn(triangles.corners(np.empty(0, np.int32)))
    return painter


def without_values(painter: Painter) -> Painter:
    """Return a painter that draws payloads, without the arrays that `gather` takes them from."""
    if painter.values is None:
        return painter
    light = copy(painter)
    light.values = painter.values._replace(array=painter.values.array[:0].copy(), faces=None)
    return light
