"""Scenes of `pairs.py` that set topleft beside other programs; one that is not installed is left out, and said so."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.arrays import grid_triangles

Calls = Mapping[str, Callable[[], object]]
Scenes = Iterator[tuple[str, Calls]]

HD = (1920, 1080)


def installed(makers: Mapping[str, Callable[[], Callable[[], object]]]) -> dict[str, Callable[[], object]]:
    """Return the calls that makers give, without those of programs that are not installed."""
    calls = {}
    for name, make in makers.items():
        try:
            calls[name] = make()
        except (ImportError, OSError) as error:
            print(f"{name}: {error}", file=sys.stderr)
    return calls


def field_beside_others() -> Scenes:
    """A field on 200,000 triangles at 1920x1080 beside matplotlib, datashader and SciPy, and many small height maps."""
    import topleft as tl

    points, triangles = tl.scenes.planar_mesh(100_100, *HD)
    values = np.sin(points[:, 0] / 100) * np.cos(points[:, 1] / 80)
    grid = tl.Grid(HD, (0, HD[0], 0, HD[1]), "down")
    others = installed({name: partial(make, points, triangles, values) for name, make in OTHER_FIELDS.items()})
    own = {"topleft field": lambda: tl.field((points, triangles), values, grid, threads=1)}
    yield "200,000 triangles, 1920x1080", own | others
    x, y = np.meshgrid(np.linspace(0, 200, 41), np.linspace(0, 200, 26))
    hills = np.column_stack([x.ravel(), y.ravel(), 5 * np.sin(x / 20).ravel() * np.cos(y / 25).ravel()])
    mesh = hills, grid_triangles(26, 41)
    yield "2,000 faces, 400x400", {"topleft height_map": lambda: tl.height_map(mesh, 0.5, threads=1)}


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


def gradients_beside_deodr() -> Scenes:
    """Forward and backward of colours and silhouettes, the loss left out but of `photometric_loss`, beside DEODR."""
    ways = ("silhouette", "area", "straight-through", "render", "photometric_loss")
    makers: dict[str, Callable[..., Callable[[], object]]] = {
        f"topleft.torch, {way}": partial(step_of_topleft, way=way) for way in ways
    } | {"DEODR": step_of_deodr}
    for n_triangles, size in ((10_000, (512, 512)), (70_000, (512, 512)), (100_000, HD)):
        clip, triangles = wavy_ball(n_triangles, *size)
        steps = {name: partial(make, clip, triangles, size) for name, make in makers.items()}
        yield f"{n_triangles} triangles, {size[0]}x{size[1]}", installed(steps)


OTHER_FIELDS = {
    "matplotlib tripcolor": matplotlib_tripcolor,
    "datashader trimesh": datashader_trimesh,
    "scipy LinearNDInterpolator": scipy_interpolator,
}


def grids_beside_others() -> Scenes:
    """Voxels beside trimesh's, a gutter beside SciPy's nearest, and visible triangles beside Open3D's."""
    import topleft as tl

    vertices, triangles = tl.scenes.blob(70_000)
    pitch = float(np.ptp(vertices, axis=0).max())
    for n in (128, 256):
        own = {"topleft voxelize": partial(tl.voxelize, (vertices, triangles), n, threads=1)}
        other = {"trimesh voxelized().fill()": partial(trimesh_voxels, vertices, triangles, pitch / n)}
        yield f"solid voxels, {n}^3 of 70,000 triangles", own | (installed(other) if n == 128 else {})
    ball, uv = latitudes(316)
    atlas = tl.Mesh(*ball, uv=uv)
    bare = {"topleft bake, without a gutter": partial(tl.bake, atlas, "position", 1024, gutter=0, threads=1)}
    bare |= {f"gutter of {n}": partial(tl.bake, atlas, "position", 1024, gutter=n, threads=1) for n in (8, 32)}
    mask = tl.bake(atlas, "triangle", 1024, gutter=0).mask
    other = installed({"scipy's nearest alone": partial(scipy_nearest, mask)})
    yield "atlas of 200,000 triangles, 1024x1024", bare | other
    mesh = tl.Mesh(vertices, triangles)
    cameras = tl.viewpoints(mesh, 20)
    seen = {"topleft visible_faces": partial(tl.visible_faces, mesh, cameras, (512, 512))}
    other = installed({"Open3D RaycastingScene": partial(open3d_rays, vertices, triangles, cameras)})
    yield "visible triangles of 70,000, 20 views of 512x512", seen | other


def trimesh_voxels(vertices: NDArray[Any], triangles: NDArray[Any], pitch: float) -> Callable[[], object]:
    """Surface voxels, and those within."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    return lambda: mesh.voxelized(pitch).fill()


def scipy_nearest(mask: NDArray[Any]) -> Callable[[], object]:
    """The nearest texel of each."""
    from scipy.ndimage import distance_transform_edt

    return lambda: distance_transform_edt(~mask, return_indices=True)


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
    """A ball of 2 n^2 triangles with a rectangle as its chart."""
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, n + 1), indexing="ij")
    points = [np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)]
    triangles = np.ascontiguousarray(grid_triangles(n + 1, n + 1)[:, ::-1])
    uv = np.stack([azimuth / (2 * np.pi) * 0.93 + 0.03, polar / np.pi * 0.91 + 0.04], axis=-1)
    return (np.stack(points, axis=-1).reshape(-1, 3).astype(np.float32), triangles), uv.reshape(-1, 2)


def wavy_ball(n_triangles: int, width: int, height: int) -> tuple[Any, Any]:
    """A wavy ball in clip space, (V, 4) float32, and its triangles."""
    import topleft as tl

    (points, triangles), _ = latitudes(int((n_triangles / 2) ** 0.5))
    x, y, z = points.T.astype(np.float64)
    r = 1 + 0.15 * np.sin(5 * np.arccos(y)) * np.cos(4 * np.arctan2(z, x))
    camera = tl.Camera.look_at((0, 0.5, 3.0), (0, 0, 0), fov_y_deg=50)
    clip = tl.scenes.to_clip(r[:, None] * points, camera.clip_from_world((width, height)))
    return clip.astype(np.float32), triangles


def step_of_topleft(clip: Any, triangles: Any, size: tuple[int, int], way: str) -> Callable[[], None]:
    """Forward and backward of `topleft.torch`: one function after the other with a rule of edges, or a call in one."""
    import torch

    import topleft.torch as dr

    torch.set_num_threads(1)
    context, tri = dr.RasterizeContext(threads=1, output_db=False), torch.from_numpy(triangles)
    pos, colors = torch.from_numpy(clip)[None].requires_grad_(), torch.rand(1, len(clip), 3, requires_grad=True)
    across, g = dr.antialias_construct_topology_hash(tri), torch.rand(1, size[1], size[0], 3)

    def one_by_one() -> None:
        rast, _ = dr.rasterize(context, pos, tri, size[::-1])
        out, _ = dr.interpolate(colors, rast, tri)
        dr.antialias(out, rast, pos, tri, topology_hash=across, edges=way).backward(g)

    in_one = {
        "render": lambda: dr.render(context, pos, tri, colors, size[::-1], across).backward(g),
        "photometric_loss": lambda: dr.photometric_loss(context, pos, tri, colors, g, across).backward(),
    }

    def step() -> None:
        pos.grad = colors.grad = None
        in_one.get(way, one_by_one)()

    return step


def step_of_deodr(clip: Any, triangles: Any, size: tuple[int, int]) -> Callable[[], None]:
    """The same of DEODR; the silhouettes are found before."""
    from deodr.differentiable_renderer import Scene2D

    (width, height), n, w = size, len(clip), clip[:, 3].astype(float)
    px = np.stack([(clip[:, 0] / w * 0.5 + 0.5) * width, (0.5 - clip[:, 1] / w * 0.5) * height], 1)
    (ax, ay), (bx, by), (cx, cy) = (px[triangles[:, k]].T for k in range(3))
    is_front = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay) < 0
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, 1)], -1).reshape(-1, 2).astype(np.int64), 1)
    _, edge = np.unique(ends[:, 0] << 32 | ends[:, 1], return_inverse=True)
    flags = (np.bincount(edge, np.repeat(is_front, 3))[edge] == 1).reshape(-1, 3) & is_front[:, None]
    scene = Scene2D(
        faces=triangles.astype(np.uint32), faces_uv=triangles.astype(np.uint32), ij=np.ascontiguousarray(px), depths=w,
        textured=np.zeros(len(triangles), bool), uv=np.zeros((n, 2)), shade=np.zeros(n), colors=np.ones((n, 3)),
        shaded=np.zeros(len(triangles), bool), edgeflags=flags, height=height, width=width, nb_colors=3,
        texture=np.zeros((0, 0)), background_color=np.zeros(3), clockwise=False, backface_culling=True,
        integer_pixel_centers=False,
    )  # fmt: skip
    g = np.ones((height, width, 3))

    def step() -> None:
        scene.render(1.0)
        scene.uv_b, scene.ij_b, scene.shade_b = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(n)
        scene.colors_b, scene.texture_b = np.zeros((n, 3)), np.zeros((0, 0))
        scene.render_backward(g)

    return step
