"""Cut-outs of scenes: what lies behind a hole may belong to another instance.

Input: buffers or layers of a `Scene`, materials of its meshes. Output: the same without what those cut out: first all
triangles without holes are drawn again, then, instance by instance, the others, as in `cutout`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.options import Sink
from topleft._base.threads import count_threads, parse_threads
from topleft._camera.camera import Camera
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._model.scene import Instance, Scene
from topleft._raster.fragments import Fragments
from topleft._render.fragments import BentFragments, Placed, SceneFragments, mesh_of_parts
from topleft._render.scene_shade import camera_of
from topleft._render.through_lens import BentSceneFragments
from topleft._shade.alpha_test import Cut, cut_of, cut_out, draw_cut

__all__ = ["cut_out_scene", "cuts_of", "draw_cuts", "solid_scene", "surfaces_of", "without_holes"]


def cuts_of(scene: Scene, material: Material | None) -> list[Cut | None]:
    """What the materials of each instance, or this one, cut out of it."""
    return [cut_of(instance.mesh, material) for instance in scene]


def solid_scene(scene: Scene, cuts: Sequence[Cut | None]) -> Scene:
    """The scene without the triangles that have holes; ids stay."""
    return Scene(
        instance if cut is None else Instance(cut.solid(instance.mesh), instance.transform)
        for instance, cut in zip(scene, cuts, strict=True)
    )


def draw_cuts(
    placed: Placed,
    surfaces: Sequence[tuple[Mesh, Camera]],
    cuts: Sequence[Cut | None],
    ids: npt.NDArray[np.int32],
    depth: npt.NDArray[np.float32],
    *,
    at: tuple[int, int] = (0, 0),
    is_peeled: bool = False,
    threads: int | None = None,
) -> None:
    """Draw the triangles with holes over the planes of what one sample sees (1, H, W), or over layers (K, H, W)."""
    for i, (cut, (mesh, camera)) in enumerate(zip(cuts, surfaces, strict=True)):
        if cut is not None:
            scene = placed.snap(i).scene.seen_from(*at)
            n_threads = count_threads(parse_threads(threads), len(mesh.triangles))
            draw_cut(scene, mesh, camera, cut, ids, depth, is_peeled=is_peeled, n_threads=n_threads)


def surfaces_of(scene: Scene, camera: Camera) -> list[tuple[Mesh, Camera]]:
    """The mesh of each instance, and how the camera sees it."""
    return [(instance.mesh, camera_of(camera, instance)) for instance in scene]


def cut_out_scene(
    frags: Fragments, scene: Scene, camera: Camera, material: Material | None = None, *, threads: int | None = None
) -> Fragments:
    """The buffers of `rasterize_mesh` without what materials cut out; `frags` is changed.

    Parameters
    ----------
    frags : SceneFragments
        Those of the scene.
    scene, camera, material, threads
        As for `topleft.cutout.cut_out`.
    """
    cuts = cuts_of(scene, material)
    if not any(cuts) or not isinstance(frags, SceneFragments) or 0 in frags.id.shape:
        return frags
    surfaces = surfaces_of(scene, camera.straightened())
    if not isinstance(frags, BentSceneFragments):
        cut_planes(frags, surfaces, cuts, threads)
        return frags
    own: list[Cut | None] = []
    for i, (cut, bent) in enumerate(zip(cuts, frags.bent, strict=True)):
        if cut is not None:
            parts = mesh_of_parts(scene[i].mesh, bent.triangles, bent.source, bent.weights)
            surfaces[i] = parts, surfaces[i][1]
        own.append(cut and cut.of_parts(bent.source))
    cut_planes(frags.drawn, surfaces, own, threads)
    return frags.again()


def cut_planes(
    frags: SceneFragments,
    surfaces: Sequence[tuple[Mesh, Camera]],
    cuts: Sequence[Cut | None],
    threads: int | None,
) -> None:
    """Draw the planes of fragments anew, as their triangles were drawn."""
    placed, positions, (ids, depth) = frags.placed, frags.positions, frags.planes
    targets = [_engine.Target(Sink.NEAREST, *planes, None) for planes in zip(ids, depth, strict=True)]
    placed.of(solid_scene(placed.scene, cuts)).draw(targets, positions, ids.shape[1])
    for k, at in enumerate(positions):
        draw_cuts(placed, surfaces, cuts, ids[k : k + 1], depth[k : k + 1], at=at, threads=threads)
    frags.forget()


def without_holes(
    frags: Fragments, mesh: Mesh | Scene, camera: Camera, material: Material | None, *, threads: int | None = None
) -> Fragments:
    """The visibility buffer without what materials (or this one) cut out; `frags` is changed."""
    if isinstance(mesh, Scene):
        return cut_out_scene(frags, mesh, camera, material, threads=threads)
    if not isinstance(frags, BentFragments):
        cut_out(frags, mesh, camera, material, threads=threads)
        return frags
    if cut_of(mesh, material) is None:
        return frags
    cut_out(frags.parts, frags.mesh_of_parts(mesh), camera.straightened(), material, threads=threads)
    return frags.again()
