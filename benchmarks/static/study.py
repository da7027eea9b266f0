"""Static scenes, drawn in clusters beside whole: time of both in turns, with the same bits, and costs of clusters.

In: scenes of `scenes.py`. Out: a record with a row for each scene and one for each mesh.

Both ways are the public call on memory that is kept, on one thread; each has a `Mesh` of its own, of the same arrays.
The planner's has been drawn before: it is in clusters where `topleft._core.raster.choices` says that this pays.
The other never is.
"""

from __future__ import annotations

import copy
import math
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import topleft as tl
from benchmarks.harness.arguments import Options, count, fraction, names, option
from benchmarks.harness.machine import describe
from benchmarks.harness.records import Record, Save, read_record, tell
from benchmarks.harness.turns import digits, quartiles
from benchmarks.harness.ways import Draw, Picture, Way, check_same_bits, take_rounds
from benchmarks.report.study import Study
from benchmarks.static import tables
from benchmarks.static.scenes import StaticScene, scenes
from topleft._core.raster import static_mesh
from topleft._core.raster.cluster_draw import ClusteredMesh
from topleft._core.raster.clusters import Clusters
from topleft._meshes.picture import placed

WHOLE = {"pays_to_cluster": False}
FORCED = {
    "pays_to_cluster": True, "pays_to_cluster_shaded": True, "pays_to_draw_clusters": True, "pays_beside_bands": True,
    "pays_to_draw_instances": True,
}  # fmt: skip

Row = dict[str, Any]


@dataclass(frozen=True)
class StaticOptions(Options):
    scenes: Sequence[str] = names("--scene", "beginnings of names; all unless given")
    files: Sequence[Path] = option((), "--mesh", "closed meshes to draw, too", nargs="+", type=Path, metavar="FILE")
    rounds: int = count(7, "--repeats", "rounds")
    seconds: float = 0.02
    """Length of a turn, at least a call."""
    most_seconds: float = 6.0
    """Of all rounds of a scene, about; there are three at least."""
    scale: float = fraction(1.0, "--scale", "of triangles and frames", "X")


@dataclass
class ClusterCounts:
    """The fates of clusters, added up over instances and samples."""

    n: int = 0
    n_in_view: int = 0
    n_turned_here: int = 0
    n_drawn: int = 0

    def shares(self) -> dict[str, float] | None:
        """Return shares of all, None without any."""
        if not self.n:
            return None
        ends = self.n, self.n_in_view, self.n_turned_here, self.n_drawn, 0
        names = "outside", "turned", "hidden", "drawn"
        return {name: round((a - b) / self.n, 4) for name, a, b in zip(names, ends, ends[1:], strict=False)}


@dataclass
class CountedEngine:
    """The engine of a mesh in clusters, which counts the clusters that it draws."""

    engine: Any
    counts: ClusterCounts

    def __len__(self) -> int:
        return len(self.engine)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.engine, name)

    def draw(self, *arguments: Any) -> tuple[int, int, int]:
        """Draw as the engine does."""
        found = self.engine.draw(*arguments)
        self.counts.n_drawn += found[2]
        return found


@contextmanager
def counting(counts: ClusterCounts) -> Iterator[None]:
    """Count the clusters of draws, while the context lasts."""

    class CountedScene(ClusteredMesh):
        def __init__(self, clusters: Clusters, view: Any, first_id: int = 0) -> None:
            super().__init__(clusters, view, first_id)
            self.clusters = copy.copy(clusters)
            self.clusters.engine = CountedEngine(clusters.engine, counts)

        def draw_rows(self, *arguments: Any, **options: Any) -> Any:
            n, seen = len(self.clusters), self.survey(len(self.clusters), options.get("sample", (0, 0)))
            counts.n += n
            counts.n_in_view += round(n * (1 - seen.outside))
            counts.n_turned_here += round(n * (seen.back + seen.front))
            return super().draw_rows(*arguments, **options)

    with ExitStack() as patched:
        for module in (static_mesh, placed):
            patched.enter_context(patch.object(module, "ClusteredMesh", CountedScene))
        yield


@lru_cache(maxsize=1)
def picture_of(size: tuple[int, int]) -> tl.Rasterizer:
    """Return the one memory of a size that all ways draw into."""
    return tl.Rasterizer(size)


def drawing(scene: StaticScene) -> Draw:
    """Return the public call on a mesh, or instances of it, of its own."""
    subject, camera = scene.fresh(), scene.camera
    options: dict[str, Any] = {"cull": scene.cull, "sampling": scene.sampling, "threads": 1}
    if isinstance(subject, tl.Mesh) and scene.sampling == "center":
        options["rasterizer"] = picture_of(scene.size)
    if scene.verb == "render":
        return lambda: (tl.render(subject, camera, scene.size, **options),)

    def draw() -> Picture:
        frags = tl.rasterize_mesh(subject, camera, scene.size, **options)
        if isinstance(subject, tl.Scene):
            return frags.samples_id, frags.samples_depth
        return frags.triangle, frags.depth

    return draw


def cpu_ms(draw: Callable[[], Any]) -> float:
    """Return the time of one call."""
    start = time.thread_time()
    draw()
    return 1e3 * (time.thread_time() - start)


def measure_scene(scene: StaticScene, options: StaticOptions) -> Row:
    """Return a row.

    Raises
    ------
    AssertionError
        If the ways draw different bits.
    """
    counts = ClusterCounts()
    planned, whole = Way("planner", drawing(scene)), Way("whole", drawing(scene), WHOLE)
    first = [cpu_ms(planned.draw), cpu_ms(planned.draw)]
    with whole.in_force():
        whole_first = cpu_ms(whole.draw)
    with counting(counts):
        planned.draw()
    ways = [planned, whole]
    shares = counts.shares()
    if shares is None:
        ways.append(Way("clusters", drawing(scene), FORCED))
        with ways[2].in_force(), counting(counts):
            ways[2].draw()  # a mesh has clusters from its second picture on
            ways[2].draw()
    check_same_bits(scene.label, ways)
    n_rounds = max(3, min(options.rounds, int(options.most_seconds * 1e3 / (4 * whole_first))))
    times = take_rounds(ways, n_rounds, options.seconds, time.thread_time, math.inf)
    row = {
        "model": scene.model,
        "kind": scene.kind,
        "view": scene.view,
        "size": list(scene.size),
        "cull": scene.cull,
        "sampling": scene.sampling,
        "verb": scene.verb,
        "n_triangles": len(scene.arrays[1]) * max(1, len(scene.places)),
        "is_clustered": shares is not None,
        "first_ms": digits(first[0]),
        "second_ms": digits(first[1]),
        "whole_first_ms": digits(whole_first),
        "ms": quartiles(times[0]),
        "whole_ms": quartiles(times[1]),
        "faster": quartiles(times[1] / times[0]),
        "rounds": n_rounds,
        "shares": counts.shares(),
    }
    if shares is None:
        row["clusters_faster"] = quartiles(times[1] / times[2])
    return row


def measure_model(scene: StaticScene) -> Row:
    """Return the time and memory of a mesh's clusters."""
    points, triangles = scene.arrays
    took = [cpu_ms(lambda: Clusters(points, triangles, 1)) for _ in range(3)]
    tracemalloc.start()
    clusters = Clusters(points, triangles, 1)
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return {
        "model": scene.model,
        "n_triangles": len(triangles),
        "n_vertices": len(points),
        "n_clusters": len(clusters),
        "build_ms": digits(min(took)),
        "kept_bytes": kept,
        "peak_bytes": peak,
    }


def run(options: StaticOptions, save: Save) -> Record:
    """Return a record, or the rows that were measured anew; `save` gets it after each scene."""
    record = read_record(options.record)
    rows: list[Row] = []
    models: list[Row] = []
    for scene in chosen_scenes(options):
        if scene.model not in (model["model"] for model in models):
            models.append(measure_model(scene))
        rows.append(measure_scene(scene, options))
        tell(row_text(rows[-1]))
        save(with_rows(record, rows, models))
    if not rows:
        raise ValueError(f"no scene begins with {' or '.join(options.scenes)}")
    return with_rows(record, rows, models)


def chosen_scenes(options: StaticOptions) -> Iterator[StaticScene]:
    """Give the scenes with labels that begin so."""
    wanted = tuple(options.scenes)
    return (scene for scene in scenes(options.scale, options.files) if not wanted or scene.label.startswith(wanted))


def with_rows(record: Record | None, rows: list[Row], models: list[Row]) -> Record:
    """Return a record with these rows in place of older ones of the same scene or mesh."""
    old = record or {"rows": [], "models": []}
    merged = {key_of(row): row for row in [*old["rows"], *rows]}
    merged_models = {row["model"]: row for row in [*old["models"], *models]}
    rows_of = {"models": list(merged_models.values()), "rows": list(merged.values())}
    return {"kind": "static"} | describe() | rows_of


def key_of(row: Row) -> tuple[Any, ...]:
    """Return the key of a row."""
    return *(row[name] for name in ("model", "view", "cull", "sampling", "verb")), *row["size"]


def row_text(row: Row) -> str:
    """Return a row for the terminal."""
    width, height = row["size"]
    what = f"{row['model']}, {row['view']}, {row['cull']} {row['verb']} {row['sampling']} {width}x{height}"
    how = "in clusters" if row["is_clustered"] else f"whole (clusters x {row['clusters_faster'][1]:.2f})"
    return f"{what:72} {row['whole_ms'][1]:9.3f} -> {row['ms'][1]:9.3f} ms  x {row['faster'][1]:6.2f}  {how}"


STUDY = Study(
    "static", "measure meshes that do not change, in clusters beside whole", StaticOptions, run, tables.lines,
    tables.PARTS, "benchmarks.static.charts",
)  # fmt: skip
