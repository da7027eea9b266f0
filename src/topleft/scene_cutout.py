"""Cut-outs of scenes: what lies behind a hole may belong to another instance.

Input: buffers or layers of a `Scene`, materials of its meshes. Output: the same without what those cut out: first all
triangles without holes are drawn again, then, instance by instance, the others, as in `cutout`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft.camera import Camera
from topleft.cutout import Cut, cut_of, draw_cut
from topleft.fragments import Fragments
from topleft.material import Material
from topleft.models import Sink
from topleft.scene import Instance, Scene
from topleft.scene_fragments import Placed, SceneFragments
from topleft.scene_render import camera_of
from topleft.threads import count_threads, parse_threads

__all__ = ["cut_out_scene", "cuts_of", "draw_cuts", "solid_scene"]


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
    camera: Camera,
    cuts: Sequence[Cut | None],
    ids: npt.NDArray[np.int32],
    depth: npt.NDArray[np.float32],
    *,
    at: tuple[int, int] = (0, 0),
    is_peeled: bool = False,
    threads: int | None = None,
) -> None:
    """Draw the triangles with holes over the planes of what one sample sees (1, H, W), or over layers (K, H, W)."""
    for i, cut in enumerate(cuts):
        if cut is not None:
            instance = placed.scene[i]
            scene = placed.snap(i).scene.seen_from(*at)
            n_threads = count_threads(parse_threads(threads), len(instance.mesh.triangles))
            own = camera_of(camera, instance)
            draw_cut(scene, instance.mesh, own, cut, ids, depth, is_peeled=is_peeled, n_threads=n_threads)


def cut_out_scene(
    frags: Fragments, scene: Scene, camera: Camera, material: Material | None = None, *, threads: int | None = None
) -> None:
    """Take out of the buffers of `rasterize_mesh` what materials cut out; changes `frags` in place.

    Parameters
    ----------
    frags : SceneFragments
        Those of the scene.
    scene, camera, material, threads
        As for `topleft.cutout.cut_out`.
    """
    cuts = cuts_of(scene, material)
    if not any(cuts) or not isinstance(frags, SceneFragments) or 0 in frags.id.shape:
        return
    placed, positions, (ids, depth) = frags.placed, frags.positions, frags.planes
    targets = [_engine.Target(Sink.NEAREST, *planes, None) for planes in zip(ids, depth, strict=True)]
    placed.of(solid_scene(scene, cuts)).draw(targets, positions, ids.shape[1])
    for k, at in enumerate(positions):
        draw_cuts(placed, camera, cuts, ids[k : k + 1], depth[k : k + 1], at=at, threads=threads)
    frags.forget()
