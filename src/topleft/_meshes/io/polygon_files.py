"""Reads polygons from files: GeoJSON, and annotations in the format of COCO.

Input: a path. Output: for each picture its polygons, which of them belong together, and what is said of each.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft.errors import MeshError


@dataclass(frozen=True)
class PolygonPicture:
    """The polygons of one picture."""

    name: str
    size: tuple[int, int] | None  # pixels; None: the polygons are on a plane, y up
    polygons: list[list[Any]] = field(default_factory=list)  # of each its rings
    owners: list[int] = field(default_factory=list)  # the object that each polygon is of
    objects: list[Mapping[str, Any]] = field(default_factory=list)  # what is said of each
    n_skipped: int = 0  # objects that are no polygons

    def add(self, parts: list[list[Any]], said: Mapping[str, Any]) -> None:
        """Add an object of several parts."""
        self.polygons.extend(parts)
        self.owners.extend([len(self.objects)] * len(parts))
        self.objects.append(said)


def load_polygons(path: str | os.PathLike[str], *, has_crowds: bool = True) -> list[PolygonPicture]:
    """Return the polygons of a GeoJSON file, one picture, or of a file of COCO annotations, a picture for each image.

    Without `has_crowds` annotations of COCO that are crowds are left out.

    Raises
    ------
    MeshError
        If the file is neither, or broken.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    try:
        if isinstance(content, dict) and isinstance(content.get("annotations"), list):
            return _coco(content, has_crowds=has_crowds)
        if isinstance(content, dict) and isinstance(content.get("type"), str):
            return [_geojson(content, path.stem)]
    except CountsError as error:
        raise MeshError(f"cannot read {str(path)!r}: {error}") from None
    except (KeyError, TypeError, AttributeError, IndexError, ValueError, OverflowError) as error:
        raise MeshError(f"cannot read {str(path)!r}: something is missing or of a wrong kind ({error!r})") from None
    raise MeshError(f"cannot read {str(path)!r}: it is neither GeoJSON nor annotations in the format of COCO")


def _coco(content: Mapping[str, Any], *, has_crowds: bool) -> list[PolygonPicture]:
    images = {image["id"]: image for image in content["images"]}
    names = {category["id"]: category.get("name") for category in content.get("categories", [])}
    found: dict[Any, list[Any]] = {key: [] for key in images}
    for annotation in content["annotations"]:
        if has_crowds or not annotation.get("iscrowd"):
            found[annotation["image_id"]].append(annotation)
    pictures = []
    for key, image in images.items():
        name = Path(str(image.get("file_name", key))).stem
        size = int(image["width"]), int(image["height"])
        drawn = [(a, _coco_parts(a.get("segmentation"), size, a.get("id"))) for a in found[key]]
        picture = PolygonPicture(name, size, n_skipped=sum(parts is None for _, parts in drawn))
        for annotation, parts in drawn:
            if parts is not None:
                picture.add(parts, {**annotation, "category": names.get(annotation.get("category_id"))})
        pictures.append(picture)
    return pictures


def _coco_parts(segmentation: Any, size: tuple[int, int], name: object) -> list[list[Any]] | None:
    """Return the polygons of a segmentation: flat rings, or run lengths; None of what is neither."""
    if isinstance(segmentation, list):
        return [[_pairs(flat)] for flat in segmentation]
    if isinstance(segmentation, dict) and "counts" in segmentation:
        height, width = (int(n) for n in segmentation["size"])
        if (width, height) != size:
            raise CountsError(f"annotation {name} is of {width}x{height} pixels, its image of {size[0]}x{size[1]}")
        counts = segmentation["counts"]
        lengths = _read_counts(counts, name) if isinstance(counts, str) else np.asarray(counts, np.int64).reshape(-1)
        if (lengths < 0).any():
            raise CountsError(f"annotation {name} has a run length of {lengths.min()} pixels")
        if lengths.sum() != width * height:
            raise CountsError(f"annotation {name} has run lengths of {lengths.sum()} pixels, not {width * height}")
        return _rectangles(lengths, height)
    return None


class CountsError(ValueError):
    """Run lengths that do not fit."""


def _read_counts(text: str, name: object) -> npt.NDArray[np.int64]:
    """Return run lengths from a string, as pycocotools writes it.

    Five bits a character, the lower first, and a sixth one that says that more follow; from the fourth number on the
    difference from the last but one.
    """
    lengths: list[int] = []
    value = shift = 0
    for character in text:
        bits = ord(character) - 48
        if not 0 <= bits < 64 or shift > 40:
            raise CountsError(f"annotation {name} has run lengths that are no text of COCO, at {character!r}")
        value |= (bits & 31) << shift
        shift += 5
        if not bits & 32:
            if bits & 16:
                value -= 1 << shift
            lengths.append(value + (lengths[-2] if len(lengths) > 2 else 0))
            value = shift = 0
    if shift:
        raise CountsError(f"annotation {name} has run lengths that end within a number")
    return np.array(lengths, np.int64)


def _rectangles(lengths: npt.NDArray[np.int64], height: int) -> list[list[Any]]:
    """Return the pixels of run lengths as rectangles, a polygon each.

    Runs go down columns, the first of pixels outside; neighbours of the same rows become one rectangle.
    """
    ends = np.cumsum(lengths)
    found: list[list[int]] = []  # left, right, top, bottom
    for first, end in zip((ends - lengths)[1::2].tolist(), ends[1::2].tolist(), strict=True):
        at = first
        while at < end:  # to the end of the column, or whole columns
            column, top = divmod(at, height)
            n_columns = max(1, (end - at) // height) if top == 0 else 1
            bottom = height if n_columns > 1 else min(height, top + end - at)
            if found and found[-1][1:] == [column, top, bottom]:
                found[-1][1] = column + n_columns
            else:
                found.append([column, column + n_columns, top, bottom])
            at = (column + n_columns) * height if bottom == height else end
    return [[[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]] for x0, x1, y0, y1 in found]


def _pairs(flat: list[float]) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in zip(flat[::2], flat[1::2], strict=True)]


def _geojson(content: Mapping[str, Any], name: str) -> PolygonPicture:
    features = content["features"] if content["type"] == "FeatureCollection" else [content]
    picture = PolygonPicture(name, None)
    n_skipped = 0
    for feature in features:
        is_feature = feature["type"] == "Feature"
        geometry = feature["geometry"] if is_feature else feature
        parts = list(_parts(geometry)) if geometry else []
        if parts:
            said = {**(feature.get("properties") or {}), "id": feature.get("id")} if is_feature else {}
            picture.add(parts, said)
        else:
            n_skipped += 1
    return PolygonPicture(name, None, picture.polygons, picture.owners, picture.objects, n_skipped)


def _parts(geometry: Mapping[str, Any]) -> Iterator[list[Any]]:
    """Yield the rings of each polygon."""
    if geometry["type"] == "GeometryCollection":
        for part in geometry["geometries"]:
            yield from _parts(part)
    elif geometry["type"] in ("Polygon", "MultiPolygon"):
        polygons = geometry["coordinates"] if geometry["type"] == "MultiPolygon" else [geometry["coordinates"]]
        for rings in polygons:
            yield [[(float(p[0]), float(p[1])) for p in ring] for ring in rings]
