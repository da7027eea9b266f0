"""A mesh that tiles the frame: gaps, overdraw, and how much of the picture changes when it is touched.

Out: for every method and precision the pixels that were missed, drawn more than once, or given to a wrong triangle, and
the pixels that change their triangle when vertices move or triangles change places, beside those of the exact picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.families import Entry, Triangles
from topleft.methods.reference.integers import ExactPicture

N_POINTS = 20_000
FAR_PX = 2**20
"""Where the far mesh lies, in x and y: a float32 has steps of 1/8 px there."""

EXACT = "exact"


class Change(NamedTuple):
    """A way to touch a mesh."""

    name: str
    what: str


CHANGES = (
    Change("ulp", "every coordinate to the next float64, up or down"),
    Change("rotate", "by 1e-6 rad round the middle of the frame"),
    Change("translate", "by 1/3 px in x and y"),
    Change("pixel", "by 1 px in x and y, against the picture shifted by 1 px"),
    Change("reorder", "the triangles drawn in another order"),
)


class Touched(NamedTuple):
    """The mesh after a change."""

    scene: Triangles
    ids: NDArray[np.int32]
    """The former index of each triangle."""
    shift_px: int = 0
    """How far the picture must be shifted back, in x and y."""


def touch(change: str, scene: Triangles, frame_px: int, seed: int = 5) -> Touched:
    """Return the scene after the change."""
    vertices, triangles = scene
    ids = np.arange(len(triangles), dtype=np.int32)
    rng = np.random.default_rng(seed)
    if change == "ulp":
        return Touched((np.nextafter(vertices, rng.choice([-np.inf, np.inf], vertices.shape)), triangles), ids)
    if change == "rotate":
        cos, sin = np.cos(1e-6), np.sin(1e-6)
        turned = (vertices - frame_px / 2) @ np.array([[cos, sin], [-sin, cos]]) + frame_px / 2
        return Touched((turned, triangles), ids)
    if change == "translate":
        return Touched((vertices + 1 / 3, triangles), ids)
    if change == "pixel":
        return Touched((vertices + 1, triangles), ids, 1)
    if change == "reorder":
        order = rng.permutation(ids)
        return Touched((vertices, triangles[order]), order)
    raise ValueError(f"change must be one of {', '.join(name for name, _ in CHANGES)}, got {change!r}")


def measure_stability(chosen: Sequence[Entry], frame_px: int, scale: float = 1.0) -> dict[str, Any]:
    """Return `mesh`, `stability` of a record: the scene, and a row for the exact picture and for each entry."""
    import topleft as tl
    from topleft import scenes

    size = (frame_px, frame_px)
    scene = scenes.planar_mesh(max(8, int(N_POINTS * scale)), *size)
    touched = {change.name: touch(change.name, scene, frame_px) for change in CHANGES}
    exact = ExactPicture(*scene, size)
    far = (scene[0] + FAR_PX, scene[1])
    clean = dict.fromkeys(("missed", "overdrawn", "wrong", "far_missed", "far_overdrawn"), 0)
    rows: list[dict[str, Any]] = [{"method": EXACT, "precision": ""} | clean]
    for name, mesh in touched.items():
        moved = ExactPicture(*mesh.scene, size).triangle
        rows[0][name] = count_flips(exact.triangle, renamed(moved, mesh.ids), mesh.shift_px)
    rasterizer = tl.Rasterizer(size, threads=1)
    for entry in chosen:
        row: dict[str, Any] = {"method": entry.method, "precision": entry.precision}
        row |= count_faults(rasterizer, entry, scene)
        before = draw_labels(rasterizer, entry, scene).copy()
        row["wrong"] = int((before != exact.triangle).sum())
        row |= {f"far_{name}": n for name, n in count_faults(rasterizer, entry, far, (FAR_PX, FAR_PX)).items()}
        for name, mesh in touched.items():
            after = renamed(draw_labels(rasterizer, entry, mesh.scene), mesh.ids)
            row[name] = count_flips(before, after, mesh.shift_px)
        rows.append(row)
    facts = {"n_triangles": len(scene[1]), "n_px": frame_px**2, "n_edge_px": int(exact.is_edge.sum())}
    return {"mesh": facts, "stability": rows}


def count_faults(
    rasterizer: Any, entry: Entry, scene: Triangles, origin: tuple[int, int] = (0, 0)
) -> dict[str, int | None]:
    """Return the pixels that no triangle of the mesh draws, and those that are drawn again; None out of its range."""
    try:
        count = rasterizer.overdraw(*entry.orient(scene), origin=origin, **entry.options())
    except ValueError:
        return {"missed": None, "overdrawn": None}
    return {"missed": int((count == 0).sum()), "overdrawn": int((count > 1).sum())}


def draw_labels(rasterizer: Any, entry: Entry, scene: Triangles) -> NDArray[np.int32]:
    """Return the triangle of each pixel in painter's order, -1 for none: the id is the colour."""
    vertices, triangles = entry.orient(scene)
    ids = np.arange(len(triangles), dtype=np.float32)
    return rasterizer.fill(vertices, triangles, ids, per="triangle", background=-1, **entry.options()).astype(np.int32)


def renamed(labels: NDArray[np.int32], ids: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the picture with other ids, -1 for none."""
    return np.append(ids, np.int32(-1))[labels]


def count_flips(before: NDArray[np.int32], after: NDArray[np.int32], shift_px: int) -> int:
    """Count the pixels that differ, of those in both pictures."""
    if shift_px:
        before, after = before[:-shift_px, :-shift_px], after[shift_px:, shift_px:]
    return int((before != after).sum())
