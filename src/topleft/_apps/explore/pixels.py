"""Draws the part Pixels: a state becomes pictures, their differences, times and the plan."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft import coverage, fill, overdraw, plan, rasterize, wireframe
from topleft._apps.explore.content import scene
from topleft._apps.explore.session import Reply, Request, Session
from topleft._apps.explore.state import PixelState, parse_state
from topleft.methods import CLASSICS, METHODS
from topleft.methods.reference import area, sampling
from topleft.methods.reference.integers import ExactPicture

EXACT = "exact"
"""The name of the exact picture where others are those of methods."""

COLORS = np.array(
    [[0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [240, 228, 66]],
    np.uint8,
)
"""Of triangles, told apart by the colour-blind: M. Okabe, K. Ito, Color Universal Design, 2008, without its black."""

HEAT = np.array(
    [[0, 0, 0, 0], [158, 202, 225, 255], [230, 159, 0, 255], [213, 94, 0, 255], [122, 31, 92, 255]], np.uint8
)
"""Of 0, 1, 2, 3, and more triangles on a pixel."""

DIFFERENCES = np.array(
    [[0, 0, 0, 0], [128, 128, 128, 70], [94, 60, 153, 255], [166, 206, 57, 255], [190, 20, 60, 255], [44, 44, 52, 255]],
    np.uint8,
)
"""Of nothing, the same, the first alone, the second alone, another owner, another count; none is one of a triangle."""

INK = (60, 72, 88, 255)

MAX_EXACT_SAMPLES, MAX_EXACT_DEPTHS = 50_000_000, 50_000
"""Samples in the boxes of triangles, and covered ones with a depth, of the exact picture: two or three seconds."""

MAX_SLOW_TESTS = 6000
"""Pixels times triangles of what the reference alone can draw: areas and conservative coverage, about half a second."""


AREA_ERROR = np.float32(2**-20)
"""Areas that differ by less are the same: those of the library are within 9e-8 of the exact ones."""

REPEATED_SECONDS = 0.05
"""A call that takes less is timed the second time: the first one imports kernels and touches memory."""


@dataclass(frozen=True)
class MethodPicture:
    """What one method draws of a state."""

    owners: NDArray[np.int32]  # (H, W, S): the triangle of each sample, -1 for none; 0 where only coverage is known
    counts: NDArray[Any]  # (H, W, S): how many triangles cover it; with areas, their sum
    shares: NDArray[np.float32]  # (H, W): how much of each pixel is covered
    seconds: float  # of the call that says who owns each sample, or how much is covered
    notes: list[str] = field(default_factory=list)  # options that the method does not have


def draw(state: PixelState, method: str) -> MethodPicture:
    """Return what a method draws, `EXACT` for the exact picture."""
    if method == EXACT:
        return draw_reference(state)
    options = state.options(method)
    sampled = options.get("sampling", "center")
    given = (state.vertices, state.triangles, state.size)
    shown, seconds = timed(lambda: call(state, method, options))
    counts = shown.astype(np.int32) if state.look == "wireframe" else overdraw(*given, **options)
    notes = state.lacks(method)
    if state.look == "wireframe" or sampled in ("area", "outer", "inner"):
        owners = np.where(shown > 0, 0, -1).astype(np.int32)[..., None]
        return MethodPicture(owners, counts[..., None], shown.astype(np.float32), seconds, notes)
    owners = shown.reshape(*shown.shape[:2], -1).astype(np.int32)
    return MethodPicture(owners, counts.reshape(owners.shape), share_of(owners), seconds, notes)


def call(state: PixelState, method: str, options: dict[str, Any]) -> NDArray[Any]:
    """Return owners, or coverage, by one call of the library."""
    given = (state.vertices, state.triangles, state.size)
    if state.look == "wireframe":
        return wireframe(*given, origin=state.origin)
    if options.get("sampling") in ("area", "outer", "inner"):
        return coverage(*given, **options)
    if method in CLASSICS:
        numbers = np.arange(len(state.triangles), dtype=np.float32)[:, None]
        return fill(state.vertices, state.triangles, numbers, state.size, background=[-1.0], **options)
    frags = rasterize(*given, depth_test=state.depth_test, **options)
    return frags.samples_triangle if "sampling" in options else frags.triangle


def timed(work: Callable[[], NDArray[Any]]) -> tuple[NDArray[Any], float]:
    """Return a result and the seconds that it took; the second time of two where that is short."""
    start = time.perf_counter()
    result = work()
    seconds = time.perf_counter() - start
    if seconds > REPEATED_SECONDS:
        return result, seconds
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def draw_reference(state: PixelState) -> MethodPicture:
    """Return the exact picture: of vertices as they are; of areas and squares with the sub-pixel bits asked for."""
    height, width = state.size[::-1]
    start = time.perf_counter()
    if state.sampling in ("area", "outer", "inner"):
        if height * width * max(1, len(state.triangles)) > MAX_SLOW_TESTS:
            raise ValueError(f"the exact picture of {state.sampling!r} takes too long here: make the window smaller")
        verb = {"area": area.area, "outer": sampling.outer, "inner": sampling.inner}[state.sampling]
        bits = 8 if (state.sampling, state.subpixel_bits) == ("area", "exact") else state.subpixel_bits
        options: dict[str, Any] = {"origin": state.origin, "subpixel_bits": bits, "cull": state.cull}
        shares = verb(state.vertices, state.triangles, state.size, **options).astype(np.float32)
        seconds = time.perf_counter() - start
        shares = np.minimum(shares, np.float32(1))
        owners = np.where(shares > 0, 0, -1).astype(np.int32)[..., None]
        counts = (shares > 0).astype(np.int32)
        if state.sampling != "area":  # how many triangles have the pixel
            each = (verb(state.vertices, row[None], state.size, **options) for row in state.triangles)
            counts = sum((own.astype(np.int32) for own in each), np.zeros_like(counts))
        return MethodPicture(owners, counts[..., None], shares, seconds)
    n = int(state.sampling.removeprefix("msaa")) if state.sampling != "center" else 1
    positions = sampling.SAMPLE_POSITIONS[n]
    n_samples = n * int(overdraw(state.vertices, state.triangles, state.size, origin=state.origin).sum())
    corners = state.vertices[state.triangles, :2] - state.origin
    low, high = (np.clip(ends, 0, state.size) for ends in (corners.min(axis=1), corners.max(axis=1)))
    n_in_boxes = n * (high - low + 1).prod(axis=1).sum()
    if n_in_boxes > MAX_EXACT_SAMPLES or (state.has_depth and n_samples > MAX_EXACT_DEPTHS):
        raise ValueError("the exact picture takes too long here: make the window smaller, or take fewer triangles")

    def both() -> NDArray[np.int32]:
        given = (state.vertices, state.triangles, state.size)
        options: dict[str, Any] = {"origin": state.origin, "cull": state.cull, "depth_tests": (depth_test,)}
        pictures = [ExactPicture(*given, sample=at, **options) for at in positions]
        return np.stack([np.stack([one.triangle, one.count]) for one in pictures], axis=-1)

    depth_test = state.depth_test if state.has_depth else None
    (owners, counts), seconds = timed(both)
    return MethodPicture(owners, counts, share_of(owners), seconds)


def share_of(owners: NDArray[np.int32]) -> NDArray[np.float32]:
    """How many of the samples of each pixel are covered."""
    return np.asarray((owners >= 0).mean(axis=2, dtype=np.float32))


# Pictures


def triangle_colors(n: int) -> NDArray[np.uint8]:
    """Colours (n, 3) of triangles: seven, then the same paler, then darker."""
    k = np.arange(n)
    colors = COLORS[k % 7].astype(np.int32)
    paler, darker = (colors + 255) // 2, colors * 2 // 3
    turn = (k // 7 % 3)[:, None]
    return np.where(turn == 0, colors, np.where(turn == 1, paler, darker)).astype(np.uint8)


def picture(state: PixelState, drawing: MethodPicture) -> NDArray[np.uint8]:
    """Return a picture (H, W, 4): owners in colours, or how often pixels are drawn; nothing is transparent."""
    if state.look == "overdraw":
        most = drawing.counts.max(axis=2)
        return HEAT[np.clip(np.ceil(most), 0, len(HEAT) - 1).astype(np.intp)]
    is_owned = drawing.owners >= 0
    if state.look == "wireframe" or state.sampling in ("area", "outer", "inner"):
        shown = np.empty((*drawing.shares.shape, 4), np.uint8)
        shown[:] = INK if state.look == "wireframe" else (*COLORS[0].tolist(), 255)
        shown[..., 3] = np.rint(255 * np.clip(drawing.shares, 0, 1))
        return shown
    colors = triangle_colors(max(1, len(state.triangles))).astype(np.float32)
    summed = np.where(is_owned[..., None], colors[np.maximum(drawing.owners, 0)], 0).sum(axis=2)
    n = is_owned.sum(axis=2, keepdims=True)
    shown = np.zeros((*n.shape[:2], 4), np.uint8)
    shown[..., :3] = np.rint(summed / np.maximum(n, 1))
    shown[..., 3] = np.rint(255 * n[..., 0] / drawing.owners.shape[2])
    return shown


def difference(one: MethodPicture, two: MethodPicture) -> NDArray[np.uint8]:
    """Return where two drawings differ: (H, W) of the rows of `DIFFERENCES`."""
    n = max(one.owners.shape[2], two.owners.shape[2])
    owners, others = (np.broadcast_to(d.owners, (*d.owners.shape[:2], n)) for d in (one, two))
    is_more, is_less = one.shares > two.shares + AREA_ERROR, one.shares + AREA_ERROR < two.shares
    is_same = (owners == others).all(axis=2)
    is_same_count = (np.ceil(one.counts).max(axis=2) == np.ceil(two.counts).max(axis=2)) | (one.shares == 0)
    kind = np.where(is_more, 2, np.where(is_less, 3, np.where(is_same, np.where(is_same_count, 1, 5), 4)))
    return np.where((kind == 1) & (one.shares == 0), 0, kind).astype(np.uint8)


# What the page asks


def draw_all(session: Session, request: Request) -> Reply:
    """Return the pictures of a state: of its methods, the exact one, and where they differ."""
    state = parse_state(request.get("state"))
    session.content.moved = state.vertices
    names = {"a": state.method}
    if state.look != "wireframe":
        names |= ({"b": state.other} if state.other else {}) | ({"exact": EXACT} if state.exact else {})
    arrays: dict[str, NDArray[Any] | bytes] = {}
    panels: dict[str, dict[str, Any]] = {}
    drawings: dict[str, MethodPicture] = {}
    for key, method in names.items():
        panels[key] = panel(key, "wireframe" if state.look == "wireframe" else method)
        try:
            drawings[key] = draw(state, method)
        except ValueError as error:  # a limit of a classic: the other pictures are drawn
            panels[key]["refused"] = str(error)
            continue
        panels[key] |= described(drawings[key], state)
        arrays[key] = picture(state, drawings[key])
        arrays[f"{key}_owners"] = drawings[key].owners[..., 0]
        arrays[f"{key}_counts"] = np.ceil(drawings[key].counts).max(axis=2).astype(np.int32)
        if key == EXACT:
            for other in drawings.keys() - {EXACT}:
                told = np.bincount(difference(drawings[other], drawings[EXACT]).reshape(-1), minlength=len(DIFFERENCES))
                panels[other]["n_wrong"] = n = int(told[2:].sum())
                panels[other]["facts"].append(wrong_of(told.tolist()) if n else ["all exact", "good", WRONG])
    pair = list(drawings)[:2]
    if len(pair) == 2:
        kinds = difference(drawings[pair[0]], drawings[pair[1]])
        arrays["difference"] = DIFFERENCES[kinds]
        panels["difference"] = panel("difference", "difference") | compared(kinds, [names[key] for key in pair])
    return Reply({"panels": list(panels.values()), "samples": samples_of(state)}, arrays)


WRONG = "beside the exact picture of the vertices as they are: each pixel counts once"


def wrong_of(told: list[int]) -> list[str]:
    """How many pixels are wrong, of each kind; the kinds add up."""
    words = ("", "", "too many", "missing", "of another triangle", "drawn too often")
    kinds = ", ".join(f"{n:,} {word}" for n, word in zip(told, words, strict=True) if word and n)
    return [f"{sum(told[2:]):,} wrong: {kinds}", "bad", WRONG]


def panel(key: str, title: str) -> dict[str, Any]:
    """What the page shows of a picture: its name, what is written over and below it, or why there is none."""
    return {"key": key, "title": title, "notes": "", "facts": [], "legend": [], "refused": ""}


def described(drawing: MethodPicture, state: PixelState) -> dict[str, Any]:
    """What is written over and below a picture."""
    ms, n = 1e3 * drawing.seconds, int((drawing.shares > 0).sum())
    n_twice = int((np.ceil(drawing.counts).max(axis=2) > 1).sum())
    facts = [
        [f"{n:,} px", "n", "pixels that are drawn at least once"],
        [f"{ms:.1f} ms" if ms >= 1 else f"{1e3 * ms:.0f} \N{MICRO SIGN}s", "n", "of the call that draws it"],
    ]
    words = ("once", "twice", "3 times", "4 or more")
    legend = list(zip(map(css, HEAT[1:]), words, strict=True)) if state.look == "overdraw" else []
    return {
        "n": n,
        "n_twice": n_twice,
        "notes": ", ".join(drawing.notes),
        "facts": facts
        + ([[f"{n_twice:,} of them more than once", "n", "drawn for several triangles"]] if n_twice else []),
        "legend": legend,
    }


def compared(kinds: NDArray[np.uint8], names: list[str]) -> dict[str, Any]:
    """What is written over and below a difference."""
    told = np.bincount(kinds.reshape(-1), minlength=len(DIFFERENCES)).tolist()
    words = ("", "same", f"{names[0]} alone", f"{names[1]} alone", "another owner", "drawn more often")
    n = sum(told[2:])
    legend = [[css(DIFFERENCES[k]), f"{told[k]:,} {words[k]}"] for k in range(1, len(told)) if told[k]]
    facts = [
        [f"{n:,} of {sum(told[1:]):,} pixels differ", "bad" if n else "good", "of those that either of them draws"]
    ]
    return {"kinds": told, "facts": facts, "legend": legend}


def css(color: NDArray[np.uint8]) -> str:
    """A colour as style sheets write it."""
    return "#" + "".join(f"{channel:02x}" for channel in color.tolist())


def samples_of(state: PixelState) -> list[list[float]]:
    """Where samples lie in each pixel, 0 to 1; none for areas and squares."""
    if state.sampling in ("area", "outer", "inner"):
        return []
    n = int(state.sampling.removeprefix("msaa")) if state.sampling != "center" else 1
    return [[0.5 + x / 16, 0.5 + y / 16] for x, y in sampling.SAMPLE_POSITIONS[n]]


def explain(_: Session, request: Request) -> Reply:
    """Return the plan of what the first method draws, in words."""
    state = parse_state(request.get("state"))
    options = state.options(state.method)
    if state.method in CLASSICS:
        classic = CLASSICS[state.method]
        return Reply({"text": f"{classic.name}: {classic.summary}.\n{classic.source}.\n\nA classic needs no plan."})
    outputs = "coverage" if options.get("sampling") in ("area", "outer", "inner") else "triangle"
    found = plan(state.vertices, state.triangles, state.size, outputs=outputs, **options)
    return Reply({"text": found.explain()})


def take_scene(_: Session, request: Request) -> Reply:
    """Return a named scene as a state."""
    return Reply({"state": scene(str(request.get("name")))})


def methods() -> list[dict[str, Any]]:
    """All methods, as the page lists them."""
    return [
        {"name": one.name, "summary": one.summary, "source": one.source, "is_classic": one.name in CLASSICS}
        for one in (*METHODS.values(), *CLASSICS.values())
    ]


HANDLERS = {"pixels.draw": draw_all, "pixels.plan": explain, "pixels.scene": take_scene}
