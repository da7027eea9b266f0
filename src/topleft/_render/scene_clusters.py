"""Scenes of clustered meshes: instances are drawn from front to back, without what those before hide.

In: a scene as a camera sees it, targets. Out: the same pictures that the whole meshes give, in their order.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from topleft import _engine
from topleft._base.memory import KeptMemory
from topleft._model.scene import Scene
from topleft._raster import choices
from topleft._raster.cluster_draw import ClusteredMesh, draw_clustered
from topleft._raster.clusters import Survey
from topleft._raster.view import View

if TYPE_CHECKING:
    from topleft._render.scene_draw import PlacedScene

__all__ = ["draw_placed", "front_to_back", "pays_to_draw", "wants_clusters"]

#: Instances that tell what a picture shows of all, and clusters of each: less than a tenth of a millisecond.
SURVEYED_INSTANCES, SURVEYED_OF_EACH = 4, 25

#: Cells on each side of the picture in which layers are counted: of 15 by 8 pixels at 1920x1080.
CELLS = 128

#: Which end of a box each of its corners has, axis by axis.
CORNERS = np.array([[k >> axis & 1 for axis in range(3)] for k in range(8)], np.bool_)


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


def pays_to_draw(placed: PlacedScene, clip_from_world: NDArray[np.float64], view: View) -> bool:
    """Tell whether a scene whose meshes are in clusters is drawn from these."""
    scene = placed.scene
    if not scene.backoff.is_over():
        return False
    n_triangles = scene.n_triangles // len(scene)
    pays = choices.pays_to_draw_instances(
        view, n_triangles, lambda: survey_instances(placed), lambda: count_layers(scene, clip_from_world)
    )
    scene.backoff.note(pays=pays)
    return pays


def survey_instances(placed: PlacedScene) -> Survey:
    """Return what becomes of the clusters of a scene, by some of its instances."""
    some = range(0, len(placed.scene), -(-len(placed.scene) // SURVEYED_INSTANCES))
    weights = [placed.scene[i].mesh.triangles.shape[0] for i in some]
    surveys = [ClusteredMesh(*placed.clustered(i)).survey(SURVEYED_OF_EACH) for i in some]
    return Survey(*np.average(surveys, axis=0, weights=weights).tolist())


def count_layers(scene: Scene, clip_from_world: NDArray[np.float64]) -> float:
    """Return how many boxes of instances lie one behind the other, on the mean over the picture where there are any."""
    boxes = {id(instance.mesh): instance.mesh.vertex_box for instance in scene}
    lows, highs = np.array([boxes[id(instance.mesh)].reshape(2, 3) for instance in scene]).swapaxes(0, 1)
    corners = np.where(CORNERS, highs[:, None], lows[:, None])
    matrices = np.array([clip_from_world @ instance.transform for instance in scene])
    clip = np.einsum("nij,nkj->nki", matrices[..., :3], corners) + matrices[:, None, :, 3]
    clip = clip[(clip[..., 3] > 0).all(axis=1)]  # a box about the eye has no outline
    cells = np.rint((clip[..., :2] / clip[..., 3:] + 1) * (0.5 * CELLS)).clip(0, CELLS).astype(np.intp)
    (left, top), (right, bottom) = cells.min(axis=1).T, cells.max(axis=1).T
    steps = np.zeros((CELLS + 1, CELLS + 1), np.intp)
    for row, column, step in ((top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)):
        np.add.at(steps, (row, column), step)
    n_of_cell = steps.cumsum(axis=0).cumsum(axis=1)
    return float(n_of_cell.sum() / max(1, np.count_nonzero(n_of_cell)))


def draw_placed(
    placed: PlacedScene,
    order: NDArray[np.intp],
    targets: Sequence[_engine.Target],
    positions: Sequence[tuple[int, int]],
    height: int,
    n_threads: int,
) -> bool:
    """Clear targets, one a sample, and draw what each sees; returns as `draw_clustered` does."""
    scenes = [ClusteredMesh(*placed.clustered(i)) for i in order.tolist()]
    memories = [KeptMemory() for _ in range(n_threads)]
    seen = zip(targets, positions, strict=True)
    return all(draw_clustered(memories, scenes, target, height, at) for target, at in seen)
