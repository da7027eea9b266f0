"""Computes the facts that decide a draw: transforms, clips and snaps as the draw does, then counts instead of drawing.

In: the arrays of a call, or a mesh. Out: `Facts`, which `stages.py` describes in sentences.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from topleft._core.base.arrays import as_array
from topleft._core.base.memory import FRESH
from topleft._core.base.options import Sampling, Sink
from topleft._core.raster import choices
from topleft._core.raster.choices import Drawing, FillRoute, Route
from topleft._core.raster.cluster_draw import SURVEYED, SURVEYED_OF_SAMPLES, ClusteredMesh
from topleft._core.raster.clusters import Clusters
from topleft._core.raster.sampling import sample_positions
from topleft._core.raster.snap import snap_mesh
from topleft._core.raster.view import View
from topleft._meshes.model.mesh import Mesh
from topleft.typing import DepthTestOption

#: The names of `tl_class` in ``csrc/topleft.h``.
CLASSES = (
    "degenerate", "culled", "outside", "between", "tiny", "small", "middle", "rows", "long",
    "edge 64", "span 64", "edge 128", "span 128",
)  # fmt: skip


MOST_SHOWS = "most of the mesh shows, and drawing that cluster by cluster takes longer"


@dataclass(frozen=True, slots=True)
class ClusterFacts:
    """How many clusters of a mesh are culled and drawn in a view."""

    clusters: Clusters | None  # the clusters to draw; None where the mesh is drawn whole
    why_not: str = ""  # why the mesh is drawn whole
    n_outside: int = 0
    n_turned: int = 0  # away from the eye
    n_hidden: int = 0
    n_drawn: int = 0


@dataclass(frozen=True, slots=True)
class Facts:
    """The facts that decide how a scene is drawn."""

    verb: str
    outputs: tuple[str, ...]
    view: View
    test: DepthTestOption | None
    route: Route | None  # of `rasterize`
    drawing: Drawing
    vertex_dtype: str  # of the caller's array
    point_dtype: str  # of the array in kernels
    is_vertex_copy: bool
    index_dtype: str
    n_vertices: int
    n_components: int
    n_triangles: int
    is_clip_space: bool
    are_whole: bool  # vertices in pixels are whole numbers
    n_clipped: int  # vertices outside of a clip plane
    n_cut: int  # triangles that a plane cuts and that are drawn as pieces
    n_pieces: int
    common_depth: float | None  # of all vertices
    is_direct: bool  # uint8 colours of triangles are stored without labels in between
    is_large_shapes: bool  # a few large triangles, whose colours are filled row by row
    work_ms: float  # of a single thread, as estimated before the draw
    census: tuple[tuple[int, float, float], ...]  # of each of CLASSES: triangles, samples in boxes, covered
    clusters: ClusterFacts | None = None  # of a mesh

    def count(self, *names: str) -> int:
        """Return how many triangles or pieces are of the named classes."""
        return sum(self.census[CLASSES.index(name)][0] for name in names)

    @property
    def n_beyond(self) -> int:
        """Triangles that lie wholly outside of a clip plane."""
        return self.n_triangles - self.n_cut + self.n_pieces - sum(row[0] for row in self.census)

    @property
    def draws_planes(self) -> bool:
        """Whether each sample is drawn to a separate picture."""
        return self.view.sampling.n_samples > 1 and self.verb in ("rasterize", "fill")

    @property
    def in_clusters(self) -> bool:
        """Whether a mesh is drawn cluster by cluster, each sample to a separate picture."""
        return self.clusters is not None and self.clusters.clusters is not None

    @property
    def is_sliced(self) -> bool:
        """Whether each thread draws a share of the triangles."""
        if self.view.sampling is Sampling.AREA or self.draws_planes or self.is_direct:
            return False
        return self.drawing.is_sliced

    @property
    def in_bands(self) -> bool:
        """Whether triangles are sorted into bands of rows, and band after band is drawn."""
        return self.drawing.in_bands and not (self.is_direct or self.is_large_shapes or 0 in self.view.size)

    @property
    def n_drawn(self) -> int:
        """Triangles and pieces that may cover a sample."""
        return self.count(*CLASSES[4:])

    @property
    def covered(self) -> float:
        """Return about how many times samples are covered, the sum over all samples."""
        return sum(row[2] for row in self.census)


def find_facts(
    vertices: ArrayLike,
    triangles: ArrayLike,
    view: View,
    verb: str,
    outputs: tuple[str, ...],
    test: DepthTestOption | None,
) -> Facts:
    """Return the facts of a scene; raises the errors of the verb."""
    caller_view, view = view, replace(view, is_exact=False)  # the census counts snapped triangles
    snapped = snap_mesh(FRESH, vertices, triangles, view, with_depth=verb == "rasterize", out=None)
    snapped.given.check_indices()
    caller_vertices, indices = as_array("vertices", vertices), as_array("triangles", triangles)
    points, source, pieces = snapped.given.points, snapped.given.source, snapped.pieces
    xy = snapped.records.view(np.int32).reshape(-1, 4)[:, :2]
    is_special = xy[:, 0] == np.iinfo(np.int32).min
    route, drawing = None, choices.drawing(view, snapped.work, find_sink(verb, view))
    if verb == "rasterize":
        route, drawing = choices.route(view, snapped.work, test, wants_depth=False)
    filling = None
    if verb == "fill":  # with RGBA, a colour of each triangle
        rgba = np.zeros((snapped.n_triangles, 4), np.uint8)
        filling = choices.fill_route(view, snapped.work, rgba, is_flat=True, is_mixed=False, has_ground=True)
    common = choices.common_depth(points, has_depth=snapped.work.has_depth, is_clip_space=source.is_clip_space)
    samples = sample_positions(view.sampling.n_samples, view.grid_bits) if drawing.sink is Sink.SAMPLES else None
    census = [(0, 0.0, 0.0)] * len(CLASSES)
    if 0 not in view.size and snapped.n_triangles:
        _, census = snapped.mesh.count_classes(drawing.sink, *view.size, samples)
    in_pixels = not source.is_clip_space and len(points) > 0
    return Facts(
        verb=verb,
        outputs=outputs,
        view=caller_view,
        test=test,
        route=route,
        drawing=drawing,
        vertex_dtype=str(caller_vertices.dtype),
        point_dtype=str(points.dtype),
        is_vertex_copy=not np.shares_memory(caller_vertices, points),
        index_dtype=str(indices.dtype),
        n_vertices=len(points),
        n_components=points.shape[1],
        n_triangles=snapped.n_triangles,
        is_clip_space=source.is_clip_space,
        are_whole=in_pixels and bool((points[:, :2] == np.rint(points[:, :2])).all()),
        n_clipped=int((is_special & (xy[:, 1] == 2)).sum()),
        n_cut=len(np.unique(pieces.arrays[5][: len(pieces)])) if pieces else 0,  # type: ignore[index]
        n_pieces=len(pieces) if pieces else 0,
        common_depth=common,
        is_direct=filling is FillRoute.BLENDED,
        is_large_shapes=filling is FillRoute.SHAPES,
        work_ms=choices.work_ns(view, snapped.work, drawing.sink) / 1e6,
        census=tuple(census),
    )


def find_sink(verb: str, view: View) -> Sink:
    """Return the sink of a verb other than `rasterize`."""
    if verb == "fill":
        return Sink.LABEL
    if verb == "overdraw" or view.sampling is Sampling.AREA:
        return Sink.COUNT
    return Sink.SAMPLES if view.sampling.n_samples > 1 else Sink.MASK


def find_cluster_facts(mesh: Mesh, view: View, verb: str, test: DepthTestOption | None) -> ClusterFacts:
    """Return the clusters that `rasterize_mesh` draws from the second picture of a mesh on; computes them if needed."""
    n_triangles = len(mesh.triangles)
    if verb != "rasterize":
        return ClusterFacts(None, f"{verb} draws arrays, which may change")
    sink = choices.fragment_sink(test, has_depth=True)
    if view.is_exact:
        return ClusterFacts(None, "vertices that are not snapped are drawn from beginning to end")
    if view.grid_bits != view.subpixel_bits:
        return ClusterFacts(None, "samples lie on a finer grid than the vertices")
    if not choices.can_cluster(view, sink):
        return ClusterFacts(None, "the order of the triangles matters, or the window lies too far off")
    if not choices.pays_to_cluster(n_triangles, 1):
        return ClusterFacts(None, f"{n_triangles:,} triangles are done before sorting them would pay")
    clusters = mesh.clusters
    seen = ClusteredMesh(clusters, view)
    few = seen.survey(SURVEYED_OF_SAMPLES if view.sampling.n_samples > 1 else SURVEYED)
    if not choices.pays_to_draw_from_clusters(view, n_triangles, few, seen.share_clipped):
        return ClusterFacts(None, MOST_SHOWS)
    n = len(clusters)
    survey = seen.survey(n)
    n_outside, n_turned, n_drawn = round(survey.outside * n), round(survey.turned * n), seen.count_drawn(sink)
    return ClusterFacts(clusters, "", n_outside, n_turned, n - n_outside - n_turned - n_drawn, n_drawn)
