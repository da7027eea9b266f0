"""Fields: values on an unstructured mesh, and heights of its surface, on a regular grid.

Input: a mesh, values of its vertices or faces, a `Grid`. Output: an array (H, W) or (H, W, C), NaN where nothing is.

Based on: Gold, C. M., T. D. Charters and J. Ramsden, "Automated Contour Mapping Using Triangular Element Data
Structures and an Interpolant over Each Irregular Triangular Domain", SIGGRAPH 1977 (the plane through each triangle).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F64, I32, MeshLike
from topleft._core.base.arrays import (
    apart_from,
    as_array,
    as_checked_triangles,
    as_number,
    as_pair,
    as_plane_points,
    check_real,
)
from topleft._core.base.grid import Extent, ExtentLike, Grid, extent_of, grid_around
from topleft._core.base.memory import SCRATCH
from topleft._core.base.options import Sink, parse
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.rasterize import Canvas, draw
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View
from topleft._meshes.model.cells import data_of
from topleft._meshes.scene.adapt import as_polygons
from topleft.typing import PerOption, SurfaceOption, YOption

#: Pixels a triangle. With fewer it pays to compute all planes first: 200,000 triangles at 1080p.
MAX_PIXELS_TO_LIST = 48

#: Planes take 64 bytes each in the thread's scratch memory.
MAX_LISTED_PLANES = 1_000_000


def field(
    mesh: MeshLike,
    values: npt.ArrayLike,
    size: int | tuple[int, int] | Grid | None = None,
    *,
    origin: tuple[int, int] = (0, 0),
    window: int | tuple[int, int] | None = None,
    nodata: float | None = None,
    extent: ExtentLike | None = None,
    pixel_size: float | tuple[float, float] | None = None,
    y: YOption = "up",
    per: PerOption = "auto",
    subpixel_bits: int | Literal["exact"] = 8,
    threads: int | None = None,
    out: npt.NDArray[Any] | None = None,
) -> npt.NDArray[Any]:
    """Return a field of an unstructured mesh on a regular grid, a value or a vector a pixel.

    Parameters
    ----------
    mesh : matplotlib.tri.Triangulation, meshio.Mesh, pyvista.PolyData, (points, triangles), ...
        Whatever `as_mesh` takes; z is not looked at. Where triangles overlap, the later one is seen.
    values : array_like of real numbers, shape (V,) or (V, C) per vertex, (F,) or (F, C) per face, or str
        Faces are the triangles, or the polygons or quadratic cells that they were cut from. A NaN makes its triangles
        NaN. C columns (components of a vector, time steps) share one drawing of the mesh. A name is that of data of
        points or cells of a mesh of meshio or pyvista.
    size : (width, height) or Grid, optional
        How many pixels; or the grid, which then says all.
    origin : (column, row), pixels
        The pixel of the grid that is row 0, column 0 of the result, which is the crop of the whole bit for bit.
    window : (width, height), optional
        The size of the result; from `origin` to the end of the grid unless given.
    nodata : number, optional
        The value where the mesh is not; unless given the `nodata` of the `Grid`, or NaN. With it integers of faces
        stay integers.
    extent : (x_min, x_max, y_min, y_max), optional
        The extent of the picture, data units; the box of the mesh unless given.
    pixel_size : float or (float, float), optional
        Width and height of a pixel, data units, instead of `size`; see `Grid.around`.
    y : {"up", "down"}
        "up": row 0 is at y_max, as on a map; "down": row 0 is at y_min. See `Grid`.
    per : {"auto", "vertex", "triangle"}
        Whether values are of vertices or of triangles; "auto" tells by their number.
    subpixel_bits, threads
        As in `coverage`.
    out : ndarray of the dtype and shape of the result, optional
        Where the result goes. A fresh array costs its first touch.

    Returns
    -------
    ndarray of float32, or float64 unless `values` are float32, shape (H, W), or (H, W, C) of C columns
        Linear over each triangle, or constant; NaN, or `nodata`, outside of the mesh. Of integers of faces and with
        `nodata` in the dtype of `values`.

    Raises
    ------
    ValueError
        If the rows of `values` fit neither in number, or both; if a point in use is not finite; if `nodata` is no
        number of the result's dtype; or as `Grid.around`.
    TypeError
        If the values are no real numbers, or the mesh is none.

    Notes
    -----
    Each pixel belongs to the triangle that owns its centre, by the top-left rule on vertices that are rounded to
    ``2**-subpixel_bits`` pixels: there are neither gaps nor doubles. The value is that of the exact triangle's plane at
    the centre in float64, kept within the three values of the triangle. Points go to pixels in float64, the difference
    to the extent first, so large coordinates (UTM, say) lose nothing: a point is off by less than 2**-51 of its
    distance from that side, before it is rounded to the grid above.

    Examples
    --------
    >>> import topleft as tl
    >>> tl.field(([[0, 0], [4, 0], [0, 4]], [[0, 1, 2]]), [0.0, 4.0, 8.0], (4, 4))
    array([[nan, nan, nan, nan],
           [5.5, nan, nan, nan],
           [3.5, 4.5, nan, nan],
           [1.5, 2.5, 3.5, nan]])

    The centres on the slanted side belong to the triangle on its other side, if there is one.
    """
    polygons = as_polygons(mesh)
    if isinstance(values, str):
        values, per = data_of(mesh, values)
    points = as_plane_points("points", polygons.points)
    array = as_array("values", apart_from(out, "values", values))
    check_real("values", array, "fiub")
    is_of_faces = is_per_face(array, len(points), polygons.n_faces, parse(PerOption, "per", per))
    triangles = as_checked_triangles(apart_from(out, "triangles", polygons.triangles), len(points))
    grid = grid_of(size, pixel_size, extent, y, partial(extent_of, points, triangles))
    size = _window_of(grid, origin) if window is None else window
    view = View.parse(size, {"subpixel_bits": subpixel_bits, "threads": threads, "origin": origin})
    if is_of_faces and polygons.faces is not None:
        array = array[polygons.faces]
    return draw_field(points, triangles, array, grid, view, nodata, out, is_of_faces=is_of_faces)


def height_map(
    mesh: MeshLike,
    spacing: float | tuple[float, float] | Grid,
    *,
    surface: SurfaceOption = "upper",
    extent: ExtentLike | None = None,
    y: YOption = "up",
    subpixel_bits: int | Literal["exact"] = 8,
    threads: int | None = None,
    out: F64 | None = None,
) -> F64:
    """Return the heights of the upper or lower surface of a mesh on a regular grid, seen along z.

    Parameters
    ----------
    mesh : mesh with points (V, 3)
        Whatever `as_mesh` takes; z is the height.
    spacing : float, (float, float) or Grid
        Width and height of a pixel, in the units of the mesh; or the grid, which then says all.
    surface : {"upper", "lower"}
        Whether the largest or the smallest height counts.
    extent : (x_min, x_max, y_min, y_max), optional
        The extent of the picture; the box of the mesh unless given.
    y : {"up", "down"}
        "up": row 0 is at y_max, as on a map; "down": row 0 is at y_min. See `Grid`.
    subpixel_bits, threads
        As in `coverage`.
    out : ndarray of float64, shape (H, W), optional
        Where the result goes. A fresh array costs its first touch.

    Returns
    -------
    ndarray of float64, shape (H, W)
        z of the surface at the pixel centres (`Grid.around(mesh, pixel_size=spacing)` tells where they are), where
        there is none the `nodata` of the `Grid`, or NaN.

    Raises
    ------
    ValueError
        If the points are flat, one in use is not finite, an option is unknown, or as `Grid.around`.
    TypeError
        If the mesh is none.

    Notes
    -----
    A depth buffer in float32 only decides which triangle is seen: of surfaces closer to each other than 2**-22 of the
    range of heights either may be taken. The height is then that of the triangle's exact plane, in float64.

    Examples
    --------
    >>> import topleft as tl
    >>> tl.height_map(([[0, 0, 1], [2, 0, 1], [0, 2, 3]], [[0, 1, 2]]), 1.0)
    array([[nan, nan],
           [1.5, nan]])
    """
    parse(SurfaceOption, "surface", surface)
    polygons = as_polygons(mesh)
    points = as_plane_points("points", polygons.points)
    if points.shape[1] != 3:
        raise ValueError(f"a height map needs points of shape (V, 3), got {points.shape}")
    size, pixel_size = (spacing, None) if isinstance(spacing, Grid) else (None, spacing)
    triangles = as_checked_triangles(apart_from(out, "triangles", polygons.triangles), len(points))
    grid = grid_of(size, pixel_size, extent, y, partial(extent_of, points, triangles))
    view = View.parse(grid.size, {"subpixel_bits": subpixel_bits, "threads": threads})
    return draw_heights(points, triangles, grid, view, surface, range_of(points[:, 2], triangles), out)


def _window_of(grid: Grid, origin: tuple[int, int]) -> tuple[int, int]:
    """The pixels of a grid from one of them on."""
    (width, height), (x, y) = grid.size, as_pair("origin", origin)
    if not (x <= width and y <= height):
        raise ValueError(f"origin must lie in the grid, of {width} x {height} pixels, or window be given, got {origin}")
    return width - x, height - y


def dtype_of_field(values: np.dtype[Any], *, is_of_faces: bool, has_nodata: bool) -> type[Any]:
    """The dtype of a field of values of a dtype."""
    if is_of_faces and has_nodata and values.kind in "iub":
        return values.type
    return np.float32 if values.newbyteorder("=") == np.float32 else np.float64


def nodata_of(nodata: object, dtype: type[Any]) -> npt.NDArray[Any]:
    """The value where the mesh is not, as an array of one number of the dtype."""
    if nodata is None:
        return np.array([np.nan], dtype)
    number = as_number("nodata", nodata)
    kind = np.dtype(dtype).kind
    low, high = (0, 1) if kind == "b" else (np.iinfo(dtype).min, np.iinfo(dtype).max) if kind in "iu" else (0, 0)
    fits = kind == "f" or (number == np.floor(number) and low <= number <= high)
    if not fits:
        raise ValueError(f"nodata must be one of {np.dtype(dtype)}, as the values are, got {nodata!r}")
    return np.array([number], dtype)


def grid_of(size: Any, pixel_size: Any, extent: ExtentLike | None, y: YOption, box: Callable[[], Extent]) -> Grid:
    """The grid that is given, or the one round an extent: the box of a mesh unless given."""
    if isinstance(size, Grid):
        if extent is not None or pixel_size is not None or y != "up":
            raise ValueError("a Grid says extent, pixel_size and y itself: give none of them beside it")
        return size
    return grid_around(box() if extent is None else extent, size, pixel_size, y)


def is_per_face(values: npt.NDArray[Any], n_vertices: int, n_faces: int, per: PerOption) -> bool:
    """Whether values are of faces; of vertices otherwise."""
    n_rows = values.shape[0] if values.ndim in (1, 2) else -1
    if per == "auto" and n_rows == n_vertices == n_faces:
        raise ValueError(
            f"values has {n_rows} rows, and there are as many faces as vertices: say per='triangle' or per='vertex'"
        )
    if n_rows == n_faces and per != "vertex":
        return True
    if n_rows == n_vertices and per != "triangle":
        return False
    wishes = {part: f"({n},) or ({n}, C)" for part, n in (("vertex", n_vertices), ("triangle", n_faces))}
    wish = wishes.get(per, f"{wishes['vertex']} per vertex or {wishes['triangle']} per face")
    raise ValueError(f"values must have shape {wish}, got {values.shape}")


def range_of(heights: npt.NDArray[Any], triangles: I32) -> tuple[float, float]:
    """The lowest and the highest height that triangles use."""
    used = heights[triangles]
    with np.errstate(invalid="ignore"):
        return (float(used.min()), float(used.max())) if used.size else (0.0, 0.0)


def depth_of(heights: F64, low: float, high: float) -> F64:
    """The heights scaled from low..high to -1..1, where float32 tells them apart best."""
    with np.errstate(invalid="ignore", over="ignore"):
        middle, half = low / 2 + high / 2, high / 2 - low / 2
        depth: F64 = np.divide(np.subtract(heights, middle), half or 1.0)
    return depth


def draw_field(
    points: npt.NDArray[Any], triangles: I32, values: npt.NDArray[Any], grid: Grid, view: View, nodata: float | None,
    out: object, *, is_of_faces: bool,
) -> npt.NDArray[Any]:  # fmt: skip
    """`field` with checked arguments: values of vertices, or a value of each triangle."""
    nodata = grid.nodata if nodata is None else nodata
    dtype = dtype_of_field(values.dtype, is_of_faces=is_of_faces, has_nodata=nodata is not None)
    empty, points_px = nodata_of(nodata, dtype), grid.to_pixels(points)
    with Canvas.of(SCRATCH, "field", out, (*view.size[::-1], *values.shape[1:]), dtype) as (result, canvas):
        ids = visible(points_px, triangles, view, Sink.LABEL)
        if is_of_faces:
            rows = np.concatenate([values.astype(dtype), np.broadcast_to(empty, (1, *values.shape[1:]))])
            np.take(rows, ids, axis=0, out=canvas, mode="wrap")  # id -1 is the last
            return result
        plane = canvas if values.ndim == 1 else SCRATCH.scratch("plane of a field", ids.shape, dtype)
        for channel, column in enumerate(values.T if values.ndim == 2 else [values]):
            fill_planes(ids, points_px, triangles, column.astype(np.float64, copy=False), view, plane)
            if not np.isnan(empty):  # which planes leave
                plane[ids < 0] = empty
            if plane is not canvas:
                canvas[..., channel] = plane
    return result


def draw_heights(
    points: npt.NDArray[Any], triangles: I32, grid: Grid, view: View, surface: SurfaceOption, ends: tuple[float, float],
    out: object,
) -> F64:  # fmt: skip
    """`height_map` with checked arguments, of heights between two ends."""
    sink = Sink.FARTHEST if surface == "upper" else Sink.NEAREST
    points_px, heights = grid.to_pixels(points), np.ascontiguousarray(points[:, 2], np.float64)
    with Canvas.of(SCRATCH, "field", out, view.size[::-1], np.float64) as (result, canvas):
        ids = visible(np.column_stack([points_px, depth_of(heights, *ends)]), triangles, view, sink)
        fill_planes(ids, points_px, triangles, heights, view, canvas)
        if grid.nodata is not None:
            canvas[ids < 0] = grid.nodata
    return result


def visible(points: F64, triangles: I32, view: View, sink: Sink) -> I32:
    """Ids (H, W) of the triangles that show, in memory that the thread's next call overwrites."""
    snapped = snap_mesh(SCRATCH, points, triangles, view, with_depth=sink is not Sink.LABEL, out=None)
    ids: I32 = SCRATCH.scratch("labels", view.size[::-1], np.int32)
    depth = None if sink is Sink.LABEL else SCRATCH.scratch("depth of heights", ids.shape, np.float32)
    draw(SCRATCH, snapped, view, choices.drawing(view, snapped.work, sink), ids, depth=depth)
    return ids


def fill_planes(ids: I32, points_px: F64, triangles: I32, values: F64, view: View, canvas: npt.NDArray[Any]) -> None:
    """Write the values of the planes that show in a canvas (H, W)."""
    n, n_threads = len(triangles), count_threads(view.threads, len(triangles))
    planes: F64 | None = None
    if ids.size < MAX_PIXELS_TO_LIST * n and n < MAX_LISTED_PLANES:
        planes = SCRATCH.scratch("planes", ((1 + n) * engine.PLANE_DOUBLES,), np.float64)
    valued = engine.Valued(points_px, triangles, np.ascontiguousarray(values), planes)
    if planes is not None:
        run_parts(valued.list_planes, n, n_threads)

    def fill_rows(first: int, end: int) -> None:
        valued.fill_planes(ids, canvas, first, end - first, *view.origin)

    run_parts(fill_rows, ids.shape[0], n_threads)
