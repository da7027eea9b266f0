"""`polygons`: masks, labels and colours of polygons.

Input: rings and a size. Output: an array (H, W) or (H, W, C).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from topleft._core.base.arrays import apart_from, as_array, as_count, as_size, as_subpixel_bits, as_window, check_real
from topleft._core.base.defaults import MAX_CROSSINGS
from topleft._core.base.georeference import crs_text, is_same_crs, transformed
from topleft._core.base.grid import Grid
from topleft._core.base.memory import FRESH, SCRATCH, empty
from topleft._core.base.options import Sampling, parse, parse_sampling
from topleft._core.base.threads import parse_threads, run_parts
from topleft._core.polygons.draw import add_shares, draw_labels, draw_mask
from topleft._core.polygons.prepared import Frame, Prepared, prepare
from topleft._core.polygons.rings import RingSet, as_rings
from topleft._core.raster.rasterize import Canvas
from topleft._core.raster.sampling import SAMPLE_GRID_BITS, sample_positions
from topleft.typing import RuleOption, SamplingOption


@dataclass(frozen=True, slots=True)
class Paint:
    """The values of polygons, a row of `table` each, and of pixels outside of all polygons."""

    table: npt.NDArray[Any]  # (P, ...), of the picture's dtype
    background: npt.NDArray[Any]  # a row


def polygons(
    rings: Any,
    size: int | tuple[int, int] | Grid,
    *,
    rule: RuleOption = "evenodd",
    values: npt.ArrayLike | Literal["index"] | None = None,
    background: npt.ArrayLike | None = None,
    crs: object = None,
    sampling: SamplingOption = "center",
    origin: tuple[int, int] = (0, 0),
    subpixel_bits: int = 8,
    assume_valid: bool = False,
    max_crossings: int = MAX_CROSSINGS,
    threads: int | None = None,
    out: npt.NDArray[Any] | None = None,
) -> npt.NDArray[Any]:
    """Return the mask of the pixels inside of polygons, or their labels or colours, the later over the earlier.

    Parameters
    ----------
    rings : array_like (N, 2), list, tuple of arrays, or geometries
        One ring of points; a list of rings, holes among them: one polygon; a list of such lists: several polygons.
        Or ``(coordinates, ring_offsets)``, one polygon, or ``(coordinates, ring_offsets, polygon_offsets)``,
        several, as in GeoArrow. Flat rings of COCO, ``[x, y, x, y, ...]``, stand for rings. Or shapely polygons, one or
        a sequence or a GeoSeries; the result of `shapely.to_ragged_array`; GeoJSON; anything with `__geo_interface__`.
        Rings close themselves, may run either way, and may cross and touch themselves and each other. Pixels, x right
        and y down, unless `size` is a `Grid`.
    size : (int, int) or Grid
        Width and height of the picture in pixels; or a grid: the points are then in its units.
    rule : "evenodd" or "nonzero"
        A point is inside if the rings wind round it an odd number of times, or any number of times but 0. Where parts
        of a MultiPolygon or of a GeometryCollection overlap, they are united under either rule.
    values : "index", number, or array_like (P,) or (P, C), optional
        The value of a pixel in a polygon: "index" the index of the polygon, as int32; a number for all polygons or for
        each, of any dtype; or a colour for each. Without `values` the result is a mask.
    background : number or array_like (C,), optional
        The value of a pixel in no polygon. The default is -1 with ``values="index"``, with other values the `nodata` of
        the `Grid`, or 0.
    crs : str, int or CRS, optional
        The CRS of the points; pyproj transforms them to the CRS of the `Grid`. The default is the CRS of the grid, and
        a GeoSeries or GeoDataFrame in another CRS raises an error.
    sampling : "center"; "msaa2", "msaa4", "msaa8" or "msaa16"; "area"; "outer" or "inner"
        A pixel is inside when its centre is. With several samples, and with exact areas, masks are the share of the
        pixel that lies inside of any polygon (with "area" the sum of the polygons' shares, at most 1), and colours
        are blended by this share. "outer": all pixels that meet a polygon in positive area (the meaning of rasterio's
        `all_touched`); "inner": all pixels that lie wholly inside of a polygon.
    origin : (int, int)
        The pixel of the whole picture that is row 0, column 0 here.
    subpixel_bits : int, 0 to 16
        Points snap to ``2**-subpixel_bits`` pixels.
    assume_valid : bool
        For "area", "outer" and "inner": the rings of a polygon neither cross nor touch, its first ring is its border
        and all other rings are holes in it; rings may run either way. Saves the search for crossings. Pictures of
        other polygons are undefined.
    max_crossings : int
        For "area", "outer" and "inner": how often rings may cross or touch within the picture; fifty million
        take some 4 s. A pixel that more than 64 edges pass side by side counts as well.
    threads : int or None
        Does not change a bit of the result.
    out : ndarray of the result's dtype, shape (H, W) or (H, W, C), optional
        The array to write. The first write to a fresh array takes several times as long as drawing few polygons.

    Returns
    -------
    ndarray of bool, shape (H, W)
        The mask. Float32 with several samples and "area". With `values` an array of their dtype, shape (H, W) or
        (H, W, C).

    Raises
    ------
    ValueError
        For a wrong shape, an unknown option, offsets that do not fit, a ring of fewer than three points, a point
        that is not finite or lies beyond ``2**60`` sub-pixels, rings that cross more than `max_crossings` times, or
        a CRS other than the CRS of the grid.
    TypeError
        If an item is no polygon, or a dtype is wrong.

    Notes
    -----
    A pixel centre on a border that two polygons share belongs to exactly one of the two: a point on an edge lies to the
    right of it, or below. Areas are exact except for a rounding to ``2**-24`` for each edge that passes the pixel.

    References
    ----------
    R. Levien, font-rs, 2015 (areas from edges); M. I. Shamos, D. Hoey, Geometric Intersection Problems, 1976.

    Examples
    --------
    >>> import topleft as tl
    >>> square, hole = [(0, 0), (5, 0), (5, 4), (0, 4)], [(1, 1), (3, 1), (3, 3), (1, 3)]
    >>> tl.polygons([square, hole], (6, 4)).astype(int)
    array([[1, 1, 1, 1, 1, 0],
           [1, 0, 0, 1, 1, 0],
           [1, 0, 0, 1, 1, 0],
           [1, 1, 1, 1, 1, 0]])
    >>> tl.polygons([[square], [hole]], (6, 4), values="index")
    array([[ 0,  0,  0,  0,  0, -1],
           [ 0,  1,  1,  0,  0, -1],
           [ 0,  1,  1,  0,  0, -1],
           [ 0,  0,  0,  0,  0, -1]], dtype=int32)
    >>> tl.polygons([(0, 0), (2, 0), (0, 2)], (2, 2), sampling="area")
    array([[1. , 0.5],
           [0.5, 0. ]], dtype=float32)
    """
    how = parse_sampling(sampling)
    is_nonzero = parse(RuleOption, "rule", rule) == "nonzero"
    ring_set = in_crs_of(size, rings, crs).apart_from(out)
    rings_px, frame = frame_of(ring_set, size, origin, subpixel_bits, threads, how.n_samples, max_crossings)
    shape = frame.size[::-1]
    if values is None:
        if background is not None:
            raise ValueError("background needs values: a mask is False where no polygon is")
        prepared = prepare(SCRATCH, rings_px, frame, is_nonzero=is_nonzero)
        warn_if_apart(prepared, ring_set, size)
        if how in (Sampling.CENTER, Sampling.OUTER, Sampling.INNER):
            with Canvas.of(FRESH, "mask", out, shape, np.bool_) as (mask, canvas):
                if canvas.size:
                    draw_binary(prepared, canvas.view(np.uint8), how, assume_valid=assume_valid)
            return mask
        with Canvas.of(FRESH, "share", out, shape, np.float32) as (result, canvas):
            if not canvas.size:
                pass
            elif how is Sampling.AREA:
                prepared.certify(assume_valid=assume_valid)
                add_shares(prepared, canvas, None)
            else:
                mean_of_samples(prepared, canvas, None, how)
        return result
    if background is None and isinstance(size, Grid) and not isinstance(values, str):
        background = size.nodata
    paint = as_paint(apart_from(out, "values", values), background, len(rings_px), how)
    prepared = prepare(SCRATCH, rings_px, frame, is_nonzero=is_nonzero)
    warn_if_apart(prepared, ring_set, size)
    with Canvas.of(FRESH, "values", out, (*shape, *paint.table.shape[1:]), paint.table.dtype.type) as (result, canvas):
        if canvas.size:
            paint_values(prepared, canvas, paint, how, assume_valid=assume_valid)
    return result


def in_crs_of(size: object, rings: Any, crs: object) -> RingSet:
    """Return the rings in the CRS of a grid, if the grid has a CRS.

    A `ValueError` if `rings.crs` is another CRS and `crs` is None, or if `crs` is set and the grid has no CRS.
    """
    ring_set, crs_of_points, of_grid = as_rings(rings), crs_text(crs), size.crs if isinstance(size, Grid) else None
    if of_grid is None:
        if crs_of_points is not None:
            raise ValueError(f"crs needs a Grid with a CRS, which the points then go to, got crs={crs_of_points!r}")
        return ring_set
    crs_of_rings = crs_text(getattr(rings, "crs", None)) if crs_of_points is None else crs_of_points
    if crs_of_rings is None or is_same_crs(crs_of_rings, of_grid):
        return ring_set
    if crs_of_points is None:
        raise ValueError(
            f"rings must be of the CRS of the grid, {of_grid}, got {crs_of_rings}: crs={crs_of_rings!r} transforms them"
        )
    return replace(ring_set, points=transformed(ring_set.points, crs_of_points, of_grid))


def frame_of(
    rings: RingSet,
    size: int | tuple[int, int] | Grid,
    origin: object,
    subpixel_bits: object,
    threads: object,
    n_samples: int,
    max_crossings: object = MAX_CROSSINGS,
) -> tuple[RingSet, Frame]:
    """Return the rings in pixels, and the frame to draw."""
    if isinstance(size, Grid):
        rings, size = replace(rings, points=size.to_pixels(rings.points)), size.size
    bits = as_subpixel_bits(subpixel_bits)
    grid_bits = max(1 if n_samples == 1 else SAMPLE_GRID_BITS, bits)
    corner = as_window(origin, grid_bits + 2)
    most = as_count("max_crossings", max_crossings)
    return rings, Frame(as_size(size), corner, bits, grid_bits, parse_threads(threads), most)


def warn_if_apart(prepared: Prepared, rings: RingSet, size: object) -> None:
    """Warn the caller's caller when no polygon meets a pixel of the grid."""
    if not isinstance(size, Grid) or not len(rings.points) or 0 in size.size or prepared.frame.origin != (0, 0):
        return
    left, top, right, bottom = prepared.compiled.boxes_px.T
    if ((left < right) & (top < bottom)).any():
        return
    (x_min, y_min), (x_max, y_max) = rings.points.min(axis=0).tolist(), rings.points.max(axis=0).tolist()
    box, box_of_grid = [x_min, x_max, y_min, y_max], list(size.extent)
    are_degrees, is_grid_of_degrees = (
        -180 <= e[0] and e[1] <= 360 and -90 <= e[2] and e[3] <= 90 for e in (box, box_of_grid)
    )
    why = "are they of another CRS than the grid?"
    if are_degrees != is_grid_of_degrees:
        degrees, other = ("polygons", "grid") if are_degrees else ("grid", "polygons")
        why = f"the {degrees} may be degrees, the {other} cannot: transform the polygons to the CRS of the grid"
    warnings.warn(
        "no polygon meets a pixel of the grid: the polygons lie in x {:g} to {:g}, y {:g} to {:g}, the grid in x {:g} "
        "to {:g}, y {:g} to {:g}; ".format(*box, *box_of_grid)
        + why,
        stacklevel=3,
    )


def draw_binary(prepared: Prepared, mask: npt.NDArray[np.uint8], how: Sampling, *, assume_valid: bool) -> None:
    """Write the mask of all polygons."""
    if how is not Sampling.CENTER:
        prepared.certify(assume_valid=assume_valid)
    elif len(prepared) == 1:
        draw_mask(prepared, mask)
        return
    draw_labels(prepared, mask, np.ones(len(prepared) + 1, np.int32), 0, str(how))


def mean_of_samples(prepared: Prepared, out: npt.NDArray[np.float32], paint: Paint | None, how: Sampling) -> None:
    """Write the mean over the samples of each pixel: of 0 or 1, or of colours."""
    height, width = out.shape[:2]
    positions = sample_positions(how.n_samples, prepared.frame.grid_bits).tolist()
    mask = empty((height, width), np.uint8) if paint is None else None
    labels = None if paint is None else empty((height, width), np.int32)
    table = None if paint is None else np.concatenate([paint.table, paint.background[None]]).astype(np.float32)
    out.fill(0)
    for at in positions:
        prepared.compiled.at_sample(*at)
        if mask is not None:
            draw_binary(prepared, mask, Sampling.CENTER, assume_valid=False)
            np.add(out, mask, out=out)
        elif labels is not None and table is not None:
            draw_labels(prepared, labels, None, -1)
            np.add(out, table[labels], out=out)  # -1 is the last row
    np.multiply(out, np.float32(1 / len(positions)), out=out)


def as_paint(values: Any, background: Any, n: int, how: Sampling) -> Paint:
    """Return the values that polygons are painted with."""
    if isinstance(values, str):
        if values != "index":
            raise ValueError(f"values must be 'index', a number or an array, got {values!r}")
        table: npt.NDArray[Any] = np.arange(n, dtype=np.int32)
        background = -1 if background is None else background
    else:
        table = as_array("values", values)
        check_real("values", table, "biuf")
        table = table.astype(table.dtype.newbyteorder("="), copy=False)  # rows are written as bytes
        if table.ndim == 0:
            table = np.full(n, table)
        if table.ndim > 2 or len(table) != n:
            raise ValueError(f"values must have shape ({n},) or ({n}, C), a row for each polygon, got {table.shape}")
    is_mixed = how is Sampling.AREA or how.n_samples > 1
    if is_mixed and (isinstance(values, str) or not (table.dtype == np.uint8 or table.dtype.kind == "f")):
        kind = "numbers of polygons" if isinstance(values, str) else str(table.dtype)
        raise ValueError(f"sampling {str(how)!r} mixes colours, which must be uint8 or floats, got {kind}")
    ground = as_array("background", 0 if background is None else background)
    if ground.shape not in ((), table.shape[1:]):
        raise ValueError(f"background must be one number or have shape {table.shape[1:]}, got {ground.shape}")
    check_real("background", ground, "biuf")
    with np.errstate(invalid="ignore", over="ignore"):
        row = np.broadcast_to(ground, table.shape[1:]).astype(table.dtype)
    if table.dtype.kind in "iub" and not (row == ground).all():
        raise ValueError(f"background must fit {table.dtype}, the dtype of values, got {ground.tolist()}")
    return Paint(np.ascontiguousarray(table), row)


def paint_values(prepared: Prepared, out: npt.NDArray[Any], paint: Paint, how: Sampling, *, assume_valid: bool) -> None:
    """Write the values of polygons over contiguous pixels."""
    if how in (Sampling.OUTER, Sampling.INNER, Sampling.AREA):
        prepared.certify(assume_valid=assume_valid)
    if how is Sampling.AREA or how.n_samples > 1:
        picture = out if out.dtype == np.float32 else empty(out.shape, np.float32)
        if how is Sampling.AREA:
            picture[...] = paint.background
            colors = np.ascontiguousarray(paint.table.reshape(len(paint.table), -1), np.float32)
            add_shares(prepared, picture, colors if len(colors) else None)
        else:
            mean_of_samples(prepared, picture, paint, how)
        if picture is not out:
            out[...] = np.rint(picture) if out.dtype == np.uint8 else picture
        return
    height, width = out.shape[:2]
    n_bytes = paint.table.itemsize * int(np.prod(paint.table.shape[1:]))
    if n_bytes in (1, 4):  # the kernel writes values of these sizes
        dtype = np.int8 if n_bytes == 1 else np.int32
        words = np.ascontiguousarray(np.append(_as_words(paint.table, dtype), 0), np.int32)  # never empty
        background = int(_as_words(paint.background[None], dtype)[0])
        draw_labels(prepared, _as_words(out, dtype).reshape(height, width), words, background, str(how))
        return
    labels: npt.NDArray[np.int32] = SCRATCH.scratch("labels", (height, width), np.int32)
    draw_labels(prepared, labels, None, -1, str(how))
    table = np.concatenate([paint.table, paint.background[None]])

    def look_up(first: int, end: int) -> None:
        np.take(table, labels[first:end], axis=0, out=out[first:end], mode="wrap")  # -1 is the last row

    run_parts(look_up, height, prepared.n_threads)


def _as_words(array: npt.NDArray[Any], dtype: type) -> npt.NDArray[Any]:
    """Return the bytes of an array as numbers of `dtype`."""
    return np.ascontiguousarray(array).view(np.uint8).reshape(-1).view(dtype)
