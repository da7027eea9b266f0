"""Cut-outs: a visibility buffer without what the textures of its triangles leave out.

Input: `Fragments` of a whole mesh, its materials. Output: the same buffers, drawn again: first the triangles without
holes, then the others, each tested pixel by pixel (or sample by sample), so what is behind a hole shows.

The test takes the opacity of the texture at the pixel, filtered as its colour is. Nothing is peeled and nothing needs
an order, however many holes lie behind each other; it costs a second pass over the mesh.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from topleft import _engine
from topleft.camera import Camera
from topleft.fragments import Fragments
from topleft.look import Look
from topleft.material import Material
from topleft.mesh import Mesh
from topleft.threads import count_threads, parse_threads, run_parts


def has_holes(material: Material, mesh: Mesh) -> bool:
    """Whether the material leaves something out of the triangles that have it."""
    texture = material.texture if mesh.uv is not None else None
    return bool(material.alpha_cutoff) and texture is not None and bool((texture.image[..., 3] < 255).any())


def cut_out(
    frags: Fragments, mesh: Mesh, camera: Camera, material: Material | None = None, *, threads: int | None = None
) -> None:
    """Take out of the buffers of `rasterize` what materials cut out; changes `frags` in place.

    Parameters
    ----------
    frags : Fragments
        What `rasterize` returned for the mesh with `depth_test="less"`.
    mesh, camera, material
        As in `topleft.shade.shade`.
    threads : int, optional
        Never changes a bit.
    """
    materials = mesh.materials if material is None else (material,)
    with_holes = np.array([has_holes(one, mesh) for one in materials], dtype=bool)
    if not with_holes.any() or 0 in frags.triangle.shape:
        return
    rows = mesh.material_of_triangle if material is None and len(materials) > 1 else None
    is_cut = np.full(len(mesh.triangles), True) if rows is None else with_holes[rows]
    cut = np.flatnonzero(is_cut).astype(np.int32)
    opaque = np.append(np.flatnonzero(~is_cut), 0).astype(np.int32)  # one more than is drawn
    n_threads = count_threads(parse_threads(threads), len(mesh.triangles))
    for k in range(frags.samples_triangle.shape[-1]):
        _cut_sample(frags.sample(k), mesh, camera, materials, rows, opaque, cut, n_threads)


def _cut_sample(
    frags: Fragments,
    mesh: Mesh,
    camera: Camera,
    materials: Sequence[Material],
    rows: np.ndarray[tuple[int, ...], np.dtype[np.int32]] | None,
    opaque: np.ndarray[tuple[int, ...], np.dtype[np.int32]],
    cut: np.ndarray[tuple[int, ...], np.dtype[np.int32]],
    n_threads: int,
) -> None:
    scene = frags._scene_with(cut)
    look = Look(scene, mesh, camera, frags.triangle.shape[::-1], rows, is_flat=False)
    look.set_materials(mesh, materials, is_unlit=True)
    look.set_view(0, None, (0, 0, 0, 0))

    def cut_rows(first: int, end: int) -> None:
        _engine.cut_out(scene, scene.view, look.shading, opaque, cut, frags.triangle, frags.depth, first, end - first)

    run_parts(cut_rows, len(frags.triangle), n_threads)
