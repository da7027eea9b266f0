"""What a method draws of a scene of the atlas, and where that differs from the exact picture.

In: an entry of the atlas and a scene. Out: counts, labels, and faulty pixels.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft import fill, overdraw
from topleft._apps.explore.race import NO_SNAP, Entry
from topleft.methods import find_method
from topleft.methods.reference.integers import ExactPicture, snapped, turns
from topleft.scene_families import PixelScene


class FaultyPixels(NamedTuple):
    """Where a picture is wrong, (H, W) bool each: another triangle shows; drawn less or more often than it should."""

    wrong: NDArray[np.bool_]
    gaps: NDArray[np.bool_]
    overdrawn: NDArray[np.bool_]


def orient(entry: Entry, scene: PixelScene) -> PixelScene:
    """Return the scene with the winding that the method draws; no change if it draws either."""
    winding = find_method(entry.method).claims.winding
    if winding == "either":
        return scene
    is_clockwise = turns(snapped(scene.vertices, entry.snap)[scene.triangles]) > 0
    is_wrong = is_clockwise != (winding == "clockwise")
    return scene._replace(triangles=np.where(is_wrong[:, None], scene.triangles[:, ::-1], scene.triangles))


def draw_counts(entry: Entry, scene: PixelScene) -> NDArray[Any]:
    """Return how often the method draws each pixel; of several samples the first one that is not the common count."""
    counts = overdraw(
        scene.vertices, orient(entry, scene).drawn(), scene.size, origin=scene.origin, threads=1, **entry.options()
    )
    if counts.ndim == 2:
        return counts
    return np.where((counts == counts[..., :1]).all(axis=-1), counts[..., 0], -1)


def draw_labels(entry: Entry, scene: PixelScene) -> NDArray[np.int32]:
    """Return the triangle that shows in each pixel in painter's order, -1 for none."""
    triangles = orient(entry, scene).drawn()
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
