"""Draws ids and depth of a placed scene: in rounds of whole instances, or in rounds of clusters.

In: `Placed`, the options of `rasterize`.  Out: `Fragments`; or any targets, for masks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX
from topleft._core.base.memory import FRESH, KeptMemory, Memory, check_fits
from topleft._core.base.options import Sink
from topleft._core.base.threads import count_threads, run_parts
from topleft._core.raster import choices
from topleft._core.raster.cluster_draw import BoxView, Survey, draw_clustered, equal_bands
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.rasterize import DEFAULT_OPTIONS, FragmentOptions, draw_fragments
from topleft._core.raster.sampling import lay_background
from topleft._core.raster.static_mesh import draw_static
from topleft._meshes.picture.placed import Placed
from topleft._meshes.scene.scene import Scene, unchecked_scene

#: Instances that are drawn before others are tested against their depths; each later round has twice as many.
FIRST_ROUND = 64

#: Instances that each thread draws in clusters before the next ones are tested against their depths.
ROUND = 16

#: A mask drawn in several calls must have fewer pixels: `tl_kernels.draw` clears its bits every 2**31.
MOST_PIXELS_OF_PART = 1 << 30

#: Instances surveyed for the share that a picture shows, and clusters of each: less than a tenth of a millisecond.
SURVEYED_INSTANCES, SURVEYED_OF_EACH = 4, 25

#: Cells on each side of the picture in which layers are counted: of 15 by 8 pixels at 1920x1080.
CELLS = 128

#: Which end of a box each of its corners has, axis by axis.
CORNERS = np.array([[k >> axis & 1 for axis in range(3)] for k in range(8)], np.bool_)


class SampleTarget(NamedTuple):
    """Where a sample is drawn, and where it lies in a pixel, in sub-pixels from the centre."""

    target: engine.Target
    at: tuple[int, int]


def draw_ids(memory: Memory, placed: Placed, options: FragmentOptions = DEFAULT_OPTIONS) -> Fragments:
    """Return the visibility buffer of a placed scene. `memory` is for one instance."""
    if placed.is_mesh or len(placed.scene) == 1:  # the length of a scene takes a hundredth of a small picture
        mesh, view = placed.scene[0].mesh, placed.view_of(0)
        if view.static is not None:
            drawn = draw_static(memory, view.static, view, options)
        else:
            drawn = draw_fragments(memory, mesh.vertices, mesh.triangles, view, options)
        return drawn if placed.is_plain_mesh else placed.kind_of_fragments.of(drawn, placed)
    sink = choices.fragment_sink(options.test, has_depth=True)
    (width, height), positions = placed.view.size, placed.positions
    shape = len(positions), height, width
    check_fits(shape, np.int32, np.float32)
    ids: NDArray[np.int32] = FRESH.empty("ids", shape, np.int32)
    depth: NDArray[np.float32] = FRESH.empty("depth", shape, np.float32)
    planes = zip(ids, depth, positions, strict=True) if width and height else ()
    targets = [SampleTarget(engine.Target(sink, own, own_depth, None), at) for own, own_depth, at in planes]
    if placed.scene.n_triangles > INT32_MAX:
        frags = placed.fragments(draw_groups(placed, targets, ids), depth)
    else:
        draw_scene(placed, targets)
        frags = placed.fragments(ids, depth)
    lay_background(frags.drawn_planes[0], depth, sink, options.background)
    return frags


def draw_groups(placed: Placed, targets: Sequence[SampleTarget], ids: NDArray[np.int32]) -> NDArray[np.int64]:
    """Draw a scene with more triangles than int32 counts; returns ids in int64, -1 where there is nothing.

    One group after the other into the planes `ids` of the targets, where 0 stands for triangles of earlier groups:
    it is less than all other ids, so that ties are decided as in one picture.
    """
    counted: NDArray[np.int64] = np.full(ids.shape, -1, np.int64)
    for i, scene in placed.scene.groups if targets else ():
        group = part_of(placed, scene, scene.first_ids[:-1] + 1, pays_in_clusters=True)
        draw_scene(group, targets, is_first=i == 0)
        is_new = ids > 0
        np.add(ids, placed.scene.first_ids[i] - 1, out=counted, where=is_new, dtype=np.int64)
        ids[is_new] = 0
    return counted


def draw_scene(placed: Placed, targets: Sequence[SampleTarget], *, is_first: bool = True) -> None:
    """Draw a scene into each target; `is_first`: clear them before, or else keep samples that nothing lies before."""
    for k, part in enumerate(parts_in_turn(placed, targets)):
        draw_part(part, targets, is_first=is_first and k == 0)


def parts_in_turn(placed: Placed, targets: Sequence[SampleTarget]) -> Iterator[Placed]:
    """Yield a scene; if it has meshes in parts, which clusters draw faster, these first where order allows it."""
    if not targets:
        return
    at = placed.in_parts
    first = some_of(placed, at, pays_in_clusters=True) if len(at) else placed
    if first is placed or not can_cluster(first, Sink(targets[0].target.sink)):
        yield placed
        return
    yield first
    if len(at) < len(placed.scene):
        yield some_of(placed, np.delete(np.arange(len(placed.scene)), at))


def some_of(placed: Placed, at: NDArray[np.intp], *, pays_in_clusters: bool = False) -> Placed:
    """Return some instances by themselves, with the ids that they have among all."""
    scene = placed.scene
    known = {"transforms": scene.transforms[at], "are_mirrored": scene.are_mirrored[at]}
    some = unchecked_scene([scene[i] for i in at.tolist()], **known)
    return part_of(placed, some, placed.numbers[at], pays_in_clusters=pays_in_clusters)


def part_of(placed: Placed, scene: Scene, numbers: NDArray[np.int64], *, pays_in_clusters: bool = False) -> Placed:
    """Return a part of a scene before the camera, whose instances have triangles 0 of these numbers."""
    return replace(
        placed,
        scene=scene,
        whole=scene,
        given_numbers=numbers,
        may_cluster=placed.may_cluster or pays_in_clusters,
        pays_in_clusters=True if pays_in_clusters else placed.pays_in_clusters,
    )


def draw_part(placed: Placed, targets: Sequence[SampleTarget], *, is_first: bool) -> None:
    """Draw all instances in one way."""
    view, sink = placed.view, Sink(targets[0].target.sink)
    shape = view.size[::-1]
    if in_clusters(placed, sink):
        order = in_order(placed, np.arange(len(placed.scene)), sink)
        if is_first and sink in (Sink.NEAREST, Sink.FARTHEST):
            for target, _ in targets:
                target.keep_bounds(FRESH.empty("bounds", engine.Target.bounds_shape(*shape), np.float32))
        memories = [KeptMemory() for _ in range(count_parts(placed))]
        if all(draw_clusters(placed, order, target, memories, is_first=is_first) for target in targets):
            return
    draw_instances(placed, targets, is_first=is_first)


def draw_instances(placed: Placed, targets: Sequence[SampleTarget], *, is_first: bool) -> None:
    """Draw whole instances; where order does not matter instances whose boxes may show, nearest first."""
    sink, order = Sink(targets[0].target.sink), np.arange(len(placed.scene))
    may_leave_out = choices.can_cluster(placed.view, sink)
    may_hide = may_leave_out and sink in (Sink.NEAREST, Sink.FARTHEST)
    if may_leave_out:
        order = find_shown(placed, order, targets, is_drawn=False)
    if may_hide:
        order = in_order(placed, order, sink)
    n_left = len(order)
    for some in placed.ranges(order, FIRST_ROUND if may_hide else np.inf):
        n_left -= len(some)
        if may_hide and not is_first:
            some = find_shown(placed, some, targets, is_drawn=True)
        if len(some):
            draw_meshes(placed, placed.snap_all(some), targets, is_first=is_first, is_last=n_left == 0)
        is_first = False


def draw_meshes(
    placed: Placed,
    meshes: Sequence[engine.SnappedMesh],
    targets: Sequence[SampleTarget],
    *,
    is_first: bool,
    is_last: bool = True,
) -> None:
    """Draw snapped meshes into each target, which the first of all clears."""

    def draw_rows(target: engine.Target, own: Sequence[engine.SnappedMesh], first: int, end: int) -> None:
        for i, mesh in enumerate(own):
            mesh.draw(target, first, end - first, is_first and i == 0, is_last and i == len(own) - 1)

    for target, at in targets:
        own = [mesh.at_sample(*at) for mesh in meshes]
        run_parts(partial(draw_rows, target, own), placed.view.size[1], count_parts(placed))


def count_parts(placed: Placed) -> int:
    """Return how many threads draw."""
    (width, height), n_triangles = placed.view.size, placed.scene.n_triangles
    return min(height, max(count_threads(placed.view.threads, n_triangles), height * width // MOST_PIXELS_OF_PART))


def in_order(placed: Placed, some: NDArray[np.intp], sink: Sink) -> NDArray[np.intp]:
    """Return some instances in the order in which they hide each other, about."""
    order = some[front_to_back(placed.scene, placed.clip_from_world, some)]
    return order[::-1].copy() if sink is Sink.FARTHEST else order


def front_to_back(scene: Scene, clip_from_world: NDArray[np.float64], some: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the order of some instances by the distance of the middle of their boxes: by w, or z if w is constant."""
    boxes, transforms = scene.boxes[some], scene.transforms[some]
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    middles = (transforms[:, :3, :3] * middles[:, None]).sum(axis=2) + transforms[:, :3, 3]
    row = clip_from_world[3] if clip_from_world[3, :3].any() else clip_from_world[2]
    return np.argsort(engine.product(middles, row[:3]), kind="stable")


def find_shown(
    placed: Placed,
    some: NDArray[np.intp],
    targets: Sequence[SampleTarget],
    rows: tuple[int, int] | None = None,
    *,
    is_drawn: bool,
) -> NDArray[np.intp]:
    """Return which of some instances have boxes that may show in a sample in some rows, or in all.

    If `is_drawn`, before the targets' depths; otherwise at least the first instance, which clears the targets.
    """
    may_show: NDArray[np.uint8] = np.zeros(len(some), np.uint8)
    for target, at in targets:
        for dtype in (np.float32, np.float64):
            own = np.flatnonzero((may_show == 0) & (placed.is_float32[some] == (dtype == np.float32)))
            if not len(own):
                continue
            chosen = some[own]
            boxes = BoxView(np.zeros((1, 3), dtype), placed.view_of(int(chosen[0])))
            seen, mesh = boxes.seen(target.sink, at, rows)
            is_shown: NDArray[np.uint8] = np.empty(len(own), np.uint8)
            matrices = placed.clip_from_objects[chosen].astype(dtype).astype(np.float64)  # as vertices have them
            engine.find_shown(mesh, seen, placed.scene.boxes[chosen], matrices, target, is_drawn, is_shown)
            may_show[own] = is_shown
    return some[:1] if not is_drawn and not may_show.any() else some[may_show != 0]


def can_cluster(placed: Placed, sink: Sink) -> bool:
    """Tell whether clusters may be drawn, which do not know that some triangles are single-sided and others are not."""
    return placed.may_cluster and choices.can_cluster(placed.view, sink) and not placed.sides[1].any()


def in_clusters(placed: Placed, sink: Sink) -> bool:
    """Tell whether a scene is drawn in clusters: these can be drawn, and that pays."""
    if not can_cluster(placed, sink):
        return False
    if placed.pays_in_clusters is None:
        placed.pays_in_clusters = pays_in_clusters(placed)
    return placed.pays_in_clusters


def pays_in_clusters(placed: Placed) -> bool:
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
    layers = partial(count_layers, scene, placed.clip_from_world)
    pays = choices.pays_to_draw_instances(placed.view, n_instances, n // n_instances, survey, layers)
    scene.backoff.note(pays=pays)
    return pays


def survey_instances(placed: Placed) -> Survey:
    """Return the survey of a scene's clusters, by some of its instances."""
    some = range(0, len(placed.scene), -(-len(placed.scene) // SURVEYED_INSTANCES))
    weights = [placed.scene[i].mesh.triangles.shape[0] for i in some]
    surveys = [placed.clustered(i).survey(SURVEYED_OF_EACH) for i in some]
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


def draw_clusters(
    placed: Placed, order: NDArray[np.intp], target: SampleTarget, memories: Sequence[Memory], *, is_first: bool
) -> bool:
    """Draw a sample in clusters, in memory of each thread; returns as `draw_clustered` does.

    In rounds, each of which leaves out instances that lie outside, between samples, or behind earlier rounds.
    """
    keeps_order = Sink(target.target.sink) in (Sink.NEAREST, Sink.FARTHEST)
    order = find_shown(placed, order, [target], is_drawn=keeps_order and not is_first)
    n = ROUND * len(memories) if keeps_order else len(order)
    for first in range(0, len(order), n):
        some = order[first : first + n]
        if first:
            some = find_shown(placed, some, [target], is_drawn=True)
        ends = {"is_first": is_first and first == 0, "is_last": first + n >= len(order)}
        if len(some) and not draw_round(placed, some, target, memories, **ends):
            return False
    return True


def draw_round(
    placed: Placed, some: NDArray[np.intp], target: SampleTarget, memories: Sequence[Memory], **ends: bool
) -> bool:
    """Draw a sample of some instances, each thread the instances in its rows; returns as `draw_clustered` does."""
    tops = split_rows(placed, some, len(memories))

    def own(first: int, end: int) -> list[int]:
        in_rows = some if len(tops) == 2 else find_shown(placed, some, [target], (first, end), is_drawn=False)
        return in_rows.tolist()

    return draw_clustered(memories, tops, own, placed.clustered, target.target, target.at, **ends)


def split_rows(placed: Placed, some: NDArray[np.intp], n_most: int) -> list[int]:
    """Return the first rows of bands with about as many of some instances each, `n_most` at most, and the height.

    Instances of about one distance often lie in one band of equal bands. Small ones are left to one thread.
    """
    view = placed.view
    width, height = view.size
    n = min(height, n_most)
    if n == 1 or height * width > MOST_PIXELS_OF_PART:
        return equal_bands(height, n)
    boxes, matrices = placed.scene.boxes[some], placed.clip_from_objects[some][:, [1, 3]]
    low, high = boxes[:, None, :3], boxes[:, None, 3:]
    y, w = (0.5 * (matrices[:, :, :3] * (low + high)).sum(axis=2) + matrices[:, :, 3]).T
    w = np.where(w > 0, w, np.inf)
    reach = 0.5 * (np.abs(matrices[:, 0, :3]) * (high - low)[:, 0]).sum(axis=1)
    n_rows = float(np.mean(reach / w)) * view.viewport[1]
    if not choices.pays_to_share_instances(placed.scene.n_triangles // len(placed.scene), n_rows):
        return [0, height]
    rows = (1 - y / w) * (0.5 * view.viewport[1]) - view.origin[1]
    wished = np.quantile(rows, np.arange(1, n) / n).clip(0, height)
    tops = [0]
    for k, top in enumerate(wished.tolist(), 1):
        tops.append(min(max(int(top), tops[-1] + 1), height - n + k))
    return [*tops, height]
