"""`topleft mask`: masks and labels of the polygons in a file."""

from __future__ import annotations

import argparse
import json
import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from topleft._apps.cli.arguments import UsageError, positive, size
from topleft._apps.cli.render import FAILED, complain
from topleft._core.base.grid import Grid
from topleft._core.base.options import Sampling
from topleft._core.base.whole_file import write_whole
from topleft._core.polygons.polygons import Rule, polygons
from topleft._core.polygons.prepared import MAX_CROSSINGS
from topleft._core.polygons.rle import encode_polygons
from topleft._core.raster.rle import annotation_of
from topleft._meshes.io.images import SUFFIXES, save_image
from topleft._meshes.io.polygon_files import PolygonPicture, load_polygons

DEFAULT_SIDE = 1024

MASK_HELP = """\
FILE is GeoJSON (Polygon, MultiPolygon, features and collections of them; y is up) or annotations in the format of COCO
(a picture for each image, of its size): polygons and run lengths, as lists and as text.

OUT is a file, or for several images a pattern: masks/{name}.png, or masks/{folder}/{name}.png where images of several
folders have one name; {index} is the number of the image. A mask is 255 inside and 0 outside, with --sampling
area and msaa2 to msaa16 the share of the pixel in between. --labels writes numbers: index, of the objects in their
order from 1 on, or a property of the features or annotations, such as category_id; 0 where nothing is. PNG holds
numbers up to 65535; .npy and TIFF hold all.

An OUT that ends in .json gets annotations of COCO instead, of all images: each object with the run lengths of its mask,
its area and its box.
"""


def run_mask(options: argparse.Namespace) -> int:
    """Write masks or labels of the polygons in a file."""
    pictures = load_polygons(options.file, has_crowds=not options.no_crowds)
    if options.image is not None:
        pictures = [p for p in pictures if options.image in (p.name, f"{p.folder}/{p.name}")]
        if not pictures:
            raise UsageError(f"--image {options.image}: {options.file} has no image of that name")
    if Path(options.out).suffix.lower() == ".json":
        return write_annotations(pictures, options)
    if len(pictures) > 1 and "{name}" not in options.out and "{index}" not in options.out:
        raise UsageError(f"{options.file} has {len(pictures)} images: -o needs {{name}}, or --image chooses one")
    if Path(options.out).suffix.lower() not in SUFFIXES:
        raise UsageError(f"-o {options.out}: the name must end in one of {' '.join(SUFFIXES)}")
    status, paths = 0, paths_of(pictures, options.out)
    for path, picture in zip(paths, pictures, strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            drawn = draw(picture, options)
        save_image(path, drawn)
        for one in caught:
            complain(f"{picture.name}: {one.message}")
        if picture.n_skipped:
            complain(f"{picture.name}: {picture.n_skipped} objects are no polygons and were left out")
            status = FAILED
    return status


def write_annotations(pictures: list[PolygonPicture], options: argparse.Namespace) -> int:
    """Write run lengths of the objects of all pictures as annotations of COCO."""
    if options.labels is not None or options.sampling != Sampling.CENTER:
        raise UsageError(f"-o {options.out}: run lengths are of masks, without --labels and --sampling")
    status, images = 0, []
    annotations: list[dict[str, Any]] = []
    for number, picture in enumerate(pictures, 1):
        frame, (points, rings, polygons) = frame_of(picture, options), picture.polygons
        width, height = frame.size if isinstance(frame, Grid) else frame
        points = frame.to_pixels(points) if isinstance(frame, Grid) else points
        rles = encode_polygons((points, rings, polygons), (width, height), options.rule, owners=picture.owners)
        own = picture.objects[0].get("image_id", number) if picture.objects else number
        named = {"id": own, "file_name": (Path(picture.folder) / picture.name).as_posix()}
        images.append(named | {"width": width, "height": height})
        for said, rle in zip(picture.objects, rles, strict=True):
            category = said.get("category_id")
            made = annotation_of(rle, len(annotations) + 1, own, category if isinstance(category, int) else 1)
            others = {name: value for name, value in said.items() if name not in (*made, "category")}
            annotations.append(made | {"iscrowd": said.get("iscrowd", 0)} | ({"attributes": others} if others else {}))
        if picture.n_skipped:
            complain(f"{picture.name}: {picture.n_skipped} objects are no polygons and were left out")
            status = FAILED
    content = {"images": images, "annotations": annotations, "categories": categories_of(pictures)}
    path = Path(options.out)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, lambda file: file.write(json.dumps(content).encode()))
    return status


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


def draw(picture: PolygonPicture, options: argparse.Namespace) -> npt.NDArray[Any]:
    """Return the mask or the labels of a picture."""
    frame = frame_of(picture, options)
    how: dict[str, Any] = {"rule": options.rule, "sampling": options.sampling, "threads": options.threads}
    how["max_crossings"] = options.max_crossings
    if options.labels is None:
        mask = polygons(picture.polygons, frame, **how)
        return np.rint(mask * np.float32(255)).astype(np.uint8)
    labels = labels_of(picture, options.labels)
    drawn = polygons(picture.polygons, frame, values=labels[picture.owners], **how)
    if Path(options.out).suffix.lower() == ".npy":
        return drawn
    largest = int(labels.max(initial=0))
    if largest > 65535 and Path(options.out).suffix.lower() == ".png":
        raise UsageError(f"--labels {options.labels}: PNG holds numbers up to 65535, got {largest}; write .npy or .tif")
    return drawn.astype(np.uint8 if largest < 256 else np.uint16 if largest < 65536 else np.int32)


def labels_of(picture: PolygonPicture, name: str) -> npt.NDArray[np.int32]:
    """Return the number of each object."""
    if name == "index":
        return np.arange(1, len(picture.objects) + 1, dtype=np.int32)
    numbers = []
    for i, said in enumerate(picture.objects):
        value = said.get(name)
        if not isinstance(value, (int, float)) or not 0 <= value < 2**31 or value != int(value):
            raise UsageError(
                f"--labels {name}: object {i} of {picture.name} has {value!r}, not a whole number from 0 on"
            )
        numbers.append(int(value))
    return np.array(numbers, np.int32)


def frame_of(picture: PolygonPicture, options: argparse.Namespace) -> tuple[int, int] | Grid:
    """Return the size of an image, or the grid over a plane."""
    if picture.size is not None:
        if options.extent is not None or options.size is not None:
            raise UsageError("--size and --extent are for GeoJSON: images have a size")
        return picture.size
    points = picture.polygons[0]
    if options.extent is None and not len(points):
        raise UsageError(f"{options.file} has no polygons: --extent must say what is shown")
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
        raise UsageError(f"{options.file} reaches over {wide} x {tall}: --extent must say what is shown")
    return Grid((max(1, round(wide * scale)), max(1, round(tall * scale))), extent)


def add_mask_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    mask = commands.add_parser(
        "mask",
        help="write masks or labels of polygons",
        description=run_mask.__doc__,
        epilog=MASK_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    mask.set_defaults(run=run_mask)
    mask.add_argument("file", metavar="FILE", help="GeoJSON, or annotations in the format of COCO")
    mask.add_argument("-o", "--out", required=True, metavar="OUT", help="where the picture goes; see below")
    mask.add_argument("--labels", metavar="NAME", help="write numbers: index, or a property")
    mask.add_argument(
        "--rule", choices=[str(rule) for rule in Rule], default="evenodd", help="what is inside (evenodd)"
    )
    mask.add_argument("--sampling", choices=[str(s) for s in Sampling], default="center", help="how pixels are sampled")
    mask.add_argument("--size", type=size, metavar="WxH", help=f"of the picture (the longer side {DEFAULT_SIDE})")
    mask.add_argument(
        "--extent", type=float, nargs=4, metavar=("X_MIN", "X_MAX", "Y_MIN", "Y_MAX"), help="what is shown (all)"
    )
    mask.add_argument("--no-crowds", action="store_true", help="leave out annotations of COCO that are crowds")
    mask.add_argument("--image", metavar="NAME", help="the one of several images, its file name without the end")
    mask.add_argument(
        "--max-crossings",
        type=positive,
        default=MAX_CROSSINGS,
        metavar="N",
        help=f"refuse rings that cross more often with --sampling area, outer and inner ({MAX_CROSSINGS})",
    )
    mask.add_argument("--threads", type=positive, metavar="N", help="how many at most")
