"""Hostile calls of gradients, run lengths, and of what a mesh gives to grids: voxels, heights, texels, faces by camera.

What must hold of them stands in `fuzzing.py`.
"""

from typing import Any

import numpy as np
from draws import DTYPES, LARGEST, SAMPLINGS, SPECIAL, Case, Draw, mesh_arrays

import topleft as tl


def values_of(draw: Draw, *shape: int) -> Any:
    """Numbers of a shape, now and then of another one."""
    return draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(*shape), -2, 3), DTYPES))


def gradients_case(draw: Draw) -> Case:
    """`area_vjp`, and the gradients of fragments whose ids their owner may have changed."""
    size = draw.source.integer(1, 40), draw.source.integer(1, 30)
    kind = draw.of(["area", "interpolate", "derivatives", "barycentric", "antialias", "sample"])
    if kind == "area":
        vertices, triangles, _, n_triangles = mesh_arrays(draw, size, (2, 3))
        n_channels = draw.of([None, 1, 3])
        shape = size[::-1] if n_channels is None else (*size[::-1], n_channels)
        colors = None if n_channels is None else values_of(draw, n_triangles, n_channels)
        inputs = (vertices, triangles, values_of(draw, *shape), colors)
        return Case(f"area_vjp {size}", lambda v, t, grad, colors: tl.area_vjp(v, t, size, grad, colors=colors), inputs)
    n_vertices, n_triangles = 30, 40
    rng = draw.rng()
    scene = rng.uniform(-5, 45, (n_vertices, 3)), rng.integers(0, n_vertices, (n_triangles, 3))
    frags = tl.rasterize(*scene, size, sampling=draw.of(SAMPLINGS[:3]), threads=1)
    if draw.chance(3):
        at = draw.source.integer(0, size[1] - 1), draw.source.integer(0, size[0] - 1)
        frags.triangle[at] = draw.of([n_triangles, -2, 10**8])
    n = 2 if kind == "sample" else draw.of([2, 1, 4])
    values = values_of(draw, *((*size[::-1], n) if kind == "antialias" else (n_vertices, n)))
    n_out = {"derivatives": 2 * n, "barycentric": 3}.get(kind, n)
    grad = values_of(draw, *size[::-1], n_out)
    texture = rng.normal(size=(draw.source.integer(1, 9), draw.source.integer(1, 9), 2))
    how, wrap = draw.of(["nearest", "bilinear", "trilinear", "pixelated"]), draw.of(["repeat", "clamp", "mirror"])
    edges = draw.mostly(["area", "silhouette", "straight-through"], ["all"])

    def call(values: Any, grad: Any) -> Any:
        if kind == "area":
            return []
        if kind == "barycentric":
            return frags.barycentric_vjp(grad)
        if kind == "sample":
            return list(frags.sample_vjp(texture, values, grad, filter=how, wrap=wrap))
        if kind == "antialias":
            return [frags.antialias(values, edges=edges), *frags.antialias_vjp(values, grad, edges=edges)]
        if kind == "derivatives":
            flat = np.asarray(grad)
            more = flat.reshape(*flat.shape[:2], -1, 2) if flat.ndim == 3 and flat.shape[2] % 2 == 0 else flat
            return frags.interpolate_vjp(values, np.zeros((*size[::-1], n)), grad_derivatives=more)
        return frags.interpolate_vjp(values, grad)

    return Case(f"Fragments.{kind}_vjp", call, (values, grad))


def rle_case(draw: Draw) -> Case:
    """`to_rle` of masks, ids and polygons."""
    kind, compressed = draw.of(["masks", "ids", "polygons"]), draw.of([True, False])
    height, width = draw.mostly([(9, 70), (64, 3), (1, 1), (31, 129)], [(0, 5), (5, 0), (0, 0)])
    if kind == "polygons":
        ring = draw.vertices(draw.mostly([5, 3, 40], [0, 2]), (2,), (60, 40))
        size = draw.size()
        size = size if max(size) <= LARGEST else (60, 40)
        options: dict[str, Any] = {"rule": draw.of(["evenodd", "nonzero"]), "size": size}
        options["subpixel_bits"] = draw.mostly([8, 0, 16], [-1, 17])
        inputs: tuple[Any, ...] = (ring,)
    else:
        shape = (height, width) if kind == "ids" or draw.chance(2) else (draw.of([3, 1, 0]), height, width)
        top, dtypes = (1, ["?", "u1"]) if kind == "masks" else (5, ["i4", "i8", "u1", ">i4"])
        array = draw.rng().integers(0 if kind == "masks" else -1, top + 1, draw.shape(*shape))
        inputs, options = (draw.laid_out(draw.as_dtype(array, dtypes)),), {}
        if kind == "ids":
            labels = np.array(draw.mostly([[0, 1, 2], [5], []], [[2, 2], [2**40]]))
            inputs = (*inputs, draw.laid_out(draw.as_index(labels, ["i8", "i4", "u8"])))

    def call(pixels: Any, labels: Any = None, **options: Any) -> Any:
        found = tl.to_rle([[pixels]] if kind == "polygons" else pixels, labels=labels, compressed=compressed, **options)
        rows = found if isinstance(found, list) else [found]
        return [np.array([*row["size"], *map(int, bytes(str(row["counts"]), "ascii"))]) for row in rows]

    return Case(f"to_rle {kind}", call, inputs, options)


def mesh_of(draw: Draw, with_uv: bool = False) -> tuple[Any, Any, Any]:
    """Vertices, triangles and texture coordinates, or None."""
    vertices, triangles, n_vertices, _ = mesh_arrays(draw, (6, 5), (3,))
    return vertices, triangles, values_of(draw, n_vertices, 2) if with_uv else None


def voxels_case(draw: Draw) -> Case:
    """`voxelize`."""
    vertices, triangles, _ = mesh_of(draw)
    options: dict[str, Any] = {"threads": draw.of([1, None, 2])}
    options["rule"] = draw.mostly(["center", "touched"], ["outer"])
    options["solid"] = draw.of([True, False])
    options["samples"] = draw.mostly([1, 2, 4], [3, 0])
    places = np.asarray(vertices)  # 40 units of 0.37 are 100 voxels along an axis
    is_huge = places.dtype.kind not in "fiu" or np.abs(np.nan_to_num(places)).max(initial=0) > 40
    if draw.chance(4) and not is_huge:
        options["pitch"] = draw.mostly([1.0, 0.37], [0.0, -1.0, *SPECIAL])
    else:
        options["shape"] = draw.mostly([8, (9, 3, 70), (1, 1, 1), 33], [0, -1, 2**14 + 1, 2**31, (5, 0, 5), 2**63])
    if draw.chance(3):
        options["bounds"] = draw.mostly([((0, 0, 0), (5, 4, 3))], [((0, 0, 0), (0, 0, 0)), ((1, 1, 1), (0, 9, 9)),
                                        ((0, 0, 0), (1e300, 1, 1)), ((0, 0, 0), (1, float("nan"), 1))])  # fmt: skip

    def call(vertices: Any, triangles: Any, **options: Any) -> Any:
        voxels = tl.voxelize(tl.Mesh(vertices, triangles), **options)
        return [voxels.values, voxels.transform, voxels.points()]

    return Case("voxelize", call, (vertices, triangles), options)


def bake_case(draw: Draw) -> Case:
    """`bake`, from the mesh itself, another one, or a picture."""
    size = draw.mostly([(20, 30), (64, 65), (1, 1), 33], [0, (5, 0), -1, 2**31, (2**31, 2**31)])
    vertices, triangles, uv = mesh_of(draw, with_uv=not draw.chance(16))
    what = draw.mostly(["position", "normal", "triangle", "tangent_normal", "values", "picture"], ["depth"])
    values = values_of(draw, draw.of([np.shape(vertices)[0], 5]), 2) if what == "values" else None
    options: dict[str, Any] = {"threads": draw.of([1, None, 2]), "gutter": draw.mostly([0, 2, 8], [-1, 10**6, 2**31])}
    options["rule"] = draw.mostly(["center", "touched", "area"], ["outer"])
    if draw.chance(3) or what == "tangent_normal":
        options["max_distance"] = draw.mostly([None, 2.0], [0.0, -1.0, *SPECIAL])
        with_source = True
    else:
        with_source = False

    def call(vertices: Any, triangles: Any, uv: Any, values: Any, **options: Any) -> Any:
        mesh = tl.Mesh(vertices, triangles, uv=uv)
        own = what if values is None else values
        if what == "picture":
            own = np.arange(5 * 4 * 3, dtype=np.uint8).reshape(5, 4, 3)
            options["cameras"] = [tl.Camera.look_at((4.0, 3.0, 9.0), (2, 2, 0.5), fov_y_deg=50)]
        if with_source and what != "picture":
            options["source"] = tl.scenes.cube()
        baked = tl.bake(mesh, own, size, **options)
        return [baked.values, baked.triangle, baked.mask]

    return Case(f"bake {what}", call, (vertices, triangles, uv, values), options)


def seen_case(draw: Draw) -> Case:
    """`visible_faces` and `object_masks`."""
    size = draw.size()
    vertices, triangles, _ = mesh_of(draw)
    eye = draw.mostly([(4.0, 3.0, 9.0), (2.0, 2.0, 2.0)], [(0, 0, 0), (1e-300, 0, 1e-300), (1e30, 0, 0)])
    is_masks, least = draw.chance(2), draw.mostly([1, 3], [0, -1, 2**31, 2**63])
    cull, beyond = draw.of([None, "back", "none"]), draw.mostly([1.0, 0.5, 3.0], [0.0, -1.0, *SPECIAL])

    def call(vertices: Any, triangles: Any) -> Any:
        mesh = tl.Mesh(vertices, triangles)
        camera = tl.Camera.look_at(eye, (2, 2, 0.5), fov_y_deg=50)
        if is_masks:
            scene = tl.Scene([mesh, tl.Instance(mesh, (np.eye(3), (1, 0, 0)))])
            masks = tl.object_masks(scene, camera, size, beyond=beyond, cull=cull)
            return [masks.instance, masks.n_full, masks.boxes_full]
        found = tl.visible_faces(mesh, [camera, camera], size, min_pixels=least, cull=cull)
        return [found.camera, found.face, found.pixels]

    return Case(f"{'object_masks' if is_masks else 'visible_faces'} {size}", call, (vertices, triangles))
