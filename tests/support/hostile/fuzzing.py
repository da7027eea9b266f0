"""Calls of the public surface that nobody would write, drawn number by number, and what must hold of each of them.

A case is one call of a verb (or two or three), with arrays of odd dtypes, strides, addresses and contents,
with indices at every border, sizes up to beyond what memory holds, and `out=` that may overlap the inputs. Then either
the call is refused in one line of a documented type, before `out` has changed; or it has written nowhere else, its
inputs are what they were, and plain copies of the same arrays, drawn by another number of threads, give the same bits.
"""

import warnings
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from draws import (
    DTYPES,
    GUARD,
    LARGEST,
    REFUSALS,
    SAMPLINGS,
    Case,
    Draw,
    Source,
    arrays_of,
    mesh_arrays,
    out_of,
    view_of,
)
from fuzzing_grids import bake_case, gradients_case, rle_case, seen_case, voxels_case

import topleft as tl


def verb_case(draw: Draw) -> Case:
    """`coverage`, `overdraw`, `fill`, `rasterize` or `wireframe`."""
    size, name = draw.size(), draw.of(["coverage", "overdraw", "fill", "rasterize", "wireframe"])
    more = {"coverage": ["area", "outer", "inner"], "overdraw": ["area", "outer", "inner"], "fill": ["area"] * 4}
    view = view_of(draw, ["center"] if name == "wireframe" else [*SAMPLINGS, *more.get(name, [])])
    columns = (3,) if "transform" in view else (2, 2, 3, 4)
    origin = view.get("origin", (0, 0)) if columns != (3,) and draw.chance(2) else (0, 0)
    vertices, triangles, n_vertices, n_triangles = mesh_arrays(draw, size, columns, origin)
    inputs = [vertices, triangles]
    shape = size[::-1]
    rasterizer = tl.Rasterizer if draw.chance(8) else None
    if name == "fill":
        view["per"] = draw.of(["auto", "triangle", "vertex"])
        colors = draw.colors(n_vertices if view["per"] == "vertex" else n_triangles)
        view["blend"] = draw.of(["replace", "over", "add", "multiply", "max", "min"])
        view["alpha"] = draw.of(["straight", "premultiplied"])
        view["background"] = draw.of([None, 0, 255, 7.5, float("nan"), -1])
        inputs.append(colors)
        channels = np.shape(colors)[1:]
        dtype = getattr(colors, "dtype", np.dtype("u1"))
        view["out"] = out_of(draw, (*shape, *channels), ["u1" if dtype == np.uint8 else "f4", "f4", "u1"], inputs)
    elif name == "rasterize":
        view["depth_test"] = draw.of(["less", "greater", None])
        view["background_depth"] = draw.of([None, 0.0, float("inf"), float("nan"), 1e300])
        if draw.chance(3):
            view["out"] = out_of(draw, shape, ["i4"], inputs), out_of(draw, shape, ["f4"], inputs)
    else:
        dtypes = {"coverage": ["?", "f4"], "overdraw": ["i4", "f4"], "wireframe": ["?", "f4", "u1"]}[name]
        if name == "wireframe":
            view["antialias"] = draw.of([False, True])
            if draw.chance(3):
                view["depth"] = draw.laid_out(draw.numbers(draw.shape(*shape), -1, 1).astype("f4")) if max(
                    size) <= LARGEST and min(size) >= 0 else None  # fmt: skip
        view["out"] = out_of(draw, shape, dtypes, inputs)

    def call(*arrays: Any, **options: Any) -> Any:
        if rasterizer is not None and name != "wireframe":
            return getattr(rasterizer(size), name)(*arrays, **options)
        return getattr(tl, name)(*arrays, size, **options)

    return Case(f"{name} {size}", call, tuple(inputs), view)


def fragments_case(draw: Draw) -> Case:
    """Attributes of a visibility buffer whose ids its owner may have changed."""
    size, n_vertices, n_triangles = (draw.source.integer(1, 40), draw.source.integer(1, 30)), 30, 40
    rng = draw.rng()
    scene = rng.uniform(-5, 45, (n_vertices, 3)), rng.integers(0, n_vertices, (n_triangles, 3))
    frags = tl.rasterize(*scene, size, sampling=draw.of(["center", "msaa4"]), threads=1)
    if draw.chance(3):
        ids = frags.triangle
        ids[draw.source.integer(0, size[1] - 1), draw.source.integer(0, size[0] - 1)] = draw.of(
            [n_triangles, -2, 10**8]
        )
    kind = draw.of(["interpolate", "barycentric", "sample"])
    values = draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(n_vertices, 2), -2, 3), DTYPES))
    image = draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(draw.of([4, 1, 9]), 5, 3), 0, 255), DTYPES))

    def call(values: Any, image: Any, **options: Any) -> Any:
        if kind == "barycentric":
            return frags.barycentric()
        if kind == "sample":
            return frags.sample(image, values, **options)
        return frags.interpolate(values)

    options = {"filter": draw.of(["nearest", "linear", "trilinear"]), "wrap": draw.of(["repeat", "clamp"])}
    return Case(f"Fragments.{kind}", call, (values, image), options if kind == "sample" else {})


def peel_case(draw: Draw) -> Case:
    """`peel`, and `composite` of layers whose ids their owner may have changed."""
    size, view = draw.size(), view_of(draw, ["center"])
    view["layers"] = draw.mostly([2, 1, 4], [0, 300, 2**31, 2**63])
    columns = (3,) if "transform" in view else (3, 4)
    vertices, triangles, _, n_triangles = mesh_arrays(draw, size, columns)
    colors = draw.colors(n_triangles)
    is_composed, is_changed, opacity = (
        draw.chance(2),
        draw.chance(3),
        draw.mostly([None, 0.5], [2.0, -1.0, float("nan")]),
    )

    def call(vertices: Any, triangles: Any, colors: Any, **options: Any) -> Any:
        layers = tl.peel(vertices, triangles, size, **options)
        if not is_composed:
            return layers
        if is_changed and layers.planes[0].size:
            layers.planes[0].reshape(-1)[0] = 10**8
        return tl.composite(layers, colors, per="triangle", opacity=opacity)

    return Case(f"peel {size}", call, (vertices, triangles, colors), view)


def field_case(draw: Draw) -> Case:
    """`field` or `height_map`."""
    size = draw.size()
    is_map = draw.chance(3)
    vertices, triangles, n_vertices, n_triangles = mesh_arrays(draw, size, (3,) if is_map else (2, 3))
    if is_map:
        spacing = draw.mostly([4.0, 1.0, 0.7], [0.0, -1.0, float("nan"), 1e-300, 1e300, 1e-12])
        options = {
            "spacing": spacing,
            "extent": draw.mostly([(0, 60, 0, 40), (-5, 9.5, 2, 11)], [(0, 1e300, 0, 1)]),
            "surface": draw.of(["upper", "lower"]),
            "threads": draw.of([1, None, 2]),
        }
        return Case("height_map", lambda *arrays, **options: tl.height_map(arrays, **options), (vertices, triangles),
                    options)  # fmt: skip
    values = draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(draw.of([n_vertices, n_triangles])), -5, 5), DTYPES))
    inputs = [vertices, triangles, values]
    options = {
        "threads": draw.of([1, None, 2]),
        "subpixel_bits": draw.mostly([8, 0, 16, "exact"], [-1]),
        "origin": draw.of([(0, 0), (5, 3)]),
    }
    if draw.chance(2):
        odd = [(0, 0, 0, 0), (5, -5, 0, 1), (0, 1e300, 0, 1), (0, float("nan"), 0, 1), (-1e308, 1e308, 0, 1)]
        options["extent"] = draw.mostly([(0, 60, 0, 40)], odd)
    out = out_of(draw, size[::-1], ["f8", "f4"], inputs)

    def call(vertices: Any, triangles: Any, values: Any, **options: Any) -> Any:
        return tl.field((vertices, triangles), values, size, **options)

    return Case(f"field {size}", call, tuple(inputs), {**options, "out": out})


def points_case(draw: Draw) -> Case:
    """`points`."""
    size, view = draw.size(), view_of(draw, SAMPLINGS)
    view = {name: value for name, value in view.items() if name not in ("cull", "method")}
    n = draw.of([5, 1, 0, 300])
    positions = draw.vertices(n, (3,) if "transform" in view else (3, 2, 4), size if max(size) <= LARGEST else (60, 40))
    widths = draw.laid_out(draw.as_dtype(np.abs(draw.numbers(draw.shape(n), 1, 9)), DTYPES))
    view["shape"] = draw.of(["square", "disc"])
    view["depth_test"] = draw.of(["less", "greater"])

    def call(positions: Any, widths: Any, **options: Any) -> Any:
        return tl.points(positions, size, point_size=widths, **options)

    return Case(f"points {size}", call, (positions, widths), view)


def rings_of(draw: Draw, size: Any) -> tuple[Any, ...]:
    """Coordinates, offsets of rings, offsets of polygons."""
    n = draw.mostly([8, 3, 40, 300], [2, 0])
    coordinates = draw.vertices(n, (2,), size if max(size) <= LARGEST else (60, 40))
    n_rings = min(draw.of([2, 1, 3]), max(n // 3, 1))
    offsets = np.linspace(0, n, n_rings + 1).astype(int)
    offsets[0], offsets[-1] = 0, n
    offsets = offsets.astype(draw.mostly(["i8", "i4", "u8", ">i4"], ["f8"]))
    if draw.chance(12):
        offsets[draw.source.integer(0, n_rings)] = draw.of([n + 1, 2**31 - 1, 0])
    parts = np.arange(n_rings + 1) if draw.chance(2) else np.array([0, n_rings])
    return coordinates, draw.laid_out(offsets), draw.laid_out(parts)


def in_other_words(form: str, coordinates: Any, offsets: Any, parts: Any) -> Any:
    """The same polygons as `polygons` takes them otherwise; what does not fit together, as it is."""
    if form == "offsets":
        return coordinates, offsets, parts
    points, borders, groups = (np.asarray(each).tolist() for each in (coordinates, offsets, parts))
    if not all(isinstance(each, int) and 0 <= each < 1000 for each in [*borders, *groups]):
        return coordinates, offsets, parts
    rings = [points[first:end] for first, end in pairwise(borders)]
    nested = [rings[first:end] for first, end in pairwise(groups)]
    if form == "flat":
        return [[[number for point in ring for number in point] for ring in each] for each in nested]
    if form == "geojson":
        return {"type": "MultiPolygon", "coordinates": nested}
    return nested


def polygons_case(draw: Draw) -> Case:
    """`polygons`, in the forms that it takes."""
    size = draw.size()
    inputs = [*rings_of(draw, size)]
    n_polygons = len(inputs[2]) - 1
    options: dict[str, Any] = {
        "rule": draw.of(["evenodd", "nonzero"]),
        "sampling": draw.of(["center", "area", "outer", "inner", "msaa4"]),
        "values": draw.of([None, "index", 7, 1e300, [1.5] * n_polygons, np.ones((n_polygons, 3), "u1"), -0.5]),
        "threads": draw.of([1, None, 2]),
        "subpixel_bits": draw.mostly([8, 0, 16], ["exact"]),
        "origin": draw.mostly([(0, 0), (5, -3)], [(2**40, 0), (2**59, 0)]),
    }
    options["out"] = out_of(draw, size[::-1], ["?", "i4", "f4"], inputs)
    form = draw.of(["offsets", "nested", "flat", "geojson"])
    options["background"] = draw.mostly([None, 0], [1e300, -1, float("nan"), [1, 2, 3]])

    def call(*arrays: Any, **options: Any) -> Any:
        return tl.polygons(in_other_words(form, *arrays), size, **options)

    return Case(f"polygons {size}", call, tuple(inputs), options)


def overlap_case(draw: Draw) -> Case:
    """`overlap`, of polygons or of the triangles of a mesh, and what its table computes of a raster."""
    size = draw.size()
    options: dict[str, Any] = {
        "rule": draw.of(["evenodd", "nonzero"]),
        "threads": draw.of([1, None, 2]),
        "subpixel_bits": draw.mostly([8, 0, 16], ["exact", -1]),
        "origin": draw.mostly([(0, 0), (5, -3)], [(2**40, 0), (2**59, 0)]),
        "out": tl.overlap([[(0, 0), (9, 0), (0, 9)]], (9, 9)) if draw.chance(3) else None,
    }
    of_mesh, is_used = draw.chance(3), draw.chance(3)
    inputs = mesh_arrays(draw, size, (2,))[:2] if of_mesh else rings_of(draw, size)
    raster = draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(7, 9), -5, 5), DTYPES)) if is_used else None

    def call(*arrays: Any, **options: Any) -> Any:
        *arrays, raster = arrays
        if of_mesh:
            table = tl.overlap(arrays[0], size, triangles=arrays[1], **options)
        else:
            table = tl.overlap(tuple(arrays), size, **options)
        if raster is None:
            return table
        whole = np.resize(np.asarray(raster), size[::-1]) if max(size) <= LARGEST else raster
        return [*arrays_of(table), table.sums(whole), table.means(whole), table.spread(table.totals())]

    return Case(f"overlap {size}", call, (*inputs, raster), options)


def assumed_valid_case(draw: Draw) -> Case:
    """`polygons` and `overlap` that are promised what is not so: any picture, and no write or read beside it."""
    size = draw.source.integer(1, 70), draw.source.integer(1, 50)
    inputs = [*rings_of(draw, size)]
    name, sampling = draw.of(["polygons", "overlap"]), draw.of(["area", "outer", "inner"])
    options: dict[str, Any] = {"origin": draw.of([(0, 0), (5, -3)]), "subpixel_bits": draw.of([8, 0, 16])}
    if name == "polygons":
        options |= {"sampling": sampling, "values": draw.of([None, "index"])}
        options["out"] = out_of(draw, size[::-1], ["?", "i4", "f4"], inputs)

    def call(*arrays: Any, **options: Any) -> Any:
        return getattr(tl, name)(arrays, size, assume_valid=True, threads=1, **options)

    return Case(f"assume_valid {size}", call, tuple(inputs), options)


def plan_case(draw: Draw) -> Case:
    """`plan`, which explains itself."""
    size, output = draw.size(), draw.of(["coverage", "overdraw", "color", "triangle"])
    more = {"coverage": ["area", "outer", "inner"], "overdraw": ["area", "outer", "inner"], "color": ["area"]}
    view = view_of(draw, [*SAMPLINGS, *more.get(output, [])])
    columns = (3,) if "transform" in view else (2, 3, 4)
    vertices, triangles, _, _ = mesh_arrays(draw, size, columns)

    def call(vertices: Any, triangles: Any, **options: Any) -> Any:
        plan = tl.plan(vertices, triangles, size, outputs=output, **options)
        if not isinstance(plan.to_dict(), dict) or not plan.explain() or not str(plan):
            raise AssertionError("a plan without words")
        return []

    return Case(f"plan {size}", call, (vertices, triangles), view)


def merge_case(draw: Draw) -> Case:
    """`merge` of visibility buffers that are right but for a number here and there."""
    shape = (draw.source.integer(1, 40), draw.source.integer(1, 50), *draw.of([(), (4,)]))
    arrays: list[Any] = []
    n = draw.source.integer(1, 3)
    for _ in range(n):
        ids = draw.rng().integers(-1, 20, draw.shape(*shape)).astype(draw.mostly(["i4"], ["i8", "f4", ">i4", "u4"]))
        if ids.size and ids.dtype.kind == "i" and draw.chance(6):
            ids.reshape(-1)[draw.source.integer(0, ids.size - 1)] = draw.of([20, -2, 10**8])
        depth = draw.numbers(ids.shape if not draw.chance(30) else (3, 3), -1, 1)
        arrays += [draw.laid_out(ids), draw.laid_out(draw.as_dtype(depth, ["f4"]))]
    kind = draw.of(["none", "first", "names"])  # what `triangles` says
    if kind == "first":
        arrays += [draw.mostly([20 * i, 0], [-1, 2**31 - 1, 2**31, 2**63, 1.5]) for i in range(n)]
    if kind == "names":
        for _ in range(n):
            ascending = draw.as_index(np.arange(20) * draw.of([1, 3, 10**8]), ["i4", "i8", ">i8", "u2"])
            arrays.append(draw.triangles(10, 100) if draw.chance(12) else draw.laid_out(ascending))
    options = {"depth_test": draw.of(["less", "greater", None]), "threads": draw.of([1, None, 3])}

    def call(*arrays: Any, **options: Any) -> Any:
        names = None if kind == "none" else arrays[2 * n :]
        return tl.merge(zip(arrays[: 2 * n : 2], arrays[1 : 2 * n : 2], strict=True), triangles=names, **options)

    return Case("merge", call, tuple(arrays), options)


def tiles_case(draw: Draw) -> Case:
    """`tiles`: windows, and slices across them, as they are drawn and as they are cut out of all windows."""
    size = draw.size()
    kind = draw.of(["labels", "depth", "coverage", "overdraw", "fill", "field", "height_map"])
    columns = (3,) if kind in ("depth", "height_map") else (2, 3)
    vertices, triangles, n_vertices, n_triangles = mesh_arrays(draw, size, columns)
    options: dict[str, Any] = {"kind": kind, "threads": draw.of([1, None, 2])}
    values = None
    if kind == "fill":
        values, options["per"] = draw.colors(n_triangles), "triangle"
        options["blend"] = draw.of(["replace", "over", "add"])
    if kind == "field":
        values = draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(draw.of([n_vertices, n_triangles])), -5, 5),
                                             DTYPES))  # fmt: skip
    if kind in ("field", "height_map") or draw.chance(4):
        odd = [(0, 0, 0, 0), (5, -5, 0, 1), (0, 1e300, 0, 1), (0, float("nan"), 0, 1), (-1e308, 1e308, 0, 1)]
        options["extent"] = draw.mostly([(0, 60, 0, 40), (-5, 9.5, 2, 11)], odd)
    if draw.chance(3):
        options["subpixel_bits"] = draw.mostly([8, 0, 4, 16], [-1, 17, "exact"])
    if draw.chance(4):
        options["cull"] = draw.of(["none", "back", "front"])
    if kind in ("coverage", "overdraw", "fill") and draw.chance(2):
        options["sampling"] = draw.of(["center", "msaa4", "area", "outer"])
    if draw.chance(6):
        options["memory"] = draw.mostly([0, 64], [-1, 2**70])
    window = draw.mostly([16, (7, 50), 4, (100, 3)], [0, -1, 2**31, 2**63, (1, 2**31 - 1)])
    first, end, step = draw.source.integer(-3, 60), draw.source.integer(-3, 60), draw.mostly([1, 3], [0, -1])

    def call(vertices: Any, triangles: Any, values: Any, **options: Any) -> Any:
        raster = tl.tiles((vertices, triangles), size, values=values, window=window, **options)
        if raster.n_windows > 2000 or max(raster.shape) > LARGEST:
            return raster[:3, :5] if max(raster.shape) < 2**31 - 1 else []
        whole = np.empty(raster.shape, raster.dtype)
        for each in raster:
            whole[each.slices] = each.pixels
        part = raster[first:end:step, end:]
        cut = whole[first:end:step, end:]
        if part.tobytes() != np.ascontiguousarray(cut).tobytes():
            raise AssertionError("a slice that is not that of the windows")
        return [whole, part]

    return Case(f"tiles {size}", call, (vertices, triangles, values), options)


def batch_case(draw: Draw) -> Case:
    """`rasterize_poses`."""
    size, view = (draw.source.integer(1, 50), draw.source.integer(1, 40)), view_of(draw, SAMPLINGS)
    n, n_vertices, n_triangles = draw.of([3, 1, 0]), draw.of([6, 3, 40, 0]), draw.of([2, 1, 0, 30])
    columns = 3 if "transform" in view else draw.of([3, 2, 4])
    poses = draw.numbers(draw.shape(n, n_vertices, columns), -20, 70)
    if "transform" in view and draw.chance(2):
        view["transform"] = np.stack([np.asarray(view["transform"])] * draw.mostly([max(n, 1)], [n + 1]))
        poses = poses[0] if poses.ndim and len(poses) else poses
    inputs = draw.laid_out(draw.as_dtype(poses, DTYPES)), draw.triangles(n_triangles, n_vertices)
    view["depth_test"] = draw.of(["less", "greater", None])

    def call(*arrays: Any, **options: Any) -> Any:
        found = tl.rasterize_poses(*arrays, size, **options)
        return [found.triangle, found.depth, found.barycentric()]

    return Case(f"poses {size}", call, inputs, view)


def mesh_case(draw: Draw) -> Case:
    """Pictures of a `Mesh`: shaded, as layers, as a silhouette, through a lens, simplified."""
    size = draw.size()
    vertices, triangles, n_vertices, n_triangles = mesh_arrays(draw, (6, 5), (3,))
    uv = (
        draw.laid_out(draw.as_dtype(draw.numbers(draw.shape(n_vertices, 2), -1, 2), DTYPES)) if draw.chance(2) else None
    )
    colors = draw.colors(n_vertices) if draw.chance(3) else None
    name = draw.of(["render", "silhouette", "render_layers", "rasterize_mesh", "transparent", "simplify", "clusters"])
    eye = draw.mostly([(4.0, 3.0, 9.0), (2.0, 2.0, 2.0)], [(0, 0, 0), (1e-300, 0, 1e-300), (1e30, 0, 0)])
    look = {"sampling": draw.of(["center", "msaa4"])} if name in ("render", "silhouette") else {}
    if name == "render":
        look["shading"] = draw.of(["smooth", "flat", "unlit"])
        look["subpixel_bits"] = draw.mostly([8, "exact"], [-1, "exactly"])
    lens = tl.OpenCVLens(k1=draw.of([-0.2, 0.1])) if draw.chance(6) and n_triangles <= 30 else None
    threads = draw.of([1, None, 2])

    def call(vertices: Any, triangles: Any, uv: Any, colors: Any) -> Any:
        image = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
        materials = (tl.Material(texture=tl.Texture(image)),) if uv is not None else ()
        mesh = tl.Mesh(vertices, triangles, uv=uv, colors=colors, materials=materials)
        camera = tl.Camera.look_at(eye, (2, 2, 0.5), fov_y_deg=50)
        if lens is not None:
            camera = tl.Camera(camera.view, camera.projection, lens=lens)
        if name == "simplify":
            levels = tl.simplify(mesh, smallest=8)
            return [np.asarray(level.mesh.vertices) for level in levels]
        if name == "clusters":
            return [np.asarray(mesh.bounds), mesh.vertex_normals(), mesh.clusters.triangles]
        if name == "transparent":
            return tl.render_transparent(mesh, camera, size, threads=threads)
        if name == "render_layers":
            layers = tl.render_layers(
                mesh, camera, size, layers=["depth", "world_normal", "triangle", "color"], threads=threads
            )
            return [layers[each] for each in layers]
        return getattr(tl, name)(mesh, camera, size, threads=threads, **look)

    return Case(f"{name} {size}", call, (vertices, triangles, uv, colors))


KINDS: dict[str, Callable[[Draw], Case]] = {
    "verb": verb_case,
    "fragments": fragments_case,
    "peel": peel_case,
    "field": field_case,
    "points": points_case,
    "polygons": polygons_case,
    "mesh": mesh_case,
    "overlap": overlap_case,
    "assume_valid": assumed_valid_case,
    "plan": plan_case,
    "merge": merge_case,
    "tiles": tiles_case,
    "batch": batch_case,
    "gradients": gradients_case,
    "rle": rle_case,
    "voxels": voxels_case,
    "bake": bake_case,
    "seen": seen_case,
}


def plain(value: Any) -> Any:
    """Copies of arrays, contiguous, aligned, of the machine's byte order."""
    if isinstance(value, np.ndarray):
        return np.array(value, value.dtype.newbyteorder("="), order="C")
    if isinstance(value, tuple):
        return tuple(plain(each) for each in value)
    return value


def owner_of(array: np.ndarray) -> np.ndarray:
    """The array whose memory it is."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


def memory_of(array: np.ndarray) -> bytes:
    """All bytes of the memory that an array lies in."""
    return b"" if array.dtype.hasobject else owner_of(array).tobytes()


def guards_of(outs: Sequence[np.ndarray]) -> list[bytes]:
    """What lies before and behind the memory to draw into."""
    return [memory_of(out)[:GUARD] + memory_of(out)[-GUARD:] for out in outs if owner_of(out).ndim == 1]


def must(holds: bool, case: Case, words: str) -> None:
    """Raise an AssertionError about a case."""
    if not holds:
        raise AssertionError(f"{words}: {case}")


def check(case: Case) -> str:
    """Run a case; returns "drawn" or the name of the error that refused it. What must not be is an AssertionError."""
    out = case.options.get("out")
    outs = [each for each in (out if isinstance(out, tuple) else (out,)) if isinstance(each, np.ndarray)]
    apart = [each for each in case.arguments
             if isinstance(each, np.ndarray) and not any(np.may_share_memory(each, one) for one in outs)]  # fmt: skip
    again = Case(case.name, case.call, plain(case.arguments), {**case.options, "out": plain(out)})
    if "out" not in case.options:
        del again.options["out"]
    before, drawn_over, guards = (
        [memory_of(each) for each in apart],
        [memory_of(each) for each in outs],
        guards_of(outs),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of NumPy, for numbers that overflow when they become float32
        try:
            results = [result.copy() for result in case.run()]
        except REFUSALS as error:
            words = str(error)
            must("\n" not in words and 0 < len(words) < 900, case, f"{type(error).__name__} says {words!r}")
            must("bytes" in words or not isinstance(error, MemoryError), case, words)
            must([memory_of(each) for each in outs] == drawn_over, case, f"out has changed, and then: {words}")
            return type(error).__name__
        must([memory_of(each) for each in apart] == before, case, "an input has changed")
        must(guards_of(outs) == guards, case, "a write beside out")
        if "threads" in again.options:
            again.options["threads"] = 3 if again.options["threads"] == 1 else 1
        for got, expected in zip(results, again.run(), strict=True):
            must(got.dtype == expected.dtype, case, f"plain copies give {expected.dtype}, not {got.dtype}")
            differ = (got != expected) & ~((got != got) & (expected != expected))
            must(not differ.any(), case, f"plain copies give {expected[differ][:3]}, not {got[differ][:3]}")
    return "drawn"


def check_one(source: Source, kind: str | None = None) -> str:
    """Draw a case and check it."""
    draw = Draw(source)
    case = KINDS[kind or draw.of([*KINDS, "verb", "verb", "verb"])](draw)
    return f"{case.name.partition(' ')[0]} {check(case)}"
