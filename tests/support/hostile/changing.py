"""Fuzz calls whose arrays change meanwhile: `python tests/support/hostile/changing.py --seconds 60`.

Another process writes to the arrays of each case. Any picture and any documented error will do; a crash, a write beside
an array and a call that takes minutes will not. Each case is printed before it runs: its options, how fast which arrays
change. All that follows from `--seed N --cases 1`, but not what meets when.
"""

import argparse
import faulthandler
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import product
from typing import Any

import numpy as np
from changing_arrays import Changing
from changing_tensors import backward, gradients, grids, jax_arrays, torch_tensors
from draws import REFUSALS, SAMPLINGS, Draw, FromRandom, view_of

import topleft as tl

METHODS = ["auto", "edge", "scanline", "edge_increment", "float_barycentric", "row_crossing", "zigzag", "lerp_scanline"]
LAYERS = ["color", "alpha", "depth", "distance", "triangle", "barycentric", "world_position", "world_normal"]
SECONDS_OF_A_CASE = 0.012
SECONDS_UNTIL_HUNG = 240

Case = tuple[str, Callable[[], Any]]


def attempts(*calls: Callable[[], Any]) -> None:
    """Make some calls, each whatever becomes of the others."""
    for call in calls:
        with suppress(*REFUSALS):
            call()


def in_words(options: dict[str, Any]) -> str:
    """The options that are words or numbers."""
    return " ".join(f"{name}={value}" for name, value in options.items() if isinstance(value, str | int | float))


def size_of(draw: Draw) -> tuple[int, int]:
    """A small picture, now and then a wide, tall or larger one."""
    if draw.chance(5):
        return draw.of([(1600, 320), (4000, 12), (9, 3000), (640, 480), (2048, 2048)])
    return draw.source.integer(1, 70), draw.source.integer(1, 50)


def options_of(
    draw: Draw, samplings: Sequence[str] = ("center",), methods: Sequence[str] = ("auto",)
) -> dict[str, Any]:
    """What all verbs share, so that there is mostly something in the picture."""
    view = view_of(draw, samplings)
    view.pop("viewport", None)
    if "method" in view:
        view["method"] = draw.of(methods)
    if "origin" in view:
        view["origin"] = draw.of([(3, 2), (-7, 9)])
    if "transform" in view:
        view["transform"] = np.eye(4) + draw.rng().uniform(-0.2, 0.2, (4, 4))
    return view


def mesh_of(
    changing: Changing, size: tuple[int, int], columns: int, *, is_clip: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices in groups of four, near each other or not, and triangles of such a group."""
    draw, rng = changing.draw, changing.rng
    n_triangles = draw.of([5_000, 20_000, 200_000]) if draw.chance(8) else draw.of([64, 1, 2, 8, 30])
    n_groups = n_triangles // 2 + 1
    spread = draw.of([1.0, 0.3, 0.05]) if n_triangles < 100 else draw.of([0.01, 0.002, 0.1])
    places = rng.uniform(-0.1, 1.1, (n_groups, 1, columns)) + rng.normal(0, spread, (n_groups, 4, columns))
    vertices = places.reshape(-1, columns)
    vertices[:, :2] = vertices[:, :2] * 2 - 1 if is_clip else vertices[:, :2] * size
    if columns == 4:
        vertices[:, 3] = np.abs(vertices[:, 3]) + 0.1
        vertices[:, :3] *= vertices[:, 3:]
    corners = rng.permuted(np.tile(np.arange(4), (n_triangles, 1)), axis=1)[:, :3]
    triangles = 4 * rng.integers(0, n_groups, (n_triangles, 1)) + corners
    return (
        changing.share("vertices", vertices.astype(draw.of(["f8", "f4", "f8", "f4", "i8", "i4"]))),
        changing.share("triangles", triangles.astype(draw.of(["i4", "i4", "i8"])), len(vertices)),
    )


def scene_of(changing: Changing, size: tuple[int, int], view: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """A mesh that suits the options; their transform changes, too."""
    if "transform" in view:
        view["transform"] = changing.share("transform", view["transform"])
        return mesh_of(changing, size, 3, is_clip=True)
    columns = changing.draw.of([3, 2, 4])
    return mesh_of(changing, size, columns, is_clip=columns == 4)


def out_of(changing: Changing, shape: Sequence[int], dtypes: str) -> np.ndarray | None:
    """Mostly nothing; or an array to draw into that others write to."""
    return changing.numbers("out", tuple(shape), 0, 1, dtypes) if changing.draw.chance(4) else None


def verb(changing: Changing) -> Case:
    """`coverage`, `overdraw`, `fill`, `rasterize` or `wireframe`, also of a `Rasterizer`."""
    draw, size = changing.draw, size_of(changing.draw)
    name = draw.of(["rasterize", "fill", "coverage", "overdraw", "wireframe"])
    areas = {"coverage": ["area", "outer", "inner"], "overdraw": ["area", "outer", "inner"], "fill": ["area"] * 2}
    view = options_of(draw, ["center"] if name == "wireframe" else [*SAMPLINGS, *areas.get(name, [])], METHODS)
    arrays = [*scene_of(changing, size, view)]
    shape = size[::-1]
    if name == "fill":
        view["per"] = draw.of(["triangle", "vertex"])
        n = len(arrays[view["per"] == "triangle"])
        arrays.append(changing.numbers("colors", (n, draw.of([4, 3, 1])), 0, 255, "u1 f4 f8"))
        view["blend"] = draw.of(["replace", "over", "add", "multiply", "max", "min"])
        view["alpha"] = draw.of(["straight", "premultiplied"])
        view["resolve"] = draw.of(["values", "linear"]) if arrays[2].dtype == np.uint8 else "values"
        view["out"] = out_of(changing, (*shape, arrays[2].shape[1]), "u1" if arrays[2].dtype == np.uint8 else "f4")
    elif name == "rasterize":
        view["depth_test"] = draw.of(["less", "greater", None])
        view["out"] = out_of(changing, shape, "i4"), out_of(changing, shape, "f4")
    else:
        view["out"] = out_of(changing, shape, {"coverage": "? f4", "overdraw": "i4 f4", "wireframe": "? f4 u1"}[name])
    if name == "wireframe":
        view["antialias"] = draw.chance(2)
        view["depth"] = changing.numbers("depth", shape, 0, 1) if draw.chance(2) else None
    more = draw.of(["once", "once", "once", "once", "Rasterizer"]) if name != "wireframe" else "once"

    def call() -> None:
        options = dict(view)
        if more == "Rasterizer":
            draws = getattr(tl.Rasterizer(size), name)
            attempts(lambda: draws(*arrays, **options), lambda: draws(*arrays, **options))
        else:
            getattr(tl, name)(*arrays, size, **options)

    return f"{name} {size} {more} {in_words(view)}", call


def fragments(changing: Changing) -> Case:
    """Attributes of a visibility buffer."""
    draw, size = changing.draw, size_of(changing.draw)
    view = options_of(draw, SAMPLINGS)
    arrays = scene_of(changing, size, view)
    is_multisampled = view.get("sampling", "center") != "center"
    if not is_multisampled:
        view["out"] = out_of(changing, size[::-1], "i4"), out_of(changing, size[::-1], "f4")
    values = changing.numbers("values", (len(arrays[0]), draw.of([2, 1, 3, 5])), -2, 3, "f4 f8")
    uv = changing.numbers("uv", (len(arrays[0]), 2), -1, 2)
    image = changing.numbers("texture", (draw.of([4, 9, 64]), 5, draw.of([3, 4])), 0, 255, "u1 f4")
    rows, cols = (changing.numbers("places", (9,), 0, n, "i8", n) for n in size[::-1])
    options = {"filter": draw.of(["nearest", "bilinear", "trilinear"]), "wrap": draw.of(["repeat", "clamp", "mirror"])}
    camera = tl.Camera.look_at((4, 3, 9), (0, 0, 0))

    def call() -> None:
        found = tl.rasterize(*arrays, size, **view)
        attempts(
            lambda: found.interpolate(values),
            found.barycentric,
            lambda: found.interpolate(values, derivatives=True),
            lambda: found.sample(image, uv, **options),
            lambda: found.only(rows, cols).interpolate(values),
            lambda: found.distance(camera),
            lambda: found.sample(1).barycentric() if is_multisampled else found.depth,
            lambda: tl.wireframe(*arrays, size, depth=found),
        )

    return f"fragments {size} {in_words(view | options)}", call


def layers(changing: Changing) -> Case:
    """`peel`, and `composite` of layers whose ids change, too."""
    draw, size = changing.draw, size_of(changing.draw)
    view = options_of(draw) | {"layers": draw.of([2, 1, 4, 16]), "depth_test": draw.of(["less", "greater"])}
    arrays = scene_of(changing, size, view)
    channels, opacity = draw.of([(4, None), (3, 0.5)])
    options: dict[str, Any] = {"per": draw.of(["triangle", "vertex"]), "opacity": opacity}
    n, n_triangles, shape = len(arrays[options["per"] == "triangle"]), len(arrays[1]), size[::-1]
    colors = changing.numbers("colors", (n, channels), 0, 255, "u1 f4 f8")
    ids = changing.numbers("ids", (view["layers"], *shape), -1, n_triangles, "i4", n_triangles)
    options["out"] = out_of(changing, (*shape, 4), "u1" if colors.dtype == np.uint8 else "f4")
    options["threads"] = view["threads"]

    def call() -> None:
        found = tl.peel(*arrays, size, **view)
        shared = tl.DepthLayers(ids, found.planes[1], found._snapped)
        attempts(
            lambda: tl.composite(found, colors, **options),
            lambda: tl.composite(shared, colors, **options),
            lambda: shared.layer(0).barycentric(),
            lambda: shared.count,
        )

    return f"peel {size} {in_words(view | options)}", call


def points(changing: Changing) -> Case:
    """`points`."""
    draw, size = changing.draw, size_of(changing.draw)
    view = options_of(draw, SAMPLINGS) | {"shape": draw.of(["square", "disc"])}
    view = {name: value for name, value in view.items() if name not in ("cull", "method")}
    positions, _ = scene_of(changing, size, view)
    widths = changing.numbers("point_size", (len(positions),), 0, 9, "f4 f8")

    def call() -> None:
        tl.points(positions, size, point_size=widths, **view).interpolate(widths)

    return f"points {size} {in_words(view)}", call


def merge(changing: Changing) -> Case:
    """`merge` of two visibility buffers."""
    draw, size = changing.draw, size_of(changing.draw)
    shape = (*size[::-1], *draw.of([(), (4,)]))
    ids = [changing.numbers("ids", shape, -1, 20, "i4", 20) for _ in range(2)]
    depths = [changing.numbers("depth", shape, -1, 1) for _ in range(2)]
    names = [changing.share("names", np.arange(20, dtype=draw.of(["i4", "i8"]))) for _ in range(2)]
    options = {"triangles": draw.of([names, None, [0, 20]]), "depth_test": draw.of(["less", "greater", None]),
               "threads": draw.of([1, 2, 3])}  # fmt: skip
    return f"merge {shape} {in_words(options)}", lambda: tl.merge(zip(ids, depths, strict=True), **options)


def rasters(changing: Changing) -> Case:
    """`field`, `height_map`, `tiles`, and `rasterize_poses`."""
    draw, size = changing.draw, size_of(changing.draw)
    name = draw.of(["field", "height_map", "tiles", "poses"])
    view = options_of(draw, SAMPLINGS)
    mesh = vertices, triangles = mesh_of(changing, size, 3, is_clip=name == "poses" and "transform" in view)
    per = draw.of(["vertex", "triangle"])
    n = len(vertices if per == "vertex" else triangles)
    values = changing.numbers("values", (n,), -5, 5, "f8 f4")
    kind = draw.of(["labels", "depth", "coverage", "overdraw", "fill", "field", "height_map"])
    options: dict[str, Any] = {"threads": view["threads"]}
    if name == "poses":
        options = view
        poses = vertices if "transform" in view else changing.share("poses", np.stack([vertices] * 3))
        if "transform" in view:
            view["transform"] = changing.share("transform", np.stack([view["transform"]] * 3))
    elif name == "tiles":
        options |= {"kind": kind, "extent": (0, size[0], 0, size[1]), "window": draw.of([16, (7, 50), 200])}
        if kind == "fill":
            options |= {"values": changing.numbers("colors", (n, 3), 0, 255, "u1 f4"), "per": per}
        if kind == "field":
            options |= {"values": values, "per": per}
    else:
        options |= {"subpixel_bits": draw.of([8, 0, 16, "exact"])}
        if name == "field":
            options |= {"per": per, "out": out_of(changing, size[::-1], "f8 f4")}
        else:
            options |= {"surface": draw.of(["upper", "lower"]), "extent": (0, size[0], 0, size[1])}

    def call() -> None:
        if name == "poses":
            tl.rasterize_poses(poses, triangles, size, **options).interpolate(vertices)
        elif name == "tiles":
            raster = tl.tiles(mesh, size, **options)
            attempts(lambda: next(iter(raster)).pixels, lambda: raster[:40, :90])
        elif name == "field":
            tl.field(mesh, values, size, **options)
        else:
            tl.height_map(mesh, max(1.0, size[0] / 60), **options)

    return f"{name} {size} {in_words(options)}", call


def rings(changing: Changing) -> Case:
    """`polygons` and `overlap` of rings or of triangles, also of what is promised to be valid."""
    draw, rng, size = changing.draw, changing.rng, size_of(changing.draw)
    n_polygons = 3_000 if draw.chance(8) else draw.of([1, 2, 9])
    n_rings = n_polygons * draw.of([1, 2])
    n = n_rings * draw.of([3, 8, 40])
    angles, reach = np.linspace(0, 6.2, n // n_rings), draw.of([0.5, 0.05]) * min(size) + 1
    middles = rng.uniform(0, 1, (n_rings, 1, 2)) * size
    corners = (middles + reach * np.stack([np.cos(angles), np.sin(angles)], 1)).reshape(-1, 2)
    if draw.chance(6):
        corners = rng.permutation(corners)
    given: Any = (
        changing.share("coordinates", corners.astype(draw.of(["f8", "f8", "f4", "i8"]))),
        changing.share("offsets", np.linspace(0, n, n_rings + 1).astype(draw.of(["i8", "i4"])), n),
        changing.share("parts", np.linspace(0, n_rings, n_polygons + 1).astype(draw.of(["i8", "i4"])), n_rings),
    )
    options: dict[str, Any] = {"rule": draw.of(["evenodd", "nonzero"]), "threads": draw.of([1, 2, 3]),
                               "subpixel_bits": draw.of([8, 0, 16]), "assume_valid": draw.chance(2)}  # fmt: skip
    if draw.chance(2):
        values = draw.of(["index", None, changing.numbers("values", (n_polygons,), 0, 9),
                          changing.numbers("values", (n_polygons, 3), 0, 255, "u1")])  # fmt: skip
        options["sampling"] = draw.of(["center", "area", "outer", "inner", "msaa4"])
        dtype = ("?" if options["sampling"] == "center" else "f4") if values is None else "f4"
        options |= {"values": values, "out": out_of(changing, size[::-1], "i4" if values == "index" else dtype) if (
            values is None or isinstance(values, str)) else None}  # fmt: skip
        return f"polygons {size} {in_words(options)}", lambda: tl.polygons(given, size, **options)
    if draw.chance(3):
        given, options["triangles"] = mesh_of(changing, size, 2)
    raster = changing.numbers("raster", size[::-1], 0, 9, "f8")

    def call() -> None:
        table = tl.overlap(given, size, **options)
        again = tl.overlap(given, size, out=table, **options)
        attempts(lambda: again.means(raster), lambda: again.spread(again.totals()))

    return f"overlap {size} {in_words(options)}", call


def pictures(changing: Changing) -> Case:
    """Pictures of a `Mesh`, a scene or points whose arrays change, one after another, and what is computed of them."""
    draw, rng, size = changing.draw, changing.rng, size_of(changing.draw)
    vertices, triangles = mesh_of(changing, (5, 4), 3)
    n = len(vertices)
    has_uv, mode, of = draw.chance(2), draw.of([None, "mask", "blend"]), draw.of(["mesh", "mesh", "scene", "points"])
    texture = changing.numbers("texture", (draw.of([4, 16, 64]), 8, draw.of([3, 4])), 0, 255, "u1")
    matrices = changing.share("matrices", np.stack([np.eye(4), np.eye(4) + 0.1 * np.eye(4, k=1)]))
    sizes = changing.numbers("sizes", (n,), 0, 5, "f8")
    attributes: dict[str, Any] = {"crease": draw.of([180.0, 30.0, 0.0])}
    if has_uv:
        attributes |= {name: changing.numbers(name, (n, 2), -1, 2) for name in ("uv", "uv1")}
    if draw.chance(3):
        attributes["normals"] = changing.share("normals", rng.normal(0, 1, (n, 3)).astype(draw.of(["f4", "f8"])))
    if draw.chance(3):
        attributes["colors"] = changing.numbers("colors", (n, draw.of([3, 4])), 0, 255, "u1")
    if draw.chance(2):
        rows = changing.numbers("material_of_triangle", (len(triangles),), 0, 2, "i4", 2)
        attributes["material_of_triangle"] = rows
    camera = tl.Camera.look_at((4.0, 3.0, 9.0), (2, 2, 0.5), fov_y_deg=50)
    if draw.chance(8) and len(triangles) <= 64:
        camera = tl.Camera(camera.view, camera.projection, lens=tl.OpenCVLens(k1=-0.1))
    look = {"threads": draw.of([1, 2, 3]), "cull": draw.of(["none", "back"]) if of != "points" else "none"}
    view = look | {"subpixel_bits": draw.of([8, "exact"]), "sampling": draw.of(["center", "msaa4"])}
    shading = draw.of(["smooth", "flat", "unlit", "normals", "depth", "ids"])
    names = [draw.of(list(PICTURES)) for _ in range(draw.of([1, 2, 3]))]

    def call() -> None:
        image = tl.Texture(texture)
        materials = [tl.Material(texture=image, alpha_mode=mode, normal_texture=image), tl.Material((200, 9, 9))]
        subject: Any
        if of == "points":
            clouds = {name: attributes[name] for name in ("normals", "colors") if name in attributes}
            subject = tl.Points(vertices, size=sizes, **clouds)
        else:
            subject = tl.Mesh(vertices, triangles, materials=materials if has_uv else [tl.Material()] * 2, **attributes)
        if of == "scene":
            subject = tl.Scene([tl.Instance(subject, transform=matrix) for matrix in matrices])
        attempts(*(lambda name=name: PICTURES[name](subject, camera, size, look, view, shading) for name in names))

    return f"{'+'.join(names)} of {of} {size} {in_words(view)} {shading}", call


def shaded(subject: Any, camera: Any, size: Any, look: Any, view: Any, shading: Any) -> None:
    """A picture in two steps, and distances between them."""
    found = tl.rasterize_mesh(subject, camera, size, **view)
    attempts(
        lambda: found.distance(camera),
        lambda: tl.shade(found, subject, camera, shading=shading, threads=look["threads"]),
    )


def numbers_of(subject: Any, *_: Any) -> None:
    """What a mesh computes of itself."""
    verbs = ["vertex_normals", "corner_normals"] if isinstance(subject, tl.Mesh) else []
    attempts(
        lambda: subject.bounds, lambda: getattr(subject, "clusters", None), *(getattr(subject, name) for name in verbs)
    )


def simplified(subject: Any, camera: Any, size: Any, *_: Any) -> None:
    """A picture of a level."""
    if isinstance(subject, tl.Mesh):
        attempts(lambda: tl.simplify(subject, smallest=8))  # kept with the mesh
    tl.render(subject, camera, size, tolerance=5.0)


PICTURES: dict[str, Callable[..., Any]] = {
    "render": lambda subject, camera, size, _, view, shading: tl.render(subject, camera, size, shading=shading, **view),
    "edges": lambda subject, camera, size, look, *_: tl.render(subject, camera, size, edges=True, **look),
    "silhouette": lambda subject, camera, size, _, view, *__: tl.silhouette(subject, camera, size, **view),
    "area": lambda subject, camera, size, look, *_: tl.silhouette(subject, camera, size, sampling="area", **look),
    "shade": shaded,
    "layers": lambda subject, camera, size, look, *_: tl.render_layers(subject, camera, size, layers=LAYERS, **look),
    "transparent": lambda subject, camera, size, look, *_: tl.render_transparent(subject, camera, size, **look),
    "visible_layers": lambda subject, camera, size, look, *_: tl.visible_layers(subject, camera, size, **look).count,
    "simplify": simplified,
    "plan": lambda subject, camera, size, *_: tl.plan(subject, camera, size).explain(),
    "detail": lambda subject, camera, size, *_: tl.choose_detail(subject, camera, size, tolerance=1.0),
    "numbers": numbers_of,
    "height_map": lambda subject, *_: tl.height_map(subject, 0.1, extent=(0, 5, 0, 4)),
}

CASES: dict[str, Callable[[Changing], Case]] = {
    "verb": verb,
    "fragments": fragments,
    "layers": layers,
    "points": points,
    "merge": merge,
    "rasters": rasters,
    "rings": rings,
    "pictures": pictures,
    "gradients": gradients,
    "backward": backward,
    "grids": grids,
}

#: Those that need PyTorch or JAX, by `--kind`.
TENSOR_CASES = {"torch": torch_tensors, "jax": jax_arrays}


def run_one(seed: int, kind: str | None = None) -> str:
    """Make the calls of a case, again and again, while its arrays change; "drawn" if ever, or the first refusal."""
    draw = Draw(FromRandom(seed))
    changing = Changing(draw)
    name, call = (CASES | TENSOR_CASES)[kind or draw.of(["verb", "verb", "pictures", "pictures", *CASES])](changing)
    print(f"seed {seed}: {name} {changing}", flush=True)
    outcomes: list[str] = []
    end = time.monotonic() + SECONDS_OF_A_CASE
    faulthandler.dump_traceback_later(SECONDS_UNTIL_HUNG, exit=True)
    if kind in TENSOR_CASES:  # what JAX compiles for these shapes is compiled before anything changes
        with suppress(*REFUSALS):
            call()
    with changing.changed():
        while not outcomes or time.monotonic() < end:
            try:
                call()
                outcomes.append("drawn")
            except REFUSALS as error:
                outcomes.append(type(error).__name__)
    faulthandler.cancel_dump_traceback_later()
    return "drawn" if "drawn" in outcomes else outcomes[0]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--cases", type=int, default=10**12, help="end after so many")
    parser.add_argument("--seed", type=int, default=0, help="of the first case")
    parser.add_argument("--kind", choices=CASES | TENSOR_CASES, nargs="+", default=[None], help="cases of each")
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # of NumPy, for odd numbers, and of Python, for a fork beside threads
    found: Counter[str] = Counter()
    end = time.monotonic() + options.seconds
    for seed, kind in product(range(options.seed, options.seed + options.cases), options.kind):
        if time.monotonic() > end:
            break
        found[run_one(seed, kind)] += 1
    print(f"{found.total():,} cases, none that must not be:", *(f"{name} {n:,}" for name, n in found.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
