"""Who draws polygons: a function that makes the input ready and returns the call that is timed.

A call returns a mask, labels with -1 where nothing is, areas, or a table (pixels, areas, starts). Objects of a library
(shapely geometries, data frames) are made before; memory that a library can be given is given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.polygons.cases import F64

Polygons = list[list[F64]]
Draw = Callable[[], Any]
Prepare = Callable[[Polygons, tuple[int, int], str, int], Draw]


@dataclass(frozen=True)
class Painter:
    """A program, the package that its version is of, and how many lines of Python its user writes for each task."""

    prepare: Prepare
    package: str
    n_lines: dict[str, int]
    most_corners: int = 10_000
    """Of a ring: those of more take minutes."""


def offsets_of(polygons: Polygons) -> tuple[F64, np.ndarray, np.ndarray]:
    """Return coordinates, ring offsets, polygon offsets."""
    rings = [ring for polygon in polygons for ring in polygon]
    ends = np.cumsum([0, *map(len, rings)]), np.cumsum([0, *map(len, polygons)])
    return np.concatenate(rings), *ends


def topleft(polygons: Polygons, size: tuple[int, int], task: str, threads: int) -> Draw:
    import topleft as tl

    given = offsets_of(polygons)
    if task == "table":
        kept = [tl.overlap(given, size, threads=threads)]

        def draw_table() -> Any:
            kept[0] = tl.overlap(given, size, threads=threads, out=kept[0])
            return kept[0].pixels, kept[0].areas, kept[0].starts

        return draw_table
    options: dict[str, Any] = {"labels": {"values": "index"}, "area": {"sampling": "area"}}.get(task, {})
    out = np.zeros(size[::-1], {"mask": bool, "labels": np.int32, "area": np.float32}[task])
    return lambda: tl.polygons(given, size, **options, threads=threads, out=out)


def opencv(polygons: Polygons, size: tuple[int, int], task: str, threads: int) -> Draw:
    import cv2

    cv2.setNumThreads(threads)
    # With shift=8 a coordinate counts 1/256 of a pixel, from the centre of the first one.
    fixed = [[np.round(256 * ring - 128).astype(np.int32).reshape(-1, 1, 2) for ring in rings] for rings in polygons]
    out = np.zeros(size[::-1], np.uint8 if task == "mask" else np.int32)

    def draw() -> Any:
        out.fill(0 if task == "mask" else -1)
        for i, rings in enumerate(fixed):
            cv2.fillPoly(out, rings, 1 if task == "mask" else i, lineType=cv2.LINE_8, shift=8)
        return out

    return draw


def pillow(polygons: Polygons, size: tuple[int, int], task: str, _: int) -> Draw:
    from PIL import Image, ImageDraw

    listed = [[list(map(tuple, (ring - 0.5).tolist())) for ring in rings] for rings in polygons]

    def draw() -> Any:
        image = Image.new("1" if task == "mask" else "I", size, 0 if task == "mask" else -1)
        pen = ImageDraw.Draw(image)
        for i, (ring, *holes) in enumerate(listed):
            pen.polygon(ring, fill=1 if task == "mask" else i)
            for hole in holes:  # painted over: right where nothing lies below
                pen.polygon(hole, fill=0 if task == "mask" else -1)
        return np.asarray(image)

    return draw


def skimage(polygons: Polygons, size: tuple[int, int], task: str, _: int) -> Draw:
    from skimage.draw import polygon

    def draw() -> Any:
        out = np.full(size[::-1], False if task == "mask" else -1)
        for i, (ring, *holes) in enumerate(polygons):
            out[polygon(ring[:, 1] - 0.5, ring[:, 0] - 0.5, size[::-1])] = True if task == "mask" else i
            for hole in holes:
                out[polygon(hole[:, 1] - 0.5, hole[:, 0] - 0.5, size[::-1])] = False if task == "mask" else -1
        return out

    return draw


def rasterio(polygons: Polygons, size: tuple[int, int], task: str, _: int) -> Draw:
    import shapely
    from affine import Affine
    from rasterio.features import rasterize

    shapes = [shapely.Polygon(ring, holes) for ring, *holes in polygons]
    out = np.zeros(size[::-1], np.uint8 if task == "mask" else np.int32)

    def draw() -> Any:
        out.fill(0 if task == "mask" else -1)
        pairs = ((shape, 1 if task == "mask" else i) for i, shape in enumerate(shapes))
        return rasterize(pairs, out=out, transform=Affine.identity())

    return draw


def shapely(polygons: Polygons, size: tuple[int, int], task: str, _: int) -> Draw:
    import shapely as sh

    ((ring, *holes),) = polygons
    shape = sh.Polygon(ring, holes)
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))

    def draw() -> Any:
        sh.prepare(shape)
        if task == "mask":
            return sh.contains_xy(shape, x + 0.5, y + 0.5)
        return sh.area(sh.intersection(sh.box(x, y, x + 1, y + 1), shape))

    return draw


def exactextract(polygons: Polygons, size: tuple[int, int], _: str, __: int) -> Draw:
    import geopandas
    import shapely as sh
    from exactextract import exact_extract
    from exactextract.raster import NumPyRasterSource

    width, height = size
    shapes = [sh.Polygon(np.c_[ring[:, 0], height - ring[:, 1]]) for (ring,) in polygons]
    frame = geopandas.GeoDataFrame({"id": np.arange(len(shapes))}, geometry=shapes, crs="EPSG:3857")
    source = NumPyRasterSource(np.ones(size[::-1], np.float32), 0, 0, width, height, srs_wkt=frame.crs.to_wkt())

    def draw() -> Any:
        found = exact_extract(source, frame, ["coverage", "cell_id"], output="pandas")
        starts = np.cumsum([0, *map(len, found["coverage"])])
        return np.concatenate(found["cell_id"].to_numpy()), np.concatenate(found["coverage"].to_numpy()), starts

    return draw


PAINTERS = {
    "topleft": Painter(topleft, "topleft", {"mask": 1, "labels": 1, "area": 1, "table": 1}, 1 << 30),
    "cv2.fillPoly": Painter(opencv, "opencv-python-headless", {"mask": 3, "labels": 4}, 1 << 30),
    "PIL ImageDraw": Painter(pillow, "pillow", {"mask": 5, "labels": 6}),
    "skimage.draw.polygon": Painter(skimage, "scikit-image", {"mask": 4, "labels": 5}),
    "rasterio.rasterize": Painter(rasterio, "rasterio", {"mask": 2, "labels": 2}),
    "shapely": Painter(shapely, "shapely", {"mask": 3, "area": 4}),
    "exactextract": Painter(exactextract, "exactextract", {"table": 3}),
}
