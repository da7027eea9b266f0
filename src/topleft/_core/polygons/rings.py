"""Converts the caller's polygons to points and offsets.

In: arrays, lists of rings, offset arrays, flat COCO lists, `__geo_interface__`, shapely geometries. Out: `RingSet`.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.array_types import I64
from topleft._core.base.arrays import apart_from, as_aligned, as_array, check_real, set_aligned

LOWER_KINDS = ("Point", "MultiPoint", "LineString", "MultiLineString", "LinearRing")
"""Geometries that cover no area."""


@dataclass(frozen=True)
class RingSet:
    """Polygon i has the rings `[polygons[i], polygons[i + 1])`, ring k the points `[rings[k], rings[k + 1])`."""

    points: npt.NDArray[Any]  # (N, 2), contiguous float32, float64 or int64
    rings: I64
    polygons: I64
    unions: npt.NDArray[np.uint8] | None = None
    """(P,) 1 for a polygon of parts that overlap: borders run one way and holes the other, and a point is inside where
    the winding number is not 0. None: there is no such polygon."""

    __setstate__ = set_aligned

    def __len__(self) -> int:
        return len(self.polygons) - 1

    def part(self, first: int, end: int) -> RingSet:
        """Return polygons [first, end)."""
        rings = self.rings[self.polygons[first] : self.polygons[end] + 1]
        polygons = self.polygons[first : end + 1]
        unions = None if self.unions is None else self.unions[first:end]
        return RingSet(self.points[rings[0] : rings[-1]], rings - rings[0], polygons - polygons[0], unions)

    def apart_from(self, out: object) -> RingSet:
        """Return the polygons with copies of the arrays that `out` may share memory with."""
        overlap = np.may_share_memory
        if out is None or (
            isinstance(out, np.ndarray)
            and not (overlap(self.points, out) or overlap(self.rings, out) or overlap(self.polygons, out))
        ):
            return self
        points, rings, polygons = (
            np.asarray(apart_from(out, "rings", each)) for each in (self.points, self.rings, self.polygons)
        )
        return RingSet(points, rings, polygons, self.unions)


def as_rings(values: Any) -> RingSet:
    """Return polygons as points and offsets."""
    if isinstance(values, RingSet):
        return values
    values = _without_tensors(values)
    rings = _from_offsets(values)
    if rings is not None:
        return _bounded(rings)
    rings = _from_shapely(values)
    if rings is None:
        values = values.to_numpy() if hasattr(values, "to_numpy") else values
        if _is_geometry(values):
            parts = [list(_parts_of_geometry(geometry)) for geometry in _geometries(values)]
            rings = united(_join([*chain.from_iterable(parts)]), np.cumsum([0, *map(len, parts)]))
        else:
            rings = _join(_nested(values))
    return _checked(rings)


def united(parts: RingSet, geometries: I64) -> RingSet:
    """Return polygons of several parts each, those of polygon i `[geometries[i], geometries[i + 1])`.

    Rings of parts with boxes that overlap are turned: the first one of a part, its border, one way, holes the other.
    """
    n_parts, starts = np.diff(geometries), parts.rings[parts.polygons]
    joined = RingSet(parts.points, parts.rings, parts.polygons[geometries])
    is_some = starts[:-1] < starts[1:]
    owners = np.repeat(np.arange(len(n_parts)), n_parts)
    which = np.flatnonzero(is_some & (n_parts > 1)[owners])
    if not len(which):
        return joined
    low, high = (np.full((len(owners), 2), np.nan) for _ in range(2))
    low[is_some], high[is_some] = (f.reduceat(parts.points, starts[:-1][is_some]) for f in (np.minimum, np.maximum))
    unions, order = np.zeros(len(n_parts), np.uint8), which[np.lexsort((low[which, 0], owners[which]))]
    for step in range(1, len(which)):
        order = order[unions[owners[order]] == 0]
        one, other = order[:-step], order[step:]
        is_near = (owners[one] == owners[other]) & (low[other, 0] < high[one, 0])
        one, other = one[is_near], other[is_near]
        if not len(one):
            break
        is_met = (low[other, 1] < high[one, 1]) & (low[one, 1] < high[other, 1])
        unions[owners[one[is_met]]] = 1
    if not unions.any():
        return joined
    points = parts.points.copy()
    for part in which[unions[owners[which]] == 1].tolist():
        for ring in range(parts.polygons[part], parts.polygons[part + 1]):
            own = points[parts.rings[ring] : parts.rings[ring + 1]]
            x, y = (own[:, :2] - own[:1, :2].astype(np.float64)).T
            is_positive = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) > 0
            if is_positive != (ring == parts.polygons[part]):
                own[:] = own[::-1].copy()
    return RingSet(points, joined.rings, joined.polygons, unions)


def rings_of_triangles(points: npt.NDArray[Any], triangles: npt.NDArray[np.int32]) -> RingSet:
    """Return the triangles as polygons of three points."""
    offsets = np.arange(0, 3 * len(triangles) + 1, 3, dtype=np.int64)
    corners = as_points(points, "vertices")[np.asarray(triangles).reshape(-1)]
    return RingSet(corners, offsets, np.arange(len(triangles) + 1, dtype=np.int64))


def as_points(values: Any, name: str) -> npt.NDArray[Any]:
    """Return (N, 2) points as a contiguous float32, float64 or int64 array."""
    array = as_array(name, values)
    if array.size == 0:
        return np.empty((0, 2))
    check_real(name, array)
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"{name} must have shape (N, 2), got {array.shape}")
    if array.dtype.kind == "u" and array.dtype.itemsize == 8:
        array = np.minimum(array, np.uint64(2**63 - 1))  # out of range either way
    single = array.dtype.kind == "f" and array.dtype.itemsize <= 4
    dtype = np.int64 if array.dtype.kind in "iu" else np.float32 if single else np.float64
    array = np.ascontiguousarray(array, dtype)
    return as_aligned(array)


def _without_tensors(values: Any) -> Any:
    """Convert arrays of other libraries to NumPy arrays, and contours of OpenCV (N, 1, 2) to rings, alone or in lists.

    Tests the first element of each list.
    """
    if isinstance(values, (list, tuple)):
        if not _has_tensors(values):
            return values
        return [*map(_without_tensors, values)] if isinstance(values, list) else (*map(_without_tensors, values),)
    if not _is_tensor(values):
        return values
    array = as_array("rings", values)
    return array[:, 0] if array.shape[1:] == (1, 2) else array


def _is_tensor(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.shape[1:] == (1, 2)  # a contour of OpenCV
    if isinstance(value, np.generic) or hasattr(value, "to_numpy") or hasattr(value, "__geo_interface__"):
        return False
    return hasattr(value, "__dlpack__") or hasattr(value, "__array__")


def _has_tensors(values: Any) -> bool:
    if isinstance(values, (list, tuple)):
        return bool(len(values)) and _has_tensors(values[0])
    return _is_tensor(values)


def _from_offsets(values: Any) -> RingSet | None:
    """Return the rings of (coordinates, ring_offsets[, polygon_offsets]) or `shapely.to_ragged_array`; else None."""
    if not isinstance(values, tuple) or not 2 <= len(values) <= 3:
        return None
    if len(values) == 3 and isinstance(values[2], tuple) and isinstance(values[0], int):
        return _from_ragged(np.asarray(values[1]), values[2])
    if np.ndim(values[0]) != 2 or np.ndim(values[1]) != 1 or np.ndim(values[-1]) != 1:
        return None
    points = as_points(values[0], "coordinates")
    rings = _as_offsets(values[1], "ring_offsets", len(points), "coordinates")
    if len(values) == 2:
        return RingSet(points, rings, np.array([0, len(rings) - 1], np.int64))
    return RingSet(points, rings, _as_offsets(values[2], "polygon_offsets", len(rings) - 1, "rings"))


def _as_offsets(values: Any, name: str, n: int, of: str) -> I64:
    offsets = as_array(name, values)
    if offsets.dtype.kind not in "iu":
        raise TypeError(f"{name} must be integers, got dtype {offsets.dtype}")
    if offsets.ndim != 1 or len(offsets) < 1:
        raise ValueError(f"{name} must have shape (n + 1,), got {offsets.shape}")
    offsets = np.array(offsets, np.int64)  # a copy: the caller's array may change after the check
    steps = offsets[1:] - offsets[:-1]
    least = np.minimum.reduce(steps, initial=3)
    if offsets[0] != 0 or offsets[-1] != n or least < 0:
        raise ValueError(f"{name} must rise from 0 to the number of {of}, {n}; got {_short(offsets)}")
    if least < 3 and name == "ring_offsets":
        raise _too_few(steps)
    return offsets


def _short(offsets: I64) -> str:
    if len(offsets) <= 6:
        return str(offsets.tolist())
    return f"{', '.join(map(str, offsets[:3].tolist()))}, ..., {', '.join(map(str, offsets[-2:].tolist()))}"


def _from_ragged(coordinates: npt.NDArray[Any], offsets: Sequence[Any]) -> RingSet:
    """Return `shapely.to_ragged_array`: polygons (rings, geometries) or multipolygons (rings, parts, geometries)."""
    if len(offsets) not in (2, 3):
        raise TypeError(f"shapely geometries must be polygons or multipolygons, got {len(offsets)} levels of offsets")
    points = as_points(coordinates[:, :2] if coordinates.ndim == 2 else coordinates, "coordinates")
    rings = _as_offsets(offsets[0], "ring_offsets", len(points), "coordinates")
    parts = _as_offsets(offsets[1], "polygon_offsets", len(rings) - 1, "rings")
    if len(offsets) == 3:
        geometries = _as_offsets(offsets[2], "geometry_offsets", len(parts) - 1, "polygons")
        return united(RingSet(points, rings, parts), geometries)
    return RingSet(points, rings, parts)


def _from_shapely(values: Any) -> RingSet | None:
    """Return shapely geometries, a geometry, a sequence or a GeoSeries; None for other values. Imports nothing."""
    shapely: Any = sys.modules.get("shapely")
    if shapely is None:
        return None
    if (
        hasattr(values, "geometry")
        and not isinstance(values, shapely.Geometry)
        and hasattr(values.geometry, "to_numpy")
    ):
        values = values.geometry  # a GeoDataFrame
    if isinstance(values, shapely.Geometry):
        values = [values]
    elif hasattr(values, "to_numpy"):
        values = values.to_numpy()
    if not isinstance(values, (list, tuple, np.ndarray)) or (isinstance(values, np.ndarray) and not values.ndim):
        return None
    if not isinstance(next((value for value in values if value is not None), None), shapely.Geometry):
        return None
    geometries = np.array(values, dtype=object)
    geometries[shapely.is_missing(geometries)] = shapely.Polygon()  # as a GeoJSON feature without a geometry
    for i in np.flatnonzero(shapely.get_type_id(geometries) == shapely.GeometryType.GEOMETRYCOLLECTION).tolist():
        parts = shapely.get_parts(geometries[i])
        while (shapely.get_type_id(parts) >= shapely.GeometryType.MULTIPOINT).any():  # collections in collections
            parts = shapely.get_parts(parts)
        is_area = shapely.get_type_id(parts) == shapely.GeometryType.POLYGON
        _tell_of({part.geom_type for part in parts[~is_area].tolist()})
        geometries[i] = shapely.MultiPolygon(parts[is_area].tolist())
    kinds = np.unique(shapely.get_type_id(geometries))
    if not set(kinds.tolist()) <= {3, 6}:
        names = sorted({g.geom_type for g in geometries.tolist() if g is not None} - {"Polygon", "MultiPolygon"})
        raise TypeError(f"shapely geometries must be polygons or multipolygons, got {', '.join(names) or 'None'}")
    _, coordinates, offsets = shapely.to_ragged_array(geometries)
    return _from_ragged(coordinates, offsets)


def _is_geometry(values: Any) -> bool:
    if isinstance(values, (list, tuple)) and len(values):
        values = values[0]
    return isinstance(values, dict) or hasattr(values, "__geo_interface__")


def _geometries(values: Any) -> list[Any]:
    """Return a GeoJSON geometry for each polygon: of features, collections, objects with `__geo_interface__`."""
    if isinstance(values, (list, tuple)):
        return [g for value in values for g in _geometries(value)]
    values = getattr(values, "__geo_interface__", values)
    if isinstance(values, dict) and values.get("type") == "FeatureCollection":
        return [feature.get("geometry") for feature in _member(values, "features")]
    return [values]


def _parts_of_geometry(geometry: Any, *, is_member: bool = False) -> Iterator[list[Any]]:
    """Yield the rings of each part of a GeoJSON geometry; of a member of a collection only if it is an area."""
    if geometry is None:
        return
    kind = geometry.get("type") if isinstance(geometry, dict) else type(geometry).__name__
    if kind == "Feature":
        yield from _parts_of_geometry(geometry.get("geometry"))
    elif kind == "GeometryCollection":
        for part in _member(geometry, "geometries"):
            yield from _parts_of_geometry(part, is_member=True)
    elif kind in ("Polygon", "MultiPolygon"):
        areas = _member(geometry, "coordinates")
        for rings in [areas] if kind == "Polygon" else areas:
            yield [[(p[0], p[1]) for p in ring] for ring in rings]
    elif is_member and kind in LOWER_KINDS:
        _tell_of({kind})
    else:
        raise TypeError(f"geometries must be Polygon or MultiPolygon, got {kind}")


def _tell_of(kinds: set[str]) -> None:
    """Warn of members of a collection that cover nothing."""
    if kinds:
        message = f"polygons leave out {', '.join(sorted(kinds))} in a GeometryCollection: they cover no area"
        warnings.warn(message, stacklevel=2)


def _member(geometry: Any, key: str) -> Any:
    try:
        return geometry[key]
    except KeyError:
        raise ValueError(f"a {geometry['type']} of GeoJSON must have {key}, got only {', '.join(geometry)}") from None


def _depth(values: Any) -> int:
    """Return how many levels of lists there are, from the first element of each level."""
    if isinstance(values, np.ndarray):
        return values.ndim
    if isinstance(values, (list, tuple)):
        return 1 + (_depth(values[0]) if len(values) else 0)
    return int(np.ndim(values)) if hasattr(values, "__array__") else 0


def _is_flat(ring: Any) -> bool:
    """Whether a list of numbers is a ring in the form of COCO, x, y, x, y, and no point."""
    return _depth(ring) == 1 and len(ring) != 2


def _nested(values: Any) -> list[list[Any]]:
    """Return lists of rings, one for each polygon, of nested lists and arrays."""
    depth = _depth(values)
    if isinstance(values, (list, tuple)) and not len(values):
        return []
    if depth == 0:
        file = "; geopandas.read_file(path) reads files, json.load GeoJSON" * isinstance(values, str | os.PathLike)
        raise TypeError(
            "rings must be an array (N, 2), a list of rings or of polygons, (coordinates, ring_offsets, "
            f"polygon_offsets), or have __geo_interface__, got {type(values).__name__}{file}"
        )
    if depth == 1:
        return [[_unflat(values)]]
    if depth == 2:
        if isinstance(values, np.ndarray) or not _is_flat(values[0]):
            return [[values]]
        return [[_unflat(ring) for ring in values]]
    if depth == 3:
        if isinstance(values, np.ndarray) or not (
            _depth(values[0]) == 2 and not isinstance(values[0], np.ndarray) and _is_flat(values[0][0])
        ):
            return [list(values)]
        return [[_unflat(ring) for ring in rings] for rings in values]
    return [list(rings) for rings in values]


def _unflat(ring: Any) -> npt.NDArray[Any]:
    numbers = np.asarray(ring)
    if numbers.ndim != 1 or len(numbers) % 2:
        raise ValueError(
            "flat rings must hold x, y, x, y, an even number of numbers, "
            f"got shape {numbers.shape}; a point has x and y alone"
        )
    return numbers.reshape(-1, 2)


def _join(listed: list[list[Any]]) -> RingSet:
    points = [as_points(ring, "rings") for rings in listed for ring in rings]
    lengths = np.array([0, *map(len, points)], np.int64)
    counts = np.array([0, *map(len, listed)], np.int64)
    if len({array.dtype for array in points}) > 1:
        points = [array.astype(np.float64) for array in points]
    joined = np.concatenate(points) if points else np.empty((0, 2))
    return RingSet(joined, np.cumsum(lengths), np.cumsum(counts))


def _checked(rings: RingSet) -> RingSet:
    """Return rings of at least three points each."""
    lengths = rings.rings[1:] - rings.rings[:-1]
    if np.minimum.reduce(lengths, initial=3) < 3:
        raise _too_few(lengths)
    return _bounded(rings)


def _too_few(lengths: I64) -> ValueError:
    k = int(np.argmax(lengths < 3))
    return ValueError(f"rings must have at least 3 points, ring {k} has {lengths[k]}")


def _bounded(rings: RingSet) -> RingSet:
    """Return the rings, or raise an error for more points or rings than int32 can index."""
    if max(len(rings.points), len(rings.rings)) > 2**31 - 1:
        raise ValueError(f"rings must have at most {2**31 - 1} points, got {len(rings.points)}")
    return rings
