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

from topleft.errors import MeshError

__all__ = ["PolygonPicture", "load_polygons"]


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


def load_polygons(path: str | os.PathLike[str]) -> list[PolygonPicture]:
    """Return the polygons of a GeoJSON file, one picture, or of a file of COCO annotations, a picture for each image.

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
            return _coco(content)
        if isinstance(content, dict) and isinstance(content.get("type"), str):
            return [_geojson(content, path.stem)]
    except (KeyError, TypeError, AttributeError, IndexError) as error:
        raise MeshError(f"cannot read {str(path)!r}: something is missing or of a wrong kind ({error!r})") from None
    raise MeshError(f"cannot read {str(path)!r}: it is neither GeoJSON nor annotations in the format of COCO")


def _coco(content: Mapping[str, Any]) -> list[PolygonPicture]:
    images = {image["id"]: image for image in content["images"]}
    names = {category["id"]: category.get("name") for category in content.get("categories", [])}
    found: dict[Any, list[Any]] = {key: [] for key in images}
    for annotation in content["annotations"]:
        found[annotation["image_id"]].append(annotation)
    pictures = []
    for key, image in images.items():
        skipped = [a for a in found[key] if not isinstance(a.get("segmentation"), list)]
        name = Path(str(image.get("file_name", key))).stem
        size = int(image["width"]), int(image["height"])
        picture = PolygonPicture(name, size, n_skipped=len(skipped))
        for annotation in found[key]:
            if isinstance(annotation.get("segmentation"), list):
                said = {**annotation, "category": names.get(annotation.get("category_id"))}
                picture.add([[_pairs(flat)] for flat in annotation["segmentation"]], said)
        pictures.append(picture)
    return pictures


def _pairs(flat: list[float]) -> list[tuple[float, float]]:
    return list(zip(flat[::2], flat[1::2], strict=True))


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
            yield [[(p[0], p[1]) for p in ring] for ring in rings]
