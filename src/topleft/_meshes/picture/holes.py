"""Takes out the holes of materials, so that surfaces behind a hole show, of whatever instance: alpha test.

Input: a `Shot`, materials. Output: its buffers or layers without holes: first all triangles without holes are drawn,
then, instance by instance, the others, each tested pixel by pixel (or sample by sample).

The test takes the opacity of the texture at the pixel, filtered as its colour is. Nothing is peeled and nothing needs
an order, however many holes lie behind each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from topleft._core import engine
from topleft._core.base.array_types import F32, I32
from topleft._core.base.cached import cached_property
from topleft._core.base.memory import Memory
from topleft._core.base.threads import run_parts, threads_for
from topleft._core.raster.fragments import Fragments
from topleft._core.raster.verbs import Rasterizer
from topleft._meshes.camera.camera import Camera
from topleft._meshes.model.material import Material
from topleft._meshes.model.mesh import Mesh, has_holes
from topleft._meshes.picture.bend import BentMesh
from topleft._meshes.picture.draw_scene import draw_ids
from topleft._meshes.picture.look import ShadingInputs, Surface
from topleft._meshes.picture.placed import Mask, Placed
from topleft._meshes.picture.shot import Shot
from topleft._meshes.scene.scene import Scene, collapsed


@dataclass(frozen=True, eq=False)
class Cut:
    """Materials of a mesh, and which triangles have holes in theirs."""

    materials: Sequence[Material]
    rows: I32 | None
    is_cut: Mask

    @cached_property
    def surface(self) -> Surface:
        """The materials, without light."""
        return Surface(self.materials, self.rows is not None, is_unlit=True)

    @property
    def triangles(self) -> I32:
        """The triangles with holes."""
        return np.flatnonzero(self.is_cut).astype(np.int32)

    def of_parts(self, source: I32) -> Cut:
        """The cut materials of parts of triangles, from the triangle of each part."""
        return Cut(self.materials, None if self.rows is None else self.rows[source], self.is_cut[source])


class MaskedInstance(NamedTuple):
    """An instance with holes: its index, its mesh as it is drawn, the camera in its space, and its cut materials."""

    i: int
    mesh: Mesh
    camera: Camera
    cut: Cut


def cut_of(mesh: Mesh, material: Material | None = None) -> Cut | None:
    """The materials with holes of a mesh, or this material, and their triangles, kept; None if there are none."""
    return mesh.cache.cuts.find(material, lambda: find_cut(mesh, material))


def find_cut(mesh: Mesh, material: Material | None) -> Cut | None:
    """Find the materials with holes of a mesh, or this material, and their triangles; None if there are none."""
    materials = mesh.materials if material is None else (material,)
    holes = [has_holes(one, mesh) for one in materials]
    if not any(holes):
        return None
    with_holes = np.array(holes)
    rows = mesh.material_of_triangle if material is None and len(materials) > 1 else None
    return Cut(materials, rows, np.full(len(mesh.triangles), True) if rows is None else with_holes[rows])


def cuts_of(scene: Scene, material: Material | None) -> list[Cut | None]:
    """The materials with holes, or this material, of the mesh of each instance."""

    def make() -> list[Cut | None]:
        return [cut_of(one.mesh, one.material if material is None else material) for one in scene]

    return scene.cache.cuts.find(material, make)


def draw_visible(
    shot: Shot, rasterizer: Rasterizer | None = None, material: Material | None = None, **options: Any
) -> Fragments:
    """The visibility buffer without the holes of materials, or of this material; options as for a `View`."""
    with shot.memory(rasterizer) as memory:
        return draw_solid(memory, Placed.parse(shot, options, material), cuts_of(shot.scene, material))


def draw_solid(
    memory: Memory, placed: Placed, cuts: Sequence[Cut | None], masks: Sequence[Mask | None] | None = None
) -> Fragments:
    """The visibility buffer of a placed scene without holes, and without the triangles of masks.

    First all triangles without holes are drawn, then, instance by instance, the others.
    """
    if masks is None and not any(cuts):
        return draw_ids(memory, placed)
    way = "with holes in its materials" if masks is None else "that something shows through"
    placed.whole.check_counted(f"a scene {way}")
    holed = holed_instances(placed.whole, cuts, placed.camera, placed.bent)
    solid = draw_ids(memory, placed.with_scene(solid_scene(placed.scene, holed, masks)))
    ids, depth = cast("tuple[I32, F32]", solid.drawn_planes)
    for k, at in enumerate(placed.positions if ids.size and holed else ()):
        cut = np.full_like(ids[k : k + 1], -1)  # apart: at equal depth they hide the others, whatever the index
        draw_holed(placed, holed, cut, depth[k : k + 1], at=at, threads=placed.view.threads)
        np.copyto(ids[k : k + 1], cut, where=cut >= 0)
    return placed.fragments(ids, depth)


def holed_instances(
    scene: Scene, cuts: Sequence[Cut | None], camera: Camera, bent: Sequence[BentMesh] | None = None
) -> list[MaskedInstance]:
    """The instances with holes, and how they are drawn."""
    found = []
    for i, (instance, cut) in enumerate(zip(scene, cuts, strict=True)):
        mesh = instance.mesh
        if cut is not None:
            if bent is not None:
                cut, mesh = cut.of_parts(bent[i].source), bent[i].mesh_of(mesh)
            found.append(MaskedInstance(i, mesh, camera.straightened().placed(instance.transform), cut))
    return found


def solid_scene(scene: Scene, holed: Sequence[MaskedInstance], masks: Sequence[Mask | None] | None = None) -> Scene:
    """The scene without triangles that have holes or that masks name; ids stay."""
    gone: list[Mask | None] = [None] * len(scene) if masks is None else list(masks)
    for i, _, _, cut in holed:
        gone[i] = cut.is_cut if (mask := gone[i]) is None else mask | cut.is_cut
    return collapsed(scene, gone)


def inputs_of(scene: engine.SnappedMesh, mesh: Mesh, camera: Camera, size: tuple[int, ...], cut: Cut) -> ShadingInputs:
    """The kernel's inputs of materials with holes."""
    finds_inverse_w = len(mesh.vertices) > size[0] * size[1]
    shown, places = [(scene, mesh, cut.surface)], np.eye(4)[None]
    inputs = ShadingInputs(shown, camera, places, (size[0], size[1]), finds_inverse_w=finds_inverse_w)
    inputs.set_picture(0, None, (0, 0, 0, 0))
    return inputs


def draw_holed(
    placed: Placed,
    holed: Sequence[MaskedInstance],
    ids: I32,
    depth: F32,
    *,
    at: tuple[int, int] = (0, 0),
    is_peeled: bool = False,
    threads: int | None = None,
) -> None:
    """Draw the triangles with holes over the planes of one sample (1, H, W), or over layers (K, H, W)."""

    def draw(i: int, mesh: Mesh, camera: Camera, cut: Cut) -> None:
        snapped = placed.snap(i).at_sample(*at)
        inputs = inputs_of(snapped, mesh, camera, ids.shape[:0:-1], cut)
        given = snapped, inputs.tables[0], cut.triangles, ids, depth, is_peeled
        n_threads = threads_for(threads, len(mesh.triangles))
        run_parts(lambda first, end: engine.cut_out(*given, first, end - first), ids.shape[1], n_threads)

    for one in holed:
        draw(*one)
