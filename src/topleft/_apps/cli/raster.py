"""`topleft raster`: a mesh or polygons to a raster of any size, in GeoTIFF, Zarr or Deep Zoom."""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from topleft._apps.cli.arguments import (
    FAILED,
    SUBPIXEL_BITS_HELP,
    UsageError,
    add_command,
    positive,
    size,
    subpixel_bits,
)
from topleft._apps.cli.labels import numbers_of, tell_of_background, whole_or_float
from topleft._apps.cli.render import client_of
from topleft._apps.cli.report import complain, complaining
from topleft._apps.tiles.tiles import Tiles, tiles
from topleft._core.base.georeference import is_same_crs, transformed
from topleft._core.base.grid import ExtentLike, Grid, grid_around
from topleft._core.base.remote import Location, RemotePath, location_of
from topleft._core.base.threads import available_threads
from topleft.annex.files import has_polygons, load_polygons
from topleft.annex.windows import WINDOW, extent_of, open_triangles
from topleft.typing import RasterKindOption

if TYPE_CHECKING:
    from topleft._apps.tiles.levels import Written

RASTER_HELP = """\
MESH is a mesh file, or two .npy files with a comma between them: vertices.npy,triangles.npy. Binary STL, binary PLY of
triangles and .npy are mapped and need not fit memory. x and y are the plane, z is the height. GeoJSON and vector files
(.gpkg, .shp, ...) are polygons: their numbers are written unless --values names a property, or --kind coverage asks for
a mask. --crs transforms them.

OUT ends in .tif (cloud-optimised GeoTIFF), .zarr (a folder, or a URL that fsspec reaches) or .dzi (Deep Zoom). Heights
of the upper surface are written unless --labels, --values or --kind asks for something else. An existing OUT is an
error: --resume continues an interrupted run of the same raster, and draws no whole window again; --overwrite replaces
an OUT that topleft has written.

examples:
  topleft raster terrain.ply -o heights.tif --pixel-size 1 --crs EPSG:25832
  topleft raster v.npy,t.npy -o labels.zarr --pixel-size 0.5 --labels --levels 5 --resume
  topleft raster mesh.ply -o depth.tif --pixel-size 10 --values water_depth --nodata -9999
  topleft raster parcels.gpkg -o use.tif --pixel-size 1 --values use_code --nodata 0
"""

SUFFIXES = (".tif", ".tiff", ".zarr", ".dzi")

DIRECT_KINDS = [one for one in get_args(RasterKindOption) if one not in ("field", "fill")]
"""Kinds that need no values."""


def run_raster(options: argparse.Namespace) -> int:
    """Write a raster of a mesh or of polygons, of any size."""
    path = location_of(options.out)
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"-o {options.out}: the name must end in one of {' '.join(SUFFIXES)}")
    is_tiff, is_zarr = path.suffix.lower() in (".tif", ".tiff"), path.suffix.lower() == ".zarr"
    if isinstance(path, RemotePath) and not is_zarr:
        raise UsageError(f"-o {options.out}: {path.suffix} goes to a path of this machine, .zarr to a URL as well")
    if options.crs is not None and not (is_tiff or is_zarr):
        raise UsageError(f"--crs is for .tif and .zarr, got {path.name}")
    if options.levels is not None and not is_zarr:
        raise UsageError(f"--levels is for .zarr, got {path.name}")
    if options.uncompressed and not (is_tiff or is_zarr):
        raise UsageError(f"--uncompressed is for .tif and .zarr, got {path.name}")
    try:
        with ExitStack() as stack, complaining() as lacks:
            raster = raster_of(options)
            if options.nodata is not None:
                raster = raster.with_nodata(options.nodata)
            n_workers = options.threads or available_threads()
            client = None if options.dask is None else client_of(options.dask, n_workers, stack)
            written = write(raster, path, options, client)
    except IndexError as error:  # a triangle that names no vertex
        raise ValueError(f"{options.mesh}: {error}") from None
    if not options.quiet:
        width, height = raster.size
        print(
            f"{options.out}: {width} x {height} {raster.dtype}, {written.n_drawn} windows drawn, "
            f"{written.n_kept} kept, {written.n_blank} blank"
        )
    if not (written.n_drawn or written.n_kept):
        shape = "polygon" if raster.is_of_polygons else "triangle"
        complain(f"no {shape} of {options.mesh} lies within {options.out}: all of it is blank")
    return FAILED if lacks and raster.is_of_polygons else 0


def write(raster: Tiles, path: Location, options: argparse.Namespace, client: Any) -> Written:
    """Write the raster in the format that the name asks for."""
    progress = True if not options.quiet and sys.stderr.isatty() else None
    how: dict[str, Any] = {
        "resume": options.resume,
        "overwrite": options.overwrite,
        "progress": progress,
        "executor": client,
    }
    suffix = path.suffix.lower()
    if suffix == ".zarr":
        return raster.to_zarr(options.out, levels=options.levels or 1, compression=compression(options, "gzip"), **how)
    assert isinstance(path, Path)
    if suffix == ".dzi":
        return raster.to_deepzoom(path, **how)
    return raster.to_geotiff(path, compression=compression(options, "deflate"), **how)


def compression(options: argparse.Namespace, usual: str) -> Any:
    """How pixels are stored."""
    return "none" if options.uncompressed else usual


def raster_of_polygons(options: argparse.Namespace) -> Tiles:
    """Return the raster of a file of polygons."""
    (picture, *more) = load_polygons(options.mesh)
    if more or picture.size is not None:
        raise UsageError(f"{options.mesh} holds annotations of images: topleft mask draws them")
    if options.surface is not None or options.kind not in (None, "labels", "coverage"):
        raise UsageError(f"polygons have numbers, values and a mask, got {options.kind or options.surface}")
    more_options: dict[str, Any] = {} if options.subpixel_bits == 8 else {"subpixel_bits": options.subpixel_bits}
    nodata = options.nodata if options.nodata is not None else -1 if options.values is None else 0
    numbers = np.arange(len(picture.objects), dtype=np.int32)
    if options.values is not None:
        numbers = numbers_of(picture, "--values", options.values, options.mesh, nodata, is_whole=False)
    subject, crs = picture.polygons, options.crs or picture.crs
    if picture.crs is not None and crs is not None and not is_same_crs(picture.crs, crs):
        subject = replace(subject, points=transformed(subject.points, picture.crs, crs))
    grid = _grid(options, extent_of(subject))
    kind: Any = "coverage"
    if options.kind != "coverage" or options.values is not None:
        tell_of_background(picture, numbers, nodata, options.mesh)
        kind, more_options["values"], more_options["background"] = "fill", numbers[picture.owners], nodata
    grid = replace(grid, crs=crs, nodata=None if kind == "coverage" else nodata)
    return tiles(subject, grid, kind=kind, window=options.window, threads=options.threads, **more_options)


def raster_of(options: argparse.Namespace) -> Tiles:
    """Return the raster of the options."""
    if (options.pixel_size is None) == (options.size is None):
        raise UsageError("either --pixel-size or --size must say how large the raster is")
    if has_polygons(Path(options.mesh)):
        return raster_of_polygons(options)
    named = options.mesh.split(",")
    mesh = tuple(named) if len(named) == 2 and all(name.endswith(".npy") for name in named) else options.mesh
    triangles = open_triangles(mesh, options.folder)
    values = None
    kind: Any = options.kind or ("labels" if options.labels else "height_map")
    more: dict[str, Any] = {}
    if options.values is not None:
        kind, values = "field", options.values
    if sum((options.labels, options.values is not None, options.kind is not None)) > 1:
        raise UsageError("--labels, --values and --kind exclude each other: give one of them")
    if kind == "height_map":
        more["surface"] = options.surface or "upper"
    elif options.surface is not None:
        raise UsageError(f"--surface is for heights, got the kind {kind}")
    if options.subpixel_bits != 8:
        more["subpixel_bits"] = options.subpixel_bits
    if kind == "field" and options.nodata is not None:
        more["nodata"] = options.nodata
    return tiles(
        triangles,
        _grid(options, extent_of(triangles)),
        kind=kind,
        values=values,
        window=options.window,
        threads=options.threads,
        folder=options.folder,
        **more,
    )


def _grid(options: argparse.Namespace, box: ExtentLike) -> Grid:
    """The grid of the options, which covers a box unless they say another window."""
    step = options.pixel_size if options.pixel_size is None or len(options.pixel_size) > 1 else options.pixel_size[0]
    return replace(grid_around(options.extent or box, options.size, step, "up"), crs=options.crs)


def add_raster_command(commands: Any) -> None:
    """Add the command to the parsers of the command line."""
    add = add_command(
        commands, "raster", run_raster, "write a raster of any size: heights, values, labels, polygons", RASTER_HELP
    ).add_argument
    add("mesh", metavar="MESH", help="a mesh file, vertices.npy,triangles.npy, or polygons")
    add("-o", "--out", required=True, metavar="OUT", help="a file .tif or .dzi, or a folder .zarr")
    add("--pixel-size", type=float, nargs="+", metavar="N", help="width, and height if it differs, of a pixel in units")
    add("--size", type=size, metavar="WxH", help="how many pixels, instead")
    add("--extent", type=float, nargs=4, metavar=("X_MIN", "X_MAX", "Y_MIN", "Y_MAX"), help="the window to draw (all)")
    add("--crs", metavar="CRS", help="the CRS of x and y: EPSG:25832, say")
    add("--labels", action="store_true", help="write which triangle shows, -1 for none")
    add("--values", metavar="FIELD", help="write values: a .npy file, or a name in a file of PLY, VTK, VTU or a solver")
    add("--kind", choices=DIRECT_KINDS, help="the content of pixels")
    add("--surface", choices=("upper", "lower"), help="the surface that gives heights (upper)")
    add("--subpixel-bits", type=subpixel_bits, default=8, metavar="N|exact", help=SUBPIXEL_BITS_HELP)
    add("--nodata", type=whole_or_float, metavar="N", help="the number of pixels where nothing is")
    add("--levels", type=positive, metavar="N", help="resolutions of a .zarr, each half as wide (1)")
    add("--uncompressed", action="store_true", help="store pixels as they are")
    add("--window", type=positive, default=WINDOW, metavar="N", help=f"side of a window ({WINDOW})")
    add("--resume", action="store_true", help="continue an interrupted run")
    add("--overwrite", action="store_true", help="replace OUT, if topleft wrote it")
    add("--folder", metavar="DIR", help="where temporary files go")
    add("--threads", type=positive, metavar="N", help="how many at most")
    add("--dask", metavar="ADDRESS", help="let the workers of a Dask cluster draw: its scheduler, or local")
    add("--quiet", action="store_true", help="show no bar and print nothing")
