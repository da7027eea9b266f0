"""What is chosen before anything is drawn: a small function for each choice, asked by the pipeline and by the planner.

None of them changes a bit of a picture; `tests/plan/test_choices.py` draws with each forced on and off. The numbers
were measured on one and two cores of a Zen 4 with AVX-512; `docs/design/choices.md` has the scenes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.options import Cull, DepthTest, Sampling, Sink
from topleft._core.base.threads import available_threads, count_threads
from topleft._core.raster.view import CULL_CODES, View
from topleft.methods import METHODS

if TYPE_CHECKING:
    from topleft._core.raster.cluster_draw import Survey
    from topleft._core.raster.clusters import Clusters
    from topleft._core.raster.snap import Snapped

#: Fewer vertices are snapped, and fewer triangles converted, by one thread: waking another takes as long.
MIN_TO_SHARE_ARRAYS = 200_000

#: Nanoseconds that decide whether depths are compared where all are equal: ids alone cost a pass over all pixels and a
#: few calls, comparisons something a covered sample, and, where the picture does not stay in a near cache, a row of a
#: triangle. Of flat triangles of 8, 40 and 400 px, 0.2 to 2 layers, 64x64 to 1920x1080: wrong by 1.2 times at most.
FLAT_CALL_NS, FLAT_PIXEL_NS = 12_000, 0.19
COMPARED_SAMPLE_NS, COMPARED_ROW_NS = 0.35, 12.0

#: Pixels of a row of a triangle, on the mean, from which on bounds of depth are kept, which triangles of 128 columns or
#: more look at, and columns of a picture. In 1920x1080, times as fast with them: 40 frames, near ones first 7.1, far
#: ones first 0.88; 30,000 large triangles all round the eye 3.2 to 4.5, 300 of 1,000 px 2.3, 1,000 of 400 px (139 px a
#: row) 1.4; below, of 33 px a row, 10,000 of 100 px 0.7 to 1.0 and 1,000 of them 0.9.
MIN_SPAN_TO_BOUND, MIN_COLUMNS_TO_BOUND = 100.0, 256

#: More triangles are small where they show, and only seem large where the guess takes one that a plane cuts for as
#: large as the picture.
MAX_TRIANGLES_TO_BOUND = 200_000

#: Pixels of a picture that stay in a near cache while it is drawn; those of a larger one are cold when they are met.
NEAR_PIXELS = 400_000

#: A thread gets at least so much work: of 132 calls, those of 0.45 ms or more were done sooner by two threads, but for
#: one that waits for memory (0.9 times), and those of less by one (1.2 times at most).
MIN_THREAD_NS = 220_000

#: What the guess of work is made of: nanoseconds a triangle; a row of a triangle that is seen, a covered sample and a
#: pixel of the picture, by what is drawn; a row and a pixel at most where the picture stays in a near cache.
TRIANGLE_NS = 5.0
WORK_NS = {
    "bits": (4.0, 0.018, 0.014),
    "counts": (6.0, 0.2, 0.3),
    "ids": (12.0, 0.4, 0.6),
    "labels": (8.0, 0.1, 0.15),
    "area": (9.0, 0.0, 0.3),
}
NEAR_ROW_NS, NEAR_PIXEL_NS = 4.0, 0.15
WORK_OF = {Sink.MASK: "bits", Sink.SAMPLES: "bits", Sink.COUNT: "counts", Sink.LABEL: "labels"}

#: Triangles times threads. With fewer, threads that each set up every triangle are done before they have met twice.
MIN_TRIANGLES_TO_SHARE = 1_000_000

#: Triangles from which on a mesh that is drawn again is sorted into clusters; instances from which on one is at once.
MIN_TRIANGLES_TO_CLUSTER = 20_000
MIN_INSTANCES_TO_CLUSTER = 16

#: Clusters take 1.2 to 1.5 times as long for a triangle that shows (hills and soup, all of it in view, are 0.65 to 0.9
#: times as fast), and leave out what is outside, turned away or behind others. A view is drawn from them where no more
#: of them face it, and as many are outside, as is said here: (below so many triangles, without culling, with it).
#: Measured on blobs, scans, hills and soup in 512x512 and 1920x1080. Whole and culled, 30,000 to 300,000 triangles are
#: 0.86 to 0.93 times as fast, 1,000,000 1.09; half in view, 0.85 to 1.05, 0.93 to 1.12, and 1.3.
#: `docs/measured/static.md`.
MAX_FRONT_TO_CLUSTER = 0.8
MIN_OUTSIDE_TO_CLUSTER = ((60_000, 0.1, 0.6), (500_000, 0.0, 0.33), (math.inf, 0.0, 0.0))

#: Meshlets take 0.4 to 0.95 of the time of clusters or of the whole mesh, whichever is less, of blobs of 30,000
#: triangles or more in every view with culled faces, but for 30,000 seen whole (1.14 times). They take longer where all
#: triangles show (hills, 1.15 times), where triangles share no vertices, of which a cluster then has 85 (soup, 1.4
#: times), and where much is hidden. Of views that cull nothing they take 0.7 to 1.03 of it from 100,000 triangles on,
#: but 1.2 where 5 % of a million show; of 30,000 1.1 to 1.2 but for views from inside (0.8), and where more is hidden
#: than is said here nothing is gained. Of large triangles less may be hidden, for meshlets are drawn from top to
#: bottom: on a Sapphire Rapids, in 1920x1080, views of a scan of 100,000 triangles beyond these limits take 1.15 to 1.5
#: times as long, and of blobs of which both sides are drawn 1.1 to 1.3 times.
#: 30,000 triangles with culled faces in 1920x1080, half or a fifth of them in view, 0.01 a pixel, take 1.25 to 1.9
#: times as long on a Zen 4 whose last-level cache others use, too; 5 % of them 0.8 to 1.1 times.
#: Growing takes about three times as long as sorting clusters, which some 100 pictures pay back; a mesh that is drawn
#: 16 times is likely to be drawn more.
MIN_PICTURES_TO_GROW = 16
MIN_TRIANGLES_OF_CLUSTER = 150


class MeshletLimits(NamedTuple):
    """So many triangles at least, or so large a share outside and so many in view a pixel; and no more hidden."""

    triangles: int
    outside: float
    density: float
    hidden: float
    hidden_of_large: float
    """Of large triangles, and so much more with each triangle in view a pixel."""
    hidden_growth: float


MIN_OUTSIDE_OF_SPARSE = 0.6
CULLED_MESHLETS = MeshletLimits(60_000, 0.1, 0.02, 0.6, hidden_of_large=0.17, hidden_growth=0.4)
MESHLETS_OF_BOTH_SIDES = MeshletLimits(90_000, 0.5, 0.0, 0.7, hidden_of_large=0.35, hidden_growth=1.0)


class ClusterRoute(Enum):
    """How `rasterize` draws a mesh that is sorted into clusters."""

    WHOLE = "as a mesh without clusters"
    CLUSTERS = "cluster by cluster"
    MESHLETS = "from meshlets"


class SampledLimits(NamedTuple):
    """So many triangles in view a pixel at least; and so many of all for each sample, or so large a share outside."""

    density: float
    triangles: int
    outside: float


#: Several samples a pixel are a picture each from clusters or meshlets, with a plane of ids and depth in memory, where
#: the whole mesh is snapped and sorted into bands of rows once, which are drawn for one sample after the other in a
#: near cache. So planes pay where triangles are many for the pixels, or many are left out. By route, without culling
#: and with it, measured on blobs of 30,000 to 10,000,000 triangles with 2 to 16 samples in 512x512 and 1920x1080. By
#: "msaa4" in 1920x1080, seen whole, both sides of 1,000,000 are 1.5 times as fast from clusters and 1.9 from meshlets,
#: those of 10,000,000 2.3 and 3.3; with culled faces 0.8 and 1.25, and 1.2 and 2. Each sample takes the whole mesh less
#: than the first: from clusters 10,000,000 culled by "msaa8" are 0.9 times as fast. Where fewer are in view a pixel,
#: views of 30,000 to 300,000 triangles in 1920x1080 would be 0.3 to 0.9 times as fast.
SAMPLED_LIMITS = {
    ClusterRoute.CLUSTERS: (SampledLimits(0.06, 15_000, 0.1), SampledLimits(0.2, 1_500_000, 0.9)),
    ClusterRoute.MESHLETS: (SampledLimits(0.04, 0, 0.0), SampledLimits(0.1, 125_000, 0.3)),
}

#: From inside of a mesh, where so large a share is outside, planes pay up to so many samples of the picture for each
#: triangle beyond the near or far plane, however few are in view: one of those takes the whole mesh 90 ns, to find out
#: what the planes cut, and a sample of a plane takes 0.4 to 0.9. Blobs of 300,000 to 10,000,000 triangles are 1.3 to
#: 180 times as fast; soup of large ones, half of it outside, would be 0.8 times as fast.
MAX_SAMPLES_A_TRIANGLE, MIN_OUTSIDE_FROM_INSIDE = 100, 0.7

#: Scenes whose instances lie so many deep, on the mean, are drawn from clusters in any case: 200 in rows, 8.8 deep, are
#: 4 to 5.5 times as fast. Others are where so large a share is outside, with one sample and with several, for each of
#: which clusters are snapped anew: small in the picture and side by side, blobs are 0.90 and 0.87 times as fast, scans
#: 1.5 and 1.4.
MIN_LAYERS_TO_CLUSTER = 3.0
MIN_OUTSIDE_OF_INSTANCES = (0.1, 0.33)

#: Triangles and rows of an instance, on the mean, from which on threads draw the clusters of a scene together: with
#: fewer, most of the time is Python. Two threads, us an instance that shows: 1,000 triangles 41 (one thread 31), 3,000
#: 75 (45), 10,000 60 (87), 100,000 427 (567); 20,000 instances that are a third of a pixel high take 0.10 s (0.06).
MIN_TRIANGLES_OF_INSTANCE, MIN_ROWS_OF_INSTANCE = 6_000, 8

#: Pixels for each vertex from which on attributes of a mesh in clusters have all vertices snapped: to find those that
#: show reads all pixels. `render` of 100,000 triangles seen whole in 1920x1080: 9.5 ms and, of those alone, 11.1; of
#: 1,000,000 22.7 and 25.1; of 3,000,000, a fifth of them in view, 18.9 and 17.5.
MIN_PIXELS_A_VERTEX = 4

#: What is saved where triangles are sorted into bands of rows that stay in the second-level cache, ns: a pixel that is
#: cleared there, of ids and depth; where triangles lie far apart from one to the next, a row and a covered sample of
#: ids and depth, and a covered sample of four bytes. And what sorting costs: a triangle that is seen, one that is not,
#: and one more where it lies far from the next. On a Sapphire Rapids, in 1920x1080, ids and depth of a mesh of 10,000
#: triangles take 0.87 of the time, strewn ones, 1,000 of 300 px, 20,000 of 40 px and 200,000 of 8 px, 0.7, 0.5 and 0.5,
#: 40 frames with the far ones first 0.5; counts of those of 300 px 0.65. 1,000,000 strewn ones of 3 px would take 1.5
#: times as long, 1,000,000 of a mesh 1.1 times.
CLEARED_PIXEL_NS, SAVED_ROW_NS, SAVED_SAMPLE_NS, SAVED_STORE_NS = 0.1, 8.0, 0.1, 0.1
SORTED_TRIANGLE_NS, OUTSIDE_TRIANGLE_NS, FAR_TRIANGLE_NS = 10.0, 4.0, 20.0

#: Rows of a triangle, on the mean, from which on rows are saved: pixels of smaller boxes are fetched before they are
#: drawn. 250,000 triangles of 7 px take 0.6 of the time, 300,000 of 6 px 0.93 to 1.2, 400,000 of 5 px 1.2.
MIN_ROWS_TO_SORT = 4.3

#: Pixels of such a band. Triangles that follow each other more closely find it in the cache anyway.
BAND_PIXELS = 1 << 17

#: Bytes of a band of colours that stays there; what it saves of each row of a triangle and each pixel that is met
#: again, ns. And what a band costs: to look at a triangle and at a vertex once more, and by area a triangle that
#: reaches into it. 1,000 triangles of 300 px take 0.43 of the time by samples, 0.65 by area, 20,000 of 40 px by samples
#: 0.5, a mesh of 10,000 0.7 to 0.8, one of 100,000 1.0; 200,000 of 8 px that share no vertices would take 1.3 times.
BLEND_BAND_BYTES = 768 << 10
BLENDED_ROW_NS, BLENDED_PIXEL_NS, STRIP_NS = 4.0, 0.1, 1000.0
SEEN_TRIANGLE_NS, SEEN_VERTEX_NS = 0.5, 1.1

#: What it does not matter to in which order triangles are drawn.
ORDER_FREE = frozenset({Sink.MASK, Sink.COUNT, Sink.NEAREST, Sink.FARTHEST, Sink.SAMPLES})

#: What is drawn row by row where triangles are few, and how few those are.
FEW_OF = {
    Sink.MASK: engine.FEW_OF_BITS, Sink.SAMPLES: engine.FEW_OF_BITS, Sink.COUNT: engine.FEW_STORED,
    Sink.LABEL: engine.FEW_STORED,
}  # fmt: skip

#: With fewer pixels in the picture for each triangle that is seen, labels take less time than colours stored triangle
#: by triangle: 200,000 triangles of 8 px in 1920x1080 take 6.4 and 8 ms, 20,000 of 40 px 3.8 and 2.3 ms, 200,000 of
#: 20 px, one in 16 of them in the picture, 5.7 and 3.7 ms.
MIN_PIXELS_A_TRIANGLE = 45


def is_affine(matrix: NDArray[Any] | None) -> bool:
    """Tell whether every w is 1 behind a transform: dividing by it changes no bit, so it is left out."""
    return matrix is not None and matrix[3].tolist() == [0, 0, 0, 1]


def must_cut(n_outside: int) -> bool:
    """Tell whether triangles are looked through for those that a clip plane cuts: no vertex outside, none cut."""
    return n_outside > 0


def threads_to_convert(threads: int | None, n_triangles: int) -> int:
    """Return how many threads make int32 of other indices."""
    return count_threads(threads, n_triangles) if n_triangles >= MIN_TO_SHARE_ARRAYS else 1


def threads_to_snap(threads: int | None, n_vertices: int, n_triangles: int) -> int:
    """Return how many threads transform and snap vertices."""
    return count_threads(threads, n_triangles) if n_vertices >= MIN_TO_SHARE_ARRAYS else 1


def threads_to_draw(view: View, snapped: Snapped, sink: Sink) -> int:
    """Return how many threads draw, in bands of rows: as many as are asked for, or as many as the work is worth."""
    n_threads = view.threads
    if n_threads is None:
        n_threads = available_threads()
        if n_threads > 1:
            n_threads = min(n_threads, max(1, int(work_ns(view, snapped, sink) / MIN_THREAD_NS)))
    return min(view.size[1], n_threads)


def work_ns(view: View, snapped: Snapped, sink: Sink) -> float:
    """Return about how long one thread draws, from a guess of what is seen."""
    kind = "area" if view.sampling is Sampling.AREA else WORK_OF.get(sink, "ids")
    row_ns, sample_ns, pixel_ns = WORK_NS[kind]
    n_pixels = view.size[0] * view.size[1]
    if n_pixels <= NEAR_PIXELS:
        row_ns, pixel_ns = min(row_ns, NEAR_ROW_NS), min(pixel_ns, NEAR_PIXEL_NS)
    _, n_layers, n_rows = snapped.mesh.guess_seen(*view.size)
    drawn_ns = row_ns * n_rows + n_pixels * (sample_ns * n_layers + pixel_ns)
    return TRIANGLE_NS * snapped.n_triangles + view.sampling.n_samples * drawn_ns


def can_share(view: View) -> bool:
    """Tell whether a pass over a scene can draw some of its triangles."""
    fits_lanes = not view.test or view.subpixel_bits <= 8
    return fits_lanes and takes_lanes(view) and not view.is_exact


def takes_lanes(view: View) -> bool:
    """Tell whether int32 can count the pixels of a picture, of which nobody has said how it is drawn."""
    width, height = view.size
    is_near = max(map(abs, view.origin)) < 2**29 and width * height < 2**31
    return is_near and view.method == METHODS["auto"].code


def is_shared(view: View, n_triangles: int, n_parts: int, sink: Sink) -> bool:
    """Tell whether each thread is to take a share of the triangles instead of setting up all of them."""
    pays = n_triangles * n_parts >= MIN_TRIANGLES_TO_SHARE
    fits_lanes = sink is not Sink.SAMPLES or view.grid_bits <= 8
    shares = takes_lanes(view) if view.is_exact else can_share(view)
    return n_parts > 1 and pays and fits_lanes and shares


def fragment_sink(test: DepthTest | None, *, has_depth: bool) -> Sink:
    """Return what `rasterize` does with a covered sample: the nearer, the farther or the later triangle stays."""
    if test is None or not has_depth:
        return Sink.PAINT
    return Sink.FARTHEST if test is DepthTest.GREATER else Sink.NEAREST


def pays_float_lanes(view: View) -> bool:
    """Tell whether float lanes draw what integer ones of 32 bits are too short for: coverage alone, on a fine grid.

    1,000,000 triangles of 1 px at 16 bits: 42 and 8 ms; 100,000 of 10 px at 12 bits: 12.7 and 4 ms.
    """
    has_way = view.plan is None and view.transform is None and view.single_sided is None and view.classic is None
    is_one = view.sampling in (Sampling.CENTER, Sampling.OUTER, Sampling.INNER)
    return view.subpixel_bits > 8 and is_one and has_way and takes_lanes(view) and not view.is_exact


def can_cluster(view: View, sink: Sink) -> bool:
    """Tell whether the clusters of a mesh may be drawn one by one, in any order: where that decides nothing."""
    is_on_grid = view.grid_bits == view.subpixel_bits and (sink is not Sink.SAMPLES or view.grid_bits <= 8)
    if view.single_sided is not None:  # clusters do not know which triangles are
        return False
    return sink in ORDER_FREE and is_on_grid and 0 not in view.size and can_share(view)


def pays_to_cluster(n_triangles: int, n_drawn: int, n_instances: int = 1) -> bool:
    """Tell whether a mesh is drawn often enough to sort its triangles first.

    `n_triangles`: of all that is drawn with it; `n_drawn`: how many pictures of it there have been.
    """
    return n_triangles >= MIN_TRIANGLES_TO_CLUSTER and (n_drawn > 0 or n_instances >= MIN_INSTANCES_TO_CLUSTER)


def cluster_route(
    view: View, sink: Sink, clusters: Clusters, survey: Survey, find_beyond: Callable[[], float]
) -> ClusterRoute:
    """Return how a view of a mesh in clusters is drawn; `survey`: what becomes of them in it.

    `find_beyond`: the share of the vertices beyond the near or far plane.
    """
    n = clusters.n_triangles
    is_grown = can_draw_meshlets(view, sink, is_float32=clusters.is_float32)
    is_grown = is_grown and pays_to_grow(clusters.n_pictures, n, len(clusters))
    if is_grown and pays_to_draw_from(ClusterRoute.MESHLETS, view, n, survey, clusters.hidden, find_beyond):
        return ClusterRoute.MESHLETS
    pays = pays_to_draw_from(ClusterRoute.CLUSTERS, view, n, survey, clusters.hidden, find_beyond)
    return ClusterRoute.CLUSTERS if pays else ClusterRoute.WHOLE


def pays_to_draw_from(
    route: ClusterRoute, view: View, n_triangles: int, survey: Survey, hidden: float, find_beyond: Callable[[], float]
) -> bool:
    """Tell whether a view of a mesh is drawn from clusters or from meshlets, as `route` says."""
    if view.sampling.n_samples > 1:
        return pays_to_draw_samples(route, view, n_triangles, survey, find_beyond)
    if route is ClusterRoute.MESHLETS:
        return pays_to_draw_meshlets(view, n_triangles, survey, hidden)
    return pays_to_draw_clusters(view, n_triangles, survey)


def pays_to_draw_samples(
    route: ClusterRoute, view: View, n_triangles: int, survey: Survey, find_beyond: Callable[[], float]
) -> bool:
    """Tell whether several samples of a mesh are drawn from clusters or meshlets, one after the other."""
    limits = SAMPLED_LIMITS[route][view.cull != CULL_CODES[Cull.NONE]]
    n_pixels, n_samples = view.size[0] * view.size[1], view.sampling.n_samples
    are_many = n_triangles >= limits.triangles * n_samples or survey.outside >= limits.outside
    if survey.front > MAX_FRONT_TO_CLUSTER:
        return False
    if are_many and n_triangles * (1.0 - survey.outside) >= limits.density * n_pixels:
        return True
    if survey.outside < MIN_OUTSIDE_FROM_INSIDE:
        return False
    return MAX_SAMPLES_A_TRIANGLE * n_triangles * find_beyond() >= n_samples * n_pixels


def pays_to_draw_clusters(view: View, n_triangles: int, survey: Survey) -> bool:
    """Tell whether a view of a mesh in clusters is drawn from these; `survey`: what becomes of them in it."""
    is_culled = view.cull != CULL_CODES[Cull.NONE]
    least = next(shares[is_culled] for below, *shares in MIN_OUTSIDE_TO_CLUSTER if n_triangles < below)
    return survey.front <= MAX_FRONT_TO_CLUSTER and survey.outside >= least


def can_draw_meshlets(view: View, sink: Sink, *, is_float32: bool) -> bool:
    """Tell whether a view of a mesh in clusters may be drawn from meshlets, where there is code for these.

    They hold coordinates that are float32 numbers, whatever their dtype, and draw triangles in 16 bits, of what lies
    between near and far.
    """
    if not (engine.has_meshlets() and sink in (Sink.NEAREST, Sink.FARTHEST) and is_float32):
        return False
    is_near = max(*view.size, *view.viewport, *map(abs, view.origin)) <= engine.MAX_DRAWN_PX
    is_clipped = view.near_clip and view.far_clip
    is_sampled = view.sampling is Sampling.CENTER or view.sampling.n_samples > 1
    return is_near and is_clipped and view.subpixel_bits <= 8 and is_sampled and view.grid_bits == view.subpixel_bits


def pays_to_grow(n_pictures: int, n_triangles: int, n_clusters: int) -> bool:
    """Tell whether a mesh in clusters has been drawn often enough to grow it into meshlets.

    Triangles that share no vertices, of which few are in a cluster, never are.
    """
    return n_pictures >= MIN_PICTURES_TO_GROW and n_triangles >= MIN_TRIANGLES_OF_CLUSTER * n_clusters


def pays_to_draw_meshlets(view: View, n_triangles: int, survey: Survey, hidden: float) -> bool:
    """Tell whether a view of a mesh is drawn from meshlets; `survey`: what becomes of its clusters.

    `hidden`: the share of those in view that the last picture hid. Meshlets are drawn from top to bottom.
    """
    limits = MESHLETS_OF_BOTH_SIDES if view.cull == CULL_CODES[Cull.NONE] else CULLED_MESHLETS
    density = n_triangles * (1.0 - survey.outside) / (view.size[0] * view.size[1])
    are_dense = density >= limits.density or survey.outside >= MIN_OUTSIDE_OF_SPARSE
    are_many = n_triangles >= limits.triangles or (survey.outside >= limits.outside and are_dense)
    most_hidden = min(limits.hidden, limits.hidden_of_large + limits.hidden_growth * density)
    return are_many and survey.front <= MAX_FRONT_TO_CLUSTER and hidden <= most_hidden


def pays_to_draw_instances(view: View, n_triangles: int, survey: Survey, count_layers: Callable[[], float]) -> bool:
    """Tell whether a scene in clusters is drawn from these; `n_triangles`: of an instance, on the mean.

    `survey`: as for one mesh; `count_layers`: how many instances lie one behind the other.
    """
    least = MIN_OUTSIDE_OF_INSTANCES[view.sampling.n_samples > 1]
    pays = survey.outside >= least and pays_to_draw_clusters(view, n_triangles, survey)
    return pays or count_layers() >= MIN_LAYERS_TO_CLUSTER


def pays_to_share_instances(n_triangles: int, n_rows: float) -> bool:
    """Tell whether threads share the rows of a scene that is drawn in clusters; of an instance, on the mean."""
    return n_triangles >= MIN_TRIANGLES_OF_INSTANCE and n_rows >= MIN_ROWS_OF_INSTANCE


def pays_to_snap_all(n_vertices: int, n_pixels: int) -> bool:
    """Tell whether all vertices of a mesh in clusters are snapped for attributes, not only those that show."""
    return n_vertices * MIN_PIXELS_A_VERTEX <= n_pixels


def common_depth(points: NDArray[Any], *, has_depth: bool, is_clip_space: bool) -> float | None:
    """Return the depth of every vertex if they all have the same.

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
    with np.errstate(over="ignore"):  # what float32 cannot hold has been refused if a triangle uses it
        return float(np.float32(points[0, 2])) + 0.0  # -0 becomes 0, as it does in every depth buffer


def pays_without_depth(snapped: Snapped, view: View) -> bool:
    """Tell whether one pass over all pixels costs less than comparing depths wherever triangles are."""
    n_pixels = view.size[0] * view.size[1]
    _, n_layers, n_rows = snapped.mesh.guess_seen(*view.size)
    compared_ns = COMPARED_SAMPLE_NS * n_layers * n_pixels
    if n_pixels > NEAR_PIXELS:
        compared_ns += COMPARED_ROW_NS * n_rows
    return compared_ns > FLAT_CALL_NS + FLAT_PIXEL_NS * n_pixels


def is_flat(snapped: Snapped, view: View) -> bool:
    """Tell whether all triangles lie at one depth, so that samples need not compare it, and leaving that out pays."""
    is_clip_space = snapped.given.source.is_clip_space
    if is_clip_space or not pays_without_depth(snapped, view):
        return False
    return common_depth(snapped.given.points, has_depth=snapped.has_depth, is_clip_space=is_clip_space) is not None


class Drawing(NamedTuple):
    """What becomes of a covered sample, and how threads share the work."""

    sink: Sink
    n_threads: int
    is_shared: bool  # each thread takes a share of the triangles; otherwise all of them, in its own rows
    is_bounded: bool  # large triangles leave out what lies behind what has been drawn
    in_bands: bool  # triangles are sorted into bands of rows, and band after band is drawn


def drawing(view: View, snapped: Snapped, sink: Sink) -> Drawing:
    """Return how a mesh is drawn."""
    n_threads = threads_to_draw(view, snapped, sink)
    shares = is_shared(view, snapped.n_triangles, n_threads, sink)
    in_bands = pays_to_sort(view, snapped, sink) and not draws_few(snapped, view, sink, n_threads)
    return Drawing(sink, n_threads, shares and not in_bands, pays_to_bound(view, snapped, sink), in_bands)


def pays_to_sort(view: View, snapped: Snapped, sink: Sink) -> bool:
    """Tell whether triangles are sorted into bands of rows: few of a large picture, or each far from the one before."""
    n_pixels, n = view.size[0] * view.size[1], snapped.n_triangles
    has_depth = sink in (Sink.NEAREST, Sink.FARTHEST, Sink.PAINT)
    is_stored = has_depth or sink in (Sink.COUNT, Sink.LABEL)
    if not is_stored or n_pixels <= NEAR_PIXELS or view.sampling is not Sampling.CENTER or not can_share(view):
        return False
    n_seen, n_layers, n_rows = snapped.mesh.guess_seen(*view.size)
    n_covered = n_layers * n_pixels
    cleared_ns = CLEARED_PIXEL_NS * n_pixels if has_depth else 0.0
    met_ns = n_rows * SAVED_ROW_NS + n_covered * SAVED_SAMPLE_NS if has_depth else n_covered * SAVED_STORE_NS
    if n_rows < MIN_ROWS_TO_SORT * n_seen:
        met_ns = 0.0
    sorted_ns = n_seen * SORTED_TRIANGLE_NS + (n - n_seen) * OUTSIDE_TRIANGLE_NS
    if cleared_ns + met_ns <= sorted_ns:
        return False
    scatter = guess_scatter(view, snapped)
    return cleared_ns + scatter * met_ns > sorted_ns + scatter * n_seen * FAR_TRIANGLE_NS


def pays_to_bound(view: View, snapped: Snapped, sink: Sink) -> bool:
    """Tell whether to keep, beside depths, a bound of those of each 64 columns of a row: where spans are long."""
    width, height = view.size
    is_kept = sink in (Sink.NEAREST, Sink.FARTHEST) and view.sampling is Sampling.CENTER and not view.is_exact
    if not is_kept or width < MIN_COLUMNS_TO_BOUND or snapped.n_triangles > MAX_TRIANGLES_TO_BOUND:
        return False
    _, n_layers, n_rows = snapped.mesh.guess_seen(width, height)
    return n_layers * width * height >= MIN_SPAN_TO_BOUND * max(1.0, n_rows)


def guess_scatter(view: View, snapped: Snapped) -> float:
    """Return the share of triangles that are taller than a band of rows, or lie farther from the next."""
    return snapped.mesh.guess_scatter(max(1, BAND_PIXELS // view.size[0]))


def rows_to_blend(view: View, snapped: Snapped, row_bytes: int, *, lays_ground: bool) -> int:
    """Return how many rows are blended before the next: a band that stays in the cache, where all are met again.

    Each band looks at all triangles.
    """
    width, height = view.size
    n_rows = max(1, BLEND_BAND_BYTES // row_bytes)
    if n_rows >= height:
        return height
    _, n_layers, n_triangle_rows = snapped.mesh.guess_seen(width, height)
    n_covered = n_layers * width * height
    again_ns = n_triangle_rows * BLENDED_ROW_NS + n_covered * BLENDED_PIXEL_NS
    ground_ns = min(n_covered, width * height) * BLENDED_PIXEL_NS if lays_ground else 0.0
    cost_ns = height / n_rows * (snapped.n_triangles * SEEN_TRIANGLE_NS + snapped.n_vertices * SEEN_VERTEX_NS)
    if view.sampling is Sampling.AREA:
        cost_ns += n_triangle_rows / n_rows * STRIP_NS
    return n_rows if ground_ns + again_ns * guess_scatter(view, snapped) > cost_ns else height


class Route(Enum):
    """How `rasterize` draws a mesh: `rasterize.ROUTES` has a function for each."""

    LABELS = "ids alone"
    FLAT = "ids alone, then the one depth wherever there is one"
    DEPTH = "ids and depth"
    SAMPLES = "ids and depth of each sample"


def route(view: View, snapped: Snapped, test: DepthTest | None, *, wants_depth: bool) -> tuple[Route, Drawing]:
    """Return how `rasterize` draws a mesh; `wants_depth`: into an array of the caller's."""
    has_depth = snapped.has_depth
    sink = fragment_sink(test, has_depth=has_depth)
    if view.sampling.n_samples > 1:
        found = Route.SAMPLES
    elif not has_depth and not wants_depth:
        found, sink = Route.LABELS, Sink.LABEL
    elif is_flat(snapped, view):
        found, sink = Route.FLAT, Sink.LABEL
    else:
        found = Route.DEPTH
    return found, drawing(view, snapped, sink)


def can_split(view: View, n_triangles: int) -> bool:
    """Tell whether what samples see may be kept once for the pixels that show one triangle."""
    return view.sampling.n_samples > 1 and 0 not in view.size and n_triangles > 0 and can_share(view)


def earlier_wins(test: DepthTest | None, *, has_depth: bool) -> bool:
    """Tell whether the triangle with the lower index shows where depths are equal; otherwise the later one does."""
    return test is not None and has_depth


def draws_few(snapped: Snapped, view: View, sink: Sink, n_threads: int) -> bool:
    """Tell whether `draw` writes a picture row by row: so few triangles for the size of a thread's rows."""
    is_known = sink in FEW_OF and view.sampling is not Sampling.AREA and not view.test
    n_samples = view.sampling.n_samples if sink is Sink.SAMPLES else 1
    width, height = view.size
    return is_known and snapped.mesh.is_few(width, height // max(1, n_threads), n_samples, FEW_OF[sink])


def fills_few(snapped: Snapped, view: View, colors: NDArray[Any], *, is_flat: bool) -> bool:
    """Tell whether flat colours over a background are written row by row."""
    n_samples = view.sampling.n_samples
    is_stored = n_samples == 1 and colors.dtype == np.uint8 and colors.shape[1:] == (4,)
    most = engine.FEW_STORED if is_stored else engine.FEW_LABELLED
    return is_flat and view.sampling is not Sampling.AREA and snapped.mesh.is_few(*view.size, n_samples, most)


def blends_few(snapped: Snapped, view: View, colors: NDArray[Any], *, is_flat: bool) -> bool:
    """Tell whether flat colours are blended over a background row by row.

    By area four bytes a pixel are blended where they are, which is as fast for one triangle and faster for several.
    """
    is_in_place = colors.dtype == np.uint8 and colors.shape[1:] == (4,)
    pays = is_flat and view.sampling.n_samples == 1 and not (view.sampling is Sampling.AREA and is_in_place)
    return pays and snapped.mesh.blends_few(*view.size)


def is_direct(snapped: Snapped, view: View, dtype: np.dtype[Any], *, is_flat: bool) -> bool:
    """Tell whether colours are best stored triangle by triangle, without labels in between.

    Labels cost a pass to clear and one to colour them, and less a triangle that is seen.
    """
    if not is_flat or dtype != np.uint8 or view.sampling.n_samples > 1 or view.is_exact:
        return False
    n_seen, _, _ = snapped.mesh.guess_seen(*view.size)
    return n_seen * MIN_PIXELS_A_TRIANGLE <= view.size[0] * view.size[1]
