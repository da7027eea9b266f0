"""Choices, and the ways that a scene could be drawn instead: each draws the same bits, in another time.

A way forces a choice by `choices.forced`, or by an option that the verbs have.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any

import numpy as np

import topleft as tl
from benchmarks.choices.scenes import Scene
from benchmarks.harness.ways import Draw, Picture, Way, Ways, answers_of
from topleft._core.raster.costs import cost_table
from topleft._core.raster.view import View

MSAA = ("msaa2", "msaa4", "msaa8", "msaa16")
FAR_PX = 2**24
"""Beyond 2**30 sub-pixels with 8 bits: triangles there take 128 bits."""


def drawing(scene: Scene, **changes: Any) -> Draw:
    """Return the function that draws a scene on memory that is kept."""
    arrays = changes.pop("arrays", None) or scene.arrays
    draw, options = getattr(picture_of(scene.size), scene.verb), scene.asked(**changes)
    if scene.verb != "rasterize":
        extra = (scene.colors(),) if scene.verb == "fill" else ()
        return lambda: (draw(*arrays, *extra, **options),)

    def draw_ids() -> Picture:
        frags = draw(*arrays, **options)
        if scene.sampling == "center":
            return frags.triangle, frags.depth
        return frags.samples_triangle, frags.samples_depth

    return draw_ids


@lru_cache(maxsize=8)
def picture_of(size: tuple[int, int]) -> Any:
    """Return the one `Rasterizer` of a size: all ways draw into the same memory, wherever the system has put it."""
    return tl.Rasterizer(size)


def other_than(scene: Scene, name: str, names: Mapping[bool, str], **changes: Any) -> Ways:
    """Return the way that a yes or no is decided, and the other; one alone if it is not asked."""
    chosen = drawing(scene, **changes)
    answers = answers_of(name, chosen)
    if not answers:
        return []
    own, other = bool(answers[0]), not answers[0]
    return [Way(names[own], chosen), Way(names[other], drawing(scene, **changes), {name: other})]


def forcing(scene: Scene, name: str, values: Mapping[str, Any], **changes: Any) -> Ways:
    """Return the way with a choice or a cost as it is, and with others."""
    others = [Way(label, drawing(scene, **changes), {name: value}) for label, value in values.items()]
    return [Way("as it is", drawing(scene, **changes)), *others]


def of_method(scene: Scene) -> Ways:
    """Code by the size of each triangle, or one for all."""
    if scene.verb == "fill" or scene.sampling not in ("center", "msaa4"):
        return []
    return [Way(name, drawing(scene, method=name)) for name in ("auto", "edge", "scanline")]


def of_arithmetic(scene: Scene) -> Ways:
    """Lanes of 32 bits where they do, or 64 or 128 for all triangles."""
    if "transform" in scene.options or scene.verb == "fill" or scene.sampling != "center":
        return []
    vertices, triangles = scene.arrays
    near = np.array(vertices, np.float64)
    near[:, :2] = np.rint(near[:, :2] * 256) / 256
    away = near.copy()
    away[:, :2] += [FAR_PX, -FAR_PX]
    return [
        Way("by extent", drawing(scene, arrays=(near, triangles))),
        Way("64 bits", drawing(scene, arrays=(near, triangles), method="scanline")),
        Way("128 bits", drawing(scene, arrays=(away, triangles), origin=(FAR_PX, -FAR_PX))),
    ]


def of_bands(scene: Scene) -> Ways:
    """Bytes of a band of rows in which several samples are drawn."""
    if scene.sampling not in MSAA or scene.verb not in ("rasterize", "fill"):
        return []
    name = "plane_bytes" if scene.verb == "rasterize" else "label_bytes"
    sizes = {f"{kib} KiB": kib << 10 for kib in (128, 256, 1024, 4096)}
    return forcing(scene, name, sizes)


def of_blended_bands(scene: Scene) -> Ways:
    """Colours in bands of rows that stay in the cache, where that is said to pay, or all rows at once, or always so."""
    if scene.verb != "fill" or scene.sampling not in ("center", "area"):
        return []

    def whole(view: View, *_: Any, **__: Any) -> int:
        return view.size[1]

    def bands(_view: View, _snapped: Any, row_bytes: int, **__: Any) -> int:
        return max(1, int(cost_table().blend_bytes) // row_bytes)

    return forcing(scene, "rows_to_blend", {"at once": whole, "in bands": bands})


def of_threads(scene: Scene) -> Ways:
    """As many threads as are said to pay, or one, or two."""
    if scene.sampling not in ("center", "area") or scene.verb == "overdraw":
        return []
    chosen, two = drawing(scene, threads=None), {"available_threads": 2}
    found = answers_of("threads_to_draw", chosen, **two)[0]
    names = {1: "1 thread", 2: "2 threads"}
    return [Way(names[found], chosen, two), Way(names[3 - found], drawing(scene, threads=3 - found))]


#: Choices of yes or no: the function that decides, what it says with yes and with no, and the number of threads.
SWITCHES: dict[str, tuple[str, str, str, int]] = {
    "depth test": ("pays_without_depth", "ids alone", "compared", 1),  # where every vertex lies at one depth
    "colours": ("is_direct", "as they come", "labels first", 1),
    "planes": ("can_slice", "bands", "a picture each", 1),  # samples of ids
    "sorting": ("pays_to_sort", "sorted", "as they come", 1),  # into bands of rows
    "shares": ("is_sliced", "shares", "bands", 2),  # of two threads
    "threads of arrays": ("pays_to_share", "both", "one", 2),  # which read vertices and indices
}


def is_switched(choice: str, scene: Scene) -> bool:
    """Whether a scene asks for a choice of `SWITCHES`."""
    is_center, verb = scene.sampling == "center", scene.verb
    if choice == "planes":
        return verb in ("rasterize", "fill") and scene.sampling in MSAA
    asks = {
        "depth test": (scene.kind == "flat z" or len(scene.arrays[0]) == 3) and verb == "rasterize" and scene.has_depth,
        "colours": verb == "fill",
        "sorting": verb in ("rasterize", "overdraw"),
        "shares": verb != "fill",
        "threads of arrays": verb == "coverage",
    }
    return is_center and asks[choice]


def of_switch(choice: str, scene: Scene) -> Ways:
    """Both answers to yes or no."""
    name, yes, no, threads = SWITCHES[choice]
    options = {"threads": threads} if threads > 1 else {}
    return other_than(scene, name, {True: yes, False: no}, **options) if is_switched(choice, scene) else []


CHOICES: Mapping[str, Callable[[Scene], Ways]] = {
    "method": of_method,
    "arithmetic": of_arithmetic,
    "depth test": partial(of_switch, "depth test"),
    "colours": partial(of_switch, "colours"),
    "planes": partial(of_switch, "planes"),
    "band size": of_bands,
    "sorting": partial(of_switch, "sorting"),
    "bands of colours": of_blended_bands,
    "threads": of_threads,
    "shares": partial(of_switch, "shares"),
    "threads of arrays": partial(of_switch, "threads of arrays"),
}
"""By name: the ways to draw a scene."""

THREADED = ("threads", "shares", "threads of arrays")
"""Choices between numbers of threads: their time is that which passes, not that of a thread."""
