"""The table of costs: a field of `Costs` is a row, with its value, its unit, its meaning and where it was measured.

Choices follow from it (`choices.py`); no bit of a picture does. `docs/design/choices.md` derives the rows.
"""

# ruff: noqa: RUF009 (a row is a field with a value that cannot change)

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Numbers = tuple[float, ...]


def row(value: Any, unit: str, prices: str, scene: str) -> Any:
    """Return a row of the table; its scene tells where the value was found."""
    return field(default=value, metadata={"unit": unit, "prices": prices, "scene": scene})


STUDY = "python -m benchmarks choices"
STATIC = "python -m benchmarks static"
HD = "1920x1080, Zen 4"
RAPIDS = "1920x1080, Sapphire Rapids"


@dataclass(frozen=True, slots=True)
class Costs:
    """The costs of drawing, on the machines that the rows name."""

    # vertices, threads
    transform: float = row(1.797, "ns", "a float32 vertex, with a matrix and a divide", "200,000 vertices, Zen 4")
    wake: float = row(31_250.0, "ns", "waking another thread", "20 calls by two threads, Zen 4")
    thread_wakes: float = row(7.04, "wakes", "the least work of a thread: 0.22 ms", f"132 calls of {STUDY}")
    shared_item: float = row(1.1, "ns", "a vertex that is snapped or triangle that is converted, by two threads", STUDY)
    shared_setups: float = row(1_000_000, "triangles x threads", "to set up all in each thread, and not shares", STUDY)

    # the guess of the work of a draw: a row of a triangle, a covered sample, a pixel of the picture
    work_triangle: float = row(5.0, "ns", "a triangle", STUDY)
    work_bits: Numbers = row((4.0, 0.018, 0.014), "ns", "coverage", STUDY)
    work_counts: Numbers = row((6.0, 0.2, 0.3), "ns", "overdraw", STUDY)
    work_ids: Numbers = row((12.0, 0.4, 0.6), "ns", "ids and depth", STUDY)
    work_labels: Numbers = row((8.0, 0.1, 0.15), "ns", "ids alone", STUDY)
    work_area: Numbers = row((9.0, 0.0, 0.3), "ns", "areas", STUDY)
    near_row: float = row(4.0, "ns", "a row of a triangle at most, in a near cache", STUDY)
    near_pixel: float = row(0.15, "ns", "a pixel at most, in a near cache", STUDY)
    near_pixels: float = row(400_000, "pixels", "a picture that stays in a near cache while it is drawn", STUDY)

    # depth left out, bounds of depth, colours
    flat_call: float = row(12_000.0, "ns", "ids alone, then depth in a pass", "flat triangles of 8, 40, 400 px, Zen 4")
    flat_pixel: float = row(0.19, "ns", "a pixel of that pass", "the same")
    compared_sample: float = row(0.35, "ns", "a comparison of depths", "the same")
    compared_row: float = row(12.0, "ns", "a row of a triangle with them, beyond the near cache", "the same")
    bound_span: float = row(100.0, "pixels", "a row of a triangle, for bounds of depth to pay", f"40 frames, {HD}")
    bound_columns: float = row(256, "pixels", "a row of the picture, likewise", STUDY)
    bound_triangles: float = row(200_000, "triangles", "more are small where they show", STUDY)
    paint: float = row(0.375, "ns", "a pixel coloured from its label", f"fill and overdraw of 10 of 300 px, {HD}")
    direct_triangle: float = row(16.875, "ns", "a triangle seen, coloured as it comes, beyond labels", f"fill, {HD}")
    seen_pixel: float = row(0.45, "ns", "a pixel read to find which vertices show", f"render of 1e5 to 3e6, {HD}")

    # bands of rows that stay in a cache
    cleared_pixel: float = row(0.1, "ns", "saved: a pixel of ids and depth, cleared", RAPIDS)
    saved_row: float = row(5.0, "ns", "saved: a row of a triangle", "201 calls, 1024x768 to 3840x2160, Zen 3")
    saved_rows: float = row(
        4.3, "rows", "triangles, on the mean, for rows to be saved", "250,000 of 7, 400,000 of 5 px"
    )
    sorted_triangle: float = row(10.0, "ns", "sorting a triangle that is seen", RAPIDS)
    outside_triangle: float = row(4.0, "ns", "sorting one that is not", RAPIDS)
    blended_row: float = row(6.0, "ns", "saved: a row of a triangle, blended", "116 fills, 1024x768 to UHD, Zen 3")
    blended_pixel: float = row(0.1, "ns", "saved: a pixel met again", f"fill of 8 to 300 px, {HD}")
    blended_triangle: float = row(0.5, "ns", "a triangle looked at in a band", "the same")
    blended_vertex: float = row(1.1, "ns", "a vertex, likewise", "the same")
    blended_strip: float = row(1000.0, "ns", "by area, a triangle that reaches into a band", "the same")
    blend_bytes: float = row(768 << 10, "bytes", "a band of colours", "the same")
    plane_bytes: float = row(512 << 10, "bytes", "a band of ids and depth of one sample", STUDY)
    label_bytes: float = row(512 << 10, "bytes", "labels of all samples in a band", STUDY)
    label_planes: float = row(
        8 << 20, "bytes", "labels of all samples of a picture, past the cache", "fill by msaa4 and 8, 3 to 300 px"
    )
    label_pixels: float = row(1600.0, "pixels", "triangles, on the mean, that hide others row by row", "the same")
    area_bytes: float = row(1 << 20, "bytes", "cells of areas in a band", f"areas of 8 to 300 px, {RAPIDS}")
    area_triangle: float = row(36.0, "ns", "a triangle sorted into bands of areas", "the same")
    area_row: float = row(2.0, "ns", "saved: a row of a triangle in the nearer cache", "the same")
    area_pixel: float = row(
        0.2, "ns", "saved: a pixel summed in the nearer cache", "one triangle, 3840x2160: 2.3 ms, not 3.2"
    )

    # clusters, by (of how many triangles: fewer, the share outside without culling, with it)
    cluster_triangles: float = row(20_000, "triangles", "a mesh drawn again, for sorting to pay", STATIC)
    cluster_shaded: float = row(150_000, "triangles", "the same, where one call draws and shades it", "blobs, 512x512")
    cluster_instances: float = row(16, "instances", "one sorted before its first picture", STATIC)
    cluster_front: float = row(0.8, "share", "clusters that face the view, at most", STATIC)
    cluster_small: Numbers = row((60_000, 0.1, 0.6), "triangles, shares", "clusters outside, of small meshes", STATIC)
    cluster_middle: Numbers = row((1e6, 0.0, 0.33), "triangles, shares", "the same, of larger meshes", STATIC)
    banded_triangles: float = row(0.4, "triangles", "a pixel of a large picture, for clusters to pay", STATIC)
    inside_triangle: float = row(50, "pixels", "large: for a triangle beyond the near or far plane", STATIC)
    cluster_layers: Numbers = row((3.0, 2.0), "layers", "instances behind each other: at least; that are drawn", STATIC)
    cluster_scene: Numbers = row((0.1, 0.33), "shares", "clusters outside, of scenes: one sample, several", STATIC)
    cluster_drawn: float = row(120_000, "ns", "an instance that is drawn from clusters, beside its triangles", "balls")
    scene_triangles: float = row(6_000, "triangles", "an instance, for threads to share a scene", STATIC)
    scene_rows: float = row(8, "rows", "the same", STATIC)

    # several samples from clusters: triangles in view a pixel; triangles a sample or the share outside
    sampled_cluster: Numbers = row((0.06, 15_000, 0.1), "limits", "samples from clusters, both sides", STATIC)
    sampled_cluster_culled: Numbers = row((0.2, 1_500_000, 0.9), "limits", "the same, culled", STATIC)
    inside_samples: float = row(100, "samples", "for a triangle beyond the near or far plane, at most", "blobs, inside")
    inside_outside: float = row(0.7, "share", "clusters outside, likewise at least", "blobs, inside")

    @property
    def thread_ns(self) -> float:
        """The least work of a thread, a multiple of the time to wake it."""
        return self.thread_wakes * self.wake


_table = Costs()


def cost_table() -> Costs:
    """Return the costs in use."""
    return _table


def use_costs(costs: Costs) -> None:
    """Put costs in use in this process."""
    global _table
    _table = costs
