"""Scenes of clustered meshes: instances are drawn from front to back, without what those before hide.

In: a scene as a camera sees it, targets. Out: the same pictures that the whole meshes give, in their order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from topleft import _engine, choices
from topleft.clustered import ClusteredScene, draw_clustered
from topleft.memory import KeptMemory
from topleft.scene import Scene

if TYPE_CHECKING:
    from topleft.scene_draw import PlacedScene

__all__ = ["draw_placed", "front_to_back", "wants_clusters"]


def wants_clusters(scene: Scene) -> bool:
    """Tell whether all meshes of a scene are to be drawn in clusters, and note that it is drawn."""
    n_instances = Counter(id(instance.mesh) for instance in scene)
    meshes = {id(instance.mesh): instance.mesh for instance in scene}
    n_triangles = scene.n_triangles
    pays = [choices.pays_to_cluster(n_triangles, mesh.note_drawn(), n_instances[key]) for key, mesh in meshes.items()]
    return all(pays)


def front_to_back(scene: Scene, clip_from_world: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the instances by the distance of the middle of their boxes: by w, or by z where all w are equal."""
    boxes = {id(instance.mesh): instance.mesh.vertex_box.reshape(2, 3).mean(axis=0) for instance in scene}
    middles = np.array([
        instance.transform[:3, :3] @ boxes[id(instance.mesh)] + instance.transform[:3, 3] for instance in scene
    ])  # fmt: skip
    row = clip_from_world[3] if clip_from_world[3, :3].any() else clip_from_world[2]
    return np.argsort(middles @ row[:3], kind="stable")


def draw_placed(
    placed: PlacedScene,
    order: NDArray[np.intp],
    targets: Sequence[_engine.Target],
    positions: Sequence[tuple[int, int]],
    height: int,
    n_threads: int,
) -> bool:
    """Clear targets, one a sample, and draw what each sees; returns as `draw_clustered` does."""
    scenes = [ClusteredScene(*placed.clustered(i)) for i in order.tolist()]
    memories = [KeptMemory() for _ in range(n_threads)]
    seen = zip(targets, positions, strict=True)
    return all(draw_clustered(memories, scenes, target, height, at) for target, at in seen)
