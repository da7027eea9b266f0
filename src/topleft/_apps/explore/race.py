"""Draws the atlas live: a family of scenes, its parameter under a slider, and where each method is wrong.

In: the name of a family, where its sliders stand, a seed. Out: a picture of faults of each method, counts, and a column
of the chart of the atlas at a time. `benchmarks/atlas` draws its record with the same entries, over more seeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft import fill, overdraw
from topleft._apps.explore.session import Reply, Request, Session
from topleft.methods import CLASSICS, find_method
from topleft.methods.reference.integers import ExactPicture, snapped, turns
from topleft.scene_families import FAMILIES, Axis, PixelScene

NO_SNAP = "exact"

PRODUCTION: dict[str, tuple[str, int | str]] = {
    "auto": ("auto", 8), "edge": ("edge", 8), "scanline": ("scanline", 8),
    "auto, 0 bits": ("auto", 0), "auto, 16 bits": ("auto", 16), "auto, exact": ("auto", NO_SNAP),
}  # fmt: skip
"""The engine's rows: method and sub-pixel bits, or NO_SNAP."""


class FaultyPixels(NamedTuple):
    """Where a picture is wrong, (H, W) bool each: another triangle shows; drawn less or more often than it should."""

    wrong: NDArray[np.bool_]
    gaps: NDArray[np.bool_]
    overdrawn: NDArray[np.bool_]


@dataclass(frozen=True)
class Entry:
    """A row of the atlas: a method at a precision, or the engine with another sampling."""

    name: str
    method: str
    bits: int | str = 8
    sampling: str = "center"

    @property
    def snap(self) -> str:
        """What the method makes of vertices first, as `snapped` calls it."""
        method = find_method(self.method)
        if self.bits == NO_SNAP:
            return NO_SNAP
        if method.code is not None or method.has_subpixel_bits:
            return str(self.bits)
        if method.claims.integer_vertices:
            return "px"
        return NO_SNAP if self.method.endswith("float64") else "float32"

    @property
    def rule(self) -> str:
        """Which edges own the centres on them."""
        return "bottom-right" if self.method.endswith("bottom-right") else "top-left"

    def options(self) -> dict[str, Any]:
        """Arguments of the verbs."""
        options: dict[str, Any] = {"method": self.method}
        if self.snap.isdigit() or self.bits == NO_SNAP:
            options["subpixel_bits"] = self.bits
        return options | ({} if self.sampling == "center" else {"sampling": self.sampling})

    def orient(self, scene: PixelScene) -> PixelScene:
        """Return the scene with the winding that the method draws; no change if it draws either."""
        winding = find_method(self.method).claims.winding
        if winding == "either":
            return scene
        is_clockwise = turns(snapped(scene.vertices, self.snap)[scene.triangles]) > 0
        is_wrong = is_clockwise != (winding == "clockwise")
        return scene._replace(triangles=np.where(is_wrong[:, None], scene.triangles[:, ::-1], scene.triangles))


def entries() -> list[Entry]:
    """Every way to fill: the engine at three precisions, by both walkers and without a snap, every classic."""
    production = [Entry(name, *what) for name, what in PRODUCTION.items()]
    return production + [Entry(name, name) for name in CLASSICS if not name.endswith("/wireframe")]


def draw_counts(entry: Entry, scene: PixelScene) -> NDArray[Any]:
    """Return how often the method draws each pixel; of several samples the first one that is not the common count."""
    counts = overdraw(
        scene.vertices, entry.orient(scene).drawn(), scene.size, origin=scene.origin, threads=1, **entry.options()
    )
    if counts.ndim == 2:
        return counts
    return np.where((counts == counts[..., :1]).all(axis=-1), counts[..., 0], -1)


def draw_labels(entry: Entry, scene: PixelScene) -> NDArray[np.int32]:
    """Return the triangle that shows in each pixel in painter's order, -1 for none."""
    triangles = entry.orient(scene).drawn()
    return fill(
        scene.vertices, triangles, np.arange(len(triangles), dtype=np.float32), scene.size, per="triangle",
        background=-1, origin=scene.origin, threads=1, **entry.options(),
    ).astype(np.int32)  # fmt: skip


class Exact:
    """Exact pictures of a scene, each drawn once."""

    def __init__(self, scene: PixelScene) -> None:
        self.scene = scene
        self.pictures: dict[tuple[str, str], ExactPicture] = {}

    def picture(self, snap: str = NO_SNAP, rule: str = "top-left") -> ExactPicture:
        """Return the picture of one copy after a snap."""
        if (snap, rule) not in self.pictures:
            scene = self.scene
            vertices = snapped(scene.vertices, snap)
            picture = ExactPicture(vertices, scene.triangles, scene.size, origin=scene.origin, rule=rule)
            self.pictures[snap, rule] = picture
        return self.pictures[snap, rule]

    def labels(self) -> NDArray[np.int32]:
        """Return what must show, of the vertices as they are."""
        ids = self.picture().triangle
        return np.where(ids < 0, ids, ids + np.int32((self.scene.copies - 1) * len(self.scene.triangles)))


def find_faults(exact: Exact, counts: NDArray[Any], labels: NDArray[np.int32]) -> FaultyPixels:
    """Return where a picture is not that of the vertices as they are."""
    true = exact.picture().count * exact.scene.copies
    return FaultyPixels(labels != exact.labels(), counts < true, counts > true)


# The page


COLORS = {"another triangle shows": (204, 121, 167), "a gap": (213, 94, 0), "drawn more than once": (20, 130, 210)}
"""Of faults, in the order of `FaultyPixels`; shades of grey tell the triangles of what is right."""

SHARES = ("#ffffcc", "#c7e9b4", "#7fcdbb", "#41b6c4", "#225ea8", "#0c2c84")
"""Colours of shares of wrong pixels by their logarithm: ColorBrewer's YlGnBu, which all eyes see."""


def value_at(axis: Axis, position: float) -> tuple[str, Any]:
    """Return how the value at a place of the slider is written, and the value; between two numbers by their ratio."""
    names, values = list(axis.values), list(axis.values.values())
    position = min(max(position, 0.0), len(values) - 1.0)
    i = min(int(position), len(values) - 2)
    part = position - i
    low, high = values[i], values[i + 1]
    if part in (0.0, 1.0) or not is_continuous(axis) or low <= 0 or high <= 0:
        nearest = round(position)
        return names[nearest], values[nearest]
    between = math.exp(math.log(low) + part * (math.log(high) - math.log(low)))
    value = round(between) if isinstance(low, int) else between
    return f"{value:.3g}" if isinstance(value, float) else str(value), value


def is_continuous(axis: Axis) -> bool:
    """Tell whether there is anything between the values of an axis."""
    return all(isinstance(value, int | float) for value in axis.values.values())


@lru_cache(maxsize=64)
def scene_at(family: str, positions: tuple[float, ...], seed: int) -> tuple[Exact, tuple[str, ...]]:
    """Return the scene of a family where its sliders stand, and how their values are written."""
    if family not in FAMILIES:
        raise ValueError(f"family must be one of {', '.join(map(repr, FAMILIES))}, got {family!r}")
    found = FAMILIES[family]
    if len(positions) != len(found.axes):
        raise ValueError(f"family {family!r} has {len(found.axes)} parameters, got {len(positions)} positions")
    written, values = zip(*map(value_at, found.axes, positions), strict=True)
    return Exact(found.make(*values, seed)), written


def faults_of(entry: Entry, exact: Exact) -> FaultyPixels | str:
    """Return where a method is wrong on a scene, or why it refuses to draw it."""
    try:
        return find_faults(exact, draw_counts(entry, exact.scene), draw_labels(entry, exact.scene))
    except ValueError as error:
        return str(error).partition(", got")[0]


def n_bad(faults: FaultyPixels) -> int:
    """Return how many pixels are wrong, or not drawn once."""
    return int((faults.wrong | faults.gaps | faults.overdrawn).sum())


def row_of(name: str, faults: FaultyPixels | str) -> dict[str, Any]:
    """Return what the page says of a method."""
    if isinstance(faults, str):
        return {"name": name, "bad": None, "text": "refuses", "title": faults}
    bad, gaps, overdrawn = n_bad(faults), int(faults.gaps.sum()), int(faults.overdrawn.sum())
    title = f"{bad} of {faults.wrong.size} pixels: {gaps} gaps, {overdrawn} drawn more than once"
    return {"name": name, "bad": bad, "text": f"{bad} wrong" if bad else "right", "title": title}


def picture_of(faults: FaultyPixels | str, ids: NDArray[np.int32]) -> NDArray[np.uint8]:
    """Return the picture (H, W, 4) of a method: faults in their colours, triangles in shades of grey."""
    picture = np.full((*ids.shape, 4), 128, np.uint8)
    picture[..., 3] = np.where(ids < 0, 0, 40 + 30 * (ids % 3))
    if isinstance(faults, str):
        return np.zeros_like(picture)
    for kind, color in zip(("wrong", "overdrawn", "gaps"), (0, 2, 1), strict=True):
        picture[getattr(faults, kind)] = (*list(COLORS.values())[color], 255)
    return picture


def cell_of(faults: FaultyPixels | str, n_edge_px: int) -> dict[str, str]:
    """Return a cell of the chart: its text, colour, kind and title."""
    if isinstance(faults, str):
        return {"text": "", "color": "", "kind": "refused", "title": "refuses to draw"}
    bad, has_gaps = n_bad(faults), bool(faults.gaps.any())
    share = bad / max(1, n_edge_px)
    level = min(5, max(0, math.floor(1.5 * math.log10(share) + 6))) if bad else 0
    return {
        "text": f"{100 * share:.{1 if share < 0.01 else 0}f}" if bad else "",
        "color": SHARES[level] if bad else "",
        "kind": ("dark" if level > 3 else "light") + (" gaps" if has_gaps else ""),
        "title": f"{bad} wrong pixels{', with gaps' if has_gaps else ''}",
    }


def as_request(request: Request) -> tuple[str, tuple[float, ...], int]:
    """Return family, positions and seed."""
    positions = tuple(float(position) for position in request["positions"])
    seed = int(request.get("seed", 0))
    if not all(map(math.isfinite, positions)) or not 0 <= seed < 2**32:
        raise ValueError(f"positions must be finite and seed at least 0, got {positions} and {seed}")
    return str(request["family"]), positions, seed


def answer_families(_: Session, __: Request) -> Reply:
    """Answer the page: the families, their parameters, and the methods."""
    families = {
        name: {
            "what": family.what,
            "axes": [
                {"what": axis.what, "steps": list(axis.values), "is_continuous": is_continuous(axis)}
                for axis in family.axes
            ],
        }
        for name, family in FAMILIES.items()
    }
    return Reply({"families": families, "methods": [entry.name for entry in entries()], "key": list(COLORS.items())})


def answer(_: Session, request: Request) -> Reply:
    """Answer the page: where each method is wrong, as pictures (N, H, W, 4) and in words."""
    exact, written = scene_at(*as_request(request))
    found = [(entry.name, faults_of(entry, exact)) for entry in entries()]
    rows = [row_of(*one) for one in found]
    ids = exact.labels()
    return Reply({"values": written, "rows": rows}, {"pictures": np.stack([picture_of(one, ids) for _, one in found])})


@lru_cache(maxsize=1024)
def column_of(family: str, positions: tuple[float, ...], seed: int) -> list[dict[str, str]]:
    """Return the cells of all methods on a scene."""
    exact, _ = scene_at(family, positions, seed)
    n_edge_px = int(exact.picture().is_edge.sum())
    return [cell_of(faults_of(entry, exact), n_edge_px) for entry in entries()]


def answer_column(_: Session, request: Request) -> Reply:
    """Answer the page: a column of the chart, one value of the last parameter; the other sliders stay."""
    return Reply({"cells": column_of(*as_request(request))})


HANDLERS = {"race.draw": answer, "race.column": answer_column, "race.families": answer_families}
