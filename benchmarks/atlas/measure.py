"""The atlas: where each method is wrong, and by how much, along families of scenes.

Out: a record for JSON of counts alone, the same on every machine. Against the exact picture of the
vertices as they are, where the snap counts as an error: *wrong*, pixels that show another triangle; *gaps* and
*overdrawn*, pixels drawn less or more often than they should be, which on these meshes is once a layer. Against the
exact picture of the vertices as the method takes them, after its own snap: *inexact*, pixels drawn another number of
times. A method that is exact and has the fill rule of the library has none of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.atlas.depth import DEPTH_FAMILIES, PRODUCTION, measure_depth
from benchmarks.atlas.families import FAMILIES, Family, Faults, Scene, tabulate, walk
from benchmarks.exact.integers import Points, draw_points, signed_area, snapped_points
from benchmarks.exact.unsnapped import ExactPicture
from benchmarks.harness.arguments import refuse_unknown
from benchmarks.harness.records import Record, tell
from benchmarks.scenes.families import NO_SNAP

SCHEMA = 1
NO_FILL = "not applicable, it draws outlines and fills nothing"
NO_DEPTH = "no classic, for they take vertices in pixels and have no clip space and no depth"


@dataclass(frozen=True)
class Entry:
    """A row of the atlas: a method at a precision, or the engine with another sampling."""

    name: str
    method: str
    bits: int | str = 8
    sampling: str = "center"

    @property
    def snap(self) -> str:
        """What the method makes of vertices first, as `snapped_points` calls it."""
        from topleft.methods import find_method

        method = find_method(self.method)
        if self.bits == NO_SNAP:
            return "true"
        if method.code is not None or method.has_subpixel_bits:
            return str(self.bits)
        if method.claims.integer_vertices:
            return "px"
        return "true" if self.method.endswith("float64") else "float32"

    @property
    def rule(self) -> str:
        """Which edges own the centres on them."""
        return "bottom-right" if self.method.endswith("bottom-right") else "top-left"

    def options(self) -> dict[str, Any]:
        """Arguments of the verbs."""
        options: dict[str, Any] = {"method": self.method}
        if self.snap.isdigit() or self.bits == NO_SNAP:
            options["subpixel_bits"] = self.bits
        return options | ({} if self.sampling == "center" else {"sampling": self.sampling})

    def orient(self, scene: Scene) -> Scene:
        """Return the scene with the winding that the method draws; no change if it draws either."""
        from topleft.methods import find_method

        winding = find_method(self.method).claims.winding
        if winding == "either":
            return scene
        points = snapped_points(scene.vertices, self.snap)
        is_clockwise = np.array([signed_area(points, triangle) > 0 for triangle in scene.triangles.tolist()])
        is_wrong = is_clockwise != (winding == "clockwise")
        return scene._replace(triangles=np.where(is_wrong[:, None], scene.triangles[:, ::-1], scene.triangles))


def entries() -> list[Entry]:
    """Every way to fill: the engine at three precisions, by both walkers and without a snap, every classic."""
    from topleft.methods import CLASSICS

    production = [Entry(name, *what) for name, what in PRODUCTION.items()]
    return production + [Entry(name, name) for name in CLASSICS if not name.endswith("/wireframe")]


SAMPLED = [Entry(f"auto, {sampling}", "auto", sampling=sampling) for sampling in ("msaa4", "area", "outer", "inner")]
"""More ways to count layers."""


def draw_counts(entry: Entry, scene: Scene) -> NDArray[Any]:
    """Return how often the method draws each pixel; of several samples the first one that is not the common count."""
    import topleft as tl

    counts = tl.overdraw(
        scene.vertices, entry.orient(scene).drawn(), scene.size, origin=scene.origin, threads=1, **entry.options()
    )
    if counts.ndim == 2:
        return counts
    return np.where((counts == counts[..., :1]).all(axis=-1), counts[..., 0], -1)


def draw_labels(entry: Entry, scene: Scene) -> NDArray[np.int32]:
    """Return the triangle that shows in each pixel in painter's order, -1 for none."""
    import topleft as tl

    triangles = entry.orient(scene).drawn()
    return tl.fill(
        scene.vertices, triangles, np.arange(len(triangles), dtype=np.float32), scene.size, per="triangle",
        background=-1, origin=scene.origin, threads=1, **entry.options(),
    ).astype(np.int32)  # fmt: skip


class Exact:
    """Exact pictures of a scene, each drawn once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.pictures: dict[tuple[str, str], ExactPicture] = {}

    def picture(self, snap: str = "true", rule: str = "top-left") -> ExactPicture:
        """Return the picture of one copy after a snap."""
        if (snap, rule) not in self.pictures:
            points: Points = snapped_points(self.scene.vertices, snap)
            scene = self.scene
            self.pictures[snap, rule] = draw_points(points, scene.triangles, scene.size, scene.origin, rule)
        return self.pictures[snap, rule]

    def labels(self) -> NDArray[np.int32]:
        """Return what must show, of the vertices as they are."""
        ids = self.picture().triangle
        return np.where(ids < 0, ids, ids + np.int32((self.scene.copies - 1) * len(self.scene.triangles)))


def measure(entry: Entry, exact: Exact) -> Faults | str:
    """Return the faults of a method on a scene, or why it refuses to draw it."""
    try:
        counts = draw_counts(entry, exact.scene)
        labels = exact.labels() if entry.sampling != "center" else draw_labels(entry, exact.scene)
    except ValueError as error:
        return str(error).partition(", got")[0]
    n = exact.scene.copies
    if entry.sampling in ("outer", "inner"):
        return faults_of_bounds(entry.sampling, counts, exact)
    true, snapped = exact.picture().count * n, exact.picture(entry.snap, entry.rule).count * n
    return Faults(*(int(is_fault.sum()) for is_fault in (
        labels != exact.labels(), counts < true, counts > true, counts != snapped)))  # fmt: skip


def faults_of_bounds(sampling: str, counts: NDArray[Any], exact: Exact) -> Faults:
    """Return what bounds tell: outer counts hold those of the centres, inner ones are within; whole layers count."""
    n = exact.scene.copies
    centers = exact.picture("8").count * n
    is_broken = (counts < centers if sampling == "outer" else counts > centers) | (counts % n != 0)
    return Faults(0, 0, 0, int(is_broken.sum()))


def map_family(family: Family, rows: Sequence[Entry]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return what was drawn, and the map of each entry."""
    cells: dict[str, list[list[Any]]] = {entry.name: [] for entry in rows}
    n_edge_px = []
    for _, values in walk(family):
        scenes = [Exact(family.make(*values, seed)) for seed in range(family.n_seeds)]
        n_edge_px.append(sum(int(exact.picture().is_edge.sum()) for exact in scenes))
        for entry in rows:
            cells[entry.name].append([measure(entry, exact) for exact in scenes])
    return tabulate(family, n_edge_px, cells)


def run_atlas(names: Sequence[str] = (), methods: Sequence[str] = ()) -> Record:
    """Draw every family, or the named ones, with every entry, or the named ones; return the record.

    Raises
    ------
    ValueError
        For a family or an entry that does not exist.
    """
    refuse_unknown("--family", names, [*FAMILIES, *DEPTH_FAMILIES])
    refuse_unknown("--method", methods, [entry.name for entry in entries()])
    chosen = [entry for entry in entries() if not methods or entry.name in methods]
    record: dict[str, Any] = {"schema": SCHEMA, "kind": "atlas", "families": [], "maps": []}
    for family in FAMILIES.values():
        if names and family.name not in names:
            continue
        tell(family.name)
        facts, maps = map_family(family, chosen + (SAMPLED if family.name == "layers" and not methods else []))
        record["families"].append(facts)
        record["maps"] += maps
    for depth_family in DEPTH_FAMILIES.values():
        if names and depth_family.name not in names:
            continue
        tell(depth_family.name)
        facts, maps = measure_depth(depth_family, [entry.name for entry in chosen if entry.name in PRODUCTION])
        record["families"].append(facts)
        record["maps"] += maps
    record["not_applicable"] = {"bresenham_scanline/wireframe": NO_FILL} | {
        family.name: NO_DEPTH for family in DEPTH_FAMILIES.values()
    }
    return record
