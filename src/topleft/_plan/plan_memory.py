"""The bytes that a call needs, told before it runs: each name that the pipeline asks `Memory` for."""

from __future__ import annotations

from topleft import _engine
from topleft._base.options import Sampling, Sink
from topleft._plan.plan_facts import Facts
from topleft._raster import choices

__all__ = ["memory_of"]


def memory_of(facts: Facts) -> tuple[dict[str, int], dict[str, int]]:
    """Return the bytes of scratch, which is kept from call to call, and of results, by name.

    What only the data can tell comes on top: a table of vertices beyond 2**30 sub-pixels, 16 bytes a vertex; the pieces
    of cut triangles, about 100 bytes each; with several samples a pixel, triangles in several bands of rows.
    """
    view, n = facts.view, facts.n_triangles
    width, height = view.size
    n_pixels, n_samples = width * height, view.sampling.n_samples
    is_empty = n_pixels == 0
    scratch = {"records": 0 if is_empty or not n else _engine.VERTEX_BYTES * facts.n_vertices}
    if facts.index_dtype not in ("int32", "uint32"):
        scratch["triangles"] = 12 * n
    results = result_bytes(facts)
    if facts.sink in (Sink.MASK, Sink.SAMPLES) and not is_empty:
        scratch["covered"] = 8 * height * _engine.Target.covered_shape(height, width, n_samples)[1]
    if view.sampling is Sampling.AREA:
        strips = facts.n_threads * _engine.blend_cells(width)
        scratch["cells"] = 4 * (strips if facts.verb == "fill" else height * _engine.area_stride(width))
    elif facts.verb == "fill" and n_samples == 1 and n and not facts.is_direct:
        scratch["labels"] = 4 * n_pixels
    elif facts.draws_planes and not is_empty and n and choices.can_share(view):
        scratch["bins"] = 12 * (n + 16)
        scratch["bands"] = 4 * (n + 1)
    found = facts.clusters
    if found is not None and found.clusters is not None:  # the records are not needed, unless a plane cuts
        scratch["records"] = 0 if not facts.n_clipped else scratch["records"]
        scratch["clusters"] = 12 * len(found.clusters) + 4 * facts.n_threads * n + found.clusters.n_bytes
    elif facts.is_shared:
        scratch["others"] = 4 * (n + 16 * facts.n_threads)
    return scratch, results


def result_bytes(facts: Facts) -> dict[str, int]:
    """Return the bytes of what the verb returns; colours have four bytes a pixel."""
    width, height = facts.view.size
    n_pixels, n_samples = width * height, facts.view.sampling.n_samples
    many = facts.view.sampling is Sampling.AREA or n_samples > 1
    if facts.verb == "rasterize":
        return {"triangle": 4 * n_pixels * n_samples, "depth": 4 * n_pixels * n_samples}
    if facts.verb == "fill":
        planes = {"sample labels": 4 * n_pixels * n_samples} if n_samples > 1 else {}
        return {"color": 4 * n_pixels, **planes}
    if facts.verb == "overdraw":
        return {"overdraw": 4 * n_pixels * n_samples}
    return {"coverage": (4 if many else 1) * n_pixels}
