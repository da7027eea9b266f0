"""Whatever is given for an argument, a public function works or says in a line of its own what is wrong with it."""

import inspect
import linecache
import traceback
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import topleft as tl
from topleft import methods, testing
from topleft._apps.explore.content import content_of

ROOT = Path(tl.__file__).parent
CUBE = tl.Mesh(*tl.scenes.shape("cube"))
SCENE = tl.Scene([CUBE])
CAMERA = tl.Camera.framing(CUBE)
SIZE = (8, 6)
FLAT = [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]
POINTS = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.5], [0.0, 4.0, 0.0]]
ONE = [[0, 1, 2]]
FRAGS = tl.rasterize_mesh(CUBE, CAMERA, SIZE)
LAYERS = tl.peel(CUBE.vertices, CUBE.triangles, SIZE, transform=CAMERA.clip_from_world(SIZE), layers=2)
POSES = tl.rasterize_poses([POINTS, POINTS], ONE, SIZE)
CLOUD = tl.points(POINTS, SIZE)
TABLE = tl.overlap([FLAT], SIZE)
PLAN = tl.plan(POINTS, ONE, SIZE)
VIEWS = tl.render_layers(CUBE, CAMERA, SIZE, layers=["depth"])
IDS = tl.render_layers(CUBE, CAMERA, SIZE, layers=["instance"])
OBJECTS = tl.object_masks(SCENE, CAMERA, SIZE)
CHART = tl.Mesh(POINTS, ONE, uv=[[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]])
LEVELS = tl.Levels(CUBE, [tl.Level(tl.Mesh(*tl.scenes.tetrahedron()), 0.5)])
RASTER = tl.tiles((FLAT, ONE), SIZE, kind="coverage", extent=(0, 8, 0, 6))
DRAW = tl.Rasterizer(SIZE)
TRANSFORMS = {"fl_x": 9.0, "frames": [{"transform_matrix": np.eye(4).tolist()}]}
PYTORCH3D = {"R": np.eye(3)[None], "T": np.zeros((1, 3)), "focal_length": 2.0, "principal_point": np.zeros((1, 2))}
VIEW = {
    "transform": None, "origin": (0, 0), "viewport": None, "subpixel_bits": 8, "sampling": "center", "method": "auto",
    "cull": "none", "clip_depth": "minus_one_to_one", "threads": None,
}  # fmt: skip
LOOK = {
    "lights": None, "ambient": None, "material": None, "matcap": None, "fog": None, "shading": "smooth",
    "color": (9, 9, 9), "background": (9, 9, 9),
}  # fmt: skip

#: Each function with arguments that suit it.
CALLS = {
    "Camera": (tl.Camera, {"view": np.eye(4), "projection": np.eye(4), "aspect": 1.0, "lens": None}),
    "Camera.framing": (tl.Camera.framing, {"subject": CUBE, "azimuth_deg": 1, "elevation_deg": 2, "fov_y_deg": 30,
                                           "up": "y", "aspect": 1.0, "fit": "sphere"}),
    "Camera.look_at": (tl.Camera.look_at, {"eye": (0, 0, 5), "target": (0, 0, 0), "up": (0, 1, 0), "fov_y_deg": 30,
                                           "ortho_height": None, "near": None, "far": None}),
    "Camera.perspective": (tl.Camera.perspective, {"view": np.eye(4), "near": 1, "far": 2, "fov_y_deg": 40}),
    "Camera.orthographic": (tl.Camera.orthographic, {"view": np.eye(4), "near": 1, "far": 2, "height": 1}),
    "Camera.off_center": (tl.Camera.off_center, {"view": np.eye(4), "left": -1, "right": 1, "bottom": -1, "top": 1,
                                                 "near": 1, "far": 2}),
    "Camera.from_matrix": (tl.Camera.from_matrix, {"clip_from_world": CAMERA.clip_from_world(SIZE)}),
    "Camera.from_intrinsics": (tl.Camera.from_intrinsics, {"intrinsics": np.eye(3), "camera_from_world": np.eye(4),
                                                           "size": SIZE, "near": 1, "far": 2, "distortion": None,
                                                           "fisheye": None}),
    "Camera.from_opengl": (tl.Camera.from_opengl, {"c2w": np.eye(4), "intrinsics": np.eye(3), "size": SIZE,
                                                   "fov_y_deg": None, "pixel_center": 0.5, "near": 1, "far": 2,
                                                   "distortion": None, "fisheye": None}),
    "Camera.from_colmap": (tl.Camera.from_colmap, {"camera": "1 PINHOLE 8 6 5 5 4 3", "image": "1 1 0 0 0 0 0 4 1 a",
                                                   "pixel_center": 0.5, "near": 1, "far": 2}),
    "Camera.from_nerfstudio": (tl.Camera.from_nerfstudio, {"transforms": TRANSFORMS, "i": 0, "size": SIZE,
                                                           "pixel_center": 0.5, "near": 1, "far": 2}),
    "Camera.from_pytorch3d": (tl.Camera.from_pytorch3d, {"cameras": PYTORCH3D, "i": 0, "size": SIZE,
                                                         "pixel_center": 0.5, "near": 1, "far": 2}),
    "Camera.project": (CAMERA.project, {"points": [[0, 0, 0]], "size": SIZE}),
    "Camera.distance_of": (CAMERA.distance_of, {"depth": [[0.5]]}),
    "Camera.clip_from_world": (CAMERA.clip_from_world, {"size": SIZE}),
    "FisheyeLens": (tl.FisheyeLens, {"k1": 0.1}),
    "Fog": (tl.Fog, {"near": 1, "far": 2, "color": (0, 0, 0)}),
    "Grid": (tl.Grid, {"size": SIZE, "extent": (0, 1, 0, 1), "y": "up"}),
    "Grid.around": (tl.Grid.around, {"subject": (FLAT, ONE), "size": SIZE, "pixel_size": None, "extent": None,
                                     "y": "up"}),
    "Instance": (tl.Instance, {"mesh": CUBE, "transform": np.eye(4), "name": None, "color": None, "material": None}),
    "Light": (tl.Light, {"at": (0, 0, 1), "kind": "point", "color": (1, 2, 3), "intensity": 1, "falloff": 0,
                         "space": "eye"}),
    "Material": (tl.Material, {"color": None, "texture": None, "specular": 0, "shininess": 1, "back_color": None,
                               "alpha_cutoff": None}),
    "Mesh": (tl.Mesh, {"vertices": POINTS, "triangles": ONE, "normals": None, "colors": None, "uv": None,
                       "materials": (), "material_of_triangle": None}),
    "OpenCVLens": (tl.OpenCVLens, {"k1": 0.1}),
    "Rasterizer": (tl.Rasterizer, {"size": SIZE, "threads": None}),
    "Scene": (tl.Scene, {"instances": [CUBE]}),
    "Texture": (tl.Texture, {"image": np.zeros((2, 2), np.uint8), "filter": "nearest", "wrap": "clamp"}),
    "area_vjp": (tl.area_vjp, {"vertices": POINTS, "triangles": ONE, "size": SIZE, "grad": np.ones((6, 8)),
                               "colors": None, "threads": None}),
    "as_mesh": (tl.as_mesh, {"subject": CUBE}),
    "bake": (tl.bake, {"mesh": CHART, "what": "position", "size": SIZE, "rule": "center", "gutter": 2, "source": None,
                       "max_distance": None, "cameras": None, "blend": "best", "threads": None}),
    "bresenham_line": (tl.bresenham_line, {"x0": 0, "y0": 0, "x1": 3, "y1": 2}),
    "choose_detail": (tl.choose_detail, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "tolerance": 0.0,
                                         "viewport": None, "cull": "none"}),
    "composite": (tl.composite, {"layers": LAYERS, "colors": np.zeros((12, 3), np.uint8), "opacity": 0.5,
                                 "background": None, "threads": None}),
    "coverage": (tl.coverage, {"vertices": FLAT, "triangles": ONE, "size": SIZE, "out": None, **VIEW}),
    "explore": (content_of, {"vertices": FLAT, "triangles": ONE, "size": SIZE}),  # what it does before it is seen
    "field": (tl.field, {"mesh": (FLAT, ONE), "values": [1.0, 2.0, 3.0], "size": SIZE, "extent": None,
                         "pixel_size": None, "y": "up", "per": "vertex", "subpixel_bits": 8, "threads": None,
                         "out": None, "origin": (0, 0), "window": None, "nodata": None}),
    "fill": (tl.fill, {"vertices": FLAT, "triangles": ONE, "colors": [[9, 9, 9]], "size": SIZE, "per": "triangle",
                       "background": None, "blend": "replace", "alpha": "straight", "resolve": "values",
                       "dtype": None, "out": None}),
    "height_map": (tl.height_map, {"mesh": (POINTS, ONE), "spacing": 1.0, "surface": "upper", "extent": None,
                                   "y": "up", "subpixel_bits": 8, "threads": None, "out": None}),
    "load": (tl.load, {"path": "nothing.obj"}),
    "overdraw": (tl.overdraw, {"vertices": FLAT, "triangles": ONE, "size": SIZE, "out": None}),
    "peel": (tl.peel, {"vertices": POINTS, "triangles": ONE, "size": SIZE, "layers": 2}),
    "plan": (tl.plan, {"vertices": POINTS, "triangles": ONE, "size": SIZE, "outputs": "triangle",
                       "depth_test": "less", "tolerance": 0.0}),
    "rasterize": (tl.rasterize, {"vertices": POINTS, "triangles": ONE, "size": SIZE, "depth_test": "less",
                                 "background_depth": None, "out": None, **VIEW}),
    "rasterize_poses": (tl.rasterize_poses, {"vertices": [POINTS, POINTS], "triangles": ONE, "size": SIZE,
                                             "depth_test": "less", "background_depth": None, "out": None, **VIEW}),
    "rasterize_mesh": (tl.rasterize_mesh, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "cull": "none",
                                           "tolerance": 0.0, "threads": None, "rasterizer": None, "origin": (0, 0),
                                           "viewport": None}),
    "render": (tl.render, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "cull": "none", "sampling": "center",
                           "tolerance": 0.0, "threads": None, "rasterizer": None, **LOOK}),
    "render_batch": (lambda **given: list(tl.render_batch(**given)),
                     {"jobs": [tl.Job(CUBE, CAMERA, SIZE)], "executor": None, "progress": None, "on_error": "raise",
                      "order": "jobs", "chunk": 1, "window": None}),
    "Job": (lambda **given: list(tl.render_batch([tl.Job(**given)])),
            {"scene": CUBE, "camera": CAMERA, "size": SIZE, "options": {}, "destination": None, "layers": ()}),
    "render_layers": (tl.render_layers, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "layers": "depth",
                                         "attributes": None, "camera_to": None, "transforms_to": None,
                                         "cull": "none", "tolerance": 0.0, "threads": None, "rasterizer": None}),
    "render_transparent": (tl.render_transparent, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "opacity": 0.5,
                                                   "layers": 2, "shading": "smooth", "background": (0, 0, 0),
                                                   "cull": "none", "tolerance": 0.0, "threads": None}),
    "save_image": (tl.save_image, {"path": "x.nothing", "image": np.zeros((2, 2), np.uint8), "text": None}),
    "shade": (tl.shade, {"frags": FRAGS, "mesh": CUBE, "camera": CAMERA, "depth_range": None, "threads": None, **LOOK}),
    "silhouette": (tl.silhouette, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "sampling": "center", "cull": "none",
                                   "tolerance": 0.0, "threads": None, "out": None}),
    "turntable": (tl.turntable, {"subject": CUBE, "n": 2}),
    "viewpoints": (tl.viewpoints, {"subject": CUBE, "n": 2}),
    "visible_faces": (tl.visible_faces, {"mesh": CUBE, "cameras": [CAMERA], "size": SIZE, "min_pixels": 1, "cull": None,
                                         "executor": None}),
    "voxelize": (tl.voxelize, {"mesh": CUBE, "shape": 4, "pitch": None, "bounds": None, "solid": True, "rule": "center",
                               "samples": 1, "threads": None}),
    "visible_layers": (tl.visible_layers, {"mesh": CUBE, "camera": CAMERA, "size": SIZE, "layers": 2}),
    "wireframe": (tl.wireframe, {"vertices": FLAT, "triangles": ONE, "size": SIZE, "depth": None,
                                 "depth_test": "less", "depth_bias": 0.1, "out": None}),
    "Environment": (tl.Environment, {"sky": (1, 2, 3), "ground": None, "image": None, "intensity": 1.0,
                                     "up": (0, 1, 0), "turn": 0.0, "space": "world"}),
    "Points": (tl.Points, {"positions": POINTS, "colors": None, "normals": None, "size": 2.0, "unit": "px",
                           "shape": "disc"}),
    "points": (tl.points, {"positions": FLAT, "size": SIZE, "point_size": 1.0, "shape": "square",
                           "depth_test": "less"}),
    "polygons": (tl.polygons, {"rings": [FLAT], "size": SIZE, "rule": "evenodd", "values": None, "background": None,
                               "sampling": "center", "origin": (0, 0), "subpixel_bits": 8, "threads": None,
                               "out": None}),
    "to_rle": (tl.to_rle, {"pixels": [FLAT], "size": SIZE, "labels": None, "rule": "evenodd", "subpixel_bits": 8}),
    "object_masks": (tl.object_masks, {"scene": SCENE, "camera": CAMERA, "size": SIZE, "beyond": 1.0, "cull": None,
                                       "subpixel_bits": 8, "threads": None}),
    "ObjectMasks.visible": (OBJECTS.visible, {"i": 0}),
    "ObjectMasks.full": (OBJECTS.full, {"i": 0}),
    "ObjectMasks.rle": (OBJECTS.rle, {"which": "full"}),
    "ObjectMasks.scene_gt_info": (OBJECTS.scene_gt_info, {"depth": None}),
    "ObjectMasks.annotations": (OBJECTS.annotations, {"image_id": 0, "category_ids": None, "first_id": 1,
                                                      "which": "visible"}),
    "ViewLayers.rle": (IDS.rle, {"layer": "instance", "labels": None}),
    "overlap": (tl.overlap, {"rings": [FLAT], "size": SIZE, "rule": "evenodd", "origin": (0, 0), "subpixel_bits": 8,
                             "threads": None, "out": None}),
    "load_cameras": (tl.load_cameras, {"path": "nothing.gltf"}),
    "pixel_grid": (tl.pixel_grid, {"values": np.eye(3), "vertices": FLAT, "triangles": ONE, "size": None,
                                   "sampling": None, "cell": 9, "edge_color": "red", "path": None}),
    "Grid.from_transform": (tl.Grid.from_transform, {"transform": (1, 0, 0, 0, -1, 0), "size": 3}),
    "Fragments.sample texture": (FRAGS.sample, {"texture": np.eye(3), "uv": CUBE.vertices[:, :2], "filter": "nearest",
                                                "wrap": "clamp", "encoding": "linear", "background": 0.0}),
    "Fragments.sample_vjp": (FRAGS.sample_vjp, {"texture": np.eye(3), "uv": CUBE.vertices[:, :2],
                                                "grad": np.ones(FRAGS.mask.shape), "filter": "nearest",
                                                "wrap": "clamp", "encoding": "linear"}),
    "Fragments.distance": (FRAGS.distance, {"camera": CAMERA}),
    "Fragments.antialias": (FRAGS.antialias, {"picture": np.ones(FRAGS.mask.shape), "edges": "area"}),
    "Fragments.antialias_vjp": (FRAGS.antialias_vjp, {"picture": np.ones(FRAGS.mask.shape),
                                                      "grad": np.ones(FRAGS.mask.shape), "edges": "area"}),
    "Fragments.barycentric_vjp": (FRAGS.barycentric_vjp, {"grad": np.ones((*FRAGS.mask.shape, 3))}),
    "Fragments.depth_vjp": (FRAGS.depth_vjp, {"grad": np.ones(FRAGS.mask.shape)}),
    "Fragments.interpolate_vjp": (FRAGS.interpolate_vjp, {"values": CUBE.vertices,
                                                          "grad": np.ones((*FRAGS.mask.shape, 3)),
                                                          "grad_derivatives": None}),
    "Fragments.interpolate": (FRAGS.interpolate, {"values": CUBE.vertices, "background": 0.0}),
    "merge": (tl.merge, {"buffers": [tl.rasterize(FLAT, ONE, SIZE)], "triangles": [0], "depth_test": "less",
                         "threads": None}),
    "tiles": (tl.tiles, {"mesh": (FLAT, ONE), "size": SIZE, "kind": "labels", "values": None, "window": 32,
                         "extent": None, "pixel_size": None, "y": "up", "threads": None, "memory": 1 << 20,
                         "folder": None}),
    "Fragments.sample": (FRAGS.sample, {"texture": 0}),
    "Fragments.only": (FRAGS.only, {"rows": np.array([0]), "cols": np.array([0])}),
    "FragmentsBatch.interpolate": (POSES.interpolate, {"values": POINTS, "background": 0.0}),
    "PointFragments": (tl.PointFragments, {"ids": CLOUD.id[None], "depth": CLOUD.depth[None], "n_points": 3}),
    "PointFragments.interpolate": (CLOUD.interpolate, {"values": [1.0, 2.0, 3.0], "background": 0.0}),
    "PointFragments.sample": (CLOUD.sample, {"texture": np.eye(3), "uv": [[0.0, 0.0]] * 3, "filter": "nearest",
                                             "wrap": "clamp"}),
    "PointFragments.only": (CLOUD.only, {"rows": np.array([0]), "cols": np.array([0])}),
    "DepthLayers.layer": (LAYERS.layer, {"k": 0}),
    "Overlap.means": (TABLE.means, {"raster": np.ones((6, 8))}),
    "Overlap.sums": (TABLE.sums, {"raster": np.ones((6, 8))}),
    **{f"Overlap.{name}": (getattr(TABLE, name), {"raster": np.ones((6, 8))})
       for name in ("counts", "minima", "maxima", "stdevs", "majorities")},
    "Overlap.quantiles": (TABLE.quantiles, {"raster": np.ones((6, 8)), "q": 0.5}),
    "Overlap.spread": (TABLE.spread, {"values": [1.0]}),
    "Plan.measure": (PLAN.measure, {"n_rounds": 1}),
    "Grid.like": (tl.Grid.like, {"raster": SimpleNamespace(transform=(1, 0, 0, 0, -1, 0), width=8, height=6)}),
    "Grid.to_xarray": (tl.Grid(SIZE, (0, 1, 0, 1)).to_xarray, {"array": np.ones((6, 8)), "name": None}),
    "Grid.to_pixels": (tl.Grid(SIZE, (0, 1, 0, 1)).to_pixels, {"points": FLAT}),
    "Camera.clip_from_eye": (CAMERA.clip_from_eye, {"size": SIZE}),
    "OpenCVLens.distort": (tl.OpenCVLens(k1=0.1).distort, {"points": POINTS}),
    "FisheyeLens.distort": (tl.FisheyeLens(0.1).distort, {"points": POINTS}),
    "ViewLayers.save": (VIEWS.save, {"path": "layers.npz", "layer": None, "depth_scale": 0.1}),
    "Levels.save": (LEVELS.save, {"path": "levels.npz"}),
    "Levels.load": (tl.Levels.load, {"path": "nothing.npz", "mesh": CUBE}),
    "Tiles.read": (RASTER.read, {"x": 0, "y": 0, "width": 2, "height": 2}),
    "Tiles.to_zarr": (RASTER.to_zarr, {"path": "a.zarr", "chunk": None, "compression": "none", "levels": 1,
                                       "progress": None, "storage": None}),
    "Tiles.to_geotiff": (RASTER.to_geotiff, {"path": "a.tif", "crs": None, "nodata": None, "compression": "none",
                                             "tile": 512, "progress": None}),
    "Tiles.to_deepzoom": (tl.tiles((FLAT, ONE), SIZE, kind="coverage").to_deepzoom,
                          {"path": "a.dzi", "tile": 256, "colors": None, "progress": None}),
    "Rasterizer.coverage": (DRAW.coverage, {"vertices": FLAT, "triangles": ONE, "out": None}),
    "Rasterizer.overdraw": (DRAW.overdraw, {"vertices": FLAT, "triangles": ONE, "out": None}),
    "Rasterizer.fill": (DRAW.fill, {"vertices": FLAT, "triangles": ONE, "colors": [[9, 9, 9]]}),
    "Rasterizer.rasterize": (DRAW.rasterize, {"vertices": POINTS, "triangles": ONE, "background_depth": None}),
    "Rasterizer.wireframe": (DRAW.wireframe, {"vertices": FLAT, "triangles": ONE, "depth": None}),
    "scenes.shape": (tl.scenes.shape, {"name": "cube"}),
    "scenes.icosphere": (tl.scenes.icosphere, {"subdivisions": 1}),
    "scenes.torus": (tl.scenes.torus, {"radius": 1.0, "tube_radius": 0.5, "segments": 3, "sections": 3}),
    "scenes.torus_knot": (tl.scenes.torus_knot, {"p": 2, "q": 3, "tube_radius": 0.3, "segments": 8, "sections": 3}),
    "scenes.blob": (tl.scenes.blob, {"n_triangles": 20, "seed": 0}),
    "scenes.large_triangle": (tl.scenes.large_triangle, {"width": 8, "height": 6}),
    "scenes.random_triangles": (tl.scenes.random_triangles, {"n": 3, "size_px": 2.0, "width": 8, "height": 6,
                                                             "seed": 0}),
    "scenes.planar_mesh": (tl.scenes.planar_mesh, {"n_points": 9, "width": 8, "height": 6, "seed": 0}),
    "scenes.tight_fan": (tl.scenes.tight_fan, {"n": 4}),
    "scenes.to_clip": (tl.scenes.to_clip, {"vertices": np.array(POINTS), "matrix": np.eye(4)}),
    "scenes.to_pixels": (tl.scenes.to_pixels, {"clip": np.ones((2, 4)), "width": 8, "height": 6}),
    "testing.assert_same_picture": (testing.assert_same_picture, {"got": np.eye(3), "expected": np.eye(3),
                                                                  "tolerance": 0.0, "path": None}),
    "testing.hard_scenes": (lambda **given: list(testing.hard_scenes(**given)), {"kind": "dust"}),
    "testing.words_of": (testing.words_of, {"buffer": np.eye(3)}),
    "methods.find_method": (methods.find_method, {"name": "edge"}),
}  # fmt: skip


#: Functions of the caller that take other things than they are given.
CALLBACKS = {("progress", "function"), ("progress", "type"), ("colors", "type"), ("colors", "function")}


class OnDevice:
    """What cupy's arrays are: of DLPack on a device, and no array of NumPy by itself."""

    shape = (3, 3)

    def __dlpack__(self, **options):
        raise BufferError("on a device")

    def __dlpack_device__(self):
        return 2, 0

    def __array__(self, dtype=None, copy=None):
        raise TypeError("Implicit conversion to a NumPy array is not allowed")


class OnCpu:
    """What arrays of other libraries are at the least: DLPack alone."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return 1, 0


WRONG = {
    "None": None,
    "object": object(),
    "word": "word",
    "bytes": b"word",
    "number": 3,
    "negative": -1,
    "float": 3.5,
    "nan": float("nan"),
    "bool": True,
    "empty": (),
    "list of None": [None],
    "dict": {"a": 1},
    "set": {1},
    "size": (640, 480),
    "floats": (4.5, 3.5),
    "three": (3, 4, 3),
    "words": ["a", "b", "c"],
    "ragged": [[1, 2], [3]],
    "ndarray of words": np.array([["a", "b"]]),
    "complex": np.ones((3, 3), complex),
    "matrix": np.eye(4),
    "singular": np.zeros((4, 4)),
    "rows": np.ones((3, 5)),
    "scalar": np.array(3.0),
    "structured": np.zeros(2, [("a", int)]),
    "function": len,
    "type": int,
    "Mesh": CUBE,
    "Camera": CAMERA,
    "Scene": SCENE,
    "Path": Path("nothing.obj"),
    "pair": (FLAT, ONE),
    "on a device": OnDevice(),
    "list on a device": [OnDevice(), OnDevice()],
    "of DLPack": OnCpu(np.ones((3, 3))),
}


def complaint_of(error: BaseException, *, is_formula: bool = False) -> str | None:
    """None if a function of topleft raised the error by itself, in words; else where it came from.

    The formulas of `topleft.scenes` may leave the words to NumPy and to Python.
    """
    documented = (TypeError, ValueError, IndexError, OSError, AssertionError, tl.TopleftError)  # assert_same_picture
    if not isinstance(error, documented):
        return f"a {type(error).__name__}: {error}"
    if is_formula:
        return None if str(error) else f"an empty {type(error).__name__}"
    frames = traceback.extract_tb(error.__traceback__)
    frame = frames[-1]
    if len(frames) == 1 or ("argument" in str(error) and "() " in str(error)):
        return None  # by Python itself, for a name that the function does not have
    line = frame.line or linecache.getline(frame.filename, frame.lineno or 0)
    if ROOT not in Path(frame.filename).parents or not line.strip().startswith("raise"):
        return f"{type(error).__name__}: {error} (from {frame.filename}:{frame.lineno}: {line.strip()})"
    return None if str(error) else f"an empty {type(error).__name__}"


def complaints(function, right, wrong_names, arguments, *, is_formula=False):
    for argument in arguments:
        for name in wrong_names:
            if (argument, name) in CALLBACKS:
                continue  # `len` of a `Result`, say: the caller's own function fails
            try:
                function(**{**right, argument: WRONG[name]})
            except Exception as error:
                found = complaint_of(error, is_formula=is_formula)
                if found:
                    yield f"{argument}={name}: {found}"


@pytest.mark.usefixtures("folder")
@pytest.mark.filterwarnings("ignore:.*encountered in divide:RuntimeWarning")  # of points at the eye
@pytest.mark.parametrize("name", CALLS)
def test_arguments_that_suit_are_taken(name):
    function, right = CALLS[name]
    if name == "Grid.to_xarray":
        pytest.importorskip("xarray")
    if name in ("load", "load_cameras", "save_image", "Levels.load"):
        with pytest.raises((OSError, tl.TopleftError)):
            function(**right)
    else:
        function(**right)


@pytest.mark.usefixtures("folder")
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CALLS)
def test_wrong_arguments_work_or_are_named(name):
    if name == "scenes.planar_mesh":
        pytest.importorskip("scipy")
    function, right = CALLS[name]
    is_formula = name.startswith("scenes.") and name != "scenes.shape"
    found = list(complaints(function, right, WRONG, right, is_formula=is_formula))
    assert not found, f"{len(found)} of {len(right) * len(WRONG)}:\n" + "\n".join(found)


def test_every_public_callable_is_tried():
    others = {"simplify", "release_memory", "build_info"}  # the first takes seconds, the others nothing
    made = {"DepthLayers", "Detail", "Fragments", "FragmentsBatch", "Level", "Levels", "Plan", "SceneDepthLayers",
            "SceneFragments", "ViewLayers", "ImageError", "MeshError", "MissingPackageError", "TopleftError",
            "MeshWarning", "Explorer", "ObjectMasks", "Overlap", "Tiles", "Window", "Baked",
            "VisibleFaces", "Voxels"}  # fmt: skip
    public = {name for name in tl.__all__ if callable(getattr(tl, name)) and not inspect.ismodule(getattr(tl, name))}
    assert public <= set(CALLS) | others | made


def takes_arguments(function):
    """Whether it takes anything but truth values."""
    parameters = inspect.signature(function).parameters.values()
    return any(each.name != "self" and each.annotation not in (bool, "bool") for each in parameters)


def test_every_promised_method_is_tried(promised):
    promised = [(owner, getattr(tl, owner), name) for owner, names in promised.items() for name in names]
    promised += [("Rasterizer", tl.Rasterizer, name) for name in dir(tl.Rasterizer) if not name.startswith("_")]
    promised += [("testing", testing, name) for name in testing.__all__]
    methods_of = {
        f"{owner}.{name}"
        for owner, home, name in promised
        if callable(found := getattr(home, name)) and takes_arguments(found)
    }
    assert methods_of <= set(CALLS)
