"""Exact, watertight triangle rasterization on the CPU: NumPy arrays in, NumPy arrays out.

What most programs need:

    load, Mesh, Scene           a mesh from a file or from arrays; meshes with poses
    Camera                      framing, look_at, from_intrinsics and others
    render, save_image          a picture of a mesh, and its file
    render_layers               depth, ids, normals and more of a view
    coverage, fill, rasterize   triangles in pixels to a mask, to colours, to ids and depth
    polygons, overlap           polygons to masks and labels, to exact areas
    field, height_map, Grid     values and heights of a mesh on a regular grid

All names, by task:

    triangles     coverage, overdraw, fill, rasterize, Fragments, Rasterizer
    layers        rasterize_poses, FragmentsBatch, area_vjp, wireframe, bresenham_line, pixel_grid, peel, DepthLayers,
                  composite, points, PointFragments, Points
    polygons      polygons, overlap, Overlap, to_rle
    meshes        load, as_mesh, Mesh, Instance, Scene, Material, Texture, Light, Fog, Environment
    cameras       Camera, OpenCVLens, FisheyeLens, load_cameras, turntable, viewpoints
    pictures      render, render_transparent, silhouette, save_image, render_batch, Job, simplify, Levels, Level,
                  choose_detail, Detail
    views         render_layers, ViewLayers, rasterize_mesh, SceneFragments, shade, object_masks, ObjectMasks,
                  visible_layers, SceneDepthLayers
    grids         field, height_map, Grid, voxelize, Voxels, bake, Baked, visible_faces, VisibleFaces
    tiles         tiles, Tiles, Window, merge
    tools         plan, Plan, explore, Explorer, scenes, build_info, release_memory, __version__
    errors        TopleftError, MeshError, ImageError, MissingPackageError, MeshWarning
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, get_type_hints

from topleft import scenes
from topleft._core.base.grid import Grid
from topleft._core.base.memory import release_memory
from topleft._core.engine.isa import build_info
from topleft._core.polygons.overlap import Overlap, overlap
from topleft._core.polygons.polygons import polygons
from topleft._core.polygons.rle import to_rle
from topleft._core.raster.backward import area_vjp
from topleft._core.raster.classic import bresenham_line
from topleft._core.raster.composite import composite
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.peel import DepthLayers, peel
from topleft._core.raster.points import PointFragments, points
from topleft._core.raster.poses import FragmentsBatch, rasterize_poses
from topleft._core.raster.verbs import Rasterizer, coverage, fill, overdraw, rasterize, wireframe
from topleft._meshes.camera.camera import Camera
from topleft._meshes.camera.file_cameras import load_cameras
from topleft._meshes.camera.lens import FisheyeLens, OpenCVLens
from topleft._meshes.camera.viewpoints import turntable, viewpoints
from topleft._meshes.field.field import field, height_map
from topleft._meshes.io.images import save_image
from topleft._meshes.io.load import load
from topleft._meshes.lod.detail import Detail, choose_detail
from topleft._meshes.lod.levels import Level, Levels
from topleft._meshes.lod.simplify import simplify
from topleft._meshes.model.environment import Environment
from topleft._meshes.model.light import Fog, Light
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh
from topleft._meshes.model.points import Points
from topleft._meshes.model.texture import Texture
from topleft._meshes.picture import notebook
from topleft._meshes.picture.fragments import SceneDepthLayers, SceneFragments
from topleft._meshes.picture.render import rasterize_mesh, render, shade
from topleft._meshes.picture.silhouette import silhouette
from topleft._meshes.plan.plan import Plan, plan
from topleft._meshes.scene.adapt import as_mesh
from topleft._meshes.scene.scene import Instance, Scene
from topleft.errors import ImageError, MeshError, MeshWarning, MissingPackageError, TopleftError

if TYPE_CHECKING:
    from topleft._apps.batch.batch import render_batch
    from topleft._apps.batch.jobs import Job
    from topleft._apps.batch.visible import VisibleFaces, visible_faces
    from topleft._apps.diagram.pixel_grid import pixel_grid
    from topleft._apps.explore.open import Explorer, explore
    from topleft._apps.tiles.tiles import Tiles, tiles
    from topleft._core.raster.merge import merge
    from topleft._meshes.grid.bake import Baked, bake
    from topleft._meshes.grid.voxels import Voxels, voxelize
    from topleft._meshes.picture.object_masks import ObjectMasks, object_masks
    from topleft._meshes.picture.transparent import render_transparent, visible_layers
    from topleft._meshes.picture.view_layers import ViewLayers, render_layers
    from topleft._meshes.windows.raster import Window

# Names that most programs do without, imported at first use: a third of the package's import time.
_LATE = {
    "Baked": "topleft._meshes.grid.bake",
    "Explorer": "topleft._apps.explore.open",
    "Job": "topleft._apps.batch.jobs",
    "ObjectMasks": "topleft._meshes.picture.object_masks",
    "Tiles": "topleft._apps.tiles.tiles",
    "ViewLayers": "topleft._meshes.picture.view_layers",
    "VisibleFaces": "topleft._apps.batch.visible",
    "Voxels": "topleft._meshes.grid.voxels",
    "Window": "topleft._meshes.windows.raster",
    "bake": "topleft._meshes.grid.bake",
    "explore": "topleft._apps.explore.open",
    "merge": "topleft._core.raster.merge",
    "object_masks": "topleft._meshes.picture.object_masks",
    "pixel_grid": "topleft._apps.diagram.pixel_grid",
    "render_batch": "topleft._apps.batch.batch",
    "render_layers": "topleft._meshes.picture.view_layers",
    "render_transparent": "topleft._meshes.picture.transparent",
    "tiles": "topleft._apps.tiles.tiles",
    "visible_faces": "topleft._apps.batch.visible",
    "visible_layers": "topleft._meshes.picture.transparent",
    "voxelize": "topleft._meshes.grid.voxels",
}

__version__: str = build_info()["version"]

__all__ = [
    "Baked",
    "Camera",
    "DepthLayers",
    "Detail",
    "Environment",
    "Explorer",
    "FisheyeLens",
    "Fog",
    "Fragments",
    "FragmentsBatch",
    "Grid",
    "ImageError",
    "Instance",
    "Job",
    "Level",
    "Levels",
    "Light",
    "Material",
    "Mesh",
    "MeshError",
    "MeshWarning",
    "MissingPackageError",
    "ObjectMasks",
    "OpenCVLens",
    "Overlap",
    "Plan",
    "PointFragments",
    "Points",
    "Rasterizer",
    "Scene",
    "SceneDepthLayers",
    "SceneFragments",
    "Texture",
    "Tiles",
    "TopleftError",
    "ViewLayers",
    "VisibleFaces",
    "Voxels",
    "Window",
    "__version__",
    "area_vjp",
    "as_mesh",
    "bake",
    "bresenham_line",
    "build_info",
    "choose_detail",
    "composite",
    "coverage",
    "explore",
    "field",
    "fill",
    "height_map",
    "load",
    "load_cameras",
    "merge",
    "object_masks",
    "overdraw",
    "overlap",
    "peel",
    "pixel_grid",
    "plan",
    "points",
    "polygons",
    "rasterize",
    "rasterize_mesh",
    "rasterize_poses",
    "release_memory",
    "render",
    "render_batch",
    "render_layers",
    "render_transparent",
    "save_image",
    "scenes",
    "shade",
    "silhouette",
    "simplify",
    "tiles",
    "to_rle",
    "turntable",
    "viewpoints",
    "visible_faces",
    "visible_layers",
    "voxelize",
    "wireframe",
]


def _publish(value: Any) -> Any:
    """Let a class or function say that it is of `topleft`: its pickles, reprs and tracebacks name no room."""
    if isinstance(value, type):
        hints = get_type_hints(value)  # while the module that they are looked up in is that of their file
        value.__annotations__ = {name: hints[name] for name in vars(value).get("__annotations__", ())}
        if "__firstlineno__" in vars(value):  # Python 3.13 would show that line of this file as its source
            del value.__firstlineno__  # type: ignore[attr-defined]
    value.__module__ = __name__
    return value


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        text = f"module {__name__!r} has no attribute {name!r}: help(topleft) lists its names by task"
        raise AttributeError(text, name=name, obj=sys.modules[__name__])
    import_module(_LATE[name])
    for late, file in _LATE.items():  # others that this import has loaded are published, too
        if hasattr(sys.modules.get(file), late):
            globals()[late] = _publish(getattr(sys.modules[file], late))
    return globals()[name]


def __dir__() -> list[str]:
    return sorted(__all__)


for _name in __all__:
    if callable(globals().get(_name)):
        _publish(globals()[_name])
notebook.register()
