"""Times calls that do the same work in several ways, in turns: one table of studies, one record, one way to print it.

A study yields scenes; each has a name and its calls; the first one is compared with the others. Times are CPU
times of the process, one thread unless a call says otherwise.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.arguments import Options, option, positive
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save
from benchmarks.harness.turns import take_turns, turn_of
from benchmarks.report.study import Study
from benchmarks.report.tables import facts_text, number, table
from benchmarks.scenes.arrays import blob_arrays, strewn_arrays, terrain_arrays
from benchmarks.scenes.families import NO_SNAP
from benchmarks.small.others import (
    HD,
    Calls,
    Scenes,
    field_beside_others,
    gradients_beside_deodr,
    grids_beside_others,
    objects_beside_bop,
    run_lengths_beside_coco,
)  # fmt: skip

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

UHD = (3840, 2160)


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
"""The sampling, and the part of the result that is read, by name."""


def samples_beside_one() -> Scenes:
    """Ids and depth of several samples a pixel beside one: meshes with back faces culled, and soup."""
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


def layers_beside_picture() -> Scenes:
    """Each layer of a view beside its picture: a mesh of 70,000 triangles at 512x512; calls share nothing."""
    import topleft as tl
    from topleft._core.base.options import LAYER_NAMES

    size = (512, 512)
    vertices, triangles = tl.scenes.blob(70_000)
    mesh = tl.Mesh(vertices, triangles, uv=np.random.default_rng(0).random((len(vertices), 2), np.float32))
    camera = tl.Camera.framing(mesh, aspect=1.0)
    options: dict[str, Any] = {
        "cull": "back", "threads": 1, "rasterizer": tl.Rasterizer(size, threads=1),
        "camera_to": replace(camera, view=tl.Camera.framing(mesh, aspect=1.0, azimuth_deg=40).view),
    }  # fmt: skip
    made: dict[str, Callable[[], object]] = {
        name: partial(tl.render_layers, mesh, camera, size, layers=(name,), **options) for name in LAYER_NAMES
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


TERRAINS = (1_000_000, 4_000_000, 10_000_000)  # triangles
TREES = 4_000_000, 500  # triangles of the terrain, and how many stand on it


def parts_beside_whole() -> Scenes:
    """Views of terrains that begin at the camera, within half a pixel beside without; levels are made before.

    Then those of one among trees.
    """
    import topleft as tl

    for n, n_trees in (*((n, 0) for n in TERRAINS), TREES):
        mesh = tl.Mesh(*terrain_arrays(n))
        subject, name = (among_trees(mesh, n_trees), f" with {n_trees} trees") if n_trees else (mesh, "")
        top = float(mesh.vertices[:, 1].max())
        looks = {
            "from its edge": ((0, 0.16, 1.1), (0, 0, 0), 0.01),
            "over the ground": ((0.02, top + 0.02, 0.9), (0, 0.3 * top, -0.5), 0.005),
            "from its middle": ((0.02, top + 0.01, 0), (0.3, 0.3 * top, -1), 0.002),
        }
        for look, (eye, target, near) in looks.items():
            camera = tl.Camera.look_at(eye, target, fov_y_deg=50, near=near, far=100)
            found = tl.choose_detail(mesh, camera, HD, tolerance=0.5)
            for verb in (tl.rasterize_mesh, tl.render):
                kept = {} if n_trees else {"rasterizer": tl.Rasterizer(HD, threads=1)}
                draw = partial(verb, subject, camera, HD, threads=1, **kept)
                for _ in range(2):  # the second picture sorts clusters
                    draw()
                yield f"terrain of {n:,}{name}, {look}, {verb.__name__}", {
                    "whole": draw, f"{found.n_drawn:,} in {found.n_parts} parts": partial(draw, tolerance=0.5),
                }  # fmt: skip


def among_trees(ground: Any, n: int) -> Any:
    """The scene of a ground and so many balls of 4,000 triangles that stand on its vertices."""
    import topleft as tl

    tree = tl.Mesh(*tl.scenes.blob(4000))
    places = np.tile(np.diag([*3 * [0.004 / np.abs(tree.bounds).max()], 1.0]), (n, 1, 1))
    rows = np.random.default_rng(1).choice(len(ground.vertices), n, replace=False)
    places[:, :3, 3] = ground.vertices[rows] + [0, 0.004, 0]
    return tl.Scene([ground, *((tree, place) for place in places)])


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


@dataclass(frozen=True)
class Pairs:
    """A row of the table: the call, the number of turns, and the length of a turn, seconds; 0: one call."""

    scenes: Callable[[], Scenes]
    help: str
    rounds: int
    seconds: float = 0.0


PAIRS = {
    "large": Pairs(verbs_beside_fill, "time one large triangle beside a fill of the same memory", 60),
    "samples": Pairs(samples_beside_one, "time several samples a pixel beside one", 9, 0.2),
    "layers": Pairs(layers_beside_picture, "time each layer of a view beside its picture", 40),
    "tolerance": Pairs(levels_beside_whole, "time views with `tolerance=` beside the same without", 31),
    "terrain": Pairs(parts_beside_whole, "time views of terrains with `tolerance=` beside the same without", 15),
    "no-snap": Pairs(unsnapped_beside_snapped, "time vertices that are not snapped beside snapped ones", 10),
    "rle": Pairs(run_lengths_beside_coco, "time run lengths beside pycocotools", 15),
    "objects": Pairs(objects_beside_bop, "time full and visible masks of objects beside the loop of BOP's tools", 7),
    "field": Pairs(field_beside_others, "time a field beside matplotlib, datashader and SciPy", 7),
    "gradients": Pairs(gradients_beside_deodr, "time forward and backward of topleft.torch beside DEODR", 12),
    "grids": Pairs(grids_beside_others, "time voxels and atlases beside other programs", 5),
}


@dataclass(frozen=True)
class PairOptions(Options):
    rounds: int | None = option(None, "--rounds", "turns, unless as many as the study has", type=positive, metavar="N")
    scenes: Sequence[str] = option(
        ("",), "--scene", "only scenes with one of these in the name", nargs="+", metavar="WORD"
    )


def cpu_seconds() -> float:
    """CPU time of this process, and of programs that it has run."""
    if resource is None:
        return time.process_time()
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def run(kind: str, options: PairOptions, _: Save) -> Record:
    """Measure milliseconds of each call, round by round."""
    rows = []
    for scene, calls in PAIRS[kind].scenes():
        if any(word in scene for word in options.scenes):
            turns = [turn_of(call, cpu_seconds) for call in calls.values()]
            times = take_turns(turns, options.rounds or PAIRS[kind].rounds, PAIRS[kind].seconds)
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


def least_text(record: Record) -> str:
    """The least time of each call, a line a scene."""
    scenes: dict[str, list[str]] = {}
    for row in record["rows"]:
        scenes.setdefault(row["scene"], []).append(f"{row['call']} {number(min(row['ms']))}")
    return "\n".join(f"- {scene}, least times in ms: {', '.join(calls)}." for scene, calls in scenes.items())


STUDIES = [
    Study(
        kind, pairs.help, PairOptions, partial(run, kind), lines,
        {f"{kind}-facts": facts_text, kind: least_text},
    )
    for kind, pairs in PAIRS.items()
]  # fmt: skip
