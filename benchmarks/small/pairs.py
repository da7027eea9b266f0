"""Times calls that do the same work in several ways, in turns: one table of studies, one record, one way to print it.

A study yields scenes; each has a name and its calls, the first of which the others are held against. Times are CPU
times of the process, one thread unless a call says otherwise.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.arguments import add_out, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import facts_text, table
from benchmarks.scenes.arrays import blob_arrays, strewn_arrays
from benchmarks.scenes.families import NO_SNAP

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

Calls = Mapping[str, Callable[[], object]]
Scenes = Iterator[tuple[str, Calls]]

HD, UHD = (1920, 1080), (3840, 2160)


def verbs_beside_fill() -> Scenes:
    """One triangle of half a 4K frame: each verb, beside NumPy's fill of the array that it writes."""
    import topleft as tl

    vertices, triangles, *_ = tl.scenes.large_triangle(*UHD)
    colors, kept = np.array([[200, 100, 50, 255]], np.uint8), tl.Rasterizer(UHD, threads=1)
    mask, share = np.zeros(UHD[::-1], bool), np.zeros(UHD[::-1], np.float32)
    picture = np.zeros((*UHD[::-1], 4), np.uint8)
    shares = [("coverage", "area", share), ("overdraw", "area", share), ("coverage", "msaa4", share)]
    for verb, sampling, out in (("coverage", "center", mask), *shares):
        draw = partial(getattr(kept, verb), vertices, triangles, sampling=sampling, out=out)
        yield f"{verb}, {sampling}", {"fill of the array": partial(out.fill, 1), "drawn": draw}
    for sampling, blend in (("center", "replace"), ("area", "over"), ("msaa4", "replace")):
        options: dict[str, Any] = {"sampling": sampling, "blend": blend, "background": 0, "out": picture}
        draw = partial(kept.fill, vertices, triangles, colors, **options)
        yield f"fill RGBA8, {sampling}", {"fill of the array": partial(picture.fill, 7), "drawn": draw}


SAMPLES: dict[str, tuple[str, str | None]] = {
    "center": ("center", None),
    "msaa4": ("msaa4", None),
    "msaa8": ("msaa8", None),
    "msaa4, ids of samples": ("msaa4", "samples_triangle"),
    "msaa4, and depths": ("msaa4", "samples_depth"),
}
"""The sampling, and what is read of the result, by name."""


def samples_beside_one() -> Scenes:
    """Ids and depth of several samples a pixel beside one: meshes whose back faces are culled, and soup."""
    import topleft as tl

    def read(draw: Callable[[], object], name: str | None) -> object:
        return draw() if name is None else getattr(draw(), name)

    found: dict[str, dict[str, Any]] = {}
    for n in (10_000, 100_000, 1_000_000):
        vertices, triangles = blob_arrays(n)
        matrix = tl.Camera.framing(tl.Mesh(vertices, triangles)).clip_from_world(HD)
        found[f"blob, {n:,}"] = {"vertices": vertices, "triangles": triangles, "transform": matrix, "cull": "back"}
    for n, px in ((1_000, 300), (20_000, 40), (200_000, 8)):
        vertices, triangles = strewn_arrays(n, px, HD)
        found[f"{n:,} of {px} px"] = {"vertices": vertices, "triangles": triangles}
    for name, scene in found.items():
        draws = {
            way: partial(tl.Rasterizer(HD, threads=1).rasterize, **scene, sampling=s) for way, (s, _) in SAMPLES.items()
        }
        yield name, {way: partial(read, draws[way], what) for way, (_, what) in SAMPLES.items()}


def fresh_beside_kept() -> Scenes:
    """Verbs that return arrays of their own beside `Rasterizer`, which overwrites its own: 1,000 triangles."""
    import topleft as tl

    rng, n = np.random.default_rng(0), 1000
    for side in (64, 256, 640, 1024, 2048, 4096):
        middles = np.repeat(rng.uniform(0, side, (n, 2)), 3, axis=0)
        corners = (middles + rng.normal(0, side / 50, (3 * n, 2))).astype(np.float32)
        deep = np.column_stack([corners, rng.random(len(corners), np.float32)])
        triangles = np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
        colors = rng.integers(0, 256, (n, 4)).astype(np.uint8)
        size, kept = (side, side), tl.Rasterizer((side, side), threads=1)
        for verb, arrays, sampling in (
            ("coverage", (corners, triangles), "center"), ("coverage", (corners, triangles), "area"),
            ("overdraw", (corners, triangles), "center"), ("fill", (corners, triangles, colors), "center"),
            ("rasterize", (deep, triangles), "center"), ("rasterize", (deep, triangles), "msaa4"),
            ("wireframe", (corners, triangles), None),
        ):  # fmt: skip
            options = {} if sampling is None else {"sampling": sampling}
            fresh = partial(getattr(tl, verb), *arrays, size, threads=1, **options)
            own = partial(getattr(kept, verb), *arrays, **options)
            yield f"{side}x{side}, {verb} {sampling or ''}".strip(), {"Rasterizer": own, "fresh arrays": fresh}


def layers_beside_picture() -> Scenes:
    """Each layer of a view beside its picture: a mesh of 70,000 triangles at 512x512; each call draws what it needs."""
    import topleft as tl
    from topleft._meshes.picture.layers import LAYERS

    size = (512, 512)
    vertices, triangles = tl.scenes.blob(70_000)
    mesh = tl.Mesh(vertices, triangles, uv=np.random.default_rng(0).random((len(vertices), 2), np.float32))
    camera = tl.Camera.framing(mesh, aspect=1.0)
    options: dict[str, Any] = {
        "cull": "back", "threads": 1, "rasterizer": tl.Rasterizer(size, threads=1),
        "camera_to": replace(camera, view=tl.Camera.framing(mesh, aspect=1.0, azimuth_deg=40).view),
    }  # fmt: skip
    made: dict[str, Callable[[], object]] = {
        name: partial(tl.render_layers, mesh, camera, size, layers=(name,), **options) for name in LAYERS
    }
    values = {"own": vertices.astype(np.float32)}
    made["attribute of 3"] = partial(tl.render_layers, mesh, camera, size, layers=(), attributes=values, **options)
    yield "blob of 70,000, 512x512", made


def levels_beside_whole() -> Scenes:
    """Views of meshes of 65,000 triangles with `tolerance=0.5` beside the same without it; levels are made before."""
    import topleft as tl

    for name, arrays in {"torus-knot": tl.scenes.shape("torus-knot"), "blob": tl.scenes.blob(65_000)}.items():
        mesh = tl.Mesh(*arrays)
        camera = tl.Camera.framing(mesh)
        for side in (20, 50, 100, 200, 400):
            level = tl.choose_detail(mesh, camera, (side, side), tolerance=0.5).level
            for verb in (tl.rasterize_mesh, tl.render):
                draw = partial(verb, mesh, camera, (side, side), threads=1)
                yield f"{name}, {side} px, {verb.__name__}", {
                    "whole": draw, f"level {level}": partial(draw, tolerance=0.5),
                }  # fmt: skip


FRAME_PX = 1024
SOUP = {"200,000 of 1.5 px": (200_000, 1.5), "100,000 of 4 px": (100_000, 4.0), "50,000 of 12 px": (50_000, 12.0),
        "5,000 of 60 px": (5_000, 60.0)}  # fmt: skip
GRIDS = {"whole pixels": 1, "half pixels": 2, "1/256 pixels": 256}


def soup(rng: np.random.Generator, n: int, side: float, frame: int = FRAME_PX) -> NDArray[np.float64]:
    """Corners (3 n, 2) of triangles that are strewn over a frame."""
    return (rng.uniform(0, frame, (n, 1, 2)) + rng.uniform(-0.5, 0.5, (n, 3, 2)) * side).reshape(-1, 2)


def thin(rng: np.random.Generator, n: int, length: float, thickness: float) -> NDArray[np.float64]:
    """Corners (3 n, 2) of slivers in any direction."""
    start, angle = rng.uniform(0, FRAME_PX, (n, 2)), rng.uniform(0, 2 * np.pi, n)
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    across = along[:, ::-1] * [-1, 1]
    corners = [start, start + length * along, start + length / 2 * along + thickness * across]
    return np.stack(corners, axis=1).reshape(-1, 2)


def beside_centres(rng: np.random.Generator, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points moved to within three steps of float64 of pixel centres: most row ends are in doubt, and on no grid."""
    centres = np.floor(points) + 0.5
    return centres + rng.integers(-3, 4, centres.shape) * np.spacing(centres)


def by_bits(draw: Callable[..., object], bits: tuple[Any, ...] = (8, NO_SNAP), **options: Any) -> Calls:
    """The same call with vertices snapped, and as they are."""
    return {f"{own} bits" if own != NO_SNAP else "exact": partial(draw, subpixel_bits=own, **options) for own in bits}


def unsnapped_beside_snapped() -> Scenes:
    """Vertices that are not snapped beside snapped ones: scenes, verbs, and two threads (CPU time of both)."""
    import topleft as tl

    rng = np.random.default_rng(3)
    square, wide = tl.Rasterizer((FRAME_PX, FRAME_PX), threads=1), tl.Rasterizer(HD, threads=1)
    points, triangles = tl.scenes.planar_mesh(100_000)
    yield "Delaunay mesh of 200,000, 1920x1080, rasterize", by_bits(partial(wide.rasterize, points, triangles))
    scenes = {
        "5,000 slivers of 300 x 2 px": thin(rng, 5_000, 300, 2),
        "20,000 of 30 x 0.3 px": thin(rng, 20_000, 30, 0.3),
    }
    for name, (n, side) in {"100,000 of 4 px": (100_000, 4.0), "50,000 of 10 px": (50_000, 10.0)}.items():
        random = soup(rng, n, side)
        scenes |= {f"{name} on {grid}": np.round(random * scale) / scale for grid, scale in GRIDS.items()}
        scenes[f"{name} within three last bits of centres"] = beside_centres(rng, random)
    for name, corners in scenes.items():
        rows = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
        yield f"{name}, overdraw", by_bits(partial(square.overdraw, corners, rows))
    for name, (n, side) in SOUP.items():
        corners, rows = soup(rng, n, side), np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
        flat, smooth = (rng.integers(0, 255, (k, 4)).astype(np.uint8) for k in (n, 3 * n))
        values, scene = rng.uniform(0, 1, (3 * n, 3)).astype(np.float32), (corners, rows)
        yield f"{name}, overdraw", by_bits(partial(square.overdraw, *scene), (8, 12, 16, NO_SNAP))
        yield f"{name}, outer squares", by_bits(partial(square.overdraw, *scene, sampling="outer"))
        yield f"{name}, blend", by_bits(partial(square.fill, *scene, flat, blend="over"))
        yield f"{name}, colours of vertices", by_bits(partial(square.fill, *scene, smooth))

        def interpolated(scene: Any = scene, values: Any = values, **view: Any) -> object:
            return square.rasterize(*scene, **view).interpolate(values)

        yield f"{name}, rasterize and interpolate", by_bits(interpolated)
    n = 1_000_000
    mesh = tl.Mesh(*tl.scenes.blob(n))
    matrix = tl.Camera.framing(mesh, aspect=4 / 3).clip_from_world((1024, 768))
    blob = mesh.vertices.astype(np.float32), mesh.triangles
    dust = soup(rng, n, 1.4, 2048), np.arange(3 * n, dtype=np.int32).reshape(-1, 3)
    drawn = partial(tl.Rasterizer((1024, 768)).rasterize, *blob, transform=matrix)
    strewn = partial(tl.Rasterizer((2048, 2048)).overdraw, *dust)
    for name, draw in {"blob of a million, rasterize": drawn, "a million of 1 px, overdraw": strewn}.items():
        calls = {f"{way}, {n} threads": partial(call, threads=n) for way, call in by_bits(draw).items() for n in (1, 2)}
        yield name, calls


def field_beside_others() -> Scenes:
    """A field on 200,000 triangles at 1920x1080 beside matplotlib, datashader and SciPy, and many small height maps."""
    import topleft as tl

    points, triangles = tl.scenes.planar_mesh(100_100, *HD)
    values = np.sin(points[:, 0] / 100) * np.cos(points[:, 1] / 80)
    grid = tl.Grid(HD, (0, HD[0], 0, HD[1]), "down")
    calls: dict[str, Callable[[], object]] = {
        "topleft field": lambda: tl.field((points, triangles), values, grid, threads=1)
    }
    for name, prepare in OTHER_FIELDS.items():
        try:
            calls[name] = prepare(points, triangles, values)
        except ImportError as error:
            print(f"{name}: {error}", file=sys.stderr)
    yield "200,000 triangles, 1920x1080", calls
    x, y = np.meshgrid(np.linspace(0, 200, 41), np.linspace(0, 200, 26))
    hills = np.column_stack([x.ravel(), y.ravel(), 5 * np.sin(x / 20).ravel() * np.cos(y / 25).ravel()])
    corner = (np.arange(25)[:, None] * 41 + np.arange(40)).reshape(-1, 1)
    faces = np.concatenate([corner + [0, 1, 41], corner + [1, 42, 41]]).astype(np.int32)
    yield "2,000 faces, 400x400", {"topleft height_map": lambda: tl.height_map((hills, faces), 0.5, threads=1)}


def matplotlib_tripcolor(points: NDArray[Any], triangles: NDArray[Any], values: NDArray[Any]) -> Callable[[], object]:
    """Gouraud shading on a canvas of the frame; the triangulation is made before."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.tri import Triangulation

    triangulation = Triangulation(points[:, 0], points[:, 1], triangles)

    def draw() -> object:
        canvas = FigureCanvasAgg(Figure(figsize=(HD[0] / 100, HD[1] / 100), dpi=100))
        axes = canvas.figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set(xlim=(0, HD[0]), ylim=(0, HD[1]))
        axes.tripcolor(triangulation, values, shading="gouraud")
        canvas.draw()
        return canvas.buffer_rgba()

    return draw


def datashader_trimesh(points: NDArray[Any], triangles: NDArray[Any], values: NDArray[Any]) -> Callable[[], object]:
    """Its mean of linear values; tables are made before."""
    import datashader as ds
    import pandas as pd

    vertices = pd.DataFrame({"x": points[:, 0], "y": points[:, 1], "z": values})
    simplices = pd.DataFrame(triangles.astype(np.int64), columns=["v0", "v1", "v2"])
    mesh = ds.utils.mesh(vertices, simplices)
    canvas = ds.Canvas(*HD, x_range=(0, HD[0]), y_range=(0, HD[1]))
    return lambda: canvas.trimesh(vertices, simplices, mesh=mesh, agg=ds.mean("z"), interpolate="linear").data


def scipy_interpolator(points: NDArray[Any], _: NDArray[Any], values: NDArray[Any]) -> Callable[[], object]:
    """Linear values at each centre, in triangles of its own."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import Delaunay

    find = LinearNDInterpolator(Delaunay(points), values)
    x, y = np.meshgrid(np.arange(HD[0]) + 0.5, np.arange(HD[1]) + 0.5)
    return lambda: find(x, y)


def run_lengths_beside_coco() -> Scenes:
    """Run lengths of 80 discs and of 80 polygons in a picture of COCO's size, beside pycocotools."""
    from pycocotools import mask as coco

    import topleft as tl

    rng, (width, height), n = np.random.default_rng(0), (640, 480), 80
    y, x = np.mgrid[:height, :width]
    discs = [(rng.uniform(0, width), rng.uniform(0, height), rng.uniform(20, 120)) for _ in range(n)]
    masks = np.stack([(x - cx) ** 2 + (y - cy) ** 2 < radius**2 for cx, cy, radius in discs])
    columns = np.asfortranarray(masks.transpose(1, 2, 0).view(np.uint8))
    ids = np.full((height, width), -1, np.int32)
    for i, mask in enumerate(masks):
        ids[mask] = i

    def copied() -> object:
        return coco.encode(np.asfortranarray(masks.transpose(1, 2, 0).view(np.uint8)))

    yield f"{n} masks, 640x480", {
        "topleft to_rle": partial(tl.to_rle, masks), "pycocotools, with the copy to columns": copied,
        "pycocotools, of columns": partial(coco.encode, columns),
    }  # fmt: skip
    yield (
        f"an id map of {n} objects, 640x480",
        {
            "topleft to_rle": partial(tl.to_rle, ids, labels=range(n)),
            "pycocotools, a mask for each": lambda: [coco.encode(np.asfortranarray(ids == i)) for i in range(n)],
        },
    )
    angle = np.sort(rng.uniform(0, 2 * np.pi, (n, 60)), axis=1)
    reach = rng.uniform(10, 200, (n, 1)) * rng.uniform(0.7, 1, (n, 60))
    points = np.stack([320 + reach * np.cos(angle), 240 + reach * np.sin(angle)], axis=2)
    flat = [[own.ravel().tolist()] for own in points]
    yield (
        f"{n} polygons of 60 corners, 640x480",
        {
            "topleft to_rle": partial(tl.to_rle, flat, (width, height)),
            "pycocotools frPyObjects": lambda: [coco.frPyObjects(own, height, width) for own in flat],
        },
    )


def objects_beside_bop() -> Scenes:
    """The objects of a scene beside the loop of BOP's tools: each alone on nine pictures, then NumPy; same renderer."""
    import topleft as tl

    rng, (width, height) = np.random.default_rng(0), (640, 480)
    intrinsics, pose = np.array([[700.0, 0, 319.5], [0, 700.0, 239.5], [0, 0, 1]]), np.eye(4)
    pose[2, 3] = 4.0
    mesh, places = tl.Mesh(*tl.scenes.blob(20_000)), np.tile(np.eye(4), (20, 1, 1))
    places[:, :3, :3] *= 0.4
    places[:, :3, 3] = rng.uniform(-1.5, 1.5, (20, 3))
    scene = tl.Scene([(mesh, place) for place in places])
    camera = tl.Camera.from_intrinsics(intrinsics, pose, (width, height))
    large = (3 * width, 3 * height)
    shifted = tl.Camera.from_intrinsics(intrinsics + [[0, 0, width], [0, 0, height], [0, 0, 0]], pose, large)

    def loop() -> object:
        ids, found = tl.rasterize_mesh(scene, camera, (width, height), threads=1).instance, []
        for i in range(len(scene)):
            mask = tl.rasterize_mesh(tl.Scene([scene[i]]), shifted, large, threads=1).mask
            (rows, columns), seen = mask.nonzero(), ids == i
            ends = [rows.min(), rows.max(), columns.min(), columns.max()] if len(rows) else []
            found.append((int(mask.sum()), int(seen.sum()), ends, seen.nonzero()))
        return found

    yield (
        "20 objects of 20,000 triangles, 640x480",
        {
            "topleft object_masks": lambda: tl.object_masks(scene, camera, (width, height), threads=1).scene_gt_info(),
            "each on a canvas of 1920x1440": loop,
        },
    )


OTHER_FIELDS = {
    "matplotlib tripcolor": matplotlib_tripcolor,
    "datashader trimesh": datashader_trimesh,
    "scipy LinearNDInterpolator": scipy_interpolator,
}


def grids_beside_others() -> Scenes:
    """Voxels beside trimesh's, a gutter beside SciPy's nearest, and a viewshed of a million cells."""
    import topleft as tl

    vertices, triangles = tl.scenes.blob(70_000)
    pitch = float(np.ptp(vertices, axis=0).max())
    for n in (128, 256):
        calls: dict[str, Callable[[], object]] = {
            "topleft voxelize": partial(tl.voxelize, (vertices, triangles), n, threads=1)
        }
        try:
            import trimesh
        except ImportError as error:
            print(f"trimesh: {error}", file=sys.stderr)
        else:
            if n == 128:
                mesh = trimesh.Trimesh(vertices, triangles, process=False)
                calls["trimesh voxelized().fill()"] = lambda mesh=mesh: mesh.voxelized(pitch / 128).fill()
        yield f"solid voxels, {n}^3 of 70,000 triangles", calls
    ball, uv = latitudes(316)
    atlas = tl.Mesh(*ball, uv=uv)
    bare = {"topleft bake, without a gutter": partial(tl.bake, atlas, "position", 1024, gutter=0, threads=1)}
    bare |= {f"gutter of {n}": partial(tl.bake, atlas, "position", 1024, gutter=n, threads=1) for n in (8, 32)}
    try:
        from scipy.ndimage import distance_transform_edt
    except ImportError as error:
        print(f"scipy: {error}", file=sys.stderr)
    else:
        mask = tl.bake(atlas, "triangle", 1024, gutter=0).mask
        bare["scipy's nearest alone"] = lambda: distance_transform_edt(~mask, return_indices=True)
    yield "atlas of 200,000 triangles, 1024x1024", bare
    x, y = np.meshgrid(np.arange(1000), np.arange(1000))
    hills = 40 * np.sin(x / 97) * np.cos(y / 83) + 9 * np.sin(x / 23 + y / 31)
    views = {"topleft": partial(tl.viewshed, hills, (500.5, 400.5), eye_height=9.0, threads=1)}
    with TemporaryDirectory() as folder:
        try:
            views["gdal_viewshed"] = gdal_viewshed(hills, Path(folder))
        except (ImportError, OSError) as error:
            print(f"gdal_viewshed: {error}", file=sys.stderr)
        yield "viewshed of 1000x1000", views
    mesh = tl.Mesh(vertices, triangles)
    cameras = tl.viewpoints(mesh, 20)
    seen = {"topleft visible_faces": partial(tl.visible_faces, mesh, cameras, (512, 512))}
    try:
        seen["Open3D RaycastingScene"] = open3d_rays(vertices, triangles, cameras)
    except ImportError as error:
        print(f"open3d: {error}", file=sys.stderr)
    yield "visible triangles of 70,000, 20 views of 512x512", seen


def gdal_viewshed(heights: NDArray[Any], folder: Path) -> Callable[[], object]:
    """The program of GDAL on a GeoTIFF, the eye in the middle of cell (500, 400)."""
    import rasterio

    path, height = folder / "heights.tif", len(heights)
    profile = {"driver": "GTiff", "width": heights.shape[1], "height": height, "count": 1, "dtype": "float64"}
    where = rasterio.Affine(1, 0, 0, 0, -1, height)
    with rasterio.open(path, "w", **profile, transform=where, crs="EPSG:32632") as file:
        file.write(heights, 1)
    words = ["-ox", "500.5", "-oy", f"{height - 400.5}", "-oz", "9", "-tz", "0", "-md", "0", "-cc", "0"]
    command = ["gdal_viewshed", "-q", *words, str(path), str(folder / "seen.tif")]
    subprocess.run(command, check=True)
    return partial(subprocess.run, command, check=True)


def open3d_rays(vertices: NDArray[Any], triangles: NDArray[Any], cameras: Sequence[Any]) -> Callable[[], object]:
    """A ray through the middle of each pixel, and the triangles that are hit counted; on one thread."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(o3d.core.Tensor(vertices.astype(np.float32)), o3d.core.Tensor(triangles.astype(np.uint32)))
    x, y = np.meshgrid((np.arange(512) + 0.5) / 256 - 1, 1 - (np.arange(512) + 0.5) / 256)
    rays = []
    for camera in cameras:
        inverse = np.linalg.inv(camera.clip_from_world((512, 512)))
        near, far = (inverse @ np.stack([x, y, np.full_like(x, z), np.ones_like(x)]).reshape(4, -1) for z in (-1, 1))
        start, end = (near[:3] / near[3]).T, (far[:3] / far[3]).T
        rays.append(np.concatenate([start, end - start], axis=1).astype(np.float32))

    def count() -> object:
        found = [scene.cast_rays(o3d.core.Tensor(own), nthreads=1)["primitive_ids"].numpy() for own in rays]
        return [np.bincount(ids[ids < len(triangles)], minlength=len(triangles)) for ids in found]

    return count


def latitudes(n: int) -> tuple[tuple[NDArray[Any], NDArray[Any]], NDArray[Any]]:
    """A ball of 2 n^2 triangles whose chart is a rectangle."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij")
    points = [np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)]
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1, 1)
    triangles = (corner + [0, 1, n + 2, n + 1])[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    uv = np.stack([azimuth / (2 * np.pi) * 0.93 + 0.03, polar / np.pi * 0.91 + 0.04], axis=-1)
    return (np.stack(points, axis=-1).reshape(-1, 3).astype(np.float32), triangles), uv.reshape(-1, 2)


@dataclass(frozen=True)
class Pairs:
    """A row of the table: what is timed, how often, and how long a turn is, seconds; 0: one call."""

    scenes: Callable[[], Scenes]
    help: str
    rounds: int
    seconds: float = 0.0


PAIRS = {
    "large": Pairs(verbs_beside_fill, "time one large triangle beside a fill of the same memory", 60),
    "samples": Pairs(samples_beside_one, "time several samples a pixel beside one", 9, 0.2),
    "fresh": Pairs(fresh_beside_kept, "time verbs that return arrays of their own beside `Rasterizer`", 30),
    "layers": Pairs(layers_beside_picture, "time each layer of a view beside its picture", 40),
    "tolerance": Pairs(levels_beside_whole, "time views with `tolerance=` beside the same without", 31),
    "no-snap": Pairs(unsnapped_beside_snapped, "time vertices that are not snapped beside snapped ones", 10),
    "rle": Pairs(run_lengths_beside_coco, "time run lengths beside pycocotools", 15),
    "objects": Pairs(objects_beside_bop, "time full and visible masks of objects beside the loop of BOP's tools", 7),
    "field": Pairs(field_beside_others, "time a field beside matplotlib, datashader and SciPy", 7),
    "grids": Pairs(grids_beside_others, "time voxels, atlases and a viewshed beside other programs", 5),
}


def add_arguments(pairs: Pairs, parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of a study."""
    parser.add_argument("--rounds", type=positive, default=pairs.rounds, metavar="N", help="(%(default)s)")
    parser.add_argument(
        "--scene", nargs="+", default=[""], metavar="WORD", help="only scenes whose name has one of these"
    )
    add_out(parser)


def cpu_seconds() -> float:
    """CPU time of this process, and of programs that it has run."""
    if resource is None:
        return time.process_time()
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def run(kind: str, arguments: argparse.Namespace, _: Save) -> Record:
    """Measure milliseconds of each call, round by round."""
    rows = []
    for scene, calls in PAIRS[kind].scenes():
        if any(word in scene for word in arguments.scene):
            turns = [turn_of(call, cpu_seconds) for call in calls.values()]
            times = take_turns(turns, arguments.rounds, PAIRS[kind].seconds)
            rows += [{"scene": scene, "call": name, "ms": own.tolist()} for name, own in zip(calls, times, strict=True)]
    return {"kind": kind} | describe() | {"rows": rows}


def lines(record: Record) -> Iterator[str]:
    """The table: least and median of each call, and the median of its ratios to the first call of its scene."""
    rows, first = [], {}
    for row in record["rows"]:
        ours = first.setdefault(row["scene"], row["ms"])
        ratio = statistics.median(a / b for a, b in zip(row["ms"], ours, strict=False))
        rows.append(
            [row["scene"], row["call"], f"{min(row['ms']):.3f}", f"{statistics.median(row['ms']):.3f}", f"{ratio:.2f}"]
        )
    yield from table(["scene", "call", "least, ms", "median, ms", "ratio"], rows)


STUDIES = [
    Study(
        kind, pairs.help, partial(add_arguments, pairs), partial(run, kind), lines,
        {f"{kind}-facts": facts_text, kind: lambda record: "\n".join(lines(record))},
    )
    for kind, pairs in PAIRS.items()
]  # fmt: skip
