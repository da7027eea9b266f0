"""Draws for the page: the triangles that methods show, counts of coverage, times, and the steps of a method.

In: a request of page/engine.js, its numbers as bytes. Out: arrays. In a page without Python a worker with the kernels
in WebAssembly answers these requests with equal arrays (page/local.js).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from topleft import coverage, fill, overdraw, rasterize, wireframe
from topleft._apps.explore.content import MAX_SIDE_PX
from topleft._apps.explore.session import Reply, Request, Session
from topleft._core.base.arrays import as_size
from topleft.methods import CLASSICS, METHODS, find_method
from topleft.methods.classics import classic_kernels

MAX_DRAWN = 1 << 18
"""The most triangles of a drawing, with their copies."""

MAX_STEPS = 40_000
"""The most steps of a trace: 10 MB to send to the page."""

MAX_SUBPIXELS = 2**60
"""The bound of vertices that are traced: sums of products of their coordinates have 128 bits."""

HEAD_WORDS, MOST_WORDS = 6, 24
"""Words of a step before its numbers, and with them; the set-up of a triangle has up to twice as many."""


@dataclass(frozen=True)
class MethodDrawing:
    """Triangles in pixels, a window, and the method that draws them."""

    vertices: NDArray[np.float64]  # (V, 2) or (V, 3)
    triangles: NDArray[np.int32]  # (T, 3)
    size: tuple[int, int]
    options: dict[str, Any]  # origin, method, subpixel_bits, sampling and cull, as for `rasterize`
    depth_test: Any = "less"
    is_wireframe: bool = False

    @property
    def is_coverage(self) -> bool:
        """Whether a picture of the drawing holds only coverage."""
        return self.options.get("sampling") in ("area", "outer", "inner")

    def count(self) -> NDArray[Any]:
        """Return how many triangles cover each pixel or sample; with areas, the sum of the covered areas."""
        return overdraw(self.vertices, self.triangles, self.size, **self.options)

    def show(self) -> NDArray[Any]:
        """Return the triangle that each sample shows, -1 for none; or coverage, or lines."""
        if self.is_wireframe:
            return wireframe(self.vertices, self.triangles, self.size, origin=self.options["origin"])
        if self.is_coverage:
            return coverage(self.vertices, self.triangles, self.size, **self.options)
        if self.options["method"] in CLASSICS:
            numbers = np.arange(len(self.triangles), dtype=np.float32)[:, None]
            return fill(self.vertices, self.triangles, numbers, self.size, background=[-1.0], **self.options)
        frags = rasterize(self.vertices, self.triangles, self.size, depth_test=self.depth_test, **self.options)
        return frags.samples_triangle

    def draw(self) -> tuple[NDArray[Any], NDArray[Any], float]:
        """Return `show` as int32, or float32 for coverage and lines; `count`; and the seconds of `show`."""
        counts = self.show() if self.is_wireframe else self.count()  # the first call imports kernels, touches memory
        start = time.perf_counter()
        shown = self.show()
        seconds = time.perf_counter() - start
        kind = np.float32 if self.is_wireframe or self.is_coverage else np.int32
        return shown.astype(kind), counts.astype(np.float32 if counts.dtype.kind == "f" else np.int32), seconds


def drawings_of(request: Request) -> list[MethodDrawing]:
    """Return the drawings of a request; `triangles` of each of its `drawings` is the index of a part of the request."""
    size = as_size(request["size"], smallest=1)
    if max(size) > MAX_SIDE_PX:
        raise ValueError(f"size must be at most {MAX_SIDE_PX} pixels a side, got {size}")
    x, y = map(int, request["origin"])  # written as text: numbers of a page end at 2**53
    copies = int(request.get("copies", 1))
    vertices = part_of(request, 0, np.float64, request["n_components"])
    drawings = []
    for spec in request["drawings"]:
        triangles = part_of(request, spec["triangles"], np.int32, 3)
        if not 0 <= copies * len(triangles) <= MAX_DRAWN:
            raise ValueError(f"at most {MAX_DRAWN} triangles are drawn, got {copies} times {len(triangles)}")
        options = {name: spec[name] for name in ("method", "subpixel_bits", "sampling", "cull") if name in spec}
        drawings.append(
            MethodDrawing(
                vertices, np.tile(triangles, (copies, 1)), size, {"origin": (x, y), "method": "auto"} | options,
                spec.get("depth_test", "less"), bool(spec.get("is_wireframe", False)),
            )
        )  # fmt: skip
    return drawings


def part_of(request: Request, i: int, kind: DTypeLike, n_columns: int) -> NDArray[Any]:
    """Return a copy of the rows of numbers in a part of a request."""
    return np.frombuffer(request["parts"][i], kind).reshape(-1, n_columns).copy()


def draw(_: Session, request: Request) -> Reply:
    """Answer the page: `shown` and `counts` of each drawing by its number, or the error of its method."""
    drawn: list[dict[str, Any]] = []
    arrays: dict[str, NDArray[Any] | bytes] = {}
    for i, drawing in enumerate(drawings_of(request)):
        try:
            arrays[f"shown{i}"], arrays[f"counts{i}"], seconds = drawing.draw()
        except ValueError as error:  # a limit of a classic: the other pictures are drawn
            drawn.append({"refused": str(error)})
        else:
            drawn.append({"seconds": seconds})
    return Reply({"drawings": drawn}, arrays)


def trace(_: Session, request: Request) -> Reply:
    """Answer the page: how many steps a method takes, their words in the format of steps.h, and counts."""
    (drawing,) = drawings_of(request)
    (x, y), method = drawing.options["origin"], find_method(drawing.options["method"])
    if method.name == "auto":
        raise ValueError("method must be a walker or a classic to be traced, got 'auto'")
    drawing.count()  # checks it all
    xy, bits = np.ascontiguousarray(drawing.vertices[:, :2]), drawing.options.get("subpixel_bits", 8)
    if method.name in METHODS and (far := abs(xy[drawing.triangles]).max(initial=0) * 2.0**bits) >= MAX_SUBPIXELS:
        raise ValueError(f"vertices must lie within 2**60 sub-pixels of 0 to be traced, got {far:.6g}")
    counts = np.zeros(drawing.size[::-1], np.int32)
    words = np.empty(MOST_WORDS * (MAX_STEPS + len(drawing.triangles)), np.int64)
    n = classic_kernels.trace(method.name, xy, drawing.triangles, counts, (x, y, *drawing.size), words, bits)
    if n > MAX_STEPS:
        raise ValueError(f"a trace must have {MAX_STEPS} steps at most: draw fewer triangles, or a smaller picture")
    lengths = [HEAD_WORDS + 2 * sum(n for _, n in numbers) for *_, numbers in classic_kernels.list_kinds()]
    end = 0
    for _step in range(n):
        end += lengths[words[end]]
    return Reply({"n": n}, {"counts": counts, "words": words[:end]})


HANDLERS = {"engine.draw": draw, "engine.trace": trace}
