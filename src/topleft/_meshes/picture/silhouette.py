"""Draws silhouettes: where a mesh or scene is, seen by a camera, as a mask.

Input: `Mesh` or `Scene`, `Camera`. Output: a mask (H, W), bool or float32.
"""

from __future__ import annotations

from itertools import chain
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from topleft._core import engine
from topleft._core.base.array_types import MeshLike
from topleft._core.base.arrays import as_out
from topleft._core.base.defaults import DEFAULT_SIZE
from topleft._core.base.memory import SCRATCH, empty
from topleft._core.base.options import Sampling, Sink
from topleft._core.base.threads import count_threads
from topleft._core.raster.rasterize import Canvas, draw_cover, draw_coverage
from topleft._core.raster.sampling import sample_positions, sum_areas
from topleft._core.raster.view import View, WindowOptions
from topleft._meshes.camera.camera import CameraLike
from topleft._meshes.model.points import Points
from topleft._meshes.picture.cloud import CloudShot
from topleft._meshes.picture.draw_scene import SampleTarget, draw_scene
from topleft._meshes.picture.placed import Placed
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Scene
from topleft.typing import CullOption, SamplingOption


def silhouette(
    mesh: MeshLike | Scene | Points,
    camera: CameraLike | None = None,
    size: int | tuple[int, int] = DEFAULT_SIZE,
    *,
    sampling: SamplingOption = "center",
    cull: CullOption | None = None,
    tolerance: float = 0.0,
    threads: int | None = None,
    out: npt.NDArray[Any] | None = None,
    **view: Unpack[WindowOptions],
) -> npt.NDArray[Any]:
    """Return the mask of the mesh or scene: where it is seen, or how much of each pixel it covers.

    Parameters
    ----------
    mesh : Mesh, Scene, Points, or whatever `as_mesh` takes
        The subject.
    camera : Camera, optional
        Unless given, the three-quarter view of `Camera.framing`, with y up.
    size : (width, height), pixels
        640 x 480 unless given.
    sampling : str
        As `coverage` takes it: "center" gives bool, "area" float32.
    cull : {"none", "back", "front"}, optional
        As for `render`: the side to leave out, whatever materials say.
    tolerance : float
        As for `render`: the largest error of the outline, pixels.
    threads : int, optional
        How many threads draw; never changes a bit.
    out : ndarray of bool (float32 for "area"), shape (H, W), optional
        Where the result goes.
    **view
        Other options of `coverage`, `origin=` for a window of a larger picture, say.

    Returns
    -------
    ndarray of bool or float32, shape (H, W)
        False or 0 where the mesh is not.

    Raises
    ------
    ValueError
        If the mesh has no triangles and no camera is given, or an option is unknown.

    Notes
    -----
    By samples the cover is the union of the triangles. By area it is the sum of their areas, at most 1: the union
    where triangles do not overlap within a pixel. They do not along the outline of a closed mesh with ``cull="back"``
    that each line of sight enters once; where one part of it hides another, a pixel of the inner outline is full.
    Without culling the far side counts as well, and a pixel on the outline gets up to twice its share. Areas of the
    instances of a scene are added up as float32, which is exact while the sum is below 1.

    Examples
    --------
    >>> import topleft as tl
    >>> mesh = tl.Mesh(*tl.scenes.shape("cube"))
    >>> int(tl.silhouette(mesh, size=(8, 6)).sum())
    17
    >>> round(float(tl.silhouette(mesh, size=(8, 6), sampling="area", cull="back").sum()), 2)
    16.2
    """
    shot = Shot.of(mesh, camera, size)
    if isinstance(shot, CloudShot):
        share = shot.share(sampling=sampling, cull=cull, threads=threads, **view)
        if out is None:
            return share
        result = as_out("out", out, share.shape, share.dtype.type)
        result[...] = share
        return result
    window: Any = {"viewport": view.get("viewport"), "origin": view.get("origin", (0, 0))}
    shot = shot.within(tolerance, cull=cull, **window)
    options: Any = {"sampling": sampling, "cull": cull, "threads": threads} | view
    return cover_shot(shot, out, **options)


def cover_shot(shot: Shot, out: object, **options: Any) -> NDArray[Any]:
    """The mask of a shot; options as for `coverage`, without `transform`."""
    placed = Placed.parse(shot, options, with_depth=False)
    view = placed.view
    if len(placed.scene) == 1:
        mesh = placed.scene[0].mesh
        return draw_coverage(SCRATCH, mesh.vertices, mesh.triangles, placed.view_of(0), out)
    view.refuse_classic("a scene")
    if view.sampling is Sampling.AREA:
        with Canvas.of(SCRATCH, "coverage area", out, view.size[::-1], np.float32) as (result, canvas):
            add_areas(placed, view, canvas)
        return result

    def draw_mask(sink: Sink, pixels: NDArray[Any], at: tuple[int, int]) -> None:
        n, (width, height) = view.sampling.n_samples if sink is Sink.SAMPLES else 1, view.size
        covered = SCRATCH.scratch("covered", engine.Target.covered_shape(height, width, n), np.uint64)
        samples = sample_positions(n, view.grid_bits) if n > 1 else None
        if pixels.size:
            draw_scene(placed, [SampleTarget(engine.Target(sink, pixels, None, covered, samples), at)])

    return draw_cover(SCRATCH, view, out, draw_mask)


def add_areas(placed: Placed, view: View, canvas: NDArray[np.float32]) -> None:
    """Write the sum of the areas that the instances cover, at most 1."""
    canvas[...] = 0
    areas = empty(canvas.shape, np.float32)
    for mesh in chain.from_iterable(placed.chunks() if canvas.size else ()):
        n_threads = count_threads(view.threads, mesh.n_triangles)
        sum_areas(SCRATCH, mesh, areas, n_threads, is_clamped=True)
        canvas += areas
    np.minimum(canvas, 1, out=canvas)
