"""What a scene is, found by the code that draws it: transform, clip and snap, then a census instead of a draw.

In: the arrays of a call. Out: `Facts`, which `plan_stages` turns into sentences.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from topleft._base.arrays import as_array
from topleft._base.memory import FreshMemory
from topleft._base.options import DepthTest, Sampling, Sink
from topleft._plan.plan_clusters import ClusterFacts
from topleft._raster import choices
from topleft._raster.sampling import sample_positions
from topleft._raster.snap import snap_mesh
from topleft._raster.view import View

__all__ = ["CLASSES", "Facts", "find_facts"]

#: The names of `tl_class` in ``csrc/topleft.h``.
CLASSES = (
    "degenerate", "culled", "outside", "between", "tiny", "small", "middle", "rows", "long",
    "edge 64", "span 64", "edge 128", "span 128",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Facts:
    """What decides how a scene is drawn."""

    verb: str
    outputs: tuple[str, ...]
    view: View
    test: DepthTest | None
    sink: Sink
    vertex_dtype: str  # as given
    point_dtype: str  # as worked on
    is_vertex_copy: bool
    index_dtype: str
    n_vertices: int
    n_components: int
    n_triangles: int
    is_clip_space: bool
    is_affine: bool
    are_whole: bool  # vertices in pixels are whole numbers
    n_wide: int  # vertices beyond 2**30 sub-pixels
    n_clipped: int  # vertices outside of a clip plane
    n_cut: int  # triangles that a plane cuts and that are drawn as pieces
    n_pieces: int
    flat_depth: float | None  # when ids are drawn alone
    common_depth: float | None  # of all vertices, whatever is made of it
    is_direct: bool  # uint8 colours of triangles are stored without labels in between
    n_threads: int  # that draw
    work_ms: float  # of one thread, as guessed before the draw
    census: tuple[tuple[int, float, float], ...]  # of each of CLASSES: triangles, samples in boxes, covered
    clusters: ClusterFacts | None = None  # of a mesh

    def count(self, *names: str) -> int:
        """Return how many triangles or pieces are of some classes."""
        return sum(self.census[CLASSES.index(name)][0] for name in names)

    @property
    def n_beyond(self) -> int:
        """Triangles of which the clip planes leave nothing."""
        return self.n_triangles - self.n_cut + self.n_pieces - sum(row[0] for row in self.census)

    @property
    def draws_planes(self) -> bool:
        """Whether each sample is a picture of its own."""
        return self.view.sampling.n_samples > 1 and self.verb in ("rasterize", "fill")

    @property
    def is_shared(self) -> bool:
        """Whether each thread takes a share of the triangles."""
        if self.view.sampling is Sampling.AREA or self.draws_planes or self.is_direct:
            return False
        return choices.is_shared(self.view, self.n_triangles, self.n_threads, self.sink)

    @property
    def n_drawn(self) -> int:
        """Triangles and pieces that may cover a sample."""
        return self.count(*CLASSES[4:])

    @property
    def covered(self) -> float:
        """Return about how many samples are covered, each as often as it is."""
        return sum(row[2] for row in self.census)


def find_facts(
    vertices: ArrayLike,
    triangles: ArrayLike,
    view: View,
    verb: str,
    outputs: tuple[str, ...],
    test: DepthTest | None,
) -> tuple[Facts, NDArray[np.int32]]:
    """Return what a scene is, and its triangles as a copy that nobody changes.

    Raises
    ------
    ValueError, TypeError, IndexError
        As the verb would.
    """
    with_depth = verb == "rasterize"
    snapped = snap_mesh(FreshMemory(), vertices, triangles, view, with_depth=with_depth, out=None)
    snapped.check_indices()
    given, indices = as_array("vertices", vertices), as_array("triangles", triangles)
    points, pieces, source = snapped.points, snapped.pieces, snapped.source
    xy = snapped.records.view(np.int32).reshape(-1, 4)[:, :2]
    is_special = xy[:, 0] == np.iinfo(np.int32).min
    sink = find_sink(verb, view, test, has_depth=snapped.has_depth)
    common = choices.common_depth(points, has_depth=snapped.has_depth, is_clip_space=source.is_clip_space)
    flat = None
    if with_depth and view.sampling is Sampling.CENTER and 0 not in view.size and choices.is_flat(snapped, view):
        flat = common
    drawn_sink = sink if flat is None else Sink.LABEL
    samples = sample_positions(view.sampling.n_samples, view.grid_bits) if sink is Sink.SAMPLES else None
    census = [(0, 0.0, 0.0)] * len(CLASSES)
    if 0 not in view.size and snapped.n_triangles:
        _, census = snapped.mesh.count_classes(drawn_sink, *view.size, samples)
    in_pixels = not source.is_clip_space and len(points) > 0
    facts = Facts(
        verb=verb,
        outputs=outputs,
        view=view,
        test=test,
        sink=drawn_sink,
        vertex_dtype=str(given.dtype),
        point_dtype=str(points.dtype),
        is_vertex_copy=not np.shares_memory(given, points),
        index_dtype=str(indices.dtype),
        n_vertices=len(points),
        n_components=points.shape[1],
        n_triangles=snapped.n_triangles,
        is_clip_space=source.is_clip_space,
        is_affine=source.is_affine,
        are_whole=in_pixels and bool((points[:, :2] == np.rint(points[:, :2])).all()),
        n_wide=int((is_special & (xy[:, 1] == 1)).sum()),
        n_clipped=int((is_special & (xy[:, 1] == 2)).sum()),
        n_cut=len(np.unique(pieces.arrays[5][: len(pieces)])) if pieces else 0,  # type: ignore[index]
        n_pieces=len(pieces) if pieces else 0,
        flat_depth=flat,
        common_depth=common,
        is_direct=verb == "fill" and choices.is_direct(snapped, view, np.dtype(np.uint8), is_flat=True),
        n_threads=choices.threads_to_draw(view, snapped, drawn_sink),
        work_ms=choices.work_ns(view, snapped, drawn_sink) / 1e6,
        census=tuple(census),
    )
    corners = np.array(snapped.triangles, np.int32)
    corners.flags.writeable = False
    return facts, corners


def find_sink(verb: str, view: View, test: DepthTest | None, *, has_depth: bool) -> Sink:
    """Return what a verb does with a covered sample."""
    if verb == "rasterize":
        return choices.fragment_sink(test, has_depth=has_depth)
    if verb == "fill":
        return Sink.LABEL
    if verb == "overdraw" or view.sampling is Sampling.AREA:
        return Sink.COUNT
    return Sink.SAMPLES if view.sampling.n_samples > 1 else Sink.MASK
