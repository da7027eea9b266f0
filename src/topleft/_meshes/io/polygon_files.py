"""Reads polygons from files: GeoJSON, annotations in the format of COCO, and vector files by pyogrio or fiona.

Input: a path. Output: for each picture its polygons, by objects, and the properties of each object. An object that
cannot be read keeps its place, without polygons, and is told.
"""

from __future__ import annotations

import json
import os
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._core.base.arrays import as_path
from topleft._core.base.georeference import WGS84
from topleft._core.base.notes import Notes, tell
from topleft._core.polygons.rings import LOWER_KINDS, RingSet, united
from topleft._core.raster.rle import read_counts
from topleft._meshes.io.limits.archives import is_junk
from topleft.errors import MeshError, MissingPackageError

BROKEN = (KeyError, TypeError, AttributeError, IndexError, ValueError, OverflowError)
"""Errors of content in which something is missing or of a wrong kind."""


@dataclass(frozen=True)
class ObjectRings:
    """Polygons of an object."""

    points: npt.NDArray[np.float64]  # (N, 2)
    lengths: npt.NDArray[np.int64]  # points of each ring
    counts: npt.NDArray[np.int64]  # rings of each polygon


NO_RINGS = ObjectRings(np.empty((0, 2)), *np.zeros((2, 0), np.int64))


@dataclass(frozen=True)
class PolygonPicture:
    """The polygons of a picture."""

    name: str
    size: tuple[int, int] | None  # pixels; None: the polygons are on a plane, y up
    folder: str = ""  # of the image, as the file has it
    crs: str | None = None  # of the plane, if it is known
    parts: list[ObjectRings] = field(default_factory=list)  # of each object
    objects: list[Mapping[str, Any]] = field(default_factory=list)  # the properties of each
    annotations: list[Mapping[str, Any]] = field(default_factory=list)  # of each in a file of COCO
    image: Mapping[str, Any] = field(default_factory=dict)  # the entry of COCO
    content: Mapping[str, Any] = field(default_factory=dict)  # the file of COCO

    def add(self, parts: ObjectRings, said: Mapping[str, Any]) -> None:
        """Add an object of several polygons."""
        self.parts.append(parts)
        self.objects.append(said)

    def name_of(self, i: int) -> str:
        """What an object is called in messages: by its id in a file of COCO, else by its place in the file."""
        return f"annotation {self.objects[i].get('id', i)}" if self.annotations else f"feature {i}"

    def values(self, name: str) -> dict[int, Any]:
        """Return a property of each object that has polygons."""
        return {i: self.objects[i].get(name) for i, part in enumerate(self.parts) if len(part.counts)}

    @property
    def polygons(self) -> RingSet:
        """Polygons with the `owners`: a part each of annotations of COCO, all parts of an object on a plane."""
        points = np.concatenate([np.empty((0, 2)), *(part.points for part in self.parts)])
        lengths = np.concatenate([np.zeros(1, np.int64), *(part.lengths for part in self.parts)])
        counts = np.concatenate([np.zeros(1, np.int64), *(part.counts for part in self.parts)])
        found = RingSet(points, np.cumsum(lengths), np.cumsum(counts))
        return found if self.size is not None else united(found, np.cumsum([0, *map(len, self._counts)]))

    @property
    def owners(self) -> npt.NDArray[np.int64]:
        """The object that each polygon is of."""
        n = [1 if self.size is None else len(counts) for counts in self._counts]
        return np.repeat(np.arange(len(self.parts)), n)

    @property
    def _counts(self) -> list[npt.NDArray[np.int64]]:
        return [part.counts for part in self.parts]


VECTOR_SUFFIXES = (".fgb", ".gml", ".gpkg", ".kml", ".parquet", ".shp", ".sqlite", ".zip")
POLYGON_SUFFIXES = (*VECTOR_SUFFIXES, ".geojson", ".geojsonl", ".geojsons", ".json", ".jsonl", ".ndjson")


def load_polygons(
    path: str | os.PathLike[str], *, has_crowds: bool = True, layer: str | None = None, image: str | None = None
) -> list[PolygonPicture]:
    """Return the polygons of a GeoJSON or a vector file, one picture, or of COCO annotations, one for each image.

    Without `has_crowds` annotations of COCO that are crowds are left out. `layer` is that of a vector file, its first
    one unless given. `image` chooses images of COCO by a name, or a folder and a name, without the end.
    """
    path = as_path("path", path)
    if path.exists() and not path.is_file():
        raise MeshError(f"{str(path)!r} is {'a folder' if path.is_dir() else 'a pipe or a device'}, not a file")
    is_vector, notes = path.suffix.lower() in VECTOR_SUFFIXES, Notes(str(path))
    try:
        content = _vector_content(path, layer) if is_vector else _json_content(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    try:
        if isinstance(content, dict) and isinstance(content.get("annotations"), list):
            pictures = _coco(content, notes, has_crowds=has_crowds, chosen=image)
        elif isinstance(content, dict) and isinstance(content.get("type"), str):
            pictures = [_geojson(content, path.stem, notes)] if image in (None, path.stem) else []
        else:
            raise ContentError("it is neither GeoJSON nor annotations in the format of COCO")
    except ContentError as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    except BROKEN as error:
        raise MeshError(f"cannot read {str(path)!r}: something is missing or of a wrong kind ({error!r})") from None
    tell(notes.lines, stacklevel=2)
    return pictures


class ContentError(ValueError):
    """A contradiction in a file, or in an object: then without its name."""


@contextmanager
def leaving_out(what: str, notes: Notes) -> Iterator[None]:
    """Note an object that is broken, in place of an error."""
    try:
        yield
    except BROKEN as error:
        reason = str(error) if isinstance(error, ContentError) else f"is broken ({error!r})"
        notes.add("objects left out", f"{what} {reason}")


def _json_content(text: bytes) -> Any:
    """The content of a JSON file, or of a file with a GeoJSON text on each line or after each record separator."""
    try:
        return json.loads(text)
    except ValueError:
        rows = list(filter(None, map(bytes.strip, text.split(b"\x1e") if b"\x1e" in text else text.splitlines())))
        if len(rows) < 2 or not isinstance(_row_content(rows[0]), dict):
            raise
    features: list[Any] = []
    for row in map(_row_content, rows):
        is_several = isinstance(row, dict) and row.get("type") == "FeatureCollection"
        features += row["features"] if is_several else [row]
    return {"type": "FeatureCollection", "features": features}


def _row_content(row: bytes) -> Any:
    """The content of a text of JSON, or its error."""
    try:
        return json.loads(row)
    except ValueError as error:
        return error


def has_polygons(path: Path) -> bool:
    """Whether a file holds polygons, by its name; of an archive by the names in it."""
    suffix = path.suffix.lower()
    return suffix in POLYGON_SUFFIXES and not (suffix == ".zip" and zipfile.is_zipfile(path) and not _members(path))


def _members(path: Path) -> list[str]:
    """The vector files in an archive."""
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    return [name for name in names if Path(name).suffix.lower() in POLYGON_SUFFIXES and not is_junk(name)]


def _member_of(path: Path) -> str:
    """The name for GDAL of the only vector file in an archive."""
    names = _members(path)
    if len(names) != 1:
        raise ContentError(f"its archive must hold one vector file, got {', '.join(names) or 'none'}")
    return f"/vsizip/{path.absolute().as_posix()}/{names[0]}"


def _vector_content(path: Path, layer: str | None) -> dict[str, Any]:
    """A layer of a vector file in the form of GeoJSON."""
    path.stat()  # a missing file is a FileNotFoundError, as of other formats
    try:
        name = _member_of(path) if path.suffix.lower() == ".zip" else str(path)
    except zipfile.BadZipFile as error:
        raise ContentError(f"its archive is broken ({error})") from None
    try:
        import pyogrio
        import shapely
    except ImportError:
        return _fiona_content(path, name, layer)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of measured coordinates, which are dropped with the heights
            said, _, geometries, columns = pyogrio.raw.read(name, layer=layer, force_2d=True)
        shapes = shapely.from_wkb(geometries, on_invalid="ignore")  # None: a feature without polygons
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, shapely.errors.ShapelyError) as error:
        raise MeshError(f"cannot read {str(path)!r}: {' '.join(str(error).split())}") from None
    rows = [dict(zip(said["fields"], row, strict=True)) for row in zip(*(c.tolist() for c in columns), strict=True)]
    features = [
        {"type": "Feature", "geometry": shape and shapely.geometry.mapping(shape), "properties": row}
        for shape, row in zip(shapes.tolist(), rows or [{}] * len(shapes), strict=True)
    ]
    return {"type": "FeatureCollection", "features": features, "own crs": said["crs"]}


def _fiona_content(path: Path, name: str, layer: str | None) -> dict[str, Any]:
    try:
        import fiona
    except ImportError:
        raise MissingPackageError(f"reading {str(path)!r} needs another package: pip install pyogrio shapely") from None
    try:
        with fiona.open(name, layer=layer) as rows:
            features = [{"type": "Feature", **row.__geo_interface__} for row in rows]
            return {"type": "FeatureCollection", "features": features, "own crs": rows.crs.to_string()}
    except fiona.errors.FionaError as error:
        raise MeshError(f"cannot read {str(path)!r}: {' '.join(str(error).split())}") from None


def _coco(content: Mapping[str, Any], notes: Notes, *, has_crowds: bool, chosen: str | None) -> list[PolygonPicture]:
    images = {image["id"]: image for image in content["images"]}
    if len(images) < len(content["images"]):
        ids = [image["id"] for image in content["images"]]
        raise ContentError(f"{sum(ids.count(i) > 1 for i in images)} ids of images stand more than once")
    names = {category["id"]: category.get("name") for category in content.get("categories", [])}
    pictures: dict[Any, PolygonPicture] = {}
    for key, image in images.items():
        file_name = str(image.get("file_name") or key)
        name, folder = Path(file_name).stem, Path(file_name).parent.as_posix()
        if "\0" in file_name or name in ("", "..") or ".." in Path(file_name).parts:
            raise ContentError(f"image {key!r} has the file name {file_name!r}, which is none within a folder")
        if chosen in (None, name, f"{folder}/{name}"):
            with leaving_out(f"image {key!r}", notes):
                size = int(image["width"]), int(image["height"])
                pictures[key] = PolygonPicture(name, size, folder, image=image, content=content)
    for i, annotation in enumerate(content["annotations"]):
        what = f"annotation {annotation.get('id', i) if isinstance(annotation, dict) else i}"
        picture, parts, said = None, NO_RINGS, {}
        with leaving_out(what, notes):
            key = annotation["image_id"]
            if key not in images:
                raise ContentError(f"is of image {key!r}, which is not there")
            if key in pictures:
                picture = pictures[key]
                said = {"category": names.get(annotation.get("category_id")), **annotation}
                if has_crowds or not annotation.get("iscrowd"):  # one that is left out keeps its number
                    parts = _coco_parts(annotation.get("segmentation"), picture, what, notes)
        if picture is not None:
            picture.add(parts, said)
            picture.annotations.append(annotation)
    return list(pictures.values())


def _coco_parts(segmentation: Any, picture: PolygonPicture, what: str, notes: Notes) -> ObjectRings:
    """Return the polygons of a segmentation: flat rings, or run lengths."""
    if isinstance(segmentation, dict) and "counts" in segmentation:
        height, width = (int(n) for n in segmentation["size"])
        if (width, height) != picture.size:
            raise ContentError(f"is of {width}x{height} pixels, its image of {'x'.join(map(str, picture.size or ()))}")
        counts = segmentation["counts"]
        lengths = _read_counts(counts) if isinstance(counts, str) else np.asarray(counts, np.int64).reshape(-1)
        if (lengths < 0).any():
            raise ContentError(f"has a run length of {lengths.min()} pixels")
        if lengths.sum() != width * height:
            raise ContentError(f"has run lengths of {lengths.sum()} pixels, not {width * height}")
        return _rectangles(lengths, height)
    return _joined([[_pairs(flat)] for flat in segmentation] if isinstance(segmentation, list) else [], what, notes)


def _read_counts(text: str) -> npt.NDArray[np.int64]:
    """Return run lengths from a string, as pycocotools writes it."""
    try:
        return read_counts(text)
    except ValueError as error:
        raise ContentError(f"has {error}") from None


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
    if len(flat) % 2:
        raise ContentError(f"has a ring of {len(flat)} numbers")
    return [(float(x), float(y)) for x, y in zip(flat[::2], flat[1::2], strict=True)]


def _joined(polygons: list[list[list[tuple[float, float]]]], what: str, notes: Notes) -> ObjectRings:
    """Return polygons from the rings of each; a ring of fewer than three points covers nothing and is left out."""
    for ring in chain.from_iterable(polygons):
        if len(ring) < 3:
            notes.add("rings left out", f"{what} has a ring of {len(ring)} points")
    kept = [[ring for ring in rings if len(ring) > 2] for rings in polygons if rings and len(rings[0]) > 2]
    if not kept:
        raise ContentError("has no polygons")
    rings = list(chain.from_iterable(kept))
    points = np.array(list(chain.from_iterable(rings)), np.float64).reshape(-1, 2)
    if not np.isfinite(points).all():
        raise ContentError(f"has a coordinate of {points[~np.isfinite(points)][0]}")
    lengths, counts = (np.array([len(one) for one in of], np.int64) for of in (rings, kept))
    return ObjectRings(points, lengths, counts)


def _geojson(content: Mapping[str, Any], name: str, notes: Notes) -> PolygonPicture:
    picture = PolygonPicture(name, None)
    for i, feature in enumerate(content["features"] if content["type"] == "FeatureCollection" else [content]):
        said: dict[str, Any] = {}
        parts = NO_RINGS
        with leaving_out(f"feature {i}", notes):
            if isinstance(feature, ValueError):
                raise ContentError(f"is no JSON: {feature}")
            is_feature = feature["type"] == "Feature"
            if is_feature:
                said = {**({"id": feature["id"]} if "id" in feature else {}), **(feature.get("properties") or {})}
            geometry = feature["geometry"] if is_feature else feature
            parts = _joined(list(_parts(geometry, f"feature {i}", notes)) if geometry else [], f"feature {i}", notes)
        picture.add(parts, said)
    return replace(picture, crs=_crs_of(content, picture))


def _crs_of(content: Mapping[str, Any], picture: PolygonPicture) -> str | None:
    """The CRS of a vector file, or of GeoJSON: the name in it, as old files have, or degrees of WGS84 if it can be."""
    if "own crs" in content:
        return content["own crs"] or None
    named = (content.get("crs") or {}).get("properties", {}).get("name")
    if named is not None:
        return WGS84 if str(named).upper().endswith("CRS84") else str(named)
    points = np.abs(picture.polygons.points)
    return WGS84 if (points <= (180, 90)).all() else None


def _parts(geometry: Mapping[str, Any], what: str, notes: Notes) -> Iterator[list[Any]]:
    """Yield the rings of each polygon."""
    if geometry["type"] == "GeometryCollection":
        for part in geometry["geometries"]:
            yield from _parts(part, what, notes)
            if part["type"] in LOWER_KINDS:
                notes.add("parts left out", f"{what} has a {part['type']} beside polygons")
    elif geometry["type"] in ("Polygon", "MultiPolygon"):
        polygons = geometry["coordinates"] if geometry["type"] == "MultiPolygon" else [geometry["coordinates"]]
        for rings in polygons:
            yield [[(float(p[0]), float(p[1])) for p in ring] for ring in rings]
