"""`topleft mask`: masks and labels of the polygons in a file."""

from __future__ import annotations

import argparse
import json
import math
import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from topleft import Grid, polygons, save_image
from topleft._apps.cli.arguments import FAILED, UsageError, add_command, positive, size
from topleft._apps.cli.labels import numbers_of, tell_of_background, words_of
from topleft._apps.cli.report import complain, complaining, write_json
from topleft._core.base.defaults import MAX_CROSSINGS, SUFFIXES
from topleft._core.base.georeference import is_same_crs, transformed
from topleft._core.base.options import Sampling
from topleft.annex.files import PolygonPicture, annotation_members, annotation_of, encode_polygons, load_polygons
from topleft.typing import RuleOption

DEFAULT_SIDE = 1024

MASK_HELP = """\
FILE is GeoJSON (Polygon, MultiPolygon, features and collections of them; y is up), a GeoPackage, shapefile or other
vector file that pyogrio or fiona reads, or annotations in the format of COCO (a picture for each image, of its size):
polygons and run lengths, as lists and as text.

OUT is a file, or for several images a pattern: masks/{name}.png, or masks/{folder}/{name}.png where images of several
folders have one name; {index} is the number of the image. A mask is 255 inside and 0 outside, with --sampling
area and msaa2 to msaa16 the share of the pixel in between. --labels writes numbers: index, of the objects of the file
in their order from 1 on, or a property of the features or annotations, such as category_id; 0 where nothing is, or
--nodata. PNG holds numbers from 0 to 65535; .npy and TIFF hold whole numbers of 64 bits. Words of a property are
numbered from 1 on in the order of the alphabet, and OUT.legend.json says which is which. Objects without a number, and
objects with the number of the background, are told.

A .tif of polygons on a plane is a GeoTIFF. Its CRS is that of the file (of GeoJSON degrees of WGS84, EPSG:4326), or
--crs, to which the polygons are then transformed. --like RASTER takes size, extent, CRS and nodata of a raster.

An OUT that ends in .json gets annotations of COCO instead, of all images: each object with the run lengths of its mask,
its area and its box.
"""


def run_mask(options: argparse.Namespace) -> int:
    """Write masks or labels of the polygons in a file."""
    with complaining() as lacks:
        pictures = load_polygons(
            options.file, has_crowds=not options.no_crowds, layer=options.layer, image=options.image
        )
        if options.image is not None and not pictures:
            raise UsageError(f"--image {options.image}: {options.file} has no image of that name")
        if Path(options.out).suffix.lower() == ".json":
            write_annotations(pictures, options)
        else:
            write_pictures(pictures, options)
    return FAILED if lacks else 0


def write_pictures(pictures: list[PolygonPicture], options: argparse.Namespace) -> None:
    """Write the mask or the labels of each picture."""
    if len(pictures) > 1 and "{name}" not in options.out and "{index}" not in options.out:
        raise UsageError(f"{options.file} has {len(pictures)} images: -o needs {{name}}, or --image chooses one")
    if Path(options.out).suffix.lower() not in SUFFIXES:
        raise UsageError(f"-o {options.out}: the name must end in one of {' '.join(SUFFIXES)}")
    if options.nodata is not None and options.labels is None:
        raise UsageError("--nodata is for --labels: a mask is 0 where nothing is")
    for path, picture in zip(paths_of(pictures, options.out), pictures, strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            drawn, frame, legend = draw(picture, options)
        is_placed = isinstance(frame, Grid) and path.suffix.lower() in (".tif", ".tiff")
        save_image(path, drawn, grid=frame if is_placed and isinstance(frame, Grid) else None)
        if legend:
            path.with_name(f"{path.name}.legend.json").write_text(json.dumps(legend, indent=1, ensure_ascii=False))
        for one in caught:
            complain(f"{picture.name}: {one.message}")


def write_annotations(pictures: list[PolygonPicture], options: argparse.Namespace) -> None:
    """Write run lengths of the objects of all pictures as annotations of COCO; a file of COCO keeps the rest."""
    if options.labels is not None or options.sampling != Sampling.CENTER:
        raise UsageError(f"-o {options.out}: run lengths are of masks, without --labels and --sampling")
    images: list[Mapping[str, Any]] = []
    annotations: list[Mapping[str, Any]] = []
    for picture in pictures:
        given, frame = frame_of(picture, options)
        width, height = frame.size if isinstance(frame, Grid) else frame
        images.append(picture.image or {"id": 1, "file_name": picture.name, "width": width, "height": height})
        rles = encode_polygons(given, frame, options.rule, owners=picture.owners)  # none of the last without polygons
        for said, own, part, rle in zip_longest(picture.objects, picture.annotations, picture.parts, rles):
            if options.no_crowds and said.get("iscrowd"):
                continue
            if own is not None:
                annotations.append({"iscrowd": 0, **own, **annotation_members(rle)} if len(part.counts) else own)
            elif len(part.counts):
                category = said.get("category_id")
                made = annotation_of(rle, len(annotations) + 1, 1, category if isinstance(category, int) else 1)
                others = {name: value for name, value in said.items() if name not in ("id", "category_id", "iscrowd")}
                made["iscrowd"] = said.get("iscrowd", 0)
                annotations.append(made | ({"attributes": others} if others else {}))
    content = (pictures and pictures[0].content) or {"categories": categories_of(pictures)}
    write_json(Path(options.out), {**content, "images": images, "annotations": annotations})


def categories_of(pictures: list[PolygonPicture]) -> list[dict[str, Any]]:
    """The categories that objects name, by their ids."""
    names = {said.get("category_id"): said.get("category") for picture in pictures for said in picture.objects}
    known = {key: name for key, name in names.items() if isinstance(key, int)} or {1: None}
    return [{"id": key, "name": str(key if name is None else name)} for key, name in sorted(known.items())]


def paths_of(pictures: list[PolygonPicture], out: str) -> list[Path]:
    """Return where each picture goes."""
    found: dict[Path, PolygonPicture] = {}
    for i, picture in enumerate(pictures):
        words = {"{name}": picture.name, "{folder}": picture.folder, "{index}": f"{i:03d}"}
        if "{folder}" in out and Path(picture.folder).is_absolute():
            raise UsageError(f"-o {out}: image {picture.name} lies in {picture.folder}, no folder within another")
        path = Path("".join(words.get(part, part) for part in re.split(r"(\{name\}|\{folder\}|\{index\})", out)))
        if path in found:
            folders = f"{found[path].folder}/{found[path].name} and {picture.folder}/{picture.name}"
            raise UsageError(f"-o {out}: images {folders} would both go to {path}; {{folder}} or {{index}} parts them")
        found[path] = picture
    return list(found)


Frame = tuple[int, int] | Grid


def draw(picture: PolygonPicture, options: argparse.Namespace) -> tuple[npt.NDArray[Any], Frame, dict[int, str]]:
    """Return the mask or the labels of a picture, its frame, and the words behind labels."""
    labels, legend = (None, {}) if options.labels is None else labels_of(picture, options)
    rings, frame = frame_of(picture, options)
    how: dict[str, Any] = {"rule": options.rule, "sampling": options.sampling, "threads": options.threads}
    how["max_crossings"] = options.max_crossings
    if labels is None:
        mask = polygons(rings, frame, **how)
        return np.rint(mask * np.float32(255)).astype(np.uint8), frame, {}
    said = frame.nodata if options.nodata is None and isinstance(frame, Grid) else options.nodata
    empty = 0 if said is None else int(said)
    tell_of_background(picture, labels, empty, options.file)
    drawn = polygons(rings, frame, values=labels[picture.owners], background=empty, **how)
    suffix, ends = Path(options.out).suffix.lower(), (int(labels.min(initial=empty)), int(labels.max(initial=empty)))
    if suffix == ".png" and not (0 <= ends[0] and ends[1] <= 65535):
        raise UsageError(
            f"--labels {options.labels}: PNG holds numbers from 0 to 65535, got {ends[0]} to {ends[1]}; "
            "write .npy or .tif"
        )
    if suffix != ".npy":
        sizes = [np.iinfo(dtype) for dtype in (np.uint8, np.uint16, np.int32, np.int64)]
        drawn = drawn.astype(next(one.dtype for one in sizes if one.min <= ends[0] and ends[1] <= one.max))
    return drawn, frame, legend


def labels_of(picture: PolygonPicture, options: argparse.Namespace) -> tuple[npt.NDArray[Any], dict[int, str]]:
    """Return the number of each object, and the word of each number."""
    if options.labels == "index":
        return np.arange(1, len(picture.objects) + 1, dtype=np.int32), {}
    words = words_of(picture, options.labels, options.file)
    return words or (
        numbers_of(picture, "--labels", options.labels, options.file, options.nodata or 0, is_whole=True),
        {},
    )


def frame_of(picture: PolygonPicture, options: argparse.Namespace) -> tuple[Any, Frame]:
    """Return the rings of a picture, and the size of an image or the grid over a plane that they lie in."""
    if picture.size is not None:
        given = [name for name in ("size", "extent", "crs", "like") if getattr(options, name) is not None]
        if given:
            raise UsageError(f"--{given[0]} is for polygons on a plane: images have a size")
        return picture.polygons, picture.size
    like = None if options.like is None else Grid.like(options.like)
    if like is not None and (options.size is not None or options.extent is not None):
        raise UsageError("--like says size and extent: give neither beside it")
    rings, crs = picture.polygons, options.crs or (picture.crs if like is None else like.crs)
    if picture.crs is not None and crs is not None and not is_same_crs(picture.crs, crs):
        if options.crs is None:
            raise UsageError(f"{options.file} is of {picture.crs}, {options.like} of {crs}: --crs {crs} transforms it")
        rings = replace(rings, points=transformed(rings.points, picture.crs, crs))
    if like is not None:
        if like.crs is not None and crs is not None and not is_same_crs(like.crs, crs):
            raise UsageError(f"--crs must be that of --like, {like.crs}, got {crs}")
        grid = like
    else:
        grid = grid_over(rings.points, options)
    nodata = grid.nodata if options.nodata is None else options.nodata
    is_label = options.labels is not None and nodata is not None and float(nodata).is_integer()
    return rings, replace(grid, crs=crs, nodata=nodata if is_label else None)


def grid_over(points: npt.NDArray[np.float64], options: argparse.Namespace) -> Grid:
    """Return the grid of the options over points, or over --extent."""
    if options.extent is None and not len(points):
        raise UsageError(f"{options.file} has no polygons: --extent must give the area")
    if options.extent is None:
        (x_min, y_min), (x_max, y_max) = points.min(axis=0), points.max(axis=0)
        extent = float(x_min), float(x_max), float(y_min), float(y_max)
    else:
        extent = tuple(options.extent)
    wide, tall = extent[1] - extent[0], extent[3] - extent[2]
    if options.size is not None or not (wide > 0 and tall > 0):
        return Grid(options.size or (DEFAULT_SIDE, DEFAULT_SIDE), extent)
    with np.errstate(all="ignore"):
        scale = float(np.float64(DEFAULT_SIDE) / max(wide, tall))
    if not 0 < scale < math.inf:
        raise UsageError(f"{options.file} reaches over {wide} x {tall}: --extent must give the area")
    return Grid((max(1, round(wide * scale)), max(1, round(tall * scale))), extent)


def add_mask_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    add = add_command(commands, "mask", run_mask, "write masks or labels of polygons", MASK_HELP).add_argument
    add("file", metavar="FILE", help="GeoJSON, a vector file, or annotations of COCO")
    add("-o", "--out", required=True, metavar="OUT", help="where the picture goes; see below")
    add("--labels", metavar="NAME", help="write numbers: index, or a property")
    add("--rule", choices=get_args(RuleOption), default="evenodd", help="the fill rule (evenodd)")
    add("--sampling", choices=[str(s) for s in Sampling], default="center", help="how pixels are sampled")
    add("--size", type=size, metavar="WxH", help=f"of the picture (the longer side {DEFAULT_SIDE})")
    add("--extent", type=float, nargs=4, metavar=("X_MIN", "X_MAX", "Y_MIN", "Y_MAX"), help="the window to draw (all)")
    add("--crs", metavar="CRS", help="the CRS of the picture, EPSG:25832 say: polygons are transformed")
    add("--like", metavar="RASTER", help="take size, extent, CRS and nodata of a raster")
    add("--nodata", type=int, metavar="N", help="the background of --labels (0)")
    add("--layer", metavar="NAME", help="of a vector file (the first one)")
    add("--no-crowds", action="store_true", help="leave out annotations of COCO that are crowds")
    add("--image", metavar="NAME", help="draw this image alone: its file name without suffix")
    add(
        "--max-crossings",
        type=positive,
        default=MAX_CROSSINGS,
        metavar="N",
        help=f"refuse rings that cross more often with --sampling area, outer and inner ({MAX_CROSSINGS})",
    )
    add("--threads", type=positive, metavar="N", help="how many at most")
