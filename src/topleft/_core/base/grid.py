"""Regular grids over data: which part of the plane a picture shows, in units of the data.

Input: an extent and a size, or data to lay the grid round. Output: `Grid`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import F64, I32
from topleft._core.base.arrays import (
    as_array,
    as_checked_triangles,
    as_number,
    as_plane_points,
    as_real,
    as_size,
    shown,
)
from topleft._core.base.georeference import crs_text, data_array, frame_of_raster
from topleft._core.base.options import parse
from topleft.typing import YOption

Extent = tuple[float, float, float, float]
ExtentLike: TypeAlias = Sequence[float] | npt.NDArray[Any]


@dataclass(frozen=True)
class Grid:
    """A picture laid over the plane of the data: its size, and its extent (x_min, x_max, y_min, y_max).

    Bounds of rasterio, shapely and geopandas are in another order, (left, bottom, right, top): their extent is (left,
    right, bottom, top). `Grid.like` takes the grid of a raster.

    Parameters
    ----------
    size : (width, height), pixels
    extent : (x_min, x_max, y_min, y_max)
        Outer sides of the outermost pixels, data units; the order of matplotlib's `imshow(extent=)`.
    y : {"up", "down"}
        Where y grows in the picture. "up": row 0 is at `y_max`, as on a map (`imshow(origin="upper")`); "down": row 0
        is at `y_min` (`origin="lower"`).
    crs : str, int or CRS, optional
        The coordinate reference system of the extent: "EPSG:25832", 25832, WKT, or that of pyproj, rasterio or
        geopandas; kept as text. Files and xarray get it; polygons with another one are refused.
    nodata : number, optional
        The value of empty pixels: the default of `nodata=` of `field`, `tiles` and `Overlap.means`, of `background=`
        of `polygons` with values, and of files.

    Raises
    ------
    ValueError
        If the extent is empty, not finite or a BoundingBox of rasterio, or `y` is neither "up" nor "down".
    TypeError
        If `crs` is no CRS, or `nodata` no number.

    Examples
    --------
    >>> grid = Grid((4, 2), (500000.0, 500002.0, 10.0, 11.0))
    >>> grid.pixel_size
    (0.5, 0.5)
    >>> grid.y_centers.tolist()
    [10.75, 10.25]
    """

    size: tuple[int, int]
    extent: Extent
    y: str = "up"
    crs: str | None = None
    nodata: float | None = None

    if TYPE_CHECKING:  # an argument may be any four numbers; the attribute is a tuple of floats

        def __init__(
            self,
            size: int | tuple[int, int],
            extent: ExtentLike,
            y: YOption = "up",
            crs: object = None,
            nodata: float | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", as_size(self.size))
        try:
            x_min, x_max, y_min, y_max = map(float, self.extent)
        except (TypeError, ValueError):
            raise ValueError(f"extent must be (x_min, x_max, y_min, y_max), got {self.extent!r}") from None
        is_box = hasattr(self.extent, "bottom")  # a BoundingBox of rasterio
        if is_box or not (np.isfinite([x_min, x_max, y_min, y_max]).all() and x_min < x_max and y_min < y_max):
            may_be_bounds = is_box or (x_min < y_min and x_max < y_max)
            raise ValueError(
                f"extent must be finite with x_min < x_max and y_min < y_max, got {x_min}, {x_max}, {y_min}, {y_max}"
                + f"; bounds (left, bottom, right, top) have extent=({x_min}, {y_min}, {x_max}, {y_max})"
                * may_be_bounds
            )
        object.__setattr__(self, "extent", (x_min, x_max, y_min, y_max))
        parse(YOption, "y", self.y)
        object.__setattr__(self, "crs", crs_text(self.crs))
        if self.nodata is not None:
            as_number("nodata", self.nodata)
            object.__setattr__(self, "nodata", np.asarray(self.nodata).item())  # a whole number stays an int

    def __repr__(self) -> str:
        """The constructor's call, without unset options."""
        more = "".join(
            f", {name}={value!r}" for name in ("crs", "nodata") if (value := getattr(self, name)) is not None
        )
        return f"Grid(size={self.size}, extent={self.extent}, y={self.y!r}{more})"

    @classmethod
    def around(
        cls,
        subject: Any,
        *,
        size: int | tuple[int, int] | None = None,
        pixel_size: float | tuple[float, float] | None = None,
        extent: ExtentLike | None = None,
        y: YOption = "up",
        crs: object = None,
        nodata: float | None = None,
    ) -> Grid:
        """The grid round a mesh, of so many pixels or of pixels so large.

        Parameters
        ----------
        subject : Mesh or (points, triangles)
            x and y of the points that triangles use; `as_mesh` reads other meshes.
        size : (width, height), optional
            How many pixels.
        pixel_size : float or (float, float), optional
            Width and height of a pixel, data units; instead of `size`. The grid begins at (x_min, y_min) of the extent
            and has as many whole pixels as cover it.
        extent : (x_min, x_max, y_min, y_max), optional
            Data units; the box of the mesh unless given.
        y, crs, nodata
            As for `Grid`.

        Raises
        ------
        ValueError
            If neither or both of `size` and `pixel_size` are given, the mesh has no triangles or no area, or a number
            is outside its range.
        """
        found = grid_around(extent_around(subject) if extent is None else extent, size, pixel_size, y)
        return replace(found, crs=crs_text(crs), nodata=nodata)

    @classmethod
    def like(cls, raster: Any) -> Grid:
        """The grid of a raster: its size, extent, CRS and number of no data.

        Parameters
        ----------
        raster : open dataset of rasterio, DataArray or Dataset of xarray, or path
            A file is opened by rasterio. Coordinates of xarray are x and y, or lon and lat, evenly spaced; the CRS is
            that of `spatial_ref`, as rioxarray writes it, or of ``attrs["crs"]``.

        Raises
        ------
        TypeError, ValueError
            If it is none of these, its coordinates are not evenly spaced, or as `from_transform`.
        MissingPackageError
            If it is a file and rasterio is not installed.
        """
        transform, size, crs, nodata = frame_of_raster(raster)
        return cls.from_transform(transform, size, crs=crs, nodata=nodata)

    @classmethod
    def from_transform(
        cls, transform: Any, size: int | tuple[int, int], *, crs: object = None, nodata: float | None = None
    ) -> Grid:
        """The grid of a raster of rasterio, GDAL or a world file.

        Parameters
        ----------
        transform : affine.Affine, or six numbers (a, b, c, d, e, f)
            x = a column + b row + c and y = d column + e row + f, from corners of pixels: rasterio's `src.transform`.
            GDAL's `GetGeoTransform()` has them in another order: (c, a, b, f, d, e).
        size : (width, height), pixels
            rasterio's `src.width, src.height`.
        crs, nodata
            As for `Grid`; `Grid.like` takes all of it from a dataset.

        Raises
        ------
        ValueError
            If the grid is turned, sheared or mirrored (b or d is not 0, or a is not positive).
        TypeError
            If these are no numbers.

        Examples
        --------
        >>> Grid.from_transform((0.5, 0.0, 500000.0, 0.0, -0.5, 11.0), (4, 2))
        Grid(size=(4, 2), extent=(500000.0, 500002.0, 10.0, 11.0), y='up')
        """
        numbers = as_real("transform", transform).ravel()
        if len(numbers) not in (6, 9) or not np.isfinite(numbers).all():
            raise ValueError(f"transform must be six finite numbers (a, b, c, d, e, f), got {shown(transform)}")
        a, b, c, d, e, f = numbers[:6].tolist()
        if b or d or a <= 0 or e == 0:
            raise ValueError(
                f"transform must neither turn nor mirror: b = d = 0, a > 0, e not 0, got {(a, b, c, d, e, f)}"
            )
        width, height = as_size(size, smallest=1)
        y_first, y_last = f, f + e * height
        extent = (c, c + a * width, min(y_first, y_last), max(y_first, y_last))
        return cls((width, height), extent, "up" if e < 0 else "down", crs, nodata)

    @property
    def transform(self) -> tuple[float, float, float, float, float, float]:
        """(a, b, c, d, e, f) as `from_transform` takes it: ``affine.Affine(*grid.transform)`` for rasterio."""
        x_min, _, y_min, y_max = self.extent
        a, e = self.pixel_size
        return (a, 0.0, x_min, 0.0, -e, y_max) if self.y == "up" else (a, 0.0, x_min, 0.0, e, y_min)

    def to_xarray(self, array: npt.ArrayLike, name: str | None = None) -> Any:
        """An `xarray.DataArray` of an array (H, W) or (H, W, C) of this grid, with coordinates, CRS and no data.

        rioxarray reads them (``array.rio.crs``) and writes them to files (``array.rio.to_raster``).

        Raises
        ------
        ValueError
            If the array has another shape.
        MissingPackageError
            If xarray is not installed.
        """
        own = array if hasattr(array, "shape") else as_array("array", array)
        if own.shape[:2] != self.size[::-1] or len(own.shape) not in (2, 3):
            raise ValueError(f"array must have shape {self.size[::-1]} or one with channels, got {own.shape}")
        return data_array(own, name, self.x_centers, self.y_centers, self.transform, self.crs, self.nodata)

    @property
    def pixel_size(self) -> tuple[float, float]:
        """Width and height of a pixel, data units."""
        x_min, x_max, y_min, y_max = self.extent
        width, height = self.size
        return (x_max - x_min) / max(width, 1), (y_max - y_min) / max(height, 1)

    @property
    def x_centers(self) -> F64:
        """The x (W,) of the middle of each column."""
        return np.add(self.extent[0], (np.arange(self.size[0]) + 0.5) * self.pixel_size[0], dtype=np.float64)

    @property
    def y_centers(self) -> F64:
        """The y (H,) of the middle of each row."""
        steps = (np.arange(self.size[1]) + 0.5) * self.pixel_size[1]
        first, sign = (self.extent[3], -1) if self.y == "up" else (self.extent[2], 1)
        return np.add(first, sign * steps, dtype=np.float64)

    def to_pixels(self, points: npt.NDArray[Any]) -> F64:
        """Pixels (N, 2) float64, x right and y down the picture, of the x and y of points (N, 2 or more).

        Notes
        -----
        The difference to the side of the extent is taken first and in float64, so coordinates may be large: the result
        has three roundings of 2**-53 each, relative to itself, besides the one of the data.
        """
        points = as_array("points", points)
        if points.dtype.kind not in "fiu":
            raise TypeError(f"points must be real numbers, got {shown(points)}")
        if points.ndim != 2 or points.shape[1] < 2:
            raise ValueError(f"points must have shape (N, 2) or more columns, got {points.shape}")
        width, height = self.size
        x_min, x_max, y_min, y_max = self.extent
        pixels = np.empty((len(points), 2))
        np.multiply(np.subtract(points[:, 0], x_min, dtype=np.float64), width / (x_max - x_min), out=pixels[:, 0])
        ends = (points[:, 1], y_min) if self.y == "down" else (y_max, points[:, 1])
        from_top = np.subtract(*ends, dtype=np.float64)  # points may be float16 or float32
        np.multiply(from_top, height / (y_max - y_min), out=pixels[:, 1])
        return pixels


def extent_around(subject: Any) -> Extent:
    """The box round the triangles of a mesh."""
    pair = subject
    if hasattr(subject, "vertices") and hasattr(subject, "triangles"):
        pair = subject.vertices, subject.triangles
    if not (isinstance(pair, tuple | list) and len(pair) == 2):
        raise TypeError(f"subject must be a Mesh or (points, triangles), got {type(subject).__name__}")
    points = as_plane_points("points", pair[0])
    return extent_of(points, as_checked_triangles(pair[1], len(points)))


def extent_of(points: npt.NDArray[Any], corners: I32) -> Extent:
    """The box round the points that triangles use."""
    if not len(corners):
        raise ValueError("a mesh without triangles has no extent")
    x, y = points[:, 0][corners], points[:, 1][corners]  # by column: NumPy is slow along short rows
    return float(x.min()), float(x.max()), float(y.min()), float(y.max())


def grid_around(
    extent: ExtentLike, size: int | tuple[int, int] | None, pixel_size: float | tuple[float, float] | None, y: YOption
) -> Grid:
    """The grid over an extent, of so many pixels or of pixels so large; see `Grid.around`."""
    if (size is None) == (pixel_size is None):
        raise ValueError("a grid needs either size or pixel_size")
    if pixel_size is None:
        return Grid(as_size(size), extent, y)
    x_min, x_max, y_min, y_max = Grid((1, 1), extent, y).extent
    step = as_real("pixel_size", pixel_size)
    if step.shape not in ((), (2,)):
        raise ValueError(f"pixel_size must be one number or two, got {shown(pixel_size)}")
    step = np.broadcast_to(step, 2)
    if not (np.isfinite(step).all() and (step > 0).all()):
        raise ValueError(f"pixel_size must be positive, got {pixel_size}")
    # A box of 3.0000000000000004 pixels, after the roundings of its sides, has three.
    with np.errstate(over="ignore"):
        counts = np.maximum(np.ceil(np.array([x_max - x_min, y_max - y_min]) / step - 1e-9), 1)
    if not np.isfinite(counts).all():
        raise ValueError(f"pixel_size must give a grid of countable pixels, got {pixel_size} for {extent}")
    width, height = as_size((int(counts[0]), int(counts[1])))
    return Grid((width, height), (x_min, x_min + width * step[0], y_min, y_min + height * step[1]), y)
