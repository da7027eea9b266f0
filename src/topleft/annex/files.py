"""Reads and writes files as the command line does: PNG, layers, polygons and masks, within limits of memory."""

from topleft._core.polygons.rle import encode_polygons
from topleft._core.raster.rle import annotation_members, annotation_of
from topleft._meshes.io import png
from topleft._meshes.io.images import read_record, write_image
from topleft._meshes.io.layer_files import layer_paths, save_layers
from topleft._meshes.io.limits.budget import LIMITS, Budget
from topleft._meshes.io.limits.npy import arrays_of
from topleft._meshes.io.load import clip_length
from topleft._meshes.io.polygon_files import NO_RINGS, PolygonPicture, has_polygons, load_polygons
from topleft._meshes.io.references import read_picture

__all__ = [
    "LIMITS",
    "NO_RINGS",
    "Budget",
    "PolygonPicture",
    "annotation_members",
    "annotation_of",
    "arrays_of",
    "clip_length",
    "encode_polygons",
    "has_polygons",
    "layer_paths",
    "load_polygons",
    "png",
    "read_picture",
    "read_record",
    "save_layers",
    "write_image",
]
