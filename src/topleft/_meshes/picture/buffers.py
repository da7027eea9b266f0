"""Draws the buffers of a shot: ids and depth of the nearest surfaces, those behind them, masks.

In: a `Shot`, the options of a verb.  Out: `Fragments`, `DepthLayers`, or a mask.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.arrays import INT32_MAX, shown
from topleft._core.base.memory import FRESH, SCRATCH, Memory, check_fits, empty
from topleft._core.base.options import Sampling, Sink
from topleft._core.base.threads import count_threads
from topleft._core.raster import choices
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.peel import DepthLayers, check_peel, draw_layers_of, peel_meshes
from topleft._core.raster.rasterize import Canvas, FragmentOptions, draw_coverage, draw_fragments, refuse_many
from topleft._core.raster.sampling import sample_positions, sum_areas
from topleft._core.raster.static_mesh import draw_static
from topleft._core.raster.verbs import Rasterizer
from topleft._core.raster.view import View, ViewOptions
from topleft._meshes.model.material import Material
from topleft._meshes.picture.fragments import SceneDepthLayers, SceneFragments
from topleft._meshes.picture.instances import PlacedScene, scene_through
from topleft._meshes.picture.shot import Shot
from topleft.typing import DepthTestOption


def place(
    shot: Shot, options: dict[str, Any], *, with_depth: bool = True, material: Material | None = None
) -> tuple[PlacedScene, View]:
    """Return the scene as the camera sees it, and the checked options of a verb; `material` goes before the meshes'."""
    view = View.parse(shot.size, cast(ViewOptions, options))
    if with_depth:
        view.refuse_classic("depth")
        refuse_many(view, "rasterize")
    drawn = scene_through(shot.scene, shot.camera, view.viewport, near_clip=view.near_clip)
    return PlacedScene(drawn, view, with_depth=with_depth, material=material, is_mesh=shot.is_mesh), view


def rasterize_shot(
    shot: Shot,
    rasterizer: Rasterizer | None = None,
    material: Material | None = None,
    *,
    depth_test: DepthTestOption | None = "less",
    background_depth: float | None = None,
    is_split: bool = True,
    **options: Any,
) -> Fragments:
    """Return the visibility buffer of a shot; options as those of `rasterize`, without `transform`.

    `material`: tells whether backs are culled, instead of those of the meshes. `rasterizer` and `out`: for a mesh
    alone, as `is_split` of `View`.
    """
    if not shot.is_mesh:
        return draw_nearest(*place(shot, options, material=material), depth_test, background_depth, is_split=is_split)
    out = options.pop("out", None)
    with lent(rasterizer, shot.size) as memory:
        placed, view = place(shot, options, material=material)
        drawn = draw_one(memory, placed, depth_test, background_depth, out, is_split=is_split)
    return drawn if placed.bent is None else placed.fragments_of(drawn, view)


def lent(rasterizer: Rasterizer | None, size: tuple[int, int]) -> AbstractContextManager[Memory]:
    """Give the memory of a `Rasterizer` of this size, which draws nothing else meanwhile, or fresh memory."""
    if rasterizer is None:  # fragments refer to their inputs, so their memory cannot be reused
        return nullcontext(FRESH)
    if not isinstance(rasterizer, Rasterizer):
        raise TypeError(f"rasterizer must be a Rasterizer or None, got {shown(rasterizer)}")
    if rasterizer.size != size:
        raise ValueError(f"rasterizer must have the size {size}, got {rasterizer.size}")
    return rasterizer._lent


def draw_one(
    memory: Memory,
    placed: PlacedScene,
    depth_test: DepthTestOption | None,
    background_depth: float | None,
    out: Any = None,
    *,
    is_split: bool = False,
) -> Fragments:
    """Return the visibility buffer of the only instance; `is_split` as in `View`."""
    mesh, view = placed.scene[0].mesh, placed.view_of(0)
    view = view.but(is_split=True) if is_split and view.sampling.n_samples > 1 else view
    if view.static is not None:
        return draw_static(memory, view.static, view, depth_test, background_depth, out)
    return draw_fragments(memory, mesh.vertices, mesh.triangles, view, depth_test, background_depth, out)


def draw_nearest(
    placed: PlacedScene,
    view: View,
    depth_test: DepthTestOption | None = "less",
    background_depth: float | None = None,
    *,
    is_split: bool = False,
    memory: Memory = FRESH,
) -> SceneFragments:
    """Return the visibility buffer of a placed scene; `is_split` as in `View`, and `memory`: of one instance."""
    if len(placed.scene) == 1:
        return placed.fragments_of(draw_one(memory, placed, depth_test, background_depth, is_split=is_split), view)
    (width, height), positions = view.size, placed.positions(view)
    n = len(positions)
    options = FragmentOptions.parse(depth_test, background_depth, None)
    sink = choices.fragment_sink(options.test, has_depth=True)
    check_fits((n, height, width), np.int32, np.float32)
    found = placed.draw_split(sink, options.background) if is_split else None
    if found is not None:
        return found
    ids: NDArray[np.int32] = FRESH.empty("ids", (n, height, width), np.int32)
    depth: NDArray[np.float32] = FRESH.empty("depth", (n, height, width), np.float32)
    targets = [engine.Target(sink, *planes, None) for planes in zip(ids, depth, strict=True) if width and height]
    if placed.scene.n_triangles > INT32_MAX:
        frags = SceneFragments(draw_groups(placed, targets, positions, ids), depth, placed, positions)
    else:
        if targets:
            placed.draw(targets, positions, height)
        frags = SceneFragments(ids, depth, placed, positions)
    if background_depth is not None:
        depth[frags.drawn_planes[0] < 0] = background_depth
    return frags


def draw_groups(
    placed: PlacedScene, targets: list[engine.Target], positions: Sequence[tuple[int, int]], ids: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Draw a scene with more triangles than int32 counts; returns ids in int64, -1 where there is nothing.

    One group after the other into the planes `ids` of the targets, where 0 stands for triangles of earlier groups:
    it is less than all other ids, so that ties are decided as in one picture.
    """
    counted: NDArray[np.int64] = np.full(ids.shape, -1, np.int64)
    if targets:
        for k, (first, group) in enumerate(placed.groups()):
            group.draw(targets, positions, ids.shape[1], is_first=k == 0)
            is_new = ids > 0
            np.add(ids, first - 1, out=counted, where=is_new, dtype=np.int64)
            ids[is_new] = 0
    return counted


def peel_shot(
    shot: Shot,
    *,
    layers: int = 4,
    depth_test: DepthTestOption = "less",
    material: Material | None = None,
    **options: Any,
) -> DepthLayers:
    """Return the nearest layers of a shot; options as those of `peel`, without `transform`."""
    shot.scene.check_counted("a scene that is peeled")
    placed, view = place(shot, options, material=material)
    if shot.is_mesh:
        mesh = shot.scene[0].mesh
        return draw_layers_of(mesh.vertices, mesh.triangles, placed.view_of(0), layers, depth_test)
    n, is_farthest = check_peel(view, layers, depth_test)
    return SceneDepthLayers(*peel_meshes(SCRATCH, placed.meshes(), view, n, is_farthest=is_farthest), placed)


def cover_shot(shot: Shot, out: object, **options: Any) -> NDArray[Any]:
    """Return the mask of a shot; options as those of `coverage`, without `transform`."""
    placed, view = place(shot, options, with_depth=False)
    if len(placed.scene) == 1:
        mesh = placed.scene[0].mesh
        return draw_coverage(SCRATCH, mesh.vertices, mesh.triangles, placed.view_of(0), out)
    view.refuse_classic("a scene")
    width, height = view.size
    n = view.sampling.n_samples
    is_share = n > 1 or view.sampling is Sampling.AREA
    with Canvas.of(FRESH, "coverage", out, (height, width), np.float32 if is_share else np.bool_) as (result, canvas):
        if not (width and height):
            pass
        elif view.sampling is Sampling.AREA:
            add_areas(placed, view, canvas)
        elif n > 1 and view.is_exact:
            add_masks(placed, view, canvas)
        else:
            samples = sample_positions(n, view.grid_bits) if n > 1 else None
            shape = engine.Target.covered_shape(height, width, n)
            sink = Sink.SAMPLES if n > 1 else Sink.MASK
            target = engine.Target(sink, canvas, None, SCRATCH.scratch("covered", shape, np.uint64), samples)
            placed.draw([target], [(0, 0)], height)
    return result


def add_masks(placed: PlacedScene, view: View, canvas: NDArray[np.float32]) -> None:
    """Write the share of samples that the instances cover, from a mask of each sample."""
    n, (width, height) = view.sampling.n_samples, view.size
    mask: NDArray[np.bool_] = SCRATCH.scratch("sample mask", (height, width), np.bool_)
    covered = SCRATCH.scratch("covered", engine.Target.covered_shape(height, width, 1), np.uint64)
    canvas[...] = 0
    for x, y in sample_positions(n, view.grid_bits).tolist():
        placed.draw([engine.Target(Sink.MASK, mask, None, covered)], [(x, y)], height)
        np.add(canvas, 1.0 / n, out=canvas, where=mask)  # exact: n is a power of two


def add_areas(placed: PlacedScene, view: View, canvas: NDArray[np.float32]) -> None:
    """Write the sum of the areas that the instances cover, at most 1."""
    canvas[...] = 0
    own = empty(canvas.shape, np.float32)
    for chunk in placed.chunks():
        for mesh in chunk:
            n_threads = count_threads(view.threads, mesh.n_triangles)
            sum_areas(SCRATCH, mesh, own, n_threads, is_clamped=True)
            canvas += own
    np.minimum(canvas, 1, out=canvas)
