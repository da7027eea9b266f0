"""Draws the instances of a scene in clusters, round by round: clusters that earlier rounds hide are left out.

In: a `PlacedScene`, targets.  Out: whether clusters pay; ids and depths of the samples, in the targets.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.memory import KeptMemory, Memory
from topleft._core.base.options import Sink
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import ClusteredMesh, Survey, draw_clustered
from topleft._core.raster.view import View
from topleft._meshes.scene.scene import Scene

if TYPE_CHECKING:
    from topleft._meshes.picture.instances import PlacedScene

#: Instances surveyed for the share that a picture shows, and clusters of each: less than a tenth of a millisecond.
SURVEYED_INSTANCES, SURVEYED_OF_EACH = 4, 25

#: Instances that each thread draws before the next ones are tested against their depths.
ROUND = 16

#: Cells on each side of the picture in which layers are counted: of 15 by 8 pixels at 1920x1080.
CELLS = 128

#: Which end of a box each of its corners has, axis by axis.
CORNERS = np.array([[k >> axis & 1 for axis in range(3)] for k in range(8)], np.bool_)


def pays_in_clusters(placed: PlacedScene, clip_from_world: NDArray[np.float64], view: View) -> bool:
    """Tell whether drawing a scene's meshes in clusters pays, and note that they are drawn."""
    scene = placed.scene
    n, n_instances = scene.n_triangles, len(scene)
    if not choices.pays_to_cluster(n, 1):
        return False
    if not scene.cache.is_drawn_often:
        wanted = [choices.pays_to_cluster(n, mesh.note_drawn(), len(at)) for mesh, at in scene.meshes.values()]
        scene.cache.is_drawn_often = all(wanted)
    if not (scene.cache.is_drawn_often and scene.backoff.is_over()):
        return False
    survey = survey_instances(placed)
    layers = partial(count_layers, scene, clip_from_world)
    pays = choices.pays_to_draw_instances(view, n_instances, n // n_instances, survey, layers)
    scene.backoff.note(pays=pays)
    return pays


def front_to_back(scene: Scene, clip_from_world: NDArray[np.float64], some: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the order of some instances by the distance of the middle of their boxes: by w, or z if w is constant."""
    boxes = np.empty((len(scene), 6))
    for mesh, at in scene.meshes.values():
        boxes[at] = mesh.vertex_box
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    transforms = scene.transforms[some]
    middles = (transforms[:, :3, :3] * middles[some][:, None]).sum(axis=2) + transforms[:, :3, 3]
    row = clip_from_world[3] if clip_from_world[3, :3].any() else clip_from_world[2]
    return np.argsort(engine.product(middles, row[:3]), kind="stable")


def survey_instances(placed: PlacedScene) -> Survey:
    """Return the survey of a scene's clusters, by some of its instances."""
    some = range(0, len(placed.scene), -(-len(placed.scene) // SURVEYED_INSTANCES))
    weights = [placed.scene[i].mesh.triangles.shape[0] for i in some]
    surveys = [ClusteredMesh(*placed.clustered(i)).survey(SURVEYED_OF_EACH) for i in some]
    return Survey(*np.average(surveys, axis=0, weights=weights).tolist())


def count_layers(scene: Scene, clip_from_world: NDArray[np.float64]) -> float:
    """Return how many boxes of instances lie one behind the other, on the mean over the picture where there are any."""
    lows, highs = scene.boxes[:, :3], scene.boxes[:, 3:]
    corners = np.where(CORNERS, highs[:, None], lows[:, None])
    matrices = scene.clip_from_objects(clip_from_world)
    clip = (matrices[:, None, :, :3] * corners[:, :, None]).sum(axis=3) + matrices[:, None, :, 3]
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
    targets: Sequence[engine.Target],
    positions: Sequence[tuple[int, int]],
    height: int,
    n_threads: int,
    *,
    is_first: bool,
) -> bool:
    """Draw all samples into targets, as `PlacedScene.draw` does; returns as `draw_clustered` does."""
    memories = [KeptMemory() for _ in range(n_threads)]
    return all(
        draw_rounds(placed, order, target, height, at, memories, is_first=is_first)
        for target, at in zip(targets, positions, strict=True)
    )


def draw_rounds(
    placed: PlacedScene,
    order: NDArray[np.intp],
    target: engine.Target,
    height: int,
    at: tuple[int, int],
    memories: Sequence[Memory],
    *,
    is_first: bool,
) -> bool:
    """Draw a sample into a target, as `draw_placed` does.

    In rounds, each of which leaves out instances that lie outside, between samples, or behind those of earlier ones.
    """
    keeps_order = Sink(target.sink) in (Sink.NEAREST, Sink.FARTHEST)
    order = placed.shown(order, [target], [at], is_drawn=keeps_order and not is_first)
    n = ROUND * len(memories) if keeps_order else len(order)
    for first in range(0, len(order), n):
        some = order[first : first + n]
        if first:
            some = placed.shown(some, [target], [at], is_drawn=True)
        ends = {"is_first": is_first and first == 0, "is_last": first + n >= len(order)}
        if len(some) and not draw_round(placed, some, target, height, at, memories, **ends):
            return False
    return True


def draw_round(
    placed: PlacedScene,
    some: NDArray[np.intp],
    target: engine.Target,
    height: int,
    at: tuple[int, int],
    memories: Sequence[Memory],
    **ends: bool,
) -> bool:
    """Draw a sample of some instances, each thread those in its rows; returns as `draw_clustered` does."""
    tops = placed.split_rows(some, height, min(height, len(memories)))

    def own(first: int, end: int) -> list[int]:
        shown = some if len(tops) == 2 else placed.shown(some, [target], [at], (first, end), is_drawn=False)
        return shown.tolist()

    return draw_clustered(memories, tops, own, lambda i: ClusteredMesh(*placed.clustered(i)), target, at, **ends)
