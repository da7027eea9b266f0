"""Choices before anything is drawn: a small function for each, called by the pipeline and by the planner.

None of them changes a bit of a picture; `tests/plan/test_choices.py` draws with each forced on and off. Their numbers
are rows of `costs.py`; `docs/design/choices.md` has the scenes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.options import Sampling, Sink
from topleft._core.base.threads import available_threads, count_threads
from topleft._core.raster.costs import Costs, cost_table, use_costs
from topleft._core.raster.view import CULL_CODES, View
from topleft.methods import METHODS
from topleft.typing import DepthTestOption

if TYPE_CHECKING:
    from topleft._core.raster.cluster_draw import Survey

#: Sinks that give the same picture whatever the order of triangles.
ORDER_FREE = frozenset({Sink.MASK, Sink.COUNT, Sink.NEAREST, Sink.FARTHEST, Sink.SAMPLES})

WORK_OF = {Sink.MASK: "bits", Sink.SAMPLES: "bits", Sink.COUNT: "counts", Sink.LABEL: "labels"}


@dataclass(slots=True)
class Work:
    """What a draw will meet: a snapped mesh, and guesses of the engine, which are made when a choice first asks."""

    mesh: engine.SnappedMesh
    points: NDArray[Any]
    is_clip_space: bool
    n_triangles: int
    size: tuple[int, int]  # of the view, pixels
    _guess: tuple[float, float, float] | None = None

    @property
    def guess(self) -> tuple[float, float, float]:
        """Triangles in the picture, layers, and rows of all triangles."""
        if self._guess is None:
            self._guess = self.mesh.guess_seen(*self.size)
        return self._guess

    @property
    def n_vertices(self) -> int:
        """Vertices of the mesh, used or not."""
        return len(self.points)

    @property
    def has_depth(self) -> bool:
        """Whether vertices have depths; otherwise all of them lie at 0."""
        return self.is_clip_space or self.points.shape[1] == 3


class SampledLimits(NamedTuple):
    """So many triangles in view a pixel at least; and so many of all for each sample, or so large a share outside."""

    density: float
    triangles: float
    outside: float


@contextmanager
def forced(**values: Any) -> Iterator[None]:
    """Force choices, for the whole process, while the context lasts.

    By the name of a function of this module: its answer, or a function that gives it. By that of a row of `Costs`: a
    value.
    """
    names, table, rows = globals(), cost_table(), Costs.__dataclass_fields__.keys()
    costs = {name: value for name, value in values.items() if name in rows}
    answers = {name: value for name, value in values.items() if name not in rows}
    for name in answers:
        if name not in FORCEABLE:
            raise ValueError(f"forced must name functions of choices or rows of Costs, got {name!r}")
    kept = {name: names[name] for name in answers}
    try:
        use_costs(replace(table, **costs))
        names.update((name, own if callable(own) else constantly(own)) for name, own in answers.items())
        yield
    finally:
        names.update(kept)
        use_costs(table)


def constantly(answer: Any) -> Callable[..., Any]:
    """Return a function that always gives one answer."""
    return lambda *_, **__: answer


def threads_to_convert(threads: int | None, n_triangles: int) -> int:
    """Return how many threads make int32 of other indices."""
    return count_threads(threads, n_triangles) if pays_to_share(n_triangles) else 1


def threads_to_snap(threads: int | None, n_vertices: int, n_triangles: int) -> int:
    """Return how many threads transform and snap vertices."""
    return count_threads(threads, n_triangles) if pays_to_share(n_vertices) else 1


def pays_to_share(n_items: int) -> bool:
    """Tell whether so many vertices or triangles of an array are the work of two threads."""
    costs = cost_table()
    return n_items * costs.shared_item >= costs.thread_ns


def threads_to_draw(view: View, work: Work, sink: Sink) -> int:
    """Return how many threads draw, in bands of rows: `threads=`, or as many as the work is worth."""
    n_threads = view.threads
    if n_threads is None:
        n_threads = available_threads()
        if n_threads > 1:
            n_threads = min(n_threads, max(1, int(work_ns(view, work, sink) / cost_table().thread_ns)))
    return min(view.size[1], n_threads)


def draws_at_once(view: View, n_triangles: int) -> bool:
    """Whether one call of one thread draws and shades the picture: it is small, and needs no bands and no bounds.

    Bounds of depth do not pay where so many triangles have short rows.
    """
    costs, (width, height) = cost_table(), view.size
    is_plain = view.sampling is Sampling.CENTER and view.single_sided is None and not view.is_exact
    is_small = 0 < width * height <= min(costs.near_pixels, n_triangles * costs.bound_span)
    is_alone = is_worth_one(n_triangles, view.size) if view.threads is None else view.threads == 1
    return is_plain and is_small and is_alone


def pays_to_cluster_shaded(n_triangles: int) -> bool:
    """Tell whether a picture that one call draws and shades looks at the clusters of its mesh first."""
    return n_triangles >= cost_table().cluster_shaded


def is_worth_one(n_triangles: int, size: tuple[int, int]) -> bool:
    """Tell whether a picture is the work of one thread, before it is known which of its triangles show."""
    costs, n_layers = cost_table(), 2  # front and back of a closed surface
    drawn_ns = costs.work_triangle * n_triangles + size[0] * size[1] * (n_layers * costs.work_ids[1] + costs.near_pixel)
    is_short = count_threads(None, n_triangles) == 1 and drawn_ns < 2 * costs.thread_ns
    return is_short or available_threads() == 1


def work_ns(view: View, work: Work, sink: Sink) -> float:
    """Return an estimate of how long one thread draws, from a guess of the visible area."""
    costs = cost_table()
    kind = "area" if view.sampling is Sampling.AREA else WORK_OF.get(sink, "ids")
    row_ns, sample_ns, pixel_ns = getattr(costs, f"work_{kind}")
    n_pixels = view.size[0] * view.size[1]
    if n_pixels <= costs.near_pixels:
        row_ns, pixel_ns = min(row_ns, costs.near_row), min(pixel_ns, costs.near_pixel)
    _, n_layers, n_rows = work.guess
    drawn_ns = row_ns * n_rows + n_pixels * (sample_ns * n_layers + pixel_ns)
    return float(costs.work_triangle * work.n_triangles + view.sampling.n_samples * drawn_ns)


def can_slice(view: View) -> bool:
    """Tell whether a pass over a scene can draw some of its triangles."""
    fits_lanes = not view.test or view.subpixel_bits <= 8
    return fits_lanes and takes_lanes(view) and not view.is_exact


def takes_lanes(view: View) -> bool:
    """Tell whether int32 can count the pixels of a picture, and no `method` was chosen for it."""
    width, height = view.size
    is_near = max(map(abs, view.origin)) < 2**29 and width * height < 2**31
    return is_near and view.method == METHODS["auto"].code


def is_sliced(view: View, n_triangles: int, n_parts: int, sink: Sink) -> bool:
    """Tell whether each thread is to take a slice of the triangles instead of setting up all of them."""
    pays = n_triangles * n_parts >= cost_table().shared_setups
    fits_lanes = sink is not Sink.SAMPLES or view.grid_bits <= 8
    shares = takes_lanes(view) if view.is_exact else can_slice(view)
    return n_parts > 1 and pays and fits_lanes and shares


def fragment_sink(test: DepthTestOption | None, *, has_depth: bool) -> Sink:
    """Return the sink of `rasterize`: the nearer, the farther or the later triangle stays."""
    if test is None or not has_depth:
        return Sink.PAINT
    return Sink.FARTHEST if test == "greater" else Sink.NEAREST


def pays_float_lanes(view: View) -> bool:
    """Tell whether float lanes draw where 32-bit integers are too short: coverage alone, on a fine grid.

    1,000,000 triangles of 1 px at 16 bits: 42 and 8 ms; 100,000 of 10 px at 12 bits: 12.7 and 4 ms.
    """
    has_way = view.transform is None and view.single_sided is None and view.classic is None
    is_one = view.sampling in (Sampling.CENTER, Sampling.OUTER, Sampling.INNER)
    return view.subpixel_bits > 8 and is_one and has_way and takes_lanes(view) and not view.is_exact


def can_cluster(view: View, sink: Sink) -> bool:
    """Tell whether the clusters of a mesh may be drawn one by one, in any order: where that decides nothing."""
    is_on_grid = view.grid_bits == view.subpixel_bits and (sink is not Sink.SAMPLES or view.grid_bits <= 8)
    if view.single_sided is not None:  # clusters do not know single-sided triangles
        return False
    return sink in ORDER_FREE and is_on_grid and 0 not in view.size and can_slice(view)


def pays_to_cluster(n_triangles: int, n_drawn: int, n_instances: int = 1) -> bool:
    """Tell whether a mesh is drawn often enough to sort its triangles first.

    `n_triangles`: of all that is drawn with it; `n_drawn`: how many pictures of it there have been.
    """
    costs = cost_table()
    return n_triangles >= costs.cluster_triangles and (n_drawn > 0 or n_instances >= costs.cluster_instances)


def pays_to_draw_from_clusters(
    view: View, n_triangles: int, survey: Survey, share_clipped: Callable[[], float]
) -> bool:
    """Tell whether a view of a mesh in clusters is drawn from these; `survey`: their visibility in it.

    `share_clipped`: the share of the vertices beyond the near or far plane.
    """
    if view.sampling.n_samples > 1:
        return pays_to_draw_samples(view, n_triangles, survey, share_clipped)
    return pays_to_draw_clusters(view, n_triangles, survey) and pays_beside_bands(view, n_triangles, share_clipped)


def pays_beside_bands(view: View, n_triangles: int, share_clipped: Callable[[], float]) -> bool:
    """Tell whether clusters, drawn in any order, gain on a whole mesh, which large pictures sort into bands of rows."""
    costs, n_pixels = cost_table(), view.size[0] * view.size[1]
    if n_pixels <= costs.near_pixels or n_triangles >= costs.banded_triangles * n_pixels:
        return True
    return costs.inside_triangle * n_triangles * share_clipped() >= n_pixels


def pays_to_draw_samples(view: View, n_triangles: int, survey: Survey, share_clipped: Callable[[], float]) -> bool:
    """Tell whether several samples of a mesh are drawn from clusters, one after the other."""
    costs, is_culled = cost_table(), view.cull != CULL_CODES["none"]
    limits = SampledLimits(*(costs.sampled_cluster_culled if is_culled else costs.sampled_cluster))
    n_pixels, n_samples = view.size[0] * view.size[1], view.sampling.n_samples
    are_many = n_triangles >= limits.triangles * n_samples or survey.outside >= limits.outside
    if survey.front > costs.cluster_front:
        return False
    if are_many and n_triangles * (1.0 - survey.outside) >= limits.density * n_pixels:
        return True
    if survey.outside < costs.inside_outside:
        return False
    return costs.inside_samples * n_triangles * share_clipped() >= n_samples * n_pixels


def pays_to_draw_clusters(view: View, n_triangles: int, survey: Survey) -> bool:
    """Tell whether a view of a mesh in clusters is drawn from these; `survey`: their visibility in it."""
    costs, is_culled = cost_table(), view.cull != CULL_CODES["none"]
    limits = costs.cluster_small, costs.cluster_middle, (math.inf, 0.0, 0.0)
    least = next(shares[is_culled] for below, *shares in limits if n_triangles < below)
    return survey.front <= costs.cluster_front and survey.outside >= least


def pays_to_draw_instances(
    view: View, n_instances: int, n_triangles: int, survey: Survey, count_layers: Callable[[], float]
) -> bool:
    """Tell whether a scene in clusters is drawn from these; `n_triangles`: of an instance, on the mean.

    `survey`: as for one mesh; `count_layers`: how many instances lie one behind the other.
    """
    costs = cost_table()

    def gains(n_layers: float, left_out: float) -> bool:
        """Whether instances of so many layers take longer than the share of them that is drawn from clusters."""
        whole_ns = instance_ns(view, n_triangles, n_layers / n_instances)
        return whole_ns >= (1 - left_out) * (whole_ns + costs.cluster_drawn)

    is_outside = survey.outside >= costs.cluster_scene[view.sampling.n_samples > 1]
    if is_outside and pays_to_draw_clusters(view, n_triangles, survey) and gains(1.0, survey.outside):
        return True
    n_layers, (least, n_drawn) = count_layers(), costs.cluster_layers
    return n_layers >= least and gains(n_layers, 1 - n_drawn / n_layers)


def instance_ns(view: View, n_triangles: int, share: float) -> float:
    """Return about how long an instance takes if its box covers a share of the picture."""
    costs, n_pixels = cost_table(), share * view.size[0] * view.size[1]
    row_ns, sample_ns, _ = costs.work_ids
    n_rows = n_triangles * max(1.0, math.sqrt(2 * n_pixels / n_triangles))
    return view.sampling.n_samples * (costs.work_triangle * n_triangles + row_ns * n_rows + sample_ns * n_pixels)


def pays_to_share_instances(n_triangles: int, n_rows: float) -> bool:
    """Tell whether threads share the rows of a scene that is drawn in clusters; of an instance, on the mean."""
    costs = cost_table()
    return n_triangles >= costs.scene_triangles and n_rows >= costs.scene_rows


def pays_to_snap_all(n_vertices: int, n_pixels: int) -> bool:
    """Tell whether all vertices of a mesh in clusters are snapped for attributes, not only visible vertices."""
    costs = cost_table()
    return n_vertices * costs.transform <= n_pixels * costs.seen_pixel


def common_depth(points: NDArray[Any], *, has_depth: bool, is_clip_space: bool) -> float | None:
    """Return the depth of every vertex if all depths are equal.

    The plane through three equal depths is that depth to the bit. The first, the middle and the last vertex settle it
    for most scenes; the others are looked at only when those agree. Clip space is never looked at: its depth is not
    known before the divide.
    """
    if not has_depth:
        return 0.0
    if is_clip_space or not len(points):
        return None
    z = points[:, 2]
    first = z[0]
    if not (z[len(z) // 2] == first and z[-1] == first) or not (z == first).all():
        return None
    return first_depth(points, has_depth=True)


def first_depth(points: NDArray[Any], *, has_depth: bool) -> float:
    """Return the depth of the first vertex as a depth buffer holds it."""
    if not has_depth:
        return 0.0
    with np.errstate(over="ignore"):  # a used vertex beyond float32 has been refused before
        return float(np.float32(points[0, 2])) + 0.0  # -0 becomes 0, as it does in every depth buffer


def pays_without_depth(view: View, work: Work) -> bool:
    """Tell whether one pass over all pixels costs less than comparing depths wherever triangles are."""
    costs, n_pixels = cost_table(), view.size[0] * view.size[1]
    _, n_layers, n_rows = work.guess
    compared_ns = costs.compared_sample * n_layers * n_pixels
    if n_pixels > costs.near_pixels:
        compared_ns += costs.compared_row * n_rows
    return compared_ns > costs.flat_call + costs.flat_pixel * n_pixels


def is_flat(view: View, work: Work) -> bool:
    """Tell whether all triangles lie at one depth, so that samples need not compare it, and leaving that out pays."""
    if work.is_clip_space or not pays_without_depth(view, work):
        return False
    return common_depth(work.points, has_depth=work.has_depth, is_clip_space=False) is not None


class Drawing(NamedTuple):
    """The sink, and how threads share the work."""

    sink: Sink
    n_threads: int
    is_sliced: bool  # each thread takes a slice of the triangles; otherwise all of them, in a part of the rows
    is_bounded: bool  # large triangles skip parts of the picture that hide them
    in_bands: bool  # triangles are sorted into bands of rows, and band after band is drawn


def drawing(view: View, work: Work, sink: Sink) -> Drawing:
    """Return how a mesh is drawn."""
    n_threads = threads_to_draw(view, work, sink)
    sliced = is_sliced(view, work.n_triangles, n_threads, sink)
    in_bands = work.mesh.exact is None and pays_to_sort(view, work, sink)  # the sort reads snapped vertices
    return Drawing(sink, n_threads, sliced and not in_bands, pays_to_bound(view, work, sink), in_bands)


def pays_to_sort(view: View, work: Work, sink: Sink) -> bool:
    """Tell whether triangles are sorted into bands of rows: a picture leaves the near cache, their rows are long."""
    costs, n_pixels, n = cost_table(), view.size[0] * view.size[1], work.n_triangles
    has_depth = sink in (Sink.NEAREST, Sink.FARTHEST, Sink.PAINT)
    is_area = view.sampling is Sampling.AREA and sink is Sink.COUNT
    is_stored = is_area or (view.sampling is Sampling.CENTER and (has_depth or sink in (Sink.COUNT, Sink.LABEL)))
    near_pixels = costs.near_pixels * (1 if has_depth or is_area else 2)  # a sample without depth has half the bytes
    if n == 0 or n_pixels <= near_pixels or not is_stored or not can_slice(view):
        return False
    n_seen, _, n_rows = work.guess
    if is_area:
        return costs.area_pixel * n_pixels + costs.area_row * n_rows > costs.area_triangle * n
    saved_ns = costs.cleared_pixel * n_pixels if has_depth else 0.0
    if n_rows >= costs.saved_rows * n_seen:
        saved_ns += n_rows * costs.saved_row
    return saved_ns > n_seen * costs.sorted_triangle + (n - n_seen) * costs.outside_triangle


def pays_to_sort_labels(view: View, work: Work, n_threads: int) -> bool:
    """Tell whether flat colours by several samples are drawn in bands, from the last triangle to the first.

    Threads share the setup, a large picture is resolved in the cache, and large triangles leave out what others cover.
    """
    costs, n_pixels = cost_table(), view.size[0] * view.size[1]
    if n_threads > 1 or 4 * n_pixels * view.sampling.n_samples > costs.label_planes:
        return True
    n_seen, n_layers, _ = work.guess
    return n_layers * n_pixels >= costs.label_pixels * n_seen


def pays_to_bound(view: View, work: Work, sink: Sink) -> bool:
    """Tell whether to keep, beside depths, a bound of the depths of each 64 columns of a row: where spans are long."""
    costs, (width, height) = cost_table(), view.size
    is_kept = sink in (Sink.NEAREST, Sink.FARTHEST) and view.sampling is Sampling.CENTER and not view.is_exact
    if not is_kept or width < costs.bound_columns or work.n_triangles > costs.bound_triangles:
        return False
    _, n_layers, n_rows = work.guess
    return n_layers * width * height >= costs.bound_span * max(1.0, n_rows)


def rows_to_blend(view: View, work: Work, row_bytes: int, *, lays_ground: bool, is_packed: bool) -> int:
    """Return how many rows are blended before the next: a band that stays in the cache, where all are met again.

    Each band looks at all triangles. `is_packed`: every pixel is unpacked in the end.
    """
    costs, (width, height) = cost_table(), view.size
    n_rows = max(1, int(costs.blend_bytes) // row_bytes)
    if n_rows >= height:
        return height
    _, n_layers, n_triangle_rows = work.guess
    n_covered = n_layers * width * height
    again_ns = n_triangle_rows * costs.blended_row + n_covered * costs.blended_pixel
    n_again = width * height if is_packed else min(n_covered, width * height) if lays_ground else 0.0
    looked_ns = work.n_triangles * costs.blended_triangle + work.n_vertices * costs.blended_vertex
    cost_ns = height / n_rows * looked_ns
    if view.sampling is Sampling.AREA:
        cost_ns += n_triangle_rows / n_rows * costs.blended_strip
    return n_rows if n_again * costs.blended_pixel + again_ns > cost_ns else height


class Route(Enum):
    """How `rasterize` draws a mesh: `rasterize.ROUTES` has a function for each."""

    LABELS = "ids alone"
    FLAT = "ids alone, then the one depth wherever there is one"
    DEPTH = "ids and depth"
    SAMPLES = "ids and depth of each sample"


def route(view: View, work: Work, test: DepthTestOption | None, *, wants_depth: bool) -> tuple[Route, Drawing]:
    """Return how `rasterize` draws a mesh; `wants_depth`: into an array of the caller's."""
    has_depth = work.has_depth
    sink = fragment_sink(test, has_depth=has_depth)
    if view.sampling.n_samples > 1:
        found = Route.SAMPLES
    elif not has_depth and not wants_depth:
        found, sink = Route.LABELS, Sink.LABEL
    elif is_flat(view, work):
        found, sink = Route.FLAT, Sink.LABEL
    else:
        found = Route.DEPTH
    return found, drawing(view, work, sink)


class FillRoute(Enum):
    """How `fill` draws a mesh."""

    NOTHING = "no triangle, or no pixel"
    SHAPES = "row by row: a few large triangles"
    BLENDED = "triangle by triangle, in their order"
    SAMPLES = "labels of the samples, then colours of the pixels"
    LABELS = "labels, then colours"


def fill_route(
    view: View, work: Work, colors: NDArray[Any], *, is_flat: bool, is_mixed: bool, has_ground: bool
) -> FillRoute:
    """Return how `fill` draws a mesh; `is_mixed`: with the colours below, `has_ground`: over one colour."""
    if not work.n_triangles or 0 in view.size:
        return FillRoute.NOTHING
    if has_ground and is_flat and fills_large_shapes(view, work, is_mixed=is_mixed):
        return FillRoute.SHAPES
    if is_mixed or is_direct(view, work, colors.dtype, is_flat=is_flat):
        return FillRoute.BLENDED
    return FillRoute.SAMPLES if view.sampling.n_samples > 1 else FillRoute.LABELS


def lays_ground(found: FillRoute, view: View, *, is_flat: bool) -> bool:
    """Tell whether a way to fill gives pixels without a triangle their colour, too."""
    if found is FillRoute.BLENDED:
        return view.sampling.n_samples == 1
    if found in (FillRoute.SAMPLES, FillRoute.LABELS):
        return is_flat and (found is FillRoute.LABELS or can_slice(view))
    return found is not FillRoute.NOTHING


def earlier_wins(test: DepthTestOption | None, *, has_depth: bool) -> bool:
    """Tell whether the triangle with the lower index shows at equal depth; otherwise that with the higher index."""
    return test is not None and has_depth


def fills_large_shapes(view: View, work: Work, *, is_mixed: bool) -> bool:
    """Tell whether flat colours over one colour are filled row by row: few triangles for the size of the picture."""
    n_samples = view.sampling.n_samples
    is_known = view.sampling is not Sampling.AREA and not (is_mixed and n_samples > 1)
    return is_known and work.mesh.is_large_shapes(*view.size, n_samples)


def is_direct(view: View, work: Work, dtype: np.dtype[Any], *, is_flat: bool) -> bool:
    """Tell whether colours are best stored triangle by triangle, without labels in between.

    Labels cost a pass to clear and one to colour them, and less a triangle that is seen.
    """
    if not is_flat or dtype != np.uint8 or view.sampling.n_samples > 1 or view.is_exact:
        return False
    costs, (n_seen, _, _) = cost_table(), work.guess
    return n_seen * costs.direct_triangle <= view.size[0] * view.size[1] * costs.paint


#: Choices that `forced` sets, beside costs.
FORCEABLE = {name for name, one in globals().items() if callable(one) and one.__module__ == __name__ and name.islower()}
FORCEABLE = FORCEABLE - {"forced", "constantly"} | {"available_threads"}
