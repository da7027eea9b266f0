"""Takes out what materials cut out, so that what lies behind a hole shows, whatever instance it belongs to: alpha test.

Input: buffers or layers of a `Mesh` or `Scene`, materials. Output: the same without holes: first all triangles without
holes are drawn again, then, instance by instance, the others, each tested pixel by pixel (or sample by sample).

The test takes the opacity of the texture at the pixel, filtered as its colour is. Nothing is peeled and nothing needs
an order, however many holes lie behind each other; it costs a second pass over the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
import numpy.typing as npt

from topleft._core import engine
from topleft._core.base.array_types import F32, I32
from topleft._core.base.options import Sink
from topleft._core.base.threads import run_parts, threads_for
from topleft._core.raster.fragments import Fragments
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh, has_holes
from topleft._meshes.picture.bend import BentMesh
from topleft._meshes.picture.fragments import BentFragments, SceneFragments
from topleft._meshes.picture.instances import PlacedScene
from topleft._meshes.picture.look import ShadingInputs, Surface
from topleft._meshes.scene.scene import Scene, collapsed


@dataclass(frozen=True, eq=False)
class Cut:
    """Materials of a mesh, and which triangles have holes in theirs."""

    materials: Sequence[Material]
    rows: I32 | None
    is_cut: npt.NDArray[np.bool_]

    @property
    def triangles(self) -> I32:
        """Those with holes."""
        return np.flatnonzero(self.is_cut).astype(np.int32)

    def of_parts(self, source: I32) -> Cut:
        """The same of parts of triangles."""
        return Cut(self.materials, None if self.rows is None else self.rows[source], self.is_cut[source])


class Holed(NamedTuple):
    """An instance with holes: its index, its mesh as it is drawn, the camera in its space, and what is cut out."""

    i: int
    mesh: Mesh
    camera: Camera
    cut: Cut


def cut_of(mesh: Mesh, material: Material | None = None) -> Cut | None:
    """What the materials of a mesh, or this one, cut out of it; None if nothing."""
    materials = mesh.materials if material is None else (material,)
    holes = [has_holes(one, mesh) for one in materials]
    if not any(holes):
        return None
    with_holes = np.array(holes)
    rows = mesh.material_of_triangle if material is None and len(materials) > 1 else None
    return Cut(materials, rows, np.full(len(mesh.triangles), True) if rows is None else with_holes[rows])


def cuts_of(scene: Scene, material: Material | None) -> list[Cut | None]:
    """What materials, or this one, cut out of the mesh of each instance."""
    return [cut_of(one.mesh, one.material if material is None else material) for one in scene]


def without_holes(
    frags: Fragments, scene: Scene, camera: Camera, material: Material | None, *, threads: int | None = None
) -> Fragments:
    """The visibility buffer without what materials (or this one) cut out; `frags` is changed."""
    cuts = cuts_of(scene, material)
    if 0 in frags.id.shape or not any(cuts):
        return frags
    bent: Sequence[BentMesh] | None = [frags.bent] if isinstance(frags, BentFragments) else None
    if isinstance(frags, SceneFragments):
        frags.whole.check_counted("a scene with holes in its materials")
        bent = frags.placed.bent
    holed = holed_instances(scene, cuts, camera, bent)
    if isinstance(frags, SceneFragments):
        return cut_scene(frags, holed, threads)
    drawn = frags.drawn if isinstance(frags, BentFragments) else frags
    cut_out(drawn, *holed[0][1:], threads=threads)
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
    placed, positions, (_, depth) = frags.placed, frags.positions, frags.drawn_planes
    ids = cast("I32", frags.drawn_planes[0])  # as `without_holes` has checked
    targets = [engine.Target(Sink.NEAREST, *planes, None) for planes in zip(ids, depth, strict=True)]
    placed.of(solid_scene(placed.scene, holed)).draw(targets, positions, ids.shape[1])
    for k, at in enumerate(positions):
        draw_holed(placed, holed, ids[k : k + 1], depth[k : k + 1], at=at, threads=threads)
    return SceneFragments(ids, depth, placed, positions)


def cut_out(frags: Fragments, mesh: Mesh, camera: Camera, cut: Cut, *, threads: int | None = None) -> None:
    """Take out of the buffers of `rasterize` what materials cut out; changes `frags` in place.

    Parameters
    ----------
    frags : Fragments
        What `rasterize` returned for the mesh with `depth_test="less"`.
    mesh, camera
        As in `topleft.shade`.
    cut : Cut
        Of the mesh.
    threads : int, optional
        Never changes a bit.
    """
    samples, _ = frags._sampled()
    for sample in samples or (frags,):
        cut_sample(sample, mesh, camera, cut, threads)


def cut_sample(sample: Fragments, mesh: Mesh, camera: Camera, cut: Cut, threads: int | None) -> None:
    """Draw the buffers of one sample anew: triangles without holes, then the others."""
    triangles = cut.triangles
    opaque = np.append(np.flatnonzero(~cut.is_cut), 0).astype(np.int32)  # one more than is drawn
    scene = sample._snapped_with(np.arange(len(mesh.triangles), dtype=np.int32))  # all are drawn anew
    ids, depth = sample.triangle, sample.depth
    inputs = inputs_of(scene, mesh, camera, ids.shape[::-1], cut)

    def cut_rows(first: int, end: int) -> None:
        engine.cut_out(scene, inputs.shading, opaque, triangles, ids, depth, first, end - first)

    run_parts(cut_rows, len(ids), threads_for(threads, len(mesh.triangles)))


def inputs_of(scene: engine.SnappedMesh, mesh: Mesh, camera: Camera, size: tuple[int, ...], cut: Cut) -> ShadingInputs:
    """What the kernel reads of materials with holes."""
    finds_inverse_w = len(mesh.vertices) > size[0] * size[1]
    surface = Surface(cut.materials, cut.rows is not None, is_unlit=True)
    inputs = ShadingInputs(
        scene, mesh, camera, camera.view, (size[0], size[1]), surface, finds_inverse_w=finds_inverse_w
    )
    inputs.set_picture(0, None, (0, 0, 0, 0))
    return inputs


def draw_holed(
    placed: PlacedScene,
    holed: Sequence[Holed],
    ids: I32,
    depth: F32,
    *,
    at: tuple[int, int] = (0, 0),
    is_peeled: bool = False,
    threads: int | None = None,
) -> None:
    """Draw the triangles with holes over the planes of what one sample sees (1, H, W), or over layers (K, H, W)."""
    for i, mesh, camera, cut in holed:
        scene = placed.snap(i).at_sample(*at)
        draw_cut(scene, mesh, camera, cut, ids, depth, is_peeled=is_peeled, threads=threads)


def draw_cut(
    scene: engine.SnappedMesh,
    mesh: Mesh,
    camera: Camera,
    cut: Cut,
    ids: I32,
    depth: F32,
    *,
    is_peeled: bool,
    threads: int | None,
) -> None:
    """The same of one instance."""
    triangles = cut.triangles
    inputs = inputs_of(scene, mesh, camera, ids.shape[:0:-1], cut)

    def draw_rows(first: int, end: int) -> None:
        engine.cut_out_over(scene, inputs.shading, triangles, ids, depth, is_peeled, first, end - first)

    run_parts(draw_rows, ids.shape[1], threads_for(threads, len(mesh.triangles)))
