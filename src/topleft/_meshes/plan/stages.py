"""Describes a draw, stage by stage: the choice, its reason and the rejected alternatives.

In: `Facts`. Out: `Stage`s, in the order of the pipeline.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from topleft._core import engine
from topleft._core.base.options import Sampling, Sink
from topleft._core.base.threads import available_threads
from topleft._core.raster import choices
from topleft._core.raster.choices import Route
from topleft._core.raster.costs import cost_table
from topleft._meshes.lod.detail import Detail
from topleft._meshes.plan.facts import ClusterFacts, Facts
from topleft.methods import METHODS


@dataclass(frozen=True, slots=True)
class Stage:
    """A step of the pipeline.

    Attributes
    ----------
    name, choice, why : str
        The stage, its choice, and why that is enough.
    rejected : tuple of str
        Alternatives, and why they were not chosen.
    timed_in : str
        What is timed in a call: a part of the draw, or the stage whose time contains this stage's.
    """

    name: str
    choice: str
    why: str
    rejected: tuple[str, ...] = ()
    timed_in: str = ""


SINKS = {
    Sink.MASK: "a bit a pixel, made bytes at the end",
    Sink.COUNT: "a counter a pixel",
    Sink.LABEL: "the id of one triangle a pixel",
    Sink.PAINT: "ids and depth; the later triangle wins",
    Sink.NEAREST: "ids and depth; the nearer triangle wins",
    Sink.FARTHEST: "ids and depth; the farther triangle wins",
    Sink.SAMPLES: "a bit a sample, counted at the end",
}


def find_stages(facts: Facts) -> tuple[Stage, ...]:
    """Return the stages of a call."""
    stages = [plan_input(facts), *plan_vertices(facts), plan_arithmetic(facts), plan_cull(facts)]
    stages += [plan_method(facts), *plan_sink(facts)]
    stages.append(plan_threads(facts))
    return tuple(stages if facts.clusters is None else with_clusters(stages, facts.clusters))


def with_clusters(stages: list[Stage], facts: ClusterFacts) -> list[Stage]:
    """Return the stages of a mesh that is drawn again, with a stage on the savings of its clusters."""
    if facts.clusters is None:
        return [stages[0], Stage("clusters", "none", facts.why_not, timed_in="method"), *stages[1:]]
    n, n_triangles = len(facts.clusters), facts.clusters.n_triangles
    names = {"outside of the picture": facts.n_outside, "turned away": facts.n_turned, "hidden": facts.n_hidden}
    parts = [f"{count:,} {text}" for text, count in names.items() if count]
    why = "the mesh does not change, so its triangles were sorted once; " + (", ".join(parts) or "none is left out")
    rejected = (
        f"the mesh from beginning to end: all of {plural(n_triangles, 'triangle')} would be set up",
        "the order of the triangles as given: near ones that come late hide nothing",
    )
    choice = f"{facts.n_drawn:,} of {n:,} drawn, front to back, at most {engine.CLUSTER} triangles each"
    row = Stage("clusters", choice, why, rejected, timed_in="method")
    changed = []
    for stage in stages:
        if stage.name == "input":
            changed.append(replace(stage, choice="a copy of the mesh, sorted and checked once", rejected=()))
        elif stage.name in ("transform", "clip", "snap"):
            changed.append(replace(stage, timed_in="method"))
        else:
            changed.append(stage)
    return [changed[0], row, *changed[1:]]


def plural(n: int, thing: str) -> str:
    """Return a number with the noun that it counts."""
    return f"{n:,} {thing}" if n == 1 else f"{n:,} {thing}s"


def vertices(n: int) -> str:
    """Return a number of vertices."""
    return "1 vertex" if n == 1 else f"{n:,} vertices"


def plan_detail(detail: Detail) -> Stage:
    """Describe which level of a mesh is drawn."""
    count, n = detail.n_drawn, detail.n_triangles
    choice = f"the mesh itself, {plural(n, 'triangle')}"
    if detail.n_parts:
        choice = (
            f"{plural(detail.n_parts, 'part')}: {plural(count, 'triangle')} of {n:,}, within {detail.bound_px:.3g} px"
        )
    elif detail.level:
        choice = f"level {detail.level}: {plural(count, 'triangle')} of {n:,}, within {detail.bound_px:.3g} px"
    return Stage("detail", choice, detail.why, detail.rejected)


def plan_input(facts: Facts) -> Stage:
    """Describe how the caller's arrays are read."""
    reads = "read as they are" if not facts.is_vertex_copy else f"copied to contiguous {facts.point_dtype}"
    converts = facts.index_dtype not in ("int32", "uint32")
    indices = "made int32, checked on the way" if converts else "read as they are, checked while drawing"
    n = facts.n_triangles
    why = f"{vertices(facts.n_vertices)} of {facts.vertex_dtype}, {plural(n, 'triangle')} of {facts.index_dtype}"
    rejected = ["a check of all indices beforehand: the pass that draws reads them anyway"]
    if converts:
        rejected = ["int64 in the kernels: twice the memory to read in each pass; pass int32, or a plan, to save this"]
    return Stage("input", f"vertices {reads}; indices {indices}", why, tuple(rejected), "input")


def plan_vertices(facts: Facts) -> Iterator[Stage]:
    """Describe transform, clip and snap: a pass over the vertices, and a pass over cut triangles."""
    view = facts.view
    threads = choices.threads_to_snap(view.threads, facts.n_vertices, facts.n_triangles)
    if not facts.is_clip_space:
        yield Stage("transform", "none", "vertices are in pixels", timed_in="snap")
        why = "pixels have no near or far plane, and sides never cut: all sums are exact"
        yield Stage("clip", "none", why, timed_in="snap")
    else:
        yield plan_transform(facts)
        yield plan_clip(facts)
    if view.is_exact:
        is_taken = not facts.is_clip_space and facts.point_dtype == "float64"
        why = f"{vertices(facts.n_vertices)} stay where they are: no pixel is wrong against the numbers of the array"
        choice = "none, float64 where it lies" if is_taken else f"none, float64, {plural(threads, 'thread')}"
        grid = ("a grid: vertices would move by up to 1/512 px at 8 sub-pixel bits",)
        yield Stage("snap", choice, why, grid, "vertices")
        return
    bits = view.subpixel_bits
    why = f"{vertices(facts.n_vertices)}, each moved by at most 1/{2 << bits} px; all that follows is integers"
    rejected = ["float32 coordinates: edges that two triangles share would leave gaps"]
    if facts.are_whole and bits:
        rejected.append("0 sub-pixel bits: all vertices are whole pixels: the same picture, but no faster")
    choice = f"{plural(bits, 'sub-pixel bit')}, {plural(threads, 'thread')}"
    yield Stage("snap", choice, why, tuple(rejected), "vertices")


def plan_transform(facts: Facts) -> Stage:
    """Describe the matrix and the divide."""
    precision = facts.point_dtype
    if facts.view.transform is None:
        return Stage("transform", f"divide by w in {precision}", "vertices are in clip space", timed_in="snap")
    other = "float64: the vertices are float32"
    if precision == "float64":
        other = "float32: would round away bits that the vertices have"
    choice = f"matrix and divide by w in {precision}"
    return Stage("transform", choice, "vertices are in object space", (other,), timed_in="snap")


def plan_clip(facts: Facts) -> Stage:
    """Describe how many triangles are cut."""
    view = facts.view
    planes = [name for name, is_on in (("near", view.near_clip), ("far", view.far_clip)) if is_on]
    names = " and ".join(planes) + (" plane" if len(planes) == 1 else " planes") if planes else "the eye's plane"
    sides = ("the four sides of the picture: sums are exact as far as 2**60 sub-pixels, so nothing is cut there",)
    if not facts.n_clipped:
        return Stage("clip", "none", f"no vertex lies outside of {names}", sides, "clip")
    return Stage(
        "clip",
        f"{plural(facts.n_cut, 'triangle')} cut into {plural(facts.n_pieces, 'piece')}",
        f"{vertices(facts.n_clipped)} outside of {names}, and {plural(facts.n_beyond, 'triangle')} with them",
        sides,
        "clip",
    )


def plan_arithmetic(facts: Facts) -> Stage:
    """Describe how many bits the edge functions need."""
    narrow, long = facts.count("tiny", "small", "middle", "rows"), facts.count("long", "edge 64", "span 64")
    wide = facts.count("edge 128", "span 128")
    parts = [f"{name}: {n:,}" for name, n in (("32-bit lanes", narrow), ("64-bit", long), ("128-bit", wide)) if n]
    why = "an extent of up to 62 px fits 32 bits, vertices below 2**30 sub-pixels 64, all others 128"
    rejected: tuple[str, ...] = ()
    if narrow and not wide:
        rejected = ("128 bits for all: the fullest model, and no bit of the picture would differ",)
    return Stage("arithmetic", ", ".join(parts) or "none", why, rejected, timed_in="method")


def plan_cull(facts: Facts) -> Stage:
    """Describe which triangles draw nothing."""
    names = {"degenerate": "without area", "culled": "turned away", "outside": "outside of the picture",
             "between": "between the samples"}  # fmt: skip
    parts = [f"{facts.count(name):,} {text}" for name, text in names.items() if facts.count(name)]
    if facts.n_beyond:
        parts.append(f"{facts.n_beyond:,} outside of a clip plane")
    if facts.view.is_exact:
        parts = [f"{part}, on 2**-8 px" if part.endswith("without area") else part for part in parts]
    n_hidden = facts.count(*names) + facts.n_beyond
    n_all = facts.n_triangles - facts.n_cut + facts.n_pieces
    why = f"{n_hidden:,} of {n_all:,} cannot cover a sample: " + ", ".join(parts)
    side = {0: "no side asked for", 1: "back faces", 2: "front faces"}[facts.view.cull]
    rejected = ("sides that are turned away: not asked for with cull=",) if not facts.view.cull else ()
    return Stage("cull", side, why if parts else "every triangle may cover a sample", rejected, timed_in="method")


METHOD_NAMES = {
    "tiny": "{:,} by four tests in place (boxes up to 2x2)",
    "small": "{:,} by sixteen tests (up to 4x4)",
    "middle": "{:,} a row of many at a time (up to 16x16)",
    "rows": "{:,} many rows at a time (up to 62x62)",
    "long": "{:,} by themselves, row ends in float64",
    "edge 64": "{:,} by themselves, sample by sample",
    "span 64": "{:,} by themselves, row by row",
    "edge 128": "{:,} by themselves, sample by sample in 128 bits",
    "span 128": "{:,} by themselves, row by row in 128 bits",
}


def plan_method(facts: Facts) -> Stage:
    """Describe how triangles of each size find their samples."""
    view = facts.view
    n_pixels = view.size[0] * view.size[1]
    if view.sampling is Sampling.AREA:
        why = f"the picture is {n_pixels:,} pixels; an edge costs the rows that it passes, an interior nothing"
        choice = f"areas right of {3 * facts.n_drawn:,} edges, summed along rows"
        return Stage("method", choice, why, ("16 samples a pixel: not exact, and slower",), "draw")
    parts = [text.format(facts.count(name)) for name, text in METHOD_NAMES.items() if facts.count(name)]
    layers = facts.covered / max(1, n_pixels)
    covered = f"about {facts.covered:,.0f} samples are covered, {layers:.2g} times the {n_pixels:,} pixels"
    rejected = ("one method for all: boxes waste tests on large triangles, rows waste setup on small ones",)
    if view.method != METHODS["auto"].code:
        rejected = ("method='auto': another one was asked for; the picture is the same",)
    if facts.is_large_shapes and facts.n_drawn:
        parts = [f"{plural(facts.n_drawn, 'triangle')} at once, row by row: every pixel is written once"]
        rejected = ("one after the other: covered pixels would be cleared first, and written again",)
    elif facts.is_direct and facts.n_drawn:
        parts = [f"{plural(facts.n_drawn, 'triangle')} one after the other, in painter's order"]
        rejected = ("vectors and queues of triangles: they change the order, and colours have no ids to tell it",)
    return Stage("method", "; ".join(parts) or "nothing to draw", covered, rejected, "draw")


def plan_sink(facts: Facts) -> Iterator[Stage]:
    """Describe depth, sampling and attributes."""
    view, n_pixels = facts.view, facts.view.size[0] * facts.view.size[1]
    yield plan_depth(facts)
    n = view.sampling.n_samples
    names = {Sampling.CENTER: "the pixel's centre", Sampling.AREA: "exact area", Sampling.OUTER: "squares that are met",
             Sampling.INNER: "squares that are held"}  # fmt: skip
    rejected = () if n == 1 else ("a full draw for each sample: setup, culling and boxes are shared",)
    choice, why = names.get(view.sampling, f"{n} samples a pixel"), f"sampling={str(view.sampling)!r} was asked for"
    if n > 1 and facts.in_clusters:
        choice = f"{choice}, a picture of each"
        rejected = ("all samples of a band of rows before the next: the whole mesh would be snapped and sorted first",)
    yield Stage("sampling", choice, why, rejected, timed_in="method")
    if facts.is_direct or facts.is_large_shapes:
        why = "triangles are few for the picture: their colours go straight to it"
        rejected = ("labels and colours from them: two passes over the picture, which pay for small triangles",)
        yield Stage("shade", "none", why, rejected, timed_in="method")
    elif facts.verb == "fill":
        why = f"at most {n_pixels:,} of about {facts.covered:,.0f} samples show"
        rejected = ("colours while drawing: hidden samples would be coloured too",)
        yield Stage("shade", "colours from ids, once a pixel", why, rejected, "shade")
    elif facts.verb == "rasterize":
        wanted = [name for name in facts.outputs if name not in ("triangle", "depth", "mask")]
        choice = f"{', '.join(wanted)} from ids, when asked for" if wanted else "none"
        why = "attributes are of pixels that show, so they come after" if wanted else "no attribute was asked for"
        yield Stage("shade", choice, why, ("attributes while drawing: hidden samples would have them too",))


def plan_depth(facts: Facts) -> Stage:
    """Describe whether samples compare depths."""
    what = SINKS[facts.drawing.sink] if facts.view.sampling is not Sampling.AREA else "a sum of areas a pixel"
    if facts.is_direct:
        what = "the colour of the later triangle a pixel"
    if facts.verb != "rasterize":
        return Stage("depth", "none", f"{facts.verb} needs {what}", timed_in="method")
    if facts.route is Route.LABELS:
        why = "vertices have no depth: the later triangle wins, and depth 0 is written when it is asked for"
        return Stage("depth", "no test, ids alone", why, timed_in="method")
    if facts.route is Route.FLAT:
        n_pixels = facts.view.size[0] * facts.view.size[1]
        earlier = choices.earlier_wins(facts.test, has_depth=facts.n_components > 2)
        order = "the earlier triangle wins" if earlier else "the later triangle wins"
        why = f"every vertex lies at depth {facts.common_depth:g}: {order}; one pass over {n_pixels:,} pixels writes it"
        compared = f"a comparison for each of about {facts.covered:,.0f} samples"
        rejected = (f"{compared}: planes through equal depths are equal to the bit",)
        return Stage("depth", "no test, ids alone", why, rejected, "depth")
    rejected = ("float32 slopes: faster, but coplanar triangles would hide each other at random",)
    why = "depths differ" if facts.test else "no test is set, but the depth of visible triangles is returned"
    if facts.common_depth is not None:
        why = f"every vertex lies at depth {facts.common_depth:g}, but little of the picture is covered"
        rejected = ("ids alone, and a pass over all pixels for depth: longer than the comparisons",)
    if facts.drawing.is_bounded:
        what += "; large triangles leave out hidden spans"
        why += "; rows of triangles are long, so a bound of depth is kept for each 64 columns of a row"
    return Stage("depth", what, why, rejected, timed_in="method")


def plan_threads(facts: Facts) -> Stage:
    """Describe how many threads draw, and the work of each."""
    view, n = facts.view, facts.n_triangles
    n_threads, usable = facts.drawing.n_threads, available_threads()
    costs = cost_table()
    wake = f"waking a thread takes {costs.wake / 1e3:.0f} us"
    if view.threads is not None:
        why = f"threads={view.threads} was asked for"
    else:
        is_enough = "at least" if n_threads == usable else "less than"
        each = f"{costs.thread_ns / 1e6:.2g} ms for each of {usable}"
        why = f"about {facts.work_ms:.2g} ms of work are {is_enough} {each}; {wake}"
    if facts.in_bands:
        sorted_ = f"the {n:,} triangles are sorted into bands of rows, which are cleared and drawn in the cache"
        rejected = ("triangles as they come: sorting them costs less than pixels outside of the cache",)
        who = "1, the caller's own" if n_threads == 1 else f"{n_threads}, each its bands of rows"
        return Stage("threads", f"{who}; one band after the other", f"{why}; {sorted_}", rejected)
    if n_threads == 1:
        return Stage("threads", "1, the caller's own", why, (f"more: {wake}",))
    if facts.is_sliced:
        rejected = (f"bands alone: each of {n_threads} threads would set up all {n:,} triangles",)
        return Stage("threads", f"{n_threads}, each a share of the triangles and its own rows", why, rejected)
    rejected = ("shares of the triangles: threads would have to meet twice",)
    return Stage("threads", f"{n_threads} bands of {-(-view.size[1] // max(1, n_threads)):,} rows", why, rejected)
