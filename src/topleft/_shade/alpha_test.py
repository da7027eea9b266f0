"""Takes out of a visibility buffer what the textures of its triangles leave out: alpha test, holes, cut-outs.

Input: `Fragments` of a whole mesh, its materials. Output: the same buffers, drawn again: first the triangles without
holes, then the others, each tested pixel by pixel (or sample by sample), so what is behind a hole shows.

The test takes the opacity of the texture at the pixel, filtered as its colour is. Nothing is peeled and nothing needs
an order, however many holes lie behind each other; it costs a second pass over the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from topleft import _engine
from topleft._base.threads import run_parts, threads_for
from topleft._camera.camera import Camera
from topleft._model.material import Material
from topleft._model.mesh import Mesh, has_holes
from topleft._raster.fragments import Fragments
from topleft._shade.look import ShadingInputs

I32 = npt.NDArray[np.int32]
F32 = npt.NDArray[np.float32]


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

    def of_parts(self, source: npt.NDArray[np.int64]) -> Cut:
        """The same of parts of triangles."""
        return Cut(self.materials, None if self.rows is None else self.rows[source], self.is_cut[source])


def cut_of(mesh: Mesh, material: Material | None = None) -> Cut | None:
    """What the materials of a mesh, or this one, cut out of it; None if nothing."""
    materials = mesh.materials if material is None else (material,)
    holes = [has_holes(one, mesh) for one in materials]
    if not any(holes):
        return None
    with_holes = np.array(holes)
    rows = mesh.material_of_triangle if material is None and len(materials) > 1 else None
    return Cut(materials, rows, np.full(len(mesh.triangles), True) if rows is None else with_holes[rows])


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
    n_threads = threads_for(threads, len(mesh.triangles))
    samples, _ = frags._sampled()
    for sample in samples or (frags,):
        cut_sample(sample, mesh, camera, cut, n_threads)


def cut_sample(sample: Fragments, mesh: Mesh, camera: Camera, cut: Cut, n_threads: int) -> None:
    """Draw the buffers of one sample anew: triangles without holes, then the others."""
    triangles = cut.triangles
    opaque = np.append(np.flatnonzero(~cut.is_cut), 0).astype(np.int32)  # one more than is drawn
    scene = sample._snapped_with(np.arange(len(mesh.triangles), dtype=np.int32))  # all are drawn anew
    ids, depth = sample.triangle, sample.depth
    inputs = inputs_of(scene, mesh, camera, ids.shape[::-1], cut)

    def cut_rows(first: int, end: int) -> None:
        _engine.cut_out(scene, inputs.shading, opaque, triangles, ids, depth, first, end - first)

    run_parts(cut_rows, len(ids), n_threads)


def draw_cut(
    scene: _engine.SnappedMesh,
    mesh: Mesh,
    camera: Camera,
    cut: Cut,
    ids: I32,
    depth: F32,
    *,
    is_peeled: bool,
    n_threads: int,
) -> None:
    """Draw the triangles with holes over the planes of a visibility buffer (1, H, W), or of layers (K, H, W)."""
    triangles = cut.triangles
    inputs = inputs_of(scene, mesh, camera, ids.shape[:0:-1], cut)

    def draw_rows(first: int, end: int) -> None:
        _engine.cut_out_over(scene, inputs.shading, triangles, ids, depth, is_peeled, first, end - first)

    run_parts(draw_rows, ids.shape[1], n_threads)


def inputs_of(scene: _engine.SnappedMesh, mesh: Mesh, camera: Camera, size: tuple[int, ...], cut: Cut) -> ShadingInputs:
    """What the kernel reads of materials with holes."""
    if scene.exact is not None:
        raise ValueError("subpixel_bits must be in 0..16 where textures cut holes, got 'exact'")
    inputs = ShadingInputs(scene, mesh, camera, (size[0], size[1]), cut.rows, is_flat=False)
    inputs.set_materials(mesh, cut.materials, is_unlit=True)
    inputs.set_view(0, None, (0, 0, 0, 0))
    return inputs
