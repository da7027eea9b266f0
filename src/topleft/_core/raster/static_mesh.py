"""Draws a mesh that does not change: from its clusters where that pays, otherwise as its arrays are drawn.

In: a `Static` mesh and a view with a `transform`. Out: the `Fragments` that `rasterize` draws of the arrays.
"""

from __future__ import annotations

import numpy as np

from topleft._core import engine
from topleft._core.base.memory import Memory, MemoryOf, check_fits
from topleft._core.base.options import Sink
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import ClusteredMesh
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.rasterize import FragmentOptions, buffers_of, copy_planes, draw_fragments, planes_of
from topleft._core.raster.sampling import lay_background, sample_positions
from topleft._core.raster.view import Static, View


def draw_static(memory: Memory, mesh: Static, view: View, options: FragmentOptions) -> Fragments:
    """Return the visibility buffer of a mesh that does not change, as `rasterize` does; the draw is counted."""
    frags = draw_clusters(memory, mesh, view, options)
    if frags is None:
        return draw_fragments(memory, mesh.vertices, mesh.triangles, view, options)
    return frags.drawn_from(mesh.vertices, mesh.triangles, view)


def draw_clusters(memory: Memory, mesh: Static, view: View, options: FragmentOptions) -> Fragments | None:
    """Draw a mesh from its clusters.

    None without clusters, where drawing them does not pay, or where a draw of the arrays must name the error.
    """
    sink = choices.fragment_sink(options.test, has_depth=True)
    if view.transform is None or not choices.can_cluster(view, sink):
        return None
    clusters = mesh.find_clusters()
    if clusters is None or not clusters.backoff.is_over():
        return None
    clustered = ClusteredMesh(clusters, view)
    if not clustered.pays():
        return None
    if view.sampling.n_samples > 1:
        return draw_cluster_samples(memory, clustered, view, options, sink)
    ids, depth = buffers_of(memory, view, options)
    bounds = memory.empty("bounds", engine.Target.bounds_shape(*ids.canvas.shape), np.float32)
    target = engine.Target(sink, ids.canvas, depth.canvas, None, bounds=bounds)
    if not clustered.draw(memory, target):
        return None
    lay_background(ids.canvas, depth.canvas, sink, options.background)
    view.mark("draw")
    return Fragments(ids.drawn(), depth.drawn(), clustered.part, len(clusters.points), clusters.n_triangles)


def draw_cluster_samples(
    memory: Memory, mesh: ClusteredMesh, view: View, options: FragmentOptions, sink: Sink
) -> Fragments | None:
    """Draw a mesh in clusters into a plane a sample, one after the other; None as `draw_clusters` returns it."""
    (width, height), n = view.size, view.sampling.n_samples
    check_fits((n, height, width), np.int32, np.float32)
    samples = [(x, y) for x, y in sample_positions(n, view.grid_bits).tolist()]
    memory = MemoryOf(memory, "samples")
    ids, depth = planes_of(memory, view)
    bounds = memory.empty("bounds", engine.Target.bounds_shape(height, width), np.float32)
    for plane, z, sample in zip(ids, depth, samples, strict=True):
        target = engine.Target(sink, plane, z, None, bounds=bounds)
        if not mesh.draw(memory, target, sample):
            return None
    lay_background(ids, depth, sink, options.background)
    view.mark("draw")
    copy_planes(ids, depth, options)
    clusters = mesh.clusters
    parts = mesh.parts_of_samples(ids, samples)
    return Fragments.of_samples(ids, depth, parts, len(clusters.points), clusters.n_triangles)
