"""What clusters do for a view of a mesh, counted before the plan is told: how many are left out, and by which test."""

from __future__ import annotations

from dataclasses import dataclass

from topleft._base.options import DepthTest, Sampling
from topleft._model.mesh import Mesh
from topleft._raster import choices
from topleft._raster.cluster_draw import ClusteredMesh
from topleft._raster.clusters import Clusters
from topleft._raster.view import View

__all__ = ["ClusterFacts", "find_cluster_facts"]


@dataclass(frozen=True, slots=True)
class ClusterFacts:
    """How the clusters of a mesh fare in a view.

    Attributes
    ----------
    clusters : Clusters or None
        What is drawn from; None when the mesh is drawn whole.
    why_not : str
        Why it is.
    n_outside, n_turned, n_hidden, n_drawn : int
        Clusters outside of the picture, turned away, hidden, and drawn.
    """

    clusters: Clusters | None
    why_not: str = ""
    n_outside: int = 0
    n_turned: int = 0
    n_hidden: int = 0
    n_drawn: int = 0


def find_cluster_facts(mesh: Mesh, view: View, verb: str, test: DepthTest | None) -> ClusterFacts:
    """Return what `rasterize_mesh` does from the second picture of a mesh on; clusters are made for it if need be."""
    n_triangles = len(mesh.triangles)
    if verb != "rasterize":
        return ClusterFacts(None, f"{verb} draws arrays, which may change")
    if view.sampling is not Sampling.CENTER:
        return ClusterFacts(None, "with several samples a pixel, bands of rows are drawn, a sample after the other")
    sink = choices.fragment_sink(test, has_depth=True)
    if not choices.can_cluster(view, sink):
        return ClusterFacts(None, "the order of the triangles matters, or the window lies too far off")
    if not choices.pays_to_cluster(n_triangles, 1):
        return ClusterFacts(None, f"{n_triangles:,} triangles are done before sorting them would pay")
    clusters = mesh.clusters
    seen = ClusteredMesh(clusters, view)
    if not choices.pays_to_draw_clusters(view, n_triangles, seen.survey):
        return ClusterFacts(None, "most of the mesh shows, and drawing that cluster by cluster takes longer")
    n, found = len(clusters), seen.survey(len(clusters))
    n_outside, n_turned, n_drawn = round(found.outside * n), round(found.turned * n), seen.count_drawn(sink)
    return ClusterFacts(clusters, "", n_outside, n_turned, n - n_outside - n_turned - n_drawn, n_drawn)
