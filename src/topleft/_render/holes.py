"""Takes out what materials cut out, so that what lies behind a hole shows, whatever instance it belongs to.

Input: buffers or layers of a `Mesh` or `Scene`, materials. Output: the same without holes: first all triangles without
holes are drawn again, then, instance by instance, the others, as in `alpha_test`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.options import Sink
from topleft._base.threads import threads_for
from topleft._camera.camera import Camera
from topleft._model.material import Material
from topleft._model.mesh import Mesh
from topleft._raster.fragments import Fragments
from topleft._render.bend import BentMesh
from topleft._render.fragments import BentFragments, SceneFragments
from topleft._render.instances import PlacedScene
from topleft._scene.scene import Scene, collapsed, meshes_of, scene_of
from topleft._shade.alpha_test import Cut, cut_of, cut_out, draw_cut

__all__ = ["Holed", "cut_scene", "cuts_of", "draw_holed", "holed_instances", "solid_scene", "without_holes"]


class Holed(NamedTuple):
    """An instance with holes: its index, its mesh as it is drawn, the camera in its space, and what is cut out."""

    i: int
    mesh: Mesh
    camera: Camera
    cut: Cut


def cuts_of(subject: Mesh | Scene, material: Material | None) -> list[Cut | None]:
    """What materials, or this one, cut out of the mesh of each instance."""
    return [cut_of(mesh, material) for mesh in meshes_of(subject)]


def without_holes(
    frags: Fragments, subject: Mesh | Scene, camera: Camera, material: Material | None, *, threads: int | None = None
) -> Fragments:
    """The visibility buffer without what materials (or this one) cut out; `frags` is changed."""
    cuts = cuts_of(subject, material)
    if 0 in frags.id.shape or not any(cuts):
        return frags
    if isinstance(frags, SceneFragments):
        return cut_scene(frags, holed_instances(scene_of(subject), cuts, camera, frags.placed.bent), threads)
    drawn, bent = (frags.drawn, [frags.bent]) if isinstance(frags, BentFragments) else (frags, None)
    (holed,) = holed_instances(scene_of(subject), cuts, camera, bent)
    cut_out(drawn, holed.mesh, holed.camera, holed.cut, threads=threads)
    return frags.again() if isinstance(frags, BentFragments) else frags


def holed_instances(
    scene: Scene, cuts: Sequence[Cut | None], camera: Camera, bent: Sequence[BentMesh] | None = None
) -> list[Holed]:
    """The instances that something is cut out of, and how they are drawn."""
    found = []
    for i, (instance, cut) in enumerate(zip(scene, cuts, strict=True)):
        mesh = instance.mesh
        if cut is not None:
            if bent is not None:
                cut, mesh = cut.of_parts(bent[i].source), bent[i].mesh_of(mesh)
            found.append(Holed(i, mesh, camera.straightened().placed(instance.transform), cut))
    return found


def solid_scene(scene: Scene, holed: Sequence[Holed]) -> Scene:
    """The scene without the triangles that have holes; ids stay."""
    cuts = {one.i: one.cut.is_cut for one in holed}
    return collapsed(scene, [cuts.get(i) for i in range(len(scene))])


def cut_scene(frags: SceneFragments, holed: Sequence[Holed], threads: int | None) -> SceneFragments:
    """Draw the planes of fragments anew, as their triangles were drawn, and return fragments of them."""
    placed, positions, (ids, depth) = frags.placed, frags.positions, frags.drawn_planes
    targets = [_engine.Target(Sink.NEAREST, *planes, None) for planes in zip(ids, depth, strict=True)]
    placed.of(solid_scene(placed.scene, holed)).draw(targets, positions, ids.shape[1])
    for k, at in enumerate(positions):
        draw_holed(placed, holed, ids[k : k + 1], depth[k : k + 1], at=at, threads=threads)
    return SceneFragments(ids, depth, placed, positions)


def draw_holed(
    placed: PlacedScene,
    holed: Sequence[Holed],
    ids: npt.NDArray[np.int32],
    depth: npt.NDArray[np.float32],
    *,
    at: tuple[int, int] = (0, 0),
    is_peeled: bool = False,
    threads: int | None = None,
) -> None:
    """Draw the triangles with holes over the planes of what one sample sees (1, H, W), or over layers (K, H, W)."""
    for i, mesh, camera, cut in holed:
        scene = placed.snap(i).mesh.seen_from(*at)
        n_threads = threads_for(threads, len(mesh.triangles))
        draw_cut(scene, mesh, camera, cut, ids, depth, is_peeled=is_peeled, n_threads=n_threads)
