"""The words that options take, as types: editors complete them, and type checkers find those that are misspelt.

A function of yours that passes an option on says so: ``def draw(mesh, cull: topleft.typing.CullOption = "back")``.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

__all__ = [
    "AlphaModeOption",
    "AlphaOption",
    "BakeOption",
    "BakeRuleOption",
    "BlendOption",
    "BoundaryOption",
    "ClipDepthOption",
    "CullOption",
    "DepthTestOption",
    "EdgesOption",
    "EncodingOption",
    "FilterModeOption",
    "FilterOption",
    "FitOption",
    "LayerOption",
    "LightKindOption",
    "LossOption",
    "MethodOption",
    "OnErrorOption",
    "OrderOption",
    "OutputOption",
    "PerOption",
    "PointShapeOption",
    "PointUnitOption",
    "RasterKindOption",
    "ResolveOption",
    "RuleOption",
    "SamplesOption",
    "SamplingOption",
    "ShadingOption",
    "SpaceOption",
    "SurfaceOption",
    "TakenOption",
    "TiffCompressionOption",
    "UpOption",
    "VoxelRuleOption",
    "WindingOption",
    "WrapOption",
    "YOption",
    "ZarrCompressionOption",
]

# Options of the verbs on arrays

AlphaOption: TypeAlias = Literal["straight", "premultiplied"]
BlendOption: TypeAlias = Literal["replace", "over", "add", "multiply", "max", "min"]
ClipDepthOption: TypeAlias = Literal["minus_one_to_one", "zero_to_one"]
CullOption: TypeAlias = Literal["none", "back", "front"]
DepthTestOption: TypeAlias = Literal["less", "greater"]
MethodOption: TypeAlias = Literal[
    "auto",
    "topleft",
    "edge",
    "scanline",
    "point_in_triangle",
    "point_in_triangle/top-left",
    "edge_increment",
    "edge_increment/integer",
    "edge_increment/bottom-right",
    "zigzag",
    "bresenham_scanline",
    "bresenham_scanline/top-left",
    "bresenham_scanline/wireframe",
    "lerp_scanline",
    "lerp_scanline/plus-one",
    "row_crossing",
    "row_crossing/zero-area-test",
    "row_crossing/cull-back",
    "row_crossing/cull-front",
    "float_barycentric",
    "float_barycentric/float64",
]
OutputOption: TypeAlias = Literal[
    "coverage", "overdraw", "color", "triangle", "depth", "mask", "barycentric", "interpolate"
]
PerOption: TypeAlias = Literal["auto", "triangle", "vertex"]
PointShapeOption: TypeAlias = Literal["disc", "square"]
ResolveOption: TypeAlias = Literal["values", "linear"]
RuleOption: TypeAlias = Literal["evenodd", "nonzero"]
SamplesOption: TypeAlias = Literal["center", "msaa2", "msaa4", "msaa8", "msaa16"]
SamplingOption: TypeAlias = Literal["center", "msaa2", "msaa4", "msaa8", "msaa16", "area", "outer", "inner"]
BakeOption: TypeAlias = Literal["position", "normal", "tangent_normal", "color", "triangle"]
BakeRuleOption: TypeAlias = Literal["center", "touched", "area"]
TakenOption: TypeAlias = Literal["best", "mean"]
VoxelRuleOption: TypeAlias = Literal["center", "touched"]
WindingOption: TypeAlias = Literal["either", "clockwise", "counter-clockwise"]

# Grids and cameras

FitOption: TypeAlias = Literal["sphere", "box", "points", "silhouette"]
SurfaceOption: TypeAlias = Literal["upper", "lower"]
UpOption: TypeAlias = Literal["y", "z"]
YOption: TypeAlias = Literal["up", "down"]

# Meshes, materials, textures, light

AlphaModeOption: TypeAlias = Literal["opaque", "mask", "blend"]
EncodingOption: TypeAlias = Literal["srgb", "linear"]
FilterOption: TypeAlias = Literal["trilinear", "bilinear", "nearest", "pixelated"]
LightKindOption: TypeAlias = Literal["directional", "point", "spot"]
PointUnitOption: TypeAlias = Literal["px", "world"]
ShadingOption: TypeAlias = Literal["smooth", "flat", "unlit", "matcap", "ids", "depth", "normals"]
SpaceOption: TypeAlias = Literal["world", "eye"]
WrapOption: TypeAlias = Literal["repeat", "clamp", "mirror"]

# Layers and batches

LayerOption: TypeAlias = Literal[
    "color",
    "alpha",
    "silhouette",
    "depth",
    "distance",
    "ray_distance",
    "triangle",
    "instance",
    "barycentric",
    "world_position",
    "world_normal",
    "camera_normal",
    "uv",
    "flow",
]
OnErrorOption: TypeAlias = Literal["raise", "collect"]
OrderOption: TypeAlias = Literal["jobs", "completed"]

# Huge rasters

RasterKindOption: TypeAlias = Literal["labels", "depth", "coverage", "overdraw", "fill", "field", "height_map"]
TiffCompressionOption: TypeAlias = Literal["deflate", "none"]
ZarrCompressionOption: TypeAlias = Literal["gzip", "zstd", "none"]

# `topleft.torch`, in the words of nvdiffrast

BoundaryOption: TypeAlias = Literal["wrap", "clamp", "zero", "cube"]
LossOption: TypeAlias = Literal["l2"]
EdgesOption: TypeAlias = Literal["silhouette", "area", "straight-through"]
FilterModeOption: TypeAlias = Literal["auto", "nearest", "linear", "linear-mipmap-nearest", "linear-mipmap-linear"]
