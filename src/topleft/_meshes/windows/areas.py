"""Polygons as a huge raster: the windows that each of them may touch, and the pixels of a window.

Input: rings in pixels, of any number of polygons. Output: an index of windows and a `Painter`, for `Tiles`
in the place of triangles; each window is the crop of the picture that `polygons` draws, to the bit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import I32, Array
from topleft._core.base.grid import Extent, Grid
from topleft._core.base.memory import FRESH, Memory
from topleft._core.base.options import parse_sampling
from topleft._core.polygons.polygons import as_paint, in_crs_of, polygons
from topleft._core.polygons.rings import RingSet
from topleft._meshes.windows.drawing import Crop, Kind, Painter, Payload, Values
from topleft._meshes.windows.spans import Tiling

MOST_SPANS = 1 << 28
"""Pairs of a polygon and a window that an index lists: 3 GB."""


def are_polygons(subject: Any) -> bool:
    """Whether a subject is geometries and no mesh: shapely's, GeoJSON, ring offsets of polygons, lists of polygons."""
    if isinstance(subject, RingSet) or hasattr(subject, "__geo_interface__") or hasattr(subject, "geom_type"):
        return True
    if isinstance(subject, Mapping):
        return "type" in subject
    if isinstance(subject, tuple) and len(subject) == 3:
        return np.ndim(subject[0]) == 2 and np.ndim(subject[1]) == 1 and np.ndim(subject[2]) == 1
    is_array = isinstance(subject, np.ndarray) and subject.dtype == object and subject.ndim == 1
    if (isinstance(subject, list) or is_array) and len(subject):
        first = next((each for each in subject if each is not None), None)
        return are_polygons(first) or (isinstance(first, list) and len(first) > 0 and np.ndim(first[0]) == 2)
    return False


class Areas:
    """Polygons in pixels, in the place of the triangles of a mesh."""

    faces: Array | None = None
    n_components = 2

    def __init__(self, rings: RingSet) -> None:
        self.rings = rings
        self.columns = (rings.points,)
        self.n = self.n_faces = len(rings)
        self.n_vertices = len(rings.points)

    def parts(self) -> Iterator[Array]:
        """All that they consist of, in pieces, to be hashed."""
        yield from (self.rings.points, self.rings.rings, self.rings.polygons)
        if self.rings.unions is not None:
            yield self.rings.unions

    def boxes(self) -> npt.NDArray[np.float64]:
        """The box (N, 4) of each: least x and y, largest x and y; of none without points."""
        rings, firsts = self.rings, self.rings.rings[self.rings.polygons]
        box = np.full((self.n, 4), np.nan)
        is_full = firsts[:-1] < firsts[1:]
        if is_full.any():
            box[is_full, :2] = np.minimum.reduceat(rings.points, firsts[:-1][is_full])
            box[is_full, 2:] = np.maximum.reduceat(rings.points, firsts[:-1][is_full])
        return box

    def corners(self, which: I32, memory: Memory = FRESH) -> RingSet:  # noqa: ARG002
        """The rings of some of the polygons."""
        rings, polygon_offsets = self.rings.rings, self.rings.polygons
        ring_rows, n_rings = _ranges(polygon_offsets[which], polygon_offsets[which + 1])
        point_rows, n_points = _ranges(rings[ring_rows], rings[ring_rows + 1])
        ring_offsets, offsets = (np.concatenate([[0], np.cumsum(n)]).astype(np.int64) for n in (n_points, n_rings))
        unions = None if self.rings.unions is None else self.rings.unions[which]
        return RingSet(self.rings.points[point_rows], ring_offsets, offsets, unions)


def _ranges(
    first: npt.NDArray[np.int64], end: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The whole numbers of ranges, one range after the other, and how many each has."""
    counts = end - first
    before = np.cumsum(counts) - counts
    return np.arange(int(counts.sum())) + np.repeat(first - before, counts), counts


def areas_of(subject: Any, grid: Grid | None, crs: object) -> Areas:
    """Polygons in the pixels of a grid, or as they are."""
    rings = in_crs_of(grid, subject, crs)
    return Areas(rings if grid is None else replace(rings, points=grid.to_pixels(rings.points)))


def extent_of_polygons(subject: Any) -> Extent:
    """The box round polygons, in the units of their points."""
    points = in_crs_of(None, subject, None).points
    if not len(points):
        raise ValueError("no polygons have no extent")
    (x_min, y_min), (x_max, y_max) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x_min, x_max, y_min, y_max


class AreaIndex:
    """Which polygons each window of a raster may show; `Tiles` asks it as it asks a `WindowIndex`."""

    is_on_disk = False

    def __init__(self, areas: Areas, tiling: Tiling) -> None:
        size, window = (
            np.array(pair) for pair in ((tiling.width, tiling.height), (tiling.window_width, tiling.window_height))
        )
        boxes = areas.boxes()
        with np.errstate(invalid="ignore"):
            low, high = np.floor(boxes[:, :2] - 1), np.floor(boxes[:, 2:] + 1)  # a point snaps by less than a pixel
            meets = ((high >= 0) & (low < size)).all(axis=1)
        low, high = np.maximum(low[meets], 0), np.minimum(high[meets], size - 1)
        first, end = (low // window).astype(np.int64), (high // window).astype(np.int64) + 1
        n_across, n_down = (end - first).T
        counts = n_across * n_down
        if int(counts.sum()) > MOST_SPANS:
            raise MemoryError(f"{int(counts.sum())} pairs of a polygon and a window: take larger windows")
        who = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(len(who)) - np.repeat(np.cumsum(counts) - counts, counts)
        row, column = first[who, 1] + place // n_across[who], first[who, 0] + place % n_across[who]
        window_of = row * tiling.n_columns + column
        order = np.argsort(window_of, kind="stable")  # the polygons of a window stay in their order
        self._polygons = np.flatnonzero(meets)[who[order]].astype(np.int32)
        self.counts = np.bincount(window_of, minlength=tiling.n_rows * tiling.n_columns).reshape(tiling.n_rows, -1)
        self._starts = np.concatenate([[0], np.cumsum(self.counts)])
        self._n_columns = tiling.n_columns
        self.n_spans = len(who)

    def of_window(self, row: int, column: int) -> I32:
        """The polygons of a window, ascending."""
        i = row * self._n_columns + column
        return self._polygons[self._starts[i] : self._starts[i + 1]]


def values_of(values: Any, areas: Areas, options: dict[str, Any]) -> Values:
    """Check the values of polygons; without values these are their numbers."""
    sampling = parse_sampling(options.get("sampling", "center"))
    paint = as_paint("index" if values is None else values, options.get("background"), areas.n, sampling)
    return Values(paint.table, is_flat=True)


def draw_polygons(painter: Painter, payload: Payload, crop: Crop) -> Array:
    """Draw a window of `polygons`."""
    style = dict(painter.style)
    if payload.values is not None:
        style["values"] = payload.values
        if style.get("background") is None:
            nodata = None if painter.grid is None else painter.grid.nodata
            style["background"] = -1 if painter.kind.name == "labels" else nodata
    return polygons(payload.corners, crop.size, out=crop.out, **style, **painter.view_at(crop))


OPTIONS = ("assume_valid", "background", "max_crossings", "rule", "sampling")

VIEW = ("subpixel_bits",)

KINDS = {
    "coverage": Kind("coverage", draw_polygons, OPTIONS, view=VIEW),
    "labels": Kind("labels", draw_polygons, OPTIONS, values_of, view=VIEW, has_nodata=True),
    "fill": Kind("fill", draw_polygons, OPTIONS, values_of, needs="numbers or colours", view=VIEW, has_nodata=True),
}
"""The kinds of rasters of polygons."""
