"""Where rasters lie on the earth: coordinate reference systems, the frames of rasters of others, tags of GeoTIFF.

Input: names and objects of rasterio, xarray and pyproj. Output: text, numbers, points.

Based on: Open Geospatial Consortium, "OGC GeoTIFF Standard", version 1.1, 2019.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from topleft._core.base.array_types import F64, Array
from topleft._core.base.arrays import shown
from topleft._core.base.tiff import Tags
from topleft.errors import MissingPackageError

Six = tuple[float, float, float, float, float, float]

WGS84 = "EPSG:4326"

IS_GEOGRAPHIC = {4326: True, 3857: False}
"""Codes that need no pyproj."""

DIMENSIONS = ({"x", "lon", "longitude", "easting", "projection_x_coordinate"},
              {"y", "lat", "latitude", "northing", "projection_y_coordinate"})  # fmt: skip
"""Names that xarray's coordinates have."""


def crs_text(crs: Any) -> str | None:
    """A CRS as text: that of rasterio, pyproj, geopandas, an EPSG code, a name or WKT."""
    if crs is None or isinstance(crs, str):
        return f"EPSG:{crs}" if crs and crs.isdecimal() else crs or None
    if isinstance(crs, int) and not isinstance(crs, bool):
        return f"EPSG:{crs}"
    for name in ("to_string", "to_wkt"):
        if callable(getattr(crs, name, None)):
            return str(getattr(crs, name)()) or None
    raise TypeError(f"crs must be an EPSG code, a name or an object of pyproj or rasterio, got {shown(crs)}")


def is_same_crs(one: str, other: str) -> bool:
    """Whether two names mean an equal CRS; pyproj decides where they differ."""
    if one.casefold() == other.casefold():
        return True
    pyproj = _pyproj("comparing two CRS")
    known, of_other = _known(pyproj, one), _known(pyproj, other)
    return bool(known.equals(of_other, ignore_axis_order=True))


def transformed(points: Array, own: str, crs: str) -> F64:
    """Points (N, 2), x before y, from a CRS to another CRS."""
    pyproj = _pyproj("another CRS")
    change = pyproj.Transformer.from_crs(_known(pyproj, own), _known(pyproj, crs), always_xy=True)
    there = np.column_stack(change.transform(points[:, 0], points[:, 1]))
    is_lost = ~np.isfinite(there).all(axis=1)
    if is_lost.any():
        at = int(np.argmax(is_lost))
        raise ValueError(f"{crs} has no place for point {at}, {points[at].tolist()} of {own}")
    return there


def _pyproj(what: str) -> Any:
    try:
        import pyproj
    except ImportError:
        raise MissingPackageError(f"{what} needs the package pyproj: pip install pyproj") from None
    return pyproj


def _known(pyproj: Any, crs: str | int) -> Any:
    try:
        return pyproj.CRS.from_user_input(crs)
    except (pyproj.exceptions.CRSError, TypeError, ValueError) as error:
        raise ValueError(f"crs must be one that pyproj knows, 'EPSG:25832', say, got {shown(crs)} ({error})") from None


def epsg_of(crs: str | int) -> tuple[int, bool]:
    """The EPSG code of a CRS, and whether it is geographic."""
    match = re.fullmatch(r"(?:EPSG:)?(\d+)", str(crs), re.IGNORECASE)
    if match and int(match[1]) in IS_GEOGRAPHIC:
        return int(match[1]), IS_GEOGRAPHIC[int(match[1])]
    found = _known(_pyproj("crs"), crs)
    code = found.to_epsg()
    if code is None or code > 65535 or not (found.is_projected or found.is_geographic):
        raise ValueError(f"crs must be projected or geographic and have an EPSG code up to 65535, got {shown(crs)}")
    return int(code), bool(found.is_geographic)


def geo_tags(crs: str | int | None, transform: Six) -> Tags:
    """The tags that say where a raster lies: size of pixels, corner, kind and EPSG code of the CRS."""
    keys = [(1025, 1)]  # a pixel is an area
    if crs is not None:
        code, is_geographic = epsg_of(crs)
        keys = [(1024, 2 if is_geographic else 1), *keys, (2048 if is_geographic else 3072, code)]
    words = [1, 1, 1, len(keys), *(number for key, value in keys for number in (key, 0, 1, value))]
    a, _, x, _, e, y = transform
    if e < 0:
        place: Tags = {33550: ("d", [a, -e, 0.0]), 33922: ("d", [0.0, 0.0, 0.0, x, y, 0.0])}
    else:
        place = {34264: ("d", [a, 0.0, 0.0, x, 0.0, e, 0.0, y, *([0.0] * 7), 1.0])}
    return {**place, 34735: ("H", words)}


def nodata_tag(nodata: float) -> tuple[str, bytes]:
    """The text of GDAL's tag of no data, 42113."""
    number = np.asarray(nodata).item()  # a whole number of 64 bits keeps its digits
    text = repr(int(number)) if np.isfinite(number) and number == int(number) else repr(number)
    return "s", text.encode() + b"\0"


def frame_of_raster(raster: Any) -> tuple[Sequence[float], tuple[int, int], str | None, float | None]:
    """The transform, the size, the CRS and the number of no data of a raster; of anything else a `TypeError`.

    `raster` is an open dataset of rasterio, a DataArray or Dataset of xarray with evenly spaced coordinates, or a file,
    which needs rasterio.
    """
    if isinstance(raster, str | os.PathLike):
        try:
            import rasterio
        except ImportError:
            raise MissingPackageError("Grid.like of a file needs the package rasterio: pip install rasterio") from None
        try:
            dataset = rasterio.open(raster)
        except OSError as error:
            raise OSError(f"like cannot open {shown(raster)}: {error}") from None
        with dataset:
            return frame_of_raster(dataset)
    if hasattr(raster, "transform") and hasattr(raster, "width") and hasattr(raster, "height"):  # of rasterio
        nodata = getattr(raster, "nodata", None)
        return raster.transform[:6], (raster.width, raster.height), crs_text(getattr(raster, "crs", None)), nodata
    if hasattr(raster, "coords") and hasattr(raster, "sizes"):  # of xarray
        return _frame_of_coordinates(raster)
    raise TypeError(
        f"like takes a dataset of rasterio, an array of xarray or the path of a raster, got {shown(raster)}"
    )


def _frame_of_coordinates(array: Any) -> tuple[Sequence[float], tuple[int, int], str | None, float | None]:
    named = [next((name for name in array.coords if str(name).casefold() in known), None) for known in DIMENSIONS]
    if None in named:
        raise ValueError(f"like needs coordinates x and y, or lon and lat, got {', '.join(map(str, array.coords))}")
    (x_first, x_step, width), (y_first, y_step, height) = (_evenly(array.coords[name], name) for name in named)
    six = x_step, 0.0, x_first - x_step / 2, 0.0, y_step, y_first - y_step / 2
    numbers = numbers_without_data(array)
    return six, (width, height), _crs_of_coordinates(array), numbers[0] if numbers else None


def _evenly(values: Any, name: object) -> tuple[float, float, int]:
    """The first of evenly spaced numbers, their distance, and how many there are."""
    numbers = np.asarray(values, np.float64)
    if numbers.ndim != 1 or len(numbers) < 2:
        raise ValueError(f"coordinate {name} must have at least two numbers in one dimension, got {numbers.shape}")
    step = (numbers[-1] - numbers[0]) / (len(numbers) - 1)
    off = np.abs(numbers - (numbers[0] + step * np.arange(len(numbers)))).max()
    if not off <= 1e-3 * abs(step):
        raise ValueError(f"coordinate {name} must be evenly spaced, it is off by up to {off:g} of a step of {step:g}")
    return float(numbers[0]), float(step), len(numbers)


def _crs_of_coordinates(array: Any) -> str | None:
    mapping = {**getattr(array, "attrs", {}), **getattr(array, "encoding", {})}.get("grid_mapping", "spatial_ref")
    said = array.coords[mapping].attrs if mapping in array.coords else {}
    found = next((said[name] for name in ("spatial_ref", "crs_wkt") if said.get(name)), None)
    text = crs_text(found if found is not None else array.attrs.get("crs"))
    code = re.search(r"""(?:AUTHORITY|ID)\["EPSG",\s*"?(\d+)"?\]\s*\]$""", text or "")  # WKT ends with its own code
    return f"EPSG:{code[1]}" if code else text


def check_rows_along_y(raster: Any) -> None:
    """Raise a `ValueError` for a raster of xarray whose names of dimensions put x before y."""
    names = getattr(raster, "dims", ())
    dims = [str(name).casefold() for name in names] if isinstance(names, tuple) else []
    x, y = (next((i for i, name in enumerate(dims) if name in known), None) for known in DIMENSIONS)
    if x is not None and y is not None and x < y:
        raise ValueError(f"raster must have its rows along {names[y]}, got dimensions {names}: transpose it")


def check_centers(raster: Any, centers: tuple[F64, F64], pixel_size: tuple[float, float]) -> None:
    """Raise a `ValueError` for a raster with centres of columns or rows a twentieth of a pixel or more from these.

    `raster`: a dataset of rasterio, or a DataArray of xarray. One that says not where it lies passes.
    """
    own: list[Any] = [None, None]
    if hasattr(raster, "transform") and hasattr(raster, "width"):  # of rasterio
        a, b, c, d, e, f = raster.transform[:6]
        if b or d:
            raise ValueError(f"raster must lie on the grid of the table, got one that is turned: {a, b, c, d, e, f}")
        if (a, c, e, f) != (1, 0, 1, 0):  # which means that it has none
            own = [c + a * (np.arange(raster.width) + 0.5), f + e * (np.arange(raster.height) + 0.5)]
    elif isinstance(getattr(raster, "dims", None), tuple) and hasattr(raster, "coords"):
        names = [next((n for n in raster.dims if str(n).casefold() in known), None) for known in DIMENSIONS]
        own = [None if name not in raster.coords else np.asarray(raster.coords[name]) for name in names]
    for what, found, wanted, step in zip(("columns", "rows"), own, centers, pixel_size, strict=True):
        if found is not None and found.dtype.kind in "iuf" and not (np.abs(found - wanted) < step / 20).all():
            raise ValueError(
                f"raster must lie on the grid of the table: its {what} have centres from {found[0]:.10g} to "
                f"{found[-1]:.10g}, the grid from {wanted[0]:.10g} to {wanted[-1]:.10g}"
            )


def numbers_without_data(raster: Any) -> list[float]:
    """Return the numbers that stand for no data in a raster of xarray."""
    said = getattr(raster, "attrs", None)
    if not isinstance(said, Mapping):
        return []
    found = [said[name] for name in ("_FillValue", "missing_value", "nodata", "nodatavals") if name in said]
    numbers = np.concatenate([np.ravel(number) for number in found]) if found else np.empty(0)
    return numbers.tolist() if numbers.dtype.kind in "iuf" else []


def data_array(array: Any, name: str | None, x: F64, y: F64, transform: Six, crs: str | None, nodata: Any) -> Any:
    """An `xarray.DataArray` on the centres of pixels; rioxarray reads its CRS, transform and no data."""
    xr = xarray_module()
    a, b, c, d, e, f = transform
    attributes = {"GeoTransform": " ".join(map(repr, (c, a, b, f, d, e)))}
    attributes |= {} if crs is None else {"spatial_ref": crs}
    coordinates = {"y": y, "x": x, "spatial_ref": ((), 0, attributes)}
    own = {} if nodata is None else {"nodata": nodata, "_FillValue": nodata}
    dims = ["y", "x", "channel"][: array.ndim]
    found = xr.DataArray(array, dims=dims, coords=coordinates, name=name, attrs=own)
    found.encoding["grid_mapping"] = "spatial_ref"
    return found


def xarray_module() -> Any:
    """Import xarray."""
    try:
        import xarray
    except ImportError:
        raise MissingPackageError("to_xarray needs the package xarray: pip install xarray") from None
    return xarray
