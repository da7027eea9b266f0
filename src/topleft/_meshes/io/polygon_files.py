"""Reads polygons from files: GeoJSON, annotations in the format of COCO, and vector files by pyogrio or fiona.

Input: a path. Output: for each picture its polygons, by objects, and the properties of each object.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.georeference import WGS84
from topleft._core.raster.rle import read_counts
from topleft.errors import MeshError, MissingPackageError


@dataclass(frozen=True)
class ObjectRings:
    """Polygons of one object."""

    points: npt.NDArray[np.float64]  # (N, 2)
    lengths: npt.NDArray[np.int64]  # points of each ring
    counts: npt.NDArray[np.int64]  # rings of each polygon


@dataclass(frozen=True)
class PolygonPicture:
    """The polygons of one picture."""

    name: str
    size: tuple[int, int] | None  # pixels; None: the polygons are on a plane, y up
    folder: str = ""  # of the image, as the file has it
    crs: str | None = None  # of the plane, if it is known
    parts: list[ObjectRings] = field(default_factory=list)  # of each object
    objects: list[Mapping[str, Any]] = field(default_factory=list)  # the properties of each
    n_skipped: int = 0  # objects that are no polygons

    def add(self, parts: ObjectRings, said: Mapping[str, Any]) -> None:
        """Add an object of several polygons."""
        self.parts.append(parts)
        self.objects.append(said)

    @property
    def polygons(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Points, where their rings begin and end, and the polygons of these: the input of `polygons`."""
        points = np.concatenate([np.empty((0, 2)), *(part.points for part in self.parts)])
        lengths = np.concatenate([np.zeros(1, np.int64), *(part.lengths for part in self.parts)])
        counts = np.concatenate([np.zeros(1, np.int64), *(part.counts for part in self.parts)])
        return points, np.cumsum(lengths), np.cumsum(counts)

    @property
    def owners(self) -> npt.NDArray[np.int64]:
        """The object that each polygon is of."""
        return np.repeat(np.arange(len(self.parts)), [len(part.counts) for part in self.parts])


VECTOR_SUFFIXES = (".fgb", ".gml", ".gpkg", ".kml", ".parquet", ".shp", ".sqlite")


def load_polygons(
    path: str | os.PathLike[str], *, has_crowds: bool = True, layer: str | None = None
) -> list[PolygonPicture]:
    """Return the polygons of a GeoJSON or a vector file, one picture, or of COCO annotations, one for each image.

    Without `has_crowds` annotations of COCO that are crowds are left out. `layer` is that of a vector file, its first
    one unless given.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        raise MeshError(f"{str(path)!r} is {'a folder' if path.is_dir() else 'a pipe or a device'}, not a file")
    is_vector = path.suffix.lower() in VECTOR_SUFFIXES
    try:
        content = _vector_content(path, layer) if is_vector else json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    try:
        if isinstance(content, dict) and isinstance(content.get("annotations"), list):
            return _coco(content, has_crowds=has_crowds)
        if isinstance(content, dict) and isinstance(content.get("type"), str):
            return [_geojson(content, path.stem)]
    except ContentError as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    except (KeyError, TypeError, AttributeError, IndexError, ValueError, OverflowError) as error:
        raise MeshError(f"cannot read {str(path)!r}: something is missing or of a wrong kind ({error!r})") from None
    raise MeshError(f"cannot read {str(path)!r}: it is neither GeoJSON nor annotations in the format of COCO")


def _vector_content(path: Path, layer: str | None) -> dict[str, Any]:
    """A layer of a vector file in the form of GeoJSON."""
    path.stat()  # raises the same error for a missing file as other formats
    try:
        import pyogrio
        import shapely
    except ImportError:
        return _fiona_content(path, layer)
    try:
        said, _, geometries, columns = pyogrio.raw.read(str(path), layer=layer, force_2d=True)
        shapes = shapely.from_wkb(geometries)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, shapely.errors.ShapelyError) as error:
        raise MeshError(f"cannot read {str(path)!r}: {' '.join(str(error).split())}") from None
    rows = [dict(zip(said["fields"], row, strict=True)) for row in zip(*(c.tolist() for c in columns), strict=True)]
    features = [
        {"type": "Feature", "geometry": shape and shapely.geometry.mapping(shape), "properties": row}
        for shape, row in zip(shapes.tolist(), rows or [{}] * len(shapes), strict=True)
    ]
    return {"type": "FeatureCollection", "features": features, "own crs": said["crs"]}


def _fiona_content(path: Path, layer: str | None) -> dict[str, Any]:
    try:
        import fiona
    except ImportError:
        raise MissingPackageError(f"reading {str(path)!r} needs another package: pip install pyogrio shapely") from None
    try:
        with fiona.open(path, layer=layer) as rows:
            features = [{"type": "Feature", **row.__geo_interface__} for row in rows]
            return {"type": "FeatureCollection", "features": features, "own crs": rows.crs.to_string()}
    except fiona.errors.FionaError as error:
        raise MeshError(f"cannot read {str(path)!r}: {' '.join(str(error).split())}") from None


def _coco(content: Mapping[str, Any], *, has_crowds: bool) -> list[PolygonPicture]:
    images = {image["id"]: image for image in content["images"]}
    if len(images) < len(content["images"]):
        ids = [image["id"] for image in content["images"]]
        raise ContentError(f"{sum(ids.count(i) > 1 for i in images)} ids of images stand more than once")
    names = {category["id"]: category.get("name") for category in content.get("categories", [])}
    found: dict[Any, list[Any]] = {key: [] for key in images}
    for annotation in content["annotations"]:
        if (image_id := annotation["image_id"]) not in found:
            raise ContentError(f"annotation {annotation.get('id')!r} is of image {image_id!r}, which is not there")
        if has_crowds or not annotation.get("iscrowd"):
            found[image_id].append(annotation)
    pictures = []
    for key, image in images.items():
        file_name = str(image.get("file_name") or key)
        if "\0" in file_name or Path(file_name).stem in ("", "..") or ".." in Path(file_name).parts:
            raise ContentError(f"image {key!r} has the file name {file_name!r}, which is none within a folder")
        size = int(image["width"]), int(image["height"])
        drawn = [(a, _coco_parts(a.get("segmentation"), size, a.get("id"))) for a in found[key]]
        folder, n_skipped = Path(file_name).parent.as_posix(), sum(parts is None for _, parts in drawn)
        picture = PolygonPicture(Path(file_name).stem, size, folder, n_skipped=n_skipped)
        for annotation, parts in drawn:
            if parts is not None:
                picture.add(parts, {**annotation, "category": names.get(annotation.get("category_id"))})
        pictures.append(picture)
    return pictures


def _coco_parts(segmentation: Any, size: tuple[int, int], name: object) -> ObjectRings | None:
    """Return the polygons of a segmentation: flat rings, or run lengths; None if it is neither."""
    if isinstance(segmentation, list):
        return _joined([[_pairs(flat)] for flat in segmentation], f"annotation {name}")
    if isinstance(segmentation, dict) and "counts" in segmentation:
        height, width = (int(n) for n in segmentation["size"])
        if (width, height) != size:
            raise ContentError(f"annotation {name} is of {width}x{height} pixels, its image of {size[0]}x{size[1]}")
        counts = segmentation["counts"]
        lengths = _read_counts(counts, name) if isinstance(counts, str) else np.asarray(counts, np.int64).reshape(-1)
        if (lengths < 0).any():
            raise ContentError(f"annotation {name} has a run length of {lengths.min()} pixels")
        if lengths.sum() != width * height:
            raise ContentError(f"annotation {name} has run lengths of {lengths.sum()} pixels, not {width * height}")
        return _rectangles(lengths, height)
    return None


class ContentError(ValueError):
    """A contradiction in a file."""


def _read_counts(text: str, name: object) -> npt.NDArray[np.int64]:
    """Return run lengths from a string, as pycocotools writes it."""
    try:
        return read_counts(text)
    except ValueError as error:
        raise ContentError(f"annotation {name} has {error}") from None


def _rectangles(lengths: npt.NDArray[np.int64], height: int) -> ObjectRings:
    """Return the pixels of run lengths as rectangles, a polygon each.

    Runs go down columns, the first of pixels outside; neighbours of the same rows become one rectangle.
    """
    ends = np.cumsum(lengths)
    first, end = (ends - lengths)[1::2], ends[1::2]
    first, end = first[first < end], end[first < end]
    (column, top), (last, bottom) = np.divmod(first, height), np.divmod(end, height)
    is_whole = top == 0
    begins = np.stack([column, column + ~is_whole, last], axis=1)  # the rest of a column, whole ones, the top of one
    stops = np.stack([column + ~is_whole, last, last + (bottom > 0)], axis=1)
    tops = np.stack([top, 0 * top, 0 * top], axis=1)
    bottoms = np.stack([np.where(column == last, bottom, height), 0 * top + height, bottom], axis=1)
    stops[:, 2] = np.where((column == last) & ~is_whole, begins[:, 2], stops[:, 2])
    is_some = (begins < stops).reshape(-1)
    left, right, y0, y1 = (edge.reshape(-1)[is_some] for edge in (begins, stops, tops, bottoms))
    is_new = np.ones(len(left), np.bool_)
    is_new[1:] = (left[1:] != right[:-1]) | (y0[1:] != y0[:-1]) | (y1[1:] != y1[:-1])
    right = right[np.append(is_new[1:], np.ones(min(1, len(left)), np.bool_))]
    left, y0, y1 = left[is_new], y0[is_new], y1[is_new]
    corners = np.stack([left, y0, right, y0, right, y1, left, y1], axis=1).reshape(-1, 2)
    return ObjectRings(corners.astype(np.float64), np.full(len(left), 4), np.ones(len(left), np.int64))


def _pairs(flat: list[float]) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in zip(flat[::2], flat[1::2], strict=True)]


def _joined(polygons: list[list[list[tuple[float, float]]]], what: str) -> ObjectRings:
    """Return polygons from the rings of each."""
    rings = list(chain.from_iterable(polygons))
    points = np.array(list(chain.from_iterable(rings)), np.float64).reshape(-1, 2)
    if not np.isfinite(points).all():
        raise ContentError(f"{what} has a coordinate of {points[~np.isfinite(points)][0]}")
    lengths, counts = (np.array([len(one) for one in of], np.int64) for of in (rings, polygons))
    return ObjectRings(points, lengths, counts)


def _geojson(content: Mapping[str, Any], name: str) -> PolygonPicture:
    features = content["features"] if content["type"] == "FeatureCollection" else [content]
    picture = PolygonPicture(name, None)
    n_skipped = 0
    for i, feature in enumerate(features):
        is_feature = feature["type"] == "Feature"
        geometry = feature["geometry"] if is_feature else feature
        parts = list(_parts(geometry)) if geometry else []
        if parts:
            said = {**(feature.get("properties") or {}), "id": feature.get("id")} if is_feature else {}
            picture.add(_joined(parts, f"feature {i}"), said)
        else:
            n_skipped += 1
    return replace(picture, n_skipped=n_skipped, crs=_crs_of(content, picture))


def _crs_of(content: Mapping[str, Any], picture: PolygonPicture) -> str | None:
    """The CRS of a vector file, or of GeoJSON: the one it names, as old files do, or degrees of WGS84 if it can be."""
    if "own crs" in content:
        return content["own crs"] or None
    named = (content.get("crs") or {}).get("properties", {}).get("name")
    if named is not None:
        return WGS84 if str(named).upper().endswith("CRS84") else str(named)
    points = np.abs(picture.polygons[0])
    return WGS84 if (points <= (180, 90)).all() else None


def _parts(geometry: Mapping[str, Any]) -> Iterator[list[Any]]:
    """Yield the rings of each polygon."""
    if geometry["type"] == "GeometryCollection":
        for part in geometry["geometries"]:
            yield from _parts(part)
    elif geometry["type"] in ("Polygon", "MultiPolygon"):
        polygons = geometry["coordinates"] if geometry["type"] == "MultiPolygon" else [geometry["coordinates"]]
        for rings in polygons:
            yield [[(float(p[0]), float(p[1])) for p in ring] for ring in rings]
