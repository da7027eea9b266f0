"""From the first failure of a method along a family to the smallest scene that still shows it.

In: the record of an atlas. Out: `topleft.failure_scenes.FailureScene`s. Triangles are left out, the frame is cut to a
few pixels, coordinates are rounded, as coarsely as the failure and what makes the family allow. The expected picture
is that of the vertices as they are, and the engine has to draw it with 8 bits, or else with 16 or 0: so nobody's snap
is to blame but the method's own.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from topleft._apps.explore.race import Entry, Exact, draw_counts, draw_labels, entries
from topleft.failure_scenes import FailureScene, Got
from topleft.methods import find_method
from topleft.scene_families import FAMILIES, Family, PixelScene

WINDOW_PX = 7
KINDS = {"gap": "gaps", "overdraw": "overdrawn", "wrong": "wrong"}
SIGNS = ".0123456789abcdefghijklmnopqrstuvwxyz"
FAR_PX = 1000.0
EVERYDAY = "any"
"""The family of failures that need nothing but a mesh."""
FINEST = "auto, 16 bits"
"""The engine at its finest: where its snap is to blame there is no one to be right."""


@dataclass(frozen=True)
class Failure:
    """The first value of a family at which a method fails in one way; `step` counts from 0, the mildest."""

    family: str
    step: int
    kind: str
    entry: Entry


def first_failures(record: dict[str, Any]) -> Iterator[Failure]:
    """Yield the first gaps and overdraw of each map of one parameter; where there are none, the first wrong pixels."""
    named = {entry.name: entry for entry in entries()}
    rows = [row for row in record["maps"] if row["family"] in FAMILIES and row["entry"] in named]
    for row in rows:
        if len(FAMILIES[row["family"]].axes) > 1 or row["entry"] == FINEST:
            continue
        found = [(kind, step) for kind, field in KINDS.items() if (step := first_step(row[field])) is not None]
        kinds = [kind for kind, _ in found]
        for kind, step in found:
            is_everyday_again = row["family"] == "layers" and step == 0  # one layer is nothing new
            if (kind != "wrong" or kinds == ["wrong"]) and not is_everyday_again:
                yield Failure(row["family"], step, kind, named[row["entry"]])


def first_step(counts: Sequence[int | None]) -> int | None:
    """Return where the first count above 0 is."""
    return next((step for step, count in enumerate(counts) if count), None)


def fault_pixels(scene: PixelScene, entry: Entry, kind: str) -> NDArray[np.bool_]:
    """Return where a method fails in that way; a pixel that is drawn too often must be one that has to be drawn."""
    exact = Exact(scene)
    if kind == "wrong":
        return draw_labels(entry, scene) != exact.labels()
    counts, true = draw_counts(entry, scene), exact.picture().count
    return counts < true if kind == "gap" else (counts > true) & (true == 1)


def is_right(scene: PixelScene, bits: int) -> bool:
    """Tell whether the engine draws the exact picture of the vertices as they are."""
    engine, exact = Entry("auto", "auto", bits), Exact(scene)
    try:
        counts = draw_counts(engine, scene)
    except ValueError:
        return False
    return bool((counts == exact.picture().count).all() and (draw_labels(engine, scene) == exact.labels()).all())


def keeps_family(scene: PixelScene, family: str, value: float) -> bool:
    """Tell whether a scene is still one of its family at that value."""
    corners = scene.vertices[scene.triangles]
    if family == "far":
        return bool(corners.min() >= value / 2)
    if family == "large":
        return bool(np.abs(corners).max() >= value / 2)
    if family == "sliver":
        return bool(heights(corners).min() <= 2 * value)
    if family == "edge" and value:  # near centres, not on them
        exact = Exact(scene)
        return bool((exact.picture().triangle == exact.picture(rule="bottom-right").triangle).all())
    return True


def heights(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least height of each triangle (T, 3, 2)."""
    sides = np.roll(corners, -1, axis=1) - corners
    area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    return area / np.sqrt((sides**2).sum(axis=-1)).max(axis=1)


class Shrinker:
    """The failure that a smaller scene must keep."""

    def __init__(self, failure: Failure, value: Any) -> None:
        self.failure, self.value = failure, value
        self.bits = 8
        self.is_everyday = failure.step == 0
        self.is_inside = True
        claims = find_method(failure.entry.method).claims
        is_exact = claims.exact and not claims.overdraws_shared_edges
        self.is_middle = failure.entry.snap == "px" and failure.kind != "wrong" and not is_exact
        """Whether vertices stay in the middle of their pixels, so that the failure is not the snap's."""

    def faults(self, scene: PixelScene) -> NDArray[np.bool_]:
        """Return the pixels that count: inside the mesh, if the failure is to be one between triangles."""
        is_fault = fault_pixels(scene, self.failure.entry, self.failure.kind)
        if self.is_inside and self.failure.kind != "wrong":
            is_once = np.pad(Exact(scene).picture().count == 1, 1)
            height, width = is_fault.shape
            is_fault &= np.all([is_once[i : i + height, j : j + width] for i in range(3) for j in range(3)], axis=0)
        return is_fault

    def fails(self, scene: PixelScene) -> bool:
        """Tell whether the method still fails as it did, and nobody else does."""
        used = scene.vertices[np.unique(scene.triangles)]
        if not (self.is_everyday or keeps_family(scene, self.failure.family, self.value)):
            return False
        if self.is_middle and ((-FAR_PX < used) & (used < 0)).any():
            return False  # truncation would turn round
        if self.failure.kind != "wrong" and Exact(scene).picture().count.max() > 1:
            return False  # a mesh does not overlap
        try:
            return bool(self.faults(scene).any() and is_right(scene, self.bits))
        except ValueError:
            return False

    def start(self, family: Family) -> PixelScene | None:
        """Return a scene of the family on which the method fails, its vertices where its own snap moves none."""
        # A mesh of tiny triangles round a pixel is not small: there the pixel alone counts.
        for is_inside in (False,) if family.name == "dense" else (True, False):
            self.is_inside = is_inside
            for seed in range(family.n_seeds):
                scene = family.make(self.value, seed)._replace(copies=1)
                if not fault_pixels(scene, self.failure.entry, self.failure.kind).any():
                    continue
                for vertices, bits in self.clean_vertices(scene.vertices):
                    self.bits = bits
                    moved = scene._replace(vertices=vertices)
                    for window in windows(moved, self.faults(moved)):
                        if self.fails(window):
                            return window
        return None

    def clean_vertices(self, vertices: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.float64], int]]:
        """Yield vertices near those given, and sub-pixel bits at which the engine should move none of them."""
        if self.is_middle:
            yield np.trunc(vertices) + 0.5, 8
            return
        near = [vertices.astype(np.float32).astype(np.float64)] if self.failure.entry.snap == "float32" else []
        for own in [*near, vertices]:
            for bits in (8, 16, 0):
                yield np.rint(own * 2.0**bits) / 2.0**bits, bits

    def smaller(self, scene: PixelScene) -> Iterator[PixelScene]:
        """Yield scenes that are simpler by one step, the boldest first."""
        n_cut = len(scene.triangles)
        while n_cut := n_cut // 2:
            for first in range(0, len(scene.triangles), n_cut):
                yield scene._replace(triangles=np.delete(scene.triangles, np.s_[first : first + n_cut], axis=0))
        if any(scene.origin) and self.failure.family != "far":
            yield scene._replace(vertices=scene.vertices - scene.origin, origin=(0, 0))
        for i in np.unique(scene.triangles):
            for k in range(2):
                local = scene.vertices[i, k] - scene.origin[k]
                shift = 0.5 if self.is_middle else 0.0
                for value in simpler(local - shift, 0 if self.is_middle else -16):
                    vertices = scene.vertices.copy()
                    vertices[i, k] = scene.origin[k] + value + shift
                    if vertices[i, k] != scene.vertices[i, k]:
                        yield scene._replace(vertices=vertices)

    def shrink(self, scene: PixelScene) -> PixelScene:
        """Return the smallest scene that single steps lead to."""
        is_smaller = True
        while is_smaller:
            is_smaller = False
            for candidate in self.smaller(scene):
                if len(candidate.triangles) and self.fails(candidate):
                    scene, is_smaller = candidate, True
                    break
        return scene


def simpler(value: float, least: int) -> Iterator[float]:
    """Yield values with fewer bits, at most as large, from 0 on; `least` is the exponent of the last bit looked at."""
    top = int(np.floor(np.log2(abs(value)))) if value else least
    last = None
    for exponent in range(top + 1, least - 1, -1):
        nearest = float(np.trunc(value / 2.0**exponent) * 2.0**exponent)
        if nearest == value:
            return
        if nearest != last:
            yield nearest
        last = nearest


def windows(scene: PixelScene, is_fault: NDArray[np.bool_]) -> Iterator[PixelScene]:
    """Yield the triangles in small windows round wrong pixels."""
    for row, column in np.argwhere(is_fault)[:20].tolist():
        at = (max(0, scene.origin[0] + column - WINDOW_PX // 2), max(0, scene.origin[1] + row - WINDOW_PX // 2))
        corners = scene.vertices[scene.triangles] - at
        is_near = (corners.max(axis=1) > -1).all(axis=1) & (corners.min(axis=1) < WINDOW_PX + 1).all(axis=1)
        yield scene._replace(triangles=scene.triangles[is_near], size=(WINDOW_PX, WINDOW_PX), origin=at)


def rows_of(values: NDArray[Any]) -> str:
    """Return a picture as text: counts, or triangles with "." for none."""
    return "/".join("".join(SIGNS[v + 1] for v in row) for row in values.tolist())


def compact(scene: PixelScene) -> PixelScene:
    """Return the scene without the vertices that no triangle uses."""
    used, triangles = np.unique(scene.triangles, return_inverse=True)
    return scene._replace(vertices=scene.vertices[used], triangles=triangles.reshape(-1, 3).astype(np.int32))


def got_of(scene: PixelScene, entry: Entry, kind: str) -> Got:
    """Return the picture of a method."""
    drawn = draw_labels(entry, scene) if kind == "wrong" else draw_counts(entry, scene)
    return Got(entry.method, entry.bits, rows_of(drawn))


def keep_scene(failure: Failure, value_name: str, scene: PixelScene, bits: int) -> FailureScene:
    """Return the conditions of a shrunk scene; without a value it only has to be a mesh."""
    scene, exact = compact(scene), Exact(compact(scene))
    expected = exact.labels() if failure.kind == "wrong" else exact.picture().count
    family = failure.family if value_name else EVERYDAY
    name = "-".join(part for part in (family, value_name.replace(" ", "-"), failure.kind) if part)
    return FailureScene(
        name, family, value_name, failure.kind, tuple((x, y) for x, y in scene.vertices.tolist()),
        tuple((a, b, c) for a, b, c in scene.triangles.tolist()), scene.size, scene.origin, bits,
        rows_of(expected), (got_of(scene, failure.entry, failure.kind),),
    )  # fmt: skip


def as_scene(kept: FailureScene) -> PixelScene:
    """Return it as the families make them."""
    return PixelScene(*kept.shape(), kept.size, kept.origin)


def shrink_all(record: dict[str, Any]) -> list[FailureScene]:
    """Return a scene for each first failure; methods that fail alike on one share it."""
    kept: list[FailureScene] = []
    for failure in first_failures(record):
        family = FAMILIES[failure.family]
        names = list(family.axes[0].values)
        place = (EVERYDAY, "") if failure.step == 0 else (failure.family, names[failure.step])
        own = functools.partial(got_of, entry=failure.entry, kind=failure.kind)
        known = [i for i, scene in enumerate(kept) if (scene.family, scene.value, scene.kind) == (*place, failure.kind)]
        if any(has_method(kept[i], failure.entry) for i in known) or is_chance(failure, kept):
            continue
        shared = next((i for i in known if fault_pixels(as_scene(kept[i]), failure.entry, failure.kind).any()), None)
        if shared is not None:
            kept[shared] = replace(kept[shared], got=(*kept[shared].got, own(as_scene(kept[shared]))))
            continue
        shrinker = Shrinker(failure, family.axes[0].values[names[failure.step]])
        start = shrinker.start(family)
        if start is None:  # it fails there, but not for what makes the family
            shrinker.is_everyday = True
            start = shrinker.start(family)
        if start is None:
            raise ValueError(f"no small scene shows {failure}")
        if shrinker.is_everyday:
            known = [i for i, scene in enumerate(kept) if (scene.family, scene.kind) == (EVERYDAY, failure.kind)]
        value_name = "" if shrinker.is_everyday else names[failure.step]
        new = keep_scene(failure, value_name, shrinker.shrink(start), shrinker.bits)
        kept.append(replace(new, name=f"{new.name}-{len(known) + 1}") if known else new)
    return kept


def is_chance(failure: Failure, kept: Sequence[FailureScene]) -> bool:
    """Tell whether the snap shows later in this family by chance: too few pixels lie close to edges in mild scenes."""
    is_snap = failure.kind == "wrong" and failure.family != "edge"
    return is_snap and any(
        (scene.family, scene.kind) == (EVERYDAY, "wrong") and has_method(scene, failure.entry) for scene in kept
    )


def has_method(kept: FailureScene, entry: Entry) -> bool:
    """Tell whether a method is among those that fail on the scene."""
    return any((got.method, got.subpixel_bits) == (entry.method, entry.bits) for got in kept.got)


def scenes_text(scenes: Iterable[FailureScene]) -> str:
    """Return `topleft/failure_scenes.json`: a scene a line."""
    return "[\n" + ",\n".join(json.dumps(asdict(scene)) for scene in scenes) + "\n]\n"
