"""The atlas: where each method is wrong, and by how much, along families of scenes.

Out: a record for JSON of counts alone, the same on every machine. Against the exact picture of the
vertices as they are, where the snap counts as an error: *wrong*, pixels that show another triangle; *gaps* and
*overdrawn*, pixels drawn less or more often than they should be, which on these meshes is once a layer. Against the
exact picture of the vertices as the method takes them, after its own snap: *inexact*, pixels drawn another number of
times. A method that is exact and has the fill rule of the library has none of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from benchmarks.atlas.depth import DEPTH_FAMILIES, measure_depth
from benchmarks.atlas.faults import Exact, draw_counts, draw_labels, find_faults
from benchmarks.atlas.maps import Faults, tabulate
from benchmarks.harness.arguments import refuse_unknown
from benchmarks.harness.records import Record, tell
from topleft._apps.explore.race import PRODUCTION, Entry, entries
from topleft.scene_families import FAMILIES, Family, walk

SCHEMA = 1
NO_FILL = "not applicable, it draws outlines and fills nothing"
NO_DEPTH = "no classic, for they take vertices in pixels and have no clip space and no depth"


SAMPLED = [Entry(f"auto, {sampling}", "auto", sampling=sampling) for sampling in ("msaa4", "area", "outer", "inner")]
"""More ways to count layers."""


def measure(entry: Entry, exact: Exact) -> Faults | str:
    """Return the faults of a method on a scene, or why it refuses to draw it."""
    try:
        counts = draw_counts(entry, exact.scene)
        labels = exact.labels() if entry.sampling != "center" else draw_labels(entry, exact.scene)
    except ValueError as error:
        return str(error).partition(", got")[0]
    if entry.sampling in ("outer", "inner"):
        return faults_of_bounds(entry.sampling, counts, exact)
    is_inexact = counts != exact.picture(entry.snap, entry.rule).count * exact.scene.copies
    return Faults(*(int(is_fault.sum()) for is_fault in (*find_faults(exact, counts, labels), is_inexact)))


def faults_of_bounds(sampling: str, counts: NDArray[Any], exact: Exact) -> Faults:
    """Check bounds: outer counts hold those of the centres, inner ones lie within; whole layers count."""
    n = exact.scene.copies
    centers = exact.picture("8").count * n
    is_broken = (counts < centers if sampling == "outer" else counts > centers) | (counts % n != 0)
    return Faults(0, 0, 0, int(is_broken.sum()))


def map_family(family: Family, rows: Sequence[Entry]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the scenes, and the map of each entry."""
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
